//! `lab dataset` and `lab detector`.

use std::fs;

use serde_json::Value;

use super::lab;

#[test]
fn frames_are_reproducible_and_whole_folders_untouched() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str| {
        let dir = folder.path().join(name);
        let options =
            ["--cell", "rain", "--split", "novel", "--frames", "2", "--seed", "5", "--detect", "-q", "--json"];
        let arguments: Vec<&str> = ["dataset", dir.to_str().unwrap()].into_iter().chain(options).collect();
        lab(&arguments)
    };
    let (first, repeated) = (write("first"), write("again"));
    assert_eq!(first.stdout, repeated.stdout);
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
fn unknown_cell_is_answered_with_the_known_ones() {
    let refused = lab(&["detector", "--cell", "snow"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("there are clear, dusk"));
}
