//! Colours of outcome classes on a terminal: the console's two, each with one meaning.
//!
//! A class that a run contained has no colour, and a class that was counted zero times has none either. The word itself is always there, so
//! that colour is never the only code.

use std::io::IsTerminal;

/// A stream of text for a person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Results.
    Stdout,
    /// Progress, failures and remarks.
    Stderr,
}

/// Meaning of a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// Red: harm, a missed bound, or an attack without an answer.
    Alarm,
    /// Yellow: abnormal and known, or not evidence.
    Caution,
}

/// Words of each colour. The colours are the theme's own, which are readable on its ground.
const WORDS: [(Colour, &[&str]); 2] = [
    (Colour::Alarm, &["UNSAFE", "LATE", "UNDETECTED", "UNEXPECTED", "FAIL"]),
    (Colour::Caution, &["DEGRADED", "FALSE_TRIP", "INVALID", "GUEST_FAILED", "STUCK", "TRUNCATED"]),
];

impl Colour {
    /// The colour of a word, where it has one.
    pub fn of_word(word: &str) -> Option<Self> {
        WORDS.iter().find(|(_, words)| words.contains(&word)).map(|(colour, _)| *colour)
    }

    fn code(self) -> &'static str {
        match self {
            Colour::Alarm => "\x1b[1;31m",
            Colour::Caution => "\x1b[33m",
        }
    }
}

/// True if a stream takes colours: a terminal that is not `dumb` does, unless `NO_COLOR` is set to anything (<https://no-color.org>).
pub fn takes_colours(stream: Stream) -> bool {
    let is_terminal = match stream {
        Stream::Stdout => std::io::stdout().is_terminal(),
        Stream::Stderr => std::io::stderr().is_terminal(),
    };
    is_terminal && !is_dumb() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// True if the terminal moves no cursor and has no colours.
pub(crate) fn is_dumb() -> bool {
    std::env::var_os("TERM").is_some_and(|name| name == "dumb")
}

/// The text with its classes in their colours, for a stream that takes them; else as it is.
pub fn painted(text: &str, stream: Stream) -> String {
    if takes_colours(stream) { coloured(text) } else { text.to_owned() }
}

fn coloured(text: &str) -> String {
    let part_of_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-');
    let (mut out, mut rest) = (String::with_capacity(text.len()), text);
    while let Some(start) = rest.find(part_of_word) {
        let (before, from) = rest.split_at(start);
        let (word, after) = from.split_at(from.find(|c| !part_of_word(c)).unwrap_or(from.len()));
        out.push_str(before);
        let is_outcome = !is_none(after) && !is_only_named(&out, after);
        match Colour::of_word(word).filter(|_| is_outcome) {
            Some(colour) => out.extend([colour.code(), word, "\x1b[0m"]),
            None => out.push_str(word),
        }
        rest = after;
    }
    out + rest
}

/// True if a count of zero follows a class.
fn is_none(after: &str) -> bool {
    after.strip_prefix(" 0").is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit() || c == '.'))
}

/// True if a class is named, and no trial ended in it: as expected, or in a list of names.
fn is_only_named(before: &str, after: &str) -> bool {
    let is_listed = after.strip_prefix(", ").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_uppercase()));
    let ends = ["expected ", " or "].iter().any(|word| before.ends_with(word));
    ends || is_listed || [" or ", ";"].iter().any(|word| after.starts_with(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn class_that_is_only_named_has_no_colour() {
        for text in ["Worse is: DEGRADED, HOLD_SAFE, LATE, UNSAFE; as", "REJECTED, expected DEGRADED or UNDETECTED"] {
            assert_eq!(coloured(text), text);
        }
        assert_eq!(coloured("LATE, expected DEGRADED"), "\x1b[1;31mLATE\x1b[0m, expected DEGRADED");
    }

    #[test]
    fn only_counted_classes_that_were_not_contained_have_colour() {
        let text = "HOLD_SAFE 3, UNSAFE 2, UNDETECTED 0 · INVALID: x, NOT_UNSAFE, LATE 0.5";
        let expected = "HOLD_SAFE 3, \x1b[1;31mUNSAFE\x1b[0m 2, UNDETECTED 0 · \x1b[33mINVALID\x1b[0m: x, NOT_UNSAFE, \
                        \x1b[1;31mLATE\x1b[0m 0.5";
        assert_eq!(coloured(text), expected);
    }

    #[test]
    fn stream_that_is_no_terminal_stays_plain() {
        if !std::io::stdout().is_terminal() {
            assert_eq!(painted("UNSAFE 2", Stream::Stdout), "UNSAFE 2");
        }
    }
}
