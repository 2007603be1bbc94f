//! What an admitted teammate says that is old, untrue, or of another kind than it is taken for.

use evidence::trial::Knowledge;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::timed::Windowed;
use super::value::{Count, Located, Millis, Radians, Real, Seconds, Whole};

/// B ends its session, dials again, and sends what it recorded in the session before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SessionReplay {
    /// When it hangs up, on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Records sent in the next session, the newest first: each whole, and then its report alone.
    pub count: Count,
    /// Time between them.
    pub every_ms: Millis,
    /// Whether B has a later boot from then on and counts from the beginning.
    #[serde(default)]
    pub restart: bool,
}

/// B claims to be where, or to move as, it does not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Falsehood {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Length.
    pub duration_s: Seconds,
    /// How fast the claimed place leaves the true one, or the speed that is feigned.
    pub drift_m_s: Real<0, 100_000>,
    /// Which way, from east to north.
    #[serde(default)]
    pub towards_rad: Radians,
    /// What of it the claimed motion shows.
    pub motion: Motion,
}

/// How the claimed motion stands to the claimed place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// The place drifts; speed and heading are the true ones.
    Hidden,
    /// The place drifts; speed and heading are those that go with it.
    Owned,
    /// The place is the true one; speed and heading are not.
    Feigned,
}

/// B's reports are no live product, or stamped in another time base than its session's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModeConfusion {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Length.
    pub duration_s: Seconds,
    /// What the reports say that they are.
    pub product: Product,
    /// How far their stamps are ahead.
    #[serde(default)]
    pub clock_ms: Whole<-60_000, 60_000>,
}

/// Where a report says that its content comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Product {
    /// Made now.
    Live,
    /// Made by a generator.
    Synthetic,
    /// Played back.
    Replayed,
}

// None of these waits for anything: they begin at their time.
macro_rules! windowed {
    ($($name:ident $length:expr;)+) => {$(
        impl Windowed for $name {
            fn at_s(&self) -> &Located<Seconds> {
                &self.at_s
            }
            fn duration_s(&self) -> Seconds {
                let length: fn(&Self) -> Seconds = $length;
                length(self)
            }
            fn needs(&self) -> Knowledge {
                Knowledge::Insider
            }
        }
    )+};
}

windowed! {
    SessionReplay |_| Seconds::default();
    Falsehood |x| x.duration_s;
    ModeConfusion |x| x.duration_s;
}
