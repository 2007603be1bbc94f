//! Sources of a window's pictures, and the place of a recording: the same with and without a window in the build.
//!
//! A running core and a recording are each a [`Source`]; the sensors of a live run are [`Sensors`]. Drawing is left to
//! `gui`.

use std::path::PathBuf;
use std::sync::Arc;

use wire::id::UnitId;
use wire::time::{Instant, Span};

use crate::act::Act;
use crate::moment::Moment;
use crate::shown::Shown;
use crate::sidecar::{Sidecar, Sight};
use crate::site::Site;

/// Source of pictures, and sink of acts. No call waits.
pub trait Source {
    /// The newest picture, if it is newer than the last one asked for, and for how long it has lain ready.
    fn newest(&mut self) -> Option<(Arc<Shown>, Span)>;
    /// Hands an act over. Its result is in the pictures; false if it was not taken.
    #[must_use]
    fn send(&mut self, act: Act) -> bool;
    /// Position of the recording; `None` if this is live.
    fn tape(&mut self) -> Option<Tape> {
        None
    }
    /// Evidence of a moment of the recording.
    fn sidecar(&mut self, _at: Instant) -> Sidecar {
        Sidecar::default()
    }
    /// Another recording at the same time of its run; `None` if there is only one.
    fn beside(&mut self) -> Option<Beside> {
        None
    }
    /// Goes elsewhere in the recording.
    fn seek(&mut self, _to: Seek) {}
    /// True if there will be no picture any more: the window closes.
    fn is_closed(&mut self) -> bool {
        false
    }
}

/// Tells the window, from any thread, that a picture has come.
pub type Wake = Box<dyn Fn() + Send>;

/// Appearance of the window.
#[derive(Clone, Debug)]
pub struct Looks {
    /// Text of the title.
    pub title: String,
    /// Whom commands go to first.
    pub unit: UnitId,
    /// Beneath the map.
    pub site: Site,
    /// File of the layouts between runs; absent: they are not kept.
    pub layout: Option<PathBuf>,
}

/// Position in a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tape {
    /// Now, from the recording's beginning.
    pub at: Span,
    /// Length of the recording.
    pub length: Span,
    /// Offset of the run's start from the recording's beginning: written times are the run's.
    pub lead: Span,
    /// Jump targets, in order.
    pub moments: Vec<Moment>,
    /// True if it runs by itself.
    pub playing: bool,
}

/// A recording beside another one.
#[derive(Clone, Debug)]
pub struct Beside {
    /// Name of the first recording.
    pub own: String,
    /// Name of the one beside it.
    pub name: String,
    /// Its picture at the same time of its run.
    pub shown: Arc<Shown>,
    /// Beneath its map.
    pub site: Arc<Site>,
}

/// A destination in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seek {
    /// To this time from its beginning.
    To(Span),
    /// A given number of pictures on, or back.
    Step(i32),
    /// Let it run, or stand.
    Play(bool),
}

/// The newest sensor pictures.
#[derive(Clone, Debug)]
pub struct Sensed {
    /// Sensor by sensor.
    pub sights: Arc<[Sight]>,
    /// Lower bound of their age.
    pub at_least: Span,
    /// Upper bound of their age, once known.
    pub at_most: Option<Span>,
}

/// A reader of sensor pictures. No call waits.
pub trait Sensors {
    /// The newest pictures; `None` before the first.
    fn newest(&mut self) -> Option<Sensed>;
    /// Reason for missing pictures, where known.
    fn trouble(&mut self) -> Option<String>;
    /// True if the stream has ended: the window closes.
    fn is_ended(&mut self) -> bool;
}

/// No window can be opened, with the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoWindow {
    /// The program was built without it.
    #[error(
        "this build has no window: `cargo run --release --features window -- …`, or look from a terminal with `holdsafe watch`"
    )]
    NotBuilt,
    /// The display, or a library that it takes, is missing.
    #[error("{0}")]
    Display(String),
    /// The display refused it.
    #[error("the window cannot be opened: {0}")]
    Refused(String),
}
