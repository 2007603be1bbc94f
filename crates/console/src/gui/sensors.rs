//! Live sensor pictures of a unit, in its own window: for the tester, beside the operator's.
//!
//! They came over no link and no console accepted them, so they are in no window that can give orders, and report it.
//! Their source and the bound of their age are for their [`Sensors`] to state.

use eframe::egui::{self, CentralPanel, Context, Panel, RichText, Ui, vec2};
use eframe::{App, CreationContext, Frame, NativeOptions};
use wire::time::Span;

use super::app::{CURRENT, MOST_OFTEN};
use super::marks::{Shape, Tone};
use super::sidecar::{Textures, one};
use super::theme::{self, Palette};
use super::words::{left, seconds};
use crate::source::NoWindow;
use crate::source::{Sensed, Sensors};

/// Between two pictures, points.
const GAP: f32 = 8.0;
/// Most height of the caption below a picture.
const WORDS: f32 = 22.0;
/// Pictures in a row.
const COLUMNS: usize = 2;

/// The content of the window.
#[derive(Debug, Default)]
pub struct Content {
    textures: Textures,
}

impl Content {
    /// Draws the pictures.
    pub fn draw(&mut self, ui: &mut Ui, sensed: Option<&Sensed>, trouble: Option<&str>) {
        Panel::top("what this is").show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                let words = "TEST BENCH · read from the unit's own log, over no link · no operator sees this";
                ui.label(RichText::new(words).color(Palette::current(ui).advice));
                sensed.into_iter().for_each(|sensed| age(ui, sensed));
                trouble.into_iter().for_each(|trouble| flag(ui, Tone::Alarm, trouble));
            });
        });
        CentralPanel::default().show(ui, |ui| match sensed {
            Some(sensed) => self.pictures(ui, sensed),
            None => {
                ui.label(RichText::new("Waiting for the first frame.").size(15.0));
            }
        });
    }

    fn pictures(&mut self, ui: &mut Ui, sensed: &Sensed) {
        self.textures.take(ui, &sensed.sights);
        ui.spacing_mut().item_spacing = vec2(GAP, 2.0);
        let rows = sensed.sights.len().div_ceil(COLUMNS).max(1) as f32;
        let wide = (ui.available_width() - GAP * (COLUMNS - 1) as f32) / COLUMNS as f32;
        let high = ui.available_height() / rows - WORDS;
        let size = vec2(wide.max(40.0), high.max(40.0));
        let pairs: Vec<_> = sensed.sights.iter().zip(&self.textures.pictures).collect();
        for row in pairs.chunks(COLUMNS) {
            ui.horizontal_top(|ui| {
                for (sight, texture) in row {
                    ui.vertical(|ui| {
                        ui.set_width(size.x);
                        one(ui, size, sight, texture.as_ref());
                    });
                }
            });
        }
    }
}

/// Draws the age of the pictures; with a sign where the age is unknown, or too large for a current picture.
fn age(ui: &mut Ui, sensed: &Sensed) {
    match sensed.at_most {
        _ if sensed.at_least > CURRENT => flag(ui, Tone::Alarm, &not_current("at least", &left(sensed.at_least))),
        Some(age) if age > CURRENT => flag(ui, Tone::Alarm, &not_current("at most", &seconds(rounded(age)))),
        Some(age) => {
            ui.label(RichText::new(format!("at most {} old", seconds(rounded(age)))).color(Palette::current(ui).text));
        }
        None => flag(ui, Tone::Caution, "of unknown age"),
    }
}

fn not_current(bound: &str, age: &str) -> String {
    format!("NOT CURRENT: {bound} {age} old")
}

/// An age bound as written: rounded up, so that the text holds for as long as it is shown.
fn rounded(age: Span) -> Span {
    let due = age.0.saturating_add(MOST_OFTEN.as_micros() as u64);
    let step = if due < 10_000_000 { 10_000 } else { 100_000 };
    Span(due.div_ceil(step).saturating_mul(step))
}

fn flag(ui: &mut Ui, tone: Tone, words: &str) {
    let color = tone.color(Palette::current(ui));
    let (place, _) = ui.allocate_exact_size(vec2(16.0, 16.0), egui::Sense::hover());
    Shape::Cross.draw(ui.painter(), place.center(), 12.0, color);
    ui.label(RichText::new(words).color(color));
}

/// Opens the window and returns when it was closed, or when the stream has ended.
///
/// # Errors
///
/// When it cannot be opened.
pub fn run(sensors: Box<dyn Sensors>) -> Result<(), NoWindow> {
    let title = "holdsafe sensors: TEST BENCH";
    let viewport = egui::ViewportBuilder::default()
        .with_title(title)
        .with_app_id("holdsafe-sensors")
        .with_inner_size([760.0, 640.0])
        .with_min_inner_size([480.0, 400.0]);
    let options = NativeOptions { viewport, renderer: eframe::Renderer::Glow, ..NativeOptions::default() };
    let make = move |context: &CreationContext<'_>| -> Result<Box<dyn App>, _> {
        theme::apply(&context.egui_ctx);
        Ok(Box::new(Program { content: Content::default(), sensors }))
    };
    eframe::run_native(title, options, Box::new(make)).map_err(|error| NoWindow::Refused(error.to_string()))
}

struct Program {
    content: Content,
    sensors: Box<dyn Sensors>,
}

impl App for Program {
    fn logic(&mut self, ctx: &Context, _: &mut Frame) {
        if self.sensors.is_ended() {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        ctx.request_repaint_after(MOST_OFTEN);
    }

    fn ui(&mut self, ui: &mut Ui, _: &mut Frame) {
        let (sensed, trouble) = (self.sensors.newest(), self.sensors.trouble());
        self.content.draw(ui, sensed.as_ref(), trouble.as_deref());
    }
}
