//! The threat catalogue against scenarios, tests, documents and code: no row untested, and no test, check or mode without a row
//! that justifies it.

use std::fs;

use evidence::ablation::Switch;
use results::catalogue::Catalogue;
use scenario::Scenario;
use wire::id::NodeId;
use wire::mode::Mode;
use wire::refusal::Reason;

use crate::crates::folders;
use crate::{root, sources};

fn scenarios() -> Vec<Scenario> {
    let files = scenario::shipped(&root()).expect("scenarios/");
    files.iter().map(|file| scenario::load(file).expect("a shipped scenario loads")).collect()
}

fn read(file: &str) -> String {
    fs::read_to_string(root().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn catalogue() -> Catalogue {
    Catalogue::load().expect("docs/reference/catalogue.toml loads")
}

/// A row without one says why; every scenario fits its rows.
#[test]
fn every_row_has_scenario_and_test() {
    assert_eq!(catalogue().disagreements(&scenarios()), Vec::<String>::new());
}

#[test]
fn papers_figures_match_the_code() {
    let ready = holdsafe_tests::shipped("teammate");
    let topology = topology::lay_out(&ready.scenario, &ready.setup, 1, &topology::RunSecret::seeded(1));
    let platforms = scenario::platforms(&root()).expect("platforms/ loads");
    let figures = catalogue().figures(&scenarios(), "teammate", &topology, &platforms);
    is_given("docs/researcher/figures.md", &figures, "lab catalogue --figures");
}

#[test]
fn threats_page_matches_the_catalogue() {
    is_given("docs/reference/threats.md", &catalogue().page(&scenarios()), "lab catalogue");
}

/// Holds a page against the code that gives it, and renews it where that is wanted.
fn is_given(path: &str, page: &str, command: &str) {
    if std::env::var_os("HOLDSAFE_RENEW").is_some() {
        std::fs::write(root().join(path), page).expect("it can be written");
    }
    assert!(
        read(path) == page,
        "{path} is not what catalogue, scenarios and code give: run `HOLDSAFE_RENEW=1 cargo test --test tidy`, or `{command} > {path}`"
    );
}

#[test]
fn every_test_that_a_row_names_exists() {
    for row in &catalogue().row {
        for test in &row.tests {
            let (file, name) = test.split_once("::").expect("`file::name`");
            // A long test runs before a release.
            let source = read(file);
            let lines: Vec<&str> = source.lines().filter(|line| !line.starts_with("#[ignore = \"long: ")).collect();
            let exists =
                lines.windows(2).any(|pair| pair[0] == "#[test]" && pair[1].starts_with(&format!("fn {name}()")));
            assert!(exists, "{} names {test}: there is no such test", row.id.as_str());
        }
    }
}

/// A file of tests/attacks that no row knows tests a threat that is not in the catalogue, or was forgotten.
#[test]
fn every_attack_test_belongs_to_a_row() {
    let catalogue = catalogue();
    let known: Vec<&String> = catalogue.row.iter().flat_map(|row| &row.tests).collect();
    for (file, text) in sources("tests/attacks") {
        let named = text.contains("#[test]");
        assert!(
            !named || known.iter().any(|test| test.starts_with(&format!("{file}::"))),
            "{file} has tests and docs/reference/catalogue.toml names none of them: add them to the rows that they test"
        );
    }
}

/// The cells of the table rows of `file` that begin with `name` in code quotes.
fn row_of(file: &str, name: &str) -> Vec<String> {
    let text = read(file);
    let begins = format!("| `{name}` |");
    let row = text.lines().find(|line| line.starts_with(&begins));
    let row = row.unwrap_or_else(|| panic!("{file} has no row for `{name}`: say what it is for, or take it out"));
    row.split('|').map(|cell| cell.trim().to_owned()).collect()
}

#[test]
fn checks_and_modes_are_justified_by_rows() {
    let catalogue = catalogue();
    let switches = Switch::all().into_iter().map(|switch| switch.name());
    let modes = Mode::ALL.into_iter().map(|mode| mode.name().to_owned());
    for name in switches.chain(modes) {
        let cells = row_of("docs/reviewer/checks.md", &name);
        let rows: Vec<&str> = cells[3].split(' ').collect();
        for id in &rows {
            assert!(catalogue.row(id).is_some(), "docs/reviewer/checks.md: `{name}` names {id}: there is no such row");
        }
    }
}

#[test]
fn every_component_is_on_the_code_map() {
    let map = read("ARCHITECTURE.md");
    for folder in folders() {
        let name = folder.rsplit('/').next().unwrap_or_default();
        assert!(map.contains(&format!("**`{name}`**")), "ARCHITECTURE.md does not say what `{name}` is");
    }
}

/// Identities from this number on follow a rule.
const RULED: usize = 32;

/// Rows named exist; an identity without any is listed as not covered. Those that follow a rule have one row together.
#[test]
fn every_identity_has_rows_or_is_uncovered() {
    let catalogue = catalogue();
    let page = read("docs/reviewer/assumptions.md");
    for node in NodeId::all() {
        if node.index() >= RULED {
            let kind = format!("`{}N`", node.name().trim_end_matches(|c: char| c.is_ascii_digit()));
            assert!(page.contains(&kind), "docs/reviewer/assumptions.md has no row for {kind}");
            continue;
        }
        let cells = row_of("docs/reviewer/assumptions.md", node.name());
        let covered = !cells[4].starts_with("not covered: ");
        for id in cells[4].split(' ').filter(|_| covered) {
            assert!(
                catalogue.row(id).is_some(),
                "docs/reviewer/assumptions.md: `{node}` names {id}: there is no such row"
            );
        }
    }
}

#[test]
fn checks_and_reasons_have_a_boundary() {
    let page = read("docs/reviewer/trust-boundaries.md");
    for switch in Switch::all() {
        let name = switch.name();
        let (table, check) = name.split_once('.').unwrap_or(("boundary", &name));
        let placed = table == "guards" || page.contains(&format!("`{check}`"));
        assert!(placed, "docs/reviewer/trust-boundaries.md does not say where `{name}` is judged");
    }
    for reason in Reason::ALL {
        let name = reason.name();
        assert!(
            page.contains(&format!("`{name}`")),
            "docs/reviewer/trust-boundaries.md does not say who refuses `{name}`"
        );
    }
}

#[test]
fn every_stop_of_the_audit_exists() {
    for place in read("docs/reviewer/audit.md")
        .split('`')
        .filter(|text| text.starts_with("crates/") || text.starts_with("docs/"))
    {
        assert!(
            root().join(place).exists(),
            "docs/reviewer/audit.md sends its reader to {place}: there is no such place"
        );
    }
}

/// A file that the route leaves out is never read on it.
#[test]
fn the_audit_route_has_all_of_trust() {
    let page = read("docs/reviewer/audit.md");
    for (file, _) in sources("crates/shared/wire/src/trust") {
        assert!(page.contains(&format!("`{file}`")), "docs/reviewer/audit.md leaves {file} out");
    }
}

#[test]
fn the_audit_route_takes_an_hour() {
    let page = read("docs/reviewer/audit.md");
    let hour = page.split("## After the hour").next().unwrap_or_default();
    let stops = hour.lines().filter_map(|line| line.strip_prefix("| ")?.split(" | ").nth(1));
    let files = stops.flat_map(|stop| stop.split('`')).filter(|text| text.contains('/'));
    let words =
        |file: &str| read(file).split("#[cfg(test)]\nmod tests").next().map_or(0, |t| t.split_whitespace().count());
    let total: usize = files.map(words).sum();
    assert!(
        (15_000..20_000).contains(&total),
        "the files of docs/reviewer/audit.md are {total} words: at 330 a minute not an hour"
    );
}
