//! The second judge, and its verdicts on changed logs.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use super::evidence::{object, recorded};
use super::guests::{STRAIGHT, guest};
use super::{holdsafe, mistaken, root};

/// The second judge of this log; `None` where this host has no Python.
pub(super) fn second_judge(log: &Path) -> Option<Output> {
    Command::new("python3").arg(root().join("tools/judge")).arg(log).output().ok()
}

/// The second judge gives the class of the first one, and notices changes of the log.
#[test]
fn second_judge_agrees_and_notices_changes() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "delay");
    let log = run.join("events.jsonl");
    let Some(output) = second_judge(&log) else { return };
    assert_eq!(object(&output)["outcome"], "HOLD_SAFE", "{output:?}");
    // A unit that leaves HOLD_SAFE without consent.
    let text = fs::read_to_string(&log).unwrap();
    let held = text.lines().find(|line| line.contains(r#""to":"HOLD_SAFE""#)).unwrap();
    let mut left: serde_json::Value = serde_json::from_str(held).unwrap();
    left["t_us"] = (left["t_us"].as_u64().unwrap() + 1_000_000).into();
    left["event"]["from"] = "HOLD_SAFE".into();
    left["event"]["to"] = "READY".into();
    fs::write(&log, format!("{text}{left}\n")).unwrap();
    let output = second_judge(&log).unwrap();
    assert_eq!(object(&output)["outcome"], "UNSAFE", "{output:?}");
    for hostile in ["", "{}\n", "[1, 2\n", "{\"bounds\": 3}\n{\"event\": {}}\n"] {
        fs::write(&log, hostile).unwrap();
        let output = second_judge(&log).unwrap();
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), words.lines().count()), (Some(2), 1), "{words}");
    }
}

#[test]
fn failed_replay_is_invalid_to_the_second_judge() {
    let dir = tempfile::tempdir().unwrap();
    let log = recorded(dir.path(), "delay").join("events.jsonl");
    let text = fs::read_to_string(&log).unwrap();
    let (head, events) = text.split_once('\n').unwrap();
    let mut head: serde_json::Value = serde_json::from_str(head).unwrap();
    assert_eq!(head["differences"], serde_json::json!([]), "{head}");
    head["differences"] = serde_json::json!(["gateway, replayed from its input journal: differs after input 7"]);
    fs::write(&log, format!("{head}\n{events}")).unwrap();
    let Some(output) = second_judge(&log) else { return };
    assert_eq!(object(&output)["outcome"], "INVALID", "{output:?}");
    assert!(object(&output)["findings"].to_string().contains("P10"), "{output:?}");
}

/// To both judges a loss between two planned contacts is masked; beside one that arrived the trial is valid, alone it is INVALID by name.
#[test]
fn loss_between_two_contacts_is_masked() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("scenes")).unwrap();
    for scene in fs::read_dir(root().join("scenarios/scenes")).unwrap().map(Result::unwrap) {
        fs::copy(scene.path(), dir.path().join("scenes").join(scene.file_name())).unwrap();
    }
    let gap = scenario::find(&root(), "contact_gap").map(|file| fs::read_to_string(file).unwrap()).unwrap();
    let loss =
        |at_s: f64, duration_s: f64| format!("\n[[loss]]\nat_s = {at_s:?}\nduration_s = {duration_s:?}\nshare = 1.0\n");
    let run = |name: &str, losses: &str| {
        let (file, out) = (dir.path().join(format!("{name}.toml")), dir.path().join(name));
        fs::write(&file, gap.replace("name = \"contact_gap\"", &format!("name = \"{name}\"")) + losses).unwrap();
        let output =
            holdsafe(&["run", file.to_str().unwrap(), "--trials", "1", "--json", "--out", out.to_str().unwrap()]);
        let trial = object(&output)["trials"][0].clone();
        if let Some(output) = second_judge(&out.join("twin").join(name).join("1/events.jsonl")) {
            assert_eq!(object(&output)["outcome"], trial["outcome"], "{trial}");
        }
        trial
    };
    let single_value = run("gap_alone", &loss(35.0, 10.0));
    assert_eq!(single_value["outcome"], "INVALID", "{single_value}");
    assert_eq!(
        single_value["findings"][0], "injection action drop from 35000 ms: masked: out of contact",
        "{single_value}"
    );
    let both = run("gap_both", &(loss(35.0, 10.0) + &loss(63.0, 5.0)));
    assert_eq!(both["injections"][0]["by"], "out_of_contact", "{both}");
    assert_ne!(both["outcome"], "INVALID", "{both}");
}

/// To both judges a run without the presumed mission shows no result.
#[test]
fn run_without_its_mission_is_no_evidence() {
    let dir = tempfile::tempdir().unwrap();
    let file = mistaken(dir.path(), "when_track = \"vehicle\"", "when_track = \"obstacle\"");
    let out = dir.path().join("out");
    let run = holdsafe(&["run", &file, "--trials", "1", "--json", "--out", out.to_str().unwrap()]);
    assert_eq!(object(&run)["trials"][0]["outcome"], "INVALID");
    let Some(output) = second_judge(&out.join("twin/loss/1/events.jsonl")) else { return };
    let value = object(&output);
    assert_eq!((&value["outcome"], &value["receipt"]), (&"INVALID".into(), &true.into()), "{value}");
    assert!(value["mission"][0].as_str().unwrap().starts_with("armed by "), "{value}");
}

/// Judged on a guest that asks for no motion, inside the guards.
#[test]
fn standing_vehicle_is_stuck_to_both_judges() {
    let dir = tempfile::tempdir().unwrap();
    let guest = guest(dir.path(), &STRAIGHT.replace("speed=1 ;;", "speed=0 ;;"), "");
    let out = dir.path().join("out");
    let run =
        holdsafe(&["run", "nominal", "--trials", "1", "--autonomy", &guest, "--json", "--out", out.to_str().unwrap()]);
    assert_eq!(object(&run)["trials"][0]["outcome"], "STUCK");
    let log = out.join("twin/nominal/1/events.jsonl");
    let Some(output) = second_judge(&log) else { return };
    assert_eq!(object(&output)["outcome"], "STUCK", "{output:?}");
    // A log from before the route was reported.
    let text = fs::read_to_string(&log).unwrap();
    let (head, events) = text.split_once('\n').unwrap();
    let mut head: serde_json::Value = serde_json::from_str(head).unwrap();
    head.as_object_mut().and_then(|head| head.remove("route")).unwrap();
    fs::write(&log, format!("{head}\n{events}")).unwrap();
    assert_eq!(object(&second_judge(&log).unwrap())["outcome"], "NOMINAL");
}

/// The vehicle moves all the time, and reaches no way point.
#[test]
fn vehicle_that_circles_is_stuck_to_both_judges() {
    let dir = tempfile::tempdir().unwrap();
    let guest = guest(dir.path(), &STRAIGHT.replace("curvature_per_m\":0", "curvature_per_m\":0.4"), "");
    let nominal = scenario::find(&root(), "nominal").map(|file| fs::read_to_string(file).unwrap()).unwrap();
    // Its operator enables, and arms on nothing: it turns away from the vehicle.
    let [nominal, enables] = [0, 1].map(|n| nominal.split("[[operator.step]]").nth(n).unwrap());
    let nominal = format!("{nominal}[[operator.step]]{enables}");
    let (file, out) = (dir.path().join("nominal.toml"), dir.path().join("out"));
    fs::create_dir(dir.path().join("scenes")).unwrap();
    fs::copy(root().join("scenarios/scenes/yard.toml"), dir.path().join("scenes/yard.toml")).unwrap();
    let outcome_after = |seconds: &str| {
        fs::write(&file, nominal.replace("duration_s = 9.0", &format!("duration_s = {seconds}"))).unwrap();
        let out = out.join(seconds);
        let run = ["run", file.to_str().unwrap(), "--trials", "1", "--autonomy", &guest, "--json", "--out"];
        let trial = object(&holdsafe(&[&run[..], &[out.to_str().unwrap()]].concat()))["trials"][0].clone();
        if let Some(output) = second_judge(&out.join("twin/nominal/1/events.jsonl")) {
            assert_eq!(object(&output)["outcome"], trial["outcome"], "{trial}");
        }
        trial
    };
    assert_eq!(outcome_after("130.0")["outcome"], "NOMINAL", "it may wait for 120 s on a leg, and drive its length");
    let circles = outcome_after("160.0");
    assert_eq!(circles["outcome"], "STUCK", "{circles}");
    assert!(circles["findings"][0].as_str().unwrap().starts_with("astray: no way point in 1"), "{circles}");
}

/// Verdicts of the second judge on a run's log: with `change` applied to each line, and unchanged.
fn of_changed(log: &Path, change: impl Fn(&mut Line)) -> Option<(serde_json::Value, serde_json::Value)> {
    let text = fs::read_to_string(log).unwrap();
    let mut lines = text.lines();
    let mut changed = lines.next().unwrap().to_owned() + "\n";
    for line in lines {
        let mut line: Line = serde_json::from_str(line).unwrap();
        change(&mut line);
        changed += &(serde_json::to_string(&line).unwrap() + "\n");
    }
    let other = log.with_file_name("changed.jsonl");
    fs::write(&other, changed).unwrap();
    Some((object(&second_judge(log)?), object(&second_judge(&other)?)))
}

/// A line of `events.jsonl`.
#[derive(serde::Deserialize, serde::Serialize)]
pub(super) struct Line {
    pub(super) t_us: u64,
    event: serde_json::Value,
    #[serde(flatten)]
    rest: serde_json::Map<String, serde_json::Value>,
}

impl Line {
    /// Its author.
    pub(super) fn node(&self) -> String {
        self.rest["node"].as_str().unwrap().to_owned()
    }

    fn is(&self, name: &str) -> bool {
        self.event["is"] == name
    }

    fn add(&mut self, field: &str, delta: i64) {
        self.event[field] = (self.event[field].as_i64().unwrap() + delta).into();
    }
}

/// A change to every line of a log.
type Change<'a> = &'a dyn Fn(&mut Line);

/// Later than the preparation of every run.
const UNDER_WAY_US: u64 = 4_000_000;

/// Each property that a change to a log breaks.
#[test]
fn second_judge_finds_each_property_broken() {
    let dir = tempfile::tempdir().unwrap();
    let later = |line: &mut Line, cause: &str| {
        if line.is("transition") && line.event["cause"] == cause {
            line.t_us += 1_500_000;
        }
    };
    let moved = |line: &mut Line, delta: i64| {
        if line.is("located") && line.t_us > UNDER_WAY_US {
            line.add("pose_x_mm", delta);
        }
    };
    let changes: [(&str, &str, Change<'_>); 7] = [
        ("masquerade_recorder", "P2", &|line| later(line, "lost:sealed_log")),
        ("process_ends", "P3", &|line| later(line, "lost:lease")),
        ("nominal", "P3", &|line| moved(line, 5_000)),
        ("nominal", "P4", &|line| {
            if line.is("executed") {
                let values = serde_json::json!({"speed_mm_s": 3000, "margin_mm": 900, "arm_permille": 600, "keep_permille": 450});
                line.event["kind"] = serde_json::json!({ "configure": values });
            }
        }),
        ("nominal", "P5", &|line| {
            if line.is("located") {
                line.event["distrusted"] = true.into();
            }
            moved(line, 2_000);
        }),
        ("nominal", "P7", &|line| {
            if line.is("executed") {
                line.t_us += 200_000;
            }
        }),
        ("command_cut", "P7", &|line| {
            if line.is("losses_shown") {
                line.event["times"] = 0.into();
            }
        }),
    ];
    for (scenario, property, change) in changes {
        let log = recorded(dir.path(), scenario).join("events.jsonl");
        let Some((was, is)) = of_changed(&log, change) else { return };
        let broken = |value: &serde_json::Value| value["broken"].as_array().unwrap().contains(&property.into());
        assert!(!broken(&was), "{scenario}: {was}");
        assert!(broken(&is), "{scenario}: {property} is broken, and it says {is}");
        fs::remove_dir_all(dir.path().join(scenario)).unwrap();
    }
}

/// An action counts for no actor unless its target logged it.
#[test]
fn second_judge_believes_no_unseen_action() {
    let dir = tempfile::tempdir().unwrap();
    let unseen = |line: &mut Line, name: &str, field: &str| {
        if line.is(name) {
            line.event[field] = 1.into();
        }
    };
    let denials: [(&str, Change<'_>); 9] = [
        ("command_cut", &|line| unseen(line, "stream_saw", "stream")),
        ("command_stall", &|line| {
            if line.is("tampered") {
                line.add("delay", 3_000_000);
            }
        }),
        ("command_replay", &|line| unseen(line, "stream_saw", "hash")),
        ("view_late", &|line| unseen(line, "mouth_saw", "hash")),
        ("gateway_hold", &|line| {
            if line.is("swallowed") {
                line.event["command"]["sequence"] = 1.into();
            }
        }),
        ("synthetic_product", &|line| unseen(line, "mouth_saw", "hash")),
        ("stolen_key", &|line| {
            if line.is("rogue") {
                line.event["command"]["boot"] = 9.into();
            }
        }),
        ("localisation_jump", &|line| unseen(line, "mouth_saw", "hash")),
        ("slow_inference", &|line| {
            if line.is("halted") {
                line.t_us += 50_000;
            }
        }),
    ];
    for (scenario, change) in denials {
        let run = recorded(dir.path(), scenario);
        let log = run.join("events.jsonl");
        let Some((was, is)) = of_changed(&log, change) else { return };
        assert_eq!((&was["receipt"], &was["not_judged"]), (&true.into(), &serde_json::json!([])), "{scenario}: {was}");
        assert_eq!(is["receipt"], false, "{scenario}: {is}");
    }
}
