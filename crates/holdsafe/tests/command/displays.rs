//! Displays of a run, `watch`, `console` and `live --console`, in the parts that need no display.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};

use console::process::player::Player;
use serde_json::Value;

use super::evidence::object;
use super::exports::message_counts;
use super::live::{LATE, TRIES};
use super::readers::flip_a_bit;
use super::{holdsafe, lock_machine, root};

/// The program in an environment without a display.
fn blind(arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").args(["--root", root().to_str().unwrap()]);
    let output = command.args(arguments).output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// Two seconds without any action, in its own folder.
pub(super) fn short() -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let nominal = fs::read_to_string(root().join("scenarios/control/nominal.toml")).unwrap();
    let (head, _) = nominal.split_once("[[operator.step]]").unwrap();
    let text = head.replace("duration_s = 9.0", "duration_s = 2.0").replace("name = \"nominal\"", "name = \"short\"");
    let path = folder.path().join("short.toml");
    fs::write(&path, text).unwrap();
    fs::create_dir(folder.path().join("scenes")).unwrap();
    fs::copy(root().join("scenarios/scenes/yard.toml"), folder.path().join("scenes/yard.toml")).unwrap();
    let path = path.to_str().unwrap().to_owned();
    (folder, path)
}

/// Application process and length of a packet.
type Packet = (u16, usize);

/// Packets that a ground system reads of a run until it is over.
fn packets(run: &str) -> std::thread::JoinHandle<Vec<Packet>> {
    let mut watch = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
    let mut watch = watch.args(["watch", run, "--packets", "--json"]).stdout(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(watch.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let value: Value = serde_json::from_str(&line).unwrap();
    let address = value["address"].as_str().and_then(|at| at.strip_prefix("tcp://")).unwrap().to_owned();
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        TcpStream::connect(address).unwrap().read_to_end(&mut bytes).unwrap();
        assert!(watch.wait().unwrap().success());
        let (mut rest, mut found) = (bytes.as_slice(), Vec::new());
        while let [first, second, _, _, high, low, ..] = *rest {
            let length = 7 + usize::from(u16::from_be_bytes([high, low]));
            found.push((u16::from_be_bytes([first, second]) & 0x7ff, length));
            rest = &rest[length.min(rest.len())..];
        }
        found
    })
}

/// Pictures and packets of a live run that is watched from beside to its end; none if the host stalled it, which is no
/// evidence.
fn watched(scenario: &str, out: &Path) -> Option<(Vec<Value>, Vec<Packet>)> {
    let run = out.to_str().unwrap();
    let _alone = lock_machine();
    let mut live = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
    live.args(["--root", root().to_str().unwrap(), "run", "--live", "--watch", scenario, "--out", run, "--json"])
        .stdout(Stdio::piped());
    let mut live = live.spawn().unwrap();
    let log = out.join("inputs/console.cbor");
    while !log.exists() {
        assert!(live.try_wait().unwrap().is_none(), "the run ended before there was anything to watch");
        std::thread::yield_now();
    }
    let packets = packets(run);
    let mut watch = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
    let mut watch = watch.args(["watch", run, "--json"]).stdout(Stdio::piped()).spawn().unwrap();
    let lines = BufReader::new(watch.stdout.take().unwrap()).lines();
    let pictures = lines.map(|line| serde_json::from_str(&line.unwrap()).unwrap()).collect();
    assert!(watch.wait().unwrap().success());
    let (packets, live) = (packets.join().unwrap(), live.wait_with_output().unwrap());
    let trial: Value = serde_json::from_slice(&live.stdout).unwrap();
    // Lateness within the recording alone is the host's too, though no longer wait of a service was measured.
    let late = trial["findings"].to_string().contains(LATE);
    if trial["host_stall_ms"].is_number() || late {
        return None;
    }
    assert!(live.status.success(), "{trial}");
    Some((pictures, packets))
}

#[test]
fn live_run_is_watched_and_shown_again() {
    let (folder, scenario) = short();
    let mut outs = (1..=TRIES).map(|number| folder.path().join(format!("run-{number}")));
    let first = outs.find_map(|out| watched(&scenario, &out).map(|seen| (out, seen)));
    let (out, (pictures, packets)) = first.unwrap_or_else(|| panic!("the host stalled each of {TRIES} live runs"));
    let run = out.to_str().unwrap();
    let of_apid = |apid: u16| packets.iter().filter(|packet| packet.0 == apid).collect::<Vec<_>>();
    assert!(
        of_apid(64).len() >= 2 && of_apid(65).iter().all(|packet| packet.1 == 79) && of_apid(65).len() >= 2,
        "{packets:?}"
    );
    let fresh = |picture: &&Value| picture["units"][0]["state"]["freshness"] == "fresh";
    assert!(pictures.iter().filter(fresh).count() >= 2, "{} pictures", pictures.len());
    let times: Vec<u64> = pictures.iter().filter_map(|picture| picture["at_us"].as_u64()).collect();
    assert!(times.is_sorted());

    let once = holdsafe(&["watch", run, "--once"]);
    let text = String::from_utf8(once.stdout).unwrap();
    assert!(once.status.success() && text.starts_with("REPLAY of a recording"), "{text}");
    assert!(text.contains("SIMULATION") && text.contains("IDLE"), "{text}");
    let replayed = String::from_utf8(holdsafe(&["watch", run, "--json"]).stdout).unwrap();
    let last: Value = serde_json::from_str(replayed.lines().last().unwrap()).unwrap();
    assert!(last["replay"] == true && pictures.iter().all(|picture| picture["replay"] != true), "{last}");
    let (code, words) = blind(&["watch", run, "--window"]);
    assert_eq!(code, Some(5), "{words}");

    // The cores' inputs have been replayed; after that one in five sets of frames is enough to look at.
    let file = folder.path().join("run.mcap");
    let exported = object(&holdsafe(&["report", "--format", "mcap", run, "--out", file.to_str().unwrap(), "--json"]));
    let (exported_count, not_kept) = (message_counts(&exported)["/camera/rgb"], exported["not_kept"].as_u64().unwrap());
    assert!(
        not_kept > 0 && exported_count == (exported_count + not_kept).div_ceil(5),
        "{exported_count} kept, {not_kept} not"
    );

    // Mark of an INVALID recording on every picture in the window: absent here, and present in an invalid player.
    let marked = |player: &Player| player.shown().marks.invalid;
    let (player, _) = Player::open(&out).unwrap();
    assert_eq!(marked(&player), None);
    assert_eq!(marked(&player.invalid("event 7".to_owned())).as_deref(), Some("event 7"));
    flip_a_bit(&out);
    for line in [
        &["inspect", "replay", run][..],
        &["watch", run, "--once"],
        &["inspect", "explain", run],
        &["inspect", "diff", run, run],
    ] {
        let output = holdsafe(line);
        assert_eq!(output.status.code(), Some(4), "{line:?}: {output:?}");
        assert!(String::from_utf8_lossy(&output.stdout).starts_with("INVALID: "), "{line:?}: {output:?}");
    }
}

/// The refusal is one line with a remedy; no run is started.
#[test]
fn window_without_a_display_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let (code, text) = blind(&["run", "--live", "--watch", "nominal", "--console", "--out", out.to_str().unwrap()]);
    assert_eq!(code, Some(5));
    assert!(text.contains("holdsafe watch") && text.trim().lines().count() == 1, "{text}");
    let (code, text) = blind(&["run", "demo", "--live", "--console", "--out", out.to_str().unwrap()]);
    assert_eq!(code, Some(5), "{text}");
    assert!(text.contains("holdsafe watch") && text.trim().lines().count() == 1, "{text}");
    assert!(!out.exists(), "nothing was started");
}

/// A separate X server without a screen; `None` where there is none on this machine.
#[cfg(feature = "window")]
fn x_server() -> Option<(std::process::Child, String)> {
    let mut command = Command::new("Xvfb");
    command.args(["-displayfd", "1", "-screen", "0", "1400x900x24", "-nolisten", "tcp"]);
    let mut server = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().ok()?;
    let mut number = String::new();
    BufReader::new(server.stdout.take()?).read_line(&mut number).unwrap();
    Some((server, format!(":{}", number.trim())))
}

/// Drawn in software, inside confinement, until the user stops the run: with its window it would have ended before.
#[cfg(feature = "window")]
#[test]
fn a_confined_window_opens_and_stays() {
    let Some((mut server, display)) = x_server() else {
        return eprintln!("skipped: Xvfb is not installed");
    };
    let (folder, scenario) = short();
    let out = folder.path().join("run");
    let _alone = lock_machine();
    let mut live = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
    live.args(["--root", root().to_str().unwrap(), "run", &scenario, "--live", "--console", "--json"]);
    live.args(["--out", out.to_str().unwrap()]).env_remove("WAYLAND_DISPLAY");
    live.env("DISPLAY", display).env("LIBGL_ALWAYS_SOFTWARE", "1").env("HOME", folder.path());
    let mut live = live.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let journal = out.join("live/short/1/inputs/console.cbor");
    while !fs::metadata(&journal).is_ok_and(|meta| meta.len() > 0) && live.try_wait().unwrap().is_none() {
        std::thread::yield_now();
    }
    let pid = nix::unistd::Pid::from_raw(live.id() as i32);
    let (ended, ends) = std::sync::mpsc::channel();
    std::thread::spawn(move || ended.send(live.wait_with_output().unwrap()));
    // The scenario is over after two seconds; a run with an open window goes on.
    let early = ends.recv_timeout(std::time::Duration::from_secs(10));
    let stayed = early.is_err();
    let output = early.unwrap_or_else(|_| {
        nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGINT).unwrap();
        ends.recv().unwrap()
    });
    server.kill().unwrap();
    server.wait().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(stayed && text.contains("sealed as far as it came"), "{text}");
}

#[test]
fn a_window_is_for_one_live_trial() {
    let (code, text) = blind(&["run", "nominal", "--console"]);
    assert_eq!(code, Some(2));
    assert!(text.contains("--live"), "{text}");
    for more in [&["nominal", "replay"][..], &["nominal", "--trials", "2"], &["teammate"]] {
        let (code, text) = blind(&[&["run", "--live", "--console"][..], more].concat());
        assert_eq!(code, Some(2), "{more:?}: {text}");
        assert!(text.contains("--console opens a window on one trial"), "{text}");
    }
}

/// Such a folder is not opened in a window either.
#[test]
fn folder_without_a_run_is_not_watched() {
    let folder = tempfile::tempdir().unwrap();
    let none = folder.path().to_str().unwrap();
    for arguments in [&["watch", none][..], &["watch", none, "--window"], &["watch", "--sensors", none]] {
        let output = holdsafe(arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(matches!(output.status.code(), Some(2 | 4 | 5)), "{arguments:?}: {text}");
        assert!(text.contains(none) || text.contains("display"), "{arguments:?}: {text}");
        assert!(!text.contains("panicked"), "{text}");
    }
    let output = holdsafe(&["watch", folder.path().join("later").to_str().unwrap()]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && text.contains("is not waited for"), "{text}");
}
