//! `[[mode_confusion]]`: an admitted teammate's reports are no live product, or in another time base.

use adversary::plan::{Confusion, Product};
use evidence::Planned;
use evidence::trial::Knowledge;
use ground_truth::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Act, Attack, Deceit, Injection};
use crate::{Located, Seconds, Whole, Windowed};

/// B's reports are no live product, or stamped in another time base than its session's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModeConfusion {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Length.
    pub duration_s: Seconds,
    /// Claimed product of the reports.
    pub product: Product,
    /// Time by which their stamps are ahead.
    #[serde(default)]
    pub clock_ms: Whole<-60_000, 60_000>,
}

impl Windowed for ModeConfusion {
    fn at_s(&self) -> &Located<Seconds> {
        &self.at_s
    }

    fn duration_s(&self) -> Seconds {
        self.duration_s
    }

    fn needs(&self) -> Knowledge {
        Knowledge::Insider
    }
}

impl Attack for ModeConfusion {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Teammate(Deceit::Confusion(Confusion {
            at_ms: self.start_ms(phase_ms),
            duration_ms: self.length_ms(),
            product: self.product,
            clock_ms: self.clock_ms.get(),
        })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Confuse)))
    }
}
