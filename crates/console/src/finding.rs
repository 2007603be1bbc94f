//! A cause as it is found at one look, with what it led to. Finding causes is left to `causes` and `ended`, raising
//! groups of them to `alarms`.

use config::suite::Suite;
use wire::person::Alarm;
use wire::time::Instant;

use crate::alarm::{LedTo, Priority};

/// A cause that stands.
#[derive(Clone, Debug)]
pub(crate) struct Finding {
    pub(crate) cause: Alarm,
    pub(crate) suite: Suite,
    pub(crate) priority: Priority,
    /// Which of its occurrences, if it is a past event.
    pub(crate) event: Option<u64>,
    /// True if a present condition stands by it.
    pub(crate) stands: bool,
    /// True if a HOLD_SAFE that nobody here ordered stands by it.
    pub(crate) hold_stands: bool,
    pub(crate) led_to: Vec<(Instant, LedTo)>,
    /// Causes that turn out to be consequences of this one.
    pub(crate) absorbs: Vec<Alarm>,
}

/// The causes that stand, each once.
#[derive(Debug, Default)]
pub(crate) struct Findings(pub(crate) Vec<Finding>);

impl Findings {
    /// The finding of this cause, by a present condition.
    pub(crate) fn of(&mut self, cause: Alarm, suite: Suite) -> &mut Finding {
        let finding = self.entry(cause, suite);
        finding.stands = true;
        finding
    }

    /// Adds the finding of a past event.
    pub(crate) fn event(&mut self, cause: Alarm, occurrence: u64) {
        self.entry(cause, Suite::Scene).event = Some(occurrence);
    }

    fn entry(&mut self, cause: Alarm, suite: Suite) -> &mut Finding {
        let at = self.0.iter().position(|finding| finding.cause == cause).unwrap_or_else(|| {
            self.0.push(Finding {
                cause,
                suite,
                priority: Priority::from_alarm(&cause),
                event: None,
                stands: false,
                hold_stands: false,
                led_to: Vec::new(),
                absorbs: Vec::new(),
            });
            self.0.len() - 1
        });
        &mut self.0[at]
    }
}
