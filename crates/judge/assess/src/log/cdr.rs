//! ROS 2's CDR: numbers of a message by its definition in the `ros2msg` form.
//!
//! A message is walked field by field to its end, because strings and sequences have no fixed place, and because bytes that are left over show that
//! the definition is another's. Plain CDR (OMG, *DDS-XTypes*, XCDR version 1): each number stands at a multiple of its size from behind the four
//! bytes of the header. The definition's text is read by `definition`.

mod definition;

pub(super) use definition::DefinitionError;

use super::layout::Number;
use super::path::Path;

/// Deepest nesting of types.
const MAX_DEPTH: usize = 16;
/// Most bytes after the last field: a message is padded to a multiple of four.
const MAX_FILL: usize = 3;

/// The definition of a message type.
#[derive(Clone, Debug)]
pub(super) struct Schema {
    types: definition::Types,
    root: String,
}

#[derive(Clone, Debug)]
struct Field {
    name: String,
    kind: Kind,
    many: Many,
}

#[derive(Clone, Debug)]
enum Kind {
    Number(Number),
    Text,
    Type(String),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Many {
    One,
    Array(usize),
    Sequence,
}

/// A message gives no numbers by its definition.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum CdrError {
    #[error("a CDR message has 4 bytes or more, got {got}")]
    Short { got: usize },
    #[error("CDR of kind {got}, expected 1 (least byte first)")]
    Kind { got: u8 },
    #[error(
        "{left} of a message's {length} bytes are left over behind the last field of `{root}`: its definition does not fit"
    )]
    LeftOver { left: usize, length: usize, root: String },
    #[error("no number `{path}` in `{root}`")]
    NoNumber { path: String, root: String },
    #[error("types nested deeper than {MAX_DEPTH}")]
    Deep,
    #[error("no definition of `{name}`")]
    NoDefinition { name: String },
    #[error("`{field}` has {count} elements in a message of {length} bytes")]
    Elements { field: String, count: usize, length: usize },
    #[error("a message ends after {length} bytes, within a field")]
    End { length: usize },
}

impl Schema {
    /// Reads the definition of `name`.
    pub(super) fn parse(name: &str, text: &[u8]) -> Result<Self, DefinitionError> {
        let root = definition::short(name);
        let types = definition::parse(&root, text)?;
        Ok(Self { types, root })
    }

    /// The numbers at `paths` in a message.
    pub(super) fn numbers(&self, bytes: &[u8], paths: &[Path]) -> Result<Vec<f64>, CdrError> {
        let [_, kind, _, _, body @ ..] = bytes else {
            return Err(CdrError::Short { got: bytes.len() });
        };
        if *kind != 1 {
            return Err(CdrError::Kind { got: *kind });
        }
        let mut walk = Walk { schema: self, body, at: 0, visits: 0, found: vec![None; paths.len()] };
        let wanted: Vec<(usize, &Path, usize)> = paths.iter().enumerate().map(|(i, path)| (i, path, 0)).collect();
        walk.message(&self.root, &wanted, 0)?;
        let left = body.len() - walk.at;
        if left > MAX_FILL {
            return Err(CdrError::LeftOver { left, length: bytes.len(), root: self.root.clone() });
        }
        let missing = walk.found.iter().zip(paths).find(|(found, _)| found.is_none());
        match missing {
            Some((_, path)) => {
                let path = path.steps().iter().map(|step| step.name.as_str()).collect::<Vec<_>>().join(".");
                Err(CdrError::NoNumber { path, root: self.root.clone() })
            }
            None => Ok(walk.found.into_iter().flatten().collect()),
        }
    }
}

/// A walk through one message.
struct Walk<'a> {
    schema: &'a Schema,
    body: &'a [u8],
    at: usize,
    visits: usize,
    found: Vec<Option<f64>>,
}

/// A path that is looked for: its index, the path, and the steps already gone.
type Wanted<'a> = (usize, &'a Path, usize);

impl Walk<'_> {
    fn message(&mut self, name: &str, wanted: &[Wanted<'_>], depth: usize) -> Result<(), CdrError> {
        if depth == MAX_DEPTH {
            return Err(CdrError::Deep);
        }
        let schema = self.schema;
        let fields = schema.types.get(name).ok_or_else(|| CdrError::NoDefinition { name: name.to_owned() })?;
        if fields.is_empty() {
            // A type without fields has one byte on the wire.
            return self.skip(1);
        }
        for field in fields {
            self.field(field, wanted, depth)?;
        }
        Ok(())
    }

    fn field(&mut self, field: &Field, wanted: &[Wanted<'_>], depth: usize) -> Result<(), CdrError> {
        let count = match field.many {
            Many::One => 1,
            Many::Array(count) => count,
            Many::Sequence => Number::U32.read(self.take(Number::U32)?).unwrap_or_default() as usize,
        };
        let is_here =
            |(_, path, gone): &&Wanted<'_>| path.steps().get(*gone).is_some_and(|step| step.name == field.name);
        let selected: Vec<Wanted<'_>> = wanted.iter().filter(is_here).copied().collect();
        if let (Kind::Number(number), true) = (&field.kind, selected.is_empty()) {
            // A block of numbers without a wanted one, such as an image, is skipped in one step.
            return if count > 0 {
                self.align(*number).and_then(|()| self.skip(number.size() * count))
            } else {
                Ok(())
            };
        }
        // An element has at least one byte at each level. The limit stops definitions whose empty elements would
        // multiply.
        self.visits += count;
        if self.visits > MAX_DEPTH * (self.body.len() + 1) {
            let (field, length) = (field.name.clone(), self.body.len());
            return Err(CdrError::Elements { field, count, length });
        }
        for index in 0..count {
            let this = |(_, path, gone): &&Wanted<'_>| match path.steps()[*gone].index {
                Some(asked) => field.many != Many::One && asked == index,
                None => field.many == Many::One,
            };
            let inner: Vec<Wanted<'_>> =
                selected.iter().filter(this).map(|(i, path, gone)| (*i, *path, gone + 1)).collect();
            self.element(&field.kind, &inner, depth)?;
        }
        Ok(())
    }

    fn element(&mut self, kind: &Kind, wanted: &[Wanted<'_>], depth: usize) -> Result<(), CdrError> {
        match kind {
            Kind::Type(name) => self.message(name, wanted, depth + 1),
            Kind::Text => {
                let length = Number::U32.read(self.take(Number::U32)?).unwrap_or_default() as usize;
                self.skip(length)
            }
            Kind::Number(number) => {
                let value = number.read(self.take(*number)?);
                for (i, ..) in wanted.iter().filter(|(_, path, gone)| path.steps().len() == *gone) {
                    self.found[*i] = value;
                }
                Ok(())
            }
        }
    }

    fn align(&mut self, number: Number) -> Result<(), CdrError> {
        let excess = self.at % number.size();
        self.skip(if excess == 0 { 0 } else { number.size() - excess })
    }

    fn take(&mut self, number: Number) -> Result<&[u8], CdrError> {
        self.align(number)?;
        let from = self.at;
        self.skip(number.size())?;
        Ok(&self.body[from..self.at])
    }

    fn skip(&mut self, length: usize) -> Result<(), CdrError> {
        let end = self.at.checked_add(length).filter(|end| *end <= self.body.len());
        self.at = end.ok_or(CdrError::End { length: self.body.len() })?;
        Ok(())
    }
}
