//! The map of a telemetry log of MAVLink, by the names of its messages.
//!
//! A ground station's time has the delays of the radio in it, so the vehicle's own time is taken where all inputs have it.

use super::varies;
use crate::log::{Log, Topic};

/// Values of `HEARTBEAT.type`: a gimbal, a camera or a ground station is no vehicle.
const WINGS: [u8; 8] = [1, 19, 20, 21, 22, 23, 24, 25];
const ROTORS: [u8; 8] = [2, 3, 4, 13, 14, 15, 29, 35];
const ROVER: u8 = 10;
/// Value of `HEARTBEAT.autopilot` for a sender that is no autopilot.
const NO_AUTOPILOT: f64 = 8.0;
/// The most by which the vehicle's times of two messages may differ, microseconds.
const SAME_CLOCK_US: f64 = 60e6;

/// A message with a field for the vehicle's time, its unit, and microseconds in it.
type Stamped = (&'static str, &'static str, &'static str, f64);

/// The stamps of all inputs.
enum Clock {
    Vehicle,
    Station,
}

impl Clock {
    /// The stamp of a message.
    fn stamp(&self, (_, field, unit, _): Stamped) -> String {
        match self {
            Clock::Vehicle => format!("stamp = {{ field = \"{field}\", unit = \"{unit}\" }}"),
            Clock::Station => "stamp = { unit = \"log\" }".to_owned(),
        }
    }
}

const RECEIVER: Stamped = ("GPS_RAW_INT", "time_usec", "us", 1.0);
const LOCAL: Stamped = ("LOCAL_POSITION_NED", "time_boot_ms", "ms", 1e3);
const GLOBAL: Stamped = ("GLOBAL_POSITION_INT", "time_boot_ms", "ms", 1e3);
const ATTITUDE: Stamped = ("ATTITUDE", "time_boot_ms", "ms", 1e3);

/// The vehicle by the first autopilot's heartbeat.
pub(super) fn vehicle(log: &Log<'_>) -> &'static str {
    let kind = heartbeat(log).and_then(|topic| log.numbers(&topic.name, &["type"])?.last()?.first().copied());
    let is = |kinds: &[u8]| kind.is_some_and(|kind| kinds.iter().any(|known| f64::from(*known) == kind));
    match (is(&WINGS), is(&ROTORS), is(&[ROVER])) {
        (true, ..) => "fixed-wing",
        (_, true, _) => "multirotor",
        (_, _, true) => "wheeled",
        (false, false, false) => "other",
    }
}

fn heartbeat<'a>(log: &'a Log<'_>) -> Option<&'a Topic> {
    let is_autopilot = |topic: &&Topic| {
        let rows = log.numbers(&topic.name, &["autopilot"]);
        rows.is_some_and(|rows| rows.first().is_some_and(|row| row[0] != NO_AUTOPILOT))
    };
    log.topics.iter().filter(|topic| topic.kind == "HEARTBEAT").find(is_autopilot)
}

/// The tables of the map, or the missing input.
pub(super) fn tables(log: &Log<'_>) -> Result<String, &'static str> {
    let is_recorded = |message: &Stamped| log.topic(message.0).is_ok();
    let fix = [RECEIVER, GLOBAL, LOCAL].into_iter().find(is_recorded);
    let fix = fix.ok_or("a fix (GPS_RAW_INT, GLOBAL_POSITION_INT, LOCAL_POSITION_NED)")?;
    let motion =
        [LOCAL, GLOBAL].into_iter().find(is_recorded).ok_or("odometry (LOCAL_POSITION_NED, GLOBAL_POSITION_INT)")?;
    let turned = [ATTITUDE, GLOBAL].into_iter().find(is_recorded).ok_or("a heading (ATTITUDE, GLOBAL_POSITION_INT)")?;
    let clock = clock(log, [fix, motion, turned]);
    let mode = match heartbeat(log) {
        // A heartbeat carries no time of the vehicle's.
        Some(topic) if matches!(clock, Clock::Station) => {
            let name = toml::Value::from(topic.name.as_str());
            format!(
                "\n[mode]\ntopic = {name}\nstamp = {{ unit = \"log\" }}\nfield = \"custom_mode\" # the autopilot's own numbers\n"
            )
        }
        Some(_) | None => String::new(),
    };
    let (fix, motion, turned) = (fixes(log, fix, &clock), odometry(motion, &clock), heading(turned, &clock));
    Ok(format!("\n{fix}\n{motion}\n{turned}{mode}"))
}

/// The vehicle's clock, if these messages are all stamped by one: a receiver may stamp by the date.
fn clock(log: &Log<'_>, messages: [Stamped; 3]) -> Clock {
    let first = |(topic, field, _, us): Stamped| {
        let rows = log.numbers(topic, &[field])?;
        varies(log, topic, field).then_some(())?;
        Some(rows.first()?[0] * us)
    };
    let times: Option<Vec<f64>> = messages.into_iter().map(first).collect();
    let near = |times: Vec<f64>| times.iter().all(|time| (time - times[0]).abs() < SAME_CLOCK_US);
    if times.is_some_and(near) { Clock::Vehicle } else { Clock::Station }
}

fn fixes(log: &Log<'_>, message: Stamped, clock: &Clock) -> String {
    let (topic, stamp) = (message.0, clock.stamp(message));
    let head = |source: &str| format!("[fix]\ntopic = \"{topic}\"\nsource = \"{source}\"\nframe = \"ned\"\n{stamp}\n");
    let global =
        "latitude = { field = \"lat\", unit = \"1e-7deg\" }\nlongitude = { field = \"lon\", unit = \"1e-7deg\" }\n";
    match topic {
        "GPS_RAW_INT" => {
            // `eph` is a dilution and no length; receivers of newer autopilots state `h_acc`.
            let sigma = if varies(log, topic, "h_acc") { "sigma = { field = \"h_acc\", unit = \"mm\" }\n" } else { "" };
            let valid = "valid = { field = \"fix_type\", at_least = 3 }\n";
            format!("{}{global}height = {{ field = \"alt\", unit = \"mm\" }}\n{sigma}{valid}", head("gnss"))
        }
        "GLOBAL_POSITION_INT" => {
            format!("{}{global}height = {{ field = \"relative_alt\", unit = \"mm\" }}\n", head("estimator"))
        }
        _ => format!(
            "{}x = {{ field = \"x\", unit = \"m\" }}\ny = {{ field = \"y\", unit = \"m\" }}\n\
             height = {{ field = \"z\", unit = \"m\", scale = -1.0 }}\n",
            head("estimator")
        ),
    }
}

fn odometry(message: Stamped, clock: &Clock) -> String {
    let (topic, stamp) = (message.0, clock.stamp(message));
    // Of `GLOBAL_POSITION_INT` centimetres a second.
    let scale = if topic == "GLOBAL_POSITION_INT" { ", scale = 0.01" } else { "" };
    let axis = |field: &str| format!("{{ field = \"{field}\", unit = \"m/s\"{scale} }}");
    format!(
        "[odometry]\ntopic = \"{topic}\"\nsource = \"estimator\"\nframe = \"ned\"\n{stamp}\nvelocity = {{ x = {}, y = {} }}\n",
        axis("vx"),
        axis("vy")
    )
}

fn heading(message: Stamped, clock: &Clock) -> String {
    let (topic, stamp) = (message.0, clock.stamp(message));
    let yaw = match topic {
        "ATTITUDE" => "{ field = \"yaw\", unit = \"rad\" }",
        _ => "{ field = \"hdg\", unit = \"deg\", scale = 0.01 }",
    };
    format!("[heading]\ntopic = \"{topic}\"\nsource = \"estimator\"\nframe = \"ned\"\n{stamp}\nyaw = {yaw}\n")
}
