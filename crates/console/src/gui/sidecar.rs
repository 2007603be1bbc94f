//! Evidence panel of a recording, above its bar: sensor pictures and reasons for the mode. It is labelled as evidence,
//! and exists in a replay only.

use std::sync::Arc;

use eframe::egui::{
    Color32, ColorImage, FontId, Label, Rect, RichText, Role, ScrollArea, Sense, Stroke, StrokeKind, TextureHandle,
    TextureOptions, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use wire::time::Span;

use super::marks::{Shape, Tone};
use super::theme::{Palette, SMALL};
use super::words::seconds;
use crate::sidecar::{Image, Sidecar, Sight};

/// Height of a picture, points.
const HIGH: f32 = 150.0;
/// Between two of them.
const GAP: f32 = 8.0;
/// Share of the width that the reasons take beside pictures.
const REASONS: f32 = 0.42;

/// The pictures that are drawn, as the graphics card has them.
#[derive(Default)]
pub(super) struct Textures {
    of: Option<Arc<[Sight]>>,
    /// Sight by sight.
    pub(super) pictures: Vec<Option<TextureHandle>>,
}

impl std::fmt::Debug for Textures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Textures").field("pictures", &self.pictures.len()).finish_non_exhaustive()
    }
}

impl Textures {
    /// Has the card take over `sights`, where they are others than it has.
    pub(super) fn take(&mut self, ui: &Ui, sights: &Arc<[Sight]>) {
        if self.of.as_ref().is_some_and(|known| Arc::ptr_eq(known, sights)) {
            return;
        }
        let largest = ui.input(|input| input.max_texture_side);
        let load = |sight: &Sight| {
            let image = picture(sight.image.as_ref()?, largest)?;
            Some(ui.ctx().load_texture(sight.name, image, TextureOptions::NEAREST))
        };
        self.pictures = sights.iter().map(load).collect();
        self.of = Some(Arc::clone(sights));
    }
}

/// The image for egui; `None` if the bytes do not match its size, or a side exceeds the graphics card's limit.
fn picture(image: &Image, largest: usize) -> Option<ColorImage> {
    let bytes = image.width.checked_mul(image.height)?.checked_mul(3)?;
    let fits = image.width.max(image.height) <= largest;
    (fits && bytes > 0 && bytes == image.rgb.len())
        .then(|| ColorImage::from_rgb([image.width, image.height], &image.rgb))
}

/// All that there is, side by side.
pub(super) fn draw(ui: &mut Ui, textures: &mut Textures, sidecar: &Sidecar) {
    ui.label(RichText::new("EVIDENCE · no operator saw this").color(Palette::current(ui).advice));
    ui.horizontal_top(|ui| {
        let whole = ui.available_width();
        if let Some((sights, before)) = &sidecar.sensed {
            let share = if sidecar.because.is_some() { 1.0 - REASONS } else { 1.0 };
            ui.vertical(|ui| {
                ui.set_width(whole * share - GAP);
                sensors(ui, textures, sights, *before);
            });
        }
        if let Some(text) = &sidecar.because {
            ui.vertical(|ui| reasons(ui, text));
        }
    });
}

/// Reasons for the mode.
fn reasons(ui: &mut Ui, text: &str) {
    ui.label(RichText::new("WHY, by what the services logged").color(Palette::current(ui).text));
    ScrollArea::vertical().id_salt("reasons").max_height(HIGH + 16.0).auto_shrink([false, true]).show(ui, |ui| {
        for line in text.lines() {
            ui.add(Label::new(RichText::new(line).monospace().size(SMALL).color(Palette::current(ui).text)).wrap());
        }
    });
}

/// The pictures beside each other.
fn sensors(ui: &mut Ui, textures: &mut Textures, sights: &Arc<[Sight]>, before: Span) {
    textures.take(ui, sights);
    let text = format!("WHAT THE SENSORS GAVE, {} before", seconds(before));
    ui.label(RichText::new(text).color(Palette::current(ui).text));
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = GAP;
        let n = sights.len().max(1) as f32;
        let wide = ((ui.available_width() - GAP * (n - 1.0)) / n).max(40.0);
        for (sight, texture) in sights.iter().zip(&textures.pictures) {
            ui.vertical(|ui| one(ui, vec2(wide, HIGH), sight, texture.as_ref()));
        }
    });
}

/// A sensor's picture, as large as fits into `size`, with its caption below.
pub(super) fn one(ui: &mut Ui, size: Vec2, sight: &Sight, texture: Option<&TextureHandle>) {
    let found = if texture.is_some() { format!("{} found", sight.marks.len()) } else { "gave nothing".to_owned() };
    labelled(ui, size, sight, texture, format!("SENSOR {} {found}", sight.name));
    let words = format!("{} · {}", sight.name, sight.legend);
    ui.add(Label::new(RichText::new(words).small().color(Palette::current(ui).text)).truncate());
}

/// The picture alone, under its name for those who hear the screen.
pub(super) fn labelled(ui: &mut Ui, size: Vec2, sight: &Sight, texture: Option<&TextureHandle>, text: String) {
    let palette = Palette::current(ui);
    let (place, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, text.clone()));
    ui.painter().rect_filled(place, 0.0, palette.ground);
    match (texture, &sight.image) {
        (Some(texture), Some(image)) => {
            let size = vec2(image.width as f32, image.height as f32);
            let scale = (place.width() / size.x).min(place.height() / size.y);
            let rect = Rect::from_center_size(place.center(), size * scale);
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            ui.painter().image(texture.id(), rect, whole, Color32::WHITE);
            marks(ui, sight, rect, scale);
        }
        _ => {
            Shape::Cross.draw(ui.painter(), place.center() - Vec2::new(0.0, 10.0), 16.0, Tone::Alarm.color(palette));
            let font = FontId::proportional(SMALL);
            let position = place.center() + Vec2::new(0.0, 12.0);
            ui.painter().text(position, eframe::egui::Align2::CENTER_CENTER, "gave nothing", font, palette.alarm);
        }
    }
}

/// Each thing found, with its words where there is room on their own ground.
fn marks(ui: &Ui, sight: &Sight, rect: Rect, scale: f32) {
    let painter = ui.painter_at(rect);
    for mark in &sight.marks {
        let [left, upper, right, lower] = mark.edges;
        let bounds = Rect::from_min_max(rect.min + vec2(left, upper) * scale, rect.min + vec2(right, lower) * scale);
        painter.rect_stroke(bounds, 0.0, Stroke::new(2.5, Color32::BLACK), StrokeKind::Outside);
        painter.rect_stroke(bounds, 0.0, Stroke::new(1.0, Color32::WHITE), StrokeKind::Outside);
        let galley = painter.layout_no_wrap(mark.says.clone(), FontId::proportional(SMALL), Color32::WHITE);
        let most = rect.max - galley.size();
        let place = pos2(
            bounds.min.x.clamp(rect.min.x, most.x.max(rect.min.x)),
            (bounds.min.y - galley.size().y - 2.0).max(rect.min.y),
        );
        painter.rect_filled(Rect::from_min_size(place, galley.size()).expand(1.0), 0.0, Color32::BLACK);
        painter.galley(place, galley, Color32::WHITE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image is not drawn if its bytes do not match its size, or if no graphics card takes that size.
    #[test]
    fn mismatched_or_oversized_image_is_not_drawn() {
        let texture = |width, height, bytes| picture(&Image { width, height, rgb: vec![7; bytes] }, 2_048).is_some();
        assert!(texture(4, 2, 24) && texture(2_048, 1, 6_144));
        assert!(![texture(4, 2, 23), texture(0, 2, 0), texture(usize::MAX, 2, 6), texture(4, 2, 25)].contains(&true));
        assert!(![texture(65_535, 1, 196_605), texture(1, 2_049, 6_147)].contains(&true));
    }
}
