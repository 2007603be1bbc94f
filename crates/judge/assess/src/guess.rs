//! A first map out of a recording's topics: the names that PX4 and ROS use. A person checks it; `source` and `vehicle` most of all.

use crate::lever::Estimate;
use crate::log::{Format, Log, Topic};
use crate::map::Map;
use crate::read::Read;

/// No map can be guessed from a recording.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}no topic is known as {missing}; the recording has{}", self.cause(), self.content())]
pub struct GuessError {
    /// Place up to which the recording was read, with the reason, if not to its end.
    pub unread: Option<String>,
    /// The input that no topic gives, with the names that are known.
    pub missing: &'static str,
    /// The recording's topics, a line each.
    pub topics: String,
}

impl GuessError {
    fn cause(&self) -> String {
        self.unread.as_ref().map_or_else(String::new, |unread| format!("{unread}; so "))
    }

    fn content(&self) -> String {
        match self.topics.is_empty() {
            true => " no topic that could be read".to_owned(),
            false => format!("\n{}", self.topics),
        }
    }
}

/// A map as text, to be checked by a person; the recording's topics are in front as comments.
///
/// # Errors
/// When no topic is known as a fix, or none as odometry; the message lists the topics.
pub fn guess(log: &Log<'_>) -> Result<String, GuessError> {
    // Names are the recording's: in a comment and in a message they stay on their line.
    let line = |topic: &Topic| {
        format!("#   {} ({}), {} messages\n", topic.name.escape_debug(), topic.kind.escape_debug(), topic.records)
    };
    let topics: String = log.topics.iter().map(line).collect();
    let parts = match log.format {
        Format::Ulog => px4(log),
        Format::Mcap => ros(log),
    };
    let unread = log.end.why.as_ref().map(|reason| {
        let reason = reason.replace(char::is_control, " ");
        format!("read to byte {} of {}: {reason}", log.end.at, log.end.of)
    });
    let parts = parts.map_err(|missing| GuessError { unread: unread.clone(), missing, topics: topics.clone() })?;
    let vehicle = if log.format == Format::Ulog { vehicle(log) } else { "other" };
    let cause = unread.map_or_else(String::new, |unread| format!("# Not all could be read: {unread}\n"));
    let text = format!(
        "# A guess from the names of topics: check every line.\n{cause}# Topics:\n{topics}\ntitle = \"guessed\"\n\
         vehicle = \"{vehicle}\" # wheeled, multirotor, fixed-wing or other\n{parts}"
    );
    Ok(with_lever(log, text))
}

/// The map with the lever that the recording tells under it, if it does.
fn with_lever(log: &Log<'_>, text: String) -> String {
    let estimate = Map::parse("guess", &text).ok().and_then(|map| Read::from_log(log, &map).ok()?.lever(&map));
    match estimate {
        Some(Estimate { lever_m: [ahead, left], deviation_m, .. }) => {
            let line = format!(
                "[fix]\nlever_m = [{ahead:?}, {left:?}] # metres ahead and to the left of the rear axle's middle, estimated from this recording: ±{:.2}, \
                 ±{:.2}\n",
                deviation_m[0], deviation_m[1]
            );
            text.replacen("[fix]\n", &line, 1)
        }
        None => text,
    }
}

/// True if a number is recorded and changes: a constant time or a deviation that is always 0 carries no information.
fn varies(log: &Log<'_>, topic: &str, path: &str) -> bool {
    let rows = log.numbers(topic, &[path]).unwrap_or_default();
    rows.windows(2).any(|two| two[0] != two[1])
}

/// The vehicle by PX4's `vehicle_status.vehicle_type`: 1 rotary wing, 2 fixed wing, 3 rover.
fn vehicle(log: &Log<'_>) -> &'static str {
    let kind = log.numbers("vehicle_status", &["vehicle_type"]);
    match kind.and_then(|rows| rows.last().and_then(|values| values.first().copied())) {
        Some(1.0) => "multirotor",
        Some(2.0) => "fixed-wing",
        Some(3.0) => "wheeled",
        Some(_) | None => "other",
    }
}

fn px4(log: &Log<'_>) -> Result<String, &'static str> {
    let estimate = ["vehicle_local_position", "vehicle_odometry"];
    let fix = px4_fix(log).ok_or("a fix (vehicle_gps_position, sensor_gps, vehicle_local_position)")?;
    let heading = if log.has_columns("vehicle_attitude", &["q[0]", "timestamp"]) {
        "[heading]\ntopic = \"vehicle_attitude\"\nsource = \"ekf2\"\nframe = \"ned\"\n\
         stamp = { field = \"timestamp\", unit = \"us\" }\nquaternion = [\"q[0]\", \"q[1]\", \"q[2]\", \"q[3]\"]\n"
    } else if log.has_columns(estimate[0], &["heading"]) {
        "[heading]\ntopic = \"vehicle_local_position\"\nsource = \"ekf2\"\nframe = \"ned\"\n\
         stamp = { field = \"timestamp\", unit = \"us\" }\nyaw = { field = \"heading\", unit = \"rad\" }\n"
    } else {
        return Err("a heading (vehicle_attitude, vehicle_local_position)");
    };
    let odometry = if log.has_columns(estimate[0], &["vx", "vy"]) {
        "[odometry]\ntopic = \"vehicle_local_position\"\nsource = \"ekf2\"\nframe = \"ned\"\n\
         stamp = { field = \"timestamp\", unit = \"us\" }\n\
         velocity = { x = { field = \"vx\", unit = \"m/s\" }, y = { field = \"vy\", unit = \"m/s\" } }\n"
    } else {
        return Err("odometry (vehicle_local_position)");
    };
    let mode = match log.has_columns("vehicle_status", &["nav_state"]) {
        true => {
            "\n[mode]\ntopic = \"vehicle_status\"\nstamp = { field = \"timestamp\", unit = \"us\" }\nfield = \"nav_state\"\n\
             names = { 0 = \"manual\", 1 = \"altitude\", 2 = \"position\", 3 = \"mission\", 4 = \"loiter\", 5 = \"return\", \
             14 = \"offboard\", 17 = \"take-off\", 18 = \"land\" }\n"
        }
        false => "",
    };
    let setpoint = match log.has_columns("vehicle_local_position_setpoint", &["vx", "vy"]) {
        true => {
            "\n[setpoint]\ntopic = \"vehicle_local_position_setpoint\"\n\
             velocity = { x = { field = \"vx\", unit = \"m/s\" }, y = { field = \"vy\", unit = \"m/s\" } }\n"
        }
        false => "",
    };
    Ok(format!("\n{fix}\n{odometry}\n{heading}{mode}{setpoint}"))
}

fn px4_fix(log: &Log<'_>) -> Option<String> {
    let mut gnss = ["vehicle_gps_position", "sensor_gps"].into_iter();
    // Newer logs have degrees as `double`, older ones ten-millionths as `int32`.
    let degrees = [("latitude_deg", "longitude_deg", "deg"), ("lat", "lon", "1e-7deg")];
    let found = gnss.find_map(|topic| {
        let (lat, lon, unit) = degrees.into_iter().find(|(lat, lon, _)| log.has_columns(topic, &[lat, lon, "eph"]))?;
        let time = match varies(log, topic, "time_utc_usec") {
            true => "time = { field = \"time_utc_usec\", unit = \"us\" }\n",
            false => "",
        };
        Some(format!(
            "[fix]\ntopic = \"{topic}\"\nsource = \"gnss\"\nframe = \"ned\"\nstamp = {{ field = \"timestamp\", unit = \"us\" }}\n\
             latitude = {{ field = \"{lat}\", unit = \"{unit}\" }}\nlongitude = {{ field = \"{lon}\", unit = \"{unit}\" }}\n\
             sigma = {{ field = \"eph\", unit = \"m\" }}\n{time}valid = {{ field = \"fix_type\", at_least = 3 }}\n"
        ))
    });
    found.or_else(|| {
        log.has_columns("vehicle_local_position", &["x", "y"]).then(|| {
            "[fix]\ntopic = \"vehicle_local_position\"\nsource = \"ekf2\"\nframe = \"ned\"\n\
             stamp = { field = \"timestamp\", unit = \"us\" }\n\
             x = { field = \"x\", unit = \"m\" }\ny = { field = \"y\", unit = \"m\" }\n"
                .to_owned()
        })
    })
}

/// The last part of a type's name, such as `Odometry` of `nav_msgs/msg/Odometry`.
fn is_a(kind: &str, name: &str) -> bool {
    kind.rsplit(['/', '.']).next() == Some(name)
}

fn ros(log: &Log<'_>) -> Result<String, &'static str> {
    // As a TOML string, with its quotes.
    let quoted = |topic: &Topic| toml::Value::from(topic.name.as_str()).to_string();
    let first = |name: &'static str| log.topics.iter().filter(move |topic| is_a(&topic.kind, name)).map(quoted);
    let mut odometry = first("Odometry");
    let wheels = odometry.next().ok_or("odometry (nav_msgs/Odometry)")?;
    let stamp = "stamp = { field = \"header.stamp\", unit = \"ros\" }";
    let yaw = "quaternion = [\"pose.pose.orientation.w\", \"pose.pose.orientation.x\", \"pose.pose.orientation.y\", \
               \"pose.pose.orientation.z\"]";
    let mut receivers = log.topics.iter().filter(|topic| is_a(&topic.kind, "NavSatFix"));
    let receiver = receivers.next().map(|topic| (quoted(topic), topic.name.as_str()));
    let fix = match (receiver, odometry.next()) {
        (Some((topic, name)), _) => {
            let states = |row: &Vec<f64>| row.first().is_some_and(|variance| *variance > 0.0);
            let stated = log.numbers(name, &["position_covariance[0]"]).is_some_and(|rows| rows.iter().any(states));
            let sigma = if stated { "sigma = { field = \"position_covariance[0]\", unit = \"m2\" }\n" } else { "" };
            format!(
                "[fix]\ntopic = {topic}\nsource = \"gnss\"\n{stamp}\nlatitude = {{ field = \"latitude\", unit = \"deg\" }}\n\
                 longitude = {{ field = \"longitude\", unit = \"deg\" }}\n{sigma}valid = {{ field = \"status.status\", at_least = 0 }}\n"
            )
        }
        (None, topic) => {
            let topic = topic.unwrap_or_else(|| wheels.clone());
            format!(
                "[fix]\ntopic = {topic}\nsource = {topic}\n{stamp}\n\
                 x = {{ field = \"pose.pose.position.x\", unit = \"m\" }}\n\
                 y = {{ field = \"pose.pose.position.y\", unit = \"m\" }}\n"
            )
        }
    };
    let setpoint = match first("Twist").next() {
        Some(topic) => format!("\n[setpoint]\ntopic = {topic}\nspeed = {{ field = \"linear.x\", unit = \"m/s\" }}\n"),
        None => String::new(),
    };
    Ok(format!(
        "\n{fix}\n[odometry]\ntopic = {wheels}\nsource = {wheels}\n{stamp}\n\
         speed = {{ field = \"twist.twist.linear.x\", unit = \"m/s\" }}\n\
         sideways = {{ field = \"twist.twist.linear.y\", unit = \"m/s\" }}\n\
         yaw_rate = {{ field = \"twist.twist.angular.z\", unit = \"rad/s\" }}\n\n\
         [heading]\ntopic = {wheels}\nsource = {wheels}\n{stamp}\n{yaw}\n{setpoint}"
    ))
}
