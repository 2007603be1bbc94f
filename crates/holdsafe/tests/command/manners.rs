//! Manners towards the user: hostile arguments, closed streams, mistakes that a suggestion mends.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::process::{Command, Stdio};

use super::{holdsafe, mistaken, root};

/// A command's stderr, and its exit code.
fn run_command(arguments: &[&str]) -> (String, Option<i32>) {
    let output = holdsafe(arguments);
    (String::from_utf8(output.stderr).unwrap(), output.status.code())
}

#[test]
fn closed_stderr_changes_no_exit_code() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let status = Command::new(env!("CARGO_BIN_EXE_holdsafe"))
        .args(["--root", root().to_str().unwrap(), "run", "nominall"])
        .stderr(writer)
        .stdout(Stdio::null())
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(2));
}

#[test]
fn non_utf8_argument_is_refused_with_exit_2() {
    let bad = OsStr::from_bytes(b"\xff\xfe");
    for arguments in [vec![bad], vec![OsStr::new("run"), bad], vec![OsStr::new("service"), bad]] {
        let output = Command::new(env!("CARGO_BIN_EXE_holdsafe")).args(&arguments).output().unwrap();
        let screen = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {screen}");
        assert!(!screen.contains("panicked"), "{screen}");
    }
}

#[test]
fn usage_errors_are_json_where_requested() {
    let output = holdsafe(&["run", "loss", "--trails", "2", "--json"]);
    assert_eq!(output.status.code(), Some(2));
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(object["exit"], 2);
    assert!(object["error"].as_str().unwrap().contains("--trails"), "{object}");
}

#[test]
fn mistyped_verb_or_key_is_answered_with_nearest() {
    let (screen, code) = run_command(&["matirx"]);
    assert!(code == Some(2) && screen.contains("did you mean `matrix`?"), "{screen}");
    let (screen, code) = run_command(&["explan", "loss"]);
    assert!(code == Some(2) && screen.contains("did you mean `inspect explain`?"), "{screen}");
    let dir = tempfile::tempdir().unwrap();
    let (screen, code) = run_command(&["run", &mistaken(dir.path(), "duration_s = 9.0", "duraton_s = 9.0")]);
    assert!(code == Some(2) && screen.contains("did you mean `duration_s`?"), "{screen}");
}

/// Two letters of `run` are exchanged, which is too far for the parser.
#[test]
fn mistyped_name_has_the_same_answer_everywhere() {
    let (screen, code) = run_command(&["rnu", "nominal"]);
    assert!(code == Some(2) && screen.contains("did you mean `run`?"), "{screen}");
    let answers = |verbs: &[&[&str]], answer: &str| {
        for verb in verbs {
            let (screen, code) = run_command(verb);
            assert!(code == Some(2) && screen.contains(answer), "{verb:?}: {screen}");
        }
    };
    let platform = ["--platform", "courir"];
    answers(
        &[&["run", "loss", platform[0], platform[1]], &["scenario", "check", platform[0], platform[1]]],
        "no platform `courir`; did you mean `courier`?",
    );
    for (name, answer) in [
        ("nominall", "no scenario `nominall`; did you mean `nominal`?"),
        ("xqz", "no scenario `xqz`; `holdsafe scenario list` prints the shipped ones."),
    ] {
        let (explain, diff, replay) =
            (["inspect", "explain", name], ["inspect", "diff", name, "loss"], ["inspect", "replay", name]);
        let export = ["report", "--format", "mcap", name, "--out", "/dev/null/none.mcap"];
        let [run, check] = [["run", name], ["search", name]];
        answers(&[&run, &check, &explain, &diff, &replay, &export], answer);
    }
}

/// No vehicle is where a wing looks, so that what the scenario presumes does not come.
#[test]
fn platform_that_owes_no_class_is_told() {
    let (screen, code) = run_command(&["run", "nominal", "--platform", "wing", "--trials", "1"]);
    assert!(screen.contains("`wing` owes no class of `nominal`"), "{screen}");
    assert!(code == Some(3) && screen.contains("FALSE_TRIP (mission: "), "{screen}");
}

#[test]
fn file_of_another_kind_is_no_scenario() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("README.md");
    fs::write(&file, "# No scenario\n").unwrap();
    for verb in ["run", "search"] {
        let (screen, code) = run_command(&[verb, file.to_str().unwrap()]);
        assert!(code == Some(2) && screen.contains("README.md` is no scenario"), "{verb}: {screen}");
        assert!(screen.contains("`holdsafe scenario list`") && screen.lines().count() == 1, "{verb}: {screen}");
    }
    let (screen, code) = run_command(&["run", "src"]);
    assert!(code == Some(2) && screen.contains("`src` is a folder"), "{screen}");
}

#[test]
fn title_of_a_run_names_its_platform() {
    let title = |more: &[&str]| {
        let output = holdsafe(&[&["run", "thermal_loss", "--trials", "1"], more].concat());
        String::from_utf8(output.stdout).unwrap().lines().next().unwrap_or_default().to_owned()
    };
    assert_eq!(title(&["--platform", "air"]), "thermal_loss on air (twin, seed 1)");
    assert_eq!(title(&[]), "thermal_loss (twin, seed 1)");
    let object = title(&["--platform", "air", "--json"]);
    let object: serde_json::Value = serde_json::from_str(&object).unwrap();
    assert_eq!(object["platform"], "air");
}

#[test]
fn window_on_several_cells_lists_them() {
    let (screen, code) = run_command(&["run", "teammate", "--live", "--console"]);
    assert!(code == Some(2) && screen.contains("choose one cell of `teammate` with --cell: "), "{screen}");
    assert!(screen.contains("verbatim/present/session-only, verbatim/"), "{screen}");
    let (screen, code) = run_command(&["run", "nominal", "loss", "--live", "--console"]);
    assert!(code == Some(2) && screen.contains("name one scenario"), "{screen}");
}

/// The claim decides the exit code.
#[test]
fn unexpected_trials_beside_a_claim_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let file = mistaken(dir.path(), "expected = [\"HOLD_SAFE\"]", "expected = [\"NOMINAL\"]");
    let out = dir.path().join("out");
    let campaign = |scenario: &str, out: &str| {
        let terms = ["--trials", "2", "--claim", "unsafe<90%@60", "--quiet", "--out", out];
        let output = holdsafe(&[&["campaign", "run", scenario], &terms[..]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let table = campaign(&file, out.to_str().unwrap());
    assert!(table.contains("shown for 1 of 1 variations"), "{table}");
    assert!(table.contains("outside of the expected classes: 2 trials. The claim says nothing of them"), "{table}");
    let other = dir.path().join("other");
    let table = campaign("loss", other.to_str().unwrap());
    assert!(!table.contains("outside of the expected classes"), "{table}");
}

#[test]
fn lines_that_end_as_on_windows_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let file = mistaken(dir.path(), "", "");
    for path in [dir.path().join("loss.toml"), dir.path().join("scenes/yard.toml")] {
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace('\n', "\r\n")).unwrap();
    }
    let (screen, code) = run_command(&["scenario", "check", &file]);
    assert_eq!(code, Some(0), "{screen}");
}

#[test]
fn irregular_model_file_is_refused_unread() {
    let dir = tempfile::tempdir().unwrap();
    let fifo = dir.path().join("model.onnx");
    nix::unistd::mkfifo(&fifo, nix::sys::stat::Mode::S_IRWXU).unwrap();
    let labels = root().join("crates/perception/models/hardened/labels.toml");
    for model in [fifo.to_str().unwrap(), "/dev/zero"] {
        let (screen, code) =
            run_command(&["run", "loss", "--trials", "1", "--detector", model, "--labels", labels.to_str().unwrap()]);
        assert!(code == Some(2) && screen.contains("not a regular file"), "{model}: {screen}");
    }
}

#[test]
fn results_that_are_no_regular_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let [result, manifest, plan] = ["result.json", "manifest.json", "plan.json"].map(|name| dir.path().join(name));
    for fifo in [&result, &manifest, &plan] {
        nix::unistd::mkfifo(fifo, nix::sys::stat::Mode::S_IRWXU).unwrap();
    }
    let [folder, result] = [dir.path(), &result].map(|path| path.to_str().unwrap());
    let page = dir.path().join("page.html");
    let merged = dir.path().join("merged");
    for line in [
        vec!["report", result, "--out", page.to_str().unwrap()],
        vec!["report", "--format", "cite", folder],
        vec!["campaign", "merge", folder, "--out", merged.to_str().unwrap()],
    ] {
        let (screen, code) = run_command(&line);
        assert!(code == Some(2) && screen.contains("not a regular file"), "{line:?}: {screen}");
    }
}

#[test]
fn a_check_finds_what_a_run_would_refuse() {
    let mistakes = [
        ("duration_s = 5.0", "duration_s = 0.0", "duration_ms"),
        ("duration_s = 9.0", "duration_s = 9.0\nbounds = { to_hold_safe_ms = 400 }", "beyond Th"),
    ];
    for (from, to, message) in mistakes {
        let dir = tempfile::tempdir().unwrap();
        let (screen, code) = run_command(&["scenario", "check", &mistaken(dir.path(), from, to)]);
        assert!(code == Some(2) && screen.contains(message), "{to}: {screen}");
    }
    let dir = tempfile::tempdir().unwrap();
    let file = mistaken(dir.path(), "", "");
    let scene = dir.path().join("scenes/yard.toml");
    let text = fs::read_to_string(&scene).unwrap();
    fs::write(&scene, text.replace("at_m = [-15.0, -5.0]", "at_m = [2.0, 10.0]")).unwrap();
    let (screen, code) = run_command(&["scenario", "check", &file]);
    assert!(code == Some(2) && screen.contains("starts inside `crate`"), "{screen}");
}

#[test]
fn scenario_given_by_file_is_reproduced_by_file() {
    let dir = tempfile::tempdir().unwrap();
    let file = mistaken(dir.path(), "expected = [\"HOLD_SAFE\"]", "expected = [\"NOMINAL\"]");
    let (screen, code) = run_command(&["run", &file, "--trials", "1"]);
    assert!(code == Some(3) && screen.contains(&format!("reproduce: holdsafe run {file} --trials 1")), "{screen}");
}

#[test]
fn progress_is_written_to_terminals_only() {
    let (screen, code) = run_command(&["run", "loss", "--trials", "2"]);
    assert_eq!((screen.as_str(), code), ("", Some(0)));
}
