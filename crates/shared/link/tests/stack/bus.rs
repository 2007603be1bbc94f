//! Shared memory: messages published in a domain arrive there, in order, and nowhere else.

use std::fs::OpenOptions;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;

use link::bus::sweep::sweep;
use link::bus::{BusError, Domain, Protection};
use tokio::sync::mpsc;
use wire::bus::{ChannelKey, Sender, TAG_LEN};
use wire::codec;
use wire::core::{Input, Topic};
use wire::id::{Boot, NodeId};
use wire::policy::Policy;
use wire::sensor::Navigation;
use wire::sign::Secret;
use wire::time::{Instant, Span};
use wire::trust::BusGate;

const NOW: Instant = Instant(5_000_000);

/// A domain of this test alone; its traces are removed when it is dropped.
struct Scratch {
    domain: Domain,
    prefix: String,
    root: PathBuf,
    _directory: tempfile::TempDir,
}

impl Scratch {
    fn new(name: &str) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let root = directory.path().join("bus");
        let prefix = format!("hs_t{}_{name}_", std::process::id());
        Self { domain: Domain::new(&root, &prefix).unwrap(), prefix, root, _directory: directory }
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        sweep(&self.prefix, &self.root).unwrap();
        assert_eq!(sweep(&self.prefix, &self.root).unwrap(), 0);
    }
}

fn bytes(input: Option<Input>) -> Vec<u8> {
    match input {
        Some(Input::Bus { bytes, .. }) => bytes,
        other => panic!("{other:?}"),
    }
}

#[test]
fn messages_stay_in_order_on_their_channel() {
    let scratch = Scratch::new("order");
    let other = Scratch::new("other");
    let (tx, mut inbox) = mpsc::channel(64);
    let (other_tx, mut other_inbox) = mpsc::channel(64);
    let publisher = scratch.domain.publisher("unit-a", Topic::Tracks).unwrap();
    let reader = scratch.domain.subscribe("unit-a", Topic::Tracks, tx).unwrap();
    let readers = [
        scratch.domain.subscribe("unit-b", Topic::Tracks, other_tx.clone()).unwrap(),
        scratch.domain.subscribe("unit-a", Topic::Drive, other_tx.clone()).unwrap(),
        other.domain.subscribe("unit-a", Topic::Tracks, other_tx).unwrap(),
    ];
    for n in 0..20u8 {
        publisher.publish(&[n; 100]).unwrap();
    }
    for n in 0..20u8 {
        assert_eq!(bytes(inbox.blocking_recv()), [n; 100]);
    }
    assert_eq!(reader.received(), 20);
    drop(readers);
    assert_eq!(other_inbox.blocking_recv(), None);
}

#[test]
fn a_rendered_frame_fits_and_more_is_refused() {
    let scratch = Scratch::new("large");
    let (tx, mut inbox) = mpsc::channel(4);
    let publisher = scratch.domain.publisher("unit-a", Topic::Frames).unwrap();
    let _reader = scratch.domain.subscribe("unit-a", Topic::Frames, tx).unwrap();
    let frame: Vec<u8> = (0..Topic::Frames.max_len()).map(|n| n as u8).collect();
    publisher.publish(&frame).unwrap();
    assert_eq!(bytes(inbox.blocking_recv()), frame);
    let too_long = vec![0; Topic::Frames.max_len() + 1];
    assert!(matches!(publisher.publish(&too_long), Err(BusError::TooLong { .. })));
}

#[test]
fn reader_hears_the_next_publisher_of_its_channel() {
    let scratch = Scratch::new("next");
    let (tx, mut inbox) = mpsc::channel(4);
    let _reader = scratch.domain.subscribe("control", Topic::Intents, tx).unwrap();
    for n in 0..3u8 {
        let publisher = scratch.domain.publisher("control", Topic::Intents).unwrap();
        publisher.publish(&[n]).unwrap();
        assert_eq!(bytes(inbox.blocking_recv()), [n]);
    }
}

#[test]
fn publisher_does_not_wait_for_slow_readers() {
    let scratch = Scratch::new("slow");
    let (tx, mut inbox) = mpsc::channel(1);
    let publisher = scratch.domain.publisher("unit-a", Topic::Drive).unwrap();
    let _reader = scratch.domain.subscribe("unit-a", Topic::Drive, tx).unwrap();
    for n in 0..1_000u32 {
        publisher.publish(&n.to_be_bytes()).unwrap();
    }
    let mut last = bytes(inbox.blocking_recv());
    while last != 999u32.to_be_bytes() {
        let next = bytes(inbox.blocking_recv());
        assert!(next > last, "the oldest are lost, the order is kept");
        last = next;
    }
}

#[test]
fn names_outside_the_form_are_refused() {
    let scratch = Scratch::new("names");
    for scope in ["", "Unit", "a/b", "..", "a b", &"x".repeat(33)] {
        assert!(matches!(scratch.domain.publisher(scope, Topic::Act), Err(BusError::Name(_))), "{scope}");
    }
    assert!(Domain::new(&scratch.root, "iox2_").is_err());
    assert!(Domain::new(&PathBuf::from("relative"), "hs_abc_").is_err());
    let long = format!("/{}", "long".repeat(20));
    assert!(matches!(Domain::new(&PathBuf::from(long), "hs_abc_"), Err(BusError::Place { length: 88 })));
}

/// The memory of a channel's messages, as another process of the host finds it.
fn memory(prefix: &str) -> Vec<PathBuf> {
    let files = std::fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().path());
    let data = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        name.starts_with(prefix) && name.ends_with(".data")
    };
    files.filter(data).collect()
}

/// Every byte of the message except the other reader's tag is altered in turn, while the message waits for its reader.
#[test]
fn message_altered_in_shared_memory_is_refused() {
    let key = ChannelKey([3; 32]);
    let body = codec::encode(&Navigation { stamp: NOW, fix: None, odometry: None, spatial: None });
    let keys = vec![key.clone(), ChannelKey([4; 32])];
    let sender = || Sender::to_readers(Topic::Navigation, NodeId::SIM, Boot(1), keys.clone());
    let sealed = |sender: &mut Sender| sender.seal(NOW, &body);
    let length = sealed(&mut sender()).len();
    let checked_bytes = length - TAG_LEN;
    let mut refused = 0;
    for byte in 0..checked_bytes {
        let scratch = Scratch::new("scribble");
        let (tx, mut inbox) = mpsc::channel(1);
        let publisher = scratch.domain.publisher("vehicle", Topic::Navigation).unwrap();
        let _reader = scratch.domain.subscribe("vehicle", Topic::Navigation, tx).unwrap();
        let mut sender = sender();
        // The first fills the reader's room and the second waits before it, so that the third stays in shared memory.
        let sent: Vec<Vec<u8>> = (0..3).map(|_| sealed(&mut sender)).collect();
        sent.iter().for_each(|bytes| publisher.publish(bytes).unwrap());
        let mut scribbled = 0;
        for file in memory(&scratch.prefix) {
            let held = std::fs::read(&file).unwrap();
            // Changed in place: a file that is truncated while threads map it ends the process.
            let open = OpenOptions::new().write(true).open(&file).unwrap();
            for (start, _) in held.windows(length).enumerate().filter(|(_, window)| *window == sent[2]) {
                let index = start + byte;
                open.write_all_at(&[held[index] ^ 1], index as u64).unwrap();
                scribbled += 1;
            }
        }
        assert_eq!(scribbled, 1, "byte {byte}: the message was in memory");
        let mut gate = BusGate::new(Topic::Navigation, NodeId::SIM, key.clone(), Span::ms(300));
        let mut judge = |bytes: &[u8]| gate.admit::<Navigation>(&Policy::default(), NOW, bytes).is_ok();
        assert!(judge(&bytes(inbox.blocking_recv())) && judge(&bytes(inbox.blocking_recv())));
        refused += usize::from(!judge(&bytes(inbox.blocking_recv())));
    }
    assert_eq!(refused, checked_bytes);
}

#[test]
fn listener_without_the_channels_key_reads_nothing() {
    let scratch = Scratch::new("hidden");
    let with_key = |key: u8| Protection { cipher: Some(Secret([key; 32])), time: None };
    let (tx, mut inbox) = mpsc::channel(8);
    let (other_tx, mut other) = mpsc::channel(8);
    let publisher = scratch.domain.protected(with_key(1)).publisher("control", Topic::Intents).unwrap();
    let _reader = scratch.domain.protected(with_key(1)).subscribe("control", Topic::Intents, tx).unwrap();
    let strangers = [scratch.domain.clone(), scratch.domain.protected(with_key(2))];
    let _listeners: Vec<_> =
        strangers.iter().map(|domain| domain.subscribe("control", Topic::Intents, other_tx.clone()).unwrap()).collect();
    let message = b"HOLD of unit-a by the operator";
    publisher.publish(message).unwrap();
    assert_eq!(bytes(inbox.blocking_recv()), message);
    for _ in &strangers {
        let heard = bytes(other.blocking_recv());
        assert!(!heard.windows(4).any(|window| window == b"HOLD"), "{heard:?}");
    }
    let seen = memory(&scratch.prefix).iter().any(|file| std::fs::read(file).unwrap().windows(4).any(|w| w == b"HOLD"));
    assert!(!seen, "nor does who maps the memory");
}

#[test]
fn channel_outside_the_time_of_its_rights_carries_nothing() {
    let scratch = Scratch::new("time");
    let now = link::clock::trace_us();
    let valid_between = |time| Protection { cipher: None, time: Some(time) };
    for time in [(0, now), (now + 3_600_000_000, u64::MAX)] {
        let publisher = scratch.domain.protected(valid_between(time)).publisher("control", Topic::Feed).unwrap();
        assert!(matches!(publisher.publish(b"late"), Err(BusError::Time)));
    }
    let publisher = scratch.domain.publisher("control", Topic::Feed).unwrap();
    let (tx, mut inbox) = mpsc::channel(8);
    let (late_tx, mut late) = mpsc::channel(8);
    let _late = scratch.domain.protected(valid_between((0, now))).subscribe("control", Topic::Feed, late_tx).unwrap();
    let _reader = scratch.domain.protected(valid_between((0, u64::MAX))).subscribe("control", Topic::Feed, tx).unwrap();
    publisher.publish(b"in time").unwrap();
    assert_eq!(bytes(inbox.blocking_recv()), b"in time");
    drop((_late, publisher));
    assert!(late.blocking_recv().is_none(), "its reader has no right any more");
}
