//! A run as an MCAP file with Foxglove's well-known schemas, for viewers and other programs that know these.
//!
//! [`Viewer`] receives a run event by event, and the messages between the services where they are known; it writes transforms, scene,
//! images, clouds, detections, tracks, modes and a log. The file is made *from* the evidence but is not evidence: no part of it is chained or
//! signed, and `holdsafe inspect verify` never reads it. The same run gives the same bytes. The source of the run is the caller's business.
//!
//! Times are times of the run: zero is its start. Frames of reference: `world` (ENU, metres), a unit's body (x ahead, y left, z up), its
//! `camera` (optical: x right, y down, z ahead) and its `lidar`.

pub mod display;
pub mod packets;
mod sensed;
mod shape;
mod stage;
mod told;

#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

use foxglove::Encode;
use foxglove::messages::Timestamp;
use ground_truth::{Any, Entry, Note};
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use perception::stages::Stages;
use sim::scene::Scene;
use wire::id::UnitId;

pub use sensed::LARGEST;

/// Trace time of a run, microseconds from its start.
pub type Micros = u64;

/// Reason for which the file cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The file cannot be extended.
    #[error("the MCAP file cannot be written: {0}")]
    Mcap(#[from] mcap::McapError),
    /// A message that the format has no room for.
    #[error("no message for {topic}: {why}")]
    Message {
        /// Its topic.
        topic: String,
        /// Reason.
        why: String,
    },
}

/// Content of a channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Topic.
    pub topic: String,
    /// Name of its schema.
    pub schema: String,
    /// Number of its messages.
    pub messages: u32,
    id: u16,
}

/// MCAP file while it is written.
pub struct Viewer<W: Write + Seek> {
    writer: Writer<W>,
    channels: BTreeMap<String, Channel>,
    /// Objects of the scene, where known.
    scene: Option<Scene>,
    /// Perception stages that repeat the detection on rendered frames: recordings have the frames alone.
    stages: Option<Stages>,
    /// Units with placed sensors.
    placed: Vec<UnitId>,
    /// Unreadable messages of services.
    unread: u64,
}

impl<W: Write + Seek> Viewer<W> {
    /// A file in `out`, of a run in `scene`; without a scene it lacks the ground and the sizes of objects. Detections in a frame do not
    /// pass between services: `stages`, if they belong to the run, compute the same ones again.
    ///
    /// # Errors
    ///
    /// When `out` fails.
    pub fn new(out: W, scene: Option<Scene>, stages: Option<Stages>) -> Result<Self, ViewError> {
        let options = WriteOptions::new().library("holdsafe").compression(Some(mcap::Compression::Zstd));
        let writer = options.create(out)?;
        let mut viewer = Viewer { writer, channels: BTreeMap::new(), scene, stages, placed: Vec::new(), unread: 0 };
        viewer.ground()?;
        Ok(viewer)
    }

    /// Writes an entry of the log at its time of the run.
    ///
    /// # Errors
    ///
    /// A file that cannot be extended.
    pub fn event(&mut self, time: Micros, entry: &Entry) -> Result<(), ViewError> {
        self.write_entry(time, entry)?;
        #[expect(clippy::wildcard_enum_match_arm, reason = "the rest moves nothing")]
        match entry.event {
            Any::Instrument(Note::Truth { unit, x_mm, y_mm, yaw_mrad, .. }) => {
                self.moved(time, unit, [x_mm, y_mm], yaw_mrad)
            }
            Any::Instrument(Note::Object { object, class, x_mm, y_mm }) => {
                self.object(time, object, class, [x_mm, y_mm])
            }
            _ => Ok(()),
        }
    }

    /// Closes the file; returns its content, by topic.
    ///
    /// # Errors
    ///
    /// When its index cannot be written.
    pub fn finish(mut self) -> Result<Vec<Channel>, ViewError> {
        self.writer.finish()?;
        Ok(self.channels.into_values().collect())
    }

    /// Number of unreadable messages among its input.
    pub fn unread(&self) -> u64 {
        self.unread
    }

    /// Writes one of Foxglove's messages.
    fn put<T: Encode>(&mut self, time: Micros, topic: &str, message: &T) -> Result<(), ViewError> {
        let Message { encoding, schema: [name, language], definition, bytes, .. } = encoded(topic, message)?;
        self.write(time, topic, &encoding, [&name, &language], &definition, &bytes)
    }

    /// One of our own.
    fn put_json(
        &mut self,
        time: Micros,
        topic: &str,
        [name, schema]: [&str; 2],
        value: &serde_json::Value,
    ) -> Result<(), ViewError> {
        self.write(time, topic, "json", [name, "jsonschema"], schema.as_bytes(), value.to_string().as_bytes())
    }

    fn write(
        &mut self,
        moment: Micros,
        topic: &str,
        encoding: &str,
        [name, schema_encoding]: [&str; 2],
        schema: &[u8],
        bytes: &[u8],
    ) -> Result<(), ViewError> {
        if !self.channels.contains_key(topic) {
            let schema_id = self.writer.add_schema(name, schema_encoding, schema)?;
            let id = self.writer.add_channel(schema_id, topic, encoding, &BTreeMap::new())?;
            let channel = Channel { topic: topic.to_owned(), schema: name.to_owned(), messages: 0, id };
            self.channels.insert(topic.to_owned(), channel);
        }
        let Some(channel) = self.channels.get_mut(topic) else { return Ok(()) };
        let time = moment.saturating_mul(1_000);
        let header =
            MessageHeader { channel_id: channel.id, sequence: channel.messages, log_time: time, publish_time: time };
        channel.messages = channel.messages.saturating_add(1);
        Ok(self.writer.write_to_known_channel(&header, bytes)?)
    }
}

/// Message to a viewer, with the schema of its bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Topic.
    pub topic: String,
    /// `protobuf` or `json`.
    pub encoding: String,
    /// Name and encoding of its schema.
    pub schema: [String; 2],
    /// The schema.
    pub definition: Cow<'static, [u8]>,
    /// Encoded message.
    pub bytes: Vec<u8>,
}

/// One of Foxglove's messages, encoded.
fn encoded<T: Encode>(topic: &str, message: &T) -> Result<Message, ViewError> {
    let reason = |why: String| ViewError::Message { topic: topic.to_owned(), why };
    let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or(256));
    message.encode(&mut bytes).map_err(|e| reason(e.to_string()))?;
    let schema = T::get_schema().ok_or_else(|| reason("it has no schema".to_owned()))?;
    let encoding = T::get_message_encoding();
    Ok(Message {
        topic: topic.to_owned(),
        encoding,
        schema: [schema.name, schema.encoding],
        definition: schema.data,
        bytes,
    })
}

fn stamp(time: Micros) -> Timestamp {
    Timestamp::new(u32::try_from(time / 1_000_000).unwrap_or(u32::MAX), (time % 1_000_000) as u32 * 1_000)
}
