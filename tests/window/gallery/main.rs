//! Draws the scenes of the tests in a real window: one for a look, or all of them into images (`docs/operator/console/draw`).
//!
//! `gallery SCENE` opens a window in which the scene goes on and obeys, `gallery SCENE SECONDS` measures it that long, and
//! `gallery DIRECTORY WIDTH HEIGHT SCENE…` writes an image of each. `SCENE` may end in `+replay`, `+behind`, `+light`,
//! `+examine`, `+map`. A scene is a real console's picture: its reports are signed and went through its boundary.

#![expect(clippy::wildcard_enum_match_arm, reason = "the bench picks out the events that it looks at")]
#![expect(clippy::unwrap_used, reason = "a gallery that cannot be drawn is to end with the reason")]

#[expect(dead_code, reason = "the tests use the rest of it")]
#[path = "../../../crates/console/tests/console/bench.rs"]
mod bench;
mod living;
#[path = "../scenes.rs"]
mod scenes;
#[path = "../yard.rs"]
mod yard;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use console::gui::layout::Preset;
use console::gui::{ConsoleWindow, Picture, theme};
use console::shown::Shown;
use console::source::Tape;
use eframe::egui::{self, ColorImage, Theme, Ui, ViewportCommand};
use wire::id::UnitId;
use wire::time::Span;

use crate::living::Living;
use crate::yard::Yard;

/// Frames that a scene's last picture is drawn before its image is taken: text and layout settle within three.
const SETTLED: usize = 6;

/// One scene, and how it is drawn.
struct Take {
    name: String,
    yard: Yard,
    /// Pictures drawn before, so that the ages have a past, and last of all the picture.
    film: Vec<Shown>,
    tape: Option<Tape>,
    behind: Option<Span>,
}

impl Take {
    /// Take of a scene's name, with `+replay` or `+behind` and words for the looks.
    fn new(name: &str) -> Self {
        let scene = name.split('+').next().unwrap_or_default();
        let make = scenes::SCENES.iter().chain(&scenes::LONG).find(|(text, _)| *text == scene).map(|(_, make)| make);
        let yard = make.unwrap_or_else(|| panic!("no scene `{scene}`"))();
        let mut film = yard.film.clone();
        let mut tape = None;
        if name.contains("+replay") {
            let (shown, of) = scenes::replayed(yard.shown());
            film.push(shown);
            tape = Some(of);
        }
        let behind = name.contains("+behind").then_some(Span::ms(3_400));
        Self { name: name.to_owned(), yard, film, tape, behind }
    }

    /// A window with the looks that the name asks for.
    fn window(&self, ui: &Ui) -> ConsoleWindow {
        ui.ctx().set_theme(if self.name.contains("+light") { Theme::Light } else { Theme::Dark });
        let preset = Preset::ALL.into_iter().find(|p| self.name.contains(&format!("+{}", p.name().to_lowercase())));
        let orbits = self.yard.shown().units.iter().any(|unit| unit.state.get().0.contact.is_some());
        let site = if orbits { yard::region() } else { yard::site() };
        let mut window = ConsoleWindow::new(UnitId::A, site);
        window.layouts_mut().start_from(preset.unwrap_or(Preset::Operate));
        window
    }
}

fn main() -> Result<(), eframe::Error> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (folder, size, names) = match args.as_slice() {
        [folder, width, height, names @ ..] => {
            (Some(PathBuf::from(folder)), [width.parse().unwrap(), height.parse().unwrap()], names.to_vec())
        }
        names => (None, [1440.0, 860.0], names.to_vec()),
    };
    let viewport = egui::ViewportBuilder::default().with_inner_size(size).with_position([0.0, 0.0]);
    let viewport = viewport.with_decorations(folder.is_none());
    let options = eframe::NativeOptions { viewport, renderer: eframe::Renderer::Glow, ..Default::default() };
    let make = move |context: &eframe::CreationContext<'_>| -> Result<Box<dyn eframe::App>, _> {
        theme::apply(&context.egui_ctx);
        Ok(match folder {
            Some(folder) => Box::new(Gallery { names, folder, on: None, images: channel() }),
            None => Box::new(Living::new(Take::new(&names[0]), names.get(1).map(|seconds| seconds.parse().unwrap()))),
        })
    };
    eframe::run_native("holdsafe gallery", options, Box::new(make))
}

/// Scenes that are drawn into images, one after the other.
struct Gallery {
    names: Vec<String>,
    folder: PathBuf,
    on: Option<(Take, ConsoleWindow, usize)>,
    images: (Sender<Arc<ColorImage>>, Receiver<Arc<ColorImage>>),
}

impl eframe::App for Gallery {
    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        if let (Ok(image), Some((take, ..))) = (self.images.1.try_recv(), &self.on) {
            write(&self.folder.join(format!("{}.ppm", take.name)), &image);
            self.on = None;
        }
        if self.on.is_none() {
            if self.names.is_empty() {
                ui.ctx().send_viewport_cmd(ViewportCommand::Close);
                return;
            }
            let take = Take::new(&self.names.remove(0));
            let window = take.window(ui);
            self.on = Some((take, window, 0));
        }
        let Some((take, window, frame)) = &mut self.on else { return };
        let shown = take.film.get(*frame).or(take.film.last()).unwrap();
        window
            .draw(ui, &Picture { shown, behind: take.behind, untaken: false, tape: take.tape.as_ref(), sidecar: None });
        *frame += 1;
        if *frame == take.film.len() + SETTLED {
            let (images, ctx) = (self.images.0.clone(), ui.ctx().clone());
            ui.ctx().request_screenshot(move |image| {
                images.send(image).unwrap();
                ctx.request_repaint();
            });
        }
        ui.ctx().request_repaint();
    }
}

/// As a portable pixmap, which needs no library.
fn write(path: &Path, image: &ColorImage) {
    let mut bytes = format!("P6 {} {} 255\n", image.size[0], image.size[1]).into_bytes();
    bytes.extend(image.pixels.iter().flat_map(|pixel| [pixel.r(), pixel.g(), pixel.b()]));
    std::fs::write(path, bytes).unwrap();
}
