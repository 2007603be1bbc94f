//! Assessments of made drives, of which the truth is known.

#![expect(clippy::unwrap_used, reason = "a test may end here")]

mod made;

use assess::log::{Format, Log};
use assess::map::Map;
use assess::{Assessment, Check, Injection, Terms, assess, guess};
use made::{FIRST, MCAP_MAP, ROVER, SIGNED, ULOG_MAP, drive, mcap, replace_passage, ulog};

fn judge(bytes: &[u8], map: &str) -> Assessment {
    let log = Log::open(bytes).unwrap();
    assert_eq!(log.end.why, None);
    let map = Map::parse("map.toml", map).unwrap_or_else(|problems| panic!("{problems}"));
    assess(&log, &map, &Terms::GROUND, 7).unwrap_or_else(|error| panic!("{error}"))
}

fn trips(assessment: &Assessment) -> Vec<u64> {
    assessment.trips.iter().map(|tripped| tripped.trips).collect()
}

#[test]
fn clean_drive_trips_no_guard() {
    let result = judge(&ulog(&drive(60, 2.0)).0, ULOG_MAP);
    assert_eq!(trips(&result), [0; 6], "{:?}", result.trips);
    assert!((result.judged_s - 60.0).abs() < 0.1, "{}", result.judged_s);
    assert_eq!((result.facts.fixes, result.facts.fixes_unused, result.facts.odometry), (1200, 0, 1200));
    assert!((result.facts.way_m - 119.9).abs() < 0.1, "{}", result.facts.way_m);
}

/// Equal numbers by three formats give the same readings; without a receiver's time and deviation in the second map.
#[test]
fn formats_agree_on_the_same_drive() {
    let drive = drive(30, 2.0);
    let first = judge(&ulog(&drive).0, ULOG_MAP);
    for compressed in [false, true] {
        let other = judge(&mcap(&drive, compressed), MCAP_MAP);
        assert_eq!((other.facts.fixes, other.facts.odometry), (first.facts.fixes, first.facts.odometry));
        assert!((other.facts.way_m - first.facts.way_m).abs() < 1e-6);
        assert_eq!(trips(&other), [0; 6], "{:?}", other.trips);
    }
}

#[test]
fn every_injection_into_motion_is_noticed() {
    let result = judge(&ulog(&drive(60, 2.0)).0, ULOG_MAP);
    let lever = result.facts.lever_m.unwrap();
    assert!((lever[0] - 0.6).abs() < 0.05 && lever[1].abs() < 0.05, "{lever:?}");
    assert_eq!(result.injected.len(), 10);
    for injected in &result.injected {
        let name = injected.injection.name();
        // A replay needs ten seconds of past, which not every moment has.
        let least = if matches!(injected.injection, Injection::Replay(_)) { 10 } else { 20 };
        assert!((least..=20).contains(&injected.n), "{name}: {}", injected.n);
        assert_eq!((injected.noticed, injected.moving), (injected.n, injected.n), "{name}: {:?}", injected.by);
        let longest = injected.after_s.last().copied().unwrap();
        let seconds = match injected.injection {
            Injection::Jump(_) => 0.11,
            // The receiver's time is late by more than the limit with the first late fix.
            Injection::Delay(_) => 0.11,
            Injection::FrozenStamp => 0.41,
            Injection::Freeze | Injection::Replay(_) => 1.0,
            Injection::Drift(_) => 5.0,
        };
        assert!(longest <= seconds, "{name}: {longest} s, expected at most {seconds}");
    }
    let failed_checks = |i: usize| result.injected[i].by.keys().copied().collect::<Vec<_>>();
    assert_eq!((failed_checks(1), failed_checks(4)), (vec![Check::Silence], vec![Check::Gate]));
    // At 2 m/s a fix that is half a second late is also beyond the gate.
    assert!(
        failed_checks(7).contains(&Check::Gate) && failed_checks(7).contains(&Check::TimeBase),
        "{:?}",
        failed_checks(7)
    );
}

/// A vehicle at rest stays where a frozen fix is: the recording cannot show more, and the result reports it.
#[test]
fn freeze_at_rest_is_not_noticed() {
    let result = judge(&ulog(&drive(60, 0.0)).0, ULOG_MAP);
    let freeze = &result.injected[0];
    assert_eq!((freeze.injection, freeze.n, freeze.noticed, freeze.moving), (Injection::Freeze, 20, 0, 0));
    assert_eq!(result.injected[4].noticed, 20, "a jump is");
}

#[test]
fn gap_of_fixes_is_one_trip_of_silence() {
    let mut drive = drive(60, 2.0);
    drive.drain(400..420);
    let result = judge(&ulog(&drive).0, ULOG_MAP);
    assert_eq!(trips(&result)[..2], [1, 0], "{:?}", result.trips);
    let silence = &result.trips[0];
    // The last fix before the gap is at 19.95 s and the limit 300 ms; both sources stop, the next reading is at 21 s.
    assert!((20.25..20.36).contains(&silence.first[0].at_s), "{:?}", silence.first);
    assert_eq!(silence.first[0].mode.as_deref(), Some("mission"));
    assert!((silence.failing_s + silence.at_risk_s - result.judged_s).abs() < 1e-9);
}

#[test]
fn restart_ends_a_lasting_failure() {
    let mut drive = drive(60, 2.0);
    drive.iter_mut().skip(400).for_each(|pose| pose.x += 30.0);
    let lasting = judge(&ulog(&drive).0, ULOG_MAP);
    assert_eq!((trips(&lasting)[1], lasting.restarts), (1, 0));
    assert!(lasting.trips[1].failing_s > 39.0, "a jump never heals itself");
    let repeated = judge(&ulog(&drive).0, &format!("{ULOG_MAP}\n[judge]\nrestart_s = 2.0\n"));
    assert_eq!((trips(&repeated)[1], repeated.restarts), (1, 1));
    assert!((1.9..2.2).contains(&repeated.trips[1].failing_s), "{:?}", repeated.trips[1]);
}

#[test]
fn leaving_the_fence_trips_the_geofence() {
    let fenced = |size: f64| {
        let corners = format!("[[-{size}, -{size}], [{size}, -{size}], [{size}, {size}], [-{size}, {size}]]");
        judge(&ulog(&drive(20, 2.0)).0, &format!("{ULOG_MAP}\n[fence]\ncorners = {corners}\n"))
    };
    assert_eq!((trips(&fenced(200.0))[4], trips(&fenced(15.0))[4]), (0, 1));
}

#[test]
fn unmodelled_vehicle_is_named_in_remarks() {
    let drive = ulog(&drive(20, 5.0)).0;
    let result = judge(&drive, &replace_passage(ULOG_MAP, "\"wheeled\"", "\"multirotor\""));
    let mentions = |words: &str| result.remarks.iter().any(|remark| remark.contains(words));
    assert!(
        mentions("expects wheels") && mentions("a multirotor") && mentions("made for 3 m/s"),
        "{:?}",
        result.remarks
    );
    let result = judge(&drive, &replace_passage(ULOG_MAP, "\"encoders\"", "\"gnss\""));
    assert!(result.remarks.iter().any(|remark| remark.contains("not independent")), "{:?}", result.remarks);
}

#[test]
fn seed_alone_decides_the_moments() {
    let bytes = ulog(&drive(60, 2.0)).0;
    let (log, map) = (Log::open(&bytes).unwrap(), Map::parse("map.toml", ULOG_MAP).unwrap());
    let injected = |seed| assess(&log, &map, &Terms::GROUND, seed).unwrap().injected;
    assert_eq!(injected(3), injected(3));
    assert_ne!(injected(3), injected(4));
}

#[test]
fn telemetry_log_of_a_rover_is_judged() {
    let log = Log::open(ROVER).unwrap();
    let map = guess(&log).unwrap();
    assert!(map.contains("vehicle = \"wheeled\"") && map.contains("field = \"time_boot_ms\""), "{map}");
    let result = judge(ROVER, &map);
    assert_eq!((log.format, result.facts.fixes, result.facts.odometry), (Format::Tlog, 30, 60));
    // A fix each 0.4 s is silence between any two; place and heading are right.
    assert_eq!((trips(&result)[1], trips(&result)[2]), (0, 0), "{:?}", result.trips);
    assert!((result.facts.way_m - 11.8).abs() < 0.1, "{}", result.facts.way_m);
    // By the ground station's time the same fixes come with the delays of the radio.
    let station = map.replace("field = \"time_usec\", unit = \"us\"", "unit = \"log\"");
    let station = station.replace("field = \"time_boot_ms\", unit = \"ms\"", "unit = \"log\"");
    assert_eq!(judge(ROVER, &station).facts.fixes, 30);
}

#[test]
fn versions_and_signatures_carry_the_same_messages() {
    let paths: Vec<assess::log::Path> = ["yaw", "yawspeed"].iter().map(|path| path.parse().unwrap()).collect();
    let attitudes = |bytes: &[u8]| {
        let log = Log::open(bytes).unwrap();
        assert_eq!(log.end.why, None);
        let rows = log.rows("ATTITUDE", &paths).unwrap().rows.into_iter();
        rows.take(10).map(|row| (row.log_us, row.values)).collect::<Vec<_>>()
    };
    let rover = attitudes(ROVER);
    assert_eq!((rover.len(), attitudes(SIGNED) == rover, attitudes(FIRST) == rover), (10, true, true), "{rover:?}");
    let log = Log::open(SIGNED).unwrap();
    assert!(log.notes.iter().any(|note| note.starts_with("49 frames are signed")), "{:?}", log.notes);
    let accuracy = |bytes: &[u8]| Log::open(bytes).unwrap().has_columns("GPS_RAW_INT", &["h_acc"]);
    assert!(accuracy(ROVER) && accuracy(FIRST), "a field that version 1 lacks is 0 there");
}
