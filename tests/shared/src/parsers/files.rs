//! Files that a person or another machine wrote: scenarios, scenes, settings, finished trials, leaderboards, models, recordings of other vehicles.

use assess::log::{Log, LogError};
use assess::map::Map;
use assess::{SceneError, Wanted};
use board::{Board, ContributorKey, ShownBoard};
use evidence::trial::Trial;
use perception::model::{MAX_MODEL, Model, ModelError, Networks, hex_digest};
use perception::onnx::{Inspected, OnnxError};
use runner::lines::reseal;
use runner::trial_store::{finished, kept_line};
use scenario::{AttackSpace, MAX_FILE_BYTES, Problems, Weaknesses};
use serde::Serialize;
use serde::de::DeserializeOwned;
use wire::sensor::Camera;

/// Most variations of one scenario.
const MAX_VARIATIONS: usize = 4096;
/// Longest report on the problems of one file: length of one, and multiples of the file.
const MAX_REPORT: (usize, usize) = (64 * 1024, 64);

/// A scenario that is taken says the same once written; the problems of one that is not have their place and a remedy.
pub fn scenario(bytes: &[u8]) -> bool {
    let Some(text) = text(bytes) else { return false };
    match scenario::parse("any.toml", named(text), text) {
        Ok(scenario) => {
            says_the_same(&scenario);
            assert!(scenario.variations(None).len() <= MAX_VARIATIONS);
            true
        }
        Err(problems) => is_located(&problems, text),
    }
}

/// Checks a scene's own file.
pub fn scene(bytes: &[u8]) -> bool {
    let Some(text) = text(bytes) else { return false };
    match scenario::parse_scene("any.toml", text) {
        Ok(scene) => says_the_same(&scene),
        Err(problems) => is_located(&problems, text),
    }
}

/// Checks platform and policy files, for attack spaces with drawable numbers, and for lists of weaknesses with findable
/// entries; a map of a recording has its problems reported.
pub fn settings(bytes: &[u8]) -> bool {
    let Some(text) = text(bytes) else { return false };
    let platform = match scenario::parse_platform("any.toml", named(text), text) {
        Ok(platform) => {
            let _bounds = platform.bounds.to_bounds();
            says_the_same(&platform)
        }
        Err(problems) => is_located(&problems, text),
    };
    let policy = match scenario::parse_policy("any.toml", named(text), text) {
        Ok(policy) => says_the_same(&policy),
        Err(problems) => is_located(&problems, text),
    };
    let space = match AttackSpace::parse("any.toml", named(text), text) {
        Ok(space) => {
            let (first, last) = space.begins();
            assert!(first <= last && !space.moves.is_empty());
            let mut ranges = space.moves.iter().flat_map(|action_type| action_type.ranges());
            assert!(ranges.all(|range| range.value_at(0).is_finite() && range.value_at(range.last()).is_finite()));
            says_the_same(&space)
        }
        Err(problems) => is_located(&problems, text),
    };
    let weaknesses = match Weaknesses::parse("any.toml", text) {
        Ok(list) => {
            assert!(!list.weakness.is_empty() && list.weakness.iter().all(|weakness| !weakness.find.is_empty()));
            true
        }
        Err(problems) => is_located(&problems, text),
    };
    let labels = match scenario::parse_labels("any.toml", text) {
        Ok(labels) => {
            assert!(labels.sha256.is_none_or(|pin| pin.len() == 64));
            true
        }
        Err(problems) => is_located(&problems, text),
    };
    let map = match Map::parse("any.toml", text) {
        Ok(map) => {
            assert!(map.inject.window_s.as_ref().is_finite());
            true
        }
        Err(problems) => is_located(&problems, text),
    };
    platform | policy | space | weaknesses | labels | map
}

/// A recording of another vehicle is refused at a place within it, or read up to one; a map guessed from its topics is a map,
/// the guards get through it, and a scenario made of it is one.
pub fn foreign(bytes: &[u8]) -> bool {
    // The offsets of one that is packed as a whole are relative to its inside.
    let packed = bytes.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]);
    let log = match Log::open(bytes) {
        Ok(log) => log,
        Err(LogError::Refused { at, why }) => {
            assert!((packed || at <= bytes.len() as u64) && !why.is_empty());
            return false;
        }
        Err(other) => panic!("not an error of opening: {other}"),
    };
    assert!(log.end.at <= log.end.of && (packed || log.end.of == bytes.len() as u64), "{:?}", log.end);
    assert!(log.end.why.is_some() || log.end.at == log.end.of, "{:?}", log.end);
    if let Ok(text) = assess::guess(&log) {
        let map = Map::parse("guess.toml", &text).unwrap_or_else(|problems| panic!("a guess is no map: {problems}"));
        if let Ok(result) = assess::assess(&log, &map, &assess::Terms::GROUND, 1) {
            assert!(result.judged_s.is_finite() && result.trips.len() == 6);
        }
        let (name, sha256) = ("made", "00");
        let wanted =
            Wanted { name, platform: "ground", recording: name, sha256, least_speed_m_s: 0.0, twin_sigma_m: 0.04 };
        // A scenario that is made passes the checks of scenarios, whatever the recording says.
        let made = assess::scenario_text(&log, &map, &assess::Terms::GROUND, &wanted);
        assert!(!matches!(made, Err(SceneError::Refused { .. })), "{made:?}");
    }
    true
}

/// Finished trials that are taken are the same once kept again, to the last digit; else the first bad line is reported. Lines are read as they
/// are, and then with digests that fit.
pub fn shelf(bytes: &[u8]) -> bool {
    is_shelf(bytes) | is_shelf(&reseal(bytes))
}

fn is_shelf(bytes: &[u8]) -> bool {
    match finished(bytes) {
        Ok(trials) => {
            let line = |trial: &Trial| kept_line(trial).expect("what was read can be kept") + "\n";
            let text: String = trials.values().map(line).collect();
            assert_eq!(finished(&reseal(text.as_bytes())).expect("what is kept can be read"), trials);
            !trials.is_empty()
        }
        Err(failure) => {
            assert!(failure.to_string().starts_with("kept:"), "{failure}");
            false
        }
    }
}

/// A leaderboard that is taken is the same text once written, and each row's fault is reported; a key that is taken is the same key once written.
pub fn board(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    if let Ok(key) = ContributorKey::from_pem(text) {
        let again = ContributorKey::from_pem(&key.to_pem()).expect("what was written is a key");
        assert_eq!(again.public(), key.public());
    }
    match Board::parse(text) {
        Ok(board) => {
            assert_eq!(board.text(), text);
            let findings = board.findings();
            assert!(findings.iter().all(|finding| (1..=board.rows().len()).contains(&finding.number)));
            assert_eq!(Board::verified(text).is_ok(), findings.is_empty());
            findings.is_empty() && !ShownBoard::new(&board).markdown().is_empty()
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

/// Bytes are a model under their own hash alone, and it is taken whole or refused at a place within them.
pub fn model(bytes: &[u8]) -> bool {
    let (own_text, small) = (hex_digest(bytes), bytes.len() <= MAX_MODEL);
    let shipped = Networks::for_camera(&Camera::GROUND).detector().expect("the shipped model");
    assert_eq!(Model::pinned(bytes, &own_text).map(|model| model.bytes()).ok(), small.then_some(bytes));
    for pinned in [hex_digest(own_text.as_bytes()).as_str(), &own_text[..63], "", hex_digest(shipped.bytes()).as_str()]
    {
        if pinned != own_text {
            let refused = Model::pinned(bytes, pinned).expect_err("another hash was pinned");
            assert!(matches!(refused, ModelError::Changed { .. } | ModelError::TooLarge { .. }));
        }
    }
    let Ok(model) = Model::pinned(bytes, &own_text) else { return false };
    match Inspected::new(model) {
        Ok(inspected) => inspected.bytes() == bytes,
        Err(OnnxError::Malformed { at, .. } | OnnxError::Unwanted { at, .. }) => {
            assert!(at <= bytes.len(), "a place beyond the end: {at} of {}", bytes.len());
            false
        }
        Err(OnnxError::TooMany | OnnxError::Empty) => false,
    }
}

fn text(bytes: &[u8]) -> Option<&str> {
    std::str::from_utf8(bytes).ok().filter(|text| text.len() as u64 <= MAX_FILE_BYTES)
}

/// The name that a file gives to itself, as its file would be named.
fn named(text: &str) -> &str {
    let name = text.lines().find_map(|line| line.strip_prefix("name = \"")?.strip_suffix('"'));
    name.unwrap_or("any")
}

fn says_the_same<T: Serialize + DeserializeOwned>(value: &T) -> bool {
    let json = |value: &T| serde_json::to_string(value).expect("what was read can be written");
    let text = toml::to_string(value).expect("what was read can be written");
    let repeated = toml::from_str(&text).unwrap_or_else(|e| panic!("what was written does not read: {e}\n{text}"));
    assert_eq!(json(value), json(&repeated));
    true
}

fn is_located(problems: &Problems, text: &str) -> bool {
    assert!(!problems.all().is_empty());
    for problem in problems.all() {
        assert!(!problem.message().is_empty() && !problem.remedy().is_empty());
        if let Some((line, column)) = problem.line_column() {
            assert!((1..=text.matches('\n').count() + 1).contains(&line) && column >= 1);
            assert!(problem.marked().is_some());
        }
    }
    assert!(problems.render(false).len() <= MAX_REPORT.0 + MAX_REPORT.1 * text.len());
    false
}
