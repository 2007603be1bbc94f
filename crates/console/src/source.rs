//! Sources of a window's pictures, and the place of a recording: the same with and without a window in the build.
//!
//! A running core and a recording are each a [`Source`]; the sensors of a live run are [`Sensors`]. Drawing is left to `gui`.

use std::path::PathBuf;
use std::sync::Arc;

use wire::id::UnitId;
use wire::time::{Instant, Span};

use crate::act::Act;
use crate::beside::{Beside, Sight};
use crate::moment::Moment;
use crate::shown::Shown;
use crate::site::Site;

/// Where pictures come from, and where acts go. No call waits.
pub trait Source {
    /// The newest picture, if it is newer than the last one asked for, and for how long it has lain ready.
    fn newest(&mut self) -> Option<(Arc<Shown>, Span)>;
    /// Hands an act over. What comes of it is in the pictures; false where nobody took it.
    #[must_use]
    fn send(&mut self, act: Act) -> bool;
    /// Where the recording stands; `None` when this is live.
    fn tape(&mut self) -> Option<Tape> {
        None
    }
    /// What the recording has of a moment beside what was shown.
    fn beside(&mut self, _at: Instant) -> Beside {
        Beside::default()
    }
    /// Goes elsewhere in the recording.
    fn seek(&mut self, _to: Seek) {}
    /// Whether there will be no picture any more: the window closes.
    fn over(&mut self) -> bool {
        false
    }
}

/// Tells the window, from any thread, that a picture has come.
pub type Wake = Box<dyn Fn() + Send>;

/// How the window is to be.
#[derive(Clone, Debug)]
pub struct Looks {
    /// In the title.
    pub title: String,
    /// Whom commands go to first.
    pub unit: UnitId,
    /// Beneath the map.
    pub site: Site,
    /// Where layouts are kept between two runs; nowhere when absent.
    pub layout: Option<PathBuf>,
}

/// Where a recording stands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tape {
    /// Now, from the recording's beginning.
    pub at: Span,
    /// Its length.
    pub length: Span,
    /// How long after the recording's beginning the run's time began: what is written is the run's.
    pub lead: Span,
    /// What one may want to jump to, in order.
    pub moments: Vec<Moment>,
    /// Whether it runs by itself.
    pub playing: bool,
}

/// Where to go in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seek {
    /// To this time from its beginning.
    To(Span),
    /// So many pictures on, or back.
    Step(i32),
    /// Let it run, or stand.
    Play(bool),
}

/// What the sensors gave last.
#[derive(Clone, Debug)]
pub struct Sensed {
    /// Sensor by sensor.
    pub sights: Arc<[Sight]>,
    /// How long ago that was, at least.
    pub at_least: Span,
    /// And at most, once that is known.
    pub at_most: Option<Span>,
}

/// Who reads them. No call waits.
pub trait Sensors {
    /// What they gave last; nothing before the first.
    fn newest(&mut self) -> Option<Sensed>;
    /// Why nothing comes, or not all, where that is known.
    fn trouble(&mut self) -> Option<String>;
    /// Whether nothing more will come: the window closes.
    fn over(&mut self) -> bool;
}
