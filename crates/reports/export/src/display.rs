//! A console's display in Foxglove's terms, for a viewer during a run: picture by picture, from the object that `holdsafe watch
//! --json` prints (`docs/operator/console.md`).
//!
//! Every label carries freshness and age. No element stays for longer than [`LASTS_MS`] without a repetition, so that a viewer with
//! a dead source shows an empty scene rather than a past one. Getting messages to a viewer is left to the caller.

use std::borrow::Cow;

use foxglove::messages::{CubePrimitive, Duration, Log, SceneEntity, SceneUpdate, SpherePrimitive, log};
use serde::Deserialize;
use wire::sensor::Class;

use crate::shape::{STRAIGHT, caution, grey, heading, metres, of_class, pose, vector};
use crate::stage::{BODY, WORLD, entity, words};
use crate::{Message, Micros, ViewError, encoded, stamp};

/// Time for which an entity is drawn without a new report, milliseconds: five pictures of a silent console.
pub const LASTS_MS: u32 = 1_000;
/// The longest picture that is read, bytes.
pub const LONGEST: usize = 1 << 20;
/// Largest radius of a track's sphere, metres.
const WIDEST: f64 = 60.0;
/// JSON schema of a picture, for viewers.
const PICTURE: &str = r#"{"type":"object","properties":{"version":{"type":"integer"},"at_us":{"type":"integer"}}}"#;

/// Parts of a picture that are read.
#[derive(Deserialize)]
struct Picture {
    max_speed_mm_s: u32,
    units: Vec<Unit>,
    alarms: Vec<Alarm>,
}

#[derive(Deserialize)]
struct Unit {
    unit: String,
    state: Aged<State>,
    place: Aged<Place>,
    tracks: Vec<Aged<Track>>,
}

/// A value of a picture, with its freshness in words and its age.
#[derive(Deserialize)]
pub(crate) struct Aged<T> {
    pub(crate) freshness: String,
    pub(crate) age_ms: Option<u64>,
    pub(crate) value: T,
}

/// Reads the parts of a picture that `T` names; `topic` is named in an error. A picture beyond [`LONGEST`] is refused.
pub(crate) fn read<'a, T: Deserialize<'a>>(topic: &str, picture: &'a str) -> Result<T, ViewError> {
    let reason = |why: String| ViewError::Message { topic: topic.to_owned(), why };
    if picture.len() > LONGEST {
        return Err(reason(format!("a picture of at most {LONGEST} bytes expected, got {}", picture.len())));
    }
    serde_json::from_str(picture).map_err(|e| reason(e.to_string()))
}

#[derive(Deserialize)]
struct State {
    mode: String,
}

#[derive(Deserialize)]
struct Place {
    x_mm: i32,
    y_mm: i32,
    yaw_mrad: i32,
}

#[derive(Deserialize)]
struct Track {
    id: u32,
    class: String,
    x_mm: i32,
    y_mm: i32,
    confidence_permille: u32,
}

#[derive(Deserialize)]
struct Alarm {
    priority: String,
    says: String,
    standing: bool,
}

/// Converter of one console's pictures, which reports each alarm once.
#[derive(Debug, Default)]
pub struct Onlooker {
    /// Alarms of the picture before: each is reported when it is new.
    stood: Vec<String>,
}

impl Onlooker {
    /// Messages of a picture that is shown at `time`, microseconds of the viewer's clock.
    ///
    /// # Errors
    /// Text that is no picture, or longer than [`LONGEST`].
    pub fn look(&mut self, time: Micros, picture: &str) -> Result<Vec<Message>, ViewError> {
        let read: Picture = read("/display", picture)?;
        let mut entities = Vec::new();
        for unit in &read.units {
            entities.push(body(time, unit));
            entities.extend(unit.tracks.iter().map(|aged| track(time, &unit.unit, aged, read.max_speed_mm_s)));
        }
        let mut messages = vec![
            Message {
                topic: "/display".to_owned(),
                encoding: "json".to_owned(),
                schema: ["holdsafe.Picture".to_owned(), "jsonschema".to_owned()],
                definition: Cow::Borrowed(PICTURE.as_bytes()),
                bytes: picture.as_bytes().to_vec(),
            },
            encoded("/display/scene", &SceneUpdate { deletions: Vec::new(), entities })?,
        ];
        let standing: Vec<&Alarm> = read.alarms.iter().filter(|alarm| alarm.standing).collect();
        for alarm in standing.iter().filter(|alarm| !self.stood.contains(&alarm.says)) {
            let level = if alarm.priority == "HIGH" { log::Level::Error } else { log::Level::Warning };
            messages.push(log_message(time, level, format!("{} {}", alarm.priority, alarm.says))?);
        }
        self.stood = standing.iter().map(|alarm| alarm.says.clone()).collect();
        Ok(messages)
    }
}

/// Message that the console has given no picture for `seconds`.
///
/// # Errors
/// A message that cannot be encoded.
pub fn silent(time: Micros, seconds: u64) -> Result<Message, ViewError> {
    log_message(time, log::Level::Error, format!("NOT CURRENT: the console has said nothing more for {seconds} s"))
}

fn log_message(time: Micros, level: log::Level, message: String) -> Result<Message, ViewError> {
    let line = Log {
        timestamp: Some(stamp(time)),
        level: level as i32,
        message,
        name: "console".to_owned(),
        ..Log::default()
    };
    encoded("/display/log", &line)
}

/// Age of a value, in words.
fn age<T>(aged: &Aged<T>) -> String {
    let age = aged.age_ms.map_or("of unknown age".to_owned(), |ms| format!("{:.2} s", ms as f64 / 1e3));
    format!("{} {age}", aged.freshness)
}

fn passing(time: Micros, id: &str) -> SceneEntity {
    let lifetime = Some(Duration::new((LASTS_MS / 1_000) as i32, LASTS_MS % 1_000 * 1_000_000));
    SceneEntity { lifetime, ..entity(time, WORLD, id) }
}

fn body(time: Micros, unit: &Unit) -> SceneEntity {
    let [length, width, height] = BODY;
    let (x, y) = (metres(unit.place.value.x_mm), metres(unit.place.value.y_mm));
    let fresh = unit.place.freshness == "fresh";
    let cube = CubePrimitive {
        pose: Some(pose(x, y, height / 2.0, heading(f64::from(unit.place.value.yaw_mrad) / 1e3))),
        size: Some(vector(length, width, height)),
        color: Some(if fresh { grey(0.8) } else { caution(0.6) }),
    };
    // A mode that is not current must not read as one.
    let was = if unit.state.freshness == "fresh" { "" } else { "was " };
    let text = format!("{} {was}{} {}", unit.unit, unit.state.value.mode, age(&unit.state));
    SceneEntity { cubes: vec![cube], texts: vec![words(text, [x, y, height + 0.6])], ..passing(time, &unit.unit) }
}

/// Sphere within which the track's thing may be by now, at the unit's largest speed.
fn track(time: Micros, unit: &str, of: &Aged<Track>, max_speed_mm_s: u32) -> SceneEntity {
    let track = &of.value;
    let (x, y) = (metres(track.x_mm), metres(track.y_mm));
    let aged = of.age_ms.map_or(WIDEST, |ms| ms as f64 / 1e3 * f64::from(max_speed_mm_s) / 1e3);
    let across = 2.0 * aged.clamp(0.2, WIDEST);
    let class = Class::ALL.into_iter().find(|class| class.name() == track.class);
    let color = class.filter(|_| of.freshness == "fresh").map_or(caution(0.3), |class| of_class(class, 0.4));
    let sphere = SpherePrimitive {
        pose: Some(pose(x, y, 0.5, STRAIGHT)),
        size: Some(vector(across, across, 1.0)),
        color: Some(color),
    };
    let text = format!("{} {} {} %, {}", track.id, track.class, track.confidence_permille / 10, age(of));
    let id = format!("{unit}-track-{}", track.id);
    SceneEntity { spheres: vec![sphere], texts: vec![words(text, [x, y, 1.6])], ..passing(time, &id) }
}

#[cfg(test)]
mod tests {
    use foxglove::Decode;

    use super::*;

    const SHOWN: &str = r#"{"version":1,"at_us":9,"max_speed_mm_s":3000,
        "units":[{"unit":"unit-a",
            "state":{"freshness":"STALE","age_ms":700,"value":{"mode":"READY","cause":"operator"}},
            "place":{"freshness":"STALE","age_ms":720,"value":{"x_mm":1000,"y_mm":-2000,"yaw_mrad":0}},
            "tracks":[{"freshness":"LOST","age_ms":null,"value":{"id":7,"class":"vehicle","x_mm":0,"y_mm":0,"confidence_permille":930}}]}],
        "alarms":[{"priority":"HIGH","says":"unit-a is in HOLD_SAFE","standing":true,"acknowledged":false},
            {"priority":"LOW","says":"over","standing":false}]}"#;

    fn scene(messages: &[Message]) -> SceneUpdate {
        let message = messages.iter().find(|message| message.topic == "/display/scene").unwrap();
        SceneUpdate::decode(message.bytes.as_slice()).unwrap()
    }

    #[test]
    fn every_element_has_age_and_expires() {
        let messages = Onlooker::default().look(5_000_000, SHOWN).unwrap();
        let scene = scene(&messages);
        let texts: Vec<&str> =
            scene.entities.iter().flat_map(|entity| &entity.texts).map(|text| text.text.as_str()).collect();
        assert_eq!(texts, ["unit-a was READY STALE 0.70 s", "7 vehicle 93 %, LOST of unknown age"]);
        assert!(scene.entities.iter().all(|of| of.lifetime == Some(Duration::new(1, 0))));
        // A thing that may be anywhere is drawn as wide as anything is.
        let sphere = scene.entities[1].spheres[0].size.unwrap();
        assert!((sphere.x - 2.0 * WIDEST).abs() < 1e-9);
    }

    #[test]
    fn standing_alarm_is_logged_once_per_occurrence() {
        let mut onlooker = Onlooker::default();
        let mut write = |picture: &str| {
            let messages = onlooker.look(0, picture).unwrap();
            messages.iter().filter(|message| message.topic == "/display/log").count()
        };
        let calm = SHOWN.replace("\"standing\":true", "\"standing\":false");
        assert_eq!([write(SHOWN), write(SHOWN), write(&calm), write(SHOWN)], [1, 0, 0, 1]);
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        let mut onlooker = Onlooker::default();
        for bad in ["", "{}", "[]", "{\"units\":[]}", &"x".repeat(LONGEST + 1)] {
            assert!(onlooker.look(0, bad).is_err());
        }
        let far = SHOWN.replace("\"x_mm\":1000", "\"x_mm\":2147483647").replace("720", "18446744073709551615");
        assert!(onlooker.look(u64::MAX, &far).is_ok());
    }
}
