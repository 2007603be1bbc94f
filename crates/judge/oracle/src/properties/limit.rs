//! Limits of the properties that a run can come near to, and the approach to each.

use serde::{Deserialize, Serialize};
use wire::bounds::Bounds;

use super::limits;
use crate::facts::Facts;

/// A limit that can be approached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// P1: age that the confirmation of an act may have.
    Confirmation,
    /// P1: time for which authority may be held.
    Authority,
    /// P2: time for which a unit may stay nominal without a sensor.
    Loss,
    /// P3: time for which the unit may continue without its localisation.
    Blindness,
    /// P3: time for which the unit may continue without a timely record at the gateway.
    Uplink,
    /// P3: time for which the unit may continue without a timely record from the gateway.
    Downlink,
    /// P4: distance that is kept to the fence.
    Fence,
    /// P5: age that an accepted record may have.
    Age,
    /// P7: age, or time of error, that a value shown as fresh may have.
    Display,
    /// P8: time by which an order may be executed late.
    Order,
    /// P9: least time before DEGRADED may end.
    Recovery,
    /// P11: distance from its class that an act may have.
    Object,
}

impl Limit {
    /// Name in a report, with the property that states the limit.
    pub fn name(self) -> String {
        self.row().map(|(property, row)| format!("{property}, {}", row.name)).unwrap_or_default()
    }

    /// Length of a limit that is a time, milliseconds. The rest of the way to such a limit is a time, too.
    pub fn length_ms(self, bounds: &Bounds) -> Option<u64> {
        let (_, row) = self.row()?;
        row.length_ms.map(|length_ms| length_ms(bounds))
    }

    fn row(self) -> Option<(&'static str, &'static LimitRow)> {
        limits().find(|(_, row)| row.limit == self).map(|(property, row)| (property.name, row))
    }
}

/// A limit that a property states.
pub(crate) struct LimitRow {
    /// The limit.
    pub limit: Limit,
    /// Its name without that of the property.
    pub name: &'static str,
    /// Its length in milliseconds, where it is a time.
    pub length_ms: Option<fn(&Bounds) -> u64>,
    /// Closest approach of a run to the limit, in millionths of it, given its length in microseconds; none where nothing approached it.
    pub approach: fn(&Facts, u64) -> Option<u32>,
}

impl LimitRow {
    /// Closest approach of a run to the limit, in millionths of it.
    pub(crate) fn closest(&self, facts: &Facts) -> Option<u32> {
        let length_ms = self.length_ms.map_or(u64::MAX, |length_ms| length_ms(&facts.evidence.bounds));
        (self.approach)(facts, length_ms.saturating_mul(1000))
    }
}

/// Approach that has reached its limit.
pub const AT_LIMIT: u32 = 1_000_000;

/// Share of the whole, in millionths.
pub(super) fn millionths(share: u64, whole: u64) -> u32 {
    let millionths = u128::from(share) * u128::from(AT_LIMIT) / u128::from(whole.max(1));
    u32::try_from(millionths).unwrap_or(u32::MAX)
}

/// Approach of the longest of these times.
pub(super) fn longest(times_us: impl IntoIterator<Item = u64>, length_us: u64) -> Option<u32> {
    times_us.into_iter().map(|time| millionths(time, length_us)).max()
}
