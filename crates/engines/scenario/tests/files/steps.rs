//! Answers to bad steps, and the events that a level of knowledge lets a scenario wait for.

use evidence::trial::Knowledge;
use scenario::*;

/// A valid scenario with two steps, at a level.
fn parse_steps(level: &str, first: &str, second: &str) -> Result<Scenario, Problems> {
    let text = template(&Name::new("x").unwrap()).replace("# knowledge = \"blind\"", level);
    let (head, _) = text.split_once("[[loss]]").unwrap();
    let tables = format!("[[loss]]\nat_s = 4.0\nduration_s = 1.0\nshare = 1.0\n{first}\n{second}\n");
    parse("x.toml", "x", &format!("{head}{tables}"))
}

const CUT: &str = "[[cut]]\nat_s = 4.0\nduration_s = 1.0\n";

/// Level, keys added to the loss, the second table, part of the message, the marked text.
const MISTAKES: [(&str, &str, &str, &str, &str); 13] = [
    ("white-box", "when = { enters = \"READY\" }", "", "a step that waits has no name", "{ enters = \"READY\" }"),
    ("white-box", "step = \"a\"\nwhen = {}", "", "waits for nothing", "{}"),
    (
        "white-box",
        "step = \"a\"\nwhen = { enters = \"READY\", datagrams = 3 }",
        "",
        "waits for 2 things",
        "{ enters = \"READY\", datagrams = 3 }",
    ),
    (
        "white-box",
        "step = \"a\"\nwhen = { datagrams = 3, from = \"READY\" }",
        "",
        "`from` and `nth` go with `enters`",
        "{ datagrams = 3, from = \"READY\" }",
    ),
    ("blind", "step = \"a\"\nwhen = { begun = \"b\" }", "", "there is no step `b`", "{ begun = \"b\" }"),
    ("blind", "step = \"a\"\nwhen = { ended = \"a\" }", "", "waits for itself", "{ ended = \"a\" }"),
    (
        "insider",
        "step = \"a\"\nwhen = { enters = \"READY\" }",
        "",
        "waiting for this needs white-box knowledge, the level is insider",
        "{ enters = \"READY\" }",
    ),
    (
        "blind",
        "step = \"a\"\nwhen = { silence_ms = 300 }",
        "",
        "waiting for this needs on-path knowledge, the level is blind",
        "{ silence_ms = 300 }",
    ),
    (
        "white-box",
        "step = \"a\"\nknowledge = \"blind\"\nwhen = { datagrams = 9 }",
        "",
        "waiting for this needs on-path knowledge, the level is blind",
        "{ datagrams = 9 }",
    ),
    ("blind", "knowledge = \"on-path\"", "", "more than the scenario's level, blind", "\"on-path\""),
    (
        "white-box",
        "step = \"a\"\nwhen = { hears = \"READY\" }",
        "",
        "this cannot be seen from there",
        "{ hears = \"READY\" }",
    ),
    (
        "blind",
        "",
        "[[replay]]\nat_s = 4.0\nduration_s = 1.0\nlag_ms = 10\ncount = 1\nevery_ms = 0",
        "what this does needs on-path knowledge, its level is blind",
        "\"blind\"",
    ),
    (
        "blind",
        "step = \"a-name-of-more-than-24-bytes\"",
        "",
        "at most 24 characters",
        "\"a-name-of-more-than-24-bytes\"",
    ),
];

#[test]
fn each_step_mistake_has_place_and_remedy() {
    for (level, first, second, message, marked) in MISTAKES {
        let problems = parse_steps(&format!("knowledge = \"{level}\""), first, second).unwrap_err();
        let problem = &problems.all()[0];
        assert_eq!(problems.all().len(), 1, "{first}: {problems}");
        assert!(problem.message().contains(message), "{first}: {}", problem.message());
        assert_eq!(problem.marked(), Some(marked), "{first}");
        assert!(!problem.remedy().is_empty());
    }
}

#[test]
fn tables_of_one_step_wait_for_one_thing() {
    let cut = |text: &str| parse_steps("knowledge = \"blind\"", "step = \"a\"", &format!("{CUT}step = \"a\"\n{text}"));
    cut("").unwrap();
    let problems = cut("when = { begun = \"a\" }").unwrap_err().to_string();
    assert!(problems.contains("the tables of step `a` wait for different things"), "{problems}");
}

#[test]
fn steps_waiting_for_each_other_are_refused() {
    let second = format!("{CUT}step = \"b\"\nwhen = {{ begun = \"a\" }}");
    let problems = parse_steps("", "step = \"a\"\nwhen = { ended = \"b\" }", &second).unwrap_err().to_string();
    assert!(problems.contains("waits for itself"), "{problems}");
}

/// It is the level that their kinds need.
#[test]
fn default_level_is_that_of_the_attacks() {
    let level = |file: &str| load(&find(&crate::scenarios::root(), file).unwrap()).unwrap().level();
    let levels = ["loss", "replay", "teammate", "cut_at_arming"].map(level);
    assert_eq!(levels, [Knowledge::Blind, Knowledge::OnPath, Knowledge::Insider, Knowledge::WhiteBox]);
}

#[test]
fn inconsistent_process_faults_are_refused() {
    let kill = |keys: &str| parse_steps("", "", &format!("[[kill]]\nprocess = \"gateway\"\nat_s = 4.0\n{keys}"));
    kill("").unwrap();
    kill("ending = \"hang\"\nduration_s = 1.5").unwrap();
    kill("ending = \"slow\"\nduration_s = 1.5\nquota = 0.25").unwrap();
    for (keys, message) in [
        ("duration_s = 1.0", "a kill has no duration"),
        ("ending = \"hang\"", "nothing says when"),
        ("ending = \"slow\"\nduration_s = 1.0", "needs a quota"),
        ("ending = \"slow\"\nduration_s = 1.0\nquota = 1.0", "not a share of the time"),
        ("quota = 0.5", "a quota is for a slow process"),
        ("restart_after_s = 1.0", "only autonomy is started again"),
    ] {
        let problems = kill(keys).unwrap_err();
        assert!(problems.to_string().contains(message), "{keys}: {problems}");
    }
}
