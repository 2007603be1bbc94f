//! The map of a bag of ROS, by the types of its topics.

use super::varies;
use crate::log::{Log, Topic};

/// The stamp of a message with a header.
const STAMP: &str = "stamp = { field = \"header.stamp\", unit = \"ros\" }";

/// The tables of the map, or the missing input.
pub(super) fn tables(log: &Log<'_>) -> Result<String, &'static str> {
    let mut odometry = of_type(log, "Odometry");
    let (first, second) = (odometry.next(), odometry.next());
    let twist = of_type(log, "TwistStamped").find(|topic| !is_command(topic));
    let motion = match (first, twist) {
        (Some(topic), _) => wheels(topic),
        (None, Some(topic)) => twisted(log, topic),
        (None, None) => return Err("odometry (nav_msgs/Odometry, geometry_msgs/TwistStamped)"),
    };
    // A pose by another estimator, such as AMCL, has the same path to its place as odometry.
    let pose = of_type(log, "PoseWithCovarianceStamped").next();
    let fix = match (of_type(log, "NavSatFix").next(), pose.or(second).or(first)) {
        (Some(topic), _) => receiver(log, topic),
        (None, Some(topic)) => local(topic),
        (None, None) => {
            return Err("a fix (sensor_msgs/NavSatFix, geometry_msgs/PoseWithCovarianceStamped, nav_msgs/Odometry)");
        }
    };
    // An IMU without a magnetometer leaves its orientation at one value.
    let imu = of_type(log, "Imu").find(|topic| varies(log, &topic.name, "orientation.z"));
    let heading = match (first, imu) {
        (Some(topic), _) => heading(topic, "pose.pose.orientation"),
        (None, Some(topic)) => heading(topic, "orientation"),
        (None, None) => return Err("a heading (nav_msgs/Odometry, sensor_msgs/Imu with an orientation)"),
    };
    Ok(format!("\n{fix}\n{motion}\n{heading}\n{}", setpoint(log)))
}

fn of_type<'a>(log: &'a Log<'_>, name: &'static str) -> impl Iterator<Item = &'a Topic> {
    log.topics.iter().filter(move |topic| is_a(&topic.kind, name))
}

/// The last part of a type's name, such as `Odometry` of `nav_msgs/msg/Odometry`.
fn is_a(kind: &str, name: &str) -> bool {
    kind.rsplit(['/', '.']).next() == Some(name)
}

/// True for a topic that commands a speed, by the name that ROS gives it.
fn is_command(topic: &Topic) -> bool {
    topic.name.contains("cmd")
}

/// A topic's name as a TOML string, with its quotes.
fn quoted(topic: &Topic) -> String {
    toml::Value::from(topic.name.as_str()).to_string()
}

fn receiver(log: &Log<'_>, topic: &Topic) -> String {
    let states = |row: &Vec<f64>| row.first().is_some_and(|variance| *variance > 0.0);
    let stated = log.numbers(&topic.name, &["position_covariance[0]"]).is_some_and(|rows| rows.iter().any(states));
    let sigma = if stated { "sigma = { field = \"position_covariance[0]\", unit = \"m2\" }\n" } else { "" };
    let height =
        if varies(log, &topic.name, "altitude") { "height = { field = \"altitude\", unit = \"m\" }\n" } else { "" };
    format!(
        "[fix]\ntopic = {}\nsource = \"gnss\"\n{STAMP}\nlatitude = {{ field = \"latitude\", unit = \"deg\" }}\n\
         longitude = {{ field = \"longitude\", unit = \"deg\" }}\n{height}{sigma}valid = {{ field = \"status.status\", at_least = 0 }}\n",
        quoted(topic)
    )
}

fn local(topic: &Topic) -> String {
    let topic = quoted(topic);
    format!(
        "[fix]\ntopic = {topic}\nsource = {topic}\n{STAMP}\nx = {{ field = \"pose.pose.position.x\", unit = \"m\" }}\n\
         y = {{ field = \"pose.pose.position.y\", unit = \"m\" }}\n"
    )
}

fn wheels(topic: &Topic) -> String {
    let topic = quoted(topic);
    format!(
        "[odometry]\ntopic = {topic}\nsource = {topic}\n{STAMP}\nspeed = {{ field = \"twist.twist.linear.x\", unit = \"m/s\" }}\n\
         sideways = {{ field = \"twist.twist.linear.y\", unit = \"m/s\" }}\n\
         yaw_rate = {{ field = \"twist.twist.angular.z\", unit = \"rad/s\" }}\n"
    )
}

fn twisted(log: &Log<'_>, topic: &Topic) -> String {
    // A speed sensor without a gyro leaves the rate at one value.
    let rate = match varies(log, &topic.name, "twist.angular.z") {
        true => "yaw_rate = { field = \"twist.angular.z\", unit = \"rad/s\" }\n",
        false => "",
    };
    let topic = quoted(topic);
    format!(
        "[odometry]\ntopic = {topic}\nsource = {topic}\n{STAMP}\nspeed = {{ field = \"twist.linear.x\", unit = \"m/s\" }}\n\
         sideways = {{ field = \"twist.linear.y\", unit = \"m/s\" }}\n{rate}"
    )
}

fn heading(topic: &Topic, path: &str) -> String {
    let topic = quoted(topic);
    format!(
        "[heading]\ntopic = {topic}\nsource = {topic}\n{STAMP}\nquaternion = [\"{path}.w\", \"{path}.x\", \"{path}.y\", \"{path}.z\"]\n"
    )
}

/// Speeds that were commanded: a `Twist`, or the `TwistStamped` that is named so.
fn setpoint(log: &Log<'_>) -> String {
    let plain = of_type(log, "Twist").next().map(|topic| (topic, "linear.x"));
    let stamped = of_type(log, "TwistStamped").find(|topic| is_command(topic)).map(|topic| (topic, "twist.linear.x"));
    plain.or(stamped).map_or_else(String::new, |(topic, field)| {
        format!("[setpoint]\ntopic = {}\nspeed = {{ field = \"{field}\", unit = \"m/s\" }}\n", quoted(topic))
    })
}
