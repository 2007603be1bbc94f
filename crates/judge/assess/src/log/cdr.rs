//! ROS 2's CDR: numbers of a message by its definition in the `ros2msg` form.
//!
//! A message is walked field by field to its end, because strings and sequences have no fixed place, and because bytes that are left over show that
//! the definition is another's. Plain CDR (OMG, *DDS-XTypes*, XCDR version 1): each number stands at a multiple of its size from behind the four
//! bytes of the header. The definition's text is read by `definition`.

mod definition;

use super::layout::Number;
use super::path::Path;

/// Deepest nesting of types.
const MAX_DEPTH: usize = 16;
/// Most bytes behind the last field: a message is filled up to a multiple of four.
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

impl Schema {
    /// Reads the definition of `name`.
    pub(super) fn parse(name: &str, text: &[u8]) -> Result<Self, String> {
        let root = definition::short(name);
        let types = definition::parse(&root, text)?;
        Ok(Self { types, root })
    }

    /// The numbers at `paths` in a message.
    pub(super) fn numbers(&self, bytes: &[u8], paths: &[Path]) -> Result<Vec<f64>, String> {
        let [_, kind, _, _, body @ ..] = bytes else {
            return Err(format!("a CDR message has 4 bytes or more, got {}", bytes.len()));
        };
        if *kind != 1 {
            return Err(format!("CDR of kind {kind}, expected 1 (least byte first)"));
        }
        let mut walk = Walk { schema: self, body, at: 0, visits: 0, found: vec![None; paths.len()] };
        let wanted: Vec<(usize, &Path, usize)> = paths.iter().enumerate().map(|(i, path)| (i, path, 0)).collect();
        walk.message(&self.root, &wanted, 0)?;
        let left = body.len() - walk.at;
        if left > MAX_FILL {
            return Err(format!(
                "{left} of a message's {} bytes are left over behind the last field of `{}`: its definition does not fit",
                bytes.len(),
                self.root
            ));
        }
        let missing = walk.found.iter().zip(paths).find(|(found, _)| found.is_none());
        match missing {
            Some((_, path)) => {
                let name = path.steps().iter().map(|step| step.name.as_str()).collect::<Vec<_>>().join(".");
                Err(format!("no number `{name}` in `{}`", self.root))
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
    fn message(&mut self, name: &str, wanted: &[Wanted<'_>], depth: usize) -> Result<(), String> {
        if depth == MAX_DEPTH {
            return Err(format!("types nested deeper than {MAX_DEPTH}"));
        }
        let schema = self.schema;
        let fields = schema.types.get(name).ok_or_else(|| format!("no definition of `{name}`"))?;
        if fields.is_empty() {
            // A type without fields has one byte on the wire.
            return self.skip(1);
        }
        for field in fields {
            self.field(field, wanted, depth)?;
        }
        Ok(())
    }

    fn field(&mut self, field: &Field, wanted: &[Wanted<'_>], depth: usize) -> Result<(), String> {
        let count = match field.many {
            Many::One => 1,
            Many::Array(count) => count,
            Many::Sequence => Number::U32.read(self.take(Number::U32)?).unwrap_or_default() as usize,
        };
        let is_here =
            |(_, path, gone): &&Wanted<'_>| path.steps().get(*gone).is_some_and(|step| step.name == field.name);
        let selected: Vec<Wanted<'_>> = wanted.iter().filter(is_here).copied().collect();
        if let (Kind::Number(number), true) = (&field.kind, selected.is_empty()) {
            // A block of numbers that are not asked for, such as an image, is one step.
            return if count > 0 {
                self.align(*number).and_then(|()| self.skip(number.size() * count))
            } else {
                Ok(())
            };
        }
        // An element has a byte at least, at each level: definitions of empty elements do not multiply.
        self.visits += count;
        if self.visits > MAX_DEPTH * (self.body.len() + 1) {
            return Err(format!("`{}` has {count} elements in a message of {} bytes", field.name, self.body.len()));
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

    fn element(&mut self, kind: &Kind, wanted: &[Wanted<'_>], depth: usize) -> Result<(), String> {
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

    fn align(&mut self, number: Number) -> Result<(), String> {
        let excess = self.at % number.size();
        self.skip(if excess == 0 { 0 } else { number.size() - excess })
    }

    fn take(&mut self, number: Number) -> Result<&[u8], String> {
        self.align(number)?;
        let from = self.at;
        self.skip(number.size())?;
        Ok(&self.body[from..self.at])
    }

    fn skip(&mut self, length: usize) -> Result<(), String> {
        let end = self.at.checked_add(length).filter(|end| *end <= self.body.len());
        self.at = end.ok_or_else(|| format!("a message ends after {} bytes, within a field", self.body.len()))?;
        Ok(())
    }
}
