//! `extends`: a scenario takes the keys that it leaves out from another one.
//!
//! Keys that a file gives replace the keys of its *base* whole, lists and tables as well. The keys that state the subject of a
//! scenario, its name, threats, expected classes and cells, are never taken over ([`OWN`]). The texts of all files stand one
//! after the other in one space of places, so that each error points into the file that it is in ([`Sources`]).

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, Deserializer};

use super::file::read_text;
use super::shipped::{find, shipped_folder};
use super::{Name, Problem, Problems, Scenario};

/// The most bases in a row.
const MAX_BASES: usize = 3;

/// Keys that every file gives for itself.
pub(super) const OWN: [&str; 20] = [
    "schema_version",
    "name",
    "title",
    "description",
    "threats",
    "stride",
    "techniques",
    "interface",
    "evidence",
    "requirement",
    "knowledge",
    "mission",
    "in_worlds",
    "expected",
    "accepted",
    "twin_of",
    "cell",
    "under",
    "curve",
    "extends",
];

/// Two keys of which a file gives one: a base's scene in either form gives way to a scene in either form.
const SCENE: [&str; 2] = ["scene", "scene_file"];

/// The text of a scenario and the texts of its bases, one after the other.
pub(super) struct Sources {
    texts: Vec<Text>,
}

struct Text {
    path: PathBuf,
    file: String,
    /// The text behind as many spaces as the texts before it have bytes: places in it are as in [`Sources`].
    padded: String,
    from: usize,
}

impl Sources {
    /// A scenario's text by itself, without bases.
    pub(super) fn one(file: &str, text: &str) -> Self {
        let text = Text { path: PathBuf::from(file), file: file.to_owned(), padded: text.to_owned(), from: 0 };
        Self { texts: vec![text] }
    }

    /// The scenario at `path` and its bases, also those that are shipped below `root`.
    pub(super) fn load(path: &Path, root: Option<&Path>) -> Result<Self, Problems> {
        let file = path.display().to_string();
        let mut sources = Self::one(&file, &read_text(path, &file)?);
        while let Some(base) = sources.base(root)? {
            let file = base.display().to_string();
            let text = read_text(&base, &file)?;
            let from = sources.texts.last().map_or(0, |text| text.padded.len());
            sources.texts.push(Text { path: base, file, padded: " ".repeat(from) + &text, from });
        }
        Ok(sources)
    }

    /// The base of the last text, where it has one.
    fn base(&self, root: Option<&Path>) -> Result<Option<PathBuf>, Problems> {
        let Some(last) = self.texts.last() else { return Ok(None) };
        let table = last.table()?;
        let Some(value) = table.get_ref().get("extends") else { return Ok(None) };
        let bytes = value.span();
        let refuse =
            |message: &str, remedy: &str| Problem::new(&last.file, last.text(), last.place(&bytes), message, remedy);
        let name = value.get_ref().as_str().and_then(|name| Name::new(name).ok());
        let name = name
            .ok_or_else(|| refuse("a base is named, without path or ending", "write it as `extends = \"nominal\"`"))?;
        let base = base_of(&last.path, &name, root);
        let base = base.ok_or_else(|| refuse("no such scenario here or among the shipped ones", "correct the name"))?;
        if self.texts.iter().any(|text| text.path.file_name() == base.file_name()) {
            return Err(refuse("the scenarios extend each other in a circle", "take one `extends` out").into());
        }
        if self.texts.len() > MAX_BASES {
            let message = format!("more than {MAX_BASES} bases in a row");
            return Err(refuse(&message, "extend what they have in common").into());
        }
        Ok(Some(base))
    }

    /// The scenario, with the keys taken from its bases.
    pub(super) fn read(&self) -> Result<Scenario, Problems> {
        let mut tables = self.texts.iter().map(Text::table);
        let mut whole = tables.next().expect("invariant: a scenario has its own text")?;
        for base in tables {
            let scene = SCENE.iter().any(|key| whole.get_ref().contains_key(*key));
            for (key, value) in base?.into_inner() {
                let name = key.get_ref().as_ref();
                let is_kept =
                    OWN.contains(&name) || (scene && SCENE.contains(&name)) || whole.get_ref().contains_key(name);
                if !is_kept {
                    whole.get_mut().insert(key, value);
                }
            }
        }
        Scenario::deserialize(Deserializer::from(whole)).map_err(|error| {
            let text = error.span().map_or(&self.texts[0], |bytes| self.text_at(&bytes));
            text.problem_of(&error).into()
        })
    }

    /// A problem at a place.
    pub(super) fn problem(
        &self,
        bytes: Range<usize>,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Problem {
        let text = self.text_at(&bytes);
        Problem::new(&text.file, text.text(), text.place(&bytes), message, remedy)
    }

    /// The file that a place is in.
    pub(super) fn path_at(&self, bytes: &Range<usize>) -> &Path {
        &self.text_at(bytes).path
    }

    fn text_at(&self, bytes: &Range<usize>) -> &Text {
        self.texts.iter().rev().find(|text| bytes.start >= text.from).unwrap_or(&self.texts[0])
    }
}

impl Text {
    fn text(&self) -> &str {
        &self.padded[self.from..]
    }

    /// A place of [`Sources`] in this text.
    fn place(&self, bytes: &Range<usize>) -> Range<usize> {
        bytes.start.saturating_sub(self.from)..bytes.end.saturating_sub(self.from)
    }

    fn table(&self) -> Result<Spanned<DeTable<'_>>, Problems> {
        DeTable::parse(&self.padded).map_err(|error| self.problem_of(&error).into())
    }

    fn problem_of(&self, error: &toml::de::Error) -> Problem {
        Problem::from_toml_at(&self.file, self.text(), error.span().map(|bytes| self.place(&bytes)), error)
    }
}

/// The file of a base: in the folder of the scenario that extends it, or else among the bases and scenarios that are shipped around it or
/// below `root`. A user's own folder may look like a root and have none.
fn base_of(path: &Path, name: &Name, root: Option<&Path>) -> Option<PathBuf> {
    let file = format!("{name}.toml");
    let around = shipped_folder(path).and_then(|folder| Some(folder.parent()?.to_owned()));
    let shipped = around.into_iter().chain(root.map(Path::to_owned)).flat_map(|root| {
        let base = root.join("scenarios/bases").join(&file);
        std::iter::once(base).chain(find(&root, name.as_str()))
    });
    let mut files = std::iter::once(path.with_file_name(&file)).chain(shipped);
    // No symbolic link: it could lead out of the folder.
    files.find(|file| fs::symlink_metadata(file).is_ok_and(|meta| meta.is_file()))
}

#[cfg(test)]
mod tests;
