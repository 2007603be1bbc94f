//! Between the core's loop and a window: pictures one way, of which the newest counts, and a person's acts the other.
//!
//! The loop is `link`'s as in every process; here the core is only looked at after each of its turns. A window cannot
//! hold the loop up: it takes a picture when it likes, and its acts go through a bounded queue into the core as inputs,
//! and so into the input journal. Drawing is left to `gui`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};

use link::clock::trace_us;
use link::drive::{self, Hand};
use link::spec::ServiceSpec;
use serde_json::json;
use wire::codec;
use wire::core::{Core, Input, Output};
use wire::person::{Act, Numbered};
use wire::time::{Instant, Span};

use super::open;
use crate::Console;
use crate::shown::Shown;
use crate::site::Site;
use crate::source::{Looks, Source, Wake};

/// A window is woken so often at least, so that ages are seen to grow: five times a second.
const WAKE_EVERY: Span = Span::ms(200);

// To take note of all of them is one press.
const _: () = assert!(drive::ACTS > crate::alarms::MAX_ALARMS);

#[derive(Default)]
struct Slot {
    /// The newest picture, and the time at which it was put there.
    newest: Option<(Arc<Shown>, u64)>,
    wake: Option<Wake>,
    over: bool,
}

/// Place of the newest picture.
#[derive(Clone, Default)]
pub struct Pictures(Arc<Mutex<Slot>>);

impl Pictures {
    /// Puts a picture there in place of the one before.
    fn put(&self, shown: Shown) {
        self.slot(|slot| slot.newest = Some((Arc::new(shown), trace_us())));
    }

    fn wake(&self) {
        self.slot(|slot| slot.wake.iter().for_each(|wake| wake()));
    }

    /// Takes the newest picture, if it has not been taken, and says for how long it lay there.
    pub fn take(&self) -> Option<(Arc<Shown>, Span)> {
        let (shown, put) = self.slot(|slot| slot.newest.take())?;
        Some((shown, Span(trace_us().saturating_sub(put))))
    }

    /// Has `wake` called whenever there is something to be drawn.
    pub fn on_arrival(&self, wake: Wake) {
        self.slot(|slot| slot.wake = Some(wake));
    }

    /// The loop has ended: no more pictures will come.
    pub fn end(&self) {
        self.slot(|slot| slot.over = true);
        self.wake();
    }

    /// True if the loop has ended.
    pub fn is_closed(&self) -> bool {
        self.slot(|slot| slot.over)
    }

    fn slot<T>(&self, act: impl FnOnce(&mut Slot) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// A console that is looked at after each of its turns.
pub struct LookedAt {
    console: Console,
    pictures: Pictures,
    last: Option<Shown>,
    woken: Instant,
}

impl LookedAt {
    /// Puts the pictures of `console` into `pictures`.
    pub fn new(console: Console, pictures: Pictures) -> Self {
        Self { console, pictures, last: None, woken: Instant(0) }
    }
}

impl Core for LookedAt {
    fn handle(&mut self, now: Instant, input: &Input) {
        self.console.handle(now, input);
        let shown = self.console.shown(now);
        let wakes = now.since(self.woken) >= WAKE_EVERY || self.last.as_ref().is_none_or(|last| differs(last, &shown));
        self.pictures.put(shown.clone());
        if wakes {
            (self.last, self.woken) = (Some(shown), now);
            self.pictures.wake();
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.console.deadline()
    }

    fn output(&mut self) -> Option<Output> {
        self.console.output()
    }
}

/// True if a person should see the new picture at once: something other than numbers has changed.
fn differs(last: &Shown, now: &Shown) -> bool {
    let faces = |shown: &Shown| -> Vec<_> {
        let unit = |unit: &crate::shown::ShownUnit| {
            let (state, freshness) = unit.state.get();
            (unit.unit, state.mode, state.authority.is_some(), freshness, unit.lost.len())
        };
        shown.units.iter().map(unit).collect()
    };
    faces(last) != faces(now)
        || (&last.alarms, &last.commands, &last.prepared) != (&now.alarms, &now.commands, &now.prepared)
        || (&last.answers, last.sound) != (&now.answers, now.sound)
}

/// The person at the window: gives each act its own number.
pub struct Person {
    hand: Hand,
    given: u64,
}

impl Person {
    /// A person at the window, with acts that go to `hand`.
    pub fn new(hand: Hand) -> Self {
        Self { hand, given: 0 }
    }

    /// Does it, once. False when it could not be given: too many acts wait, or the loop has ended.
    #[must_use]
    pub fn does(&mut self, act: Act) -> bool {
        self.given += 1;
        self.hand.give(codec::encode(&Numbered { serial: self.given, act }))
    }
}

/// The running core, for the window.
struct Live {
    pictures: Pictures,
    person: Person,
}

impl Source for Live {
    fn newest(&mut self) -> Option<(Arc<Shown>, Span)> {
        self.pictures.take()
    }

    fn send(&mut self, act: Act) -> bool {
        self.person.does(act)
    }

    fn is_closed(&mut self) -> bool {
        self.pictures.is_closed()
    }
}

/// Runs the core on its own thread and the window on this one, until the launcher ends the run. A window that is
/// closed reports it to the launcher, which then does.
pub(super) fn run(spec: ServiceSpec, console: Console, site: Site) -> ExitCode {
    let pictures = Pictures::default();
    let (hand, acts) = drive::hands();
    let unit = console.first();
    let (looked_at, ends) = (LookedAt::new(console, pictures.clone()), pictures.clone());
    let core = std::thread::Builder::new().name("core".into()).spawn(move || {
        let code = drive::run_for(spec, Box::new(looked_at), acts);
        ends.end();
        code
    });
    let core = match core {
        Ok(core) => core,
        Err(why) => {
            link::note!("holdsafe-console: no thread for the core: {why}");
            return ExitCode::from(2);
        }
    };
    let looks = Looks { title: "holdsafe console".to_owned(), unit, site, layout: layout() };
    let live = Live { pictures: pictures.clone(), person: Person::new(hand) };
    let refused = open::console(looks, Box::new(live), move |wake| pictures.on_arrival(wake)).err();
    let reason = refused.map(|error| error.to_string());
    drive::print_line("closed", &json!(reason));
    core.join().unwrap_or(ExitCode::FAILURE)
}

/// File of the layout between runs: in the user's own folder, if there is one.
pub(super) fn layout() -> Option<PathBuf> {
    let home = std::env::var_os("HOME").filter(|home| !home.is_empty())?;
    Some(PathBuf::from(home).join(".config/holdsafe/console.json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refused_acts_are_returned_and_numbers_unique() {
        let (hand, _acts) = link::drive::hands();
        let mut person = Person::new(hand);
        let withdrawn = (0..2 * drive::ACTS).filter(|_| person.does(Act::Withdraw)).count();
        assert_eq!(withdrawn, drive::ACTS);
        assert_eq!(person.given, 2 * drive::ACTS as u64);
    }
}
