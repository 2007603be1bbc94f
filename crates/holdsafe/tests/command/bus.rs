//! `[[guest_bus]]`: attacks on the bus of a guest's own programs, by its adapter and with the receipts of its witness.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::evidence::object;
use super::guests::{STRAIGHT, guest};
use super::judge::second_judge;
use super::{holdsafe, root};

/// The straight driver with an adapter: where an attack is open, it follows the attacker at 3 m/s and gives this receipt.
fn attacked(receipt: &str) -> String {
    let adapter = format!(
        "bus=\n  case \"$line\" in *'\"bus\":['*) speed=${{speed%%[!0]*}}; speed=3; bus=',\"bus\":[{receipt}]' ;; esac\n  echo"
    );
    STRAIGHT
        .replace("echo '{\"reply\"", &format!("{adapter} '{{\"reply\""))
        .replace("\"place\":'\"$place\"'}}'", "\"place\":'\"$place\"''\"$bus\"'}}'")
}

/// A guest of `jsonl/2` with an adapter that offers these attacks.
fn adapter(dir: &Path, receipt: &str, offers: &str) -> String {
    let path = guest(dir, &attacked(receipt), "");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("protocol = \"jsonl/1\"", &format!("protocol = \"jsonl/2\"\nbus = [{offers}]")))
        .unwrap();
    path
}

const ARRIVED: &str = r#"{"id":1,"sent":5,"received":5,"honest":1,"used":true}"#;
const REFUSED: &str = r#"{"id":1,"sent":5,"received":5,"honest":1,"used":false,"why":"signature"}"#;
const NEVER_SENT: &str = r#"{"id":1,"sent":0,"received":0,"honest":1,"used":false,"why":"the rogue has ended"}"#;
const LOST: &str = r#"{"id":1,"sent":5,"received":0,"honest":1,"used":false}"#;

/// The scenario with an attack of the bus on set-points.
fn scenario() -> String {
    root().join("guests/bus/bus_command.toml").to_str().unwrap().to_owned()
}

fn trial(guest: &str, more: &[&str]) -> Value {
    let file = scenario();
    let output = holdsafe(&[&["run", &file, "--trials", "1", "--json", "--autonomy", guest], more].concat());
    let object: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)));
    object["trials"][0].clone()
}

#[test]
fn attack_on_a_guests_bus_counts_by_what_its_witness_received() {
    let cases = [
        (ARRIVED, "UNDETECTED", true),
        (REFUSED, "REJECTED", true),
        (NEVER_SENT, "INVALID", false),
        (LOST, "INVALID", false),
    ];
    for (receipt, outcome, arrived) in cases {
        let dir = tempfile::tempdir().unwrap();
        let guest = adapter(dir.path(), receipt, "\"command\"");
        let trial = trial(&guest, &[]);
        assert_eq!((&trial["outcome"], &trial["receipt"]), (&outcome.into(), &arrived.into()), "{receipt}: {trial}");
    }
}

/// The attacker's 3 m/s reach the plant bare, and end before what stands in the way guarded.
#[test]
fn attack_on_a_guests_bus_harms_only_the_bare_vehicle() {
    let dir = tempfile::tempdir().unwrap();
    let guest = adapter(dir.path(), ARRIVED, "\"command\"");
    let bare = trial(&guest, &["--bare"]);
    assert_eq!(bare["outcome"], "UNSAFE", "{bare}");
    assert_eq!(trial(&guest, &[])["outcome"], "UNDETECTED");
}

#[test]
fn attack_that_no_adapter_offers_is_refused_before_the_run() {
    let dir = tempfile::tempdir().unwrap();
    let other = adapter(dir.path(), ARRIVED, "\"clock\"");
    let file = scenario();
    let cases: [(&[&str], &str); 3] = [
        (&["run", &file], "name a guest whose file offers it"),
        (&["run", &file, "--autonomy", &other], "`scripted` does not offer"),
        (&["run", &file, "--autonomy", &other, "--live"], "`scripted` does not offer"),
    ];
    for (arguments, message) in cases {
        let output = holdsafe(arguments);
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && text.contains(message), "{message}: {text}");
    }
}

#[test]
fn both_judges_agree_on_an_attacked_bus() {
    for (receipt, outcome) in [(ARRIVED, "UNDETECTED"), (REFUSED, "REJECTED"), (LOST, "INVALID")] {
        let dir = tempfile::tempdir().unwrap();
        let guest = adapter(dir.path(), receipt, "\"command\"");
        let out = dir.path().join("out");
        assert_eq!(trial(&guest, &["--out", out.to_str().unwrap()])["outcome"], outcome);
        let Some(output) = second_judge(&out.join("twin/bus_command/1/events.jsonl")) else { return };
        assert_eq!(object(&output)["outcome"], outcome, "{output:?}");
    }
}

/// One process serves all trials. A guest that promises to forget and does not is found out by the probe of the plan.
#[test]
fn reused_process_that_remembers_is_marked() {
    let script = |forgets: bool| {
        let start = if forgets {
            "place='[0,0]'; echo '{\"ready\":{}}'; continue"
        } else {
            "old=$new; new=0.5; echo '{\"ready\":{}}'; continue"
        };
        format!(
            "new=0\nold=0\n{}",
            STRAIGHT
                .replace("echo '{\"ready\":{}}'; continue", start)
                .replace("speed=1 ;;", "speed=1; [ $old = 0 ] || speed=0 ;;")
        )
    };
    for (forgets, marked) in [(true, false), (false, true)] {
        let dir = tempfile::tempdir().unwrap();
        let path = guest(dir.path(), &script(forgets), "");
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace("\"jsonl/1\"", "\"jsonl/2\"\nreuse = true")).unwrap();
        let output = holdsafe(&["run", "nominal", "--trials", "2", "--json", "--autonomy", &path]);
        let object: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(object["watermark"].as_str().unwrap().contains("NOT DETERMINISTIC"), marked, "{object}");
    }
}

/// The bridge of the clone, by a path at which it is.
#[test]
fn new_ros2_node_stands_behind_the_bridge() {
    let dir = tempfile::tempdir().unwrap();
    let root = root();
    let made = |arguments: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_holdsafe"));
        command.current_dir(dir.path()).args(arguments).output().unwrap()
    };
    let output = made(&["--root", root.to_str().unwrap(), "guest", "new", "mine", "--ros2"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = fs::read_to_string(dir.path().join("mine/guest.toml")).unwrap();
    let bridge = text.split('"').find(|word| word.ends_with("ros2_guest.py")).expect("a bridge");
    assert!(Path::new(bridge).exists() && text.contains("name = \"mine\""), "{text}");
    // Without the wheels the bridge does not start; the file itself is right.
    let checked = made(&["--root", root.to_str().unwrap(), "guest", "check", "mine/guest.toml"]);
    assert!(checked.status.code() != Some(2), "{}", String::from_utf8_lossy(&checked.stderr));
    let node = fs::read_to_string(dir.path().join("mine/node.py")).unwrap();
    assert!(node.lines().count() < 45 && !node.contains("holdsafe"), "a node of ROS 2 alone");
}
