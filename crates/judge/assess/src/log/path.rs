//! A field's path in a message: `pose.pose.position.x`, `q[0]`.

use std::str::FromStr;

/// Most steps of a path.
const MAX_STEPS: usize = 16;

/// Path of a number in a message.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Path(Vec<Step>);

/// One step: a field, and the element of an array.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Step {
    pub(super) name: String,
    pub(super) index: Option<usize>,
}

impl Path {
    pub(super) fn steps(&self) -> &[Step] {
        &self.0
    }

    /// The field `name` of the one that this path leads to.
    #[must_use]
    pub fn join(&self, name: &str) -> Path {
        let mut steps = self.0.clone();
        steps.push(Step { name: name.to_owned(), index: None });
        Path(steps)
    }
}

/// Error of a path's text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PathError {
    /// A path with too many steps.
    #[error("a path has at most {MAX_STEPS} steps")]
    Long,
    /// A part that is no step.
    #[error("`{text}` is no step of a path, expected `name` or `name[0]`")]
    Step {
        /// The part.
        text: String,
    },
}

impl FromStr for Path {
    type Err = PathError;

    fn from_str(text: &str) -> Result<Self, PathError> {
        let steps: Vec<Step> = text.split('.').take(MAX_STEPS + 1).map(step).collect::<Result<_, _>>()?;
        match steps.len() {
            ..=MAX_STEPS => Ok(Path(steps)),
            _ => Err(PathError::Long),
        }
    }
}

fn step(text: &str) -> Result<Step, PathError> {
    let malformed = || PathError::Step { text: text.to_owned() };
    let (name, index) = match text.split_once('[') {
        Some((name, index)) => {
            let index = index.strip_suffix(']').and_then(|index| index.parse().ok());
            (name, Some(index.ok_or_else(malformed)?))
        }
        None => (text, None),
    };
    match name.is_empty() {
        true => Err(malformed()),
        false => Ok(Step { name: name.to_owned(), index }),
    }
}
