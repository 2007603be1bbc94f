//! Delays in the twin: of stages, and of hops over shared memory and over loopback.
//!
//! A delay is uniform over a range. The ranges were fitted by hand to the 5th percentile and the median of live runs
//! (`lab stages --runs 6`, rendered, release build, 2 otherwise idle cores); that command prints the remaining gap. The
//! tails of live delays are left out, such as of a reader that waits for a core while the renderer has it. A stage's
//! delay is drawn once for each input with an output.
//!
//! A delay is a function of the seed, of sender and receiver, and of the time of sending. One message more or less
//! therefore changes the delay of no other: two runs of one seed differ by the actions in them, and by no other chance.

use std::collections::VecDeque;
use std::hash::Hasher;

use adversary::Adversary;
use siphasher::sip::SipHasher13;
use wire::core::{Output, Topic};
use wire::id::NodeId;

use super::part::Part;
use super::queue::Micros;

/// Both ends, microseconds.
type Range = (u64, u64);

/// A hop over shared memory, with the wake-up of its reader, microseconds.
const BUS: Range = (20, 120);
/// A datagram over loopback, with the wake-up of its reader, microseconds.
const DATAGRAM: Range = (70, 270);
/// Delay of a flight of a handshake after its cause: with a relay's hops all six take 2 to 3 ms, seen live 2.
const FLIGHT: Range = (20, 120);
/// Time from the start of the run to a dialler's first attempt: who starts when is chance, and with it the phase of the
/// gateway's grants, which it sends each tenth of a second from its first session on.
const START: Range = (20_000, 119_999);
/// A publication through the broker, both legs.
const COMMAND: Range = (300, 900);
/// An entry on its way to the recorder.
pub const INSTRUMENT: Micros = 100;

/// Sender and receiver; one and the same for a node's own work.
pub type EndPair = (NodeId, NodeId);

/// Source of a delay: a stage's work, or a hop.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Stage,
    Bus,
    Datagram,
    Flight,
    Start,
    Command,
}

/// Delays as a function of the seed.
#[derive(Clone, Copy, Debug)]
pub struct Delays {
    seed: u64,
    varied: bool,
}

impl Delays {
    /// With `varied` off every delay is the middle of its range.
    pub fn new(seed: u64, varied: bool) -> Self {
        Self { seed, varied }
    }

    /// Draws from `seed` from now on.
    pub fn reseed(&mut self, seed: u64) {
        self.seed = seed;
    }

    /// Between an input of `node`'s part and `outputs`.
    pub fn stage(&self, node: NodeId, part: &Part, outputs: &VecDeque<Output>, time: Micros) -> Micros {
        let renders = |output: &Output| matches!(output, Output::Bus { topic: Topic::Frames, .. });
        let range = match part {
            Part::Sim(_) if outputs.iter().any(renders) => (4_500, 8_200),
            Part::Sim(_) => (30, 200),
            Part::Perception { rendered: true, .. } => (1_900, 3_400),
            Part::Perception { rendered: false, .. } => (60, 300),
            Part::Autonomy(_) | Part::Gateway(_) | Part::Console(_) => (40, 250),
            Part::Recorder(_) => (60, 260),
            Part::Adversary(Adversary::DatagramRelay(_) | Adversary::StreamRelay(_)) => (10, 60),
            Part::Adversary(_) => (40, 250),
            Part::Following(along) => return self.stage(node, along.like(), outputs, time),
        };
        self.draw(range, Kind::Stage, (node, node), time)
    }

    /// Over shared memory.
    pub fn bus(&self, way: EndPair, time: Micros) -> Micros {
        self.draw(BUS, Kind::Bus, way, time)
    }

    /// Over loopback UDP.
    pub fn datagram(&self, way: EndPair, time: Micros) -> Micros {
        self.draw(DATAGRAM, Kind::Datagram, way, time)
    }

    /// A flight of a handshake.
    pub fn flight(&self, way: EndPair, time: Micros) -> Micros {
        self.draw(FLIGHT, Kind::Flight, way, time)
    }

    /// A dialler's first attempt, from the start of the run.
    pub fn start(&self, way: EndPair) -> Micros {
        self.draw(START, Kind::Start, way, 0)
    }

    /// Through the broker.
    pub fn command(&self, way: EndPair, time: Micros) -> Micros {
        self.draw(COMMAND, Kind::Command, way, time)
    }

    fn draw(&self, (low, high): Range, kind: Kind, (from, to): EndPair, time: Micros) -> Micros {
        if !self.varied {
            return (low + high) / 2;
        }
        // The key is secret to nobody here; what is asked of the hash is that it scatters.
        let mut hasher = SipHasher13::new_with_keys(self.seed, kind as u64);
        hasher.write(&time.to_le_bytes());
        hasher.write(&[from.index() as u8, to.index() as u8]);
        low + hasher.finish() % (high - low + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAY: EndPair = (NodeId::UNIT_A, NodeId::GATEWAY);

    /// Sender, receiver, message and time determine it; earlier messages do not.
    #[test]
    fn delay_depends_on_message_and_time_alone() {
        let delays = Delays::new(1, true);
        let one = delays.datagram(WAY, 5_000);
        assert_eq!(one, delays.datagram(WAY, 5_000));
        let rest = [
            delays.datagram(WAY, 5_001),
            delays.datagram((WAY.1, WAY.0), 5_000),
            Delays::new(2, true).datagram(WAY, 5_000),
        ];
        assert!(rest.iter().all(|other| *other != one), "{one}, {rest:?}");
    }

    #[test]
    fn delays_are_even_over_their_range() {
        let delays = Delays::new(1, true);
        let mut tenths = [0_u32; 10];
        for at in 0..20_100 {
            let delay = delays.datagram(WAY, at);
            assert!((DATAGRAM.0..=DATAGRAM.1).contains(&delay));
            tenths[((delay - DATAGRAM.0) * 10 / (DATAGRAM.1 - DATAGRAM.0 + 1)) as usize] += 1;
        }
        // 2,010 each, with a standard deviation of 43.
        assert!(tenths.iter().all(|n| (1_800..2_220).contains(n)), "{tenths:?}");
    }
}
