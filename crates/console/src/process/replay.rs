//! A recording in the window: the player behind the same views, running by itself when it is told to.

use std::path::Path;
use std::sync::Arc;

use link::clock::trace_us;
use wire::person::Act;
use wire::time::{Instant, Span};

use super::player::{Player, PlayerError};
use super::window::layout;
use crate::gui::app::{self, Looks, Source};
use crate::gui::replay::{Seek, Tape};
use crate::sensed::{Sensed, Sensing};
use crate::shown::Shown;
use crate::site::Site;

/// A recording, opened.
pub struct Recorded {
    player: Player,
    site: Site,
    sensing: Option<Box<dyn Sensing>>,
}

/// Opens the recording below `run_dir`.
///
/// # Errors
/// When something of it is missing or is no recording.
pub fn open(run_dir: &Path) -> Result<Recorded, PlayerError> {
    let (player, config) = Player::open(run_dir)?;
    Ok(Recorded { player, site: config.window.unwrap_or_default(), sensing: None })
}

impl Recorded {
    /// With what the sensors gave, beside what was shown.
    #[must_use]
    pub fn sensed_by(self, sensing: Box<dyn Sensing>) -> Self {
        Self { sensing: Some(sensing), ..self }
    }

    /// Shows it in a window, until that is closed.
    ///
    /// # Errors
    /// When the window cannot be opened.
    pub fn show(self) -> Result<(), String> {
        let unit = self.player.first();
        let looks = Looks { title: "holdsafe console: REPLAY".to_owned(), unit, site: self.site, layout: layout() };
        let source = Running { player: self.player, sensing: self.sensing, since: None, new: true };
        app::run(looks, Box::new(source), |_wake| {}).map_err(|why| format!("the window cannot be opened: {why}"))
    }
}

/// The player with the time at which it was set running, and from where.
struct Running {
    player: Player,
    sensing: Option<Box<dyn Sensing>>,
    since: Option<(Instant, Span)>,
    /// Whether there is a picture that was not drawn.
    new: bool,
}

impl Source for Running {
    fn newest(&mut self) -> Option<Arc<Shown>> {
        if let Some((set_off, from)) = self.since {
            self.player.seek(from + Instant(trace_us()).since(set_off));
            self.new = true;
            if self.player.at() >= self.player.length() {
                self.since = None;
            }
        }
        std::mem::take(&mut self.new).then(|| Arc::new(self.player.shown()))
    }

    /// Nothing can be done in a recording.
    fn send(&mut self, _: Act) {}

    fn tape(&mut self) -> Option<Tape> {
        let (at, length) = (self.player.at(), self.player.length());
        Some(Tape { at, length, moments: self.player.moments().to_vec(), playing: self.since.is_some() })
    }

    fn sensed(&mut self, at: Instant) -> Option<Arc<Sensed>> {
        self.sensing.as_mut()?.at(at)
    }

    fn seek(&mut self, to: Seek) {
        match to {
            Seek::To(at) => self.player.seek(at),
            Seek::Step(by) => self.player.step(by),
            Seek::Play(true) => {
                self.since = Some((Instant(trace_us()), self.player.at()));
                return;
            }
            Seek::Play(false) => {}
        }
        // Whoever goes somewhere wants to stay there.
        (self.since, self.new) = (None, true);
    }
}
