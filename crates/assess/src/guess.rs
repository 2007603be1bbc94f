//! A first map out of a recording's topics: the names that PX4 and ROS use. A person checks it; `source` and `vehicle` most of all.

use crate::log::{Format, Log, Topic};

/// A map as text, to be checked by a person; the recording's topics stand in front as comments.
///
/// # Errors
/// When no topic is known as a fix, or none as odometry; the message lists the topics.
pub fn guess(log: &Log<'_>) -> Result<String, String> {
    // Names are the recording's: in a comment and in a message they stay on their line.
    let line = |topic: &Topic| {
        format!("#   {} ({}), {} messages\n", topic.name.escape_debug(), topic.kind.escape_debug(), topic.records)
    };
    let topics: String = log.topics.iter().map(line).collect();
    let parts = match log.format {
        Format::Ulog => px4(log),
        Format::Mcap => ros(log),
    };
    let parts = parts.map_err(|missing| format!("no topic is known as {missing}; the recording has\n{topics}"))?;
    let vehicle = if log.format == Format::Ulog { vehicle(log) } else { "other" };
    Ok(format!(
        "# A guess from the names of topics: check every line.\n# Topics:\n{topics}\ntitle = \"guessed\"\n\
         vehicle = \"{vehicle}\" # wheeled, multirotor, fixed-wing or other\n{parts}"
    ))
}

/// The vehicle by PX4's `vehicle_status.vehicle_type`: 1 rotary wing, 2 fixed wing, 3 rover.
fn vehicle(log: &Log<'_>) -> &'static str {
    let path = "vehicle_type".parse().into_iter().collect::<Vec<_>>();
    let kind = log.rows("vehicle_status", &path).ok().and_then(|rows| rows.last().map(|row| row.values[0]));
    match kind {
        Some(1.0) => "multirotor",
        Some(2.0) => "fixed-wing",
        Some(3.0) => "wheeled",
        Some(_) | None => "other",
    }
}

fn px4(log: &Log<'_>) -> Result<String, &'static str> {
    let estimate = ["vehicle_local_position", "vehicle_odometry"];
    let fix = px4_fix(log).ok_or("a fix (vehicle_gps_position, sensor_gps, vehicle_local_position)")?;
    let heading = if log.has("vehicle_attitude", &["q[0]", "timestamp"]) {
        "[heading]\ntopic = \"vehicle_attitude\"\nsource = \"ekf2\"\nframe = \"ned\"\n\
         stamp = { field = \"timestamp\", unit = \"us\" }\nquaternion = [\"q[0]\", \"q[1]\", \"q[2]\", \"q[3]\"]\n"
    } else if log.has(estimate[0], &["heading"]) {
        "[heading]\ntopic = \"vehicle_local_position\"\nsource = \"ekf2\"\nframe = \"ned\"\n\
         stamp = { field = \"timestamp\", unit = \"us\" }\nyaw = { field = \"heading\", unit = \"rad\" }\n"
    } else {
        return Err("a heading (vehicle_attitude, vehicle_local_position)");
    };
    let odometry = if log.has(estimate[0], &["vx", "vy"]) {
        "[odometry]\ntopic = \"vehicle_local_position\"\nsource = \"ekf2\"\nframe = \"ned\"\n\
         stamp = { field = \"timestamp\", unit = \"us\" }\n\
         velocity = { x = { field = \"vx\", unit = \"m/s\" }, y = { field = \"vy\", unit = \"m/s\" } }\n"
    } else {
        return Err("odometry (vehicle_local_position)");
    };
    let mode = match log.has("vehicle_status", &["nav_state"]) {
        true => {
            "\n[mode]\ntopic = \"vehicle_status\"\nstamp = { field = \"timestamp\", unit = \"us\" }\nfield = \"nav_state\"\n\
             names = { 0 = \"manual\", 1 = \"altitude\", 2 = \"position\", 3 = \"mission\", 4 = \"loiter\", 5 = \"return\", \
             14 = \"offboard\", 17 = \"take-off\", 18 = \"land\" }\n"
        }
        false => "",
    };
    let setpoint = match log.has("vehicle_local_position_setpoint", &["vx", "vy"]) {
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
        let (lat, lon, unit) = degrees.into_iter().find(|(lat, lon, _)| log.has(topic, &[lat, lon, "eph"]))?;
        let time = match log.has(topic, &["time_utc_usec"]) {
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
        log.has("vehicle_local_position", &["x", "y"]).then(|| {
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
    let fix = match (first("NavSatFix").next(), odometry.next()) {
        (Some(topic), _) => format!(
            "[fix]\ntopic = {topic}\nsource = \"gnss\"\n{stamp}\nlatitude = {{ field = \"latitude\", unit = \"deg\" }}\n\
             longitude = {{ field = \"longitude\", unit = \"deg\" }}\nvalid = {{ field = \"status.status\", at_least = 0 }}\n"
        ),
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
