//! A first map out of a recording's topics: the names that PX4, ROS and MAVLink use, a file each. A person checks it; `source` and `vehicle` most
//! of all.

mod px4;
mod ros;
mod tlog;

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
        Format::Ulog => px4::tables(log),
        Format::Mcap => ros::tables(log),
        Format::Tlog => tlog::tables(log),
    };
    let unread = log.end.why.as_ref().map(|reason| {
        let reason = reason.replace(char::is_control, " ");
        format!("read to byte {} of {}: {reason}", log.end.at, log.end.of)
    });
    let parts = parts.map_err(|missing| GuessError { unread: unread.clone(), missing, topics: topics.clone() })?;
    let vehicle = match log.format {
        Format::Ulog => px4::vehicle(log),
        Format::Mcap => "other",
        Format::Tlog => tlog::vehicle(log),
    };
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
