//! `dataset`, and scenes with weather.

use std::fs;

use serde_json::Value;

use super::{holdsafe, root};

#[test]
fn the_same_frames_come_out_again_and_a_folder_that_is_whole_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str| {
        let dir = folder.path().join(name);
        let options =
            ["--cell", "rain", "--split", "novel", "--frames", "2", "--seed", "5", "--detect", "-q", "--json"];
        let arguments: Vec<&str> = ["dataset", dir.to_str().unwrap()].into_iter().chain(options).collect();
        holdsafe(&arguments)
    };
    let (first, again) = (write("first"), write("again"));
    assert_eq!(first.stdout, again.stdout);
    let manifest: Value = serde_json::from_slice(&first.stdout).unwrap();
    assert_eq!((&manifest["kind"], &manifest["frames"]), (&"dataset".into(), &2.into()));
    for (path, digest) in manifest["files"].as_object().unwrap() {
        let bytes = fs::read(folder.path().join("first").join(path)).unwrap();
        assert_eq!(digest.as_str(), Some(perception::model::hex_digest(&bytes).as_str()), "{path}");
    }
    let refused = write("first");
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("is there already"));
}

#[test]
fn a_cell_that_there_is_not_is_answered_with_those_that_there_are() {
    let refused = holdsafe(&["bench", "detector", "--cell", "snow"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("there are clear, dusk"));
}

#[test]
fn weather_without_the_sensors_that_see_it_is_no_run_in_clear_air() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("scenes")).unwrap();
    let yard = fs::read_to_string(root().join("scenarios/scenes/yard.toml")).unwrap();
    let foggy = yard.replacen("[ground]", "[weather]\nvisibility_m = 40.0\n\n[ground]", 1);
    fs::write(folder.path().join("scenes/yard.toml"), foggy).unwrap();
    let file = folder.path().join("nominal.toml");
    fs::copy(root().join("scenarios/control/nominal.toml"), &file).unwrap();
    let refused = holdsafe(&["run", file.to_str().unwrap(), "--trials", "1"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--rendered"), "{refused:?}");
}
