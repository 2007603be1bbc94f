//! Images of the track that an order rests on, beside its interlocks and above its button. They came over the link and
//! the unit vouches for them, unlike the pictures of `sidecar`.

use eframe::egui::{RichText, Ui, vec2};
use wire::person::Order;

use super::sidecar::{Textures, labelled};
use super::words::seconds;
use crate::shown::Shown;

/// Height of an image, points.
const HIGH: f32 = 68.0;
/// Between two of them.
const GAP: f32 = 4.0;

/// Images of the track that `order` rests on, if it rests on one.
pub(super) fn draw(ui: &mut Ui, textures: &mut Textures, shown: &Shown, order: &Order) {
    let Order::Command(unit, kind) = *order else { return };
    let Some(track) = kind.rests_on_display() else { return };
    let images = shown.unit(unit).and_then(|unit| unit.images.iter().find(|images| images.get().0.track == track));
    let Some(images) = images else {
        ui.label(RichText::new(format!("No recent image of track {}.", track.0)).weak().small());
        return;
    };
    let of = images.get().0;
    textures.take(ui, &of.sights);
    ui.small(format!("TRACK {} as the cameras saw it, {} before", track.0, seconds(images.age())));
    ui.horizontal_top(|ui| {
        ui.spacing_mut().item_spacing.x = GAP;
        let wide = (ui.available_width() / of.sights.len().max(1) as f32 - GAP).max(40.0);
        for (sight, texture) in of.sights.iter().zip(&textures.pictures) {
            let text = format!("TRACK {} {} {}", track.0, sight.name, sight.legend);
            ui.vertical(|ui| {
                ui.set_width(wide);
                labelled(ui, vec2(wide, HIGH), sight, texture.as_ref(), text);
                ui.small(format!("{} {}", sight.name, sight.legend));
            });
        }
    });
}
