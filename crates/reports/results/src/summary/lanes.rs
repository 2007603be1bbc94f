//! Lanes of a run beside its modes: the guards that fail, and the display.

use evidence::Witnessed;
use ground_truth::Any;
use wire::event::{Event, Freshness, Inconsistency};
use wire::id::{NodeId, UnitId};
use wire::mode::{Cause, Guard, Guards};

use super::{Clock, Lasted, MAX_STRETCHES};

/// States one after the other, equal ones as one stretch; `None` is no stretch.
struct Stretches {
    all: Vec<Lasted>,
    open: Option<(String, f64)>,
}

impl Stretches {
    fn take(&mut self, at: f64, state: Option<String>) {
        if self.open.as_ref().map(|(what, _)| what) == state.as_ref() {
            return;
        }
        self.close(at);
        self.open = state.map(|what| (what, at));
    }

    fn close(&mut self, at: f64) {
        if let Some((what, from)) = self.open.take()
            && self.all.len() < MAX_STRETCHES
        {
            self.all.push(Lasted { what, from, to: at });
        }
    }
}

/// Stretches in which guards fail. Those before all guards held for the first time are the start of the run and left out.
pub(super) fn guards(entries: &[Witnessed], clock: Clock) -> Vec<Lasted> {
    let mut stretches = Stretches { all: Vec::new(), open: None };
    let (mut begun, mut contradiction) = (false, None);
    for w in entries.iter().filter(|w| w.entry.node == NodeId::UNIT_A) {
        match w.entry.event {
            Any::Service(Event::Inconsistent { unit, finding, .. }) => {
                contradiction = Some(format!("{unit} {}", contradiction_words(finding)));
            }
            // The guards of a change of mode are those that the unit judged it by.
            Any::Service(Event::Judged { failing, .. } | Event::Transition { failing, .. }) => {
                begun = begun || failing.is_empty();
                let state = (begun && !failing.is_empty()).then(|| failing_words(failing, contradiction.as_deref()));
                stretches.take(clock.seconds_at(w.at), state);
            }
            _ => {}
        }
    }
    stretches.close(clock.seconds_at(clock.end));
    stretches.all
}

fn failing_words(failing: Guards, contradiction: Option<&str>) -> String {
    let word = |guard: Guard| match contradiction {
        Some(of) if guard == Guard::Teammates => format!("{}: {of}", guard_words(guard)),
        _ => guard_words(guard).to_owned(),
    };
    failing.iter().map(word).collect::<Vec<_>>().join(", ")
}

fn contradiction_words(finding: Inconsistency) -> &'static str {
    match finding {
        Inconsistency::Kinematics => "moves faster than its body can",
        Inconsistency::Exclusion => "stands where another unit is",
        Inconsistency::TimeBase => "against its own time",
        Inconsistency::Residual => "does not go where it says it drives",
    }
}

/// A guard in words for people.
fn guard_words(guard: Guard) -> &'static str {
    match guard {
        Guard::Rgb => "Colour camera",
        Guard::Depth => "Depth camera",
        Guard::Thermal => "Thermal camera",
        Guard::Lidar => "LiDAR",
        Guard::Tracks => "Tracks",
        Guard::Localisation => "Own place",
        Guard::Geofence => "Distance to fence",
        Guard::Lease => "Permission to drive",
        Guard::Teammates => "Teammates",
        Guard::SealedLog => "Sealed log",
        Guard::Designation => "Designated track",
        Guard::Drift => "Position drift",
        Guard::TimeBase => "Receiver time",
    }
}

/// A cause in words for people.
pub(super) fn cause_words(cause: Cause) -> String {
    match cause {
        Cause::Lost(guard) => format!("{} lost", guard_words(guard)),
        Cause::Unrecovered(guard) => format!("{} not recovered in time", guard_words(guard)),
        other => other.label(),
    }
}

/// The modes that the console showed of the unit under test; a value that is not fresh is named with a *was*.
pub(super) fn shown(entries: &[Witnessed], clock: Clock) -> Vec<Lasted> {
    let mut stretches = Stretches { all: Vec::new(), open: None };
    for w in entries.iter().filter(|w| w.at <= clock.end) {
        if let Any::Service(Event::Displayed { unit: UnitId::A, mode, freshness, .. }) = w.entry.event {
            let state = match freshness {
                Freshness::Fresh => mode.name().to_owned(),
                Freshness::Late => format!("LATE, was {}", mode.name()),
                Freshness::Stale => format!("STALE, was {}", mode.name()),
                Freshness::Lost => format!("LOST, was {}", mode.name()),
            };
            stretches.take(clock.seconds_at(w.at), Some(state));
        }
    }
    stretches.close(clock.seconds_at(clock.end));
    stretches.all
}
