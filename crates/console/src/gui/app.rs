//! The window as a program: takes the newest picture, draws it, sends the person's acts. Between it and the console's
//! core stands a [`Source`], so that a live core and a recording are drawn by the same code.
//!
//! A picture is drawn when it comes, at most [`MOST_OFTEN`]; without a new one the window still draws a few times a
//! second with ages increased, and reports it once the last is too old to be called current.

use std::io::Read;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use eframe::egui::{self, Context, Ui};
use eframe::{App, CreationContext, Frame, NativeOptions};
use link::clock::trace_us;
use wire::time::Span;

use super::bell::Bell;
use super::layout::{Layouts, MAX_SAVED};
use super::{ConsoleWindow, Picture, Wish, theme};
use crate::shown::Shown;
use crate::source::NoWindow;
use crate::source::{Looks, Source, Wake};

/// Least time between two pictures drawn because one came.
pub const MOST_OFTEN: Duration = Duration::from_millis(100);
/// The window is drawn again after this time at the latest.
pub const AT_LEAST: Duration = Duration::from_millis(250);
/// Redraw period of a paused recording: a request to close may be waiting.
const STANDING: Duration = Duration::from_secs(1);
/// The window's least size, points: the banner and the units have room in it.
const LEAST: [f32; 2] = [1024.0, 700.0];
/// Width of a window from which on it starts larger than drawn, and by how much: 15 points are then 20 minutes of arc
/// at 60 cm and 96 dots an inch (NUREG-0700, 1.3.1-4, prefers 20 to 22).
const LARGE: f32 = 1900.0;
const LARGER: f32 = 1.1;
/// Display time of the notice that an act was not taken, seconds.
const UNTAKEN_FOR: f64 = 10.0;
/// Layouts are kept so often, where they have changed, seconds.
const KEPT_EVERY: f64 = 1.0;
/// A picture with none after it for so long is not current. A live core gives several a second.
pub const CURRENT: Span = Span::s(1);

/// Opens the window and returns when it was closed. `start` gets the way to wake it up.
///
/// # Errors
/// When it cannot be opened.
pub fn run(looks: Looks, source: Box<dyn Source>, start: impl FnOnce(Wake) + 'static) -> Result<(), NoWindow> {
    let viewport = egui::ViewportBuilder::default()
        .with_title(&looks.title)
        .with_app_id("holdsafe-console")
        .with_inner_size([1440.0, 860.0])
        .with_min_inner_size(LEAST);
    let options = NativeOptions { viewport, renderer: eframe::Renderer::Glow, ..NativeOptions::default() };
    let title = looks.title.clone();
    let make = move |context: &CreationContext<'_>| -> Result<Box<dyn App>, _> {
        theme::apply(&context.egui_ctx);
        let ctx = context.egui_ctx.clone();
        let drawn = Drawn::default();
        let last = drawn.clone();
        start(Box::new(move || ctx.request_repaint_after(last.left())));
        Ok(Box::new(Program::new(looks, source, drawn)))
    };
    eframe::run_native(&title, options, Box::new(make)).map_err(|error| NoWindow::Refused(error.to_string()))
}

/// State of the window's program.
struct Program {
    window: ConsoleWindow,
    source: Box<dyn Source>,
    newest: Option<Arc<Shown>>,
    bell: Bell,
    /// Time of its making, on egui's clock, seconds.
    made: f64,
    /// Time of the last act that was not taken, on the same clock.
    untaken: Option<f64>,
    /// Time of the last drawn picture.
    drawn: Drawn,
    layout: Option<PathBuf>,
    /// The file's content.
    kept: String,
    /// Time of the last read, on egui's clock, seconds.
    looked: f64,
    /// True once the zoom to start with was chosen.
    zoomed: bool,
}

impl Program {
    fn new(looks: Looks, source: Box<dyn Source>, drawn: Drawn) -> Self {
        let mut window = ConsoleWindow::new(looks.unit, looks.site);
        let mut layout = looks.layout;
        match layout.as_deref().map(load_layouts) {
            Some(Ok(Some(layouts))) => *window.layouts_mut() = layouts,
            Some(Ok(None)) | None => {}
            // What somebody kept is not written over.
            Some(Err(why)) => {
                let path = layout.take().unwrap_or_default();
                link::note!(
                    "{} cannot be used, and layouts are not kept until it is moved away: {why}",
                    path.display()
                );
            }
        }
        // What is never touched is never written.
        let kept = window.layouts_mut().saved().unwrap_or_default();
        let bell = Bell::new();
        window.set_bell(bell.rings());
        Self {
            window,
            source,
            newest: None,
            bell,
            made: 0.0,
            untaken: None,
            drawn,
            layout,
            kept,
            looked: 0.0,
            zoomed: false,
        }
    }

    /// Keeps the layouts, where they are others than are kept. A run may end without asking the window.
    fn keep(&mut self) {
        let Some(path) = &self.layout else { return };
        let saved = self.window.layouts_mut().saved().map_err(std::io::Error::other);
        let result = saved.and_then(|saved| {
            if saved == self.kept {
                return Ok(());
            }
            // Another window may have saved layouts since.
            if let Some(their_layouts) = load_layouts(path).map_err(|error| std::io::Error::other(error.to_string()))? {
                self.window.layouts_mut().join(&their_layouts, &Layouts::read(&self.kept).unwrap_or_default());
            }
            let saved = self.window.layouts_mut().saved().map_err(std::io::Error::other)?;
            path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
            // Whole or not at all.
            let new = path.with_extension(format!("{}.new", std::process::id()));
            std::fs::write(&new, &saved)?;
            self.kept = saved;
            std::fs::rename(&new, path)
        });
        // Layouts that cannot be kept are no reason to fail, and are reported once.
        if let Err(error) = result {
            link::note!("layouts are not kept in {}: {error}", path.display());
            self.layout = None;
        }
    }

    fn grant(&mut self, wishes: Vec<Wish>, now: f64) {
        for wish in wishes {
            match wish {
                Wish::Act(act) if !self.source.send(act) => self.untaken = Some(now),
                Wish::Act(_) => {}
                Wish::Seek(to) => self.source.seek(to),
            }
        }
    }
}

impl App for Program {
    /// Runs while the window is hidden too, so that no queue fills.
    fn logic(&mut self, ctx: &Context, _: &mut Frame) {
        let now = ctx.input(|input| input.time);
        if let Some((newest, lain)) = self.source.newest() {
            self.newest = Some(newest);
            self.made = now - lain.as_ms() / 1000.0;
        }
        if !self.zoomed && ctx.content_rect().width() >= LARGE {
            ctx.set_zoom_factor(LARGER);
        }
        self.zoomed = true;
        zoom_that_fits(ctx);
        if now - self.looked >= KEPT_EVERY {
            self.looked = now;
            self.keep();
        }
        if self.source.is_closed() {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        // A recording that stands has nothing that ages.
        let is_paused = self.source.tape().is_some_and(|tape| !tape.playing);
        ctx.request_repaint_after(if is_paused { STANDING } else { AT_LEAST });
    }

    fn ui(&mut self, ui: &mut Ui, _: &mut Frame) {
        self.drawn.note();
        let now = ui.input(|input| input.time);
        let Some(shown) = self.newest.clone() else {
            let wishes = self.window.wait(ui);
            return self.grant(wishes, now);
        };
        let tape = self.source.tape();
        // A paused recording shows one picture.
        let lain = if tape.is_some() { Span::ZERO } else { lain(now, self.made) };
        let shown = Shown::clone(&shown).older(lain);
        self.bell.ring(&shown);
        let sidecar = tape.as_ref().map(|_| self.source.sidecar(shown.at));
        let untaken = self.untaken.is_some_and(|since| now - since < UNTAKEN_FOR);
        let beside = self.source.beside();
        let (tape, sidecar, beside) = (tape.as_ref(), sidecar.as_ref(), beside.as_ref());
        let picture = Picture { shown: &shown, behind: picture_lag(lain), untaken, tape, sidecar, beside };
        let wishes = self.window.draw(ui, &picture);
        self.grant(wishes, now);
    }

    fn on_exit(&mut self, _: Option<&eframe::glow::Context>) {
        self.keep();
    }
}

/// Time of the last drawn picture, shared with the source of the next.
#[derive(Clone, Debug, Default)]
struct Drawn(Arc<AtomicU64>);

impl Drawn {
    fn note(&self) {
        self.0.store(trace_us(), Ordering::Relaxed);
    }

    /// Time left until the next may be drawn.
    fn left(&self) -> Duration {
        MOST_OFTEN.saturating_sub(Duration::from_micros(trace_us().saturating_sub(self.0.load(Ordering::Relaxed))))
    }
}

/// Limits the zoom so that the window has at least the size that its parts need.
fn zoom_that_fits(ctx: &Context) {
    let zoom = ctx.zoom_factor();
    let size = ctx.content_rect().size() * zoom;
    let most = (size.x / LEAST[0]).min(size.y / LEAST[1]);
    if zoom > most.max(1.0) {
        ctx.set_zoom_factor(most.max(1.0));
    }
}

/// Time since the newest picture was made; both on egui's clock, seconds.
fn lain(now: f64, made: f64) -> Span {
    Span(((now - made).max(0.0) * 1e6) as u64)
}

/// Time since the last picture, once that is too long to call it current.
fn picture_lag(lain: Span) -> Option<Span> {
    Some(lain).filter(|lain| *lain > CURRENT)
}

/// The layouts of the last run; none where there was none.
fn load_layouts(path: &std::path::Path) -> Result<Option<Layouts>, Box<dyn std::error::Error>> {
    let mut saved = String::new();
    let file = match std::fs::File::open(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        file => file?,
    };
    // One byte more than may be there, so that a longer one is found out without being read.
    file.take(MAX_SAVED as u64 + 1).read_to_string(&mut saved)?;
    Ok(Some(Layouts::read(&saved)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picture_is_current_for_one_second() {
        assert_eq!(picture_lag(lain(7.0, 6.0)), None);
        assert_eq!(picture_lag(lain(7.5, 6.0)), Some(Span::ms(1500)));
        assert_eq!(picture_lag(lain(6.0, 7.0)), None, "a clock that runs backwards is no alarm");
    }

    #[test]
    fn picture_age_is_zero_under_a_backward_clock() {
        assert_eq!(lain(7.5, 6.0), Span::ms(1500));
        assert_eq!(lain(6.0, 7.0), Span::ZERO);
    }
}
