//! The process that parses a foreign recording: confined first, then fed over its standard input.

use std::io::{BufRead, Read};

use assess::log::{Log, MAX_LOG};
use assess::map::{MAX_MAP, Map};
use assess::{Terms, TrackError, Wanted, guess};
use results::report::{AssessObject, Assessed, assess_table};
use runner::failure::{Exit, Failure};
use runner::out;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Name of the service, and of its row in the table of rights.
pub(crate) const NAME: &str = "assess";
/// Longest request, bytes: a map in JSON's escapes, and the names of many files.
const MAX_REQUEST: u64 = 64 * MAX_MAP;

/// Line before the bytes of the recording.
#[derive(Serialize, Deserialize)]
pub(super) struct Request {
    /// The recording, as it was named.
    pub(super) file: String,
    /// Terms of the judgement; without them, a first map is wanted.
    pub(super) judged: Option<Judged>,
    pub(super) seed: u64,
    pub(super) json: bool,
    /// Names and lengths of its files, whose bytes follow one another; without any, all bytes are one file.
    #[serde(default)]
    pub(super) files: Vec<(String, u64)>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Judged {
    /// Name and text.
    pub(super) map: (String, String),
    /// Name of the platform.
    pub(super) platform: String,
    pub(super) terms: Terms,
    /// The scenario that is wanted in place of the tables.
    #[serde(default)]
    pub(super) scene: Option<Scene>,
}

/// A scenario to be made.
#[derive(Serialize, Deserialize)]
pub(super) struct Scene {
    /// Its name.
    pub(super) name: String,
    /// Least speed of the platform, m/s.
    pub(super) least_speed_m_s: f64,
    /// Deviation of the twin's receiver, metres.
    pub(super) twin_sigma_m: f64,
}

/// Confines this process, reads a request and a recording, and prints the result.
pub(crate) fn main() -> Exit {
    let confined =
        link::confined::reader(NAME, Vec::new()).map_err(|error| Failure::new(Exit::Environment, error.to_string()));
    let requested = confined.and_then(|level| {
        if !(level.landlock && level.calls) {
            link::note!("the recording is parsed under confinement {level}");
        }
        request()
    });
    match requested {
        Ok(request) => answer(&request).unwrap_or_else(|failure| failure.report(request.json)),
        Err(failure) => failure.report(false),
    }
}

fn request() -> Result<Request, Failure> {
    let mut line = String::new();
    std::io::stdin().lock().take(MAX_REQUEST).read_line(&mut line).map_err(Failure::internal)?;
    serde_json::from_str(&line).map_err(Failure::internal)
}

fn answer(request: &Request) -> Result<Exit, Failure> {
    let Request { file: name, judged, seed, json, files } = request;
    let unusable = |reason: &dyn std::fmt::Display| Failure::new(Exit::Usage, format!("{name}: {reason}"));
    let mut bytes = Vec::new();
    // One byte beyond the limit, so that `Log::open_all` refuses a longer input and does not judge its beginning.
    std::io::stdin().lock().take(MAX_LOG + 1).read_to_end(&mut bytes).map_err(Failure::internal)?;
    let log = Log::open_all(&split(files, &bytes)).map_err(|error| unusable(&error))?;
    let Some(Judged { map: (at, text), platform, terms, scene }) = judged else {
        let text = guess(&log).map_err(|reason| unusable(&reason))?;
        out::say(format_args!("{}", text.trim_end()));
        return Ok(Exit::Fine);
    };
    let map = Map::parse(at, text)?;
    let sha256: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    if let Some(scene) = scene {
        let &Scene { name: ref scenario, least_speed_m_s, twin_sigma_m } = scene;
        let wanted =
            Wanted { name: scenario, platform, recording: name, sha256: &sha256, least_speed_m_s, twin_sigma_m };
        let text = assess::scenario_text(&log, &map, terms, &wanted).map_err(|reason| unusable(&reason))?;
        out::say(format_args!("{}", text.trim_end()));
        return Ok(Exit::Fine);
    }
    let result = assess::assess(&log, &map, terms, *seed).map_err(|error: TrackError| unusable(&error))?;
    let assessed =
        Assessed { file: name.clone(), sha256, log: &log, map: &map, platform: platform.clone(), seed: *seed };
    let object = AssessObject::new(assessed, &result);
    if *json {
        out::print_json("assess", &object)?;
    } else {
        out::show(assess_table(&object).trim_end());
    }
    Ok(if object.judged_s > 0.0 { Exit::Fine } else { Exit::NoEvidence })
}

/// Splits the bytes of a recording into its files.
fn split<'a>(files: &'a [(String, u64)], mut bytes: &'a [u8]) -> Vec<(&'a str, &'a [u8])> {
    let mut all = Vec::new();
    for (name, length) in files {
        let length = usize::try_from(*length).unwrap_or(usize::MAX).min(bytes.len());
        let (file, rest) = bytes.split_at(length);
        all.push((name.as_str(), file));
        bytes = rest;
    }
    if all.is_empty() { vec![("", bytes)] } else { all }
}
