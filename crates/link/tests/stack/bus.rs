//! Shared memory: messages published in a domain arrive there, in order, and nowhere else.

use std::path::PathBuf;

use link::bus::sweep::sweep;
use link::bus::{BusError, Domain};
use tokio::sync::mpsc;
use wire::core::{Input, Topic};

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
