//! Campaigns as a user meets them: on one thread and two, in parts, killed, and put together again.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use runner::lines::reseal;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::{holdsafe, mistaken, root};

/// Two variations, each trial with its own moment.
const SMALL: [&str; 7] =
    ["campaign", "run", "loss", "--grid", "loss.0.share=0.9,1", "--draw", "loss.0.at_s=uniform:3.5:4.5"];

struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn dir(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs the small campaign with more options, into a folder of this name.
    fn campaign(&self, name: &str, more: &[&str]) -> Output {
        let dir = self.dir(name);
        let out = ["--out", dir.to_str().unwrap(), "--quiet", "--json"];
        holdsafe(&[SMALL.as_slice(), more, &out].concat())
    }

    fn merge(&self, parts: &[&str], into: &str) -> Output {
        let parts: Vec<String> = parts.iter().map(|part| self.dir(part).to_str().unwrap().to_owned()).collect();
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        let into = self.dir(into);
        holdsafe(
            &[&["campaign", "merge"], parts.as_slice(), &["--out", into.to_str().unwrap(), "--quiet", "--json"]]
                .concat(),
        )
    }

    /// The campaign's object, and the bytes of its table.
    fn result(&self, name: &str) -> (String, Vec<u8>) {
        let read = |file: &str| fs::read(self.dir(name).join(file));
        let table = read("trials.parquet").ok().map(|bytes| Sha256::digest(bytes).to_vec());
        assert_eq!(table.is_some(), cfg!(feature = "parquet"));
        (String::from_utf8(read("campaign.json").unwrap()).unwrap(), table.unwrap_or_default())
    }

    fn lines(&self, name: &str) -> Vec<String> {
        let text = fs::read_to_string(self.dir(name).join("trials.jsonl")).unwrap();
        text.lines().map(str::to_owned).collect()
    }
}

fn object(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

fn fine(output: &Output) -> Value {
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    object(output)
}

fn refused(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
    object(output)["error"].as_str().unwrap().to_owned()
}

/// Threads and parts decide only which of them runs a trial.
#[test]
fn threads_and_parts_do_not_change_the_result() {
    let place = Place::new();
    let whole = fine(&place.campaign("whole", &["--trials", "4", "--jobs", "1"]));
    assert_eq!((&whole["trials"], &whole["complete"], &whole["rows"][1]["n"]), (&8.into(), &true.into(), &4.into()));
    fine(&place.campaign("threads", &["--trials", "4", "--jobs", "2"]));
    assert_eq!(place.result("threads"), place.result("whole"));

    let parts = |total: u64| (1..=total).map(move |i| format!("{i}/{total}"));
    for part in parts(2).chain(parts(7)) {
        let object = fine(&place.campaign(&part.replace('/', "of"), &["--trials", "4", "--partition", &part]));
        assert_eq!((&object["complete"], &object["rows"][0]["bounds"]), (&false.into(), &Value::Null));
    }
    fine(&place.merge(&["2of2", "1of2", "2of2"], "two"));
    assert_eq!(place.result("two"), place.result("whole"), "in another order, one twice");
    fine(&place.merge(&["7of7", "3of7", "1of7", "2of7", "5of7", "4of7", "6of7", "1of2"], "seven"));
    assert_eq!(place.result("seven"), place.result("whole"), "with overlaps");

    let output = place.merge(&["1of7", "5of7"], "some");
    let some = object(&output);
    assert_eq!((output.status.code(), &some["complete"], &some["planned"]), (Some(4), &false.into(), &8.into()));
    assert_ne!(some["hash"], whole["hash"]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains(&format!("{} of 8 trials are there", some["trials"])), "{text}");
    // The rest, later, into the same folder.
    fine(&place.merge(&["2of2", "1of2"], "some"));
    assert_eq!(place.result("some"), place.result("whole"));
}

/// The jobs run in any order; one is killed and one runs twice.
#[test]
fn jobs_of_an_engine_equal_one_process() {
    let place = Place::new();
    let emit = |engine: &str, name: &str, text: &[&str]| {
        let dir = place.dir(name);
        let own_texts = ["emit", engine, "--partitions", "3", "--out", dir.to_str().unwrap(), "--json", "--"];
        holdsafe(&[own_texts.as_slice(), &SMALL, &["--trials", "4"], text].concat())
    };
    let words = refused(&emit("make", "none", &["--partition", "1/2"]));
    assert!(words.contains("behind `--`: --partition, --after, --from and --out are set for each job"), "{words}");
    let words = refused(&emit("make", "none", &["--trails", "4"]));
    assert!(words.contains("behind `--`: error: unexpected argument '--trails' found"), "{words}");
    assert!(!place.dir("none").exists(), "nothing is written");

    for engine in ["make", "slurm", "hyperqueue"] {
        let value = fine(&emit(engine, &format!("it's {engine}"), &[]));
        assert_eq!((&value["jobs"], &value["most"], &value["of"]), (&3.into(), &3.into(), &"trials".into()));
    }
    let words = refused(&emit("make", "it's make", &[]));
    assert!(words.contains("it's make"), "a folder in use: {words}");
    let script = |name: &str, argument: &str| {
        let path = place.dir("it's make").join(name);
        let mut command = Command::new(path);
        command.arg(argument).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    let told = script("look", "").stdout(Stdio::piped()).output().unwrap();
    assert_eq!((told.status.code(), &told.stdout[..]), (Some(0), &b"no partition has begun\n"[..]));
    let planned = Command::new("make")
        .arg("-n")
        .current_dir(place.dir("it's make"))
        .output()
        .expect("GNU make, which this test needs");
    let planned = String::from_utf8(planned.stdout).unwrap();
    let steps: Vec<&str> = planned.lines().filter(|line| line.starts_with("./")).collect();
    assert_eq!(steps, ["./part 1", "./part 2", "./part 3", "./merge"], "{planned}");
    let killed = script("part", "2").spawn().unwrap();
    end_midway(killed, &place.dir("it's make").join("parts/partition=2"), Signal::SIGKILL);
    let look = script("look", "").output().unwrap();
    assert_eq!(look.status.code(), Some(0), "{}", String::from_utf8_lossy(&look.stderr));
    let page = fs::read_to_string(place.dir("it's make/so-far/report.html")).unwrap();
    assert!(["http-equiv=\"refresh\"", "none yet: ", " is incomplete: "].iter().all(|part| page.contains(part)));
    for part in ["3", "1", "2", "1"] {
        let output = script("part", part).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert_eq!(script("merge", "").output().unwrap().status.code(), Some(0));
    fine(&place.campaign("whole", &["--trials", "4"]));
    assert_eq!(place.result("it's make/result"), place.result("whole"));

    let text = |file: &str| fs::read_to_string(place.dir(file)).unwrap();
    let job: toml::Table = text("it's hyperqueue/job.toml").parse().unwrap();
    let tasks = job["task"].as_array().unwrap();
    assert_eq!((tasks.len(), tasks[3]["deps"].as_array().unwrap().len()), (4, 3), "merging after the partitions");
    assert!(text("it's slurm/part.sbatch").contains("--array=1-3\n"));
    assert!(text("it's slurm/submit").contains("--dependency=afterok"));
    assert!(text("it's make/Makefile").contains("seq 1 3"));
}

/// Rounds end at the same look as one process.
#[test]
#[ignore = "long: rounds of a campaign"]
fn rounds_of_a_sequential_campaign_equal_one_process() {
    let place = Place::new();
    let claim = ["--claim", "unsafe<5%@90", "--sequential"];
    let whole = fine(&place.campaign("whole", &claim));
    let merged = place.dir("merged");
    let mut rounds = 0;
    while rounds == 0 || object(&place.merge(&["1of2", "2of2"], "merged"))["complete"] == false {
        for part in ["2/2", "1/2"] {
            let more = ["--partition", part, "--after", merged.to_str().unwrap()];
            fine(&place.campaign(&part.replace('/', "of"), &[claim.as_slice(), &more].concat()));
        }
        rounds += 1;
    }
    let rows = |dir: &str| serde_json::from_str::<Value>(&place.result(dir).0).unwrap()["trials"].as_u64().unwrap();
    assert!(rows("1of2") + rows("2of2") >= rows("whole"), "a partition has all of its trials in its table");
    assert!((2..5).contains(&rounds), "{rounds} rounds for {} trials", whole["trials"]);
    assert_eq!(place.result("merged"), place.result("whole"));
}

/// One partition is lost, and its trials run where the parts are put together.
#[test]
#[ignore = "long: a matrix and an ablation, twice each"]
fn matrix_and_ablation_in_partitions_equal_one_process() {
    let place = Place::new();
    let matrix: &[&str] = &["matrix", "--rows", "A01", "--trials", "2"];
    let ablation: &[&str] = &[
        "ablate",
        "naive_relay",
        "brief_silence",
        "--only",
        "guards.lease,boundary.freshness",
        "--trials",
        "2",
        "--screen",
        "1",
        "--hours",
        "0",
    ];
    for (words, result) in [(matrix, "matrix.json"), (ablation, "ablation.json")] {
        let whole = place.dir(&format!("whole {result}"));
        let output = holdsafe(&[words, &["--quiet", "--out", whole.to_str().unwrap()]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let jobs = place.dir(&format!("jobs {result}"));
        let emit = ["emit", "make", "--partitions", "3", "--out", jobs.to_str().unwrap(), "--"];
        assert_eq!(holdsafe(&[emit.as_slice(), words].concat()).status.code(), Some(0));
        let script = |name: &str, argument: &str| {
            let output = Command::new(jobs.join(name)).arg(argument).output().unwrap();
            assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        };
        script("part", "3");
        script("part", "1");
        assert!(!jobs.join("parts/partition=1").join(result).exists(), "a partition has no result");
        script("merge", "");
        let [merged, whole] = [jobs.join("result"), whole].map(|dir| {
            let text = fs::read_to_string(dir.join(result)).unwrap();
            let timeless = text.lines().filter(|line| !line.contains("cpu_seconds"));
            timeless.map(str::to_owned).collect::<Vec<_>>()
        });
        assert_eq!(merged, whole, "{result}");
    }
}

/// Starts the small campaign with its progress to be read.
fn start(place: &Place, name: &str, trials: &str) -> Child {
    let dir = place.dir(name);
    Command::new(env!("CARGO_BIN_EXE_holdsafe"))
        .args(["--root", root().to_str().unwrap()])
        .args(SMALL)
        .args(["--trials", trials, "--jobs", "1", "--out", dir.to_str().unwrap()])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Sends the signal once a trial of the campaign below `dir` is finished, and gives the child's stderr.
fn end_midway(mut child: Child, dir: &Path, signal: Signal) -> (Option<i32>, String) {
    let finished = || fs::read_to_string(dir.join("trials.jsonl")).is_ok_and(|text| text.contains('\n'));
    while !finished() {
        assert_eq!(child.try_wait().unwrap(), None, "it ended before its first trial");
        std::thread::yield_now();
    }
    kill(Pid::from_raw(child.id() as i32), signal).unwrap();
    let mut line = String::new();
    child.stderr.take().unwrap().read_to_string(&mut line).unwrap();
    (child.wait().unwrap().code(), line)
}

/// No trial is lost, and none is counted twice.
#[test]
fn killed_campaign_resumes_without_loss_or_repetition() {
    let place = Place::new();
    let (code, _) = end_midway(start(&place, "killed", "12"), &place.dir("killed"), Signal::SIGKILL);
    assert_eq!(code, None, "ended by the signal");
    assert!(!place.dir("killed").join("campaign.json").exists());
    let before = fs::read_to_string(place.dir("killed").join("trials.jsonl")).unwrap();
    assert!((1..24).contains(&before.lines().count()), "{} lines", before.lines().count());
    // Finished trials are taken as they stand: a trial that ran again would come out otherwise than this line.
    fs::create_dir(place.dir("marked")).unwrap();
    fs::copy(place.dir("killed").join("plan.json"), place.dir("marked").join("plan.json")).unwrap();
    let marked = before.replacen("\"sim_us\":9000000", "\"sim_us\":9000001", 1);
    fs::write(place.dir("marked").join("trials.jsonl"), &marked).unwrap();
    let text = refused(&place.campaign("marked", &["--trials", "12"]));
    assert!(text.contains("trials.jsonl:1: changed by hand"), "{text}");
    fs::write(place.dir("marked").join("trials.jsonl"), reseal(marked.as_bytes())).unwrap();
    fine(&place.campaign("marked", &["--trials", "12"]));
    assert!(place.lines("marked")[0].contains("\"sim_us\":9000001"));
    // As if it had been in the middle of a line.
    fs::write(place.dir("killed").join("trials.jsonl"), format!("{before}{{\"trial\":23,\"outc")).unwrap();

    fine(&place.campaign("killed", &["--trials", "12"]));
    let lines = place.lines("killed");
    let whole: Vec<&str> =
        before.split_inclusive('\n').filter(|line| line.ends_with('\n')).map(str::trim_end).collect();
    assert!(lines.starts_with(&whole.iter().map(ToString::to_string).collect::<Vec<_>>()), "none of them ran again");
    assert_eq!(lines.len(), 24);
    fine(&place.campaign("whole", &["--trials", "12"]));
    assert_eq!(place.result("killed"), place.result("whole"));
}

#[test]
fn ctrl_c_prints_the_line_that_resumes() {
    let place = Place::new();
    let (code, text) = end_midway(start(&place, "stopped", "12"), &place.dir("stopped"), Signal::SIGINT);
    assert_eq!(code, Some(130), "{text}");
    let line = text.lines().find_map(|line| line.strip_prefix("to go on, the same command again: ")).unwrap();
    assert!(text.contains("of 24 trials are finished and kept"), "{text}");
    let repeated = Command::new("sh").args(["-c", line]).output().unwrap();
    assert_eq!(repeated.status.code(), Some(0), "{line}: {}", String::from_utf8_lossy(&repeated.stderr));
    assert_eq!(place.lines("stopped").len(), 24);
}

/// The refusal names the first difference of the plans.
#[test]
fn part_of_another_campaign_is_refused() {
    let place = Place::new();
    let run = |name: &str, more: &[&str]| fine(&place.campaign(name, &[&["--trials", "1"], more].concat()));
    run("ours", &[]);
    run("seed", &["--seed", "2"]);
    run("draw", &["--draw", "conditions.jitter_ms=integer:0:9"]);
    let text = mistaken(place.0.path(), "share = 1.0", "share = 0.8");
    let out = place.dir("text");
    let of_file = [&["campaign", "run", text.as_str()], &SMALL[3..], &["--trials", "1", "--quiet", "--json"]].concat();
    fine(&holdsafe(&[of_file.as_slice(), &["--out", out.to_str().unwrap()]].concat()));
    // Another program: as if its sources had been others.
    run("program", &[]);
    let plan = place.dir("program").join("plan.json");
    let other: Value = serde_json::from_str(&fs::read_to_string(&plan).unwrap()).unwrap();
    let program = other["terms"]["program"].as_str().unwrap().to_owned();
    fs::write(&plan, fs::read_to_string(&plan).unwrap().replace(&program, &"0".repeat(64))).unwrap();

    for (other, told) in [
        ("seed", "is of another campaign: seed: expected 1, got 2"),
        (
            "draw",
            "is of another campaign: draws: expected loss.0.at_s=uniform:3.5:4.5, got conditions.jitter_ms=integer:0:9, ",
        ),
        ("program", "is of another campaign: program (SHA-256 of its sources): expected "),
    ] {
        let error = refused(&place.merge(&["ours", other], "none"));
        assert!(error.contains(told), "{other}: {error}");
        assert!(!place.dir("none").exists(), "nothing is written");
    }
    // The grid replaces the share that differs, so that file is the same campaign; the description is not.
    fine(&place.merge(&["ours", "text"], "same"));
    let text = mistaken(place.0.path(), "duration_s = 9.0", "duration_s = 9.1");
    let of_file = [&["campaign", "run", text.as_str()], &SMALL[3..], &["--trials", "1", "--quiet", "--json"]].concat();
    let error = refused(&holdsafe(&[of_file.as_slice(), &["--out", out.to_str().unwrap()]].concat()));
    assert!(error.contains("scenario text of `loss @ loss.0.share=0.9`: expected "), "{error}");
    let error = refused(&place.merge(&["ours", "nowhere"], "none"));
    assert!(error.contains("plan.json: ") && error.contains("name the folder that `holdsafe campaign"), "{error}");

    // A trial that came out differently in two parts.
    let trials = place.dir("same").join("trials.jsonl");
    let text = fs::read_to_string(&trials).unwrap();
    fs::write(&trials, reseal(text.replacen("HOLD_SAFE", "UNSAFE", 1).as_bytes())).unwrap();
    let error = refused(&place.merge(&["ours", "same"], "both"));
    assert!(error.contains("expected HOLD_SAFE with log ") && error.contains("got UNSAFE with log "), "{error}");
}

/// A claim determines its number of trials.
#[test]
fn exit_code_gives_the_verdict_on_a_claim() {
    let claimed = |claim: &str, more: &[&str]| {
        let place = Place::new();
        let out = place.dir("out");
        let line = ["campaign", "run", "loss", "--claim", claim, "--quiet", "--json", "--out", out.to_str().unwrap()];
        let output = holdsafe(&[line.as_slice(), more].concat());
        (output.status.code(), object(&output))
    };
    let (code, shown) = claimed("unsafe<50%@95", &[]);
    assert_eq!((code, &shown["trials"]), (Some(0), &5.into()));
    let uncorrected = &shown["rows"][0]["claim"]["alone"];
    assert_eq!(
        (&uncorrected["verdict"], uncorrected["upper"].as_f64().map(|u| u < 0.5)),
        (&"shown".into(), Some(true))
    );
    let (code, open) = claimed("unsafe<50%@95", &["--trials", "4"]);
    assert_eq!((code, &open["claim"]["open"]), (Some(4), &1.into()));
    let (code, refuted) = claimed("hold-safe<50%@95", &[]);
    assert_eq!((code, &refuted["claim"]["refuted"]), (Some(3), &1.into()));
}

#[test]
fn reproducing_line_sets_the_drawn_values() {
    let place = Place::new();
    let share = ["campaign", "run", "loss", "--grid", "loss.0.share=0.1", "--draw", "loss.0.at_s=uniform:3.5:4.5"];
    let draw = ["--draw", "loss.0.direction=choice:up|both", "--trials", "1", "--seed", "5", "--quiet", "--json"];
    let out = place.dir("drawn");
    let output = holdsafe(&[share.as_slice(), &draw, &["--out", out.to_str().unwrap()]].concat());
    assert_eq!(output.status.code(), Some(3), "so little loss is not noticed, and HOLD_SAFE was expected");
    let line = object(&output)["rows"][0]["reproduce"].as_str().unwrap().replacen("holdsafe", "\"$0\"", 1);
    let (root, repeated) = (root(), place.dir("again"));
    let line = format!("{line} --root '{}' --out '{}' --quiet", root.display(), repeated.display());
    let output = Command::new("sh").args(["-c", &line, env!("CARGO_BIN_EXE_holdsafe")]).output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(place.lines("again"), place.lines("drawn"), "the same trial to the bit");
}

/// It ends at the same look for any number of threads that run ahead.
#[test]
fn sequential_campaign_ends_independently_of_threads() {
    let place = Place::new();
    let run = |name: &str, jobs: &str| {
        let out = place.dir(name);
        let line =
            ["campaign", "run", "record_damage", "--cell", "truncate", "--claim", "unsafe<20%@95", "--sequential"];
        fine(&holdsafe(
            &[line.as_slice(), &["--jobs", jobs, "--quiet", "--json", "--out", out.to_str().unwrap()]].concat(),
        ))
    };
    let one = run("one", "1");
    assert_eq!((&one["trials"], &one["planned"], &one["claim"]["shown"]), (&50.into(), &50.into(), &1.into()));
    assert_eq!(one["rows"][0]["bounds"], Value::Null);
    run("two", "2");
    assert_eq!(place.result("one"), place.result("two"));
}

/// The refusal is that of a cell in the file, before any trial runs.
#[test]
fn values_that_do_not_fit_are_refused_first() {
    let place = Place::new();
    let refuse = |more: &[&str]| {
        let out = place.dir("out");
        let line = [&["campaign", "run", "loss", "--out", out.to_str().unwrap(), "--json"], more].concat();
        let output = holdsafe(&line);
        assert!(!Path::new(&out).exists(), "{more:?}");
        let text = String::from_utf8(output.stderr.clone()).unwrap();
        assert_eq!(output.status.code(), Some(2), "{text}");
        text
    };
    for (more, told) in [
        (["--grid", "loss.1.share=1"].as_slice(), "in loss: `loss.1.share` leads nowhere"),
        (&["--grid", "loss.0.share=0.5,1.5"], "loss.0.share: 1.5 is out of range, expected 0 to 1"),
        (&["--grid", "loss.0.share=much"], "loss.0.share: invalid type"),
        (&["--grid", "loss.0.at_s=8.5"], "in loss: starts at 8.5 s, up to 1 s later by its phase"),
        (&["--grid", "policy=session-only"], "`policy` is not for a path to set"),
        (&["--grid", "loss.0.share"], "a grid is PATH=V1,V2"),
        (&["--grid", "loss.0.share=1,1"], "has a value twice"),
        (&["--draw", "loss.0.share=uniform:0.5:1.5"], "loss.0.share: 1.5 is out of range"),
        (&["--draw", "conditions.jitter_ms=uniform:0:40"], "conditions.jitter_ms: invalid type: floating point"),
        (&["--draw", "bounds.lease_ms=integer:100:200"], "is the same for all trials of a variation; use --grid"),
        (&["--draw", "loss.0.share=normal:0:1"], "a draw is PATH=uniform:LOW:HIGH"),
        (&["--grid", "loss.0.share=1", "--draw", "loss.0.share=uniform:0:1"], "`loss.0.share` is set twice"),
        (&["--claim", "unsave<1%@95"], "no class `unsave`; there are: unsafe, "),
        (&["--claim", "unsafe<0.0000001%@95"], "at most 10000000 trials are taken together"),
        (&["--sequential"], "--claim <CLAIM>"),
        (&["--partition", "8/7"], "a partition is i/N"),
        (&["loss", "--trials", "1"], "`loss` is there twice"),
    ] {
        let screen = refuse(more);
        assert!(screen.contains(told) && screen.lines().count() < 24, "{more:?}: {screen}");
    }
    let values: Vec<String> = (0..101).map(|i| format!("{}", 3.0 + f64::from(i) / 100.0)).collect();
    let (times, lengths) =
        (format!("loss.0.at_s={}", values.join(",")), format!("loss.0.duration_s={}", values.join(",")));
    let screen = refuse(&["--grid", &times, "--grid", &lengths]);
    assert!(screen.contains("more than 10000 variations"), "{screen}");
}
