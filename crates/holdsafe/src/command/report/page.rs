//! `holdsafe report --format html`: one HTML file for a reviewer, made of results and of recorded runs.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use evidence::SCHEMA_VERSION;
use recording::find::find_runs;
use recording::{Checked, RecordedLog, RunFolder};
use report::reader::{FoundResult, MAX_FILE_BYTES, Manifest, Results};
use report::{Dossier, Recording};
use results::summary;
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::recorded::note_assumptions;
use runner::{Context, checked, out, plan, protected};
use serde::Serialize;

use super::Args;
use crate::command::campaign::recount;

/// The file in a folder of a command's results that holds the result.
pub(super) const RESULTS: [&str; 7] =
    ["matrix.json", "reference.json", "campaign.json", "ablation.json", "guests.json", "worlds.json", "result.json"];
/// The page where no other is named.
const PAGE: &str = "report.html";
/// Largest number of runs described one by one.
const MAX_STORIES: usize = 32;

/// Options of the page, and files that are written beside it.
#[derive(Debug, Default, clap::Args)]
#[command(next_help_heading = "With --format html")]
pub(super) struct PageOptions {
    /// Title of the page [default: the finding].
    #[arg(long)]
    title: Option<String>,
    /// A browser reads the page again after so many seconds.
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    renew: Option<u32>,
    /// Every figure as SVG (and as PDF, in a build with `--features pdf`), its numbers as CSV and LaTeX, and its caption, into this folder.
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
    /// The results as JUnit XML, for build servers.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Outcomes that were not expected, and findings, as SARIF, for code scanners.
    #[arg(long, value_name = "FILE")]
    sarif: Option<PathBuf>,
    /// Layers for the ATT&CK Navigator, scored by outcome, into this folder.
    #[arg(long, value_name = "DIR")]
    navigator: Option<PathBuf>,
    /// The paper's claims one by one, as Markdown.
    #[arg(long, value_name = "FILE")]
    evaluation: Option<PathBuf>,
    /// A CycloneDX bill of materials, with the inputs of the runs that `manifest.json` beside the first result names.
    #[arg(long, value_name = "FILE")]
    sbom: Option<PathBuf>,
}

impl PageOptions {
    /// True if any of them is given.
    pub(super) fn any_given(&self) -> bool {
        let files = [&self.figures, &self.junit, &self.sarif, &self.navigator, &self.evaluation, &self.sbom];
        self.title.is_some() || self.renew.is_some() || files.into_iter().any(Option::is_some)
    }
}

/// The written files.
#[derive(Serialize)]
struct Written {
    schema_version: u32,
    files: Vec<String>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let (mut dossier, checked) = gather(&args.given, &args.page)?;
    dossier.results.lie_in(folders(context));
    let read: Vec<&Checked> = checked.iter().collect();
    checked::print_marks(context, &read);
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(PAGE));
    let options = &args.page;
    let mut files = vec![("--out", out, report::page::page(&dossier).into_bytes())];
    if let Some(dir) = &options.figures {
        let figures = report::files::files(&report::page::figures(&dossier)).map_err(Failure::internal)?;
        files.extend(figures.into_iter().map(|file| ("--figures", dir.join(file.name), file.bytes)));
        if !cfg!(feature = "pdf") {
            link::note!("no figures as PDF: `cargo run --release --features pdf -- report …` adds them");
        }
    }
    files.extend(options.junit.clone().map(|file| ("--junit", file, report::junit(&dossier.results).into_bytes())));
    files.extend(options.sarif.clone().map(|file| ("--sarif", file, report::sarif(&dossier.results).into_bytes())));
    if let Some(dir) = &options.navigator {
        let layers = report::layers(&dossier.results);
        if layers.is_empty() {
            link::note!(
                "no layer for the Navigator: none of these results is of a scenario with techniques; give a `matrix`"
            );
        }
        files.extend(layers.into_iter().map(|(name, text)| ("--navigator", dir.join(name), text.into_bytes())));
    }
    let evaluation = options.evaluation.clone();
    files.extend(evaluation.map(|file| ("--evaluation", file, report::evaluation(&dossier.results).into_bytes())));
    if let Some(file) = &options.sbom {
        files.push(("--sbom", file.clone(), report::sbom(manifest(args)?.as_ref()).into_bytes()));
    }
    let mut written = Written { schema_version: SCHEMA_VERSION, files: Vec::new() };
    let paths = || args.given.iter().map(PathBuf::as_path);
    files.iter().try_for_each(|(option, path, _)| protected::check_report_path(option, path, paths()))?;
    for (_, path, bytes) in &files {
        write(path, bytes)?;
        written.files.push(path.display().to_string());
    }
    if context.json {
        checked::print_json("report", &written, &read)?;
    } else {
        written.files.iter().for_each(|file| out::say(format_args!("{file}")));
    }
    close(context, args, &read, written.files.len());
    Ok(args.unverified.exit(&read, Exit::Fine))
}

/// Summary, and the evidence behind the page.
fn close(context: &Context, args: &Args, read: &[&Checked], files: usize) {
    let given = args.given.first().map(|path| path.to_string_lossy()).unwrap_or_default();
    let run = read.iter().find(|run| run.invalid().is_some()).or(read.first());
    let first = run.map_or_else(
        || context.command(["report", &given, "--junit", "junit.xml"]),
        |run| context.command(["inspect", "verify", &run.path().to_string_lossy()]),
    );
    let closing = Closing::new(context).part(format!("files written: {files}")).checked(read, read.len());
    closing.print([first, context.command(["report", &given, "--figures", "figures"])]);
}

/// Writes the page over the results and recordings in the folder `dir` into it; gives its path.
pub(in crate::command) fn write_of_folder(context: &Context, dir: &Path, title: &str) -> Result<PathBuf, Failure> {
    let options = PageOptions { title: Some(title.to_owned()), ..PageOptions::default() };
    let (mut dossier, _checked) = gather(&[dir.to_owned()], &options)?;
    dossier.results.lie_in(folders(context));
    let out = dir.join(PAGE);
    write(&out, report::page::page(&dossier).as_bytes())?;
    Ok(out)
}

/// The manifest beside the first result that has one.
fn manifest(args: &Args) -> Result<Option<Manifest>, Failure> {
    let inside = |path: &PathBuf| if path.is_dir() { path.join(out::MANIFEST) } else { path.clone() };
    args.given.iter().map(inside).find_map(|file| manifest_beside(&file).transpose()).transpose()
}

/// The manifest in the folder of a file.
fn manifest_beside(file: &Path) -> Result<Option<Manifest>, Failure> {
    let file = file.with_file_name(out::MANIFEST);
    if !file.is_file() {
        return Ok(None);
    }
    let read = Manifest::read(&file.display().to_string(), &bounded(&file)?);
    read.map(Some).map_err(|e| Failure::new(Exit::Usage, e.to_string()))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let parent = path.parent().filter(|dir| !dir.as_os_str().is_empty());
    parent.map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::write(path, bytes)).map_err(|e| unwritable(path, &e))
}

/// Folder of each shipped scenario, by name; none where the scenarios cannot be listed.
fn folders(context: &Context) -> BTreeMap<String, String> {
    let shipped = context.root().ok().and_then(|root| scenario::shipped(&root).ok()).unwrap_or_default();
    let folder = |path: &PathBuf| Some((plan::stem(path), path.parent()?.file_name()?.to_str()?.to_owned()));
    shipped.iter().filter_map(folder).collect()
}

/// The parts of the page, and every recording that was checked for it.
fn gather(paths: &[PathBuf], options: &PageOptions) -> Result<(Dossier, Vec<Checked>), Failure> {
    let title = options.title.clone().unwrap_or_default();
    let version = env!("CARGO_PKG_VERSION").to_owned();
    let mut dossier = Dossier { title, version, renew_s: options.renew, ..Dossier::default() };
    let (mut checked, mut seen) = (Vec::new(), BTreeSet::new());
    for path in paths {
        let (vec, runs) = match found(path)? {
            Given::Result(file, runs) => {
                let bytes = bounded(&file)?;
                let read = dossier.results.read(&file.display().to_string(), &bytes);
                read.map_err(|e| Failure::new(Exit::Usage, e.to_string()))?;
                agrees(&file, &dossier.results)?;
                dossier.watermarks.extend(manifest_beside(&file)?.into_iter().flat_map(|manifest| manifest.watermarks));
                (Some(dossier.results.files().last().map(report::tried::kept_trials).unwrap_or_default()), runs)
            }
            Given::Runs(runs) => (None, runs),
        };
        let runs: Vec<Checked> = runs.into_iter().map(checked::open_run).collect::<Result<_, _>>()?;
        match vec {
            Some(kept) => tell_kept(&mut dossier, &kept, &runs)?,
            None => runs.iter().try_for_each(|of| tell_given(&mut dossier, of))?,
        }
        for of in runs {
            // The folder of a result may hold a run that is given by itself, too.
            if seen.insert(fs::canonicalize(of.path())?) {
                checked.push(of);
            }
        }
    }
    dossier.recordings = checked.iter().map(recording).collect();
    Ok((dossier, checked))
}

/// Tells a run that was given by itself.
fn tell_given(dossier: &mut Dossier, run: &Checked) -> Result<(), Failure> {
    if dossier.stories.len() == MAX_STORIES {
        return Err(Failure::new(Exit::Usage, format!("more than {MAX_STORIES} runs; make several reports")));
    }
    let name = run.path().display().to_string();
    dossier.stories.push(summarise(&name, run)?);
    dossier.folders.insert(name.clone(), name);
    Ok(())
}

/// Tells the kept trials of a result, each a name and the digest of its `held.json`, in their order, whose recordings are among `runs`.
fn tell_kept(dossier: &mut Dossier, stories: &[(String, String)], runs: &[Checked]) -> Result<(), Failure> {
    let by_digest: BTreeMap<&str, &Checked> =
        runs.iter().filter_map(|run| Some((run.anchors_sha256()?, run))).collect();
    let recorded: Vec<_> =
        stories.iter().filter_map(|(name, held)| Some((name, held, *by_digest.get(held.as_str())?))).collect();
    let room = MAX_STORIES.saturating_sub(dossier.stories.len());
    if recorded.len() > room {
        link::note!("{} recordings of cells are not told over time; {MAX_STORIES} are at most", recorded.len() - room);
    }
    for (name, held, run) in recorded.into_iter().take(room) {
        // Two results may have a scenario and a seed in common.
        let is_used = dossier.stories.iter().any(|story| story.name == *name);
        let name = if is_used { format!("{name} ({})", run.path().display()) } else { name.clone() };
        dossier.stories.push(summarise(&name, run)?);
        dossier.folders.insert(name.clone(), run.path().display().to_string());
        dossier.kept.insert(held.clone(), name);
    }
    Ok(())
}

/// Checks the newest of `results`, which was read from `file`, against itself and against the finished trials beside it.
pub(super) fn agrees(file: &Path, results: &Results) -> Result<(), Failure> {
    let Some(found) = results.files().last().map(|given| &given.found) else { return Ok(()) };
    let of_folder = match (found, file.parent()) {
        (FoundResult::Campaign(campaign), Some(folder)) if file.ends_with("campaign.json") => {
            recount::contradiction(folder, campaign)?
        }
        _ => None,
    };
    match found.contradiction().map(|reason| format!("it contradicts itself: {reason}")).or(of_folder) {
        None => Ok(()),
        Some(why) => {
            let message = format!("{}: changed since the command wrote it: {why}", file.display());
            Err(Failure::new(Exit::NoEvidence, message))
        }
    }
}

/// Meaning of a path.
enum Given {
    /// A result, and the runs that were recorded for it.
    Result(PathBuf, Vec<RunFolder>),
    /// Recorded runs, each to be described.
    Runs(Vec<RunFolder>),
}

fn found(path: &Path) -> Result<Given, Failure> {
    if !path.is_dir() {
        return Ok(Given::Result(path.to_owned(), Vec::new()));
    }
    let (inside, runs) = (RESULTS.iter().map(|name| path.join(name)).find(|file| file.is_file()), find_runs(path)?);
    if let Some(file) = inside {
        return Ok(Given::Result(file, runs));
    }
    if runs.is_empty() {
        let text = RESULTS.join(", ");
        let message = format!("{}: neither a recorded run (`recording/`) nor a result ({text})", path.display());
        return Err(Failure::new(Exit::Usage, message));
    }
    Ok(Given::Runs(runs))
}

fn summarise(name: &str, run: &Checked) -> Result<summary::RunSummary, Failure> {
    let log = RecordedLog::read(run)?;
    note_assumptions(&log, &run.path().display().to_string());
    Ok(summary::from_entries(name, &log.entries, &log.bounds, log.flaw))
}

fn recording(checked: &Checked) -> Recording {
    let verification = checked.verification();
    Recording {
        name: verification.run.clone(),
        sha256: verification.sha256.clone(),
        holds: verification.holds,
        outcome: verification.outcome.map(|class| class.name().to_owned()),
        invalid: verification.reason.clone(),
    }
}

/// A regular file's bytes, one more than is read at most: a longer file is refused by its reader, not cut.
fn bounded(file: &Path) -> Result<Vec<u8>, Failure> {
    let unreadable = |e: std::io::Error| Failure::new(Exit::Usage, format!("{}: {e}", file.display()));
    let mut bytes = Vec::new();
    let most = MAX_FILE_BYTES as u64 + 1;
    link::files::open(file).map_err(unreadable)?.take(most).read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

fn unwritable(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(Exit::Environment, format!("{}: {error}", path.display()))
}
