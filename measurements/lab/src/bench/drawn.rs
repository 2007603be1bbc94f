//! The attack sequences of `lab agreement`: drawn by a seed, each as a file that `holdsafe run` takes, in the twin and
//! live.
//!
//! A sequence depends on the seed of the drawing, its stratum and its number, not on the sequences before it, so that
//! they are drawn on any number of threads and a drawing resumes after an interruption.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use evidence::log::hex;
use evidence::trial::Outcome;
use parallel::progress::Progress;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use runner::failure::{Exit, Failure};
use runner::lines::Lines;
use runner::plan::{PlanOptions, Planned};
use runner::search_config::{SearchNames, stopped_or_unfit};
use runner::trial_store::TrialStore;
use runner::{Context, out, plan, search_config};
use scenario::{Name, Weakness};
use search::{Drawn, SearchConfig, Stratum, ends_in};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Findings where no check is waived: classes that no platform should show.
const BROKEN: [Outcome; 2] = [Outcome::Unsafe, Outcome::Late];
/// Search configurations tried for one sequence: some have no sequence in a stratum.
const CONFIGS: u32 = 16;

/// Size and seeds of a drawing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lot {
    /// Seed of the drawing.
    pub(super) draws: u64,
    /// Sequences of each stratum.
    pub(super) each: u64,
}

/// A drawn sequence.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Case {
    pub(super) stratum: Stratum,
    /// Index within its stratum, from 1.
    number: u64,
    /// The weakness, or the attack space where no check is waived.
    pub(super) of: String,
    waived: bool,
    #[serde(rename = "word")]
    pub(super) sequence: String,
}

impl Case {
    /// The name of its file.
    pub(super) fn name(&self) -> String {
        format!("{}-{}", self.stratum.name(), self.number)
    }

    /// Its file below `dir`, ready to run as it will be live: rendered.
    pub(super) fn planned(&self, context: &Context, dir: &Path) -> Result<Planned, Failure> {
        let file = file(dir, "words", &self.name());
        let policy = self.waived.then(|| self::file(dir, "policies", &self.of));
        let repeated = policy.as_ref().map_or_else(String::new, |policy| format!(" --policy {}", policy.display()));
        let wanted = PlanOptions { policy, rendered: true, ..PlanOptions::default() };
        let (_, planned) = plan::plan(context, &file, &wanted)?;
        let [mut one] = <[Planned; 1]>::try_from(planned)
            .map_err(|_| Failure::internal("a sequence that was drawn has several cells"))?;
        one.command = Some(format!("holdsafe run {} --trials 1 --live{repeated}", file.display()));
        Ok(one)
    }
}

fn file(dir: &Path, folder: &str, name: &str) -> PathBuf {
    dir.join(folder).join(format!("{name}.toml"))
}

/// Every sequence of the lot, each in its file below `dir`; files already there are not drawn again.
pub(super) fn all(context: &Context, kept: &TrialStore, lot: Lot, dir: &Path) -> Result<Vec<Case>, Failure> {
    ["words", "policies"].iter().try_for_each(|folder| std::fs::create_dir_all(dir.join(folder)))?;
    let mut done = BTreeMap::new();
    let lines = Lines::open(&dir.join(format!("drawn.{}.jsonl", digest(context, kept, lot)?)), |_, case: Case| {
        done.insert((case.stratum, case.number), case);
        Ok(())
    })?;
    let wanted = || Stratum::ALL.into_iter().flat_map(|stratum| (1..=lot.each).map(move |number| (stratum, number)));
    let missing: Vec<_> = wanted().filter(|place| !done.contains_key(place)).collect();
    let sources = Sources::load(context)?;
    let progress = Progress::new("sequences drawn", missing.len(), context.talk);
    let drawn = parallel::map(parallel::cores(), &missing, |(stratum, number)| {
        let case = sources.draw(context, lot, *stratum, *number, dir)?;
        lines.put(&case)?;
        progress.step();
        Ok::<_, Failure>(case)
    })?;
    progress.finish();
    done.extend(drawn.into_iter().map(|case| ((case.stratum, case.number), case)));
    Ok(wanted().filter_map(|place| done.remove(&place)).collect())
}

/// Digest of every input of a sequence beside its stratum and number.
fn digest(context: &Context, kept: &TrialStore, lot: Lot) -> Result<String, Failure> {
    let of = (kept.build(), context.seed, lot.draws, out::inputs(&context.root()?)?);
    let text = serde_json::to_vec(&of).map_err(Failure::internal)?;
    Ok(hex(&Sha256::digest(text))[..16].to_owned())
}

/// Sources of sequences: findings and edges where a check is waived, safe sequences where none is.
struct Sources {
    weaknesses: Vec<Weakness>,
    spaces: Vec<String>,
}

impl Sources {
    fn load(context: &Context) -> Result<Self, Failure> {
        let mut weaknesses = search_config::weaknesses(context)?;
        // A policy can name a waived check, and `run` takes a policy; a wrong bound is in no file that it takes. What needs several
        // parts needs controls.
        weaknesses.retain(|weakness| weakness.misset.is_empty() && weakness.waive.len() == 1);
        Ok(Self { weaknesses, spaces: search_config::shipped(context, "spaces")? })
    }

    fn draw(&self, context: &Context, lot: Lot, stratum: Stratum, number: u64, dir: &Path) -> Result<Case, Failure> {
        let place = format!("{} {} {number}", lot.draws, stratum.name());
        let mut rng = ChaCha8Rng::from_seed(Sha256::digest(place).into());
        for _ in 0..CONFIGS {
            let (of, find, config) = match stratum {
                Stratum::Safe => self.sound(context, &mut rng)?,
                Stratum::Finding | Stratum::Edge => self.weakened(context, &mut rng)?,
            };
            let drawn = config.sample(stratum, &ends_in(&find), rng.next_u64(), &context.stop);
            if let Some(drawn) = drawn.map_err(|reason| stopped_or_unfit(context, reason))? {
                let waived = stratum != Stratum::Safe;
                let case = Case { stratum, number, of, waived, sequence: drawn.sequence.clone() };
                write(&case, &drawn, &config, dir)?;
                return Ok(case);
            }
        }
        let message = format!("no sequence for {} in {CONFIGS} configurations", stratum.name());
        Err(Failure::new(Exit::NoEvidence, message))
    }

    /// One of the attack spaces, under every check.
    fn sound(&self, context: &Context, rng: &mut ChaCha8Rng) -> Result<(String, Vec<Outcome>, SearchConfig), Failure> {
        let space = one_of(&self.spaces, rng)?;
        let wanted = PlanOptions { rendered: true, ..PlanOptions::default() };
        let config =
            SearchNames { scenario: "nominal", space, options: wanted, waive: &[], misset: &[] }.config(context)?;
        Ok((space.clone(), BROKEN.to_vec(), config))
    }

    /// One of the weaknesses, with its check waived by a policy of its name.
    fn weakened(
        &self,
        context: &Context,
        rng: &mut ChaCha8Rng,
    ) -> Result<(String, Vec<Outcome>, SearchConfig), Failure> {
        let weakness = one_of(&self.weaknesses, rng)?;
        let wanted = PlanOptions { rendered: true, ..PlanOptions::default() };
        let mut config = search_config::of_weakness(context, weakness, wanted)?;
        let name = weakness.name.as_str();
        name.clone_into(&mut config.setup.policy_name);
        name.clone_into(&mut config.setup.policy.name);
        Ok((name.to_owned(), weakness.find.to_vec(), config))
    }
}

fn one_of<'a, T>(of: &'a [T], rng: &mut ChaCha8Rng) -> Result<&'a T, Failure> {
    let i = (u64::from(rng.next_u32()) * of.len() as u64) >> 32;
    of.get(i as usize).ok_or_else(|| Failure::new(Exit::NoEvidence, "no source to draw sequences from"))
}

fn write(case: &Case, drawn: &Drawn, config: &SearchConfig, dir: &Path) -> Result<(), Failure> {
    let name = case.name();
    let parsed = Name::new(&name).map_err(Failure::internal)?;
    let text = drawn.scenario.to_file(&parsed).map_err(Failure::internal)?;
    std::fs::write(file(dir, "words", &name), text)?;
    if case.waived {
        let text = toml::to_string_pretty(&config.setup.policy).map_err(Failure::internal)?;
        std::fs::write(file(dir, "policies", &case.of), text)?;
    }
    Ok(())
}
