//! Content of a log entry, of whichever kind: what readers of a whole log decode.

use core::fmt;

use minicbor::encode::Write;
use minicbor::{Decode, Decoder, Encode, Encoder};
use wire::audit;
use wire::event::Event;

use crate::note::{Note, is_note};

/// A service's event or a note of the instrument. Its bytes, its JSON and its text are as of its content.
#[derive(Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(untagged)]
pub enum Any {
    /// An event of a service.
    Service(Event),
    /// A note of the instrument.
    Instrument(Note),
}

/// An entry of any chain.
pub type Entry = audit::Entry<Any>;

impl From<Event> for Any {
    fn from(event: Event) -> Any {
        Any::Service(event)
    }
}

impl From<Note> for Any {
    fn from(note: Note) -> Any {
        Any::Instrument(note)
    }
}

impl fmt::Debug for Any {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Any::Service(event) => event.fmt(f),
            Any::Instrument(note) => note.fmt(f),
        }
    }
}

impl<C> Encode<C> for Any {
    fn encode<W: Write>(&self, e: &mut Encoder<W>, ctx: &mut C) -> Result<(), minicbor::encode::Error<W::Error>> {
        match self {
            Any::Service(event) => event.encode(e, ctx),
            Any::Instrument(note) => note.encode(e, ctx),
        }
    }
}

impl<'b, C> Decode<'b, C> for Any {
    fn decode(d: &mut Decoder<'b>, ctx: &mut C) -> Result<Self, minicbor::decode::Error> {
        // An entry without a number is of neither type: the error is the one of a service's event, with its place.
        if number(d).is_some_and(is_note) {
            Note::decode(d, ctx).map(Any::Instrument)
        } else {
            Event::decode(d, ctx).map(Any::Service)
        }
    }
}

/// The number that is next, where there is one.
fn number(d: &mut Decoder<'_>) -> Option<u32> {
    let mut ahead = d.probe();
    ahead.array().ok()?;
    ahead.u32().ok()
}

/// True if an encoded entry is one that a step of an attack may wait for: a change of mode, or another step.
pub fn is_awaited(bytes: &[u8]) -> bool {
    let awaited =
        |event: Any| matches!(event, Any::Service(Event::Transition { .. }) | Any::Instrument(Note::Step { .. }));
    Entry::decode(bytes).is_ok_and(|entry| awaited(entry.event))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each number belongs to one of the two types: a number of both would be read as the wrong one, a number of
    /// neither not at all.
    #[test]
    fn every_number_is_of_one_kind() {
        let known =
            |result: Result<Any, minicbor::decode::Error>| result.map_or_else(|e| !e.is_unknown_variant(), |_| true);
        for number in 0..=u8::MAX {
            let bytes = [0x82, 0x18, number, 0x80];
            let event = known(minicbor::decode::<Event>(&bytes).map(Any::Service));
            let note = known(minicbor::decode::<Note>(&bytes).map(Any::Instrument));
            assert_eq!((note, event && note), (is_note(u32::from(number)), false), "{number}");
        }
    }
}
