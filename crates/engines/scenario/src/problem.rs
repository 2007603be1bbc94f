//! A mistake in a file, shown in the file: message, place, remedy.
//!
//! A [`Problem`] renders as one screen on a terminal and as one object in JSON; it makes no decision.

use std::fmt;
use std::ops::Range;

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};
use serde::Serialize;
use wire::plain;

/// Most problems of one file that are shown; the rest are counted.
const MAX_SHOWN: usize = 5;
/// Most lines that are marked; of a longer passage only the first is.
const MAX_MARKED: usize = 10;

/// The schemas, as remedies name them.
const SCHEMA: &str = "`holdsafe scenario schema`";
const PLATFORM_SCHEMA: &str = "`holdsafe scenario schema --platform`";

/// One problem.
#[derive(Clone, Debug)]
pub struct Problem {
    file: String,
    message: String,
    remedy: String,
    place: Option<Box<(NamedSource<String>, Range<usize>)>>,
}

impl Problem {
    /// A problem with the file as a whole.
    pub fn with_file(file: &str, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { file: file.to_owned(), message: plain::same_length(&message.into()), remedy: remedy.into(), place: None }
    }

    /// A problem at some bytes of the file's text.
    pub fn new(
        file: &str,
        text: &str,
        bytes: Range<usize>,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        let start = floor_boundary(text, bytes.start);
        let mut end = floor_boundary(text, bytes.end).max(start);
        let marked = &text[start..end];
        if marked.lines().count() > MAX_MARKED {
            end = start + marked.lines().next().map_or(0, str::len);
        }
        let source = NamedSource::new(file, plain::same_length(text)).with_language("toml");
        Self { place: Some(Box::new((source, start..end))), ..Self::with_file(file, message, remedy) }
    }

    /// A TOML or schema error, at the place that the parser names.
    pub fn from_toml(file: &str, text: &str, error: &toml::de::Error) -> Self {
        Self::from_toml_at(file, text, error.span(), error)
    }

    /// A problem in a platform file.
    pub(super) fn of_platform(file: &str, text: &str, error: &toml::de::Error) -> Self {
        let problem = Self::from_toml(file, text, error);
        Self { remedy: problem.remedy.replace(SCHEMA, PLATFORM_SCHEMA), ..problem }
    }

    /// A TOML problem at a place in this text, where the parser's was in several.
    pub(super) fn from_toml_at(file: &str, text: &str, bytes: Option<Range<usize>>, error: &toml::de::Error) -> Self {
        let message = error.message().trim().to_owned();
        let remedy = remedy_for(&message);
        match bytes {
            Some(bytes) => Self::new(file, text, bytes, message, remedy),
            None => Self::with_file(file, message, remedy),
        }
    }

    /// The message.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The remedy.
    pub fn remedy(&self) -> &str {
        &self.remedy
    }

    /// Line and column, from 1, where the problem has a place.
    pub fn line_column(&self) -> Option<(usize, usize)> {
        let (source, bytes) = self.place.as_deref()?;
        let before = source.inner().get(..bytes.start)?;
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        Some((line, column))
    }

    /// The text under the mark, where the problem has a place.
    pub fn marked(&self) -> Option<&str> {
        let (source, bytes) = self.place.as_deref()?;
        source.inner().get(bytes.clone())
    }
}

fn floor_boundary(text: &str, at: usize) -> usize {
    let mut index = at.min(text.len());
    while !text.is_char_boundary(index) {
        index -= 1;
    }
    index
}

/// The one of `known` that `word` is most like, else the one that a letter or an exchange of neighbours makes of it; `None` where none is near.
pub fn closest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // The threshold is that of clap's suggestions.
    const NEAR: f64 = 0.7;
    let known: Vec<&str> = known.into_iter().collect();
    let likeness = known.iter().map(|name| (strsim::jaro(word, name), *name)).filter(|(near, _)| *near > NEAR);
    let likest = likeness.max_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, name)| name);
    // Two exchanged letters of a short name are too far for that measure.
    let slip = |name: &&str| word.chars().count() > 1 && strsim::osa_distance(word, name) == 1;
    likest.or_else(|| known.into_iter().find(slip))
}

/// A suggestion for "unknown field `x`, expected one of `a`, `b`".
fn suggestion(message: &str) -> Option<String> {
    let mut names = message.split('`').skip(1).step_by(2);
    let word = names.next()?;
    closest(word, names).map(|name| format!("did you mean `{name}`?"))
}

fn remedy_for(message: &str) -> String {
    let schema = format!("{SCHEMA} prints every key with its type and range");
    if message.starts_with("unknown ")
        && let Some(text) = suggestion(message)
    {
        return format!("{text} {schema}");
    }
    let remedy = if message.starts_with("unknown field") {
        "correct the key or take it out"
    } else if message.starts_with("unknown variant") {
        "use one of the values named above"
    } else if message.starts_with("missing field") {
        "add the key to this table"
    } else if message.starts_with("invalid type") {
        "write the value with the type named above"
    } else if message.contains("out of range") || message.contains("not a finite number") {
        "use a number within the range"
    } else {
        "correct the value"
    };
    format!("{remedy}; {schema}")
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line_column() {
            Some((line, column)) => write!(f, "{}:{line}:{column}: {}", self.file, self.message),
            None => write!(f, "{}: {}", self.file, self.message),
        }
    }
}

impl std::error::Error for Problem {}

impl Diagnostic for Problem {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(&self.remedy))
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.place.as_deref().map(|(source, _)| source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let (_, bytes) = self.place.as_deref()?;
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(Some("here".to_owned()), bytes.clone()))))
    }
}

/// At least one problem.
#[derive(Clone, Debug)]
pub struct Problems(Vec<Problem>);

impl Problems {
    /// `Err` when there is any problem.
    pub fn none_or(problems: Vec<Problem>) -> Result<(), Self> {
        if problems.is_empty() { Ok(()) } else { Err(Self(problems)) }
    }

    /// Every problem.
    pub fn all(&self) -> &[Problem] {
        &self.0
    }

    /// Text for a person: the first few problems, each with its place in the file.
    pub fn render(&self, colour: bool) -> String {
        let theme = if colour { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
        let handler = GraphicalReportHandler::new_themed(theme).with_width(110).with_context_lines(1);
        let mut text = String::new();
        for problem in self.0.iter().take(MAX_SHOWN) {
            if handler.render_report(&mut text, problem).is_err() {
                text.push_str(&problem.to_string());
            }
        }
        if self.0.len() > MAX_SHOWN {
            text.push_str(&format!("and {} more\n", self.0.len() - MAX_SHOWN));
        }
        text
    }

    /// Rows for a program's output.
    pub fn rows(&self) -> Vec<ProblemRow> {
        self.0.iter().map(ProblemRow::from).collect()
    }
}

impl From<Problem> for Problems {
    fn from(problem: Problem) -> Self {
        Self(vec![problem])
    }
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, problem) in self.0.iter().enumerate() {
            let gap = if i == 0 { "" } else { "\n" };
            write!(f, "{gap}{problem}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Problems {}

/// A problem in JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProblemRow {
    /// File.
    pub file: String,
    /// Line from 1.
    pub line: Option<usize>,
    /// Column from 1.
    pub column: Option<usize>,
    /// The message.
    pub message: String,
    /// The remedy.
    pub remedy: String,
}

impl From<&Problem> for ProblemRow {
    fn from(problem: &Problem) -> Self {
        let place = problem.line_column();
        Self {
            file: problem.file.clone(),
            line: place.map(|p| p.0),
            column: place.map(|p| p.1),
            message: problem.message.clone(),
            remedy: problem.remedy.clone(),
        }
    }
}
