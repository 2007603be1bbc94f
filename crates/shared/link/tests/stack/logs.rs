//! Input journals: replay, and files that were cut or forged.

use link::input_journal::{
    Entry, Header, JournalError, MAGIC, MAX_ENTRY, Reader, ReplayError, Thinned, Writer, replay, thin,
};
use wire::core::{Core, Input, Output, Topic};
use wire::event::wire_hash;
use wire::id::{Boot, NodeId};
use wire::time::Instant;

/// Answers each bus message with its sum so far, and a timeout with no output.
#[derive(Default)]
struct Adder {
    sum: u8,
    out: Option<Output>,
}

impl Core for Adder {
    fn handle(&mut self, _now: Instant, input: &Input) {
        if let Input::Bus { bytes, .. } = input {
            self.sum = bytes.iter().fold(self.sum, |sum, byte| sum.wrapping_add(*byte));
            self.out = Some(Output::Bus { topic: Topic::Drive, bytes: vec![self.sum] });
        }
    }

    fn deadline(&self) -> Option<Instant> {
        None
    }

    fn output(&mut self) -> Option<Output> {
        self.out.take()
    }
}

fn log() -> Vec<u8> {
    let mut bytes = Vec::new();
    let header = Header { node: NodeId::SIM, boot: Boot(1), started: Instant(5) };
    let mut writer = Writer::new(&mut bytes, header, 1 << 20).unwrap();
    let mut core = Adder::default();
    for n in 0..10u8 {
        let input = if n % 3 == 0 { Input::Timeout } else { Input::Bus { topic: Topic::Act, bytes: vec![n, n] } };
        let now = Instant(100 + u64::from(n));
        writer.input(now, &input).unwrap();
        core.handle(now, &input);
        while let Some(output) = core.output() {
            writer.output(&output).unwrap();
        }
    }
    bytes
}

#[test]
fn log_replays_and_exposes_a_changed_core() {
    let log = log();
    let reader = Reader::new(log.as_slice()).unwrap();
    assert_eq!(reader.header().started, Instant(5));
    let replayed = replay(reader, &mut Adder::default()).unwrap();
    assert_eq!((replayed.inputs, replayed.outputs, replayed.unlogged), (10, 6, 0));
    let mut other = Adder { sum: 1, out: None };
    match replay(Reader::new(log.as_slice()).unwrap(), &mut other) {
        Err(ReplayError::Diverged(divergence)) => assert_eq!(divergence.index, 0),
        other => panic!("{other:?}"),
    }
}

#[test]
fn truncated_log_replays_as_far_as_it_goes() {
    let log = log();
    let header = Header { node: NodeId::SIM, boot: Boot(1), started: Instant(5) };
    let head = MAGIC.len() + 4 + minicbor::to_vec(header).unwrap().len();
    let mut before = 0;
    for cut in 0..log.len() {
        match Reader::new(&log[..cut]) {
            Ok(reader) => {
                let replayed = replay(reader, &mut Adder::default()).unwrap();
                assert!(replayed.inputs >= before && replayed.unlogged <= 1, "cut at {cut}");
                before = replayed.inputs;
            }
            Err(JournalError::Magic | JournalError::Truncated { .. }) => assert!(cut < head, "cut at {cut}"),
            Err(other) => panic!("cut at {cut}: {other}"),
        }
    }
}

/// Forged bytes, too.
#[test]
fn forged_lengths_are_named_without_cost() {
    let log = log();
    let mut huge = log.clone();
    let header = MAGIC.len();
    huge[header..header + 4].copy_from_slice(&u32::MAX.to_be_bytes());
    assert!(matches!(Reader::new(huge.as_slice()), Err(JournalError::TooLong { offset: 8, .. })));
    let mut trailing = log.clone();
    trailing.extend([0, 0, 0, 3, 0xf6, 0xf6, 0xf6]);
    let last = Reader::new(trailing.as_slice()).unwrap().last().unwrap();
    assert!(matches!(last, Err(JournalError::Malformed { .. })));
    for index in MAGIC.len()..log.len() {
        let mut changed = log.clone();
        changed[index] ^= 0x41;
        if let Ok(reader) = Reader::new(changed.as_slice()) {
            assert!(reader.take(1_000).count() < 1_000);
        }
    }
}

#[test]
fn full_log_ends_at_the_first_loss() {
    let mut bytes = Vec::new();
    let header = Header { node: NodeId::SIM, boot: Boot(1), started: Instant(0) };
    let mut writer = Writer::new(&mut bytes, header, 200).unwrap();
    writer.input(Instant(1), &Input::Timeout).unwrap();
    writer.input(Instant(2), &Input::Bus { topic: Topic::Frames, bytes: vec![0; MAX_ENTRY] }).unwrap();
    writer.input(Instant(3), &Input::Timeout).unwrap();
    assert_eq!(writer.counts(), (1, 2));
    let entries: Vec<Entry> = Reader::new(bytes.as_slice()).unwrap().map(Result::unwrap).collect();
    assert_eq!(entries, [Entry::Input { now: Instant(1), input: Input::Timeout }]);
}

/// A removed set of frames leaves its hash, and the thinned journal does not replay.
#[test]
fn thinned_log_keeps_every_third_frame_set() {
    let header = Header { node: NodeId::PERCEPTION, boot: Boot(1), started: Instant(5) };
    let frames = |n: u8| vec![n; 1000];
    let mut whole = Vec::new();
    let mut writer = Writer::new(&mut whole, header, 1 << 20).unwrap();
    for n in 0..7 {
        writer.input(Instant(n.into()), &Input::Bus { topic: Topic::Frames, bytes: frames(n) }).unwrap();
        writer.input(Instant(n.into()), &Input::Timeout).unwrap();
        writer.output(&Output::Bus { topic: Topic::Tracks, bytes: vec![n] }).unwrap();
    }
    writer.output(&Output::Bus { topic: Topic::Frames, bytes: frames(9) }).unwrap();
    // Its writer was killed.
    let cut = &whole[..whole.len() - 1];
    let thinned = |log: &[u8], every| {
        let mut thin_log = Vec::new();
        let counts = thin(Reader::new(log).unwrap(), &mut thin_log, every).unwrap();
        let log = Reader::new(thin_log.as_slice()).unwrap();
        assert_eq!(log.header(), header);
        (counts, log.map(Result::unwrap).collect::<Vec<_>>(), thin_log)
    };
    let (counts, entries, _) = thinned(&whole, 3);
    assert_eq!(counts, Thinned { whole: 14 + 3, left_out: 4 + 1 });
    let left_out = |n: u8, now| Entry::LeftOut { now, topic: Topic::Frames, length: 1000, hash: wire_hash(&frames(n)) };
    for (n, three) in (0..7u8).zip(entries.chunks(3)) {
        let now = Instant(n.into());
        let fed = Entry::Input { now, input: Input::Bus { topic: Topic::Frames, bytes: frames(n) } };
        assert_eq!(three[0], if n % 3 == 0 { fed } else { left_out(n, Some(now)) });
        assert_eq!(
            three[1..],
            [
                Entry::Input { now, input: Input::Timeout },
                Entry::Output(Output::Bus { topic: Topic::Tracks, bytes: vec![n] })
            ]
        );
    }
    assert_eq!(entries.last(), Some(&left_out(9, None)));
    assert_eq!(thinned(cut, 1).0, Thinned { whole: 21, left_out: 0 });
    let (counts, _, log) = thinned(cut, 0);
    assert_eq!(counts, Thinned { whole: 14, left_out: 7 });
    let replayed = replay(Reader::new(log.as_slice()).unwrap(), &mut Adder::default());
    assert!(matches!(replayed, Err(ReplayError::Thinned { topic: Topic::Frames })), "{replayed:?}");
}
