//! Draws the scenes of the tests in a real window: one for a look, or all of them into images (`docs/operator/console/draw`).
//!
//! `gallery SCENE` opens a window in which the scene goes on and obeys, `gallery SCENE SECONDS` measures it that long, and
//! `gallery DIRECTORY WIDTH HEIGHT SCENE…` writes an image of each. `SCENE` may end in `+replay`, `+behind`, `+light`,
//! `+examine`, `+map`, `+air`, `+orbit`. A scene is a real console's picture: its reports are signed and went through its boundary.
//! In place of a scene `NAME=RUN@SECONDS` is a kept run at that time of its recording, as its operator saw it then;
//! with `+replay` as a recording, and with `+beside=RUN2` beside another one.

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
use console::process::player::Player;
use console::process::replay::name_of;
use console::shown::Shown;
use console::site::Site;
use console::source::{Beside, Tape};
use eframe::egui::{self, ColorImage, Theme, Ui, ViewportCommand};
use wire::id::UnitId;
use wire::time::Span;

use crate::living::Living;
use crate::yard::{Domain, Yard};

/// Frames that a scene's last picture is drawn before its image is taken: text and layout settle within three.
const SETTLED: usize = 6;

/// One scene, and how it is drawn.
struct Take {
    name: String,
    /// Words for the looks, each behind a plus.
    looks: String,
    yard: Yard,
    /// Pictures drawn before, so that the ages have a past, and last of all the picture.
    film: Vec<Shown>,
    tape: Option<Tape>,
    behind: Option<Span>,
    site: Site,
    beside: Option<Beside>,
}

/// A kept run at a time of its recording.
fn recorded(run: &str, seconds: f64) -> (Player, Site) {
    let (mut player, config) = Player::open(Path::new(run)).unwrap_or_else(|why| panic!("{run}: {why}"));
    player.seek(Span((seconds * 1e6) as u64));
    (player, config.window.unwrap_or_default())
}

impl Take {
    /// Take of a scene or a run, with words for the looks.
    fn new(name: &str) -> Self {
        match name.split_once('=').filter(|(name, _)| !name.contains('+')) {
            Some((name, run)) => Self::of_run(name, run),
            None => Self::of_scene(name),
        }
    }

    /// Take of `RUN@SECONDS`.
    fn of_run(name: &str, of: &str) -> Self {
        let mut words = of.split('+');
        let (run, seconds) = words.next().and_then(|run| run.split_once('@')).expect("RUN@SECONDS");
        let seconds = seconds.parse().expect("seconds");
        let (player, site) = recorded(run, seconds);
        let looks: Vec<&str> = words.collect();
        let mut shown = player.shown();
        let replay = looks.contains(&"replay");
        shown.marks.replay = replay;
        let tape = Tape {
            at: player.position(),
            length: player.length(),
            lead: player.lead(),
            moments: player.moments().to_vec(),
            playing: false,
        };
        let beside = looks.iter().find_map(|word| word.strip_prefix("beside=")).map(|other| {
            let (player, site) = recorded(other, seconds);
            Beside {
                own: name_of(Path::new(run)),
                name: name_of(Path::new(other)),
                shown: player.shown().into(),
                site: site.into(),
            }
        });
        let looks: String = looks.iter().map(|word| format!("+{word}")).collect();
        let (film, tape) = (vec![shown], replay.then_some(tape));
        let (name, looks) = (name.to_owned(), looks);
        Self { name, looks, yard: scenes::nominal(), film, tape, behind: None, site, beside }
    }

    /// Take of a scene's name, with `+replay` or `+behind` and words for the looks.
    fn of_scene(name: &str) -> Self {
        let scene = name.split('+').next().unwrap_or_default();
        let domains = [("+air", Domain::Air), ("+orbit", Domain::Orbit)];
        let domain = domains.into_iter().find(|(word, _)| name.contains(word)).map_or(Domain::Ground, |(_, of)| of);
        yard::set_domain(domain);
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
        let orbits = yard.shown().units.iter().any(|unit| unit.state.get().0.contact.is_some());
        let site = if orbits { yard::region() } else { yard::site() };
        let looks = name.to_owned();
        Self { name: name.to_owned(), looks, yard, film, tape, behind, site, beside: None }
    }

    /// A window with the looks that the name asks for.
    fn window(&self, ui: &Ui) -> ConsoleWindow {
        ui.ctx().set_theme(if self.looks.contains("+light") { Theme::Light } else { Theme::Dark });
        let preset = Preset::ALL.into_iter().find(|p| self.looks.contains(&format!("+{}", p.name().to_lowercase())));
        let mut window = ConsoleWindow::new(UnitId::A, self.site.clone());
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
        let (tape, beside) = (take.tape.as_ref(), take.beside.as_ref());
        window.draw(ui, &Picture { shown, behind: take.behind, untaken: false, tape, sidecar: None, beside });
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
