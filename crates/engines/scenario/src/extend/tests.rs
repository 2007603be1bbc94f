//! Scenarios that extend others, in their own folder.

use std::fs;

use super::super::{Name, Problems, Scenario, load, load_with, template};

/// Keys of a file that takes everything else from its base.
const HEAD: &str = "schema_version = 1\nname = \"one\"\nextends = \"base\"\ntitle = \"One\"\ndescription = \"One.\"\n\
                    threats = [\"A04\"]\nstride = []\ninterface = \"telemetry-link\"\nevidence = \"model\"\n\
                    requirement = \"communication-trust\"\nexpected = [\"HOLD_SAFE\"]\n";

fn base() -> String {
    template(&Name::new("base").unwrap())
}

/// `one.toml` with this text, beside these other files.
fn one(text: &str, rest: &[(&str, &str)]) -> Result<Scenario, Problems> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in rest.iter().chain(&[("one", text)]) {
        fs::write(folder.path().join(format!("{name}.toml")), text).unwrap();
    }
    load(&folder.path().join("one.toml"))
}

/// The one problem, with the name of its file in place of its path.
fn problem(text: &str, rest: &[(&str, &str)]) -> String {
    let problems = one(text, rest).unwrap_err();
    assert_eq!(problems.all().len(), 1, "{problems}");
    let line = problems.all()[0].to_string();
    line.rsplit_once('/').map_or(line.clone(), |(_, file)| file.to_owned())
}

#[test]
fn what_is_left_out_comes_from_the_base() {
    let (scenario, base) = (one(HEAD, &[("base", &base())]).unwrap(), template(&Name::new("base").unwrap()));
    let base = super::super::parse("base.toml", "base", &base).unwrap();
    assert_eq!((scenario.name.as_str(), scenario.title.as_str()), ("one", "One"));
    assert_eq!((&scenario.operator, &scenario.scene, &scenario.loss), (&base.operator, &base.scene, &base.loss));
}

#[test]
fn given_keys_replace_the_base_whole() {
    let step = "[[operator.step]]\nat_s = 2.0\ndo = \"enable\"\nreason = \"alone\"\n[[loss]]\nat_s = 5.0\nduration_s = 1.0\nshare = 0.5\n";
    let scenario = one(&format!("{HEAD}{step}"), &[("base", &base())]).unwrap();
    assert_eq!((scenario.operator.step.len(), scenario.loss.len()), (1, 1));
    assert_eq!(scenario.loss[0].share.get(), 0.5);
}

#[test]
fn expected_classes_are_never_taken_over() {
    let stripped = HEAD.replace("expected = [\"HOLD_SAFE\"]\n", "");
    let text = problem(&stripped, &[("base", &base())]);
    assert!(text.starts_with("one.toml:1:1: missing field `expected`"), "{text}");
}

#[test]
fn mistakes_point_into_their_own_file() {
    let line = |text: &str, found: &str| text.lines().position(|line| line.starts_with(found)).unwrap() + 1;
    for (from, to) in [("share = 1.0", "share = 1.5"), ("at_s = 4.0", "at_s = 8.5"), ("[[loss]]", "[[loss]]\nlos = 1")]
    {
        let wrong = base().replace(from, to);
        let words = problem(HEAD, &[("base", &wrong)]);
        let marked = to.lines().last().unwrap();
        assert!(words.starts_with(&format!("base.toml:{}:", line(&wrong, marked))), "{to}: {words}");
    }
    let own_text = format!("{HEAD}duration_s = \"long\"\n");
    let words = problem(&own_text, &[("base", &base())]);
    assert!(words.starts_with(&format!("one.toml:{}:", line(&own_text, "duration_s"))), "{words}");
}

#[test]
fn a_base_is_found_and_ends() {
    let extends = |name: &str| format!("extends = \"{name}\"\n");
    let other = |name: &str| HEAD.replace("extends = \"base\"\n", &extends(name));
    for (text, others, message) in [
        (HEAD.to_owned(), vec![], "no such scenario"),
        (other("../base"), vec![], "a base is named, without path or ending"),
        (HEAD.to_owned(), vec![("base", extends("one"))], "extend each other in a circle"),
        (other("one"), vec![], "extend each other in a circle"),
        (
            HEAD.to_owned(),
            vec![("base", extends("b")), ("b", extends("c")), ("c", extends("d")), ("d", base())],
            "more than 3 bases",
        ),
    ] {
        let rest: Vec<(&str, &str)> = others.iter().map(|(name, text)| (*name, text.as_str())).collect();
        let line = problem(&text, &rest);
        assert!(line.contains(message), "{message}: {line}");
    }
}

#[test]
fn a_base_is_no_symbolic_link() {
    let folder = tempfile::tempdir().unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    fs::write(elsewhere.path().join("base.toml"), base()).unwrap();
    fs::write(folder.path().join("one.toml"), HEAD).unwrap();
    std::os::unix::fs::symlink(elsewhere.path().join("base.toml"), folder.path().join("base.toml")).unwrap();
    let problems = load(&folder.path().join("one.toml")).unwrap_err();
    assert!(problems.all()[0].message().contains("no such scenario"), "{problems}");
}

/// A folder with `scenarios/` and `platforms/` of a user's own looks like a root.
#[test]
fn own_folders_hide_no_shipped_base() {
    let folder = tempfile::tempdir().unwrap();
    let [scenarios, platforms] = ["scenarios", "platforms"].map(|name| folder.path().join(name));
    [&scenarios, &platforms].into_iter().for_each(|folder| fs::create_dir(folder).unwrap());
    fs::write(scenarios.join("one.toml"), HEAD.replace("\"base\"", "\"nominal\"")).unwrap();
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
    let scenario = load_with(&scenarios.join("one.toml"), Some(&root)).unwrap();
    assert!(!scenario.operator.step.is_empty() && scenario.scene.is_some());
}
