//! `holdsafe watch RUN`: the view of a run's console, as text, from another terminal: over ssh, or in a script; with
//! `--json` as one object a line, with `--web` as a page for a browser, with `--foxglove` for that viewer, with `--packets` for a ground system. `sensors`
//! and `window` are windows.
//!
//! It reads the console's input journal while it grows, and prints the console's own words: no second model, no key and
//! no access to the run, so any number of watchers may read it. A console that has gone silent is shown as silent.
//! While a run goes on nothing of it is verified yet; one that is over is checked first.

mod beside;
mod follow;
mod frame;
mod onlook;
mod sensors;
mod window;

use std::path::{Path, PathBuf};
use std::sync::mpsc::channel;
use std::time::Duration;

use console::process::player::Player;
use console::site::Site;
use evidence::SCHEMA_VERSION;
use link::clock::trace_us;
use link::input_journal::{Entry, JournalError};
use recording::find::find_one_run;
use recording::{RecordingError, RunFolder, read_site};
use runner::checked::Unverified;
use runner::custom_detector::DetectorOptions;
use runner::failure::{Exit, Failure};
use runner::{Context, checked, out};
use serde::Serialize;
use serde_json::json;
use wire::core::{Input, Output};
use wire::id::{Boot, NodeId};

use follow::Follow;
use onlook::{Ground, Page, Viewer};

/// Time without a picture after which the last one is not current, microseconds: a console gives ten a second, and five
/// in silence.
const CURRENT_US: u64 = 1_000_000;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Directory of the run, as given to `run --live --out`.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// The operator's view as text; the default.
    #[arg(long, group = "place")]
    text: bool,
    /// Print the last view, and end.
    #[arg(long, conflicts_with_all = ["web", "foxglove", "packets", "sensors", "window"])]
    once: bool,
    /// Show it to a browser on this host instead, at this port or a free one, and print the address.
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0", group = "place")]
    web: Option<u16>,
    /// Offer it to Foxglove's app on this host instead, at this port or the app's usual one; takes a build with `--features foxglove`.
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "8765", group = "place")]
    foxglove: Option<u16>,
    /// Offer it as CCSDS space packets to a ground system on this host instead, at this port or a free one (docs/operator/packets.md).
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0", group = "place")]
    packets: Option<u16>,
    /// Show the sensors of a run that goes on, in a window beside the operator's.
    #[arg(long, group = "place")]
    sensors: bool,
    /// Open a run that is over in the operator's window: to look at, not to act in.
    #[arg(long, group = "place")]
    window: bool,
    /// With --window: another run that is over beside it, at the same time.
    #[arg(long, value_name = "RUN", requires = "window")]
    compare: Option<PathBuf>,
    /// With --sensors or --window.
    #[command(flatten)]
    bring: DetectorOptions,
    #[command(flatten)]
    unverified: Unverified,
}

/// Output of the view.
enum Place {
    Terminal { json: bool },
    Page(Page),
    Viewer(Viewer),
    Ground(Ground),
}

impl Place {
    fn open(context: &Context, args: &Args, run: &RunFolder) -> Result<Self, Failure> {
        let place = match (args.web, args.foxglove, args.packets) {
            (Some(port), ..) => Place::Page(Page::open(port, site(run))?),
            (None, Some(port), _) => Place::Viewer(Viewer::open(port)?),
            (None, None, Some(port)) => Place::Ground(Ground::open(port)?),
            (None, None, None) => return Ok(Place::Terminal { json: context.json }),
        };
        let address = match &place {
            Place::Page(page) => page.address(),
            Place::Viewer(viewer) => viewer.address(),
            Place::Ground(ground) => ground.address(),
            Place::Terminal { .. } => String::new(),
        };
        if context.json {
            out::say(format_args!("{}", json!({ "address": address })));
        } else {
            out::say(format_args!("{address}\nto look only, until the run or Ctrl-C ends it"));
        }
        Ok(place)
    }

    /// Time between two looks for new entries.
    fn looks_every(&self) -> Duration {
        match self {
            Place::Terminal { .. } => Duration::from_millis(200),
            // These count the age of a picture, and that grows with the wait for it.
            Place::Page(_) | Place::Viewer(_) | Place::Ground(_) => Duration::from_millis(20),
        }
    }

    /// Shows a picture that was not there yet at `since`, which is `None` where it was there from the beginning.
    fn show(&mut self, text: &str, picture: String, since: Option<u64>) -> Result<(), Failure> {
        match self {
            Place::Terminal { json: true } => out::say(format_args!("{picture}")),
            Place::Terminal { json: false } => out::say(format_args!("{text}")),
            Place::Page(page) => page.lay(picture, since),
            Place::Viewer(viewer) => viewer.show(&picture)?,
            Place::Ground(ground) => ground.show(&picture)?,
        }
        Ok(())
    }

    /// Reports that there has been no picture for `seconds`. A page counts for itself, and a ground system notices the
    /// missing packets.
    fn silent(&mut self, seconds: u64) -> Result<(), Failure> {
        match self {
            Place::Terminal { json: true } => out::say(format_args!("{}", json!({ "not_current_s": seconds }))),
            Place::Terminal { json: false } => {
                out::say(format_args!("NOT CURRENT: the console has said nothing more for {seconds} s"));
            }
            Place::Page(_) | Place::Ground(_) => {}
            Place::Viewer(viewer) => viewer.silent(seconds)?,
        }
        Ok(())
    }
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    if args.sensors {
        return sensors::run(context, args);
    }
    if args.window {
        return window::run(context, args);
    }
    if args.bring.files().iter().any(Option::is_some) {
        return Err(Failure::new(Exit::Usage, "--detector is for --sensors or --window, which show images"));
    }
    print(context, args)
}

/// Refusal of a folder without a run. One that does not exist yet may be a misspelt name: it is not waited for.
fn not_begun(folder: &Path, error: RecordingError) -> Failure {
    let failure = Failure::from(error);
    if folder.exists() {
        return failure;
    }
    Failure::new(
        Exit::Usage,
        format!("{failure}; a run that has still to begin is not waited for: watch it once it has"),
    )
}

/// Shows the operator's view until the run ends, a person asks, or, of a run that is over, once.
fn print(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let run = find_one_run(&args.run).map_err(|error| not_begun(&args.run, error))?;
    if !run.has_input_journals() {
        return last_view(context, args, &run);
    }
    let path = run.input_journal(NodeId::CONSOLE, Boot(1));
    let unread = |error: JournalError| Failure::new(Exit::NoEvidence, format!("{}: {error}", path.display()));
    let unopened = |error: JournalError| {
        let line = format!(
            "{}: {error}; is this the folder that `run --live --out` was given, and has the run begun?",
            path.display()
        );
        Failure::new(Exit::NoEvidence, line)
    };
    let mut log = Follow::open(&path).map_err(unopened)?;
    let (_nobody, pause) = channel::<()>();
    let mut looked = None;
    let mut now = trace_us();
    let mut news = News::read_log(&mut log).map_err(unread)?;
    if news.finished || run.is_over() {
        return last_view(context, args, &run);
    }
    if news.newest.is_none() && args.once {
        let line = format!(
            "{}: the console has shown nothing yet; without `--once` its first view is waited for",
            path.display()
        );
        return Err(Failure::new(Exit::NoEvidence, line));
    }
    let mut place = Place::open(context, args, &run)?;
    let (mut heard, mut reported) = (trace_us(), false);
    loop {
        // A picture that was not there at the last look has come since.
        let since = looked.replace(now);
        if let Some((text, picture)) = news.newest {
            (heard, reported) = (trace_us(), false);
            place.show(&text, picture, since)?;
        }
        if news.finished || args.once {
            return Ok(Exit::Fine);
        }
        let silent = trace_us().saturating_sub(heard);
        if silent > CURRENT_US && !reported {
            reported = true;
            place.silent(silent / 1_000_000)?;
        }
        // The channel has no sender: this is a sleep.
        let _ = pause.recv_timeout(place.looks_every());
        if context.stop.is_requested() {
            break;
        }
        now = trace_us();
        news = News::read_log(&mut log).map_err(unread)?;
    }
    Ok(Exit::Interrupted)
}

/// The last view of a run that is over, as one in the twin is at once: checked like any other recording, and marked as a replay.
fn last_view(context: &Context, args: &Args, run: &RunFolder) -> Result<Exit, Failure> {
    let path = run.path().display();
    if args.web.or(args.foxglove).or(args.packets).is_some() {
        let line = format!("{path} is over: `holdsafe watch --window {path}` shows its recording");
        return Err(Failure::new(Exit::NoEvidence, line));
    }
    let checked = checked::open_run(run.clone())?;
    checked::print_marks(context, &[&checked]);
    let (mut player, _) =
        Player::open(run.path()).map_err(|error| Failure::new(Exit::NoEvidence, error.to_string()))?;
    player.seek(player.over());
    let (text, picture) = player.words();
    if context.json {
        checked::print_json("watch", &Over { schema_version: SCHEMA_VERSION }, &[&checked])?;
    }
    out::say(format_args!("{}", if context.json { picture } else { text }));
    Ok(args.unverified.exit(&[&checked], Exit::Fine))
}

/// Header printed before the pictures of a run that is over.
#[derive(Serialize)]
struct Over {
    schema_version: u32,
}

/// The site that the run was planned on; an unreadable one leaves the drawing empty.
fn site(run: &RunFolder) -> Site {
    read_site(run).unwrap_or_else(|error| {
        link::note!("{}: the page shows no geofence and no route: {error}", run.path().display());
        Site::default()
    })
}

/// New entries in the console's input journal since the last look.
#[derive(Default)]
struct News {
    /// The newest picture, in words and as an object.
    newest: Option<(String, String)>,
    /// The console has written its closing account.
    finished: bool,
}

impl News {
    fn read_log(log: &mut Follow) -> Result<Self, JournalError> {
        let mut news = News::default();
        log.news(|entry| match entry {
            Entry::Output(Output::Text { text, picture }) => news.newest = Some((text, picture)),
            Entry::Input { input: Input::Finish, .. } => news.finished = true,
            Entry::Input { .. } | Entry::Output(_) | Entry::LeftOut { .. } => {}
        })?;
        Ok(news)
    }
}
