//! All that stands outside of the data: numbers of the axes at the left and below, and a row with scale, legend and
//! buttons.

use eframe::egui::{
    Align2, Button, Color32, FontId, Painter, Pos2, Rect, RichText, Role, Sense, Shape as Drawn, Stroke, Ui, Vec2,
    WidgetInfo, pos2, vec2,
};

use super::camera::{View, fit};
use super::things::{AHEAD_S, fastest};
use super::{plan, words};
use crate::gui::marks::Shape;
use crate::gui::theme::Palette;
use crate::gui::view_state::ViewState;
use crate::shown::Shown;
use crate::site::Site;

/// Margins of the data within the pane, points: left and top, right and bottom.
const MARGINS: [Vec2; 2] = [vec2(46.0, 8.0), vec2(10.0, 54.0)];
/// Height of the row of buttons, points.
const FOOTER: f32 = 32.0;
/// Size of the text, points.
const SMALL: f32 = 13.0;
/// Width of a sample and its distance from its word, points.
const SAMPLE: [f32; 2] = [24.0, 6.0];
/// Distance of two entries, points.
const ENTRIES: f32 = 16.0;
/// Greatest length of the scale, points.
const BAR: f32 = 72.0;
/// Width of the row below which it says less, points.
const NARROW: f32 = 330.0;
/// Factors of the buttons that zoom.
const ZOOM: [f32; 2] = [0.8, 1.25];

/// The legend in words, for its tooltip and for screen readers.
pub(super) const WORDS: &str = "circles of what is LOST pale, to 10 m at most; symbols: the surer the larger and \
                                stronger; extents: the greatest of the class, in any direction; an object out of view \
                                has a cross and no label";

/// Area of the data in a pane.
pub(super) fn data(pane: Rect) -> Rect {
    let [before, after] = MARGINS;
    let inner = Rect::from_min_max(pane.min + before, pane.max - after);
    if inner.is_positive() { inner } else { Rect::from_center_size(pane.center(), Vec2::splat(1.0)) }
}

/// Numbers of the axes: metres east below, metres north at the left.
pub(super) fn axes(painter: &Painter, palette: &Palette, site: &Site, view: &View) {
    let (font, step, unit) = (FontId::proportional(SMALL), plan::step(view), words::axis_unit(site));
    let write = |at: Pos2, align: Align2, text: String| painter.text(at, align, text, font.clone(), palette.weak);
    let corner = view.rect.right_bottom() + vec2(0.0, 3.0);
    let east = write(corner, Align2::RIGHT_TOP, format!("{unit} east"));
    let north = write(view.rect.left_top() - vec2(6.0, 2.0), Align2::RIGHT_TOP, "north".to_owned());
    for x in plan::lines(view, 0, step) {
        let at = pos2(view.position([x as f32 * step, 0.0]).x, corner.y);
        if at.x > view.rect.left() + 8.0 && at.x < east.left() - 24.0 {
            write(at, Align2::CENTER_TOP, words::coordinate(site, x as f32 * step));
        }
    }
    for y in plan::lines(view, 1, step) {
        let at = pos2(view.rect.left() - 6.0, view.position([0.0, y as f32 * step]).y);
        if at.y > north.bottom() + 8.0 && at.y < view.rect.bottom() - 6.0 {
            write(at, Align2::RIGHT_CENTER, words::coordinate(site, y as f32 * step));
        }
    }
}

/// Sample of a sign.
#[derive(Clone, Copy)]
enum Sample {
    Line(f32),
    Dashes,
    Dots,
    Circle,
    Extent,
    North,
    Sign(Shape),
    /// Words alone.
    Note,
}

/// Draws the row below the data: scale and north, notes on labels left out, legend as far as there is room, buttons.
pub(super) fn footer(
    ui: &mut Ui,
    view_state: &mut ViewState,
    site: &Site,
    shown: &Shown,
    mut view: View,
    notes: &[String],
    contours: Option<f32>,
) {
    let palette = Palette::current(ui);
    let top = view.rect.bottom() + MARGINS[1].y - FOOTER;
    let row = Rect::from_min_max(pos2(view.rect.left(), top), pos2(view.rect.right(), top + FOOTER - 4.0));
    let end = buttons(ui, view_state, &mut view, row);
    let entries = entries(palette, site, shown, contours);
    let words: Vec<&str> = entries.iter().map(|(.., word)| word.as_str()).collect();
    let room = Rect::from_min_max(row.min, pos2(end, row.max.y));
    let tip = format!("{}; {WORDS}", words.join("; "));
    ui.interact(room, ui.scope_id().with("legend"), Sense::hover()).on_hover_text(tip);
    let painter = ui.painter_at(room);
    let mut at = pos2(scale(&painter, palette, site, &view, room), row.center().y);
    for (sample, color, word) in notes.iter().map(|note| (Sample::Note, palette.text, note.clone())).chain(entries) {
        let noted = matches!(sample, Sample::Note);
        let galley =
            painter.layout_no_wrap(word, FontId::proportional(SMALL), if noted { color } else { palette.weak });
        let sampled = if noted { 0.0 } else { SAMPLE[0] + SAMPLE[1] };
        let wide = sampled + galley.size().x;
        if at.x + wide <= end {
            paint_sample(&painter, sample, at, color);
            painter.galley(at + vec2(sampled, -galley.size().y / 2.0), galley, color);
            at.x += wide + ENTRIES;
        }
    }
}

/// Entries of the legend that apply, the most important first.
fn entries(palette: &Palette, site: &Site, shown: &Shown, contours: Option<f32>) -> Vec<(Sample, Color32, String)> {
    let fenced = site.fence.len() > 2;
    let all = [
        (true, Sample::Line(4.0), palette.text, "trail, 10 s thick".to_owned()),
        (true, Sample::North, palette.text, "north up".to_owned()),
        (fenced, Sample::Dashes, palette.text, "fence".to_owned()),
        (fenced, Sample::Dots, palette.text, "stops before".to_owned()),
        (!site.below.is_empty(), Sample::Dashes, palette.quiet, "ground track, computed".to_owned()),
        (!site.route.is_empty(), Sample::Line(1.4), palette.quiet, "route".to_owned()),
        (true, Sample::Circle, palette.text, format!("possible place, {}/s", words::distance(site, fastest(shown)))),
        (true, Sample::Sign(Shape::Cross), palette.weak, "out of view".to_owned()),
        (true, Sample::Extent, palette.trail, "extent at most".to_owned()),
        (true, Sample::Line(2.0), palette.strong, format!("ahead: {AHEAD_S:.0} s")),
        (contours.is_some(), Sample::Line(1.0), palette.line, format!("every {} m of height", contours.unwrap_or(0.0))),
    ];
    all.into_iter().filter(|(applies, ..)| *applies).map(|(_, sample, color, word)| (sample, color, word)).collect()
}

fn paint_sample(painter: &Painter, sample: Sample, left: Pos2, color: Color32) {
    let ends = [left, left + vec2(SAMPLE[0], 0.0)];
    let middle = ends[0].lerp(ends[1], 0.5);
    match sample {
        Sample::Line(width) => {
            painter.line_segment(ends, Stroke::new(width, color));
        }
        Sample::Dashes => painter.extend(Drawn::dashed_line(&ends, Stroke::new(2.0, color), 6.0, 3.0)),
        Sample::Dots => painter.extend(Drawn::dotted_line(&ends, color, 6.0, 1.2)),
        Sample::Circle => plan::dashed_circle(painter, middle, 9.0, Stroke::new(1.0, color)),
        Sample::Extent => {
            painter.circle(middle, 8.0, color.gamma_multiply(super::paint::EXTENT), Stroke::new(1.0, color));
        }
        Sample::North => painter.arrow(middle + vec2(0.0, 9.0), vec2(0.0, -18.0), Stroke::new(1.5, color)),
        Sample::Sign(shape) => shape.draw(painter, middle, 10.0, color),
        Sample::Note => {}
    }
}

/// The scale, where there is room for it; the place after it.
fn scale(painter: &Painter, palette: &Palette, site: &Site, view: &View, row: Rect) -> f32 {
    let step = plan::below(view, BAR);
    let (stroke, y) = (Stroke::new(2.0, palette.text), row.center().y);
    let ends = [pos2(row.left() + 1.0, y), pos2(row.left() + 1.0 + view.long(step), y)];
    let text = format!("{} {}", words::coordinate(site, step), words::axis_unit(site));
    let galley = painter.layout_no_wrap(text, FontId::proportional(SMALL), palette.text);
    let end = ends[1].x + 8.0 + galley.size().x;
    if end > row.right() {
        return row.left();
    }
    painter.line_segment(ends, stroke);
    for end in ends {
        painter.line_segment([end - vec2(0.0, 5.0), end + vec2(0.0, 5.0)], stroke);
    }
    painter.galley(ends[1] + vec2(8.0, -galley.size().y / 2.0), galley, palette.text);
    end + ENTRIES
}

/// Buttons: their text, their width, points, and their name for screen readers.
const BUTTONS: [(&str, f32, &str); 4] = [
    ("Follow", 72.0, "follow the chosen unit"),
    ("Fit", 32.0, "fit the map"),
    ("−", 26.0, "zoom out"),
    ("+", 26.0, "zoom in"),
];

/// The buttons at the right end of the row; where they begin.
fn buttons(ui: &mut Ui, view_state: &mut ViewState, view: &mut View, row: Rect) -> f32 {
    let narrow = if row.width() < NARROW { 18.0 } else { 0.0 };
    let begin = row.right() - BUTTONS.iter().map(|(_, wide, _)| wide + 4.0).sum::<f32>() + 4.0 + narrow;
    let mut x = begin;
    let on = view_state.follow;
    let palette = Palette::current(ui);
    for (at, (sign, wide, says)) in BUTTONS.into_iter().enumerate() {
        let follows = at == 0 && on;
        let wide = if at == 0 { wide - narrow } else { wide };
        let place = Rect::from_min_size(pos2(x, row.top()), vec2(wide, row.height()));
        let text = RichText::new(if follows && narrow == 0.0 { "Following" } else { sign }).size(SMALL);
        let text = if follows { text.color(palette.strong) } else { text };
        let edge = if follows { palette.strong } else { palette.edge };
        let button = ui.put(place, Button::new(text).stroke(Stroke::new(1.0, edge)));
        button.widget_info(|| match at {
            0 => WidgetInfo::selected(Role::Button, true, on, says),
            _ => WidgetInfo::labeled(Role::Button, true, says),
        });
        x += wide + 4.0;
        match (button.clicked(), at) {
            (true, 0) => view_state.follow = !on,
            (true, 1) => fit(view_state),
            (true, zooms) => {
                view.zoom(view.rect.center(), ZOOM[zooms - 2]);
                view_state.camera = Some(view.camera);
            }
            (false, _) => {}
        }
    }
    begin - ENTRIES
}
