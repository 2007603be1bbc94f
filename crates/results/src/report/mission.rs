//! Progress of the missions of a run, folded over its trials and in words.

use std::collections::BTreeMap;

use evidence::mission::Carried;
use evidence::trial::Trial;
use serde::{Deserialize, Serialize};

/// The missions of all trials that have one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MissionSummary {
    /// Trials with a platform.
    pub n: u64,
    /// In so many of them the unit held authority.
    pub armed: u64,
    /// In so many the plant acted.
    pub acted: u64,
    /// In so many the mission did not come as far as the scenario presumes.
    pub missing: u64,
    /// Mean way by the plant's truth, metres.
    pub driven_m: f64,
    /// Mean time in nominal control, seconds.
    pub nominal_s: f64,
    /// Steps of the operator that were never carried out, with why, and in how many trials: "arm: never, no vehicle shown".
    pub never: BTreeMap<String, u64>,
}

impl MissionSummary {
    /// Of `trials`.
    pub fn of(trials: &[Trial]) -> Self {
        let missions: Vec<_> = trials.iter().filter_map(|trial| trial.mission.as_ref()).collect();
        let n = missions.len() as u64;
        let mean = |sum: f64| if n > 0 { sum / n as f64 } else { 0.0 };
        let mut never = BTreeMap::new();
        for told in missions.iter().flat_map(|mission| &mission.steps).filter_map(told) {
            *never.entry(told).or_insert(0) += 1;
        }
        Self {
            n,
            armed: missions.iter().filter(|m| m.armed_ms.is_some()).count() as u64,
            acted: missions.iter().filter(|m| m.acted_ms.is_some()).count() as u64,
            missing: missions.iter().filter(|m| !m.missing.is_empty()).count() as u64,
            driven_m: mean(missions.iter().map(|m| m.driven_m).sum()),
            nominal_s: mean(missions.iter().map(|m| m.nominal_s).sum()),
            never,
        }
    }

    /// As lines below a table; none for a run without a platform.
    pub(super) fn lines(&self) -> String {
        if self.n == 0 {
            return String::new();
        }
        let Self { n, armed, acted, driven_m, nominal_s, .. } = self;
        let mut lines = format!(
            "mission: armed {armed} of {n}, acted {acted} of {n}; means: {driven_m:.1} m driven, {nominal_s:.1} s in nominal control\n"
        );
        for (step, times) in &self.never {
            lines.push_str(&format!("  {step} ({times} of {n})\n"));
        }
        if self.missing > 0 {
            lines.push_str(&format!(
                "  in {} of {n} the mission did not come as far as the scenario presumes: INVALID unless worse\n",
                self.missing
            ));
        }
        lines
    }
}

/// A step that was never carried out; the times in why it was not are left out, for they differ by trial.
fn told(step: &Carried) -> Option<String> {
    let why = step.why.as_ref()?;
    let why = why.strip_prefix("given at ").and_then(|rest| Some(rest.split_once(", ")?.1)).unwrap_or(why);
    Some(format!("{}: never, {why}", step.verb.name()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use evidence::mission::{Mission, Verb};
    use evidence::trial::Outcome;

    #[test]
    fn missed_step_is_reported_once_with_count() {
        let arm = |why: &str| Carried { verb: Verb::Arm, due_ms: 2500.0, done_ms: None, why: Some(why.to_owned()) };
        let of = |seed, why| Trial {
            mission: Some(Mission { steps: vec![arm(why)], driven_m: 4.0, ..Mission::default() }),
            ..Trial::example(seed, Outcome::Invalid)
        };
        let trials = [of(1, "no vehicle shown"), of(2, "no vehicle shown"), of(3, "given at 2600 ms, not executed")];
        let summary = MissionSummary::of(&trials);
        assert_eq!((summary.n, summary.armed, summary.driven_m), (3, 0, 4.0));
        let lines = summary.lines();
        assert!(
            lines.contains("armed 0 of 3") && lines.contains("  arm: never, no vehicle shown (2 of 3)\n"),
            "{lines}"
        );
        assert!(lines.contains("  arm: never, not executed (1 of 3)\n"), "{lines}");
        assert_eq!(MissionSummary::of(&[Trial::example(1, Outcome::Rejected)]).lines(), "");
    }
}
