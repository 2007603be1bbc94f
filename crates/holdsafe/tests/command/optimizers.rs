//! A program that proposes the sequences of a search: asked, informed, refused, and ended.

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::{Value, json};

use super::{holdsafe, root};

/// An executable shell script that has read its first line.
fn script(dir: &Path, body: &str) -> PathBuf {
    let file = dir.join("own.sh");
    fs::write(&file, format!("#!/bin/sh\nread begin\n{body}\n")).unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
    file
}

/// Arguments of a search of 20 trials for records that are accepted too old.
fn search<'a>(program: &'a Path, out: &'a Path) -> [&'a str; 12] {
    let [program, out] = [program, out].map(|path| path.to_str().unwrap());
    let budget = ["--budget", "20", "--optimizer", program, "--out", out, "--json", "--quiet"];
    let mut all = ["search", "nominal", "--waive", "boundary.freshness", "", "", "", "", "", "", "", ""];
    all[4..].copy_from_slice(&budget);
    all
}

/// The lines that a script wrote.
fn lines(file: &Path) -> Vec<Value> {
    fs::read_to_string(file).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// The first line that a program receives.
fn begin(dir: &Path) -> Value {
    let heard = dir.join("begin");
    let program = script(dir, &format!("echo \"$begin\" > {}", heard.display()));
    assert_eq!(holdsafe(&search(&program, &dir.join("none"))).status.code(), Some(2), "it proposes none");
    lines(&heard).remove(0)
}

#[test]
fn own_optimizer_is_told_its_results() {
    let dir = tempfile::tempdir().unwrap();
    let begin = begin(dir.path());
    assert_eq!((&begin["space"], &begin["budget"], &begin["seed"]), (&"path".into(), &20.into(), &1.into()));
    // Records held for long, while their age is not checked.
    let moves = begin["moves"].as_array().unwrap();
    let hold = moves.iter().position(|value| value["name"] == "hold").unwrap();
    let action = json!({ "move": hold, "begins": begin["begins"][0], "places": moves[hold]["last"] });
    let answer = json!({ "sequences": [[action]] });
    let heard = dir.path().join("heard");
    let body = format!("while read round; do echo \"$round\" >> {}; echo '{answer}'; done", heard.display());
    let output = holdsafe(&search(&script(dir.path(), &body), &dir.path().join("out")));
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    let (strategy, trials) = (&object["hunt"]["strategy"], &object["hunt"]["trials"]);
    assert_eq!((strategy, trials), (&"optimizer:own.sh".into(), &20.into()), "{object}");
    assert_eq!(object["findings"][0]["trial"], 1, "{object}");
    let rounds = lines(&heard);
    let counts: Vec<usize> = rounds.iter().map(|round| round["results"].as_array().unwrap().len()).collect();
    assert_eq!((counts.len(), counts[0]), (21, 0), "one sequence a round, and the end: {counts:?}");
    assert!(counts[1..].iter().all(|n| *n == 1), "{counts:?}");
    let result = &rounds[1]["results"][0];
    assert_eq!((&result["class"], &result["finding"]), (&"UNSAFE".into(), &true.into()), "{result}");
    let most: Vec<&Value> = [0, 4, 19, 20].iter().map(|i| &rounds[*i]["most"]).collect();
    assert_eq!(most, [16, 16, 1, 0], "a round asks for no more than the budget has left");
}

/// Results in the order of the sequences, with two threads; also those behind a finding that ends the search.
#[test]
fn results_come_in_order_of_the_sequences() {
    let dir = tempfile::tempdir().unwrap();
    let begin = begin(dir.path());
    let moves = begin["moves"].as_array().unwrap();
    let hold = moves.iter().position(|value| value["name"] == "hold").unwrap();
    let action = |places: &Value| json!([{ "move": hold, "begins": begin["begins"][0], "places": places }]);
    let (weak, strong) = (action(&json!([0, 0])), action(&moves[hold]["last"]));
    let answer = json!({ "sequences": [weak, strong, weak, weak] });
    let heard = dir.path().join("heard");
    let body = format!("while read round; do echo \"$round\" >> {}; echo '{answer}'; done", heard.display());
    let program = script(dir.path(), &body);
    for (more, told) in [(&["--jobs", "2"][..], vec![0, 4, 4, 4, 4, 4]), (&["--first", "--jobs", "1"], vec![0, 2])] {
        let _none_before = fs::remove_file(&heard);
        let output = holdsafe(&[&search(&program, &dir.path().join(told.len().to_string()))[..], more].concat());
        assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
        let rounds = lines(&heard);
        let results = |round: &Value| round["results"].as_array().unwrap().clone();
        assert_eq!(rounds.iter().map(|round| results(round).len()).collect::<Vec<_>>(), told);
        let found: Vec<bool> = results(&rounds[1]).iter().map(|result| result["finding"] == true).collect();
        assert_eq!(found, [false, true, false, false][..found.len()]);
        assert_eq!(rounds.last().unwrap()["most"], 0, "the last results come without a request");
    }
}

/// The refusal has exit code 2 and names the place of the fault.
#[test]
fn unfit_answers_are_refused_with_their_place() {
    let dir = tempfile::tempdir().unwrap();
    let action = |action: &str| format!("read round; echo '{{\"sequences\":[[{action}]]}}'; read round");
    let wrong = [
        ("exit 7".to_owned(), "its output ended before the search did, with exit code 7"),
        ("read round; exec >&-; while read round; do :; done".to_owned(), "its output ended"),
        ("read round; echo surprise; read round".to_owned(), "expected value"),
        ("read round; echo '{\"sequences\":[],\"more\":1}'; read round".to_owned(), "unknown field `more`"),
        ("read round; echo '{\"sequences\":[]}'; read round".to_owned(), "0 sequences; 1 to 16 were asked for"),
        (
            "read round; echo '{\"sequences\":[[]]}'; read round".to_owned(),
            "sequence 0: 0 actions; a sequence has 1 to",
        ),
        (action(r#"{"move":99,"begins":60,"places":[]}"#), "sequence 0: action 0: move 99; the last is"),
        (action(r#"{"move":0,"begins":0,"places":[]}"#), "begins at tick 0; the attack space has"),
        (action(r#"{"move":0,"begins":60,"places":[1,2,3,4,5,6]}"#), "6 places; its move has"),
        (action(r#"{"move":0,"begins":60,"places":[4000000000]}"#), "place 4000000000 of number 0; the last is"),
        ("read round; head -c 2000000 /dev/zero; read round".to_owned(), "more than 1048576 bytes in a line"),
        (
            "while :; do echo '{\"sequences\":[[{\"move\":0,\"begins\":60,\"places\":[1]}]]}'; done".to_owned(),
            "before its request was read",
        ),
        ("read round; printf '{\"\\033[2J\":1}\\n'; read round".to_owned(), "control character"),
    ];
    for (body, message) in wrong {
        let program = script(dir.path(), &body);
        let output = holdsafe(&search(&program, &dir.path().join("out")));
        let value: Value = serde_json::from_slice(&output.stdout).unwrap();
        let error = value["error"].as_str().unwrap_or_default();
        assert_eq!(output.status.code(), Some(2), "{body}: {value}");
        assert!(error.contains(message) && error.starts_with("optimizer own.sh, answer "), "{body}: {error}");
    }
    let none = holdsafe(&search(&dir.path().join("none"), &dir.path().join("out")));
    let line = String::from_utf8(none.stdout).unwrap();
    assert!(line.contains("No such file") && line.contains("can be executed"), "{line}");
    let text = dir.path().join("text");
    fs::write(&text, "words").unwrap();
    let line = String::from_utf8(holdsafe(&search(&text, &dir.path().join("out"))).stdout).unwrap();
    assert!(line.contains("ermission denied") && line.contains("can be executed"), "{line}");
}

/// Also one that neither reads nor answers; its process and that process's own are gone.
#[test]
fn interrupt_ends_silent_optimizer_too() {
    let dir = tempfile::tempdir().unwrap();
    let program = script(dir.path(), "tail -f /dev/null & echo $! >&2; wait");
    let mut search = Command::new(env!("CARGO_BIN_EXE_holdsafe"))
        .args(["--root", root().to_str().unwrap()])
        .args(search(&program, &dir.path().join("out")))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut id = String::new();
    BufReader::new(search.stderr.as_mut().unwrap()).read_line(&mut id).unwrap();
    kill(Pid::from_raw(search.id() as i32), Signal::SIGINT).unwrap();
    assert_eq!(search.wait().unwrap().code(), Some(130));
    // Gone, or waiting for its new parent to look at it. A process that outlives the search is waited for without end.
    let state = || fs::read_to_string(format!("/proc/{}/stat", id.trim())).unwrap_or_default();
    while !(state().is_empty() || state().contains(") Z ")) {
        std::thread::yield_now();
    }
}

#[test]
fn search_with_an_optimizer_has_no_partitions() {
    let dir = tempfile::tempdir().unwrap();
    let program = script(dir.path(), "exit 1");
    let jobs = dir.path().join("jobs");
    let [program, jobs] = [&program, &jobs].map(|path| path.to_str().unwrap());
    let emit = ["emit", "make", "--partitions", "2", "--out", jobs, "--", "search", "nominal", "--optimizer", program];
    let output = holdsafe(&emit);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("depends on the results of earlier ones"), "{text}");
}
