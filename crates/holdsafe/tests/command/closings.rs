//! The end of commands that measure: a summary, two commands that work when pasted, colours and progress on terminals alone.

use std::path::Path;
use std::process::{Command, Output};

use super::{mistaken, root};

/// The program in a folder; its two next commands are started there too.
struct Shell {
    dir: tempfile::TempDir,
}

impl Shell {
    fn new() -> Self {
        Self { dir: tempfile::Builder::new().prefix("with space ").tempdir().unwrap() }
    }

    fn holdsafe(&self, arguments: &[&str]) -> Output {
        let root = root().canonicalize().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
        command.args(["--root", root.to_str().unwrap()]).args(arguments);
        command.current_dir(self.dir.path()).output().unwrap()
    }

    /// The summary and the next commands of a command, which ends with `code`.
    fn end_of(&self, arguments: &[&str], code: i32) -> (String, Vec<String>) {
        let output = self.holdsafe(arguments);
        let text = String::from_utf8(output.stdout).unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}{errors}");
        let (before, next) = text.rsplit_once("\nnext: ").unwrap_or_else(|| panic!("{arguments:?}: {text}"));
        let next: Vec<String> = next.lines().flat_map(|line| line.trim().split("   ")).map(str::to_owned).collect();
        assert_eq!(next.len(), 2, "{arguments:?}: {next:?}");
        (before.lines().last().unwrap_or_default().to_owned(), next)
    }

    /// Pastes a command, which ends with one of `codes`.
    fn paste(&self, command: &str, codes: &[i32]) {
        let output = Command::new("sh").args(["-c", command]).current_dir(self.dir.path()).output().unwrap();
        let code = output.status.code().unwrap();
        assert!(codes.contains(&code), "{command}: {code}, {}", String::from_utf8_lossy(&output.stderr));
    }

    /// Checks the summary of a command, and pastes its next commands in their order; each ends with one of `codes`.
    fn try_next(&self, arguments: &[&str], code: i32, summary: &str, codes: &[i32]) {
        let (line, next) = self.end_of(arguments, code);
        assert!(line.contains(summary) && line.ends_with(" s"), "{arguments:?}: {line}");
        next.iter().for_each(|command| self.paste(command, codes));
    }

    /// The screen of a terminal of so many columns on which the program runs, with its escape sequences; `None` where the host has none.
    fn screen(&self, columns: usize, environment: &str, arguments: &str) -> Option<String> {
        let (program, root) = (env!("CARGO_BIN_EXE_holdsafe"), root().canonicalize().unwrap());
        let line = format!("stty cols {columns}; {environment} '{program}' --root '{}' {arguments}", root.display());
        let mut script = Command::new("script");
        script.args(["-qec", &line, "/dev/null"]).current_dir(self.dir.path());
        script.env_remove("NO_COLOR").env_remove("COLUMNS").env("TERM", "xterm").stdin(std::process::Stdio::null());
        let output = script.output().inspect_err(|error| eprintln!("skipped: script: {error}")).ok()?;
        Some(String::from_utf8(output.stdout).unwrap())
    }
}

#[test]
fn next_commands_of_runs_work_when_pasted() {
    let shell = Shell::new();
    let cells = ["run", "teammate", "--trials", "1", "--cell", "verbatim/silent/session-only"];
    let summary = "1 of 1 ended as stated · 1 of 1 UNDETECTED · UNSAFE 0 · evidence verified";
    shell.try_next(&[&cells[..], &["--out", "kept here"]].concat(), 0, summary, &[0]);
    shell.try_next(&cells, 0, "no evidence kept", &[0]);
    shell.try_next(&["run", "certificates", "--trials", "1"], 0, "ended as stated", &[0]);
    shell.try_next(&["inspect", "verify", "kept here"], 0, "the evidence holds · ended UNDETECTED", &[0]);
    shell.try_next(&["report", "kept here"], 0, "files written: 1 · evidence verified", &[0]);
}

#[test]
fn next_commands_of_an_invalid_run_say_why() {
    let shell = Shell::new();
    let mission = "when_track = \"obstacle\"\nwithin_s = 1.0";
    let file = mistaken(shell.dir.path(), "when_track = \"vehicle\"", mission);
    let run = ["run", &file, "--trials", "1", "--out", "out"];
    let (line, next) = shell.end_of(&run, 4);
    assert!(line.starts_with("0 of 1 ended as stated · UNEXPECTED 1 · 1 of 1 INVALID"), "{line}");
    let why = Command::new("sh").args(["-c", &next[0]]).current_dir(shell.dir.path()).output().unwrap();
    assert!(String::from_utf8_lossy(&why.stdout).contains("mission: armed by "), "{next:?}: {why:?}");
    shell.paste(&next[1], &[4]);
    let recording = shell.dir.path().join("out/twin/loss/1");
    let verify = ["inspect", "verify", recording.to_str().unwrap()];
    shell.try_next(&verify, 4, "of a trial that shows nothing · ended INVALID", &[0]);
}

#[test]
fn next_commands_of_many_trials_work_when_pasted() {
    let shell = Shell::new();
    let ablate = ["ablate", "loss", "--trials", "2", "--hours", "0", "--pairs", "0", "--only", "guards.lease"];
    shell.try_next(&[&ablate[..], &["--out", "a"]].concat(), 0, "1 of 1 checks needed alone", &[0]);
    shell.try_next(&["campaign", "run", "loss", "--trials", "2", "--out", "c"], 0, "2 of 2 ended as stated", &[0]);
    shell.try_next(&["matrix", "--rows", "N0", "--trials", "1", "--out", "m"], 0, "ended as stated", &[0]);
    let search = ["search", "nominal", "--attack-space", "display", "--waive", "display.signature", "--first"];
    shell.try_next(
        &[&search[..], &["--budget", "400", "--out", "s"]].concat(),
        3,
        "1 found, the first UNSAFE",
        &[0, 3],
    );
    shell.try_next(&["search", "nominal", "--budget", "2", "--out", "n"], 0, "2 trials · nothing found", &[0]);
    let estimate = ["estimate", "loss", "--event", "hold-safe", "--levels", "0", "--trials", "5", "--repetitions", "2"];
    shell.try_next(&estimate, 0, "estimate 1.00e0", &[0]);
    let compare = ["guest", "compare", "follower", "--scenarios", "localisation_freeze", "--trials", "1", "--out", "g"];
    shell.try_next(&compare, 0, "guarded harmed in 0 of 1", &[0, 3]);
    let (_, next) = shell.end_of(&compare, 0);
    assert!(next.iter().any(|command| command.contains(" report g ")), "{next:?}");
}

#[test]
fn recording_in_the_open_loop_has_next_commands() {
    let shell = Shell::new();
    let made = root().join("crates/judge/assess/tests/made").canonicalize().unwrap();
    let rover = made.join("rover.tlog");
    let guess = shell.holdsafe(&["assess", rover.to_str().unwrap(), "--guess"]);
    std::fs::write(shell.dir.path().join("map.toml"), &guess.stdout).unwrap();
    let (line, next) = shell.end_of(&["assess", rover.to_str().unwrap(), "--map", "map.toml"], 0);
    assert!(line.starts_with("judged in the open loop"), "{line}");
    next.iter().for_each(|command| shell.paste(command, &[0]));
}

#[test]
fn pipe_gets_no_colour_and_no_progress() {
    let shell = Shell::new();
    let output = shell.holdsafe(&["run", "teammate", "--trials", "1"]);
    let screen = [output.stdout, output.stderr].concat();
    assert!(!screen.contains(&0x1b) && !String::from_utf8(screen).unwrap().contains('━'));
}

#[test]
fn terminal_gets_both_unless_it_refuses() {
    let shell = Shell::new();
    let run = "run teammate --trials 1";
    let Some(screen) = shell.screen(80, "", run) else { return };
    assert!(screen.contains("\u{1b}[1;31mUNDETECTED\u{1b}[0m") && !screen.contains("mREJECTED"), "{screen}");
    let (progress, after) = screen.rsplit_once('━').unwrap();
    assert!(progress.contains("/18, ") && progress.contains(" left  "), "done, total and time left: {screen}");
    assert!(after.split('\n').next().unwrap().contains("\u{1b}[2K"), "the line is cleared: {after}");
    for environment in ["NO_COLOR=1", "TERM=dumb"] {
        let plain = shell.screen(80, environment, run).unwrap();
        assert!(plain.contains("UNDETECTED") && !plain.contains("\u{1b}[1;31m"), "{environment}: {plain}");
        assert_eq!(plain.contains('━'), environment == "NO_COLOR=1", "{environment}: {plain}");
    }
}

/// Commands stay whole, so that they can be pasted.
#[test]
fn lines_keep_to_the_width_of_the_terminal() {
    let shell = Shell::new();
    for columns in [80, 100] {
        let arguments = format!("run teammate --trials 1 --quiet --out {columns}");
        let Some(screen) = shell.screen(columns, "NO_COLOR=1", &arguments) else { return };
        let (results, _) = screen.split_once("next: ").unwrap();
        let longest = results.lines().map(|line| line.trim_end().chars().count()).max().unwrap_or_default();
        assert!(longest <= columns, "{longest} of {columns}: {results}");
        assert!(Path::new(&shell.dir.path().join(columns.to_string())).is_dir());
    }
}
