//! Evidence that a recording holds beside the displayed values, moment by moment: the unit's sensor pictures and the
//! reasons for its mode. For those who examine evidence.
//!
//! No running console has it, for it does not reach the control domain; and no view of displayed values is built from
//! it. Finding and reading it in a recording is left to the program that opens the recording.

use std::borrow::Cow;
use std::sync::Arc;

use wire::time::{Instant, Span};

/// A picture: three bytes a pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Number of pixel rows.
    pub height: usize,
    /// Red, green and blue of each.
    pub rgb: Vec<u8>,
}

/// A detection in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Left, upper, right and lower edge, pixels.
    pub edges: [f32; 4],
    /// Class and confidence of the detection.
    pub says: String,
}

/// Product of one sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Sight {
    /// Name of the sensor.
    pub name: &'static str,
    /// Legend of the shades.
    pub legend: Cow<'static, str>,
    /// Absent where the sensor gave none.
    pub image: Option<Image>,
    /// Detections in it.
    pub marks: Vec<Mark>,
}

/// Evidence of one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sidecar {
    /// The newest that perception had taken in and that was kept, sensor by sensor, and how long before.
    pub sensed: Option<(Arc<[Sight]>, Span)>,
    /// Reasons for the mode, from the services' logs; one a line.
    pub because: Option<Arc<str>>,
}

impl Sidecar {
    /// True if there is no evidence of this moment.
    pub fn is_empty(&self) -> bool {
        self.sensed.is_none() && self.because.is_none()
    }
}

/// A source of evidence.
pub trait EvidenceSource {
    /// Start of the run's time, on the console's clock.
    fn began(&self) -> Option<Instant>;
    /// Evidence of `time`, a time of the console's clock.
    fn evidence_at(&mut self, time: Instant) -> Sidecar;
}
