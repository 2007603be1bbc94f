//! A rogue on a host's shared memory: it hears every channel that it cares about and writes in another's name.
//!
//! Any process of the same user can do so. An impostor holds no channel's key and tags its messages under its own;
//! an insider in a service's place holds that service's keys, and tags under the right one wherever that service could.
//! It claims to be the producer started again, one boot later, as an impostor would. It keeps the messages it heard,
//! bounded, up to its first act on that channel. The content of a message is `forged`'s.

use std::collections::{BTreeMap, VecDeque};

use config::setup::Setup;
use ground_truth::Action;
use wire::bus::{ChannelKey, Sender};
use wire::core::{Core, Input, Output, Side, Topic};
use wire::event::{Account, Event};
use wire::id::Boot;
use wire::time::{Instant, Span};

use super::forged::{self, Heard};
use crate::outbox::Outbox;
use crate::plan::{PlanError, RogueConfig, RogueMove, Says};
use crate::schedule::Steps;

/// Most messages of one channel kept; the oldest goes first.
const MAX_KEPT: usize = 256;

/// A rogue on shared memory.
#[derive(Clone, Debug)]
pub struct Rogue {
    origin: Instant,
    runs: Vec<Run>,
    heard: BTreeMap<Topic, VecDeque<(Instant, Vec<u8>)>>,
    sent: u64,
    outbox: Outbox,
}

/// A move under way.
#[derive(Clone, Debug)]
struct Run {
    plan: RogueMove,
    steps: Steps,
    sender: Sender,
    taken: usize,
}

impl Rogue {
    /// A rogue that starts at `now` with the channel keys of its setup.
    ///
    /// # Errors
    /// A magnitude of the plan outside its bounds.
    pub fn new(setup: Setup, config: RogueConfig, now: Instant) -> Result<Self, PlanError> {
        config.check()?;
        let run = |plan: &RogueMove| {
            let held = setup.channels.iter().find(|c| c.topic == plan.topic).map(|c| c.key.clone());
            // An impostor holds no channel's key, and tags under its own.
            let key = held.unwrap_or(ChannelKey(setup.secret.0));
            let count = u32::try_from(plan.count()).unwrap_or(u32::MAX);
            Run {
                plan: *plan,
                steps: Steps::new(now + Span::ms(plan.at_ms), plan.every_ms, count, None),
                // One boot later than the producer: the readers' windows then accept the rogue as the restarted
                // producer, and refuse the genuine messages as of an old boot.
                sender: Sender::new(plan.topic, plan.producer, Boot(setup.boot.0 + 1), key),
                taken: 0,
            }
        };
        Ok(Self {
            origin: now,
            runs: config.moves.iter().map(run).collect(),
            heard: BTreeMap::new(),
            sent: 0,
            outbox: Outbox::new(&setup, now),
        })
    }

    fn hear(&mut self, now: Instant, topic: Topic, bytes: &[u8]) {
        let acts = |run: &Run| run.plan.topic == topic && now >= self.origin + Span::ms(run.plan.at_ms);
        if !self.runs.iter().any(acts) {
            let queue = self.heard.entry(topic).or_default();
            if queue.len() == MAX_KEPT {
                queue.pop_front();
            }
            queue.push_back((now, bytes.to_vec()));
        }
        for i in 0..self.runs.len() {
            let Run { plan, sender, .. } = &self.runs[i];
            let until = self.origin + Span::ms(plan.at_ms + plan.duration_ms);
            let open = plan.topic == topic && now >= self.origin + Span::ms(plan.at_ms) && now < until;
            // Its own words come back to it; the genuine ones are of an earlier boot.
            if open
                && !self.outbox.is_quiet()
                && sender.boot() > forged::boot(bytes)
                && let Some(body) = forged::passed_on(bytes, plan.says)
            {
                self.say(now, i, &body);
            }
        }
    }

    /// Messages that are due.
    fn act(&mut self, now: Instant) {
        for i in 0..self.runs.len() {
            while !self.runs[i].plan.says.waits() && self.runs[i].steps.take(now) {
                self.publish_once(now, i);
            }
        }
    }

    fn publish_once(&mut self, now: Instant, i: usize) {
        let RogueMove { topic, says, .. } = self.runs[i].plan;
        let queue = self.heard.entry(topic).or_default();
        if let Says::Recorded { lag_ms } = says {
            let old: Vec<&(Instant, Vec<u8>)> =
                queue.iter().filter(|(time, _)| now.since(*time) >= Span::ms(lag_ms)).collect();
            if old.is_empty() {
                return;
            }
            let (time, bytes) = old[self.runs[i].taken % old.len()];
            let (delay, bytes) = (now.since(*time), bytes.clone());
            self.runs[i].taken += 1;
            return self.publish(now, topic, Action::Republish, delay, bytes);
        }
        let last = queue.back().map(|(time, bytes)| Heard { at: *time, bytes });
        if let Some(body) = forged::body(now, topic, says, last) {
            self.say(now, i, &body);
        }
    }

    fn say(&mut self, now: Instant, i: usize, body: &[u8]) {
        let bytes = self.runs[i].sender.seal(now, body);
        self.publish(now, self.runs[i].plan.topic, Action::Forge, Span::ZERO, bytes);
    }

    fn publish(&mut self, now: Instant, topic: Topic, action: Action, delay: Span, bytes: Vec<u8>) {
        self.outbox.attack(now, action, Side::Server, &bytes, delay);
        self.sent += 1;
        self.outbox.put(Output::Bus { topic, bytes });
    }
}

impl Core for Rogue {
    fn handle(&mut self, now: Instant, input: &Input) {
        if let Input::Bus { topic, bytes } = input {
            self.hear(now, *topic, bytes);
        }
        if matches!(input, Input::Finish) {
            self.outbox.write(now, Event::Count { account: Account::Sent, n: self.sent });
        }
        if !self.outbox.heed(now, input) && !self.outbox.is_quiet() {
            self.act(now);
        }
    }

    fn deadline(&self) -> Option<Instant> {
        let timed = self.runs.iter().filter(|run| !run.plan.says.waits());
        timed.filter_map(|run| run.steps.due()).min().filter(|_| !self.outbox.is_quiet())
    }

    fn output(&mut self) -> Option<Output> {
        self.outbox.next()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Spot;
    use crate::testing::{at_ms, setup, times, turn};
    use config::setup::Channel;
    use ground_truth::Any;
    use wire::codec;
    use wire::id::{FrameId, NodeId};
    use wire::policy::Policy;
    use wire::sensor::ProductMode;
    use wire::track::Tracks;
    use wire::trust::BusGate;

    const KEY: ChannelKey = ChannelKey([9; 32]);

    fn rogue(key: Option<ChannelKey>, says: Says) -> Rogue {
        let mut setup = setup(NodeId::IMPOSTOR, 5);
        let channel = |key| Channel { topic: Topic::Tracks, producer: NodeId::PERCEPTION, key };
        setup.channels = key.map(channel).into_iter().collect();
        let producer = NodeId::PERCEPTION;
        let plan = RogueMove { topic: Topic::Tracks, producer, at_ms: 100, duration_ms: 300, every_ms: 100, says };
        Rogue::new(setup, RogueConfig { moves: vec![plan] }, at_ms(0)).unwrap()
    }

    fn genuine(ms: u64) -> Input {
        let mut sender = Sender::new(Topic::Tracks, NodeId::PERCEPTION, Boot(1), KEY);
        let (frame, mode) = (FrameId(7), ProductMode::Live);
        let (tracks, crops) = Default::default();
        let tracks = Tracks { frame, stamp: at_ms(ms), mode, products: [None; 4], tracks, crops, nearby: None };
        Input::Bus { topic: Topic::Tracks, bytes: sender.seal(at_ms(ms), &codec::encode(&tracks)) }
    }

    /// Publications of a rogue that has heard one genuine message, at the time of its move.
    fn publications(rogue: &mut Rogue) -> (Vec<Vec<u8>>, Vec<Any>) {
        let (mut events, mut bytes) = (Vec::new(), Vec::new());
        turn(rogue, at_ms(50), &genuine(50), &mut events);
        for ms in [100, 200, 300, 400, 500] {
            for output in turn(rogue, at_ms(ms), &Input::Timeout, &mut events) {
                let Output::Bus { bytes: one, .. } = output else { panic!("{output:?}") };
                bytes.push(one);
            }
        }
        (bytes, events)
    }

    fn admitted(bytes: &[u8], ms: u64) -> bool {
        let mut gate = BusGate::new(Topic::Tracks, NodeId::PERCEPTION, KEY, Span::ms(300));
        gate.admit::<Tracks>(&Policy::default(), at_ms(ms), bytes).is_ok()
    }

    #[test]
    fn messages_are_admitted_only_under_the_channels_key() {
        let vehicle = Says::Vehicle(Spot { x_mm: 1, y_mm: 2 });
        let (bytes, events) = publications(&mut rogue(None, vehicle));
        assert_eq!((bytes.len(), times(&events, Action::Forge)), (3, 3));
        assert!(bytes.iter().all(|b| !admitted(b, 300)));
        let (bytes, _) = publications(&mut rogue(Some(KEY), vehicle));
        assert!(bytes.len() == 3 && bytes.iter().all(|b| admitted(b, 300)));
    }

    #[test]
    fn beat_has_new_header_and_old_frame() {
        let (bytes, _) = publications(&mut rogue(Some(KEY), Says::Beat));
        let tracks: Tracks = minicbor::decode(wire::bus::body(&bytes[2]).unwrap()).unwrap();
        assert_eq!((tracks.frame, tracks.stamp), (FrameId(7), at_ms(50)));
        assert!(admitted(&bytes[2], 300));
    }

    /// They repeat once they are as old as the plan says.
    #[test]
    fn recorded_messages_repeat_byte_for_byte_when_old() {
        let (bytes, events) = publications(&mut rogue(None, Says::Recorded { lag_ms: 200 }));
        let Input::Bus { bytes: heard, .. } = genuine(50) else { panic!("a message") };
        assert_eq!(bytes, [heard], "at 300 ms, and not before");
        assert_eq!(times(&events, Action::Republish), 1);
    }

    #[test]
    fn magnitudes_outside_their_bounds_are_refused() {
        let plan = |every_ms, duration_ms, statement| RogueConfig {
            moves: vec![RogueMove {
                topic: Topic::Tracks,
                producer: NodeId::PERCEPTION,
                at_ms: 0,
                duration_ms,
                every_ms,
                says: statement,
            }],
        };
        assert!(plan(1, 10_000, Says::Echo).check().is_ok());
        assert!(plan(0, 100, Says::Echo).check().is_err());
        assert!(plan(1, 10_001, Says::Echo).check().is_err(), "too many messages");
        assert!(plan(100, 100, Says::Elsewhere(Spot { x_mm: i32::MIN, y_mm: 0 })).check().is_err());
        assert!(plan(100, 100, Says::Recorded { lag_ms: 60_001 }).check().is_err());
    }
}
