//! The thermal stage as the veto that it is: does it tell a true claim from a false one?
//!
//! Each vehicle and person, under its own name, should be as warm as its class; each decoy and obstacle that is called a
//! vehicle should be found out. Balanced accuracy is the mean of the two shares. Boxes are the true ones, so that the
//! detector's errors are not the thermal stage's.

use perception::corroborate::thermal::{Warmth, judge};
use perception::detector::Detector;
use perception::thermal;
use serde::Serialize;
use wire::id::ObjectId;
use wire::sensor::{Class, Detection};

use crate::example::{Example, counts};

/// Claims, and how the stage judged them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Claims {
    /// True claims.
    pub honest: u32,
    /// True claims that warmth supports.
    pub supported: u32,
    /// False claims.
    pub false_claims: u32,
    /// False claims that warmth contradicts.
    pub contradicted: u32,
}

impl Claims {
    /// Adds the detections of one frame that are about objects `of` it.
    pub fn add(&mut self, network: &Detector, example: &Example, of: impl Fn(ObjectId) -> bool) {
        let frame = &example.frame;
        let Some(blobs) = thermal::blobs(network, &frame.thermal, frame.width, frame.height) else { return };
        for label in frame.labels.iter().filter(|l| counts(l) && of(l.object)) {
            let claim = |class| judge(&Detection { class, score: 1000, bounds: label.bounds }, Some(&blobs));
            match label.class {
                Class::Vehicle | Class::Person => {
                    self.honest += 1;
                    self.supported += u32::from(claim(label.class) == Warmth::Fits);
                }
                Class::Decoy | Class::Obstacle => {
                    self.false_claims += 1;
                    self.contradicted += u32::from(claim(Class::Vehicle) == Warmth::Contradicts);
                }
            }
        }
    }

    /// Mean of the shares judged rightly; `None` without claims of both kinds.
    pub fn balanced_accuracy(&self) -> Option<f64> {
        let share = |of: u32, n: u32| (n > 0).then(|| f64::from(of) / f64::from(n));
        Some(0.5 * (share(self.supported, self.honest)? + share(self.contradicted, self.false_claims)?))
    }
}
