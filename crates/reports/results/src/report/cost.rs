//! Cost of the twin: the object that `lab twin` prints, and its table.

use serde::{Deserialize, Serialize};

use super::table::new_table;

/// Least, middle and greatest of repeated measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Number of values.
    pub n: usize,
    /// Least.
    pub min: f64,
    /// Middle value; the upper of the two middle ones for an even number.
    pub median: f64,
    /// Greatest.
    pub max: f64,
}

impl Spread {
    /// Spread of `values`; zeros of none.
    pub fn from_values(values: impl IntoIterator<Item = f64>) -> Spread {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let value = |i: usize| values.get(i).copied().unwrap_or_default();
        Spread {
            n: values.len(),
            min: value(0),
            median: value(values.len() / 2),
            max: value(values.len().saturating_sub(1)),
        }
    }

    /// Least, middle and greatest with a given number of digits behind the point.
    pub fn text(&self, digits: usize) -> String {
        format!("{:.digits$} / {:.digits$} / {:.digits$}", self.min, self.median, self.max)
    }
}

/// One stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageCost {
    /// Its name.
    pub stage: String,
    /// CPU microseconds a simulated second.
    pub us: f64,
    /// Share of the twin's.
    pub share: f64,
}

impl StageCost {
    /// `us` out of `all`.
    pub fn new(stage: &str, us: f64, all: f64) -> Self {
        Self { stage: stage.to_owned(), us, share: us / all }
    }
}

/// The cost of the twin, per simulated second unless stated otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwinCost {
    /// Version of this object.
    pub schema_version: u32,
    /// Scenario.
    pub scenario: String,
    /// True if sensors were rendered and the detector ran.
    pub rendered: bool,
    /// First seed.
    pub seed: u64,
    /// Repetitions.
    pub rounds: usize,
    /// Trials in each.
    pub trials: usize,
    /// Simulated seconds in each.
    pub sim_seconds: f64,
    /// Simulated seconds a CPU second of the twin.
    pub per_cpu_second: Spread,
    /// Rate of bare rapier.
    pub bare_per_cpu_second: Spread,
    /// CPU of the twin over CPU of bare rapier, round by round.
    pub ratio: Spread,
    /// CPU of the watched twin over CPU of the twin, round by round.
    pub watching: Spread,
    /// Simulated seconds a CPU second, where the first trial is run again and every core follows the known run.
    pub along_per_cpu_second: Spread,
    /// Rate of a run forked from the known run 3 s before its end: of the whole trial, which is judged whole.
    pub forked_per_cpu_second: Spread,
    /// Rate of these 3 s alone.
    pub suffix_per_cpu_second: Spread,
    /// CPU microseconds of the twin.
    pub twin_us: Spread,
    /// CPU microseconds of bare rapier.
    pub bare_us: Spread,
    /// Costs by stage; they add up to the median of `twin_us`.
    pub stages: Vec<StageCost>,
    /// CPU microseconds of one signature.
    pub sign_us: Spread,
    /// CPU microseconds of one verification.
    pub verify_us: Spread,
    /// Signatures that a core made.
    pub signatures_made: f64,
    /// Signatures that a core asked about.
    pub signatures_asked: f64,
    /// Signatures that were verified.
    pub signatures_verified: f64,
}

impl TwinCost {
    /// CPU microseconds of signing and of verifying, by count and unit cost: in the stages already.
    pub fn signatures_us(&self) -> (f64, f64) {
        (self.signatures_made * self.sign_us.median, self.signatures_verified * self.verify_us.median)
    }
}

/// The table of the twin's cost.
pub fn cost_table(cost: &TwinCost) -> String {
    let mut table = new_table(&["stage", "CPU us per simulated s", "share"]);
    let twin = cost.twin_us.median;
    let (signing, verifying) = cost.signatures_us();
    let signing = StageCost::new("  of which signing (count x unit cost)", signing, twin);
    let verifying = StageCost::new("  of which verifying (count x unit cost)", verifying, twin);
    for row in cost.stages.iter().chain([&StageCost::new("all", twin, twin), &signing, &verifying]) {
        table.add_row([row.stage.clone(), format!("{:.1}", row.us), format!("{:.1} %", row.share * 100.0)]);
    }
    let name = if cost.rendered { "rendered, with detector" } else { "unrendered" };
    format!(
        "{} ({name}): {} rounds of {} trials, {:.0} simulated s each\n{table}\n\
         twin: {} simulated s per CPU s\nbare rapier on the same course: {}\nCPU of the twin over bare rapier: {}\n\
         the first trial again, every core along with the known run: {}\n\
         forked 3 s before its end and judged whole: {} of the trial, {} of these 3 s\n\
         min / median / max over the rounds. Watching costs {} and is not in the table.\n\
         A simulated s has {:.1} signatures made and {:.1} verified of {:.1} asked about; \
         one takes {:.1} us to make, {:.1} us to verify.",
        cost.scenario,
        cost.rounds,
        cost.trials,
        cost.sim_seconds,
        cost.per_cpu_second.text(1),
        cost.bare_per_cpu_second.text(1),
        cost.ratio.text(2),
        cost.along_per_cpu_second.text(0),
        cost.forked_per_cpu_second.text(0),
        cost.suffix_per_cpu_second.text(0),
        format_args!("{:+.1} %", (cost.watching.median - 1.0) * 100.0),
        cost.signatures_made,
        cost.signatures_verified,
        cost.signatures_asked,
        cost.sign_us.median,
        cost.verify_us.median,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_ignores_order_and_is_zero_if_empty() {
        assert_eq!(Spread::from_values([3.0, 1.0, 2.0]), Spread { n: 3, min: 1.0, median: 2.0, max: 3.0 });
        assert_eq!(Spread::from_values([]), Spread::default());
    }
}
