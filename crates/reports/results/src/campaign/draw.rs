//! A trial's own draw: a distribution for one value of the scenario.
//!
//! A draw depends on its key alone, so trials may run anywhere and in any order.

use core::fmt;
use core::str::FromStr;

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

/// Most values of a choice.
const MAX_CHOICES: usize = 64;

/// Distribution of a value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Distribution {
    /// A number between two others, each as likely.
    Uniform(f64, f64),
    /// A number between two positive others, its logarithm uniform.
    LogUniform(f64, f64),
    /// A whole number from one to another, both included, each as likely.
    Integer(i64, i64),
    /// One of these, each as likely.
    Choice(Vec<Value>),
}

impl Distribution {
    /// The value under this key.
    pub fn draw(&self, key: &[&[u8]]) -> Value {
        let mut rng = keyed(key);
        match self {
            Distribution::Uniform(low, high) => Value::from((low + (high - low) * unit(&mut rng)).clamp(*low, *high)),
            Distribution::LogUniform(low, high) => {
                let (from, to) = (libm::log(*low), libm::log(*high));
                Value::from(libm::exp(from + (to - from) * unit(&mut rng)).clamp(*low, *high))
            }
            Distribution::Integer(low, high) => {
                // Saturating: of the widest range the highest number is never drawn.
                Value::from(low.wrapping_add_unsigned(uniform_below(&mut rng, high.abs_diff(*low).saturating_add(1))))
            }
            Distribution::Choice(values) => {
                let index = uniform_below(&mut rng, values.len() as u64) as usize;
                values.get(index).cloned().unwrap_or_default()
            }
        }
    }

    /// Values that represent all: the ends of a range, every choice.
    pub fn ends(&self) -> Vec<Value> {
        match self {
            Distribution::Uniform(low, high) | Distribution::LogUniform(low, high) => {
                vec![Value::from(*low), Value::from(*high)]
            }
            Distribution::Integer(low, high) => vec![Value::from(*low), Value::from(*high)],
            Distribution::Choice(values) => values.clone(),
        }
    }
}

fn keyed(key: &[&[u8]]) -> ChaCha8Rng {
    let mut digest = Sha256::new_with_prefix("holdsafe draw");
    for part in key {
        digest.update((part.len() as u64).to_le_bytes());
        digest.update(part);
    }
    ChaCha8Rng::from_seed(digest.finalize().into())
}

/// A number from 0 up to, not including, 1.
fn unit(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// A number from 0 up to, not including, `n`, each exactly as likely.
fn uniform_below(rng: &mut ChaCha8Rng, n: u64) -> u64 {
    let n = n.max(1);
    // A remainder alone would favour small numbers: draws beyond the last whole multiple of `n` are repeated.
    let whole = u64::MAX - u64::MAX % n;
    loop {
        let drawn = rng.next_u64();
        if drawn < whole {
            return drawn % n;
        }
    }
}

/// A value as it may stand on a command line: as in TOML, or a bare word.
pub fn scalar(text: &str) -> Value {
    values(text).filter(|values| values.len() == 1).and_then(|mut values| values.pop()).unwrap_or_else(|| text.into())
}

/// Values with commas between them, as in a TOML array; where they are no array, words.
pub fn list(text: &str) -> Vec<Value> {
    values(text).unwrap_or_else(|| text.split(',').map(|word| scalar(word.trim())).collect())
}

fn values(text: &str) -> Option<Vec<Value>> {
    let table: toml::Table = toml::from_str(&format!("v = [{text}]")).ok()?;
    let single_entry = (table.len() == 1).then_some(table)?;
    single_entry.get("v")?.as_array()?.iter().map(|value| serde_json::to_value(value).ok()).collect()
}

impl FromStr for Distribution {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || {
            "a draw is PATH=uniform:LOW:HIGH, loguniform:LOW:HIGH, integer:LOW:HIGH or choice:A|B, such as \
             loss.0.share=uniform:0.2:0.9"
                .to_owned()
        };
        let (kind, rest) = text.split_once(':').ok_or_else(unknown)?;
        match kind {
            "uniform" => range(rest, f64::NEG_INFINITY).map(|(low, high)| Distribution::Uniform(low, high)),
            "loguniform" => range(rest, 0.0).map(|(low, high)| Distribution::LogUniform(low, high)),
            "integer" => whole_range(rest).map(|(low, high)| Distribution::Integer(low, high)),
            "choice" => match rest.split('|').map(scalar).collect::<Vec<_>>() {
                values if (2..=MAX_CHOICES).contains(&values.len()) => Ok(Distribution::Choice(values)),
                _ => Err(format!("`{rest}` is no choice: write 2 to {MAX_CHOICES} values with | between them")),
            },
            _ => Err(unknown()),
        }
    }
}

fn range(text: &str, above: f64) -> Result<(f64, f64), String> {
    let ends = text.split_once(':').and_then(|(low, high)| Some((low.parse().ok()?, high.parse().ok()?)));
    let fits = |(low, high): &(f64, f64)| low.is_finite() && high.is_finite() && *low > above && low < high;
    ends.filter(fits).ok_or_else(|| {
        let positive = if above == 0.0 { " positive" } else { "" };
        format!("`{text}` is no range: write LOW:HIGH, two{positive} numbers, the lower one first")
    })
}

fn whole_range(text: &str) -> Result<(i64, i64), String> {
    let ends = text.split_once(':').and_then(|(low, high)| Some((low.parse().ok()?, high.parse().ok()?)));
    let whole = || format!("`{text}` is no range: write LOW:HIGH, two whole numbers, the lower one first");
    ends.filter(|(low, high): &(i64, i64)| low < high).ok_or_else(whole)
}

impl fmt::Display for Distribution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Distribution::Uniform(low, high) => write!(f, "uniform:{low}:{high}"),
            Distribution::LogUniform(low, high) => write!(f, "loguniform:{low}:{high}"),
            Distribution::Integer(low, high) => write!(f, "integer:{low}:{high}"),
            Distribution::Choice(values) => {
                let words: Vec<String> = values.iter().map(Value::to_string).collect();
                write!(f, "choice:{}", words.join("|"))
            }
        }
    }
}

impl TryFrom<String> for Distribution {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Distribution> for String {
    fn from(distribution: Distribution) -> Self {
        distribution.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_distribution(text: &str) -> Distribution {
        text.parse().unwrap()
    }

    fn many(text: &str) -> Vec<Value> {
        (0..2_000u64).map(|i| parse_distribution(text).draw(&[&i.to_le_bytes()])).collect()
    }

    #[test]
    fn draw_depends_on_key_and_its_boundaries() {
        let draw = parse_distribution("uniform:0:1");
        assert_eq!(draw.draw(&[b"ab", b"c"]), draw.draw(&[b"ab", b"c"]));
        assert_ne!(draw.draw(&[b"ab", b"c"]), draw.draw(&[b"a", b"bc"]));
    }

    #[test]
    fn draws_fill_their_range_evenly() {
        let numbers = |text: &str| many(text).iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
        let share = |all: &[f64], below: f64| all.iter().filter(|v| **v < below).count() as f64 / all.len() as f64;
        let uniform = numbers("uniform:-2:6");
        assert!(uniform.iter().all(|v| (-2.0..6.0).contains(v)) && (share(&uniform, 0.0) - 0.25).abs() < 0.04);
        let log = numbers("loguniform:0.01:100");
        assert!(log.iter().all(|v| (0.01..=100.0).contains(v)) && (share(&log, 1.0) - 0.5).abs() < 0.05);
        let whole = numbers("integer:3:6");
        assert!((3..=6).all(|n| (share(&whole, f64::from(n) + 0.5) - share(&whole, f64::from(n)) - 0.25).abs() < 0.04));
        let chosen = many("choice:up|down");
        assert!((chosen.iter().filter(|v| v.as_str() == Some("up")).count() as f64 / 2_000.0 - 0.5).abs() < 0.05);
    }

    #[test]
    fn widest_integer_range_can_be_drawn() {
        let widest = parse_distribution(&format!("integer:{}:{}", i64::MIN, i64::MAX));
        assert!(widest.draw(&[b"a"]).is_i64() && widest.draw(&[b"a"]) != widest.draw(&[b"b"]));
    }

    #[test]
    fn a_distribution_is_written_as_it_is_read() {
        for text in ["uniform:0.2:0.9", "loguniform:0.001:10", "integer:1:9", "choice:1|2.5|\"up\"|true"] {
            assert_eq!(parse_distribution(&parse_distribution(text).to_string()), parse_distribution(text));
        }
        assert_eq!(parse_distribution("choice:up|1"), parse_distribution("choice:\"up\"|1"));
        for text in
            ["uniform", "normal:0:1", "uniform:1:0", "uniform:0:inf", "loguniform:0:1", "integer:1:2.5", "choice:a"]
        {
            assert!(text.parse::<Distribution>().is_err(), "{text}");
        }
    }

    #[test]
    fn values_parse_as_in_files_else_as_text() {
        assert_eq!(list("1,2.5,true"), [Value::from(1), Value::from(2.5), Value::from(true)]);
        assert_eq!(list("up,down"), [Value::from("up"), Value::from("down")]);
        assert_eq!(list("[1, 2],[3, 4]").len(), 2);
        // A value that would be more than one entry of a table is always a word.
        assert_eq!(scalar("1]\nw = [2"), Value::from("1]\nw = [2"));
    }
}
