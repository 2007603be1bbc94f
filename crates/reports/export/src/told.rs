//! Log of services, relays and the launcher: each entry as JSON, the log in words, and the true and the displayed modes.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::io::{Seek, Write};

use foxglove::messages::{Log, PoseInFrame, log};
use ground_truth::{Any, Entry, GuardVerdict, Note};
use serde_json::json;
use wire::event::Event;
use wire::mode::Mode;

use crate::shape::{heading, metres, pose};
use crate::stage::WORLD;
use crate::{Micros, ViewError, Viewer, stamp};

/// Schema of an entry: `docs/reviewer/evidence.md` has the events' fields.
const ENTRY: [&str; 2] = [
    "holdsafe.Entry",
    r#"{"type":"object","properties":{"boot":{"type":"integer"},"counter":{"type":"integer"},"local_us":{"type":"integer"},"event":{"type":"object","properties":{"is":{"type":"string"}}}}}"#,
];
const MODE: [&str; 2] = [
    "holdsafe.Mode",
    r#"{"type":"object","properties":{"mode":{"type":"string"},"from":{"type":"string"},"cause":{"type":"string"}}}"#,
];
const DISPLAY: [&str; 2] = [
    "holdsafe.Display",
    r#"{"type":"object","properties":{"mode":{"type":"string"},"freshness":{"type":"string"},"authority":{"type":"boolean"},"age_ms":{"type":"number"},"tracks_fresh":{"type":"integer"},"tracks_stale":{"type":"integer"}}}"#,
];

const VERIFICATION: [&str; 2] = [
    "holdsafe.Custody",
    r#"{"type":"object","properties":{"run":{"type":"string"},"sha256":{"type":"string"},"valid":{"type":"boolean"},"reason":{"type":["string","null"]}}}"#,
];

impl<W: Write + Seek> Viewer<W> {
    /// Writes the verification of the recording in `run`, the files of which have this digest, at time zero. For a
    /// recording that is no evidence the log then begins with the reason, at its highest level.
    ///
    /// # Errors
    ///
    /// A file that cannot be extended.
    pub fn verification(&mut self, run: &str, sha256: &str, invalid: Option<&str>) -> Result<(), ViewError> {
        let value = json!({ "run": run, "sha256": sha256, "valid": invalid.is_none(), "reason": invalid });
        self.put_json(0, "/custody", VERIFICATION, &value)?;
        let Some(reason) = invalid else { return Ok(()) };
        let line = Log {
            timestamp: Some(stamp(0)),
            level: log::Level::Fatal as i32,
            message: format!("INVALID, evidence of nothing: {run}: {reason}"),
            name: "custody".to_owned(),
            file: String::new(),
            line: 0,
        };
        self.put(0, "/log", &line)
    }

    pub(crate) fn write_entry(&mut self, time: Micros, entry: &Entry) -> Result<(), ViewError> {
        let Entry { node, boot, counter, at: local, event, .. } = entry;
        let whole = json!({ "boot": boot, "counter": counter, "local_us": local, "event": event });
        self.put_json(time, &format!("/audit/{node}"), ENTRY, &whole)?;
        if let Some(level) = level(event) {
            let line = Log {
                timestamp: Some(stamp(time)),
                level: level as i32,
                message: json!(event).to_string(),
                name: node.to_string(),
                file: String::new(),
                line: 0,
            };
            self.put(time, "/log", &line)?;
        }
        match *event {
            Any::Service(Event::Transition { from, to, cause, .. }) => {
                let value = json!({ "mode": to.name(), "from": from.name(), "cause": cause.label() });
                self.put_json(time, &format!("/mode/{node}"), MODE, &value)
            }
            Any::Service(Event::Displayed {
                unit,
                mode,
                authority,
                freshness,
                age,
                tracks_fresh,
                tracks_stale,
                ..
            }) => {
                let age_ms = age.as_ms();
                let value = json!({
                    "mode": mode.name(), "freshness": freshness, "authority": authority, "age_ms": age_ms,
                    "tracks_fresh": tracks_fresh, "tracks_stale": tracks_stale,
                });
                self.put_json(time, &format!("/display/{unit}"), DISPLAY, &value)
            }
            Any::Service(Event::Located { pose_x_mm, pose_y_mm, .. }) => {
                let place = pose(metres(pose_x_mm), metres(pose_y_mm), 0.0, heading(0.0));
                let frame = PoseInFrame { timestamp: Some(stamp(time)), frame_id: WORLD.to_owned(), pose: Some(place) };
                self.put(time, &format!("/localisation/{node}"), &frame)
            }
            _ => Ok(()),
        }
    }
}

/// Log level of an event; `None` for frequent events, which have topics of their own.
fn level(event: &Any) -> Option<log::Level> {
    Some(match event {
        Any::Instrument(
            Note::Truth { .. }
            | Note::Object { .. }
            | Note::GuardSaw { verdict: GuardVerdict::Passed, .. }
            | Note::MouthSaw { .. }
            | Note::Ran { .. }
            | Note::Kept { .. }
            | Note::Imposed { .. }
            | Note::Altered { .. },
        )
        | Any::Service(
            Event::Displayed { .. }
            | Event::Located { .. }
            | Event::Accepted { .. }
            | Event::Sealed { .. }
            | Event::Signed { .. }
            | Event::Count { .. },
        ) => return None,
        Any::Service(Event::Transition { to: Mode::HoldSafe | Mode::Degraded, .. })
        | Any::Instrument(Note::Collided { .. }) => log::Level::Error,
        Any::Service(
            Event::Refused { .. }
            | Event::Inconsistent { .. }
            | Event::Repeated { .. }
            | Event::Doubted { .. }
            | Event::Crowded { .. }
            | Event::Pictured { .. }
            | Event::SessionLost { .. }
            | Event::ChainBroken { .. },
        )
        | Any::Instrument(Note::GuardSaw { .. }) => log::Level::Warning,
        _ => log::Level::Info,
    })
}
