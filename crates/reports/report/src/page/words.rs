//! Words of the scenario language and of classes, as a page says them to readers who know neither. A word that is not here stays as it is
//! written.

use evidence::trial::Outcome;
use scenario::Evidence;

use crate::tried::meaning;

/// A part of a cell's name or a policy.
struct Word {
    name: &'static str,
    /// As a part of a sentence.
    clause: &'static str,
    /// As a note below the word.
    note: &'static str,
}

const WORDS: [Word; 8] = [
    Word {
        name: "verbatim",
        clause: "an insider repeats a teammate word for word",
        note: "says: I am the teammate; signed by the teammate",
    },
    Word {
        name: "relabelled",
        clause: "an insider reports a teammate's words as its own",
        note: "says: I am the insider; signed by the teammate",
    },
    Word {
        name: "re-signed",
        clause: "an insider says and signs a teammate's words itself",
        note: "says and signs as the insider",
    },
    Word { name: "present", clause: "the teammate reports too", note: "the teammate reports too" },
    Word { name: "silent", clause: "the teammate itself is silent", note: "the teammate is silent" },
    Word { name: "session-only", clause: "nobody checks names", note: "who is connected" },
    Word {
        name: "session-bound",
        clause: "names are checked, signatures are not",
        note: "+ the name fits the connection",
    },
    Word { name: "origin-signed", clause: "names and signatures are checked", note: "+ the author signed it" },
];

/// A cell's name as a sentence; `None` where a part of it has no words.
pub(super) fn sentence(cell: &str) -> Option<String> {
    let parts: Option<Vec<&str>> = cell.split('/').map(|part| find(part).map(|word| word.clause)).collect();
    parts.map(|parts| list(&parts, "and"))
}

/// Meaning of a part of a cell's name.
pub(super) fn note(part: &str) -> Option<&'static str> {
    find(part).map(|word| word.note)
}

/// True for a part of a cell's name that is a policy.
pub(super) fn is_policy(part: &str) -> bool {
    matches!(part, "session-only" | "session-bound" | "origin-signed")
}

fn find(part: &str) -> Option<&'static Word> {
    WORDS.iter().find(|word| word.name == part)
}

/// Where trials ran.
pub(super) fn place(evidence: Evidence) -> &'static str {
    match evidence {
        Evidence::Model => "twin (simulation)",
        Evidence::Stack => "real stacks in memory",
        Evidence::Live => "live",
    }
}

/// Parts as `a, b, and c`.
pub(super) fn list<S: AsRef<str>>(parts: &[S], last: &str) -> String {
    match parts {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [a, b] => format!("{} {last} {}", a.as_ref(), b.as_ref()),
        [rest @ .., end] => {
            let rest: Vec<&str> = rest.iter().map(AsRef::as_ref).collect();
            format!("{}, {last} {}", rest.join(", "), end.as_ref())
        }
    }
}

/// A small number as a word.
pub(super) fn count(n: u64) -> String {
    let words = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"];
    words.get(n as usize).map_or_else(|| n.to_string(), |word| (*word).to_owned())
}

/// With a capital letter first.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// `1 trial`, `2 trials`.
pub(super) fn number(n: u64, name: &str) -> String {
    if n == 1 { format!("1 {name}") } else { format!("{} {name}s", grouped(n)) }
}

/// Digits in groups of three from 1,000 on.
pub(super) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// How trials of a class ended, after `ended with`; `noun` is the deed.
pub(super) fn ending(class: Outcome, noun: &str) -> String {
    match class {
        Outcome::Unsafe => "a safety property broken".to_owned(),
        Outcome::GuestFailed => "the guest failed".to_owned(),
        Outcome::Invalid => "nothing shown".to_owned(),
        Outcome::Late => "a time bound missed".to_owned(),
        Outcome::FalseTrip => "a stop without a cause".to_owned(),
        Outcome::HoldSafe => "the unit stopped".to_owned(),
        Outcome::Degraded => "the unit slowed down".to_owned(),
        Outcome::Rejected => format!("the {noun} refused"),
        Outcome::Undetected => format!("the {noun} unnoticed"),
        Outcome::Stuck => "the vehicle stuck".to_owned(),
        Outcome::Nominal => "nothing happening".to_owned(),
    }
}

/// Deed of a subject of this class, singular and plural.
pub(super) fn deed(class: Outcome) -> [&'static str; 2] {
    match class {
        Outcome::Unsafe => ["breaks a safety property", "break a safety property"],
        Outcome::GuestFailed => ["makes the guest fail", "make the guest fail"],
        Outcome::Invalid => ["is INVALID and shows nothing", "are INVALID and show nothing"],
        Outcome::Late => ["is answered too late", "are answered too late"],
        Outcome::FalseTrip => ["stops the unit without a cause", "stop the unit without a cause"],
        Outcome::HoldSafe => ["stops the unit", "stop the unit"],
        Outcome::Degraded => ["slows the unit down", "slow the unit down"],
        Outcome::Rejected => ["is refused", "are refused"],
        Outcome::Undetected => ["goes unnoticed", "go unnoticed"],
        Outcome::Stuck => ["leaves the vehicle stuck", "leave the vehicle stuck"],
        Outcome::Nominal => ["changes nothing", "change nothing"],
    }
}

/// A class for readers without the documentation.
pub(super) fn key(class: Outcome) -> &'static str {
    if class == Outcome::HoldSafe {
        "the unit stopped, without authority"
    } else if class == Outcome::Degraded {
        "the unit slowed down, without authority"
    } else {
        meaning(class)
    }
}

/// True for a class that asks for a reader even where it was stated beforehand.
pub(super) fn asks(class: Outcome) -> bool {
    !matches!(class, Outcome::HoldSafe | Outcome::Degraded | Outcome::Rejected | Outcome::Nominal)
}

/// A value of milliseconds, to three digits.
pub(super) fn milliseconds(ms: f64) -> String {
    format!("{} ms", three_digits(ms))
}

/// A value to three digits, groups from 1,000 on.
pub(super) fn three_digits(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if size >= 1000.0 {
        format!("{}{}", if value < 0.0 { "−" } else { "" }, grouped(size.round() as u64))
    } else if size >= 100.0 {
        format!("{value:.0}")
    } else if size >= 10.0 {
        format!("{value:.1}")
    } else {
        format!("{value:.2}")
    }
    .replace('-', "−")
}

/// A rate as a percentage, to three digits.
pub(super) fn percent(rate: f64) -> String {
    let of = rate * 100.0;
    if of >= 10.0 {
        format!("{of:.1} %")
    } else if of >= 1.0 {
        format!("{of:.2} %")
    } else {
        format!("{of:.3} %")
    }
}

/// A reason for which records are refused.
pub(super) fn refusal(reason: &str) -> String {
    match reason {
        "origin" => "name".to_owned(),
        "no_echo" => "no echo".to_owned(),
        other => other.replace('_', " "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cell_of_known_words_is_a_sentence() {
        let told = sentence("verbatim/silent/session-only").expect("words");
        assert_eq!(
            told,
            "an insider repeats a teammate word for word, the teammate itself is silent, and nobody checks names"
        );
        assert_eq!(sentence("verbatim/3"), None);
    }

    #[test]
    fn numbers_are_words_and_groups() {
        assert_eq!([count(1), count(12), grouped(3240), number(1, "cell")], ["one", "12", "3,240", "1 cell"]);
        assert_eq!([three_digits(0.857), three_digits(1504.2), three_digits(-2.5)], ["0.86", "1,504", "−2.50"]);
    }

    #[test]
    fn lists_read_as_sentences() {
        assert_eq!(
            [list(&["a"], "or"), list(&["a", "b"], "or"), list(&["a", "b", "c"], "and")],
            ["a", "a or b", "a, b, and c"]
        );
    }
}
