//! A recording in the window: the player behind the same views, running by itself on request.

use std::path::Path;
use std::sync::Arc;

use link::clock::trace_us;
use wire::person::Act;
use wire::time::{Instant, Span};

use super::open;
use super::player::{Player, PlayerError};
use super::window::layout;
use crate::shown::Shown;
use crate::sidecar::{EvidenceSource, Sidecar};
use crate::site::Site;
use crate::source::NoWindow;
use crate::source::{Beside, Looks, Seek, Source, Tape};

/// A recording, opened.
pub struct Recorded {
    name: String,
    player: Player,
    site: Site,
    evidence: Option<Box<dyn EvidenceSource>>,
    beside: Option<Box<Recorded>>,
}

/// Opens the recording below `run_dir`.
///
/// # Errors
/// When something of it is missing or is no recording.
pub fn open(run_dir: &Path) -> Result<Recorded, PlayerError> {
    let (player, config) = Player::open(run_dir)?;
    let (name, site) = (name_of(run_dir), config.window.unwrap_or_default().sound());
    Ok(Recorded { name, player, site, evidence: None, beside: None })
}

/// Name of a run by its folder: the last two parts of the path.
pub fn name_of(run_dir: &Path) -> String {
    let parts: Vec<_> = run_dir.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    parts[parts.len().saturating_sub(2)..].join("/")
}

impl Recorded {
    /// Adds this evidence.
    #[must_use]
    pub fn sidecar(mut self, evidence: Box<dyn EvidenceSource>) -> Self {
        evidence.began().into_iter().for_each(|began| self.player.count_from(began));
        Self { evidence: Some(evidence), ..self }
    }

    /// Marks the recording as no evidence, with the reason.
    #[must_use]
    pub fn invalid(self, reason: String) -> Self {
        Self { player: self.player.invalid(reason), ..self }
    }

    /// Shows another recording beside it, at the same time of its run.
    #[must_use]
    pub fn beside(self, other: Recorded) -> Self {
        Self { beside: Some(Box::new(other)), ..self }
    }

    /// Shows it in a window, until that is closed or `is_over`.
    ///
    /// # Errors
    /// When the window cannot be opened.
    pub fn show(self, is_over: impl Fn() -> bool + 'static) -> Result<(), NoWindow> {
        let unit = self.player.first();
        let invalid = if self.player.shown().marks.invalid.is_some() { ", INVALID" } else { "" };
        let looks =
            Looks { title: format!("holdsafe console: REPLAY{invalid}"), unit, site: self.site, layout: layout() };
        let source = Running {
            player: self.player,
            evidence: self.evidence,
            beside: self.beside.map(|other| Other::new(self.name, *other)),
            since: None,
            new: true,
            over: Box::new(is_over),
        };
        open::console(looks, Box::new(source), |_wake| {})
    }
}

/// The player with the time at which it was set running, and from where.
struct Running {
    player: Player,
    evidence: Option<Box<dyn EvidenceSource>>,
    beside: Option<Other>,
    since: Option<(Instant, Span)>,
    /// True if there is a picture that was not drawn.
    new: bool,
    /// True if the window is to close.
    over: Box<dyn Fn() -> bool>,
}

/// The recording beside the one that is played.
struct Other {
    own: String,
    name: String,
    player: Player,
    site: Arc<Site>,
}

impl Other {
    fn new(own: String, other: Recorded) -> Self {
        Self { own, name: other.name, player: other.player, site: Arc::new(other.site) }
    }

    /// Its picture at a time of the run.
    fn at(&mut self, position: Span, lead: Span) -> Beside {
        let to = (position + self.player.lead()).0.saturating_sub(lead.0);
        self.player.seek(Span(to));
        let (own, name) = (self.own.clone(), self.name.clone());
        Beside { own, name, shown: Arc::new(self.player.shown()), site: Arc::clone(&self.site) }
    }
}

impl Source for Running {
    fn newest(&mut self) -> Option<(Arc<Shown>, Span)> {
        if let Some((set_off, from)) = self.since {
            self.player.seek(from + Instant(trace_us()).since(set_off));
            self.new = true;
            if self.player.position() >= self.player.length() {
                self.since = None;
            }
        }
        std::mem::take(&mut self.new).then(|| (Arc::new(self.player.shown()), Span::ZERO))
    }

    /// No act is possible in a recording.
    fn send(&mut self, _: Act) -> bool {
        true
    }

    fn is_closed(&mut self) -> bool {
        (self.over)()
    }

    fn tape(&mut self) -> Option<Tape> {
        let (at, length, lead) = (self.player.position(), self.player.length(), self.player.lead());
        Some(Tape { at, length, lead, moments: self.player.moments().to_vec(), playing: self.since.is_some() })
    }

    fn beside(&mut self) -> Option<Beside> {
        let (position, lead) = (self.player.position(), self.player.lead());
        self.beside.as_mut().map(|other| other.at(position, lead))
    }

    fn sidecar(&mut self, time: Instant) -> Sidecar {
        self.evidence.as_mut().map_or_else(Sidecar::default, |evidence| evidence.evidence_at(time))
    }

    fn seek(&mut self, to: Seek) {
        match to {
            Seek::To(at) => self.player.seek(at),
            Seek::Step(by) => self.player.step(by),
            Seek::Play(true) => {
                // The only way from the end is back.
                if self.player.position() >= self.player.length() {
                    self.player.seek(Span::ZERO);
                }
                self.since = Some((Instant(trace_us()), self.player.position()));
                return;
            }
            Seek::Play(false) => {}
        }
        // A person who goes somewhere wants to stay there.
        (self.since, self.new) = (None, true);
    }
}
