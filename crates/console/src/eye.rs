//! Eye of the scripted operator: whether a person could tell by the shown image that a track is no vehicle.
//!
//! After Johnson, *Analysis of image forming systems* (1958): half of all observers identify an object with 6.4 cycles,
//! each of two pixels, across its smaller side. The share for other numbers is the target transfer probability function
//! of the ACQUIRE model: `r^e / (1 + r^e)` with `r` the ratio to that number and `e = 2.7 + 0.7 r`. One draw a trial
//! says how good this observer is, so that a longer look at the same image tells no more. An observer who cannot tell
//! is assumed to use the machine: people misuse such an aid and leave it unused (Dzindolet et al., *Predicting misuse
//! and disuse of combat identification systems*, 2001), and this is the worse of the two here. A fake beside the way of
//! a vehicle that moves is never seen through.
//!
//! A model for campaigns, not a statement about people. Knowledge of the vehicles that are real is given by the
//! scenario; the person at the window has no part in it.

use serde::{Deserialize, Serialize};
use wire::report::ReportedTrack;

/// Furthest that a track may be from a vehicle that it is held for, millimetres.
const NEAR_MM: f64 = 1_500.0;

/// An observer, and the vehicles that are real.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Eye {
    /// Cycles from which half of all observers identify, thousandths.
    pub cycles_milli: u32,
    /// Share of observers who are better than this one, millionths.
    pub better_ppm: u32,
    /// Places of the vehicles that are real, millimetres east and north; of one that moves, of its whole way.
    pub vehicles: Vec<(i32, i32)>,
}

impl Eye {
    /// True if this observer can tell that the track is no vehicle, by an image in which every `scale` pixels of the
    /// camera are one.
    pub fn sees_through(&self, track: &ReportedTrack, scale: u8) -> bool {
        let distance = |(x, y): &(i32, i32)| {
            libm::hypot(f64::from(*x) - f64::from(track.x_mm), f64::from(*y) - f64::from(track.y_mm))
        };
        let real = self.vehicles.iter().any(|place| distance(place) <= NEAR_MM);
        !real && self.identifies(track.across_px / u16::from(scale.max(1)))
    }

    fn identifies(&self, across_px: u16) -> bool {
        let ratio = f64::from(across_px) / 2.0 * 1000.0 / f64::from(self.cycles_milli.max(1));
        let odds = libm::pow(ratio, 2.7 + 0.7 * ratio);
        // Beyond every float, all identify.
        let share = if odds.is_finite() { odds / (1.0 + odds) } else { 1.0 };
        f64::from(self.better_ppm) < share * 1e6
    }
}
