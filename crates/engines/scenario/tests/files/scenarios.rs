//! Answers to bad files: message, marked text, line, remedy. One table, one row a mistake.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use evidence::trial::Outcome;
use scenario::*;

pub(super) fn root() -> PathBuf {
    find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn template_named_x() -> String {
    template(&Name::new("x").unwrap())
}

fn only_problem(text: &str) -> Problem {
    let problems = parse("x.toml", "x", text).unwrap_err();
    assert_eq!(problems.all().len(), 1, "{problems}");
    problems.all()[0].clone()
}

/// The template with one mistake made in it: (found, replaced by, message holds, marked text).
const MISTAKES: [(&str, &str, &str, &str); 36] = [
    ("[[loss]]", "[conditions]\nloss = 0.02\n[[loss]]", "a condition of the link and an attack", "0.02"),
    ("threats =", "threads =", "unknown field `threads`", "threads"),
    ("share = 1.0", "share = 1.0\nshar = 2", "unknown field `shar`, expected", "shar"),
    ("share = 1.0", "share = \"all\"", "invalid type: string \"all\", expected a number from 0 to 1", "\"all\""),
    ("share = 1.0", "share = 1.5", "1.5 is out of range, expected 0 to 1", "1.5"),
    ("share = 1.0", "share = nan", "NaN is not a finite number", "nan"),
    ("share = 1.0", "share = inf", "inf is not a finite number", "inf"),
    ("share = 1.0", "", "missing field `share`", "[[loss]]"),
    ("duration_s = 9.0", "duration_s = -1", "-1 is out of range, expected 0.1 to 7200", "-1"),
    ("duration_s = 9.0", "duration_s = 9.0.0", "invalid float", ".0"),
    ("schema_version = 1", "schema_version = 2", "2 is out of range, expected 1 to 1", "2"),
    ("name = \"x\"", "name = \"y\"", "the file is named `x`", "\"y\""),
    ("name = \"x\"", "name = \"../x\"", "a name is 1 to 48 of a-z", "\"../x\""),
    ("policy = \"default\"", "policy = \"/etc/passwd\"", "a name is 1 to 48 of a-z", "\"/etc/passwd\""),
    ("[\"A04\"]", "[\"A99\"]", "no such row in the threat catalogue", "\"A99\""),
    ("[\"T0814\"]", "[\"X0814\"]", "not a technique id", "\"X0814\""),
    ("[\"denial-of-service\"]", "[\"D\"]", "unknown variant `D`, expected one of `spoofing`", "\"D\""),
    ("[\"HOLD_SAFE\"]", "[]", "no expected class", "[]"),
    ("[\"HOLD_SAFE\"]", "[\"SAFE\"]", "unknown variant `SAFE`", "\"SAFE\""),
    ("[\"HOLD_SAFE\"]", "[\"LATE\", \"LATE\"]", "a class is named twice", "[\"LATE\", \"LATE\"]"),
    ("[0.0, 1.0]  ", "[1.0, 0.0]  ", "the phase ends before it begins", "[1.0, 0.0]"),
    ("[0.0, 1.0]  ", "[1.0]  ", "a phase has two numbers", "[1.0]"),
    ("at_s = 4.0", "at_s = 8.5", "the trial ends at 9 s", "8.5"),
    ("when_track = \"vehicle\"\n", "", "arming needs a track", "\"arm\""),
    ("reason = \"start of the mission\"", "", "a step away from safe needs a reason", "\"enable\""),
    ("at_s = 1.0", "at_s = 3.0", "earlier than the step before", "2.5"),
    (
        "[-15.0, -5.0]",
        "[-45.0, -5.0]",
        "the platform starts outside its geofence",
        "{ at_m = [-45.0, -5.0], heading_rad = 0.0 }",
    ),
    ("[-8.0, -5.0]", "[45.0, -5.0]", "a way point lies outside the geofence", "[45.0, -5.0]"),
    (
        "[[loss]]",
        "[[fault]]\nsensor = \"rgb\"\nkind = \"perturbation\"\nat_s = 1\nduration_s = 1\nmagnitude = [8]\n[[loss]]",
        "the scene has no perturbation",
        "[8]",
    ),
    (
        "[[loss]]",
        "[[fault]]\nsensor = \"rgb\"\nkind = \"perturbation\"\nat_s = 1\nduration_s = 1\nmagnitude = [8.5]\n[[loss]]",
        "no strength of a perturbation",
        "[8.5]",
    ),
    ("[-8.0, -5.0]", "[501.0, -5.0]", "501 is out of range, expected -500 to 500", "501.0"),
    (
        "[[loss]]",
        "[[teammate]]\nform = \"verbatim\"\nc = \"silent\"\nat_s = 4\nduration_s = 1\n[[unit]]\nname = \"unit-b\"\n\
      role = \"insider\"\nstart = { at_m = [0, 0] }\n[[loss]]",
        "there is no unit C to forward",
        "4",
    ),
    (
        "[[loss]]",
        "[[fault]]\nsensor = \"lidar\"\nkind = \"jump\"\nat_s = 3\nduration_s = 1\nmagnitude = [1, 1]\n[[loss]]",
        "lidar has no fault of kind jump",
        "3",
    ),
    (
        "[[loss]]",
        "[[fault]]\nsensor = \"localisation\"\nkind = \"scale\"\nat_s = 3\nduration_s = 1\nmagnitude = [2]\n[[loss]]",
        "localisation has no fault of kind scale",
        "3",
    ),
    (
        "[[loss]]",
        "[[fault]]\nsensor = \"odometry\"\nkind = \"drift\"\nat_s = 3\nduration_s = 1\nmagnitude = [3.1]\n[[loss]]",
        "no error that odometry can be given",
        "[3.1]",
    ),
    (
        "[[loss]]",
        "[[fault]]\nsensor = \"rgb\"\nkind = \"noise\"\nat_s = 3\nduration_s = 1\n[[loss]]",
        "this kind needs a magnitude",
        "3",
    ),
];

#[test]
fn each_mistake_has_place_and_remedy() {
    let mut wrong = Vec::new();
    for (from, to, message, marked) in MISTAKES {
        let text = template_named_x().replacen(from, to, 1);
        assert_ne!(text, template_named_x(), "{from} is not in the template");
        let problem = only_problem(&text);
        let right = problem.message().contains(message) && problem.marked() == Some(marked);
        if !right || problem.remedy().is_empty() || problem.line_column().is_none() {
            wrong.push(format!("{to}\n  marks {:?}: {}", problem.marked(), problem.message()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// An error fits one screen.
#[test]
fn error_screen_names_file_line_and_remedy() {
    let text = template_named_x().replace("share = 1.0", "share = 1.5");
    let screen = parse("x.toml", "x", &text).unwrap_err().render(false);
    let line = text.lines().position(|l| l == "share = 1.5").unwrap() + 1;
    assert!(screen.contains(&format!("x.toml:{line}:9")), "{screen}");
    assert!(screen.contains("help: use a number within the range"), "{screen}");
    assert!(screen.lines().count() < 24, "{screen}");
}

#[test]
fn long_mistakes_are_marked_in_their_first_line() {
    let problem = Problem::new("x.toml", &"row\n".repeat(400), 4..1200, "wrong", "right it");
    assert_eq!((problem.marked(), problem.line_column()), (Some("row"), Some((2, 1))));
    assert!(Problems::from(problem).render(false).lines().count() < 12);
}

#[test]
fn the_template_is_a_valid_scenario() {
    parse("x.toml", "x", &template_named_x()).unwrap();
}

/// Its platform and policies load, too.
#[test]
fn every_shipped_scenario_is_valid_and_short() {
    let files = shipped(&root()).unwrap();
    assert!(files.len() >= 12, "{files:?}");
    for file in files {
        let scenario = load(&file).unwrap_or_else(|e| panic!("{}", e.render(false)));
        // 299 trials of it take about a minute of CPU.
        assert!(scenario.duration_s.get() <= 120.0, "{}", file.display());
        for variation in scenario.variations(None) {
            Setup::load(&root(), &variation.scenario, None, false).unwrap_or_else(|e| panic!("{}", e.render(false)));
        }
        for under in &scenario.under {
            let Some(policy) = &under.policy else { continue };
            let policy = root().join("policies").join(format!("{}.toml", policy.as_str()));
            Setup::load(&root(), &scenario, Some(&policy), false).unwrap_or_else(|e| panic!("{}", e.render(false)));
        }
    }
}

#[test]
fn every_shipped_scenario_fits_the_printed_schema() {
    let validator = jsonschema::validator_for(&schema()).unwrap();
    for file in shipped(&root()).unwrap() {
        let value: serde_json::Value = toml::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
        let errors: Vec<String> = validator.iter_errors(&value).map(|e| e.to_string()).collect();
        assert!(errors.is_empty(), "{}: {errors:?}", file.display());
    }
}

#[test]
fn shipped_scenarios_lie_by_interface_under_unique_names() {
    let mut names = std::collections::BTreeSet::new();
    for file in shipped(&root()).unwrap() {
        let folder = file.parent().and_then(Path::file_name).and_then(|name| name.to_str()).unwrap();
        assert_eq!(load(&file).unwrap().interface.folder(), folder, "{}", file.display());
        assert!(Interface::FOLDERS.contains(&folder));
        assert!(names.insert(file.file_name().unwrap().to_owned()), "{} is there twice", file.display());
    }
    let further = [rendered(&root()).unwrap(), demo(&root()).unwrap(), honest(&root()).unwrap()].concat();
    assert!(further.iter().all(|file| names.insert(file.file_name().unwrap().to_owned())), "{further:?}");
}

#[test]
fn every_honest_fault_is_a_twin_of_shipped_attacks() {
    let files = honest(&root()).unwrap();
    assert!(files.len() >= 8, "{files:?}");
    for file in files {
        let scenario = load(&file).unwrap_or_else(|e| panic!("{}", e.render(false)));
        assert!(!scenario.twin_of.is_empty(), "{} is a twin of no attack", file.display());
        assert!(scenario.duration_s.get() <= 120.0, "{}", file.display());
        for attack in scenario.twin_of.iter() {
            let other =
                scenario::find(&root(), attack.as_str()).unwrap_or_else(|| panic!("no scenario {}", attack.as_str()));
            assert!(load(&other).unwrap().twin_of.is_empty(), "{} is itself a twin", attack.as_str());
        }
    }
}

#[test]
fn platform_file_has_the_bounds_of_wire() {
    let platform = load_platform(&root().join("platforms/ground.toml")).unwrap();
    assert_eq!(platform.bounds.to_bounds(), wire::bounds::Bounds::GROUND);
}

#[test]
fn teammate_table_has_every_form_presence_and_policy() {
    let scenario = load(&root().join("scenarios/telemetry/teammate.toml")).unwrap();
    let cells = scenario.variations(None);
    assert_eq!(cells.len(), 18);
    assert_eq!(scenario.variations(Some("session-bound")).len(), 6);
    let last = cells.last().unwrap();
    assert_eq!(last.cell.as_deref(), Some("re-signed/silent/origin-signed"));
    assert_eq!(last.scenario.teammate[0].form, Form::ReSigned);
    assert_eq!(last.scenario.policy.as_str(), "origin-signed");
}

#[test]
fn another_policy_brings_its_own_expectation_or_none() {
    let scenario = load(&root().join("scenarios/telemetry/alert.toml")).unwrap();
    let expected = |policy| scenario.variations(policy)[0].scenario.expected.to_vec();
    assert_eq!(expected(None), [Outcome::Rejected]);
    assert_eq!(expected(Some("guard-off")), [Outcome::HoldSafe]);
    assert_eq!(expected(Some("session-only")), []);
}

/// A loosened bound is refused; a tightened one is in force.
#[test]
fn bounds_are_tightened_and_never_loosened() {
    let with_bound = |bound: &str| {
        parse("x.toml", "x", &template_named_x().replace("[varies]", &format!("[bounds]\n{bound}\n[varies]")))
    };
    let refused = Setup::load(&root(), &with_bound("lease_ms = 501").unwrap(), None, false).unwrap_err();
    assert!(refused.to_string().contains("501 ms is looser than the platform's 500 ms"), "{refused}");
    let setup = Setup::load(&root(), &with_bound("lease_ms = 400").unwrap(), None, false).unwrap();
    assert_eq!((setup.bounds.lease_ms, setup.bounds.freshness_ms), (400, 300));
    assert_eq!(setup.watermark(), None);
    let setup = Setup::load(&root(), &with_bound("designation_bearings_mrad = 524").unwrap(), None, false).unwrap();
    assert_eq!(setup.bounds.designation_bearings_mrad, 524);
    assert!(with_bound("designation_bearings_mrad = 3143").is_err(), "more than half a turn");
}

/// A missing file, a directory and a gigabyte.
#[test]
fn unfit_files_are_refused_unread() {
    let dir = tempfile::tempdir().unwrap();
    let error_text = |path: &Path| load(path).unwrap_err().to_string();
    assert!(error_text(&dir.path().join("none.toml")).ends_with("none.toml: no such file"));
    assert!(error_text(dir.path()).ends_with("not a regular file"));
    let huge = dir.path().join("huge.toml");
    File::create(&huge).unwrap().set_len(1_000_000_000).unwrap();
    assert!(error_text(&huge).ends_with("1000000000 bytes, at most 262144 are read"));
}

#[test]
fn non_text_file_is_refused_with_its_line() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.toml");
    fs::write(&path, b"name = 1\n\xff\xfe").unwrap();
    assert!(load(&path).unwrap_err().to_string().ends_with("line 2 is not UTF-8"));
}

/// The template with its scene in its own file, and that scene.
fn split_scene(path: &str) -> (String, String) {
    let text = template_named_x();
    let (head, rest) = text.split_once("[scene]").unwrap();
    let (scene, tail) = rest.split_once("# The operator").unwrap();
    let head = head.replace("[varies]", &format!("scene_file = \"{path}\"\n[varies]"));
    (format!("{head}# The operator{tail}"), scene.replace("[[scene.object]]", "[[object]]"))
}

#[test]
fn a_scene_file_stays_below_its_scenario() {
    let outside = tempfile::tempdir().unwrap();
    let dir = tempfile::tempdir().unwrap();
    let load_with = |path: &str| {
        let (scenario, scene) = split_scene(path);
        fs::write(outside.path().join("scene.toml"), &scene).unwrap();
        fs::write(dir.path().join("scene.toml"), &scene).unwrap();
        fs::write(dir.path().join("x.toml"), scenario).unwrap();
        load(&dir.path().join("x.toml"))
            .map_err(|e| (e.all()[0].message().to_owned(), e.all()[0].marked().map(str::to_owned)))
    };
    assert!(load_with("scene.toml").is_ok());
    for escape in ["../scene.toml", "/etc/passwd", "a/../../scene.toml", "./scene.toml", "a//b"] {
        let (message, marked) = load_with(escape).unwrap_err();
        assert!(message.starts_with("path leaves the scenario directory"), "{escape}: {message}");
        assert_eq!(marked.as_deref(), Some(format!("\"{escape}\"").as_str()));
    }
    assert_eq!(load_with("gone.toml").unwrap_err().0, "no such file");
    std::os::unix::fs::symlink(outside.path(), dir.path().join("link")).unwrap();
    assert_eq!(load_with("link/scene.toml").unwrap_err().0, "path leads through a symbolic link");
}

#[test]
fn scene_file_errors_point_into_that_file() {
    let dir = tempfile::tempdir().unwrap();
    let (scenario, scene) = split_scene("scene.toml");
    fs::write(dir.path().join("x.toml"), scenario).unwrap();
    fs::write(dir.path().join("scene.toml"), scene.replace("temperature_k = 318.0", "temperature_k = 9000")).unwrap();
    let problems = load(&dir.path().join("x.toml")).unwrap_err();
    assert!(problems.rows()[0].file.ends_with("scene.toml"));
    assert_eq!(problems.all()[0].marked(), Some("9000"));
}

/// A policy may only waive checks that exist.
#[test]
fn unknown_check_is_refused_at_its_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("odd.toml");
    fs::write(&path, "name = \"odd\"\n[boundary]\nlength = \"waived\"\n").unwrap();
    let problems = load_policy(&path, "odd").unwrap_err();
    assert!(problems.all()[0].message().contains("unknown variant `length`"), "{problems}");
    assert_eq!(problems.all()[0].line_column().map(|p| p.0), Some(3));
}
