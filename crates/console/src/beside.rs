//! What a recording has beside what was shown, moment by moment: what the unit's sensors gave, and why its mode changed. For whoever looks
//! at evidence.
//!
//! No console that runs has it, for it does not reach the control domain; and no view of what was shown is made of it. Finding it in a
//! recording, and reading it, is left to whoever opens that.

use std::sync::Arc;

use wire::time::{Instant, Span};

/// A picture: three bytes a pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green and blue of each.
    pub rgb: Vec<u8>,
}

/// What was found in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Its left, upper, right and lower edge, pixels.
    pub edges: [f32; 4],
    /// What it is taken for, and how surely.
    pub says: String,
}

/// One sensor's product.
#[derive(Clone, Debug, PartialEq)]
pub struct Sight {
    /// Of which sensor.
    pub name: &'static str,
    /// What its shades mean.
    pub legend: &'static str,
    /// Absent where it gave nothing.
    pub image: Option<Image>,
    /// What was found in it.
    pub marks: Vec<Mark>,
}

/// What there is of one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beside {
    /// The newest that perception had taken in and that was kept, sensor by sensor, and how long before.
    pub sensed: Option<(Arc<[Sight]>, Span)>,
    /// Why the mode is what it is, by what the services logged; line by line.
    pub because: Option<Arc<str>>,
}

impl Beside {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.sensed.is_none() && self.because.is_none()
    }
}

/// Who has it.
pub trait Evidence {
    /// When the run's time began, on the console's clock.
    fn began(&self) -> Option<Instant>;
    /// What there is of `at`, a time of the console's clock.
    fn at(&mut self, at: Instant) -> Beside;
}
