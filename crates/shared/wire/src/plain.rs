//! Characters that are safe to print: text of others reaches terminals, logs and pages.

/// True unless the character is a control character, or one that changes the direction, joins or hides its neighbours
/// (Unicode's bidirectional controls and zero-width characters), by which a line can read otherwise than it is.
pub fn is_plain(c: char) -> bool {
    let hides = matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}');
    !c.is_control() && !hides
}

/// A character for display: each other one is a space.
pub fn shown(c: char) -> char {
    if is_plain(c) { c } else { ' ' }
}

/// A text of several lines as it is shown: other characters than plain ones are replaced by others of as many bytes, so
/// that places stay.
pub fn same_length(text: &str) -> String {
    let shown = |c: char| match c.len_utf8() {
        _ if is_plain(c) || matches!(c, '\n' | '\r' | '\t') => c,
        1 => '?',
        2 => '\u{b7}',
        _ => '\u{fffd}',
    };
    text.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reordering_and_hidden_characters_are_not_plain() {
        assert!("aé→漢 ".chars().all(is_plain));
        for c in ['\u{1b}', '\n', '\u{202e}', '\u{2066}', '\u{200b}', '\u{feff}'] {
            assert!(!is_plain(c) && shown(c) == ' ', "{c:?}");
        }
        assert_eq!(same_length("a\u{1b}b\n\u{202e}"), "a?b\n\u{fffd}");
    }
}
