//! The thermal stage as the veto that it is: does it tell a true claim from a false one?
//!
//! Each vehicle and person, under its own name, should be as warm as its class; each decoy and obstacle that is called a
//! vehicle should be found out. Balanced accuracy is the mean of the two shares; what was heated to
//! deceive is counted apart. Boxes are the true ones, so that the
//! detector's errors are not the thermal stage's.

use perception::corroborate::thermal::{Warmth, judge};
use perception::detector::Detector;
use perception::thermal;
use serde::Serialize;
use wire::sensor::{Class, Detection};

use crate::example::{Example, counts};

/// What is warmer than the ground by so much was heated, kelvin.
pub const HEATED_K: f32 = 8.0;

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
    /// False claims of what is warmer than the ground by [`HEATED_K`] and more, apart from those.
    pub heated: u32,
    /// Those of them that warmth contradicts.
    pub heated_contradicted: u32,
}

impl Claims {
    /// Adds those of one frame.
    pub fn add(&mut self, network: &Detector, example: &Example) {
        let frame = &example.frame;
        let Some(blobs) = thermal::blobs(network, &frame.thermal, frame.width, frame.height) else { return };
        for label in frame.labels.iter().filter(|l| counts(l)) {
            let claim = |class| judge(&Detection { class, score: 1000, bounds: label.bounds }, Some(&blobs));
            match label.class {
                Class::Vehicle | Class::Person => {
                    self.honest += 1;
                    self.supported += u32::from(claim(label.class) == Warmth::Fits);
                }
                Class::Decoy | Class::Obstacle => {
                    let object = &example.scene.objects[usize::from(label.object.0)];
                    let heated = object.kelvin >= example.scene.ground.kelvin + HEATED_K;
                    let found_out = u32::from(claim(Class::Vehicle) == Warmth::Contradicts);
                    let (claims, contradicted) = match heated {
                        true => (&mut self.heated, &mut self.heated_contradicted),
                        false => (&mut self.false_claims, &mut self.contradicted),
                    };
                    (*claims, *contradicted) = (*claims + 1, *contradicted + found_out);
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
