//! Configuration of a search, assembled from a command line or a list of weaknesses.

use std::fmt::Display;
use std::path::Path;

use super::Context;
use super::failure::{Exit, Failure};
use super::plan::{self, PlanOptions, Planned};
use evidence::ablation::Switch;
use scenario::{AttackSpace, Misset, Weakness, Weaknesses};
use search::SearchConfig;

/// Most sequences of one length that are tried exhaustively.
pub const MOST_SEQUENCES: usize = 1_000_000;

/// A search configuration by its names.
#[derive(Debug)]
pub struct SearchNames<'a> {
    /// A scenario of the twin, by name or by file.
    pub scenario: &'a str,
    /// An attack space, by name or by file.
    pub space: &'a str,
    /// Policy and cell of the scenario.
    pub options: PlanOptions,
    /// Additional waivers.
    pub waive: &'a [Switch],
    /// Bounds of which the services get wrong values.
    pub misset: &'a [Misset],
}

impl SearchNames<'_> {
    /// The search configuration; every action type of the attack space was tried on.
    pub fn config(&self, context: &Context) -> Result<SearchConfig, Failure> {
        let (scenario, planned) = plan::plan(context, &plan::file_of(context, self.scenario)?, &self.options)?;
        if scenario.is_of_stacks() {
            let message =
                format!("`{}` runs on the real stacks in memory; a search needs the twin", scenario.name.as_str());
            return Err(Failure::new(Exit::Usage, message));
        }
        let [planned] = <[Planned; 1]>::try_from(planned).map_err(|several| {
            let cells: Vec<String> = several.into_iter().filter_map(|p| p.variation.cell).collect();
            Failure::new(
                Exit::Usage,
                format!("`{}` has several cells; choose one with --cell: {}", self.scenario, cells.join(", ")),
            )
        })?;
        let space = space(context, self.space)?;
        let Planned { variation, mut setup, .. } = planned;
        for switch in self.waive {
            switch.waive(&mut setup.policy);
        }
        if !self.waive.is_empty() {
            "searched".clone_into(&mut setup.policy_name);
            "searched".clone_into(&mut setup.policy.name);
        }
        if !self.misset.is_empty() {
            setup.misset = Some(self.misset.iter().fold(setup.bounds, |bounds, misset| misset.apply(bounds)));
        }
        let config = SearchConfig::new(variation.scenario, setup, context.seed, space).map_err(unfit)?;
        config.fits().map_err(unfit)?;
        Ok(config)
    }
}

/// An attack space by name or by path.
pub fn space(context: &Context, name: &str) -> Result<AttackSpace, Failure> {
    if name.ends_with(".toml") || name.contains('/') {
        return Ok(AttackSpace::load(Path::new(name))?);
    }
    let path = context.root()?.join("scenarios").join("spaces").join(format!("{name}.toml"));
    if path.is_file() {
        return Ok(AttackSpace::load(&path)?);
    }
    let known = shipped(context, "spaces")?.join(", ");
    Err(Failure::new(Exit::Usage, format!("no attack space `{name}`; there are: {known}")))
}

/// The search configuration of a weakness.
pub fn of_weakness(context: &Context, weakness: &Weakness, options: PlanOptions) -> Result<SearchConfig, Failure> {
    let (scenario, space) = (weakness.scenario.as_str(), weakness.space.as_str());
    let (waive, misset) = (&weakness.waive, &weakness.misset);
    SearchNames { scenario, space, options, waive, misset }.config(context)
}

/// Every weakness of every list that is shipped, list by list.
pub fn weaknesses(context: &Context) -> Result<Vec<Weakness>, Failure> {
    let folder = context.root()?.join("scenarios").join("weaknesses");
    let names = shipped(context, "weaknesses")?;
    let list = |name: &String| Ok(Weaknesses::load(&folder.join(format!("{name}.toml")))?.weakness.to_vec());
    Ok(names.iter().map(list).collect::<Result<Vec<_>, Failure>>()?.concat())
}

/// The files in a folder of scenarios/, by name, in order.
pub fn shipped(context: &Context, folder: &str) -> Result<Vec<String>, Failure> {
    let entries = std::fs::read_dir(context.root()?.join("scenarios").join(folder))?;
    let mut names: Vec<String> = entries.flatten().map(|entry| plan::stem(&entry.path())).collect();
    names.sort();
    Ok(names)
}

/// Reason for the early end of a search: a request to stop, or a sequence that did not fit.
pub fn stopped_or_unfit(context: &Context, error: impl Display) -> Failure {
    if context.stop.is_requested() {
        Failure::new(Exit::Interrupted, "stopped; nothing was kept")
    } else {
        unfit(error)
    }
}

/// Usage error of an attack space: its action types do not fit the scenario, or one another.
pub fn unfit(error: impl Display) -> Failure {
    Failure::new(Exit::Usage, error.to_string())
}
