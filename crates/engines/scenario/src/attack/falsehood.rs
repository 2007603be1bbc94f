//! `[[falsehood]]`: an admitted teammate claims a place or a motion that is not its own.

use adversary::plan::{self, MotionClaim};
use evidence::Planned;
use evidence::trial::Knowledge;
use ground_truth::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Act, Attack, Deceit, Injection};
use crate::{Located, Radians, Real, Seconds, Windowed};

/// B claims a false place, or a false motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Falsehood {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Length.
    pub duration_s: Seconds,
    /// Speed at which the claimed place leaves the true one, or the speed that is feigned.
    pub drift_m_s: Real<0, 100_000>,
    /// Direction of the motion, from east to north.
    #[serde(default)]
    pub towards_rad: Radians,
    /// Relation of the claimed speed and heading to the claimed place.
    pub motion: MotionClaim,
}

impl Windowed for Falsehood {
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

impl Attack for Falsehood {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Teammate(Deceit::Falsehood(plan::Falsehood {
            at_ms: self.start_ms(phase_ms),
            duration_ms: self.length_ms(),
            drift_mm_s: (self.drift_m_s.get() * 1000.0) as u32,
            towards_mrad: (self.towards_rad.get() * 1000.0) as i32,
            motion: self.motion,
        })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Lie)))
    }
}
