//! The colours of outcomes, modes and lines, light and dark: one table, from which the page's style sheet and the style of single
//! files are made. A colour is never the only sign of anything: the word stands beside it or in the table below.

use core::fmt::Write;

/// Each class of the style sheet: its name, its use as fill or stroke, its colour on white and on near-black. Outcomes
/// and modes are fills, lines are strokes.
const COLOURS: [(&str, Paint, &str, &str); 29] = [
    ("unsafe", Paint::Fill, "#b3001b", "#ff6b76"),
    ("invalid", Paint::Fill, "#6d28d9", "#b89cff"),
    ("late", Paint::Fill, "#c2410c", "#ff9b57"),
    ("false-trip", Paint::Fill, "#a16207", "#f2c94c"),
    ("stuck", Paint::Fill, "#713f12", "#d9a441"),
    ("hold-safe", Paint::Fill, "#1d4ed8", "#7aa7ff"),
    ("degraded", Paint::Fill, "#0e7490", "#4cc9e0"),
    ("rejected", Paint::Fill, "#15803d", "#5ccb86"),
    ("undetected", Paint::Fill, "#57534e", "#c4bdb4"),
    ("nominal", Paint::Fill, "#a8a29e", "#6b6660"),
    ("idle", Paint::Fill, "#d6d3d1", "#44403c"),
    ("ready", Paint::Fill, "#a8a29e", "#6b6660"),
    ("prepare", Paint::Fill, "#57534e", "#c4bdb4"),
    ("authority", Paint::Fill, "#1c1917", "#f5f5f4"),
    ("attack", Paint::Fill, "#b3001b", "#ff6b76"),
    ("refusal", Paint::Fill, "#15803d", "#5ccb86"),
    ("plain", Paint::Fill, "#44403c", "#d6d3d1"),
    ("other", Paint::Fill, "#d6d3d1", "#57534e"),
    ("label", Paint::Fill, "#1c1917", "#f5f5f4"),
    ("faint", Paint::Fill, "#57534e", "#b8b2aa"),
    ("grid", Paint::Stroke(1.0), "#d6d3d1", "#44403c"),
    ("axis", Paint::Stroke(1.0), "#78716c", "#a8a29e"),
    ("reported", Paint::Stroke(1.5), "#6d28d9", "#b89cff"),
    ("line-0", Paint::Stroke(1.75), "#1d4ed8", "#7aa7ff"),
    ("line-1", Paint::Stroke(1.75), "#b3001b", "#ff6b76"),
    ("line-2", Paint::Stroke(1.75), "#57534e", "#c4bdb4"),
    ("band-0", Paint::Veil, "#1d4ed8", "#7aa7ff"),
    ("band-1", Paint::Veil, "#b3001b", "#ff6b76"),
    ("band-2", Paint::Veil, "#57534e", "#c4bdb4"),
];

#[derive(Clone, Copy)]
enum Paint {
    Fill,
    Stroke(f64),
    /// A translucent fill.
    Veil,
}

/// The rules of a file that stands alone.
pub(super) fn light() -> String {
    rules(|(_, _, light, _)| (*light).to_owned())
}

/// The rules of a page with colours as variables, and the variables: rules, light, dark.
pub(crate) fn sheet() -> (String, String, String) {
    let variables = |pick: fn(&(&str, Paint, &'static str, &'static str)) -> &'static str| {
        COLOURS.iter().fold(String::new(), |all, colour| format!("{all}--{}:{};", colour.0, pick(colour)))
    };
    (rules(|(class, ..)| format!("var(--{class})")), variables(|c| c.2), variables(|c| c.3))
}

fn rules(colour: impl Fn(&(&str, Paint, &str, &str)) -> String) -> String {
    let mut all = String::new();
    for row in &COLOURS {
        let (class, name) = (row.0, colour(row));
        let rule = match row.1 {
            Paint::Fill => format!("fill:{name}"),
            Paint::Veil => format!("fill:{name};fill-opacity:.15"),
            Paint::Stroke(width) => format!("fill:none;stroke:{name};stroke-width:{width}"),
        };
        write!(all, ".{class}{{{rule}}}").expect("invariant: writing to a String cannot fail");
    }
    all
}

/// The colour of an outcome on white, by its name in results.
pub(crate) fn colour_of_outcome(name: &str) -> &'static str {
    let class = class_of_outcome(name);
    COLOURS.iter().find(|row| row.0 == class).map_or("#d6d3d1", |row| row.2)
}

/// The class of an outcome by its name in results.
pub fn class_of_outcome(name: &str) -> &'static str {
    match name {
        "UNSAFE" => "unsafe",
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
    fn harm_stands_out_light_and_dark() {
        let paper = [crate::page::PAPER_LIGHT, crate::page::PAPER_DARK];
        for class in ["unsafe", "invalid", "late", "false-trip", "hold-safe", "degraded", "rejected", "undetected"] {
            let (.., light, dark) = COLOURS.iter().find(|c| c.0 == class).expect("a colour");
            assert!(contrast(light, paper[0]) >= 3.0 && contrast(dark, paper[1]) >= 3.0, "{class}");
        }
    }
}
