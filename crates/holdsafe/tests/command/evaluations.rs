//! The reference evaluation of a few scenarios, as a smoke check: interrupted and resumed, and its output.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tempfile::TempDir;

use super::{MACHINE, root};

/// The scenarios: with cells, in the twin of several platforms; and on the stacks.
const SCENARIOS: [&str; 4] =
    ["telemetry/loss.toml", "command/command_again.toml", "telemetry/certificates.toml", "control/nominal.toml"];
/// The folders that the program looks into.
const FOLDERS: [&str; 8] =
    ["command", "console", "control", "host", "localisation", "perception", "process", "telemetry"];

/// A folder with few scenarios, and evaluations of them.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        for folder in ["platforms", "policies", "scenarios/bases", "scenarios/scenes"] {
            copy(&root().join(folder), &directory.path().join("root").join(folder));
        }
        let scenarios = directory.path().join("root/scenarios");
        FOLDERS.iter().for_each(|folder| fs::create_dir_all(scenarios.join(folder)).unwrap());
        for file in SCENARIOS {
            fs::copy(root().join("scenarios").join(file), scenarios.join(file)).unwrap();
        }
        Self(directory)
    }

    fn dir(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, out: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
        command.arg("--root").arg(self.dir("root")).args(["evaluate", "--quick", "--out"]).arg(self.dir(out));
        command
    }

    /// An evaluation to its end, with its stdout and stderr.
    fn evaluate(&self, out: &str, more: &[&str]) -> (String, String) {
        let _shared = MACHINE.read().unwrap_or_else(std::sync::PoisonError::into_inner);
        let Output { status, stdout, stderr } = self.command(out).args(more).output().unwrap();
        let [stdout, stderr] = [stdout, stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        assert_eq!(status.code(), Some(0), "{stdout}{stderr}");
        (stdout, stderr)
    }

    /// Starts one and sends the signal once a trial is finished; gives its exit code and stderr.
    fn end_midway(&self, out: &str, signal: Signal) -> (Option<i32>, String) {
        let _shared = MACHINE.read().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut child: Child = self.command(out).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        while trial_files(&self.dir(out)).iter().all(|text| !text.contains('\n')) {
            assert_eq!(child.try_wait().unwrap(), None, "it ended before its first trial");
            std::thread::yield_now();
        }
        kill(Pid::from_raw(child.id() as i32), signal).unwrap();
        let mut line = String::new();
        child.stderr.take().unwrap().read_to_string(&mut line).unwrap();
        (child.wait().unwrap().code(), line)
    }

    /// A result but for the processor time that it took.
    fn result(&self, out: &str) -> Vec<String> {
        let text = fs::read_to_string(self.dir(out).join("reference.json")).unwrap();
        text.lines().filter(|line| !line.contains("cpu_seconds")).map(str::to_owned).collect()
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap).filter(|entry| entry.path().is_file()) {
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

/// The text of each file of finished trials.
fn trial_files(dir: &Path) -> Vec<String> {
    let files = fs::read_dir(dir.join("kept")).into_iter().flatten();
    files.map(|entry| fs::read_to_string(entry.unwrap().path()).unwrap()).collect()
}

/// The complete recordings at their places below `dir`, and every unfinished one.
fn recordings(dir: &Path, below: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for path in fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir()) {
        let is_made = path.join("recording").exists();
        match path.extension().map(|ending| ending.to_string_lossy().into_owned()) {
            Some(ending) if ending.starts_with("earlier-") => {}
            Some(_) | None if is_made => found.push(path.strip_prefix(below).unwrap().to_owned()),
            Some(_) | None => found.extend(recordings(&path, below)),
        }
    }
    found.sort();
    found
}

/// Interruptions: `kill -9`, by a line that is cut short, and by a recording that is gone.
#[test]
fn interrupted_evaluation_resumes_to_the_same_result() {
    let place = Place::new();
    let (whole, _) = place.evaluate("whole", &[]);
    let (dir, other) = (place.dir("whole"), place.dir("killed"));
    assert_eq!(place.end_midway("killed", Signal::SIGKILL).0, None, "ended by the signal");
    assert!(!other.join("reference.json").exists());
    // As if it had been in the middle of a recording.
    let unfinished = other.join("twin/nominal/1.unfinished/recording");
    fs::create_dir_all(&unfinished).unwrap();
    place.evaluate("killed", &[]);
    assert_eq!(place.result("killed"), place.result("whole"));
    assert_eq!(recordings(&other, &other), recordings(&dir, &dir));
    assert!(recordings(&dir, &dir).contains(&PathBuf::from("air/twin/loss/1")));

    let loss = fs::read_dir(dir.join("kept")).unwrap().map(|entry| entry.unwrap().path());
    for file in loss.filter(|path| path.to_string_lossy().contains("/loss.twin.")) {
        let text = fs::read_to_string(&file).unwrap();
        fs::write(&file, &text[..text.len() - 20]).unwrap();
    }
    fs::remove_dir_all(dir.join("twin/nominal/1")).unwrap();
    let (resumed, words) = place.evaluate("whole", &[]);
    assert!(words.contains("are there already"), "{words}");
    assert_eq!(place.result("killed"), place.result("whole"));
    assert_eq!(recordings(&other, &other), recordings(&dir, &dir));
    let lines =
        |text: &str, name: &str| text.lines().filter(|line| line.starts_with(&format!("ok         {name} "))).count();
    assert_eq!(["loss", "nominal", "certificates"].map(|name| lines(&whole, name)), [1, 1, 1], "{whole}");
    assert_eq!(["loss", "nominal", "certificates"].map(|name| lines(&resumed, name)), [1, 1, 0], "{resumed}");

    let (repeated, words) = place.evaluate("whole", &[]);
    assert!(words.contains("all were there already"), "{words}");
    assert!(repeated.contains("a smoke check: n = 3") && lines(&repeated, "loss") == 0, "{repeated}");
    assert_eq!(place.result("killed"), place.result("whole"));
}

#[test]
fn ctrl_c_prints_the_line_that_goes_on() {
    let place = Place::new();
    let (code, text) = place.end_midway("stopped", Signal::SIGINT);
    assert_eq!(code, Some(130), "{text}");
    assert!(text.contains("Ctrl-C is safe") && text.contains("none of them runs again"), "{text}");
    let line = text.lines().find_map(|line| line.strip_prefix("to go on, the same command again: ")).unwrap();
    let _shared = MACHINE.read().unwrap_or_else(std::sync::PoisonError::into_inner);
    let repeated = Command::new("sh").args(["-c", line]).output().unwrap();
    assert_eq!(repeated.status.code(), Some(0), "{line}: {}", String::from_utf8_lossy(&repeated.stderr));
}

/// The table is in the file, and on stdout where it is asked for.
#[test]
fn whole_table_has_a_line_for_each_row() {
    let place = Place::new();
    let (short, _) = place.evaluate("out", &["--quiet"]);
    let table = fs::read_to_string(place.dir("out").join("table.txt")).unwrap();
    assert!(table.contains("disarm") && !short.contains("disarm"), "{table}");
    let rows = table.lines().filter(|line| line.starts_with('│')).count();
    let result: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(place.dir("out").join("reference.json")).unwrap()).unwrap();
    assert_eq!(rows, result["rows"].as_array().unwrap().len() + 1, "with the headings");
    let (long, _) = place.evaluate("out", &["--quiet", "--table"]);
    assert!(table.lines().all(|line| long.contains(line)), "{long}");
    assert!(short.lines().count() < 40, "{short}");
}
