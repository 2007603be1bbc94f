//! `holdsafe report`: what a reviewer is handed, as one HTML file, made of results and of recorded runs.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use dossier::Dossier;
use dossier::results::{MAX_FILE_BYTES, Results};
use dossier::story::Story;

use super::failure::{Exit, Failure};
use super::{Context, engine, out};
use crate::story;

/// The file in a folder of a command's results that holds the result.
const RESULTS: [&str; 5] = ["matrix.json", "reference.json", "campaign.json", "ablation.json", "result.json"];
/// The most runs that are told one by one.
const MAX_STORIES: usize = 32;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Results (what `--json` printed, or a folder that a command wrote) and folders of single recorded runs.
    #[arg(value_name = "RESULT", required = true)]
    given: Vec<PathBuf>,
    /// The page.
    #[arg(long, value_name = "FILE", default_value = "report.html")]
    out: PathBuf,
    /// What it is about, in a line.
    #[arg(long, default_value = "Does trust decay safely?")]
    title: String,
    /// Every figure as SVG, its numbers as CSV and LaTeX, and its caption, into this folder.
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let dossier = gather(args)?;
    let page = dossier::page::page(&dossier);
    fs::write(&args.out, &page).map_err(|e| unwritable(&args.out, &e))?;
    if let Some(dir) = &args.figures {
        fs::create_dir_all(dir).map_err(|e| unwritable(dir, &e))?;
        for file in dossier::files::files(&dossier::page::figures(&dossier)) {
            let path = dir.join(file.name);
            fs::write(&path, file.text).map_err(|e| unwritable(&path, &e))?;
        }
    }
    if !context.json {
        out::say(format_args!("{}", args.out.display()));
    }
    Ok(Exit::Fine)
}

fn gather(args: &Args) -> Result<Dossier, Failure> {
    let (mut results, mut stories) = (Results::default(), Vec::new());
    for path in &args.given {
        match found(path)? {
            Given::Result(file) => {
                let bytes = bounded(&file)?;
                results
                    .read(&file.display().to_string(), &bytes)
                    .map_err(|e| Failure::new(Exit::Usage, e.to_string()))?;
            }
            Given::Run if stories.len() < MAX_STORIES => stories.push(told(path)?),
            Given::Run => {
                return Err(Failure::new(Exit::Usage, format!("more than {MAX_STORIES} runs; make several reports")));
            }
        }
    }
    let version = env!("CARGO_PKG_VERSION").to_owned();
    Ok(Dossier { title: args.title.clone(), version, results, stories })
}

/// What a path stands for.
enum Given {
    Result(PathBuf),
    Run,
}

fn found(path: &Path) -> Result<Given, Failure> {
    if !path.is_dir() {
        return Ok(Given::Result(path.to_owned()));
    }
    if path.join("recording").is_dir() {
        return Ok(Given::Run);
    }
    let inside = RESULTS.iter().map(|name| path.join(name)).find(|file| file.is_file());
    inside.map(Given::Result).ok_or_else(|| {
        let of = RESULTS.join(", ");
        let message = format!("{}: neither a recorded run (`recording/`) nor a result ({of})", path.display());
        Failure::new(Exit::Usage, message)
    })
}

fn told(run: &Path) -> Result<Story, Failure> {
    let (entries, flaw) = engine::recorded(run)?;
    let bounds = engine::recorded_bounds(run);
    Ok(story::of(&run.display().to_string(), &entries, &bounds, flaw))
}

/// A file's bytes, one more than is read at most: what is too long is refused, not cut.
fn bounded(file: &Path) -> Result<Vec<u8>, Failure> {
    let unreadable = |e: std::io::Error| Failure::new(Exit::Usage, format!("{}: {e}", file.display()));
    let mut bytes = Vec::new();
    let most = MAX_FILE_BYTES as u64 + 1;
    File::open(file).map_err(unreadable)?.take(most).read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

fn unwritable(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(Exit::Environment, format!("{}: {error}", path.display()))
}
