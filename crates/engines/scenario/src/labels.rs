//! The file beside a custom detector: the head that reads its output, and the meaning of its classes to the platform.
//!
//! ```toml
//! head = "yolo-v8"          # or "yolo-v5", or "grid" for the shipped detector's
//! sha256 = "…"              # the model's; where it is left out, any file is taken, and its hash recorded
//!
//! [classes]                 # not for "grid"
//! count = 80                # how many the model knows
//! person = [0]              # their indices; any other is ignored
//! vehicle = [2, 5, 7]
//! ```

use std::path::Path;

use perception::head::Head;
use perception::yolo::{Layout, MAX_CLASSES, Yolo};
use serde::Deserialize;
use wire::sensor::Class;

use super::file::read_text;
use super::{Located, Problem, Problems};

/// Content of such a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Labels {
    /// The head that reads the output.
    pub head: Head,
    /// SHA-256 of the model, where it is pinned.
    pub sha256: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    head: Located<Kind>,
    sha256: Option<Located<String>>,
    classes: Option<Located<Classes>>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Grid,
    YoloV8,
    YoloV5,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Classes {
    count: Located<usize>,
    #[serde(default)]
    vehicle: Vec<Located<usize>>,
    #[serde(default)]
    person: Vec<Located<usize>>,
    #[serde(default)]
    decoy: Vec<Located<usize>>,
    #[serde(default)]
    obstacle: Vec<Located<usize>>,
}

/// Reads and checks the labels at `path`.
///
/// # Errors
/// A mistake in them, in its place.
pub fn load_labels(path: &Path) -> Result<Labels, Problems> {
    let file = path.display().to_string();
    parse_labels(&file, &read_text(path, &file)?)
}

/// Checks the text of labels by itself.
///
/// # Errors
/// A mistake in it, with `file` as its name.
pub fn parse_labels(file: &str, text: &str) -> Result<Labels, Problems> {
    let range = |bytes, message: String, remedy: &str| Problem::new(file, text, bytes, message, remedy);
    let read: File = toml::from_str(text).map_err(|e| Problem::from_toml(file, text, &e))?;
    if let Some(pin) = read.sha256.as_ref().filter(|pin| pin.len() != 64 || !pin.chars().all(|c| c.is_ascii_hexdigit()))
    {
        let remedy = "write what `sha256sum` prints of the model, or take the line out";
        return Err(range(pin.bytes(), "a SHA-256 has 64 hexadecimal digits".to_owned(), remedy).into());
    }
    let layout = match *read.head {
        Kind::Grid => None,
        Kind::YoloV8 => Some(Layout::V8),
        Kind::YoloV5 => Some(Layout::V5),
    };
    let head = match (layout, &read.classes) {
        (None, None) => Head::Grid,
        (Some(layout), Some(classes)) => {
            let classes = meanings(classes).map_err(|(bytes, message)| range(bytes, message, "correct the indices"))?;
            Head::Yolo(Yolo { layout, classes })
        }
        (None, Some(classes)) => {
            return Err(range(classes.bytes(), "the grid's classes are fixed".to_owned(), "take the table out").into());
        }
        (Some(_), None) => {
            let remedy = "add [classes] with count and indices, such as vehicle = [2, 7]";
            return Err(range(read.head.bytes(), "this head's classes mean nothing yet".to_owned(), remedy).into());
        }
    };
    Ok(Labels { head, sha256: read.sha256.map(|pin| pin.to_ascii_lowercase()) })
}

/// A mistake: its place and its message.
type Wrong = (std::ops::Range<usize>, String);

/// Meaning of each of the model's classes to the platform.
fn meanings(classes: &Located<Classes>) -> Result<Vec<Option<Class>>, Wrong> {
    let count = *classes.count;
    if !(1..=MAX_CLASSES).contains(&count) {
        return Err((classes.count.bytes(), format!("a model knows 1 to {MAX_CLASSES} classes, not {count}")));
    }
    let named = [
        (Class::Vehicle, &classes.vehicle),
        (Class::Person, &classes.person),
        (Class::Decoy, &classes.decoy),
        (Class::Obstacle, &classes.obstacle),
    ];
    let mut meanings = vec![None; count];
    for (class, index) in named.iter().flat_map(|(class, indices)| indices.iter().map(move |index| (*class, index))) {
        let last = count - 1;
        let place = meanings.get_mut(**index);
        let place = place.ok_or_else(|| (index.bytes(), format!("no class {}: the last is {last}", **index)))?;
        if place.replace(class).is_some() {
            return Err((index.bytes(), format!("class {} is named twice", **index)));
        }
    }
    if meanings.iter().all(Option::is_none) {
        return Err((classes.bytes(), "no class means anything: nothing would be seen".to_owned()));
    }
    Ok(meanings)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "head = \"yolo-v8\"\n[classes]\ncount = 4\nperson = [0]\nvehicle = [2, 3]\n";

    /// An index that is not named is ignored.
    #[test]
    fn class_indices_become_meanings() {
        let vehicle = Some(Class::Vehicle);
        let classes = vec![Some(Class::Person), None, vehicle, vehicle];
        let head = Head::Yolo(Yolo { layout: Layout::V8, classes });
        assert_eq!(parse_labels("l.toml", GOOD).unwrap(), Labels { head, sha256: None });
        let pinned = format!("head = \"grid\"\nsha256 = \"{}\"\n", "AB".repeat(32));
        let labels = parse_labels("l.toml", &pinned).unwrap();
        assert_eq!(labels, Labels { head: Head::Grid, sha256: Some("ab".repeat(32)) });
    }

    #[test]
    fn mistakes_are_answered_with_their_line() {
        let mistakes = [
            ("yolo-v8", "yolo-v9", 1, "unknown variant"),
            ("count = 4", "count = 300", 3, "1 to 256 classes"),
            ("count = 4", "count = 0", 3, "1 to 256 classes"),
            ("count = 4", "", 2, "missing field `count`"),
            ("[2, 3]", "[2, 4]", 5, "no class 4: the last is 3"),
            ("[2, 3]", "[2, 0]", 4, "class 0 is named twice"),
            ("person = [0]", "car = [0]", 4, "unknown field `car`"),
            ("person = [0]\nvehicle = [2, 3]\n", "", 2, "no class means anything"),
            ("yolo-v8", "grid", 2, "the grid's classes are fixed"),
            ("[classes]", "sha256 = \"12\"\n[classes]", 2, "64 hexadecimal digits"),
        ];
        for (from, to, line, said) in mistakes {
            let problems = parse_labels("l.toml", &GOOD.replacen(from, to, 1)).unwrap_err();
            let problem = &problems.all()[0];
            assert!(problem.message().contains(said), "{to}: {problem}");
            assert_eq!(problem.line_column().unwrap().0, line, "{to}: {problem}");
        }
        assert!(parse_labels("l.toml", "head = \"yolo-v5\"\n").is_err());
    }
}
