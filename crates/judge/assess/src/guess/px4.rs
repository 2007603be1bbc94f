//! The map of a PX4 ULog, by the names of its topics.

use super::varies;
use crate::log::Log;

/// The vehicle by PX4's `vehicle_status.vehicle_type`: 1 rotary wing, 2 fixed wing, 3 rover.
pub(super) fn vehicle(log: &Log<'_>) -> &'static str {
    let kind = log.numbers("vehicle_status", &["vehicle_type"]);
    match kind.and_then(|rows| rows.last().and_then(|values| values.first().copied())) {
        Some(1.0) => "multirotor",
        Some(2.0) => "fixed-wing",
        Some(3.0) => "wheeled",
        Some(_) | None => "other",
    }
}

/// The tables of the map, or the missing input.
pub(super) fn tables(log: &Log<'_>) -> Result<String, &'static str> {
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
        // Newer logs have metres as `double`, older ones millimetres as `int32`.
        let heights = [("altitude_msl_m", "m"), ("alt", "mm")];
        let height = heights.into_iter().find(|(field, _)| log.has_columns(topic, &[field]));
        let height = height.map_or_else(String::new, |(field, unit)| {
            format!("height = {{ field = \"{field}\", unit = \"{unit}\" }}\n")
        });
        Some(format!(
            "[fix]\ntopic = \"{topic}\"\nsource = \"gnss\"\nframe = \"ned\"\nstamp = {{ field = \"timestamp\", unit = \"us\" }}\n\
             latitude = {{ field = \"{lat}\", unit = \"{unit}\" }}\nlongitude = {{ field = \"{lon}\", unit = \"{unit}\" }}\n\
             {height}sigma = {{ field = \"eph\", unit = \"m\" }}\n{time}valid = {{ field = \"fix_type\", at_least = 3 }}\n"
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
