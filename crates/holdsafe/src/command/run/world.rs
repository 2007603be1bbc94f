//! `--world FAMILY[:SEED]`: drawn worlds by the name of their family.

use runner::plan::Worlds;
use scenario::world::Family;

/// A family, and the seed of one world of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Named {
    family: Family,
    seed: Option<u64>,
}

impl Named {
    /// The world that is named, or a given number of the family from `first` on.
    pub(super) fn worlds(self, first: u64, number: u64) -> Worlds {
        let (first, number) = self.seed.map_or((first, number), |seed| (seed, 1));
        Worlds { family: self.family, seeds: first..first.saturating_add(number) }
    }
}

/// Reads `FAMILY` or `FAMILY:SEED`.
pub(super) fn named(text: &str) -> Result<Named, String> {
    let (name, seed) = text.split_once(':').map_or((text, None), |(name, seed)| (name, Some(seed)));
    let families = || Family::ALL.map(Family::name).join(", ");
    let family = Family::from_name(name).ok_or_else(|| format!("no family `{name}`; there are: {}", families()))?;
    let seed = seed.map(|seed| seed.parse().map_err(|_| format!("`{seed}` is no seed; a whole number is expected")));
    Ok(Named { family, seed: seed.transpose()? })
}
