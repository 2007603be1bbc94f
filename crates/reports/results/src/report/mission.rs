//! Progress of the missions of a run, folded over its trials and in words.

use std::collections::BTreeMap;

use evidence::mission::Carried;
use evidence::progress::Progress;
use evidence::trial::Trial;
use serde::{Deserialize, Serialize};

/// The missions of all trials that have one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MissionSummary {
    /// Trials with a platform.
    pub n: u64,
    /// Trials in which the unit held authority.
    pub armed: u64,
    /// Trials in which the plant acted.
    pub acted: u64,
    /// Trials in which the mission did not come as far as the scenario presumes.
    pub missing: u64,
    /// Mean way by the plant's truth, metres.
    pub driven_m: f64,
    /// Mean time in nominal control, seconds.
    pub nominal_s: f64,
    /// Progress along the route; none where no trial has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub progress: Option<ProgressSummary>,
    /// Operator's steps that were never carried out, each with the reason, and the number of trials: "arm: never, no
    /// vehicle shown".
    pub never: BTreeMap<String, u64>,
}

/// Progress along the route, over the trials in which it was judged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProgressSummary {
    /// Number of these trials.
    pub n: u64,
    /// Mean share of the way points that were passed, 0 to 1.
    pub completed: f64,
    /// Mean share of the route's length that was covered, 0 to 1.
    pub covered: f64,
    /// Mean time in modes that let it drive with way points left, seconds.
    pub driving_s: f64,
    /// Trials in which it was stuck.
    pub stuck: u64,
    /// Mean time in which it was, seconds.
    pub stuck_s: f64,
}

impl ProgressSummary {
    /// Progress over `trials`; none where none has a route.
    pub(super) fn from_trials(trials: &[Trial]) -> Option<Self> {
        let each = trials.iter().filter_map(|trial| trial.mission.as_ref()?.progress.as_ref());
        let each: Vec<&Progress> = each.collect();
        let n = each.len() as u64;
        let mean =
            |value: &dyn Fn(&Progress) -> f64| each.iter().map(|progress| value(progress)).sum::<f64>() / n as f64;
        (n > 0).then(|| Self {
            n,
            completed: mean(&|progress| f64::from(progress.passed) / f64::from(progress.total.max(1))),
            covered: mean(&|progress| progress.covered),
            driving_s: mean(&|progress| progress.driving_s),
            stuck: each.iter().filter(|progress| progress.is_stuck()).count() as u64,
            stuck_s: mean(&|progress| progress.stuck_s),
        })
    }

    /// As a line below a table.
    fn line(&self) -> String {
        let Self { n, completed, covered, driving_s, stuck, stuck_s } = self;
        let percent = |share: &f64| share * 100.0;
        format!(
            "route: means: {:.0} % of way points passed, {:.0} % of the way covered; stuck in {stuck} of {n}, {stuck_s:.1} of {driving_s:.1} s \
             in which it could drive on\n",
            percent(completed),
            percent(covered)
        )
    }
}

impl MissionSummary {
    /// Missions of `trials`.
    pub fn from_trials(trials: &[Trial]) -> Self {
        let missions: Vec<_> = trials.iter().filter_map(|trial| trial.mission.as_ref()).collect();
        let n = missions.len() as u64;
        let mean = |sum: f64| if n > 0 { sum / n as f64 } else { 0.0 };
        let mut never = BTreeMap::new();
        for told in missions.iter().flat_map(|mission| &mission.steps).filter_map(missed_step) {
            *never.entry(told).or_insert(0) += 1;
        }
        Self {
            n,
            armed: missions.iter().filter(|m| m.armed_ms.is_some()).count() as u64,
            acted: missions.iter().filter(|m| m.acted_ms.is_some()).count() as u64,
            missing: missions.iter().filter(|m| !m.missing.is_empty()).count() as u64,
            driven_m: mean(missions.iter().map(|m| m.driven_m).sum()),
            nominal_s: mean(missions.iter().map(|m| m.nominal_s).sum()),
            progress: ProgressSummary::from_trials(trials),
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
        lines.extend(self.progress.as_ref().map(ProgressSummary::line));
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
fn missed_step(step: &Carried) -> Option<String> {
    let reason = step.reason.as_ref()?;
    let reason = reason.strip_prefix("given at ").and_then(|rest| Some(rest.split_once(", ")?.1)).unwrap_or(reason);
    Some(format!("{}: never, {reason}", step.verb.name()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use evidence::mission::{Mission, Verb};
    use evidence::progress::{Standstill, Stretch};
    use evidence::trial::Outcome;

    #[test]
    fn stuck_trials_are_counted_beside_the_share_passed() {
        let of = |passed: u32, stuck_s: f64| {
            let stretch = Stretch { from_ms: 2000.0, s: stuck_s, reason: Standstill::Planner };
            let stuck = (stuck_s > 0.0).then_some(stretch);
            let progress = Progress {
                passed,
                total: 4,
                covered: 0.5,
                driving_s: 30.0,
                farthest_m: 9.0,
                stuck_s,
                stuck_at_end: true,
                astray_s: None,
                stuck,
            };
            let mission = Mission { progress: Some(progress), ..Mission::default() };
            Trial { mission: Some(mission), ..Trial::example(1, Outcome::Nominal) }
        };
        let lines = MissionSummary::from_trials(&[of(4, 0.0), of(1, 20.0)]).lines();
        let text = "62 % of way points passed, 50 % of the way covered; stuck in 1 of 2, 10.0 of 30.0 s";
        assert!(lines.contains(text), "{lines}");
        let ablated_trial = Trial { mission: Some(Mission::default()), ..Trial::example(1, Outcome::Nominal) };
        assert!(!MissionSummary::from_trials(&[ablated_trial]).lines().contains("route"));
    }

    #[test]
    fn missed_step_is_reported_once_with_count() {
        let arm =
            |reason: &str| Carried { verb: Verb::Arm, due_ms: 2500.0, done_ms: None, reason: Some(reason.to_owned()) };
        let trial = |seed, reason| Trial {
            mission: Some(Mission { steps: vec![arm(reason)], driven_m: 4.0, ..Mission::default() }),
            ..Trial::example(seed, Outcome::Invalid)
        };
        let trials =
            [trial(1, "no vehicle shown"), trial(2, "no vehicle shown"), trial(3, "given at 2600 ms, not executed")];
        let summary = MissionSummary::from_trials(&trials);
        assert_eq!((summary.n, summary.armed, summary.driven_m), (3, 0, 4.0));
        let lines = summary.lines();
        assert!(
            lines.contains("armed 0 of 3") && lines.contains("  arm: never, no vehicle shown (2 of 3)\n"),
            "{lines}"
        );
        assert!(lines.contains("  arm: never, not executed (1 of 3)\n"), "{lines}");
        assert_eq!(MissionSummary::from_trials(&[Trial::example(1, Outcome::Rejected)]).lines(), "");
    }
}
