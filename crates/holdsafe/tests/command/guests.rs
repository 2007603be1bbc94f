//! `--autonomy GUEST.TOML` and `holdsafe guest`: programs of others drive, and each of their ends has a name.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::live::TRIES;
use super::{holdsafe, lock_machine, root, started};

/// Drives straight on at 1 m/s where driving is enabled, by the newest fix; without one by the last.
pub(super) const STRAIGHT: &str = r#"place='[0,0]'
while read -r line; do
  case "$line" in
  *'"start"'*) echo '{"ready":{}}'; continue ;;
  *'"fix":{'*) place=${line#*'"at":'}; place="${place%%]*}]" ;;
  esac
  n=${line#*'"number":'}; n=${n%%,*}
  case "$line" in *'"limit_m_s":0.0'*) speed=0 ;; *) speed=1 ;; esac
  echo '{"reply":{"number":'"$n"',"speed_m_s":'"$speed"',"curvature_per_m":0,"place":'"$place"'}}'
done"#;

/// A guest of this script, with these lines in its file.
pub(super) fn guest(dir: &Path, script: &str, more: &str) -> String {
    let file = format!(
        "name = \"scripted\"\ncommand = [\"sh\", \"{{dir}}/guest.sh\"]\nprotocol = \"jsonl/1\"\ntakes = [\"navigation\"]\n\
         gives = [\"drive\", \"place\"]\n{more}"
    );
    fs::write(dir.join("guest.sh"), script).unwrap();
    let path = dir.join("guest.toml");
    fs::write(&path, file).unwrap();
    path.to_str().unwrap().to_owned()
}

fn run(arguments: &[&str]) -> Value {
    let output = holdsafe(&[arguments, &["--json"]].concat());
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)))
}

/// The first trial of `scenario` under the guest.
fn trial(scenario: &str, guest: &str, more: &[&str]) -> Value {
    run(&[&["run", scenario, "--trials", "1", "--autonomy", guest], more].concat())["trials"][0].clone()
}

#[test]
fn frozen_fix_harms_only_the_bare_guest() {
    let dir = tempfile::tempdir().unwrap();
    let guest = guest(dir.path(), STRAIGHT, "");
    let bare = trial("localisation_freeze", &guest, &["--bare"]);
    assert_eq!(bare["outcome"], "LATE", "{bare}");
    assert!(bare["findings"][0].as_str().unwrap().contains("from the place that it goes by"), "{bare}");
    assert!(bare["guest"]["not_judged"].as_array().unwrap().iter().any(|p| p.as_str().unwrap().starts_with("P1:")));
    let guarded = trial("localisation_freeze", &guest, &[]);
    assert_eq!(guarded["outcome"], "HOLD_SAFE", "{guarded}");
    assert!(guarded["guest"].get("not_judged").is_none(), "{guarded}");
}

#[test]
fn guest_without_an_attack_is_nominal() {
    let dir = tempfile::tempdir().unwrap();
    let guest = guest(dir.path(), STRAIGHT, "");
    for more in [&[][..], &["--bare"]] {
        let object = run(&[&["run", "nominal", "--trials", "2", "--autonomy", &guest], more].concat());
        assert_eq!(object["summary"]["outcomes"]["NOMINAL"], 2, "{object}");
        assert!(object["watermark"].as_str().unwrap().starts_with("GUEST: `scripted` drives"), "{object}");
        assert!(!object["watermark"].as_str().unwrap().contains("DETERMINISTIC"), "{object}");
    }
}

/// The vehicle stands still throughout, and no other finding is due.
#[test]
fn guest_that_never_moves_is_stuck() {
    let dir = tempfile::tempdir().unwrap();
    let guest = guest(dir.path(), &STRAIGHT.replace("speed=1 ;;", "speed=0 ;;"), "");
    for more in [&[][..], &["--bare"]] {
        let output = holdsafe(&[&["run", "nominal", "--trials", "1", "--json", "--autonomy", &guest], more].concat());
        let trial = &serde_json::from_slice::<Value>(&output.stdout).unwrap()["trials"][0];
        assert_eq!((output.status.code(), &trial["outcome"]), (Some(3), &"STUCK".into()), "{trial}");
        let progress = &trial["mission"]["progress"];
        assert_eq!((&progress["passed"], &progress["stuck"]["why"]), (&0.into(), &"guest".into()), "{trial}");
        assert!(trial["findings"][0].as_str().unwrap().contains("rest asked for by the guest"), "{trial}");
    }
    let own_trial = &run(&["run", "nominal", "--trials", "1"])["trials"][0];
    assert_eq!(own_trial["outcome"], "NOMINAL", "{own_trial}");
    assert!(own_trial["mission"]["progress"]["passed"].as_u64().unwrap() > 0, "{own_trial}");
}

/// A trial has the same log, bare and guarded.
#[test]
fn a_guest_that_goes_by_the_clock_is_marked() {
    let dir = tempfile::tempdir().unwrap();
    let clocked = STRAIGHT.replace("speed=1", "speed=0.$(date +%N)");
    let guest = guest(dir.path(), &clocked, "");
    let object = run(&["run", "nominal", "--trials", "1", "--autonomy", &guest]);
    assert!(object["watermark"].as_str().unwrap().contains("NOT DETERMINISTIC"), "{object}");
}

#[test]
fn hostile_guests_end_by_name() {
    let after_start = |answer: &str| format!("read -r line; echo '{{\"ready\":{{}}}}'; read -r line; {answer}");
    let guests = [
        ("exit 3".to_owned(), "ended"),
        ("sleep 100".to_owned(), "silent"),
        (after_start("sleep 100"), "silent"),
        (after_start("exit 0"), "ended"),
        (after_start("echo hello"), "malformed"),
        (
            after_start(r#"echo '{"reply":{"number":1,"speed_m_s":NaN,"curvature_per_m":0,"place":[0,0]}}'"#),
            "malformed",
        ),
        (after_start(r#"echo '{"reply":{"number":1,"speed_m_s":1e9,"curvature_per_m":0,"place":[0,0]}}'"#), "value"),
        (
            after_start(r#"echo '{"reply":{"number":9,"speed_m_s":1,"curvature_per_m":0,"place":[0,0]}}'"#),
            "out_of_step",
        ),
        (after_start(r#"echo '{"reply":{"number":1,"speed_m_s":1,"curvature_per_m":0}}'"#), "undeclared"),
        (after_start("head -c 1073741824 /dev/zero | tr '\\0' x"), "flood"),
        (after_start("while :; do echo '{}'; done"), "malformed"),
        // A subshell forks: the guest itself would end with a failed fork.
        (after_start("f() { f | f & }; (f) & read -r line"), "silent"),
    ];
    for (script, fault) in guests {
        let dir = tempfile::tempdir().unwrap();
        let guest = guest(dir.path(), &script, "[limits]\nstart_ms = 1500\nstep_ms = 700\nprocesses = 8\n");
        for more in [&[][..], &["--bare"]] {
            let trial = trial("localisation_freeze", &guest, more);
            assert_eq!(trial["outcome"], "GUEST_FAILED", "{script}: {trial}");
            assert_eq!(trial["guest"]["failure"]["fault"], fault, "{script}: {trial}");
        }
    }
}

#[test]
fn a_failed_guarded_guest_is_stopped() {
    let dir = tempfile::tempdir().unwrap();
    let dies = STRAIGHT.replace(
        "while read -r line; do",
        "while read -r line; do\n  case \"$line\" in *'\"number\":90,'*) exit 1 ;; esac",
    );
    let guest = guest(dir.path(), &dies, "");
    let trial = trial("nominal", &guest, &[]);
    assert_eq!((&trial["outcome"], &trial["guest"]["failure"]["fault"]), (&"GUEST_FAILED".into(), &"ended".into()));
    let driven = trial["mission"]["driven_m"].as_f64().unwrap();
    assert!(driven > 0.5 && driven < 5.0, "{driven}");
}

/// Shipped guests, with a platform that each can drive and a program that it needs.
const SHIPPED: [(&str, &str, &str); 5] = [
    ("follower", "courier", "follower.py"),
    ("mrpt", "courier", "mrpt-guest"),
    ("wpilib", "courier", ".venv/bin/python"),
    ("raptor", "air", ".venv/bin/python"),
    ("basilisk", "space", ".venv/bin/python"),
];

/// The follower always; the others where their programs are installed.
#[test]
fn shipped_guests_drive_live_inside_confinement() {
    let _alone = lock_machine();
    for (name, platform, needs) in SHIPPED {
        let folder = root().join("guests").join(name);
        if !folder.join(needs).exists() {
            eprintln!("skipped: {name} is not installed (guests/README.md)");
            continue;
        }
        let file = folder.join("guest.toml");
        let dir = tempfile::tempdir().unwrap();
        let tries = TRIES.to_string();
        let arguments =
            ["run", "nominal", "--live", "--trials", "1", "--retries", &tries, "--platform", platform, "--json"];
        let guest = ["--autonomy", file.to_str().unwrap(), "--out", dir.path().join("out").to_str().unwrap()]
            .map(str::to_owned);
        let guest: Vec<&str> = guest.iter().map(String::as_str).collect();
        let output = started(&[&arguments[..], &guest].concat());
        let object: Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|_| panic!("{name}: {}", String::from_utf8_lossy(&output.stderr)));
        let trial = &object["trials"][0];
        // On a host under load a stage of perception may be late, which is no fault of the guest.
        assert!(trial["outcome"] == "NOMINAL" || trial["outcome"] == "FALSE_TRIP", "{name}: {trial}");
        assert!(trial["guest"].get("failure").is_none(), "{name}: {trial}");
        assert!(trial["mission"]["driven_m"].as_f64().unwrap() > 3.0, "{name}: {trial}");
        assert_ne!(trial["confinement"], "none", "{name}: {trial}");
    }
}

#[test]
fn mistakes_in_a_guest_file_have_a_place() {
    let dir = tempfile::tempdir().unwrap();
    let cases = [
        ("protocol = \"jsonl/1\"", "protocol = \"jsonl/9\"", "protocol jsonl/1 or jsonl/2 expected, got jsonl/9"),
        ("gives = [\"drive\"", "gives = [\"dive\"", "unknown variant `dive`"),
        ("takes", "takse", "unknown field `takse`"),
    ];
    let good = fs::read_to_string(guest(dir.path(), STRAIGHT, "")).unwrap();
    for (from, to, message) in cases {
        let file = dir.path().join("wrong.toml");
        fs::write(&file, good.replace(from, to)).unwrap();
        let output = holdsafe(&["run", "nominal", "--autonomy", file.to_str().unwrap()]);
        let screen = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{screen}");
        assert!(screen.contains(message) && screen.contains("wrong.toml:"), "{screen}");
    }
    let none = dir.path().join("none.toml");
    let output = holdsafe(&["run", "nominal", "--autonomy", none.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn comparison_sets_bare_beside_guarded() {
    let dir = tempfile::tempdir().unwrap();
    let guest = guest(dir.path(), STRAIGHT, "");
    let out = dir.path().join("out");
    let scenarios = "nominal,localisation_freeze";
    let object =
        run(&["guest", "compare", &guest, "--scenarios", scenarios, "--trials", "2", "--out", out.to_str().unwrap()]);
    let harmful = |conduct: &str| {
        let rows = object["rows"].as_array().unwrap();
        let is_wanted = |row: &&Value| row["conduct"] == conduct && row["scenario"] == "localisation_freeze";
        rows.iter().find(is_wanted).unwrap()["harmful"]["hits"].as_u64()
    };
    assert_eq!((harmful("bare"), harmful("guarded")), (Some(2), Some(0)), "{object}");
}

/// A guest made in an empty folder.
#[test]
fn new_guest_passes_its_check() {
    if Command::new("python3").arg("--version").output().is_err() {
        eprintln!("skipped: python3 is not installed");
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let root = root().canonicalize().unwrap();
    let run_here = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
        command.args(["--root", root.to_str().unwrap()]).args(arguments).current_dir(dir.path()).output().unwrap()
    };
    let made = run_here(&["guest", "new", "mine"]);
    assert_eq!(made.status.code(), Some(0), "{}", String::from_utf8_lossy(&made.stderr));
    assert_eq!(run_here(&["guest", "new", "mine"]).status.code(), Some(2), "nothing is overwritten");
    let checked = run_here(&["guest", "check", "mine/guest.toml", "--json"]);
    super::golden::hold(&checked.stdout);
    let object: Value = serde_json::from_slice(&checked.stdout).unwrap();
    assert_eq!((object["steps"].as_u64(), object["failure"].is_null()), (Some(200), true), "{object}");
    assert!(object["driven_m"].as_f64().unwrap() > 5.0, "{object}");
}

#[test]
fn check_names_what_a_guest_gets_wrong() {
    let dir = tempfile::tempdir().unwrap();
    let wrong = STRAIGHT.replace("\"curvature_per_m\":0", "\"curvature\":0");
    let output = holdsafe(&["guest", "check", &guest(dir.path(), &wrong, "")]);
    let screen = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(3), "{screen}");
    assert!(screen.contains("failed in step 1: malformed: unknown field `curvature`"), "{screen}");
    assert!(!screen.contains("without a fix"), "it did not come so far: {screen}");
}

/// The shell commands under a heading of a document.
fn tutorial(document: &str, heading: &str) -> String {
    let text = fs::read_to_string(root().join(document)).unwrap();
    let (_, rest) = text.split_once(&format!("\n## {heading}\n")).unwrap();
    let section = rest.split("\n## ").next().unwrap();
    section.split("```sh\n").skip(1).map(|block| block.split("```").next().unwrap()).collect()
}

/// The tutorial's commands run word for word, in a folder with the project's guests.
#[test]
#[ignore = "long: a whole tutorial"]
fn tutorial_leads_from_an_empty_folder_to_verdicts() {
    let dir = tempfile::tempdir().unwrap();
    for folder in ["scenarios", "platforms", "policies", "python"] {
        let copied = Command::new("cp").arg("-r").arg(root().join(folder)).arg(dir.path()).status().unwrap();
        assert!(copied.success(), "{folder}");
    }
    let script = format!(
        "holdsafe() {{ '{}' \"$@\"; echo \"exit $?\"; }}\n{}",
        env!("CARGO_BIN_EXE_holdsafe"),
        tutorial("docs/researcher/guests.md", "From an empty folder to a verdict"),
    );
    let output = Command::new("bash").args(["-c", &script]).current_dir(dir.path()).output().unwrap();
    let (shown, text) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let client = Command::new(dir.path().join("mine/.venv/bin/python")).args(["-c", "import holdsafe_guest"]).output();
    if !client.is_ok_and(|imported| imported.status.success()) {
        eprintln!("skipped: python3 or its package cannot be installed: {text}");
        return;
    }
    let exits: Vec<&str> = shown.lines().filter_map(|line| line.strip_prefix("exit ")).collect();
    let classes: Vec<&str> = shown.lines().filter_map(|line| line.strip_prefix("│ all  ┆ 20 ┆ ")).collect();
    let classes: Vec<&str> = classes.iter().filter_map(|row| row.split(" 20 ").next()).collect();
    assert_eq!(exits, ["0", "0", "3", "0", "0", "0", "3"], "{shown}{text}");
    assert_eq!(classes, ["LATE", "HOLD_SAFE", "HOLD_SAFE", "UNSAFE"], "{shown}{text}");
}
