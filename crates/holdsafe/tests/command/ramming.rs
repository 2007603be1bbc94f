//! A guest that drives at things: bare it hits them, inside the shell it stops.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fs;
use std::path::Path;

use serde_json::Value;

use super::{holdsafe, root};

/// Things of the yard that stand, with their middles, metres.
const THINGS: [(&str, [f64; 2]); 3] = [("car", [8.0, -3.0]), ("dummy", [6.0, -15.0]), ("crate", [2.0, 10.0])];
/// Distance ahead at the start and behind at the end, metres.
const AWAY: (f64, f64) = (9.0, 4.0);

/// Sides from which it comes: direction from the thing, and heading towards it.
const SIDES: [([f64; 2], f64); 4] =
    [([1.0, 0.0], PI), ([0.0, 1.0], -FRAC_PI_2), ([-1.0, 0.0], 0.0), ([0.0, -1.0], FRAC_PI_2)];

/// The yard with a start from which a straight way leads through a thing, `sideways` of its middle.
fn yard(dir: &Path, place: [f64; 2], ([east, north], heading): ([f64; 2], f64), sideways: f64) {
    let middle = [place[0] - sideways * north, place[1] + sideways * east];
    let along = |distance: f64| [middle[0] + distance * east, middle[1] + distance * north];
    let (from, to) = (along(AWAY.0), along(-AWAY.1));
    let shipped = fs::read_to_string(root().join("scenarios/scenes/yard.toml")).unwrap();
    let line = |line: &str| match line.split(" = ").next() {
        Some("start") => format!("start = {{ at_m = [{:.3}, {:.3}], heading_rad = {heading:.4} }}", from[0], from[1]),
        Some("route") => format!("route = [[{:.3}, {:.3}]]", to[0], to[1]),
        _ => line.to_owned(),
    };
    fs::write(dir.join("yard.toml"), shipped.lines().map(line).collect::<Vec<_>>().join("\n")).unwrap();
    let enable = "[[operator.step]]\nat_s = 1.0\nwhen_state = \"IDLE\"\ndo = \"enable\"\nreason = \"start\"\n";
    let head = "schema_version = 1\nname = \"ram\"\ntitle = \"Ram\"\ndescription = \"None.\"\nthreats = [\"N0\"]\nstride = []\ninterface = \"control\"\n\
                evidence = \"model\"\nrequirement = \"runtime-assurance\"\nexpected = [\"NOMINAL\"]\nduration_s = 14.0\nscene_file = \"yard.toml\"\n";
    fs::write(dir.join("ram.toml"), format!("{head}{enable}")).unwrap();
}

fn rammed(dir: &Path, bare: bool) -> Value {
    let file = dir.join("ram.toml");
    let more: &[&str] = if bare { &["--bare"] } else { &[] };
    let run = ["run", file.to_str().unwrap(), "--autonomy", "follower", "--trials", "1", "--json"];
    let output = holdsafe(&[&run, more].concat());
    let object: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{output:?}"));
    object["trials"][0].clone()
}

/// Approaches from all sides, at the middle, between it and a corner, and at a corner.
#[test]
fn guest_that_rams_is_stopped_at_every_thing() {
    let dir = tempfile::tempdir().unwrap();
    for (name, at) in THINGS {
        for side in SIDES {
            for beside in [0.0, 0.55, 1.1] {
                yard(dir.path(), at, side, beside);
                let cell = format!("{name}, heading {:.1}, {beside} m beside", side.1);
                let guarded = rammed(dir.path(), false);
                assert_ne!(guarded["outcome"], "UNSAFE", "{cell}: {guarded}");
                assert_eq!(guarded["receipt"], true, "{cell}: {guarded}");
                assert!(guarded["mission"]["driven_m"].as_f64().unwrap() > 3.0, "{cell}: {guarded}");
                let bare = rammed(dir.path(), true);
                assert_eq!(bare["outcome"], "UNSAFE", "{cell}, bare: {bare}");
            }
        }
    }
}
