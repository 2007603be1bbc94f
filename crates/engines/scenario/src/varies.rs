//! Quantities that a seed varies, and the conditions of the link and the models that hold for every seed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spacecraft::earth::{GeodeticPlace, Look, Tangent, Window, look, passes};
use spacecraft::orbit::Orbit;

use super::value::{List, Located, Millis, Real, Share};

/// Most ground stations of a scenario.
pub const MAX_STATIONS: usize = 4;

/// Conditions of the telemetry link all along, both ways, from the first datagram to the last. They are no attack: no injection
/// is made, no receipt is required, and a trip that they cause in quiet hours is a false trip.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Conditions {
    /// Probability that a datagram is lost.
    pub loss: Located<Share>,
    /// Longest uniform random delay of a datagram, beside the link's own.
    pub jitter_ms: Located<Millis>,
    /// Ground stations through which the link to a satellite goes, command path included; without any it always carries. At each time the nearest
    /// one serves; in between neither path carries.
    pub station: List<Station, MAX_STATIONS>,
}

/// A ground station.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Station {
    /// Latitude, degrees, positive to the north.
    pub latitude_deg: Real<-90_000, 90_000>,
    /// Longitude, degrees, positive to the east.
    pub longitude_deg: Real<-180_000, 180_000>,
    /// Least elevation at which it sees the satellite, degrees.
    pub least_elevation_deg: Real<0, 90_000>,
}

impl Station {
    fn tangent(&self) -> Tangent {
        Tangent::new(GeodeticPlace::of_degrees(self.latitude_deg.get(), self.longitude_deg.get(), 0.0))
    }

    /// When it sees the satellite between two times, seconds after the orbit's epoch.
    pub fn sees(&self, orbit: &Orbit, from_s: f64, until_s: f64) -> Vec<Window> {
        passes(&self.tangent(), orbit, from_s, until_s, self.least_elevation_deg.get().to_radians())
    }

    /// The satellite as it stands there then, seconds after the orbit's epoch.
    pub fn look(&self, orbit: &Orbit, time_s: f64) -> Look {
        look(&self.tangent(), &orbit.state_at(time_s), orbit.epoch().plus_seconds(time_s))
    }
}

/// Factors by which the twin's models of sensors and plant are taken to be off, 1 as they ship. No service knows of them. They
/// are there to ask which results hang on the models (`docs/researcher/evaluation.md`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Models {
    /// On the noise of every sensor; unrendered, also on the rate at which a stage misses, confuses or invents an object.
    pub noise: Real<100, 10_000>,
    /// On the vehicle's mass, of which its drive and its brakes are not informed.
    pub load: Real<500, 2_000>,
    /// On the friction between its wheels and the ground.
    pub grip: Real<50, 2_000>,
}

impl Default for Models {
    fn default() -> Self {
        Self { noise: Real::constant(1.0), load: Real::constant(1.0), grip: Real::constant(1.0) }
    }
}

/// Quantities that a seed varies. Everything else is the same in each trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Varies {
    /// One uniform draw a trial, added to the time of every attack, fault, insider and kill: `[from, to]`.
    pub injection_phase_s: Located<List<Real<0, 600_000>, 2>>,
    /// Zero and drift of each host's clock, and the phase of its periods.
    pub clocks: bool,
    /// Delays of links and processing stages.
    pub delays: bool,
    /// Sensor and detector noise.
    pub noise: bool,
    /// Greatest shift of the objects, which move together: one uniform draw for x and one for y.
    pub object_shift_m: Real<0, 5_000>,
}

impl Default for Varies {
    fn default() -> Self {
        Self {
            injection_phase_s: Located::nowhere(List::default()),
            clocks: true,
            delays: true,
            noise: true,
            object_shift_m: Real::default(),
        }
    }
}

impl Varies {
    /// The phase's range in seconds; `(0, 0)` where none is drawn.
    pub fn phase_s(&self) -> (f64, f64) {
        match &self.injection_phase_s[..] {
            [from, to] => (from.get(), to.get()),
            [] | [_] | [_, _, ..] => (0.0, 0.0),
        }
    }
}
