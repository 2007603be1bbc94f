//! `holdsafe report --format mcap RUN`: a run as an MCAP file with Foxglove's schemas, from a recording or from a run in the twin.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use evidence::{SCHEMA_VERSION, Witnessed};
use export::Viewer;
use perception::stages::Stages;
use recording::messages::{Message, RecordedMessages, read_messages};
use recording::{Checked, RecordedLog};
use runner::custom_detector::DetectorOptions;
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::recorded::note_assumptions;
use runner::{Context, checked, engine, out, plan, protected};
use serde::Serialize;
use sim::scene::Scene;
use wire::core::Topic;

use super::Args;

/// Options of an MCAP file.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "With --format mcap")]
pub(super) struct McapOptions {
    /// Of a scenario: only this cell; else the first.
    #[arg(long)]
    cell: Option<String>,
    /// Of a scenario: a policy file in place of its own.
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
    /// Of a scenario: sensors are rendered, and their images are in the file.
    #[arg(long)]
    rendered: bool,
    #[command(flatten)]
    bring: DetectorOptions,
}

impl McapOptions {
    /// True if any of them is given.
    pub(super) fn any_given(&self) -> bool {
        self.cell.is_some() || self.policy.is_some() || self.rendered || self.bring.files().iter().any(Option::is_some)
    }
}

/// The export, and its file.
struct Asked<'a> {
    run: &'a str,
    out: &'a Path,
    options: &'a McapOptions,
}

#[derive(Serialize)]
struct Exported {
    schema_version: u32,
    run: String,
    file: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    watermark: Option<String>,
    channels: Vec<Channel>,
    /// Messages between services that could not be read and are left out.
    unread: u64,
    /// Sets of frames of which the recording has the hash alone (`--frames`).
    not_kept: u64,
}

#[derive(Serialize)]
struct Channel {
    topic: String,
    schema: String,
    messages: u32,
}

/// The parts of a run to show.
struct Found {
    entries: Vec<Witnessed>,
    messages: Vec<Message>,
    scene: Option<Scene>,
    watermark: Option<String>,
    not_kept: u64,
    /// The recording that it was read from.
    checked: Option<Checked>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let run = args.one()?;
    let file = args.out.as_deref().ok_or_else(|| Failure::new(Exit::Usage, "name a file with --out FILE"))?;
    let name = run.to_str().ok_or_else(|| Failure::new(Exit::Usage, format!("{}: not UTF-8", run.display())))?;
    let requested = Asked { run: name, out: file, options: &args.mcap };
    let paths = [Some(run), args.mcap.policy.as_deref()].into_iter().chain(args.mcap.bring.files());
    protected::check_report_path("--out", file, paths.flatten())?;
    let found = if run.is_dir() { of_recording(&requested)? } else { of_scenario(context, &requested)? };
    if found.entries.is_empty() {
        return Err(Failure::new(Exit::NoEvidence, format!("{name}: no entry of any service")));
    }
    let (watermark, not_kept, checked) = (found.watermark.clone(), found.not_kept, found.checked.clone());
    let read: Vec<&Checked> = checked.iter().collect();
    checked::print_marks(context, &read);
    let (channels, unread) = write(context, &requested, found)?;
    let channels: Vec<Channel> = channels
        .into_iter()
        .map(|channel| Channel { topic: channel.topic, schema: channel.schema, messages: channel.messages })
        .collect();
    let (run, file) = (name.to_owned(), file.display().to_string());
    if context.json {
        let object = Exported { schema_version: SCHEMA_VERSION, run, file, watermark, channels, unread, not_kept };
        checked::print_json("export", &object, &read)?;
        return Ok(args.unverified.exit(&read, Exit::Fine));
    }
    watermark.iter().for_each(|mark| out::say(format_args!("{mark}")));
    for Channel { topic, schema, messages } in &channels {
        out::say(format_args!("{topic:32} {schema:28} {messages:8}"));
    }
    if unread > 0 {
        link::note!("{unread} messages between services could not be read and are left out");
    }
    if not_kept > 0 {
        link::note!(
            "{not_kept} sets of frames were not kept but for their hash; `run --live --frames 1 --out DIR` keeps them all"
        );
    }
    Ok(args.unverified.exit(&read, Exit::Fine))
}

fn of_recording(args: &Asked<'_>) -> Result<Found, Failure> {
    if args.options.policy.is_some() || args.options.cell.is_some() || args.options.rendered {
        let message =
            format!("{} is recorded, as it was run; name a scenario for another cell, policy or rendering", args.run);
        return Err(Failure::new(Exit::Usage, message));
    }
    let checked = checked::open_one_run(Path::new(args.run))?;
    let found = RecordedLog::read(&checked)?;
    note_assumptions(&found, args.run);
    let RecordedMessages { messages, left_out } = read_messages(&checked, &found.entries)
        .map_err(|error| Failure::new(Exit::Usage, format!("{}: input journals: {error}", args.run)))?;
    let (entries, checked) = (found.entries, Some(checked));
    Ok(Found { entries, messages, scene: None, watermark: None, not_kept: left_out, checked })
}

fn of_scenario(context: &Context, args: &Asked<'_>) -> Result<Found, Failure> {
    let wanted = PlanOptions {
        policy: args.options.policy.clone(),
        cell: args.options.cell.clone(),
        rendered: args.options.rendered,
        detector: args.options.bring.load()?,
        ..PlanOptions::default()
    };
    let (scenario, planned) = plan::plan(context, &plan::file_of(context, args.run)?, &wanted)?;
    let one = planned.first().filter(|_| !scenario.is_of_stacks());
    let one = one.ok_or_else(|| Failure::new(Exit::Usage, format!("`{}` has no run in the twin", args.run)))?;
    // One run, twice: once judged, once with all inputs of its cores kept.
    let (evidence, _) = engine::twin_verdict(&one.variation.scenario, &one.setup, context.seed)?;
    let journalled = engine::run_journalled(one, context.seed)?;
    let scene = journalled.topology().world().map(|world| world.scene.clone());
    Ok(Found {
        entries: evidence.entries,
        messages: journalled.messages(),
        scene,
        watermark: one.setup.watermark(),
        not_kept: 0,
        checked: None,
    })
}

/// Writes the file beside its place and puts it there when it is whole.
fn write(context: &Context, args: &Asked<'_>, found: Found) -> Result<(Vec<export::Channel>, u64), Failure> {
    let unwritable = |reason: String| Failure::new(Exit::Usage, format!("{}: {reason}", args.out.display()));
    let stages = found
        .messages
        .iter()
        .any(|message| message.topic == Topic::Frames)
        .then(|| args.options.bring.stages())
        .transpose()?;
    let path = args.out.with_extension("mcap.new");
    let file = File::create(&path).map_err(|e| unwritable(e.to_string()))?;
    let whole = match show(context, BufWriter::new(file), found, stages) {
        Ok(Some(whole)) => std::fs::rename(&path, args.out).map(|()| whole).map_err(|e| unwritable(e.to_string())),
        Ok(None) => Err(runner::error::EngineError::Stopped.into()),
        Err(error) => Err(unwritable(error.to_string())),
    };
    if whole.is_err() {
        // A partial file is of no use, and the failure is reported.
        let _ = std::fs::remove_file(&path);
    }
    whole
}

/// Writes the run in order of time, messages before the entries about them. `None` if it was interrupted.
fn show(
    context: &Context,
    file: BufWriter<File>,
    found: Found,
    stages: Option<Stages>,
) -> Result<Option<(Vec<export::Channel>, u64)>, export::ViewError> {
    let mut viewer = Viewer::new(file, found.scene, stages)?;
    if let Some(checked) = &found.checked {
        viewer.verification(&checked.verification().run, &checked.verification().sha256, checked.invalid())?;
    }
    let mut messages = found.messages.iter().peekable();
    for w in &found.entries {
        if context.stop.is_requested() {
            return Ok(None);
        }
        while let Some(message) = messages.next_if(|message| message.at <= w.at) {
            viewer.message(message.at, message.topic, &message.bytes)?;
        }
        viewer.event(w.at, &w.entry)?;
    }
    for of in messages {
        viewer.message(of.at, of.topic, &of.bytes)?;
    }
    let unread = viewer.unread();
    Ok(Some((viewer.finish()?, unread)))
}
