//! `holdsafe watch RUN`: what the console of a run shows, as text, from another terminal: over ssh, or in a script; with
//! `--json` as one object a line.
//!
//! It reads the console's mouth log while it grows, and prints the words that the console itself gave: no second model, no
//! key and no hand in the run, so it may be called as often as one likes. A console that says nothing more is not shown as
//! if it did.

use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::mpsc::channel;
use std::time::Duration;

use link::clock::trace_us;
use link::mouth::{Entry, MouthError, Reader};
use serde_json::json;
use wire::core::{Input, Output};
use wire::id::NodeId;

use super::failure::{Exit, Failure};
use super::{Context, out};

/// How often it is looked whether there is more.
const LOOK: Duration = Duration::from_millis(200);
/// A console gives five texts a second; after so long without one, microseconds, what it gave last is not current.
const CURRENT_US: u64 = 1_000_000;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The run's directory, as given to `live --out`.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Print what was shown last, and end.
    #[arg(long)]
    once: bool,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let path = args.run.join("mouth").join(format!("{}.cbor", NodeId::CONSOLE));
    let unread = |why: MouthError| Failure::new(Exit::NoEvidence, format!("{}: {why}", path.display()));
    let mut log = Follow::open(&path).map_err(unread)?;
    let (_nobody, pause) = channel::<()>();
    let (mut heard, mut said) = (trace_us(), false);
    while !context.stop.asked() {
        let news = log.news().map_err(unread)?;
        if let Some((text, picture)) = news.newest {
            (heard, said) = (trace_us(), false);
            out::say(format_args!("{}", if context.json { picture } else { text }));
        }
        if news.finished || args.once {
            return Ok(Exit::Fine);
        }
        let silent = trace_us().saturating_sub(heard);
        if silent > CURRENT_US && !said {
            said = true;
            let seconds = silent / 1_000_000;
            if context.json {
                out::say(format_args!("{}", json!({ "not_current_s": seconds })));
            } else {
                out::say(format_args!("NOT CURRENT: the console has said nothing more for {seconds} s"));
            }
        }
        // Nobody sends: this waits for its time.
        let _ = pause.recv_timeout(LOOK);
    }
    Ok(Exit::Interrupted)
}

/// A mouth log that may still grow.
struct Follow {
    file: File,
    header: link::mouth::Header,
    /// Behind the last whole entry.
    at: u64,
}

/// What has come into it since the last look.
struct News {
    /// The newest picture, in words and as an object.
    newest: Option<(String, String)>,
    /// The console has written its closing account.
    finished: bool,
}

impl Follow {
    fn open(path: &Path) -> Result<Self, MouthError> {
        let file = File::open(path)?;
        let reader = Reader::new(BufReader::new(&file))?;
        let (header, at) = (reader.header(), reader.at());
        Ok(Self { file, header, at })
    }

    fn news(&mut self) -> Result<News, MouthError> {
        self.file.seek(SeekFrom::Start(self.at))?;
        let mut log = Reader::resume(BufReader::new(&self.file), self.header, self.at);
        let mut news = News { newest: None, finished: false };
        for entry in log.by_ref() {
            match entry {
                Ok(Entry::Output(Output::Text { text, picture })) => news.newest = Some((text, picture)),
                Ok(Entry::Input { input: Input::Finish, .. }) => news.finished = true,
                Ok(Entry::Input { .. } | Entry::Output(_)) => {}
                // The rest of the entry is still to be written.
                Err(MouthError::Truncated { .. }) => break,
                Err(error) => return Err(error),
            }
        }
        self.at = log.at();
        Ok(news)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use link::mouth::{Header, Writer};
    use wire::id::Boot;
    use wire::time::Instant;

    use super::*;

    #[test]
    fn a_log_is_followed_over_an_entry_that_is_half_written() {
        let header = Header { node: NodeId::CONSOLE, boot: Boot(1), started: Instant(0) };
        let mut whole = Vec::new();
        let mut log = Writer::new(&mut whole, header, 1 << 20).unwrap();
        for text in ["one", "two"] {
            log.output(&Output::Text { text: text.into(), picture: "{}".into() }).unwrap();
        }
        log.input(Instant(5), &Input::Finish).unwrap();
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let mut seen = Vec::new();
        file.write_all(&whole[..whole.len() / 2]).unwrap();
        let mut follow = Follow::open(file.path()).unwrap();
        for byte in &whole[whole.len() / 2..] {
            let news = follow.news().unwrap();
            seen.extend(news.newest.map(|(text, _)| text));
            assert!(!news.finished);
            file.write_all(&[*byte]).unwrap();
        }
        let news = follow.news().unwrap();
        assert!(news.finished && seen == ["one", "two"], "{seen:?}");
    }
}
