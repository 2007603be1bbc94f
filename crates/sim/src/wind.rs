//! Wind: a mean and gusts on it.
//!
//! The gusts are the Dryden model's first-order forms (MIL-F-8785C, 3.7.1.2), for the horizontal components and, at half the deviation, the
//! vertical one; the air that moves past the body at its airspeed is what sets their time. The model's second-order lateral forms
//! are left out: a body in a hover has no flight path that they could be lateral to.

use rapier3d::prelude::Vector;
use serde::{Deserialize, Serialize};

use crate::limits::{SceneError, within};
use crate::noise::{Noise, Stream};
use crate::world::DT;

/// Least airspeed by which the gusts pass, m/s: turbulence decays in still air too.
const LEAST_AIRSPEED: f32 = 1.0;

/// Wind over a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Wind {
    /// Mean towards the east, m/s.
    pub east_m_s: f32,
    /// Mean towards the north, m/s.
    pub north_m_s: f32,
    /// Deviation of the horizontal gusts, m/s.
    pub gust_m_s: f32,
    /// Length of the gusts, metres; 0: 50 m.
    pub length_m: f32,
}

/// Length of gusts where none is stated, metres: MIL-F-8785C's at 4 m height.
const LENGTH_M: f32 = 50.0;

impl Wind {
    /// # Errors
    /// A value that is no number or out of range.
    pub fn check(&self) -> Result<(), SceneError> {
        within("wind.east_m_s", self.east_m_s, -20.0, 20.0)?;
        within("wind.north_m_s", self.north_m_s, -20.0, 20.0)?;
        within("wind.gust_m_s", self.gust_m_s, 0.0, 10.0)?;
        within("wind.length_m", self.length_m, 0.0, 1000.0)
    }

    fn mean(&self) -> Vector {
        Vector::new(self.east_m_s, self.north_m_s, 0.0)
    }
}

/// The air at the body, step by step.
#[derive(Clone, Debug)]
pub(crate) struct Air {
    wind: Wind,
    noise: Noise,
    steps: u64,
    gust: Vector,
}

impl Air {
    pub(crate) fn new(wind: Wind, seed: u64) -> Self {
        Air { wind, noise: Noise::new(seed, Stream::Wind), steps: 0, gust: Vector::ZERO }
    }

    /// Velocity of the air in the step that follows, world frame, m/s, past a body that moves at `velocity`.
    pub(crate) fn step(&mut self, velocity: Vector) -> Vector {
        self.steps += 1;
        let Wind { gust_m_s, length_m, .. } = self.wind;
        if gust_m_s > 0.0 {
            let length = if length_m > 0.0 { length_m } else { LENGTH_M };
            let airspeed = (velocity - self.wind.mean()).length().max(LEAST_AIRSPEED);
            // The exact step of a first-order process: its deviation stays what it is at any airspeed.
            let kept = libm::expf(-airspeed * DT / length);
            let fresh = gust_m_s * (1.0 - kept * kept).max(0.0).sqrt();
            self.noise.seek(self.steps);
            let mut drawn = |share: f32| share * fresh * self.noise.normal();
            self.gust = self.gust * kept + Vector::new(drawn(1.0), drawn(1.0), drawn(0.5));
        }
        self.wind.mean() + self.gust
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calm_air_stands_still() {
        let mut air = Air::new(Wind::default(), 1);
        assert!((0..100).all(|_| air.step(Vector::X) == Vector::ZERO));
    }

    /// Deviation and correlation over 2,000 lengths.
    #[test]
    fn gusts_have_the_deviation_and_length_that_are_stated() {
        let wind = Wind { east_m_s: 0.0, north_m_s: 0.0, gust_m_s: 2.0, length_m: 5.0 };
        let mut air = Air::new(wind, 7);
        let speed = Vector::new(10.0, 0.0, 0.0);
        let east: Vec<f32> = (0..100_000).map(|_| air.step(speed).x).collect();
        let n = east.len() as f32;
        let square = |lag: usize| east.iter().zip(&east[lag..]).map(|(a, b)| a * b).sum::<f32>() / n;
        let deviation = square(0).sqrt();
        assert!((deviation - 2.0).abs() < 0.15, "{deviation}");
        // Half a second at 10 m/s is one length.
        let after_one_length = square(50) / square(0);
        assert!((after_one_length - 0.368).abs() < 0.06, "{after_one_length}");
    }
}
