//! Sentences with pointers into results: `{/0/summary/n}`, a sum over places, a count of texts, and forms of a number.
//!
//! The first step of a pointer is the index of the command. `{sum /0/cells/*/n}`, `min`, `max` and `count` go over every element at `*`;
//! `{count /0/trials/*/outcome=UNSAFE}` counts equal texts, and `*[mode=live]` goes over elements whose field is that text. Behind a colon: a number of decimals, `thousands`, `percent` with a number of
//! decimals, or `times` with a factor. `{/0/x?0}` has a default.

use serde_json::Value;

/// The sentence, with every pointer replaced by its number.
///
/// # Errors
/// A brace that is not closed, a number that is not there, or an unknown form.
pub fn fill(sentence: &str, results: &Value) -> Result<String, String> {
    let mut filled = String::new();
    for (i, part) in sentence.split('{').enumerate() {
        match part.split_once('}') {
            Some((pointer, rest)) if i > 0 => filled.extend([&shown(pointer, results)?, rest]),
            Some(_) | None if i > 0 => return Err(format!("`{{{part}` is not closed")),
            Some(_) | None => filled.push_str(part),
        }
    }
    Ok(filled)
}

/// Truth of this comparison: a pointer, `>=`, `<=` or `==`, and a number or a text.
///
/// # Errors
/// It is no comparison, or its number is not there.
pub fn compare(comparison: &str, results: &Value) -> Result<bool, String> {
    let symbols = [" >= ", " <= ", " == "];
    let found = symbols.iter().find_map(|symbol| Some((*symbol, comparison.split_once(symbol)?)));
    let (symbol, (pointer, wanted)) = found.ok_or_else(|| format!("`{comparison}` compares nothing"))?;
    let got = value(pointer.trim(), results)?;
    match (got.as_f64(), wanted.trim().parse::<f64>()) {
        (Some(got), Ok(wanted)) => Ok(match symbol.trim() {
            ">=" => got >= wanted,
            "<=" => got <= wanted,
            _ => got == wanted,
        }),
        _ if symbol == " == " => Ok(got.as_str().map_or_else(|| got.to_string(), str::to_owned) == wanted.trim()),
        _ => Err(format!("`{comparison}` compares no numbers")),
    }
}

fn shown(text: &str, results: &Value) -> Result<String, String> {
    let (pointer, form) = text.rsplit_once(':').map_or((text, None), |(pointer, form)| (pointer, Some(form)));
    let value = value(pointer, results)?;
    let Some(form) = form else {
        return Ok(value.as_str().map_or_else(|| plain(&value), str::to_owned));
    };
    let number = value.as_f64().ok_or_else(|| format!("`{pointer}` is no number"))?;
    formed(number, form).ok_or_else(|| format!("`{form}` is no form of a number"))
}

/// A whole number without decimals.
fn plain(value: &Value) -> String {
    match value.as_f64() {
        Some(number) if number.fract() == 0.0 => format!("{number:.0}"),
        Some(_) | None => value.to_string(),
    }
}

fn formed(number: f64, form: &str) -> Option<String> {
    if let Some(digits) = form.strip_prefix("percent") {
        let digits: usize = digits.parse().ok().filter(|digits| *digits < 6)?;
        return Some(format!("{:.digits$} %", 100.0 * number));
    }
    if let Some(rest) = form.strip_prefix("times") {
        // A factor and decimals: `times1000.1`.
        let (factor, digits) = rest.split_once('.')?;
        let digits: usize = digits.parse().ok().filter(|digits| *digits < 9)?;
        return Some(format!("{:.digits$}", factor.parse::<f64>().ok()? * number));
    }
    if form == "thousands" {
        return Some(thousands(number));
    }
    let digits: usize = form.parse().ok().filter(|digits| *digits < 9)?;
    Some(format!("{number:.digits$}"))
}

/// `33,453`.
fn thousands(number: f64) -> String {
    let digits = format!("{number:.0}");
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// The value at a pointer, or over its places.
fn value(text: &str, results: &Value) -> Result<Value, String> {
    if let Some((act, pointer)) = text.split_once(' ') {
        return over(act, pointer, results);
    }
    let (pointer, default) = text.split_once('?').map_or((text, None), |(pointer, default)| (pointer, Some(default)));
    let found = results.pointer(pointer).filter(|value| value.is_number() || value.is_string() || value.is_boolean());
    match (found, default.and_then(|default| default.parse::<f64>().ok())) {
        (Some(value), _) => Ok(value.clone()),
        (None, Some(default)) => Ok(Value::from(default)),
        (None, None) => Err(format!("no number and no text at `{pointer}`")),
    }
}

fn over(act: &str, pointer: &str, results: &Value) -> Result<Value, String> {
    let end = pointer.rfind(']').map_or(0, |end| end + 1);
    let (pointer, wanted) = match pointer.get(end..).and_then(|rest| rest.find('=')) {
        Some(at) => (&pointer[..end + at], Some(&pointer[end + at + 1..])),
        None => (pointer, None),
    };
    let steps: Vec<&str> = pointer.split('/').skip(1).collect();
    let mut found = Vec::new();
    collect(results, &steps, &mut found);
    let numbers = || found.iter().filter_map(|value| value.as_f64());
    let is_wanted = |value: &&&Value| wanted.is_none_or(|text| value.as_str() == Some(text));
    let result = match act {
        "count" => Some(found.iter().filter(is_wanted).count() as f64),
        // The sum of no numbers is −0 otherwise.
        "sum" => Some(numbers().fold(0.0, |sum, number| sum + number)),
        "min" => numbers().reduce(f64::min),
        "max" => numbers().reduce(f64::max),
        _ => return Err(format!("`{act}` is none of sum, min, max, count")),
    };
    result.map(Value::from).ok_or_else(|| format!("no number at `{pointer}`"))
}

/// Every value at these steps, where `*` goes over all elements.
fn collect<'a>(value: &'a Value, steps: &[&str], to: &mut Vec<&'a Value>) {
    let Some((step, rest)) = steps.split_first() else {
        to.push(value);
        return;
    };
    let (step, filter) = filtered(step);
    let is_text = |value: &Value, text: &str| value.as_str().map_or_else(|| value.to_string(), str::to_owned) == text;
    let is_wanted =
        |one: &&Value| filter.is_none_or(|(field, text)| one.get(field).is_some_and(|value| is_text(value, text)));
    let next: Vec<&Value> = match (step, value) {
        ("*", Value::Array(all)) => all.iter().filter(is_wanted).collect(),
        ("*", Value::Object(all)) => all.values().filter(is_wanted).collect(),
        (name, Value::Array(all)) => name.parse::<usize>().ok().and_then(|index| all.get(index)).into_iter().collect(),
        (name, Value::Object(all)) => all.get(name).into_iter().collect(),
        (_, _) => Vec::new(),
    };
    for one in next {
        collect(one, rest, to);
    }
}

/// A step without its filter, and the filter's field and text: `*[mode=live]`.
fn filtered(step: &str) -> (&str, Option<(&str, &str)>) {
    let parts = step.strip_suffix(']').and_then(|step| step.split_once('['));
    parts.map_or((step, None), |(step, filter)| (step, filter.split_once('=')))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results() -> Value {
        serde_json::json!([{ "cells": [{ "n": 59, "share": 0.1264 }, { "n": 1200, "share": 0.5 }], "of": ["A", "B", "A"], "name": "x" }])
    }

    #[test]
    fn numbers_come_from_the_results() {
        for (sentence, filled) in [
            ("{/0/cells/0/n} of {sum /0/cells/*/n:thousands}", "59 of 1,259"),
            (
                "{/0/cells/0/share:2}, {/0/cells/0/share:percent1}, {/0/cells/0/share:times1000.1}",
                "0.13, 12.6 %, 126.4",
            ),
            ("{max /0/cells/*/share} {min /0/cells/*/n} {count /0/of/*=A} {count /0/of/*}", "0.5 59 2 3"),
            ("{/0/none?0} {/0/name} {sum /0/none/*/n}", "0 x 0"),
            ("{sum /0/cells/*[n=59]/share:2} {count /0/cells/*[n=59]/n} {count /0/cells/*[n=1]/n}", "0.13 1 0"),
        ] {
            assert_eq!(fill(sentence, &results()).as_deref(), Ok(filled));
        }
    }

    #[test]
    fn a_missing_number_is_an_error() {
        for (sentence, why) in [
            ("{/0/none}", "no number and no text"),
            ("{/0/name:1}", "is no number"),
            ("{/0/cells/0/n:far}", "is no form"),
            ("{/0/name", "not closed"),
            ("{max /0/none/*}", "no number at"),
            ("{mean /0/cells/*/n}", "none of sum"),
        ] {
            assert!(fill(sentence, &results()).unwrap_err().contains(why), "{sentence}");
        }
    }

    #[test]
    fn claims_are_compared() {
        let results = results();
        for (claim, holds) in [
            ("/0/cells/0/n >= 59", true),
            ("/0/cells/0/share <= 0.1", false),
            ("sum /0/cells/*/n == 1259", true),
            ("/0/name == x", true),
            ("/0/name == y", false),
        ] {
            assert_eq!(compare(claim, &results), Ok(holds), "{claim}");
        }
        assert!(compare("/0/cells/0/n > 1", &results).is_err());
        assert!(compare("/0/name >= 1", &results).is_err());
    }
}
