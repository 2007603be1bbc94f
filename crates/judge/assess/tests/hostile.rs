//! Cut, damaged and hostile recordings and maps: an error or an end with its place, and no panic.

#![expect(clippy::unwrap_used, reason = "a test may end here")]

mod made;

use assess::log::{Log, LogError};
use assess::map::Map;
use assess::{SceneError, Terms, assess, guess, scenario_text};
use made::{
    MCAP_MAP, ROVER, ULOG_MAP, drive, heartbeat, mcap, record, replace_passage, telemetry_records, ulog, wanted,
};
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};

/// Reads and judges any bytes; gives the offset at which reading ended.
fn read_end(bytes: &[u8], map: &Map) -> Option<u64> {
    match Log::open(bytes) {
        Ok(log) => {
            let _result = assess(&log, map, &Terms::GROUND, 1);
            let _guess = guess(&log);
            assert!(log.end.at <= log.end.of && log.end.of == bytes.len() as u64);
            Some(log.end.at)
        }
        Err(LogError::Refused { at, .. }) => {
            assert!(at <= bytes.len() as u64);
            None
        }
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn every_prefix_of_a_ulog_ends_at_a_border() {
    let (bytes, borders) = ulog(&drive(2, 2.0));
    for length in 0..=bytes.len() {
        let Ok(log) = Log::open(&bytes[..length]) else {
            assert!(length < 16, "{length}");
            continue;
        };
        let border = *borders.iter().rfind(|border| **border <= length).unwrap();
        assert_eq!(log.end.at, border as u64, "{length}");
        assert_eq!(log.end.why.is_some(), border != length, "{length}: {:?}", log.end);
    }
}

#[test]
fn every_prefix_of_an_mcap_names_its_end() {
    for compressed in [false, true] {
        let bytes = mcap(&drive(2, 2.0), compressed);
        // The footer is the last record: opcode, length, 20 bytes, and the end mark of 8.
        let footer = bytes.len() - 8;
        for length in 0..footer {
            let Ok(log) = Log::open(&bytes[..length]) else {
                assert!(length < 8, "{length}");
                continue;
            };
            assert!(log.end.why.is_some() && log.end.at <= length as u64, "{length}: {:?}", log.end);
        }
        assert_eq!(Log::open(&bytes).unwrap().end.why, None);
    }
}

#[test]
fn damaged_recordings_never_panic() {
    let few = |map: &str| Map::parse("", &format!("{map}\n[inject]\nplacements = 2\nwindow_s = 1\n")).unwrap();
    let (ulog_map, mcap_map) = (few(ULOG_MAP), few(MCAP_MAP));
    let drive = drive(3, 2.0);
    let rover_map = few(&guess(&Log::open(ROVER).unwrap()).unwrap());
    let seeds = [
        (ulog(&drive).0, &ulog_map),
        (mcap(&drive, false), &mcap_map),
        (mcap(&drive, true), &mcap_map),
        (ROVER.to_vec(), &rover_map),
    ];
    let mut random = ChaCha8Rng::seed_from_u64(20_261_125);
    let (mut refused, mut cut) = (0, 0);
    for case in 0..1_000 {
        let (bytes, map) = &seeds[case % seeds.len()];
        let mut bytes = bytes.clone();
        for _ in 0..1 + random.next_u32() % 4 {
            let index = (random.next_u64() % bytes.len() as u64) as usize;
            bytes[index] ^= 1 << (random.next_u32() % 8);
        }
        match read_end(&bytes, map) {
            None => refused += 1,
            Some(at) => cut += usize::from(at < bytes.len() as u64),
        }
        if let (true, Ok(log)) = (case % seeds.len() == 3, Log::open(&bytes)) {
            let made = scenario_text(&log, map, &Terms::GROUND, &wanted("ground"));
            assert!(!matches!(made, Err(SceneError::Refused { .. })), "{made:?}");
        }
    }
    assert!(refused > 0 && cut > 50, "{refused} refused, {cut} cut");
}

#[test]
fn unknown_incompatibility_and_version_are_refused() {
    let head = [&b"ULog\x01\x12\x35\x01"[..], &[0; 8]].concat();
    let mut flags = [0; 40];
    flags[8] = 2;
    let error_text = |bytes: &[u8]| Log::open(bytes).unwrap_err().to_string();
    let incompatible = [&head[..], &record(b'B', &flags)].concat();
    assert_eq!(error_text(&incompatible), "at byte 16: flags of an incompatibility that is not known");
    assert_eq!(error_text(b"ULog\x01\x12\x35\x02\0\0\0\0\0\0\0\0"), "at byte 7: ULog version 2, expected 0 or 1");
    assert_eq!(error_text(b"ULog\x01\x12\x35\x01"), "at byte 8: a ULog header has 16 bytes, the file ends after 8");
    assert!(error_text(b"bag").starts_with("at byte 0: neither a ULog"));
}

/// A logger that crashed within a record appends what it saved, and names the place.
#[test]
fn appended_data_is_read_behind_a_cut_record() {
    let (bytes, borders) = ulog(&drive(2, 2.0));
    let (cut, rest) = (borders[40] + 5, borders[41]);
    let mut appended = [&bytes[..cut], &bytes[rest..]].concat();
    let flags = 16 + 3;
    appended[flags + 8] = 1;
    appended[flags + 16..flags + 24].copy_from_slice(&(cut as u64).to_le_bytes());
    let log = Log::open(&appended).unwrap();
    assert_eq!((log.end.why.as_deref(), log.topics.iter().map(|topic| topic.records).sum::<u64>()), (None, 79));
}

/// 20,000 subscriptions, deep formats and formats of ever more parts end the reading with a reason.
#[test]
fn tables_of_a_recording_are_bounded() {
    let head = [&b"ULog\x01\x12\x35\x01"[..], &[0; 8]].concat();
    let error_text =
        |records: &[Vec<u8>]| Log::open(&[&head[..], &records.concat()].concat()).unwrap().end.why.unwrap();
    let format = record(b'F', b"a:uint8_t x;");
    let many = (0..20_000_u32).map(|i| {
        let [low, high, ..] = i.to_le_bytes();
        record(b'A', &[&[(i % 250) as u8, low, high][..], b"a"].concat())
    });
    let mut subscribed = vec![format.clone()];
    subscribed.extend(many);
    assert_eq!(Log::open(&[&head[..], &subscribed.concat()].concat()).unwrap().topics.len(), 250);
    let named: Vec<Vec<u8>> = (0..2000).map(|i| record(b'F', format!("f{i}:uint8_t x;").as_bytes())).collect();
    assert_eq!(error_text(&named), "more than 1024 formats");
    let wide = format!("f:{}", "uint8_t x;".repeat(2000));
    assert_eq!(error_text(&[record(b'F', wide.as_bytes())]), "a format of more than 1024 fields");
    assert_eq!(error_text(&[format, record(b'D', &[9, 0, 1])]), "data of the unknown subscription 9");
}

#[test]
fn map_errors_have_their_place() {
    let error_text = |map: &str| Map::parse("map.toml", map).unwrap_err().to_string();
    assert_eq!(
        error_text(&replace_passage(ULOG_MAP, "unit = \"mm\"", "unit = \"m/s\"")),
        "map.toml:11:9: a unit of speed, expected one of length: m, cm, mm"
    );
    assert!(
        error_text(&replace_passage(ULOG_MAP, "sigma =", "sygma ="))
            .starts_with("map.toml:11:1: unknown field `sygma`")
    );
    assert_eq!(
        error_text(&replace_passage(ULOG_MAP, "speed = {", "sideways = {")),
        "map.toml: [odometry] has either `speed` or `velocity`"
    );
    let fence = format!("{ULOG_MAP}\n[fence]\ncorners = [[0, 0], [1, 1]]\n");
    assert_eq!(error_text(&fence), "map.toml:28:11: a fence has 3 to 256 corners within 1000 km");
}

#[test]
fn missing_topic_and_field_name_a_near_one() {
    let bytes = ulog(&drive(2, 2.0)).0;
    let log = Log::open(&bytes).unwrap();
    let error_text = |from: &str, to: &str| {
        let map = Map::parse("map.toml", &replace_passage(ULOG_MAP, from, to)).unwrap();
        assess(&log, &map, &Terms::GROUND, 1).unwrap_err().to_string()
    };
    assert_eq!(
        error_text("topic = \"fix\"", "topic = \"fixx\""),
        "no topic `fixx`; did you mean `fix`?; --guess lists the topics"
    );
    assert_eq!(error_text("\"place.x\"", "\"place.z\""), "topic `fix`: no field `z` in `point`");
    assert_eq!(
        error_text("field = \"utc\", unit = \"us\"", "field = \"speed\", unit = \"us\""),
        "topic `fix`: no field `speed` in `fix`"
    );
}

#[test]
fn clocks_apart_are_told() {
    let bytes = ulog(&drive(2, 2.0)).0;
    let map = Map::parse("map.toml", &ULOG_MAP.replacen("unit = \"us\"", "unit = \"ms\"", 1)).unwrap();
    let error_text = assess(&Log::open(&bytes).unwrap(), &map, &Terms::GROUND, 1).unwrap_err().to_string();
    assert_eq!(
        error_text,
        "fixes from 5000 to 6950 s and odometry from 5 to 6 s have no time in common: are both stamps of one clock?"
    );
}

fn counted(log: &Log<'_>) -> u64 {
    log.topics.iter().map(|topic| topic.records).sum()
}

#[test]
fn every_prefix_of_a_telemetry_log_ends_at_a_record() {
    let borders: Vec<usize> = telemetry_records(ROVER).into_iter().map(|(_, to)| to).collect();
    for length in 9..ROVER.len() {
        let log = Log::open(&ROVER[..length]).unwrap();
        let border = borders.iter().rfind(|border| **border <= length).copied().unwrap_or(0);
        assert_eq!((log.end.at, log.end.why.is_some()), (border as u64, border != length), "{length}: {:?}", log.end);
    }
    let error_text = Log::open(&ROVER[..8]).unwrap_err().to_string();
    assert!(error_text.starts_with("at byte 0: neither a ULog"), "{error_text}");
}

/// The time before a frame is covered by no checksum, and the frame of an unknown message by one that is not known.
#[test]
fn false_byte_of_a_frame_costs_one_message() {
    let whole = counted(&Log::open(ROVER).unwrap());
    let records = telemetry_records(ROVER);
    // An attitude and a fix in the middle.
    for (from, to) in [30, 24].map(|id| *records[60..].iter().find(|(from, _)| ROVER[from + 15] == id).unwrap()) {
        for at in from + 8..to {
            let mut bytes = ROVER.to_vec();
            bytes[at] ^= 0x55;
            let log = Log::open(&bytes).unwrap();
            assert_eq!(counted(&log), whole - 1, "byte {at}: {:?}", log.end);
            let is_place_told = log.end.gaps.iter().any(|gap| (gap.from, gap.to) == (from as u64, to as u64));
            // With another number it is a message that is not read.
            let is_number = (from + 15..from + 18).contains(&at);
            assert!(is_place_told || is_number, "byte {at}: {:?}", log.end);
        }
    }
}

#[test]
fn false_length_of_a_frame_costs_one_message() {
    let whole = counted(&Log::open(ROVER).unwrap());
    let (from, _) = telemetry_records(ROVER)[100];
    for length in 0..=u8::MAX {
        let mut bytes = ROVER.to_vec();
        bytes[from + 9] = length;
        let log = Log::open(&bytes).unwrap();
        assert_eq!(counted(&log), whole - u64::from(length != ROVER[from + 9]), "{length}: {:?}", log.end);
    }
}

#[test]
fn senders_of_a_telemetry_log_are_bounded() {
    let time = |i: u16| 1_700_000_000_000_000 + u64::from(i);
    let bytes: Vec<u8> = (0..3000).flat_map(|i: u16| heartbeat(time(i), i.to_le_bytes())).collect();
    let log = Log::open(&bytes).unwrap();
    assert_eq!((log.topics.len(), log.topics[1].name.as_str(), log.end.why.clone()), (1024, "HEARTBEAT/1.0", None));
    assert!(log.notes.iter().any(|note| note.starts_with("1976 messages are of kinds")), "{:?}", log.notes);
}

/// A million beginnings of frames, none of which has its checksum, and as many zeros: each byte costs little.
#[test]
fn telemetry_without_a_sound_frame_ends_at_once() {
    let false_frame = [&1_700_000_000_000_000_u64.to_be_bytes()[..], &[0xfd, 255, 0, 0, 0, 1, 1, 30]].concat();
    let bytes = [false_frame.repeat(1 << 16), vec![0; 1 << 20]].concat();
    let log = Log::open(&bytes).unwrap();
    assert_eq!((log.topics.len(), log.end.at), (0, 0), "{:?}", log.end);
}
