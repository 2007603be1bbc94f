//! Recordings with the faults of recordings by others: damage, clocks that go back, definitions that do not fit, facts that are stated wrongly or not at all.

#![expect(clippy::unwrap_used, reason = "a test may end here")]

mod made;

use assess::log::Log;
use assess::map::Map;
use assess::{Assessment, Check, Terms, assess, guess};
use made::{
    CIRCLE_MAP, MCAP_MAP, ODOMETRY, Pair, ULOG_MAP, circle, drive, json, mcap_with, record, replace_passage, ulog,
};

const ZSTD: Option<mcap::Compression> = Some(mcap::Compression::Zstd);

fn no_fault(_: f64) -> String {
    String::new()
}

fn assess_with(log: &Log<'_>, map: &str, terms: &Terms) -> Assessment {
    let map = Map::parse("map.toml", map).unwrap_or_else(|problems| panic!("{problems}"));
    assess(log, &map, terms, 1).unwrap_or_else(|error| panic!("{error}"))
}

fn judge(bytes: &[u8], map: &str) -> Assessment {
    assess_with(&Log::open(bytes).unwrap(), map, &Terms::GROUND)
}

fn refused(bytes: &[u8], map: &str) -> String {
    let map = Map::parse("map.toml", map).unwrap_or_else(|problems| panic!("{problems}"));
    assess(&Log::open(bytes).unwrap(), &map, &Terms::GROUND, 1).unwrap_err().to_string()
}

fn trips(assessment: &Assessment) -> u64 {
    assessment.trips.last().unwrap().trips
}

fn mentions(assessment: &Assessment, words: &str) -> bool {
    assessment.remarks.iter().any(|remark| remark.contains(words))
}

fn counts(log: &Log<'_>) -> Vec<u64> {
    log.topics.iter().map(|topic| topic.records).collect()
}

#[test]
fn lever_is_the_maps_or_the_recordings() {
    let stated = |lever: &str| {
        replace_passage(CIRCLE_MAP, "source = \"gnss\"", &format!("source = \"gnss\"\nlever_m = {lever}")).into_owned()
    };
    for (lever, right, wrong) in [
        ([0.0, 0.0], "[0.0, 0.0]", "[0.6, 0.0]"),
        ([0.6, 0.0], "[0.6, 0.0]", "[0.0, 0.0]"),
        ([0.1, -0.8], "[0.1, -0.8]", "[1, 0]"),
    ] {
        let bytes = json(&circle(20, lever, no_fault), None);
        assert_eq!(trips(&judge(&bytes, &stated(right))), 0, "{lever:?}");
        let found = judge(&bytes, CIRCLE_MAP);
        assert_eq!((trips(&found), found.facts.lever_m), (0, Some(lever)), "{:?}", found.remarks);
        assert!(mentions(&found, &format!("state `lever_m = [{}, {}]`", lever[0], lever[1])), "{:?}", found.remarks);
        let false_lever = judge(&bytes, &stated(wrong));
        assert!(
            trips(&false_lever) > 0 && mentions(&false_lever, "trips of gate and drift"),
            "{:?}",
            false_lever.remarks
        );
    }
}

#[test]
fn limits_of_the_platform_are_used() {
    let bytes = json(&circle(20, [0.6, 0.0], no_fault), None);
    let log = Log::open(&bytes).unwrap();
    let mut terms = Terms::GROUND;
    let ground = assess_with(&log, CIRCLE_MAP, &terms);
    terms.limits.odometry_permille = 100;
    let loose = assess_with(&log, CIRCLE_MAP, &terms);
    assert!(loose.injected[2].after_s > ground.injected[2].after_s, "a slow drift is noticed later");
    terms = Terms::GROUND;
    terms.limits.rear_axle_mm = 20;
    let short = assess_with(&log, CIRCLE_MAP, &terms);
    assert!(
        trips(&short) == 0 && mentions(&short, "0.02 m ahead") && mentions(&ground, "0.6 m ahead"),
        "{:?}",
        short.remarks
    );
    // The origin of a long vehicle reaches the fence that a short one's does not.
    let fenced = format!("{CIRCLE_MAP}\n[fence]\ncorners = [[-7, -1.5], [7, -1.5], [7, 12], [-7, 12]]\n");
    assert_eq!(assess_with(&log, &fenced, &terms).trips[4].trips, 0);
    terms.limits.rear_axle_mm = 6000;
    assert!(assess_with(&log, &fenced, &terms).trips[4].trips > 0);
}

/// Places of the chunks of a file: kind 6, a length, and behind it 16 bytes of times.
fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let (mut index, mut found) = (8, Vec::new());
    while index + 9 < bytes.len() - 8 {
        let next = index + 9 + u64::from_le_bytes(bytes[index + 1..index + 9].try_into().unwrap()) as usize;
        if bytes[index] == 6 {
            found.push((index, next));
        }
        index = next;
    }
    found
}

/// A false bit in a chunk's kind, in its length, in its sizes, in its CRC, in its data: that chunk is lost, and the result
/// says where.
#[test]
fn one_false_bit_costs_one_chunk_and_is_told() {
    let pairs = circle(20, [0.0, 0.0], no_fault);
    for compression in [None, ZSTD] {
        let bytes = json(&pairs, compression);
        let (all, whole) = (chunks(&bytes), counts(&Log::open(&bytes).unwrap()));
        assert!(all.len() > 10, "{}", all.len());
        for (i, (from, to)) in all.iter().enumerate() {
            for (byte, bit) in
                [(0, 4), (1, 2), (2, 3), (5, 1), (9 + 16, 1), (9 + 25, 1), (to - from - 40, 2), (to - from - 9, 0)]
            {
                let mut bytes = bytes.clone();
                bytes[from + byte] ^= 1 << bit;
                let log = Log::open(&bytes).unwrap();
                let text = log.end.why.clone().unwrap_or_default();
                let case = format!("chunk {i} at {from}, byte {byte}: {text}");
                if text.is_empty() {
                    // A bit of zstd's filling changes nothing.
                    assert!(compression.is_some() && counts(&log) == whole, "{case}");
                    continue;
                }
                assert!(text.contains(&format!("bytes {from} to ")) && log.end.gaps.len() == 1, "{case}");
                let lost: Vec<u64> = whole.iter().zip(counts(&log)).map(|(whole, read)| whole - read).collect();
                assert!((1..80).contains(&lost.iter().sum::<u64>()), "{case}: {lost:?}");
                let result = assess_with(&log, CIRCLE_MAP, &Terms::GROUND);
                assert_eq!(
                    (trips(&result), mentions(&result, "could not be read")),
                    (0, true),
                    "{case}: {:?}",
                    result.trips
                );
                let ends = [0, all.len() - 1].contains(&i);
                assert_eq!(result.facts.parts, (!ends).then_some(2), "{case}");
            }
        }
    }
}

#[test]
fn cause_of_a_missing_input_stands_first() {
    let mut bytes = json(&circle(1, [0.0, 0.0], no_fault), None);
    let all = chunks(&bytes);
    all.iter().for_each(|(_, to)| bytes[to - 9] ^= 1);
    let (line, requested) = (refused(&bytes, CIRCLE_MAP), guess(&Log::open(&bytes).unwrap()).unwrap_err().to_string());
    for text in [line, requested] {
        assert!(text.starts_with("read to byte ") && text.contains("a chunk's CRC is "), "{text}");
    }
}

#[test]
fn receiver_without_a_time_is_not_judged() {
    let map =
        replace_passage(CIRCLE_MAP, "source = \"gnss\"", "source = \"gnss\"\ntime = { field = \"utc\", unit = \"s\" }");
    let judged = |utc: fn(f64) -> String| judge(&json(&circle(20, [0.6, 0.0], utc), None), &map);
    let no_faults: [fn(f64) -> String; 3] =
        [|_| ",\"utc\":0".to_owned(), |_| ",\"utc\":null".to_owned(), |_| ",\"utc\":1700000000".to_owned()];
    for none in no_faults {
        let result = judged(none);
        let time_base = result.trips.iter().find(|tripped| tripped.check == Some(Check::TimeBase)).unwrap();
        assert!(!time_base.judged && trips(&result) == 0, "{:?}", result.trips);
        assert!(mentions(&result, "the time base is not judged"), "{:?}", result.remarks);
    }
    let now_and_then =
        judged(|t| format!(",\"utc\":{}", if t < 2.0 || (9.0..10.0).contains(&t) { 0.0 } else { 1.7e9 + t }));
    assert!(now_and_then.trips[3].judged && trips(&now_and_then) == 0, "{:?}", now_and_then.trips);
    assert!(mentions(&now_and_then, "no time in 30 of 201 fixes"), "{:?}", now_and_then.remarks);
    assert!(trips(&judged(|t| format!(",\"utc\":{}", if t < 9.0 { 1.7e9 + t } else { 1.8e9 + t }))) > 0);
}

#[test]
fn guess_leaves_out_a_constant_time() {
    let guessed = |utc: fn(u64) -> u64| {
        let mut bytes = [&b"ULog\x01\x12\x35\x01"[..], &[0; 8]].concat();
        let formats = [
            "vehicle_gps_position:uint64_t timestamp;uint64_t time_utc_usec;int32_t lat;int32_t lon;float eph;uint8_t fix_type;",
            "vehicle_local_position:uint64_t timestamp;float vx;float vy;float heading;",
        ];
        formats.iter().for_each(|format| bytes.extend(record(b'F', format.as_bytes())));
        bytes.extend(record(b'A', b"\0\x01\0vehicle_gps_position"));
        bytes.extend(record(b'A', b"\0\x02\0vehicle_local_position"));
        for i in 0..20_u64 {
            let stamp_bytes = (i * 100_000).to_le_bytes();
            bytes.extend(record(
                b'D',
                &[&[1, 0], &stamp_bytes[..], &utc(i).to_le_bytes(), &[0; 8], &[0, 0, 128, 63, 3]].concat(),
            ));
            bytes.extend(record(b'D', &[&[2, 0], &stamp_bytes[..], &[0; 12]].concat()));
        }
        guess(&Log::open(&bytes).unwrap()).unwrap()
    };
    assert!(guessed(|i| 1_700_000_000_000_000 + i).contains("time_utc_usec"));
    assert!(!guessed(|_| 0).contains("time_utc_usec") && !guessed(|_| 7).contains("time_utc_usec"));
}

#[test]
fn definition_that_does_not_fit_is_refused() {
    let drive = drive(5, 2.0);
    let error_text =
        |definition: &str| refused(&mcap_with(&drive, None, definition.as_bytes(), |message| message), MCAP_MAP);
    let swallowed = error_text(&replace_passage(ODOMETRY, "float32[] rest\n====", "float32[] rest===="));
    assert!(swallowed.contains("topic `/odom`: line 6 of its definition, `float32[] rest===="), "{swallowed}");
    let short = error_text(&replace_passage(ODOMETRY, "float32[] rest\n", ""));
    assert!(short.contains("8 of a message's ") && short.contains("left over behind the last field"), "{short}");
    let long = error_text(&replace_passage(ODOMETRY, "float32[] rest\n", "float32[] rest\nfloat64 more\n"));
    assert!(long.contains("a message ends after "), "{long}");
}

#[test]
fn unreadable_topic_spoils_no_other() {
    let drive = drive(5, 2.0);
    let latin = [&b"# 20 \xb0C\n"[..], ODOMETRY.as_bytes()].concat();
    assert_eq!(trips(&judge(&mcap_with(&drive, None, &latin, |message| message), MCAP_MAP)), 0);
    let bytes = mcap_with(&drive, None, b"float64 \xb0", |message| message);
    let log = Log::open(&bytes).unwrap();
    assert_eq!((counts(&log), log.end.why.clone()), (vec![100, 100], None));
    assert!(log.has_columns("/fix", &["p[0]"]) && !log.has_columns("/odom", &["place[0]"]));
}

/// Ten seconds, and the same stamps again under later recording times.
#[test]
fn looped_recording_is_judged_in_parts() {
    let repeat = |pairs: Vec<Pair>, back: f64| -> Vec<Pair> {
        let stamp = |text: &str, t: f64| {
            let index = text.find(',').unwrap();
            format!("{{\"t\":{}{}", if t >= 10.0 { t - back } else { t }, &text[index..])
        };
        pairs
            .into_iter()
            .map(|(us, fix, odometry)| (us, stamp(&fix, us as f64 / 1e6), stamp(&odometry, us as f64 / 1e6)))
            .collect()
    };
    for (back, words) in [
        (10.0, "stamps go back by 10 s at 10.0 s"),
        (0.5, "stamps go back by 0.5 s at 10.0 s"),
        (3.5, "go back by 3.5 s"),
    ] {
        let result = judge(&json(&repeat(circle(20, [0.6, 0.0], no_fault), back), None), CIRCLE_MAP);
        assert!(mentions(&result, words), "{:?}", result.remarks);
        assert_eq!((trips(&result), result.facts.fixes, result.facts.parts), (0, 201, Some(2)), "{:?}", result.trips);
        assert!((result.judged_s - 20.0).abs() < 0.2, "{}", result.judged_s);
    }
}

#[test]
fn compressed_recordings_are_read_alike() {
    let lz4 = include_bytes!("made/lz4.mcap");
    assert_eq!(trips(&judge(lz4, CIRCLE_MAP)), 0);
    let drive = drive(5, 2.0);
    let packed =
        mcap_with(&drive, None, ODOMETRY.as_bytes(), |message| zstd::encode_all(message.as_slice(), 1).unwrap());
    let result = judge(&packed, MCAP_MAP);
    assert!(trips(&result) == 0 && mentions(&result, "messages are zstd frames"), "{:?}", result.remarks);
    for (bytes, map) in [(packed, MCAP_MAP), (ulog(&drive).0, ULOG_MAP)] {
        let whole = zstd::encode_all(bytes.as_slice(), 1).unwrap();
        assert_eq!(judge(&whole, map).facts, judge(&bytes, map).facts);
        let cut = Log::open(&whole[..whole.len() / 2]).map(|log| log.end.why);
        assert!(cut.as_ref().is_ok_and(Option::is_some) || cut.is_err(), "{cut:?}");
    }
}

#[test]
fn packed_file_expands_within_its_bound() {
    for head in [mcap::MAGIC, made::ROVER] {
        let endless = std::io::Read::chain(head, std::io::Read::take(std::io::repeat(0), assess::log::MAX_LOG));
        let bomb = zstd::encode_all(endless, 1).unwrap();
        assert!(bomb.len() < 1 << 20);
        assert_eq!(Log::open(&bomb).unwrap_err().to_string(), "at byte 268435456: at most 268435456 bytes are read");
    }
}

#[test]
fn split_recording_is_one() {
    let pairs = circle(20, [0.6, 0.0], no_fault);
    let files = [json(&pairs[..100], None), json(&pairs[100..], ZSTD)];
    let log = Log::open_all(&[("bag_0.mcap", &files[0]), ("bag_1.mcap", &files[1])]).unwrap();
    let (split, whole) = (assess_with(&log, CIRCLE_MAP, &Terms::GROUND), judge(&json(&pairs, None), CIRCLE_MAP));
    assert_eq!((split.facts, split.trips), (whole.facts, whole.trips));
    let other = ulog(&drive(2, 2.0)).0;
    let error_text = Log::open_all(&[("a.mcap", &files[0]), ("b.ulg", &other)]).unwrap_err().to_string();
    assert!(error_text.contains("b.ulg: another format"), "{error_text}");
}

#[test]
fn unread_formats_say_what_to_do() {
    for (bytes, words) in [
        (&b"SQLite format 3\0......"[..], "ros2 bag convert"),
        (b"#ROSBAG V2.0\n", "rosbags-convert"),
        (b"\x1f\x8b\x08", "gunzip"),
    ] {
        let error_text = Log::open(bytes).unwrap_err().to_string();
        assert!(error_text.contains(words) && !error_text.contains('\n'), "{error_text}");
    }
}

/// The drive as a ULog with a sync record after every tenth record from the 21st on, and the offsets of these.
fn synced(drive: &[made::At]) -> (Vec<u8>, Vec<usize>) {
    let sync = record(b'S', &[0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12]);
    let (bytes, borders) = ulog(drive);
    let (mut all, mut places) = (bytes[..borders[0]].to_vec(), Vec::new());
    for (i, two) in borders.windows(2).enumerate() {
        all.extend(&bytes[two[0]..two[1]]);
        if i > 20 && i % 10 == 0 {
            places.push(all.len());
            all.extend(&sync);
        }
    }
    (all, places)
}

#[test]
fn ulog_goes_on_at_the_next_sync_record() {
    let (bytes, places) = synced(&drive(10, 2.0));
    assert_eq!(counts(&Log::open(&bytes).unwrap()), [200, 200]);
    for at in places[..places.len() - 1].iter().copied() {
        let rubbish = [&bytes[..at], b"\x21\xff\x00rubbish", &bytes[at..]].concat();
        let short = [&bytes[..at - 1], &bytes[at..]].concat();
        // The third record before the sync record; two stand between.
        let earlier = [&bytes[..at - 90], &bytes[at - 89..]].concat();
        for (bytes, most) in [(rubbish, 1), (short, 1), (earlier, 5)] {
            let log = Log::open(&bytes).unwrap();
            let lost = 400 - counts(&log).iter().sum::<u64>();
            assert!(
                lost <= most && log.end.gaps.len() == 1 && log.end.at == log.end.of,
                "{at}: {lost} lost, {:?}",
                log.end
            );
            let result = assess_with(&log, ULOG_MAP, &Terms::GROUND);
            assert!(trips(&result) == 0 && mentions(&result, "1 part could not be read"), "{:?}", result.trips);
        }
    }
}

#[test]
fn variance_is_taken_as_one() {
    let map = |unit: &str| {
        replace_passage(
            CIRCLE_MAP,
            "source = \"gnss\"",
            &format!("source = \"gnss\"\nsigma = {{ field = \"covariance\", unit = \"{unit}\" }}"),
        )
        .into_owned()
    };
    let stated = |variance: f64| json(&circle(20, [0.6, 0.0], move |_| format!(",\"covariance\":{variance}")), None);
    let assessment = judge(&stated(0.0025), &map("m2"));
    assert!(
        (assessment.facts.sigma_m.unwrap() - 0.05).abs() < 1e-12 && !mentions(&assessment, "of 0 or less"),
        "{:?}",
        assessment.remarks
    );
    for unknown in [0.0, -1.0] {
        let result = judge(&stated(unknown), &map("m2"));
        assert!(mentions(&result, "201 of 201 fixes state a variance of 0 or less"), "{:?}", result.remarks);
    }
    assert!(mentions(&judge(&stated(0.0025), &map("m")), "the unit of a variance is `m2`"));
    let text = Map::parse("map.toml", &replace_passage(CIRCLE_MAP, "unit = \"m\" }\ny", "unit = \"m2\" }\ny"))
        .unwrap_err()
        .to_string();
    assert!(text.contains("a unit of variance, expected one of length"), "{text}");
}
