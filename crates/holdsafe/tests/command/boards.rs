//! `holdsafe guest board`: rows of guests that are signed, verified, shown and run again.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Output;

use serde_json::Value;

use super::guests::{STRAIGHT, guest};
use super::{holdsafe, root};

/// `guest board` with these arguments.
fn board(arguments: &[&str]) -> Output {
    holdsafe(&[&["guest", "board"], arguments].concat())
}

fn object(arguments: &[&str]) -> Value {
    let output = board(&[arguments, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Exit code and stderr of a command that is refused.
fn refusal(arguments: &[&str]) -> (Option<i32>, String) {
    let output = board(arguments);
    let lines = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8(lines).unwrap())
}

/// Paths below a folder, as text.
fn paths<const N: usize>(dir: &Path, names: [&str; N]) -> [String; N] {
    names.map(|name| dir.join(name).to_str().unwrap().to_owned())
}

#[test]
fn signed_rows_are_verified_and_run_again() {
    let dir = tempfile::tempdir().unwrap();
    let [key, file, out] = paths(dir.path(), ["key", "board.json", "out"]);
    let public = object(&["key", &key])["public"].as_str().unwrap().to_owned();
    let mode = fs::metadata(&key).unwrap().permissions().mode();
    assert_eq!((mode & 0o777, refusal(&["key", &key]).0), (0o600, Some(2)), "no key is overwritten");
    let add =
        ["add", &file, "follower", "--scenarios", "localisation_freeze", "--trials", "2", "--key", &key, "--name"];
    let add: Vec<&str> = [&add[..], &["A. Tester", "--out", &out]].concat();
    assert_eq!(object(&add)["added"], 2);

    assert_eq!(object(&["verify", &file, "--key", &public])["holds"], true);
    let shown = object(&["show", &file]);
    let harm = |conduct: &str| shown["rows"][0][conduct]["harm"]["hits"].as_u64();
    assert_eq!((harm("bare"), harm("guarded")), (Some(2), Some(0)), "{shown}");
    for row in ["1", "2"] {
        let replay = object(&["replay", &file, "--row", row]);
        assert_eq!((&replay["verdict"], &replay["same_logs"]), (&"reproduced".into(), &2.into()), "{replay}");
        assert_eq!(replay["remarks"].as_array().map(Vec::len), Some(0), "{replay}");
    }
    let (code, screen) = refusal(&add);
    assert!(code == Some(2) && screen.contains("row 1 is follower bare, localisation_freeze"), "{screen}");
    let unnamed: Vec<&str> = add.iter().map(|word| if *word == "A. Tester" { "<b>" } else { word }).collect();
    let (code, screen) = refusal(&unnamed);
    assert!(code == Some(2) && screen.contains("contributor.name: 1 to 64 letters"), "{screen}");
    let stranger = object(&["key", &(key.clone() + "2")])["public"].as_str().unwrap().to_owned();
    let (code, screen) = refusal(&["verify", &file, "--key", &stranger]);
    assert!(code == Some(4) && screen.contains("INVALID: row 2") && screen.contains("none of the keys"), "{screen}");
}

#[test]
fn altered_board_names_its_row() {
    let dir = tempfile::tempdir().unwrap();
    let [key, file, out] = paths(dir.path(), ["key", "board.json", "out"]);
    object(&["key", &key]);
    let add =
        ["add", &file, "follower", "--scenarios", "nominal", "--trials", "1", "--key", &key, "--name", "A. Tester"];
    let add = [&add[..], &["--out", &out]].concat();
    object(&add);
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replacen("A. Tester", "B. Tester", 1)).unwrap();
    let (code, screen) = refusal(&["verify", &file]);
    assert!(code == Some(4) && screen.contains("INVALID: row 1 (follower bare, nominal, own scene"), "{screen}");
    for more in [&["show", &file][..], &["replay", &file, "--row", "1"], &["merge", &file, &file], &add] {
        let (code, screen) = refusal(more);
        assert!(code == Some(4) && screen.contains("signature: not the contributor's"), "{screen}");
    }
    fs::write(&file, text.replacen("\"schema_version\":1", "\"schema_version\":9", 1)).unwrap();
    let (code, screen) = refusal(&["verify", &file]);
    assert!(code == Some(2) && screen.contains("schema_version 1 expected, got 9"), "{screen}");
    fs::set_permissions(&key, fs::Permissions::from_mode(0o644)).unwrap();
    fs::write(&file, text).unwrap();
    let (code, screen) = refusal(&add);
    assert!(code == Some(2) && screen.contains("others may read this key"), "{screen}");
}

/// A world for each trial, and a guest of the user's own that is another one later.
#[test]
fn row_in_worlds_is_of_its_guest_alone() {
    let dir = tempfile::tempdir().unwrap();
    let [key, file, out] = paths(dir.path(), ["key", "board.json", "out"]);
    let file_of_guest = guest(dir.path(), STRAIGHT, "");
    object(&["key", &key]);
    let add =
        ["add", &file, &file_of_guest, "--scenarios", "localisation_freeze", "--world", "crossing", "--trials", "2"];
    object(&[&add[..], &["--key", &key, "--name", "A. Tester", "--out", &out]].concat());
    let replay = ["replay", &file, "--row", "1", "--trials", "1"];
    let named = [&replay[..], &["--autonomy", &file_of_guest]].concat();
    let repeated = object(&named);
    assert_eq!(
        (&repeated["verdict"], &repeated["trials"], &repeated["of"]),
        (&"reproduced".into(), &1.into(), &2.into())
    );
    let (code, screen) = refusal(&replay);
    assert!(code == Some(2) && screen.contains("guests/scripted/guest.toml"), "{screen}");
    guest(dir.path(), STRAIGHT, "[limits]\nstep_ms = 999\n");
    let (code, screen) = refusal(&named);
    assert!(code == Some(2) && screen.contains("guest's file: the row has"), "{screen}");
}

#[test]
fn committed_leaderboard_holds_under_its_published_key() {
    let page = fs::read_to_string(root().join("docs/researcher/leaderboard.md")).unwrap();
    let key = page.split("--key ").nth(1).and_then(|rest| rest.split_whitespace().next()).unwrap();
    let file = root().join("docs/results/leaderboard.json");
    let verified = object(&["verify", file.to_str().unwrap(), "--key", key]);
    assert!(verified["holds"] == true && verified["rows"].as_u64().unwrap() > 10, "{verified}");
}
