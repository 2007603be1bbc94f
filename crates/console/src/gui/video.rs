//! Images of the tracks of the chosen unit: each of the four sensors with what it found, what supports the track and
//! what contradicts it.
//!
//! The images came over the link and the unit vouches for them, unlike the pictures of `sidecar`.

use eframe::egui::{Align2, FontId, Rect, RichText, Role, ScrollArea, Sense, Ui, WidgetInfo, vec2};
use wire::report::ReportedTrack;
use wire::sensor::Modality;

use super::marks::{self, Shape, Tone};
use super::sidecar::labelled;
use super::theme::{BODY, Palette};
use super::view_state::ViewState;
use super::words::at_most;
use crate::age::Labelled;
use crate::shown::{Shown, ShownUnit};
use crate::wording;

/// Between two images, points.
const GAP: f32 = 8.0;
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
    let columns = if ui.available_width() > 560.0 { 4 } else { 2 };
    let wide = (ui.available_width() - GAP * (columns as f32 - 1.0)) / columns as f32;
    let rows = of.sights.len().div_ceil(columns).max(1);
    let high = ((ui.available_height() / rows as f32) - WORDS - GAP).clamp(48.0, wide * 0.8);
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        for (first, row) in of.sights.chunks(columns).enumerate() {
            ui.horizontal_top(|ui| {
                ui.spacing_mut().item_spacing.x = GAP;
                for (at, sight) in row.iter().enumerate() {
                    let texture = view_state.video.pictures.get(first * columns + at).and_then(Option::as_ref);
                    let text = format!("IMAGE of track {} {} {}", of.track.0, sight.name, sight.legend);
                    ui.vertical(|ui| {
                        ui.set_width(wide);
                        labelled(ui, vec2(wide, high), sight, texture, text);
                        let place = Modality::ALL.get(first * columns + at).copied();
                        caption(ui, unit, track, place, &sight.name, wide);
                    });
                }
            });
        }
    });
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

/// What the track is, and how old its images are.
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
    ui.horizontal(|ui| {
        ui.label(RichText::new(words).strong());
        ui.weak(format!("images {age}"));
    });
}

/// Whether the sensor supports or contradicts the track.
fn caption(
    ui: &mut Ui,
    unit: &ShownUnit,
    track: Option<&Labelled<ReportedTrack>>,
    place: Option<Modality>,
    name: &str,
    wide: f32,
) {
    let palette = Palette::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(wide, WORDS - 6.0), Sense::hover());
    let title = place.map_or(name, |place| wording::sensor(unit.state.get().0.suite(), place));
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
