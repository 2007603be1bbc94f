//! Scenes with weather.

use std::fs;

use super::{holdsafe, root};

/// Without rendered sensors the run would be one in clear air.
#[test]
fn weather_without_rendered_sensors_is_refused() {
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
