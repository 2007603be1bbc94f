//! Scenarios out of made drives: route, speed and noise are the recording's, and a recording that no scenario expresses is refused in words.

#![expect(clippy::unwrap_used, reason = "a test may end here")]

mod made;

use std::collections::BTreeMap;
use std::io::Cursor;

use assess::log::Log;
use assess::map::Map;
use assess::{Terms, Wanted, guess, scenario_text};
use config::platform::{Aloft, Limits};
use made::{At, ROVER, ULOG_MAP, drive, replace_passage, ulog, wanted};
use mcap::records::MessageHeader;
use scenario::Scenario;

fn made(bytes: &[u8], map: &str, terms: &Terms, wanted: &Wanted<'_>) -> Result<String, String> {
    let map = Map::parse("map.toml", map).unwrap_or_else(|problems| panic!("{problems}"));
    scenario_text(&Log::open(bytes).unwrap(), &map, terms, wanted).map_err(|error| error.to_string())
}

fn of_drive(drive: &[At]) -> Result<String, String> {
    made(&ulog(drive).0, ULOG_MAP, &Terms::GROUND, &wanted("ground"))
}

fn parsed(text: &str) -> Scenario {
    scenario::parse("mine.toml", "mine", text).unwrap_or_else(|problems| panic!("{problems}\n{text}"))
}

/// Distance of a place from the nearest leg.
fn distance(place: [f64; 2], legs: &[[f64; 2]]) -> f64 {
    let to_leg = |two: &[[f64; 2]]| {
        let [x, y] = [0, 1].map(|axis| two[1][axis] - two[0][axis]);
        let along = ((place[0] - two[0][0]) * x + (place[1] - two[0][1]) * y) / (x * x + y * y);
        let along = along.clamp(0.0, 1.0);
        libm::hypot(place[0] - two[0][0] - along * x, place[1] - two[0][1] - along * y)
    };
    legs.windows(2).map(to_leg).fold(f64::MAX, f64::min)
}

#[test]
fn route_follows_the_recorded_places() {
    let drive = drive(60, 2.0);
    let text = of_drive(&drive).unwrap();
    let scenario = parsed(&text);
    let scene = scenario.scene();
    let point = |point: &scenario::Point| point.map(|along| along.get());
    let legs: Vec<[f64; 2]> =
        std::iter::once(point(&scene.start.at_m)).chain(scene.route.iter().map(|place| point(place))).collect();
    // The origin of `ground` is where the made drive has its receiver; the world's zero is in the comment.
    let shift = text.split("of the point [").nth(1).unwrap().split(']').next().unwrap();
    let shift: Vec<f64> = shift.split(", ").map(|number| number.parse().unwrap()).collect();
    let farthest = drive.iter().map(|at| distance([at.x - shift[0], at.y - shift[1]], &legs)).fold(0.0, f64::max);
    assert!(farthest < 0.35, "{farthest}\n{text}");
    assert!((2..=64).contains(&scene.route.len()) && (scene.start.heading_rad.get() - 0.5).abs() < 0.02, "{text}");
}

#[test]
fn speed_and_noise_are_those_of_the_recording() {
    let scenario = parsed(&of_drive(&drive(60, 2.0)).unwrap());
    let speed = scenario.operator.step[0].values.map(|values| values.settings().speed_mm_s);
    assert_eq!(speed, Some(2000));
    // Errors are uniform within 20 mm: a deviation of 12 mm, of which the median tells 15; the twin's is 40 mm.
    let noise = scenario.models.noise.get();
    assert!((0.25..0.45).contains(&noise), "{noise}");
}

#[test]
fn fence_of_the_map_is_kept() {
    let bytes = ulog(&drive(20, 2.0)).0;
    let fenced = |size: f64| {
        let corners = format!("[[-{size}, -{size}], [{size}, -{size}], [{size}, {size}], [-{size}, {size}]]");
        made(&bytes, &format!("{ULOG_MAP}\n[fence]\ncorners = {corners}\n"), &Terms::GROUND, &wanted("ground"))
    };
    let text = fenced(60.0).unwrap();
    assert!(text.contains("The fence is that of the map") && text.contains("[60.0, 60.0]"), "{text}");
    assert!(fenced(10.0).unwrap_err().starts_with("the route leaves the map's [fence] at "));
    let error_text = fenced(600.0).unwrap_err();
    assert!(error_text.contains("are 1200 m long or wide"), "{error_text}");
}

#[test]
fn words_of_the_recording_stay_in_their_comment() {
    let map = replace_passage(ULOG_MAP, "title = \"made drive\"", "title = \"a\\n[[fault]]\\nb\"");
    let text = made(&ulog(&drive(20, 2.0)).0, &map, &Terms::GROUND, &wanted("ground")).unwrap();
    assert!(text.contains("# Map: a\\n[[fault]]\\nb\n") && parsed(&text).fault.is_empty(), "{text}");
}

#[test]
fn silence_and_bias_stand_as_comments() {
    let mut drive = drive(60, 2.0);
    drive.drain(400..420);
    let text = of_drive(&drive).unwrap();
    assert!(text.contains("# The longest silence of fixes: 1.05 s, 19.9 s after the start"), "{text}");
    // With the marks taken off, the fault is one that a scenario has.
    let at = text.find("# [[fault]]").unwrap();
    let with_fault = format!("{}{}", &text[..at], text[at..].replace("# ", ""));
    assert_eq!(parsed(&with_fault).fault.len(), 1);
}

/// Rows up and down, 400 m long and so far apart, at 2 m/s.
fn rows(count: u64, apart_m: f64) -> Vec<At> {
    let place = |i: u64| {
        let (along, row) = (i % 100, i / 100);
        let along = if row % 2 == 0 { along } else { 99 - along } as f64;
        At { us: 5_000_000 + i * 2_000_000, x: 4.0 * along, y: row as f64 * apart_m, yaw: 0.0, speed: 2.0, rate: 0.0 }
    };
    (0..100 * count).map(place).collect()
}

#[test]
fn inexpressible_drives_are_refused_in_words() {
    for (drive, words) in [
        (drive(20, 5.0), "moves at up to 5.0 m/s in 95 % of the time, platform `ground` at 3 m/s at most"),
        (drive(20, 0.0), "stays within 0.0 m of its start"),
        (drive(900, 2.9), "m long or wide, and a scenario's world is 1000 m each way"),
    ] {
        let error_text = of_drive(&drive).unwrap_err();
        assert!(error_text.contains(words), "{error_text}");
    }
    let error_text = of_drive(&rows(40, 4.0)).unwrap_err();
    assert!(
        error_text.contains("way points or more to stay within 2 m of the recorded one, and a scenario has 64"),
        "{error_text}"
    );
    let error_text = of_drive(&rows(28, 15.0)).unwrap_err();
    assert!(error_text.contains("s at the recorded speed, and a trial lasts 7200 s at most"), "{error_text}");
    assert!(of_drive(&rows(12, 15.0)).is_ok(), "fewer rows are a scenario");
}

fn air() -> Terms {
    let aloft = Aloft {
        cruise_mm: 3000,
        floor_ceiling_mm: [1500, 6000],
        climb_mm_s: 800,
        height_gate_mm: 800,
        gust_spare_mm_s: 0,
    };
    let limits = Limits { aloft: Some(aloft), free: true, rear_axle_mm: 0, ..Limits::GROUND };
    Terms { limits, ..Terms::GROUND }
}

/// A scenario of a rover's log that is taken for a multirotor's, with this line for its heights.
fn flown(height: &str, terms: &Terms, wanted: &Wanted<'_>) -> Result<String, String> {
    let map = guess(&Log::open(ROVER).unwrap()).unwrap().replace("\"wheeled\"", "\"multirotor\"");
    let map = map.replace("height = { field = \"alt\", unit = \"mm\" }\n", height);
    made(ROVER, &map, terms, wanted)
}

#[test]
fn flight_needs_heights_that_the_platform_has() {
    let refused = |height: &str, terms: &Terms, wanted: &Wanted<'_>| flown(height, terms, wanted).unwrap_err();
    assert!(refused("", &Terms::GROUND, &wanted("ground")).contains("platform `ground` does not"));
    assert!(refused("", &air(), &wanted("air")).contains("add `height` to [fix]"));
    let level = refused("height = { field = \"alt\", unit = \"mm\" }\n", &air(), &wanted("air"));
    assert!(level.contains("flies at 0.0 m (median) to 0.0 m") && level.contains("at 1.5 to 6 m"), "{level}");
    // The time since the start as a height: from 0 to 11.6 m, and a third of it.
    let rising = |scale: &str| format!("height = {{ field = \"time_usec\", unit = \"m\", scale = {scale} }}\n");
    assert!(refused(&rising("1e-6"), &air(), &wanted("air")).contains("5.6 m (median) to 10.4 m"));
    let text = flown(&rising("0.4e-6"), &air(), &wanted("air")).unwrap();
    assert!(
        text.contains("the platform flies the whole route at 3.0 m") && text.contains("platform = \"air\""),
        "{text}"
    );
    let wing = Wanted { least_speed_m_s: 1.5, ..wanted("wing") };
    assert!(refused(&rising("0.4e-6"), &air(), &wing).contains("platform `wing` at 1.5 m/s at least"));
    let map = guess(&Log::open(ROVER).unwrap()).unwrap();
    assert!(made(ROVER, &map, &air(), &wanted("air")).unwrap_err().contains("has wheels and platform `air` flies"));
    let orbit = Terms { limits: Limits { free: true, ..Limits::GROUND }, ..Terms::GROUND };
    assert!(made(ROVER, &map, &orbit, &wanted("space")).unwrap_err().contains("is in an orbit"));
}

/// A bag without odometry: a twist, an IMU and a receiver, and a command that is not taken for a measurement.
#[test]
fn types_of_ros_give_a_map() {
    let mut writer = mcap::WriteOptions::new().compression(None).create(Cursor::new(Vec::new())).unwrap();
    let topics = [("/cmd", "TwistStamped"), ("/wheels", "TwistStamped"), ("/imu", "Imu"), ("/gps", "NavSatFix")];
    let channels = topics.map(|(topic, kind)| {
        let schema = writer.add_schema(&format!("any_msgs/msg/{kind}"), "jsonschema", b"{}").unwrap();
        writer.add_channel(schema, topic, "json", &BTreeMap::new()).unwrap()
    });
    for i in 0..200_u64 {
        let (us, yaw) = (i * 100_000, 0.02 * i as f64);
        let header =
            format!(r#""header":{{"stamp":{{"sec":{},"nanosec":{}}}}}"#, us / 1_000_000, us % 1_000_000 * 1000);
        let (sin, cos) = libm::sincos(yaw);
        let degrees = [5.0 * (1.0 - cos) / 111_200.0 + 48.0, 5.0 * sin / 74_500.0 + 11.0];
        let (half_sin, half_cos) = libm::sincos(yaw / 2.0);
        let twist = r#""twist":{"linear":{"x":1.0,"y":0.0},"angular":{"z":0.2}}"#;
        let texts = [
            format!("{{{header},{twist}}}"),
            format!("{{{header},{twist}}}"),
            format!(r#"{{{header},"orientation":{{"x":0.0,"y":0.0,"z":{half_sin},"w":{half_cos}}}}}"#),
            format!(
                r#"{{{header},"status":{{"status":0}},"latitude":{},"longitude":{},"position_covariance":[0.0]}}"#,
                degrees[0], degrees[1]
            ),
        ];
        for (channel_id, text) in channels.iter().zip(texts) {
            let header =
                MessageHeader { channel_id: *channel_id, sequence: 0, log_time: us * 1000, publish_time: us * 1000 };
            writer.write_to_known_channel(&header, text.as_bytes()).unwrap();
        }
    }
    writer.finish().unwrap();
    let bytes = writer.into_inner().into_inner();
    let map = guess(&Log::open(&bytes).unwrap()).unwrap();
    let [odometry, heading, setpoint] =
        ["[odometry]\ntopic = \"/wheels\"", "[heading]\ntopic = \"/imu\"", "[setpoint]\ntopic = \"/cmd\""];
    assert!(map.contains(odometry) && map.contains(heading) && map.contains(setpoint), "{map}");
    assert!(parsed(&made(&bytes, &map, &Terms::GROUND, &wanted("ground")).unwrap()).scene().route.len() > 5);
}
