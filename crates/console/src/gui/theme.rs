//! Colours and sizes: grey is normal, a saturated colour means that something is not, and is never the only sign of it.
//!
//! In the dark theme the four saturated hues are of Okabe and Ito's palette or beside it; in the light one, where all
//! have to be dark enough to read, they differ in lightness too. Every text colour has a contrast of at least
//! [`LEAST_CONTRAST`] on every surface, and no two of the hues look alike to the colour-blind: tests compute both.
//! Still none stands without a shape and a word.

use eframe::egui::{
    self, Color32, CornerRadius, FontFamily, FontId, Margin, Stroke, Style, TextStyle, Theme, Ui, Vec2, Visuals,
    epaint::Shadow, style::WidgetVisuals,
};

/// Least contrast between a text and its background (WCAG 2, level AA for text of any size).
pub const LEAST_CONTRAST: f64 = 4.5;

/// Least contrast of the edge of a control (the same, for non-text elements).
pub const LEAST_EDGE: f64 = 3.0;

/// Opacity of a control that cannot be pressed, which is still to be read.
pub const DISABLED: f32 = 0.9;

/// Height of a row of a table, points.
pub const ROW: f32 = 20.0;

/// A set of colours.
#[derive(Clone, Copy, Debug)]
pub struct Palette {
    /// Behind everything.
    pub ground: Color32,
    /// Behind a pane's content.
    pub pane: Color32,
    /// Behind a control, a chip, every other row.
    pub raised: Color32,
    /// Lines that part things; carries no text.
    pub line: Color32,
    /// The edge of a control or a chip; carries no text.
    pub edge: Color32,
    /// Grid and scale of the map; carries no text.
    pub faint: Color32,
    /// Text to be read first.
    pub strong: Color32,
    /// Text.
    pub text: Color32,
    /// Headings, units, disabled elements.
    pub weak: Color32,
    /// Act now.
    pub alarm: Color32,
    /// Not to be relied on, or out of normal.
    pub caution: Color32,
    /// Worth a look.
    pub advice: Color32,
    /// Selection, and marks of the run; no statement about the world.
    pub mark: Color32,
    /// On a block filled with a saturated colour or with `strong`.
    pub on_block: Color32,
    /// The way that a unit has come; carries no text.
    pub trail: Color32,
    /// Marks of what is normal; carries no text.
    pub quiet: Color32,
}

impl Palette {
    /// For a dark room.
    pub const DARK: Palette = Palette {
        ground: Color32::from_rgb(0x14, 0x16, 0x19),
        pane: Color32::from_rgb(0x1C, 0x1F, 0x23),
        raised: Color32::from_rgb(0x26, 0x2A, 0x2F),
        line: Color32::from_rgb(0x3A, 0x40, 0x47),
        edge: Color32::from_rgb(0x78, 0x81, 0x8A),
        faint: Color32::from_rgb(0x2B, 0x2F, 0x35),
        strong: Color32::from_rgb(0xF2, 0xF4, 0xF5),
        text: Color32::from_rgb(0xCB, 0xD0, 0xD5),
        weak: Color32::from_rgb(0x9A, 0xA2, 0xAA),
        alarm: Color32::from_rgb(0xFF, 0x6B, 0x55),
        caution: Color32::from_rgb(0xE6, 0x9F, 0x00),
        advice: Color32::from_rgb(0xF0, 0xE4, 0x42),
        mark: Color32::from_rgb(0x56, 0xB4, 0xE9),
        on_block: Color32::from_rgb(0x10, 0x12, 0x14),
        trail: Color32::from_rgb(0x8C, 0x95, 0x9E),
        quiet: Color32::from_rgb(0x6E, 0x77, 0x80),
    };

    /// For a bright room.
    pub const LIGHT: Palette = Palette {
        ground: Color32::from_rgb(0xD9, 0xDC, 0xDF),
        pane: Color32::from_rgb(0xEE, 0xF0, 0xF1),
        raised: Color32::from_rgb(0xDF, 0xE2, 0xE5),
        line: Color32::from_rgb(0xB4, 0xBA, 0xC0),
        edge: Color32::from_rgb(0x6A, 0x72, 0x7A),
        faint: Color32::from_rgb(0xC9, 0xCD, 0xD1),
        strong: Color32::from_rgb(0x0C, 0x0E, 0x10),
        text: Color32::from_rgb(0x2A, 0x2F, 0x34),
        weak: Color32::from_rgb(0x4A, 0x51, 0x58),
        alarm: Color32::from_rgb(0xA1, 0x1A, 0x2D),
        caution: Color32::from_rgb(0x91, 0x48, 0x08),
        advice: Color32::from_rgb(0x40, 0x33, 0x02),
        mark: Color32::from_rgb(0x00, 0x4C, 0x7D),
        on_block: Color32::from_rgb(0xFF, 0xFF, 0xFF),
        trail: Color32::from_rgb(0x6B, 0x73, 0x7B),
        quiet: Color32::from_rgb(0x6F, 0x77, 0x7F),
    };

    /// The one in use.
    pub fn current(ui: &Ui) -> &'static Palette {
        if ui.visuals().dark_mode { &Self::DARK } else { &Self::LIGHT }
    }

    fn visuals(&self, base: Visuals) -> Visuals {
        let widget = |fill: Color32, stroke: Color32, text: Color32| WidgetVisuals {
            bg_fill: fill,
            weak_bg_fill: fill,
            bg_stroke: Stroke::new(1.0, stroke),
            corner_radius: CornerRadius::same(2),
            fg_stroke: Stroke::new(1.0, text),
            expansion: 0.0,
        };
        let mut visuals = base;
        visuals.widgets.noninteractive = widget(self.pane, self.line, self.text);
        visuals.widgets.inactive = widget(self.raised, self.edge, self.text);
        visuals.widgets.hovered = widget(self.line, self.weak, self.strong);
        visuals.widgets.active = widget(self.line, self.strong, self.strong);
        visuals.widgets.open = widget(self.raised, self.weak, self.strong);
        visuals.selection.bg_fill = self.mark.gamma_multiply(0.35);
        visuals.selection.stroke = Stroke::new(1.5, self.mark);
        visuals.weak_text_color = Some(self.weak);
        visuals.panel_fill = self.pane;
        visuals.window_fill = self.pane;
        visuals.faint_bg_color = self.raised;
        visuals.extreme_bg_color = self.ground;
        visuals.text_edit_bg_color = Some(self.ground);
        visuals.disabled_alpha = DISABLED;
        visuals.warn_fg_color = self.caution;
        visuals.error_fg_color = self.alarm;
        visuals.window_shadow = Shadow::NONE;
        visuals.popup_shadow = Shadow::NONE;
        visuals
    }
}

/// Gives the window its looks, in both themes.
pub fn apply(ctx: &egui::Context) {
    for (theme, palette, base) in
        [(Theme::Dark, Palette::DARK, Visuals::dark()), (Theme::Light, Palette::LIGHT, Visuals::light())]
    {
        ctx.style_mut_of(theme, |style: &mut Style| {
            style.visuals = palette.visuals(base.clone());
            style.text_styles = text_styles();
            style.spacing.item_spacing = Vec2::new(6.0, 4.0);
            style.spacing.button_padding = Vec2::new(8.0, 4.0);
            style.spacing.menu_margin = Margin::same(6);
            style.spacing.scroll = egui::style::ScrollStyle::solid();
            style.interaction.selectable_labels = false;
            // A picture that is honest at once: nothing glides from one value to the next.
            style.animation_time = 0.0;
        });
    }
}

fn text_styles() -> std::collections::BTreeMap<TextStyle, FontId> {
    let font = |size, family| FontId::new(size, family);
    [
        (TextStyle::Small, font(11.0, FontFamily::Proportional)),
        (TextStyle::Body, font(13.0, FontFamily::Proportional)),
        (TextStyle::Button, font(13.0, FontFamily::Proportional)),
        (TextStyle::Heading, font(17.0, FontFamily::Proportional)),
        (TextStyle::Monospace, font(12.0, FontFamily::Monospace)),
    ]
    .into()
}

/// Contrast of two colours, from 1 to 21, as WCAG 2 defines it.
pub fn contrast(a: Color32, b: Color32) -> f64 {
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

fn luminance(color: Color32) -> f64 {
    let [r, g, b] = linear(color);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Red, green and blue as they add up, 0 to 1.
fn linear(color: Color32) -> [f64; 3] {
    [color.r(), color.g(), color.b()].map(|value| {
        let value = f64::from(value) / 255.0;
        if value <= 0.04045 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contrast_is_as_the_recommendation_defines_it() {
        assert!((contrast(Color32::BLACK, Color32::WHITE) - 21.0).abs() < 1e-9);
        // The example that its techniques give for the least that passes on white.
        assert!((contrast(Color32::from_gray(0x76), Color32::WHITE) - 4.54).abs() < 0.01);
    }

    /// Linear red, green and blue as seen without red, green or blue cones (Machado, Oliveira and Fernandes, 2009,
    /// severity 1), and with all of them.
    const EYES: [[[f64; 3]; 3]; 4] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    ];
    /// Least distance of two hues in CIE L*a*b* (1976), where some 2 is just seen.
    const LEAST_APART: f64 = 15.0;

    /// L*, a* and b* of a colour as an eye sees it, under D65.
    fn lab(color: Color32, eye: &[[f64; 3]; 3]) -> [f64; 3] {
        let seen = linear(color);
        let product = |row: &[f64; 3]| row.iter().zip(seen).map(|(m, c)| m * c).sum::<f64>();
        let [r, g, b] = [product(&eye[0]), product(&eye[1]), product(&eye[2])].map(|c| c.clamp(0.0, 1.0));
        let f = |t: f64| if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
        let x = f((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.95047);
        let y = f(0.2126 * r + 0.7152 * g + 0.0722 * b);
        let z = f((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.08883);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// Hues differ from each other and from grey.
    #[test]
    fn hues_differ_for_every_kind_of_sight() {
        for p in [Palette::DARK, Palette::LIGHT] {
            let hues = [p.alarm, p.caution, p.advice, p.mark];
            let texts = [p.strong, p.text, p.weak];
            let pairs = (0..4).flat_map(|k| hues[..k].iter().chain(&texts).map(move |other| (hues[k], *other)));
            for (a, b) in pairs {
                for eye in &EYES {
                    let (a, b) = (lab(a, eye), lab(b, eye));
                    let distance = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
                    assert!(distance >= LEAST_APART, "{a:?} {b:?}: {distance:.1}");
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_pressed_can_still_be_read() {
        for p in [Palette::DARK, Palette::LIGHT] {
            for (text, surface) in [p.text, p.weak].into_iter().flat_map(|t| [p.pane, p.raised].map(|s| (t, s))) {
                let seen = surface.lerp_to_gamma(text, DISABLED);
                assert!(contrast(seen, surface) >= LEAST_CONTRAST, "{text:?} on {surface:?}");
            }
        }
    }

    #[test]
    fn the_page_has_the_windows_hues() {
        let page = include_str!("../page/page.css");
        for p in [Palette::DARK, Palette::LIGHT] {
            for (name, hue) in [("alarm", p.alarm), ("caution", p.caution), ("advice", p.advice), ("mark", p.mark)] {
                let text = format!("--{name}: #{:02x}{:02x}{:02x};", hue.r(), hue.g(), hue.b());
                assert!(page.contains(&text), "{text}");
            }
        }
    }

    #[test]
    fn every_text_is_readable_on_every_surface() {
        for p in [Palette::DARK, Palette::LIGHT] {
            let texts = [p.strong, p.text, p.weak, p.alarm, p.caution, p.advice, p.mark];
            for (text, surface) in texts.iter().flat_map(|t| [p.ground, p.pane, p.raised].map(|s| (*t, s))) {
                assert!(contrast(text, surface) >= LEAST_CONTRAST, "{text:?} on {surface:?}");
            }
            assert!([p.ground, p.pane, p.raised].iter().all(|s| contrast(p.edge, *s) >= LEAST_EDGE), "{:?}", p.edge);
            for block in [p.strong, p.alarm, p.caution, p.advice, p.mark] {
                assert!(contrast(p.on_block, block) >= LEAST_CONTRAST, "{block:?}");
            }
        }
    }
}
