//! The air at a body that flies: wind and gusts.
//!
//! The gusts are the Dryden model's first-order forms (MIL-F-8785C, 3.7.1.2), for the horizontal components and, at
//! half the deviation, the vertical one; the body's airspeed sets their time. The model's second-order lateral forms
//! are left out: a body in a hover has no flight path that they could be lateral to.

use rapier3d::prelude::Vector;

use crate::noise::{Noise, Stream};
use crate::wind::Wind;
use crate::world::DT;

/// Least airspeed by which the gusts pass, m/s: turbulence decays in still air too.
const LEAST_AIRSPEED: f32 = 1.0;

/// Length of gusts where none is stated, metres: MIL-F-8785C's at 4 m height.
const LENGTH_M: f32 = 50.0;

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
            let airspeed = (velocity - mean(&self.wind)).length().max(LEAST_AIRSPEED);
            // The exact step of a first-order process: its deviation stays what it is at any airspeed.
            let kept = libm::expf(-airspeed * DT / length);
            let fresh = gust_m_s * (1.0 - kept * kept).max(0.0).sqrt();
            self.noise.seek(self.steps);
            let mut drawn = |share: f32| share * fresh * self.noise.normal();
            self.gust = self.gust * kept + Vector::new(drawn(1.0), drawn(1.0), drawn(0.5));
        }
        mean(&self.wind) + self.gust
    }
}

fn mean(wind: &Wind) -> Vector {
    Vector::new(wind.east_m_s, wind.north_m_s, 0.0)
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
