//! The colours of outcomes, modes and lines, light and dark: one table, from which the page's style sheet and the style of single
//! files are made. A colour is never the only sign of anything: the word stands beside it or in the table below.

use core::fmt::Write;

/// Each class of the style sheet: its name, its use as fill or stroke, its colour on white and on near-black. Outcomes
/// and modes are fills, lines are strokes.
const COLOURS: [(&str, Paint, &str, &str); 37] = [
    ("unsafe", Paint::Fill, "#7a0f2b", "#e0607f"),
    ("guest-failed", Paint::Fill, "#6b4e2e", "#b98a58"),
    ("invalid", Paint::Fill, "#5f6670", "#8a929c"),
    ("late", Paint::Edged, "#f0c53d", "#f0c53d"),
    ("false-trip", Paint::Fill, "#cc79a7", "#cc79a7"),
    ("stuck", Paint::Fill, "#8c6d1f", "#c9a94f"),
    ("hold-safe", Paint::Fill, "#1f5fa8", "#6fa8e8"),
    ("degraded", Paint::Edged, "#8fb4dc", "#8fb4dc"),
    ("rejected", Paint::Fill, "#0b6e4f", "#4fbf96"),
    ("undetected", Paint::Fill, "#c2410c", "#d9531e"),
    ("nominal", Paint::Edged, "#ffffff", "#3a424a"),
    ("idle", Paint::Fill, "#d5dadf", "#33393f"),
    ("ready", Paint::Fill, "#bac2ca", "#4a525a"),
    ("prepare", Paint::Fill, "#98a3ae", "#5f6973"),
    ("authority", Paint::Fill, "#3a424a", "#cbd0d5"),
    ("attack", Paint::Fill, "#5f6670", "#8a929c"),
    ("attack-unnoticed", Paint::Fill, "#c2410c", "#d9531e"),
    ("guard", Paint::Fill, "#1f5fa8", "#6fa8e8"),
    ("refusal", Paint::Fill, "#0b6e4f", "#4fbf96"),
    ("shown", Paint::Edged, "#ffffff", "#161412"),
    ("lane", Paint::Fill, "#f1f3f5", "#22262b"),
    ("plain", Paint::Fill, "#3a424a", "#cbd0d5"),
    ("other", Paint::Fill, "#d5dadf", "#4a525a"),
    ("label", Paint::Fill, "#14181c", "#f2f4f5"),
    ("faint", Paint::Fill, "#4a5158", "#aeb5bc"),
    ("on-fill", Paint::Fill, "#ffffff", "#101214"),
    ("on-pale", Paint::Fill, "#14181c", "#14181c"),
    ("grid", Paint::Stroke(1.0), "#d5dadf", "#4a525a"),
    ("axis", Paint::Stroke(1.0), "#6a727a", "#9aa2aa"),
    ("injected", Paint::Stroke(1.5), "#c2410c", "#e8703e"),
    ("reported", Paint::Stroke(1.5), "#7a0f2b", "#e0607f"),
    ("line-0", Paint::Stroke(2.0), "#14181c", "#f2f4f5"),
    ("line-1", Paint::Stroke(2.0), "#c2410c", "#e8703e"),
    ("line-2", Paint::Stroke(2.0), "#1f5fa8", "#6fa8e8"),
    ("band-0", Paint::Veil, "#14181c", "#f2f4f5"),
    ("band-1", Paint::Veil, "#c2410c", "#e8703e"),
    ("band-2", Paint::Veil, "#1f5fa8", "#6fa8e8"),
];

/// Ground of a cell whose outcome needs no reader, light and dark.
const TINTS: [(&str, &str, &str); 4] = [
    ("hold-safe", "#e4ecf6", "#18283c"),
    ("rejected", "#e1efe9", "#132e26"),
    ("degraded", "#eef4fa", "#1d2833"),
    ("nominal", "#ffffff", "#161412"),
];

#[derive(Clone, Copy)]
enum Paint {
    Fill,
    /// A fill with an edge, for colours near the paper's.
    Edged,
    Stroke(f64),
    /// A translucent fill.
    Veil,
}

/// The rules of a file that stands alone.
pub(super) fn light() -> String {
    let edge = COLOURS.iter().find(|row| row.0 == "axis").map_or("", |row| row.2);
    rules(|(_, _, light, _)| (*light).to_owned(), edge)
}

/// The rules of a page with colours as variables, and the variables: rules, light, dark.
pub(crate) fn sheet() -> (String, String, String) {
    let variables = |pick: fn([&'static str; 2]) -> &'static str| {
        let own = COLOURS.iter().fold(String::new(), |all, row| format!("{all}--{}:{};", row.0, pick([row.2, row.3])));
        TINTS.iter().fold(own, |all, row| format!("{all}--tint-{}:{};", row.0, pick([row.1, row.2])))
    };
    let mut all = rules(|(class, ..)| format!("var(--{class})"), "var(--axis)");
    for (class, ..) in &TINTS {
        write!(all, ".tint-{class}{{background:var(--tint-{class})}}")
            .expect("invariant: writing to a String cannot fail");
    }
    // Ten outcomes and one more: each can fill a cell.
    for (class, ..) in COLOURS.iter().take(11) {
        let letters = letters_on(class);
        write!(all, ".full-{class}{{background:var(--{class});color:var(--{letters})}}")
            .expect("invariant: writing to a String cannot fail");
    }
    (all, variables(|[light, _]| light), variables(|[_, dark]| dark))
}

fn rules(colour: impl Fn(&(&str, Paint, &str, &str)) -> String, edge: &str) -> String {
    let mut all = String::new();
    for row in &COLOURS {
        let (class, name) = (row.0, colour(row));
        let rule = match row.1 {
            Paint::Fill => format!("fill:{name}"),
            Paint::Edged => format!("fill:{name};stroke:{edge};stroke-width:1"),
            Paint::Veil => format!("fill:{name};fill-opacity:.15"),
            Paint::Stroke(width) => format!("fill:none;stroke:{name};stroke-width:{width}"),
        };
        write!(all, ".{class}{{{rule}}}").expect("invariant: writing to a String cannot fail");
    }
    all
}

/// True if a cell of this class has a tint of its own.
pub(crate) fn is_tinted(class: &str) -> bool {
    TINTS.iter().any(|row| row.0 == class)
}

/// Class of letters on a fill of this class.
pub(crate) fn letters_on(class: &str) -> &'static str {
    match class {
        "late" | "false-trip" | "degraded" => "on-pale",
        "nominal" | "idle" | "ready" | "prepare" | "shown" | "other" | "lane" => "label",
        _ => "on-fill",
    }
}

/// The class of an outcome by its name in results.
pub fn class_of_outcome(name: &str) -> &'static str {
    match name {
        "UNSAFE" => "unsafe",
        "GUEST_FAILED" => "guest-failed",
        "INVALID" => "invalid",
        "LATE" => "late",
        "FALSE_TRIP" => "false-trip",
        "STUCK" => "stuck",
        "HOLD_SAFE" => "hold-safe",
        "DEGRADED" => "degraded",
        "REJECTED" => "rejected",
        "UNDETECTED" => "undetected",
        "NOMINAL" => "nominal",
        _ => "other",
    }
}

/// The class of a mode of the platform by its name in results.
pub fn class_of_mode(name: &str) -> &'static str {
    match name {
        "IDLE" => "idle",
        "READY" => "ready",
        "PREPARE_TO_ACT" => "prepare",
        "DEGRADED" => "degraded",
        "HOLD_SAFE" => "hold-safe",
        _ => "other",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance, WCAG 2.2.
    fn luminance(hex: &str) -> f64 {
        let part = |i: usize| {
            let c = f64::from(u8::from_str_radix(&hex[i..i + 2], 16).expect("hexadecimal")) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) }
        };
        0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5)
    }

    fn contrast(a: &str, b: &str) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    /// Light and dark.
    #[test]
    fn text_contrast_is_at_least_4_5() {
        let paper = [crate::page::PAPER_LIGHT, crate::page::PAPER_DARK];
        for (class, _, light, dark) in COLOURS.iter().filter(|c| matches!(c.0, "label" | "faint")) {
            assert!(contrast(light, paper[0]) >= 4.5 && contrast(dark, paper[1]) >= 4.5, "{class}");
        }
    }

    #[test]
    fn outcomes_stand_out_by_colour_or_edge() {
        let paper = [crate::page::PAPER_LIGHT, crate::page::PAPER_DARK];
        for (class, paint, light, dark) in COLOURS.iter().take(11) {
            let seen = contrast(light, paper[0]) >= 3.0 && contrast(dark, paper[1]) >= 3.0;
            assert!(seen || matches!(paint, Paint::Edged), "{class}");
        }
    }

    #[test]
    fn letters_on_a_fill_can_be_read() {
        let modes = ["idle", "ready", "prepare", "guard", "shown", "lane", "attack"];
        for (class, _, light, dark) in
            COLOURS.iter().take(11).chain(COLOURS.iter().filter(|row| modes.contains(&row.0)))
        {
            let letters = COLOURS.iter().find(|row| row.0 == letters_on(class)).expect("a colour");
            assert!(contrast(light, letters.2) >= 4.5 && contrast(dark, letters.3) >= 4.5, "{class}");
        }
    }

    #[test]
    fn text_on_a_tint_can_be_read() {
        for (class, light, dark) in &TINTS {
            assert!(contrast(light, "#14181c") >= 7.0 && contrast(dark, "#f2f4f5") >= 7.0, "{class}");
            let mark = COLOURS.iter().find(|row| row.0 == *class).expect("a colour");
            let edged = matches!(mark.1, Paint::Edged);
            assert!(edged || (contrast(light, mark.2) >= 3.0 && contrast(dark, mark.3) >= 3.0), "{class}");
        }
    }
}
