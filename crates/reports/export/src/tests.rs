//! Other readers find the written values; unreadable messages are left out.

use std::collections::BTreeMap;
use std::io::Cursor;

use ground_truth::{Any, Entry, Note};
use wire::bus::{ChannelKey, Sender};
use wire::codec::encode;
use wire::core::Topic;
use wire::event::Event;
use wire::id::{Boot, FrameId, NodeId, UnitId};
use wire::mode::{Because, Cause, Guards, Mode};
use wire::sensor::Frames;
use wire::time::Instant;

use crate::{Channel, Viewer};

fn entry(node: NodeId, event: impl Into<Any>) -> Entry {
    let event = event.into();
    Entry { node, boot: Boot(1), counter: 1, at: Instant(5), event, previous: [0; 32] }
}

fn frames(rgb: &[u8], lidar: &[u8]) -> Vec<u8> {
    let frames = Frames {
        frame: FrameId(1),
        stamp: Instant(7),
        width: 4,
        height: 2,
        rgb: Some(rgb.into()),
        depth: None,
        thermal: None,
        lidar: Some(lidar.into()),
    };
    Sender::new(Topic::Frames, NodeId::SIM, Boot(1), ChannelKey([1; 32])).seal(Instant(8), &encode(&frames))
}

/// A small run: a unit moves, degrades, and sees a frame; then `more` on shared memory.
fn written(more: &[(Topic, Vec<u8>)]) -> (Vec<u8>, Vec<Channel>, u64) {
    let mut file = Cursor::new(Vec::new());
    let mut viewer = Viewer::new(&mut file, Some(sim::scene::Scene::default()), None).unwrap();
    let moves = Note::Truth {
        unit: UnitId::A,
        x_mm: 1000,
        y_mm: -2000,
        yaw_mrad: 300,
        speed_mm_s: 500,
        set_speed_mm_s: 500,
        leased: true,
        fence_mm: 9000,
    };
    let degrades = Event::Transition {
        from: Mode::Ready,
        to: Mode::Degraded,
        cause: Cause::Recovered,
        because: Because::Itself,
        failing: Guards::default(),
    };
    viewer.event(100, &entry(NodeId::SIM, moves)).unwrap();
    viewer.message(150, Topic::Frames, &frames(&[9; 24], &[0xe8, 3])).unwrap();
    viewer.event(200, &entry(NodeId::UNIT_A, degrades)).unwrap();
    for (topic, bytes) in more {
        viewer.message(300, *topic, bytes).unwrap();
    }
    let unread = viewer.unread();
    let channels = viewer.finish().unwrap();
    (file.into_inner(), channels, unread)
}

/// Equal runs give equal bytes.
#[test]
fn messages_match_their_schema_and_bytes_repeat() {
    let (file, channels, unread) = written(&[]);
    let mut found: BTreeMap<String, (String, u32)> = BTreeMap::new();
    for message in mcap::MessageStream::new(&file).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap().name.clone();
        found.entry(message.channel.topic.clone()).or_insert((schema, 0)).1 += 1;
    }
    let map = channels.iter().map(|c| (c.topic.clone(), (c.schema.clone(), c.messages))).collect();
    assert_eq!(found, map);
    let topics: Vec<&str> = found.keys().map(String::as_str).collect();
    let wanted = [
        "/audit/sim",
        "/audit/unit-a",
        "/camera/calibration",
        "/camera/rgb",
        "/lidar",
        "/log",
        "/mode/unit-a",
        "/tf",
        "/truth",
    ];
    assert_eq!((topics.as_slice(), unread), (wanted.as_slice(), 0));
    assert_eq!(file, written(&[]).0);
}

#[test]
fn file_of_an_invalid_recording_opens_with_that() {
    let messages_of = |invalid: Option<&str>| {
        let mut file = Cursor::new(Vec::new());
        let mut viewer = Viewer::new(&mut file, None, None).unwrap();
        viewer.verification("runs/x/1", "ab", invalid).unwrap();
        viewer.event(200, &entry(NodeId::SIM, Event::Started)).unwrap();
        viewer.finish().unwrap();
        let file = file.into_inner();
        let messages: Vec<(String, u64, String)> = mcap::MessageStream::new(&file)
            .unwrap()
            .map(Result::unwrap)
            .map(|m| (m.channel.topic.clone(), m.log_time, String::from_utf8_lossy(&m.data).into_owned()))
            .collect();
        messages
    };
    let messages = messages_of(Some("event 7: no such chain"));
    let verification = messages.iter().find(|(topic, ..)| topic == "/custody").unwrap();
    let object: serde_json::Value = serde_json::from_str(&verification.2).unwrap();
    assert_eq!(
        (verification.1, &object["valid"], &object["reason"]),
        (0, &false.into(), &"event 7: no such chain".into())
    );
    let line = messages.iter().find(|(topic, ..)| topic == "/log").unwrap();
    assert!(line.1 == 0 && line.2.contains("INVALID, evidence of nothing: runs/x/1: event 7"), "{line:?}");
    let messages = messages_of(None);
    assert!(
        messages.iter().any(|(topic, _, text)| topic == "/custody" && text.contains("\"valid\":true")),
        "{messages:?}"
    );
    assert!(messages.iter().all(|(_, _, text)| !text.contains("INVALID")), "{messages:?}");
}

/// A frame that is cut at any byte is counted as unread.
#[test]
fn unreadable_bytes_and_wrong_planes_are_left_out() {
    let whole = frames(&[9; 24], &[0xe8, 3]);
    let cuts: Vec<(Topic, Vec<u8>)> = (0..whole.len()).map(|n| (Topic::Frames, whole[..n].to_vec())).collect();
    let (_, channels, unread) = written(&cuts);
    assert_eq!(unread, cuts.len() as u64, "of a frame that is cut off nothing is shown");
    let images = |channels: &[Channel]| channels.iter().find(|c| c.topic == "/camera/rgb").unwrap().messages;
    assert_eq!(images(&channels), 1);
    // As many bytes as another image would have, and more returns than there are beams.
    let other = frames(&[9; 21], &[0xff; 40_000]);
    let (_, channels, unread) = written(&[(Topic::Frames, other), (Topic::Tracks, whole)]);
    assert_eq!((images(&channels), unread), (1, 1), "what is no track is not taken for one");
}
