//! Images of the tracks of the chosen unit: each of the four sensors with its detections, and
//! whether it supports the track or contradicts it.
//!
//! The images came over the link and the unit vouches for them, unlike the pictures of `sidecar`.

use eframe::egui::{
    Align2, FontId, Rect, RichText, Role, ScrollArea, Sense, Stroke, StrokeKind, TextureHandle, Ui, Vec2, WidgetInfo,
    vec2,
};
use wire::id::TrackId;
use wire::report::ReportedTrack;
use wire::sensor::Modality;

use super::marks::{self, Shape, Tone};
use super::sidecar::labelled;
use super::theme::{BODY, Palette, SMALL};
use super::view_state::ViewState;
use super::words::at_most;
use crate::age::Labelled;
use crate::images::Images;
use crate::shown::{Shown, ShownUnit};
use crate::wording;

/// Between two images, points.
const GAP: f32 = 8.0;
/// Metres that the view from above is high.
const RANGE: f32 = 45.0;
/// Height of the words below an image.
const WORDS: f32 = 44.0;

/// Draws the images of the chosen track, or of the one with the newest images.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown) {
    let Some(unit) = shown.unit(view_state.unit) else {
        ui.label(format!("Nothing was received of {}.", view_state.unit));
        return;
    };
    choice(ui, view_state, unit);
    let wanted = view_state.track.filter(|(owner, _)| *owner == unit.unit).map(|(_, track)| track);
    let youngest = || unit.images.iter().min_by_key(|images| (images.age(), images.get().0.track.0));
    let images = match wanted {
        Some(track) => unit.images.iter().find(|images| images.get().0.track == track),
        None => youngest(),
    };
    let Some(images) = images else {
        let of = wanted.map_or("any track".to_owned(), |track| format!("track {}", track.0));
        ui.weak(format!("No image of {of} has come. A unit sends crops of the track that it looks at."));
        return;
    };
    let of = images.get().0;
    let track = unit.tracks.iter().find(|track| track.get().0.id == of.track);
    head(ui, unit, track, of.track.0, &at_most(images.age()));
    view_state.video.take(ui, &of.sights);
    let cells = of.sights.len() + 1;
    let room = ui.available_width() - ui.spacing().scroll.allocated_width();
    let columns = if room > 560.0 { 4 } else { 2 };
    let wide = (room - GAP * (columns as f32 - 1.0)) / columns as f32;
    let rows = cells.div_ceil(columns);
    let high = ((ui.available_height() / rows as f32) - WORDS - GAP).clamp(48.0, wide * 0.8);
    let textures = &view_state.video.pictures;
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        for row in 0..rows {
            ui.horizontal_top(|ui| {
                ui.spacing_mut().item_spacing.x = GAP;
                for at in row * columns..((row + 1) * columns).min(cells) {
                    ui.vertical(|ui| {
                        ui.set_width(wide);
                        cell(ui, unit, (track, of), textures.get(at).and_then(Option::as_ref), (at, vec2(wide, high)));
                    });
                }
            });
        }
    });
}

/// One sensor: its image, or for the one without images its view from above.
fn cell(
    ui: &mut Ui,
    unit: &ShownUnit,
    (track, of): (Option<&Labelled<ReportedTrack>>, &Images),
    texture: Option<&TextureHandle>,
    (at, size): (usize, Vec2),
) {
    match of.sights.get(at) {
        Some(sight) => {
            let text = format!("IMAGE of track {} {} {}", of.track.0, sight.name, sight.legend);
            labelled(ui, size, sight, texture, text);
        }
        None => above(ui, unit, of.track, size),
    }
    let place = Modality::ALL.get(at).copied();
    caption(ui, unit, track, place, size.x);
}

/// The tracks around the unit as seen from above, its nose up, with rings of distance; the chosen one is framed.
fn above(ui: &mut Ui, unit: &ShownUnit, chosen: TrackId, size: Vec2) {
    let palette = Palette::current(ui);
    let (place, response) = ui.allocate_exact_size(size, Sense::hover());
    let painter = ui.painter_at(place);
    painter.rect_filled(place, 0.0, palette.ground);
    let (own, scale) = (place.center() + vec2(0.0, place.height() * 0.3), place.height() / RANGE);
    for ring in [10.0, 20.0, 30.0] {
        painter.circle_stroke(own, ring * scale, Stroke::new(1.0, palette.line));
        let label = own - vec2(0.0, ring * scale);
        painter.text(label, Align2::CENTER_CENTER, format!("{ring:.0} m"), FontId::proportional(SMALL), palette.weak);
    }
    Shape::Triangle.draw(&painter, own, 10.0, palette.strong);
    let pose = unit.pose.get().0;
    let (sin, cos) = libm::sincosf(f32::from(pose.yaw_mrad) / 1000.0);
    let mut named = Vec::new();
    for track in unit.tracks.iter().map(|track| track.get().0) {
        let [east, north] = [(track.x_mm - pose.x_mm) as f32 / 1000.0, (track.y_mm - pose.y_mm) as f32 / 1000.0];
        let (ahead, left) = (east * cos + north * sin, north * cos - east * sin);
        let at = own + vec2(-left, -ahead) * scale;
        let backed = track.supported.contains(Modality::Lidar);
        let shape = if backed { Shape::Square } else { Shape::Ring };
        shape.draw(&painter, at, 9.0, if backed { palette.text } else { palette.quiet });
        if track.id == chosen {
            let frame = Rect::from_center_size(at, vec2(18.0, 18.0));
            painter.rect_stroke(frame, 0.0, Stroke::new(1.5, palette.mark), StrokeKind::Middle);
            named.push(format!("track {} {:.0} m away", track.id.0, libm::hypotf(east, north)));
        }
    }
    let text = format!("LIDAR view from above: {}", named.join(""));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &text));
}

/// The tracks that have images, to choose from.
fn choice(ui: &mut Ui, view_state: &mut ViewState, unit: &ShownUnit) {
    if unit.images.is_empty() {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        for images in &unit.images {
            let id = images.get().0.track;
            let chosen = view_state.track == Some((unit.unit, id));
            if ui.selectable_label(chosen, format!("track {}", id.0)).clicked() {
                view_state.look_at(unit.unit, id);
            }
        }
    });
}

/// The track, and the age of its images.
fn head(ui: &mut Ui, unit: &ShownUnit, track: Option<&Labelled<ReportedTrack>>, id: u32, age: &str) {
    let words = match track {
        Some(track) => {
            let track = track.get().0;
            let against = if track.contradicted.count() > 0 { ", CONTRADICTED" } else { "" };
            format!(
                "Track {id} · {} · confidence {:.2}{against}",
                track.class.name(),
                f64::from(track.confidence) / 1000.0
            )
        }
        None => format!("Track {id} · {} no longer reports it", unit.unit),
    };
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(words).strong());
        ui.weak(format!("images {age}"));
    });
}

/// Whether the sensor supports or contradicts the track.
fn caption(ui: &mut Ui, unit: &ShownUnit, track: Option<&Labelled<ReportedTrack>>, place: Option<Modality>, wide: f32) {
    let palette = Palette::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(wide, WORDS - 6.0), Sense::hover());
    let title = place.map_or("", |place| wording::sensor(unit.state.get().0.suite(), place));
    let verdict = track.zip(place).map(|(track, place)| {
        let track = track.get().0;
        match (track.contradicted.contains(place), track.supported.contains(place)) {
            (true, _) => (Tone::Caution, Shape::Diamond, "contradicts it"),
            (false, true) => (Tone::Normal, Shape::Disc, "supports it"),
            (false, false) => (Tone::Weak, Shape::Ring, "says nothing of it"),
        }
    });
    let row = |at: f32| Rect::from_min_size(rect.min + vec2(0.0, at), vec2(wide, 18.0));
    marks::text_in(ui.painter(), row(0.0), Align2::LEFT_CENTER, title, FontId::proportional(BODY), palette.text);
    if let Some((tone, shape, words)) = verdict {
        let color = if tone > Tone::Normal { tone.color(palette) } else { palette.text };
        shape.draw(ui.painter(), row(19.0).left_center() + vec2(7.0, 0.0), 10.0, color);
        let place = row(19.0).translate(vec2(18.0, 0.0));
        marks::text_in(ui.painter(), place, Align2::LEFT_CENTER, words, FontId::proportional(BODY), color);
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{title} {words}")));
    }
}
