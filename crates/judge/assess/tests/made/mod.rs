//! Recordings made for tests: a wheeled unit on a winding road, as ULog, as MCAP with JSON or with CDR, and as MAVLink telemetry
//! (`tools/recordings/telemetry.py` wrote the files).

#![allow(dead_code, reason = "each test program uses a part")]

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::records::MessageHeader;

/// A moment of the made drive.
#[derive(Clone, Copy)]
pub(crate) struct At {
    pub(crate) us: u64,
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) yaw: f64,
    pub(crate) speed: f64,
    pub(crate) rate: f64,
}

/// `seconds` at `speed`, sampled 20 times a second; fixes are wrong by up to 20 mm. The origin is 600 mm ahead of the rear axle.
pub(crate) fn drive(seconds: u64, speed: f64) -> Vec<At> {
    let (mut x, mut y, mut yaw) = (3.0_f64, -2.0_f64, 0.5_f64);
    let mut noise = 12_345_u64;
    let mut off = || {
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((noise >> 40) as f64 / (1_u64 << 24) as f64 - 0.5) * 0.04
    };
    let mut all = Vec::new();
    for i in 0..seconds * 20 {
        let t = i as f64 / 20.0;
        let rate = if speed > 0.0 { 0.3 * libm::sin(0.4 * t) } else { 0.0 };
        all.push(At { us: 5_000_000 + i * 50_000, x: x + off(), y: y + off(), yaw, speed, rate });
        for part in 0..50 {
            let turn = if speed > 0.0 { 0.3 * libm::sin(0.4 * (t + f64::from(part) / 1000.0)) } else { 0.0 };
            let (sin, cos) = libm::sincos(yaw);
            x += (speed * cos - 0.6 * turn * sin) / 1000.0;
            y += (speed * sin + 0.6 * turn * cos) / 1000.0;
            yaw += turn / 1000.0;
        }
    }
    all
}

/// The map of the ULog.
pub(crate) const ULOG_MAP: &str = r#"title = "made drive"
vehicle = "wheeled"

[fix]
topic = "fix"
source = "gnss"
stamp = { field = "timestamp", unit = "us" }
x = { field = "place.x", unit = "m" }
y = { field = "place.y", unit = "m" }
yaw = { field = "yaw", unit = "rad" }
sigma = { field = "sigma", unit = "mm" }
time = { field = "utc", unit = "us" }

[odometry]
topic = "wheels"
source = "encoders"
stamp = { field = "timestamp", unit = "us" }
speed = { field = "speed[0]", unit = "m/s" }
yaw_rate = { field = "speed[1]", unit = "rad/s" }

[mode]
topic = "wheels"
stamp = { field = "timestamp", unit = "us" }
field = "mode"
names = { 2 = "mission" }
"#;

pub(crate) fn record(kind: u8, body: &[u8]) -> Vec<u8> {
    let size = u16::try_from(body.len()).unwrap().to_le_bytes();
    [&size[..], &[kind], body].concat()
}

/// The drive as ULog, and the offset of each border between records.
pub(crate) fn ulog(drive: &[At]) -> (Vec<u8>, Vec<usize>) {
    let mut bytes = [&b"ULog\x01\x12\x35\x01"[..], &5_000_000_u64.to_le_bytes()].concat();
    let mut borders = vec![bytes.len()];
    let mut add = |kind: u8, body: &[u8]| {
        bytes.extend(record(kind, body));
        borders.push(bytes.len());
    };
    add(b'B', &[0; 40]);
    add(b'I', b"\x0bchar[3] sysPX4");
    add(b'F', b"point:float x;double y;");
    add(b'F', b"fix:uint64_t timestamp;uint64_t utc;point place;float yaw;uint16_t sigma;uint8_t[6] _padding0;");
    add(b'F', b"wheels:uint64_t timestamp;float[2] speed;uint8_t mode;");
    add(b'A', b"\0\x07\0fix");
    add(b'A', b"\0\x08\0wheels");
    for at in drive {
        let [x, yaw, speed, rate] = [at.x, at.yaw, at.speed, at.rate].map(|n| (n as f32).to_le_bytes());
        let (us, utc) = (at.us.to_le_bytes(), (at.us + 1_700_000_000_000_000).to_le_bytes());
        let y = at.y.to_le_bytes();
        add(b'D', &[&[8, 0], &us[..], &speed, &rate, &[2]].concat());
        add(b'D', &[&[7, 0], &us[..], &utc, &x, &y, &yaw, &20_u16.to_le_bytes()].concat());
    }
    (bytes, borders)
}

/// Definition of the messages that [`mcap`] has in CDR.
pub(crate) const ODOMETRY: &str = "# An estimate.\nstd_msgs/Header header\nstring child_frame_id\nfloat64[2] place\ngeometry_msgs/Twist twist\nfloat32[] \
rest\n================================================================================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time \
stamp\nstring frame_id\n================================================================================\nMSG: \
builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n================================================================================\nMSG: \
geometry_msgs/Twist\nuint8 KIND=3\nfloat64 linear\nfloat64 angular 0.0\nfloat32 yaw\n";

/// The drive as MCAP with a topic in CDR and one in JSON.
pub(crate) fn mcap(drive: &[At], compressed: bool) -> Vec<u8> {
    mcap_with(drive, compressed.then_some(mcap::Compression::Zstd), ODOMETRY.as_bytes(), |message| message)
}

/// An MCAP recording with another definition, and messages in CDR that are changed.
pub(crate) fn mcap_with(
    drive: &[At],
    compression: Option<mcap::Compression>,
    definition: &[u8],
    change: impl Fn(Vec<u8>) -> Vec<u8>,
) -> Vec<u8> {
    let options = mcap::WriteOptions::new().compression(compression).chunk_size(Some(4096)).profile("ros2");
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema("nav_msgs/msg/Odometry", "ros2msg", definition).unwrap();
    let wheels = writer.add_channel(schema, "/odom", "cdr", &BTreeMap::new()).unwrap();
    let json = writer.add_schema("Fix", "jsonschema", b"{}").unwrap();
    let fix = writer.add_channel(json, "/fix", "json", &BTreeMap::new()).unwrap();
    for (i, at) in drive.iter().enumerate() {
        let header = |channel_id| MessageHeader {
            channel_id,
            sequence: i as u32,
            log_time: at.us * 1000,
            publish_time: at.us * 1000,
        };
        writer.write_to_known_channel(&header(wheels), &change(cdr(at))).unwrap();
        let text = format!(
            r#"{{"stamp":{{"sec":{},"nanosec":{}}},"p":[{},{}],"yaw":{}}}"#,
            at.us / 1_000_000,
            at.us % 1_000_000 * 1000,
            at.x,
            at.y,
            at.yaw
        );
        writer.write_to_known_channel(&header(fix), text.as_bytes()).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn cdr(place: &At) -> Vec<u8> {
    let mut body: Vec<u8> = Vec::new();
    let mut put = |bytes: &[u8], align: usize| {
        body.resize(body.len().next_multiple_of(align), 0);
        body.extend(bytes);
    };
    put(&((place.us / 1_000_000) as i32).to_le_bytes(), 4);
    put(&((place.us % 1_000_000 * 1000) as u32).to_le_bytes(), 4);
    for text in ["odom\0", "base_link\0"] {
        put(&(text.len() as u32).to_le_bytes(), 4);
        put(text.as_bytes(), 1);
    }
    for number in [place.x, place.y, place.speed, place.rate] {
        put(&number.to_le_bytes(), 8);
    }
    put(&(place.yaw as f32).to_le_bytes(), 4);
    put(&1_u32.to_le_bytes(), 4);
    put(&0.5_f32.to_le_bytes(), 4);
    [&[0, 1, 0, 0], body.as_slice()].concat()
}

/// A message with a fix on a circle, and one with odometry, at a moment.
pub(crate) type Pair = (u64, String, String);

/// A circle of 5 m at 1 m/s without noise, ten pairs a second; the receiver is `lever` metres ahead of and to the left of the axle. `more` is what
/// else a fix has, by its second.
pub(crate) fn circle(seconds: u64, [ahead, left]: [f64; 2], more: impl Fn(f64) -> String) -> Vec<Pair> {
    let pair = |i: u64| {
        let t = i as f64 / 10.0;
        let (sin, cos) = libm::sincos(0.2 * t);
        let yaw = libm::atan2(sin, cos);
        let (x, y) = (5.0 * sin + ahead * cos - left * sin, 5.0 * (1.0 - cos) + ahead * sin + left * cos);
        let odometry = format!(r#"{{"t":{t},"v":1.0,"w":0.2,"yaw":{yaw}}}"#);
        (i * 100_000, format!(r#"{{"t":{t},"x":{x},"y":{y}{}}}"#, more(t)), odometry)
    };
    (0..=seconds * 10).map(pair).collect()
}

/// Pairs as MCAP with JSON, in chunks of about a second.
pub(crate) fn json(pairs: &[Pair], compression: Option<mcap::Compression>) -> Vec<u8> {
    let options = mcap::WriteOptions::new().compression(compression).chunk_size(Some(2048));
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema("any", "jsonschema", b"{}").unwrap();
    let [fix, odometry] =
        ["/fix", "/odom"].map(|topic| writer.add_channel(schema, topic, "json", &BTreeMap::new()).unwrap());
    for (us, one, other) in pairs {
        for (channel_id, text) in [(odometry, other), (fix, one)] {
            let header = MessageHeader { channel_id, sequence: 0, log_time: us * 1000, publish_time: us * 1000 };
            writer.write_to_known_channel(&header, text.as_bytes()).unwrap();
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// The map of a circle; more lines of `[fix]` go behind `source`.
pub(crate) const CIRCLE_MAP: &str = include_str!("circle.toml");

/// Telemetry of a rover for 12 s in frames of version 2; its first 2 s in these with signatures, and in frames of version 1.
pub(crate) const ROVER: &[u8] = include_bytes!("rover.tlog");
pub(crate) const SIGNED: &[u8] = include_bytes!("signed.tlog");
pub(crate) const FIRST: &[u8] = include_bytes!("first.tlog");

/// A scenario `mine` that is wanted for a platform of this name.
pub(crate) fn wanted(platform: &str) -> assess::Wanted<'_> {
    assess::Wanted {
        name: "mine",
        platform,
        recording: "a \n recording",
        sha256: "00",
        least_speed_m_s: 0.0,
        twin_sigma_m: 0.04,
    }
}

/// Places of the records of a telemetry log in frames of version 2 without signatures.
pub(crate) fn telemetry_records(bytes: &[u8]) -> Vec<(usize, usize)> {
    let (mut from, mut found) = (0, Vec::new());
    while from < bytes.len() {
        let to = from + 8 + 10 + usize::from(bytes[from + 9]) + 2;
        found.push((from, to));
        from = to;
    }
    found
}

/// A record of telemetry: a heartbeat of this system and component.
pub(crate) fn heartbeat(us: u64, [system, component]: [u8; 2]) -> Vec<u8> {
    let covered = [9, 0, 0, 0, system, component, 0, 0, 0, 4, 0, 0, 0, 10, 3, 81, 4, 3];
    let mut sum = 0xffff_u16;
    for byte in covered.iter().chain(&[50]) {
        sum ^= u16::from(*byte);
        (0..8).for_each(|_| sum = if sum & 1 == 1 { sum >> 1 ^ 0x8408 } else { sum >> 1 });
    }
    [&us.to_be_bytes()[..], &[0xfd], &covered, &sum.to_le_bytes()].concat()
}

/// The map of the MCAP file.
pub(crate) const MCAP_MAP: &str = r#"title = "made drive"
vehicle = "wheeled"

[fix]
topic = "/fix"
source = "gnss"
stamp = { field = "stamp", unit = "ros" }
x = { field = "p[0]", unit = "m" }
y = { field = "p[1]", unit = "m" }
yaw = { field = "yaw", unit = "rad" }

[odometry]
topic = "/odom"
source = "encoders"
stamp = { field = "header.stamp", unit = "ros" }
speed = { field = "twist.linear", unit = "m/s" }
yaw_rate = { field = "twist.angular", unit = "rad/s" }
"#;

/// The text with one passage replaced.
pub(crate) fn replace_passage<'a>(text: &'a str, from: &str, to: &str) -> Cow<'a, str> {
    assert!(text.contains(from), "{from}");
    text.replace(from, to).into()
}
