//! Sentences of other pages that carry a figure: the place of a template in a page, whatever its numbers are.

use std::ops::Range;

/// Longest text in the place of a pointer.
const LONGEST: usize = 40;

/// Place of the one sentence of `page` that this template gives with some numbers.
///
/// # Errors
/// The template begins with a pointer, or the page has no such sentence, or several.
pub fn place(page: &str, template: &str) -> Result<Range<usize>, String> {
    let pieces = literals(template)?;
    let (first, rest) = pieces.split_first().ok_or("the template is empty")?;
    if first.is_empty() {
        return Err(format!("`{template}` begins with a pointer: text is expected"));
    }
    let found: Vec<Range<usize>> = page
        .match_indices(first.as_str())
        .filter_map(|(start, text)| Some(start..end(page, start + text.len(), rest)?))
        .collect();
    match found.as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(format!("no sentence `{template}`")),
        several => Err(format!("{} sentences `{template}`", several.len())),
    }
}

/// End of the pieces that follow `at`, each behind a short text of one line.
fn end(page: &str, at: usize, pieces: &[String]) -> Option<usize> {
    let mut at = at;
    for (i, piece) in pieces.iter().enumerate() {
        let rest = page.get(at..)?;
        let is_last = i + 1 == pieces.len();
        let gap = match piece.is_empty() {
            // Behind the last pointer: up to the end of its number.
            true if is_last => number_end(rest),
            true => return None,
            false => rest.find(piece.as_str())?,
        };
        let between = rest.get(..gap)?;
        if between.is_empty() || between.contains('\n') || between.chars().count() > LONGEST {
            return None;
        }
        at += gap + piece.len();
    }
    Some(at)
}

/// Length of the number at the begin of a text; a full stop or comma belongs to it only before a digit.
fn number_end(text: &str) -> usize {
    let is_digit = |at: usize| text.as_bytes().get(at).is_some_and(u8::is_ascii_digit);
    let is_inside = |(at, c): (usize, char)| is_digit(at) || (",.".contains(c) && is_digit(at + 1));
    text.char_indices().find(|one| !is_inside(*one)).map_or(text.len(), |(at, _)| at)
}

/// The text before, between and behind the pointers.
fn literals(template: &str) -> Result<Vec<String>, String> {
    let mut pieces = Vec::new();
    for (i, part) in template.split('{').enumerate() {
        match part.split_once('}') {
            Some((_, text)) if i > 0 => pieces.push(text.to_owned()),
            None if i == 0 => pieces.push(part.to_owned()),
            Some(_) | None => return Err(format!("`{template}` has a brace that is not closed or not opened")),
        }
    }
    Ok(pieces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_is_found_with_other_numbers() {
        let page = "Loss: mean 182 ms, p95 188 ms.\nLoss: mean x.";
        let found = place(page, "mean {/0/a} ms, p95 {/0/b} ms").unwrap();
        assert_eq!(&page[found], "mean 182 ms, p95 188 ms");
        let found = place("| 59 of 59 |", "of {/0/n}").unwrap();
        assert_eq!(found, 5..10);
        assert_eq!(place("seed 1.", "seed {/0/seed}"), Ok(0..6));
    }

    #[test]
    fn missing_or_repeated_sentence_is_an_error() {
        let page = "mean 1 ms. mean 2 ms.";
        for (template, why) in [
            ("mean {/a} s", "no sentence"),
            ("mean {/a} ms", "2 sentences"),
            ("{/a} ms", "begins with"),
            ("mean {/a ms", "brace"),
            ("mean {/a}{/b} ms", "no sentence"),
        ] {
            assert!(place(page, template).unwrap_err().contains(why), "{template}");
        }
    }
}
