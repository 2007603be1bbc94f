//! A scene that moves and obeys, and the cost of drawing it.

use std::fs;
use std::time::Duration;

use console::gui::{ConsoleWindow, Picture, Wish};
use eframe::egui::{Ui, ViewportCommand};
use link::clock::trace_us;
use wire::time::Span;

use crate::Take;

/// Time between two pictures.
const BETWEEN: Span = Span::ms(200);
/// Ticks of the kernel's accounts in a second.
const TICKS: f64 = 100.0;

/// A scene in a window.
pub(crate) struct Living {
    take: Take,
    window: Option<ConsoleWindow>,
    /// Time of the last picture, on egui's clock.
    last: f64,
    pictures: u32,
    /// Drawing time of each picture, microseconds; while it is measured.
    drawn: Vec<u64>,
    measured: Option<Measured>,
}

/// A measurement over a given number of seconds.
struct Measured {
    seconds: f64,
    began: Option<Usage>,
}

/// Resource usage of this process.
struct Usage {
    /// On egui's clock, seconds.
    at: f64,
    /// Since the process began, seconds.
    age: f64,
    cpu: f64,
    resident_mb: u64,
}

impl Living {
    pub(crate) fn new(take: Take, seconds: Option<f64>) -> Self {
        let measured = seconds.map(|seconds| Measured { seconds, began: None });
        Self { take, window: None, last: 0.0, pictures: 0, drawn: Vec::new(), measured }
    }

    /// Advances the scene, and drops the records that the tests keep for later.
    fn go_on(&mut self) {
        let yard = &mut self.take.yard;
        yard.run(BETWEEN);
        yard.film.clear();
        yard.bench.journal.clear();
        yard.bench.events.clear();
        yard.bench.texts.clear();
        yard.bench.pictures.clear();
        self.pictures += 1;
    }

    fn measure(&mut self, ui: &Ui, now: f64) {
        let Some(measured) = &mut self.measured else { return };
        let usage = Usage::now(now);
        let Some(began) = &measured.began else {
            println!("first picture {:.2} s after the process began", usage.age);
            measured.began = Some(usage);
            self.pictures = 0;
            self.drawn.clear();
            return;
        };
        let took = usage.at - began.at;
        if took >= measured.seconds {
            let (share, first, last) = ((usage.cpu - began.cpu) / took, began.resident_mb, usage.resident_mb);
            println!(
                "{} pictures in {took:.1} s, {share:.3} of a core, {first} MB at first, {last} MB at last",
                self.pictures
            );
            self.drawn.sort_unstable();
            let rank = |share: f64| self.drawn[((self.drawn.len() - 1) as f64 * share) as usize] as f64 / 1000.0;
            println!(
                "drawing one took {:.1} ms in the middle, {:.1} in 99 of 100, {:.1} at most",
                rank(0.5),
                rank(0.99),
                rank(1.0)
            );
            self.measured = None;
            ui.ctx().send_viewport_cmd(ViewportCommand::Close);
        }
    }
}

impl eframe::App for Living {
    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        let now = ui.input(|input| input.time);
        let distance = BETWEEN.as_ms() / 1000.0;
        if now - self.last >= distance {
            self.last = now;
            self.go_on();
        }
        let window = self.window.get_or_insert_with(|| self.take.window(ui));
        let shown = self.take.yard.shown();
        let picture = Picture {
            shown: &shown,
            behind: self.take.behind,
            untaken: false,
            tape: self.take.tape.as_ref(),
            sidecar: None,
            beside: None,
        };
        let before = trace_us();
        let wishes = window.draw(ui, &picture);
        if self.measured.is_some() {
            self.drawn.push(trace_us() - before);
        }
        for wish in wishes {
            if let Wish::Act(act) = wish {
                // Its effect is in the picture.
                let _ = self.take.yard.bench.act(act);
            }
        }
        self.measure(ui, now);
        ui.ctx().request_repaint_after(Duration::from_secs_f64((self.last + distance - now).clamp(0.0, distance)));
    }
}

impl Usage {
    /// As the kernel accounts for it.
    fn now(at: f64) -> Self {
        let stat = fs::read_to_string("/proc/self/stat").unwrap();
        let field =
            |n: usize| stat.rsplit(')').next().unwrap().split_whitespace().nth(n).unwrap().parse::<f64>().unwrap();
        let uptime = fs::read_to_string("/proc/uptime").unwrap();
        let uptime: f64 = uptime.split_whitespace().next().unwrap().parse().unwrap();
        let status = fs::read_to_string("/proc/self/status").unwrap();
        let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
        let kb: u64 = resident.split_whitespace().next().unwrap().parse().unwrap();
        Self { at, age: uptime - field(19) / TICKS, cpu: (field(11) + field(12)) / TICKS, resident_mb: kb / 1024 }
    }
}
