//! Tests of the page as a whole, over golden results of every kind and a made-up run; parts have theirs in their files.

use std::collections::BTreeSet;

use results::summary::{ClaimsMade, Lasted, Refusals, RunSummary, TruthPoint};
use serde_json::{Value, json};

use super::*;
use crate::Recording;
use crate::reader::{Results, golden};

/// A run of nine seconds with every lane.
fn story(name: &str, flaw: Option<&str>) -> RunSummary {
    let lasted = |label: &str| Lasted { what: label.to_owned(), from: 1.0, to: 2.0 };
    let refused = Refusals { by: "gateway".to_owned(), reason: "stale".to_owned(), n: 30, at: vec![lasted("stale")] };
    RunSummary {
        name: name.to_owned(),
        seconds: 9.0,
        flaw: flaw.map(str::to_owned),
        modes: vec![lasted("READY")],
        authority: Vec::new(),
        done: vec![lasted("insider-b: sends a report of unit-c that is a lie"), lasted("<script>")],
        refused: vec![refused],
        why: Vec::new(),
        guards: vec![lasted("Teammates")],
        shown: vec![lasted("READY")],
        truth: vec![TruthPoint { at: 0.0, speed: 0.0 }, TruthPoint { at: 8.0, speed: 3.0 }],
        claims: Some(ClaimsMade { n: 40, off_m: 0.0 }),
        distances: Vec::new(),
        limits_ms: [1000, 500],
    }
}

fn dossier() -> Dossier {
    let mut results = Results::default();
    let mut search = golden("search");
    search["watermark"] = Value::Null;
    search["findings"][0]["word"] = "<img src=//a.b/c onerror=alert(1)>".into();
    results.read("search.json", search.to_string().as_bytes()).expect("a search");
    let story = story("</style><script>alert(1)</script>", Some("cut"));
    let (title, version) = ("a & b".to_owned(), "0".to_owned());
    let recording = Recording {
        name: story.name.clone(),
        sha256: "ab".repeat(32),
        holds: false,
        outcome: Some("NOMINAL".to_owned()),
        invalid: story.flaw.clone(),
    };
    let (stories, recordings) = (vec![story], vec![recording]);
    Dossier { title, version, results, stories, recordings, ..Dossier::default() }
}

/// Every golden result on one page, with rows under a full policy so that claims rest on them.
fn every_kind() -> Dossier {
    let mut dossier = dossier();
    for kind in ["matrix", "run", "reference", "campaign", "curve", "ablation", "guests", "bench-live", "bench-twin"] {
        let mut golden = golden(kind);
        for row in golden["rows"].as_array_mut().into_iter().flatten() {
            row["watermark"] = Value::Null;
            for kind in row["kinds"].as_array_mut().into_iter().flatten() {
                (kind["ablation"], kind["counts"]) = (false.into(), true.into());
            }
        }
        dossier.results.read(kind, golden.to_string().as_bytes()).expect("a golden result");
    }
    dossier
}

/// A run of four cells of 20 trials each, one of them unnoticed.
fn teammates() -> Value {
    let mut run = golden("run");
    let trial = run["trials"][0].clone();
    let (mut cells, mut trials) = (Vec::new(), Vec::new());
    let ends = [
        ("verbatim/present/session-only", "HOLD_SAFE"),
        ("verbatim/present/origin-signed", "REJECTED"),
        ("verbatim/silent/session-only", "UNDETECTED"),
        ("verbatim/silent/origin-signed", "REJECTED"),
    ];
    for (name, class) in ends {
        let mut cell =
            json!({"cell": name, "expected": [class], "accepted": 1, "dropped": {"origin": 800, "no_echo": 4}});
        cell["summary"] = run["summary"].clone();
        (cell["summary"]["n"], cell["summary"]["outcomes"]) = (json!(20), json!({ class: 20 }));
        cells.push(cell);
        let mut own = trial.clone();
        (own["cell"], own["outcome"]) = (json!(name), json!(class));
        own["injections"] =
            json!([{"what": {"action": "forward"}, "from_ms": 4549, "fate": "noticed", "at_ms": 4650.0}]);
        own["claims"] = json!({"said": 40, "accepted": 40, "believed_mm": 0});
        trials.push(own);
    }
    (run["scenario"], run["cells"], run["trials"]) = (json!("teammate"), json!(cells), json!(trials));
    run["watermark"] = "ABLATION: policy `session-only` waives checks".into();
    run
}

fn of(kind: &str, result: &Value) -> Dossier {
    let mut results = Results::default();
    results.read(kind, result.to_string().as_bytes()).expect("a result");
    Dossier { results, version: "0".to_owned(), ..Dossier::default() }
}

/// The first screen, without its markup.
fn first_screen(page: &str) -> String {
    let head = page.split_once("<header>").and_then(|(_, rest)| rest.split_once("<main>")).expect("a header").0;
    let mut text = String::new();
    let mut within = false;
    for c in head.chars() {
        match c {
            '<' => (within, text) = (true, text + " "),
            '>' => within = false,
            c if !within => text.push(c),
            _ => {}
        }
    }
    text
}

#[test]
fn page_loads_no_resource_and_runs_no_script() {
    let page = page(&every_kind());
    assert!(!page.contains("<script") && !page.contains("<img") && !page.contains("<link"), "{page}");
    assert!(!page.contains("url(") && !page.contains("@import") && !page.contains(" onerror=\""), "{page}");
    let addresses = page.matches("http").count();
    assert_eq!(addresses, page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count());
}

#[test]
fn invalid_recording_comes_before_what_results_say() {
    let page = page(&dossier());
    let (head, rest) = page.split_once("<main>").expect("a body");
    assert!(head.contains("This recording is INVALID") && head.contains("one way to break P3"), "{head}");
    assert!(head.find("INVALID") < head.find("one way"), "before what results say: {head}");
    assert!(rest.contains("&lt;img src=//a.b/c"), "{rest}");
    assert!(rest.find("id=\"evidence\"") < rest.find("id=\"outcomes\""), "evidence leads where it does not hold");
    assert!(
        rest.contains("<details open>") && rest.contains("does not hold") && rest.contains(&"ab".repeat(32)),
        "{rest}"
    );
    assert!(rest.matches("INVALID").count() >= 3, "at its run and its table, too: {rest}");
}

#[test]
fn evidence_is_folded_and_last_where_it_verifies() {
    let mut dossier = dossier();
    dossier.recordings[0].invalid = None;
    let page = page(&dossier);
    assert!(page.contains("1 recording, all verify") && !page.contains("<details open>"), "{page}");
    assert!(page.find("id=\"cost\"") < page.find("id=\"evidence\""), "{page}");
}

#[test]
fn unnoticed_cell_is_the_finding_in_words() {
    let page = page(&of("run.json", &teammates()));
    let text = first_screen(&page);
    assert!(
        text.contains(
            ": an insider repeats a teammate word for word, the teammate itself is silent, and nobody checks names."
        ),
        "{text}"
    );
    assert!(
        text.contains("One lie goes") && text.contains("unnoticed") && text.contains("2 of the 4 cells waive"),
        "{text}"
    );
    assert!(
        text.contains("In the 3 other cells 60 trials ended with the unit stopped (20) or the lie refused (40)"),
        "{text}"
    );
    assert_eq!(page.matches("full-undetected\">").count(), 1, "one filled cell");
}

/// Numbers of a text as written, without groups.
fn numbers(text: &str) -> Vec<String> {
    let text = text.replace(',', "");
    let parts = text.split(|c: char| !(c.is_ascii_digit() || c == '.'));
    parts.map(|part| part.trim_matches('.').to_owned()).filter(|part| part.parse::<f64>().is_ok()).collect()
}

/// Every number of a result, how many entries each list has, and sums of trials by cell and class.
fn known(value: &Value, all: &mut BTreeSet<String>) {
    match value {
        Value::Number(number) => {
            let number = number.as_f64().unwrap_or_default();
            for scaled in [number, number * 100.0, number / 10.0, number / 1e3] {
                all.extend([
                    format!("{scaled:.0}"),
                    format!("{scaled:.1}"),
                    format!("{scaled:.2}"),
                    format!("{scaled:.3}"),
                ]);
            }
        }
        Value::Array(list) => {
            all.insert(list.len().to_string());
            list.iter().for_each(|value| known(value, all));
        }
        Value::Object(map) => map.values().for_each(|value| known(value, all)),
        Value::String(text) => all.extend(numbers(text)),
        Value::Null | Value::Bool(_) => {}
    }
}

#[test]
fn numbers_of_the_first_screen_are_in_the_results() {
    let cases = [
        // Cells: the unnoticed one, the others, those that waive; trials: of all, of the others, refused.
        ("run", teammates(), &["1", "3", "2", "80", "60", "40", "95", "0"][..]),
        ("search", golden("search"), &["95"][..]),
        ("guests", golden("guests"), &["95"][..]),
        ("campaign", golden("campaign"), &["95", "0"][..]),
        ("curve", golden("curve"), &["95"][..]),
    ];
    for (kind, result, derived) in cases {
        let text = first_screen(&page(&of(kind, &result)));
        let mut all: BTreeSet<String> = derived.iter().map(|number| (*number).to_owned()).collect();
        known(&result, &mut all);
        let unknown: Vec<String> = numbers(&text).into_iter().filter(|number| !all.contains(number)).collect();
        assert!(unknown.is_empty(), "{kind}: {unknown:?} in {text}");
        assert!(numbers(&text).len() > 3, "{kind}: {text}");
    }
}

#[test]
fn changed_result_changes_the_first_screen() {
    let screen = |run: &Value| first_screen(&page(&of("run.json", run)));
    let (run, mut other) = (teammates(), teammates());
    other["cells"][2]["summary"]["outcomes"] = json!({"UNDETECTED": 13, "HOLD_SAFE": 7});
    other["cells"][2]["expected"] = json!(["HOLD_SAFE", "UNDETECTED"]);
    assert!(screen(&run).contains("20 of 20 trials") && screen(&other).contains("13 of 20 trials"));
}

#[test]
fn what_was_not_stated_leads() {
    let mut run = teammates();
    run["cells"][1]["summary"]["outcomes"] = json!({"REJECTED": 19, "UNSAFE": 1});
    let text = first_screen(&page(&of("run.json", &run)));
    assert!(text.contains("a safety property") && text.contains("which was not stated beforehand"), "{text}");
    assert!(text.contains("79 of 80"), "{text}");
}

#[test]
fn every_kind_has_a_finding_and_a_picture() {
    for kind in ["matrix", "run", "reference", "campaign", "search", "guests", "bench-live", "curve", "ablation"] {
        let page = page(&of(kind, &golden(kind)));
        let (head, body) = page.split_once("<main>").expect("a body");
        assert!(
            head.contains("<h1>") && head.contains("class=\"lead\"") && head.contains("class=\"facts\""),
            "{kind}: {head}"
        );
        let outcomes = body
            .split_once("id=\"outcomes\"")
            .and_then(|(_, rest)| rest.split_once("</section>"))
            .expect("a section")
            .0;
        assert!(outcomes.contains("<h2>"), "{kind}: {outcomes}");
        assert!(body.contains("class=\"next\"") && body.matches("<code>holdsafe ").count() >= 2, "{kind}");
    }
}

#[test]
fn anchors_lead_somewhere_and_drawings_have_numbers() {
    let page = page(&every_kind());
    assert_eq!(page.matches("<figure").count(), page.matches("<summary>The same in numbers</summary>").count() - 1);
    for anchor in page.split("href=\"#").skip(1).filter_map(|rest| rest.split('"').next()) {
        assert!(page.contains(&format!(" id=\"{anchor}\"")), "{anchor}");
    }
}

#[test]
fn rows_are_as_long_as_their_headers() {
    let page = page(&every_kind());
    assert!(page.contains("Claims, table") && page.contains("Every variation, table"), "{page}");
    let (mut tables, cells) = (0, |row: &str| row.matches("<th").count() + row.matches("<td").count());
    for table in page.split("<table>").skip(1).filter_map(|rest| rest.split("</table>").next()) {
        let rows: Vec<&str> = table.split("<tr>").skip(1).collect();
        assert!(rows.iter().all(|row| cells(row) == cells(rows[0])), "{table}");
        tables += 1;
    }
    assert!(tables > 5, "{tables}");
}

#[test]
fn named_run_is_told_first_beside_one_that_ended_otherwise() {
    let mut dossier = of("run.json", &teammates());
    let stop = |name: &str| {
        let mut of = story(name, None);
        let link = results::summary::ChainLink {
            stage: "guard".to_owned(),
            at: 1.0,
            by: "unit-a".to_owned(),
            what: "fails".to_owned(),
        };
        of.why = vec![results::summary::Why {
            at: 1.0,
            change: "READY to HOLD_SAFE".to_owned(),
            cause: "x".to_owned(),
            chain: vec![link],
        }];
        of
    };
    dossier.stories = vec![
        stop("teammate re-signed/present/session-bound, model, seed 1: HOLD_SAFE"),
        stop("teammate verbatim/present/session-only, model, seed 1: HOLD_SAFE"),
        story("teammate verbatim/silent/session-only, live, seed 1: UNDETECTED", None),
    ];
    let page = page(&dossier);
    let place = |name: &str| page.find(&format!("<strong>{name}")).unwrap_or_else(|| panic!("{name}: {page}"));
    let [named, other, folded] =
        ["Teammate verbatim, silent", "Teammate verbatim, present", "Teammate re-signed"].map(place);
    assert!(named < other && other < folded && page.contains("1 more kept run"), "{named} {other} {folded}");
    assert!(page.contains("attack-unnoticed") && page.contains("40 reports of unit-c, by insider-b"), "{page}");
    assert!(page.contains("Why the unit stopped") && page.contains("Truth: speed, m/s"), "{page}");
}

#[test]
fn the_same_results_give_the_same_page() {
    assert_eq!(page(&every_kind()), page(&every_kind()));
}

#[test]
fn a_slug_is_an_anchor() {
    assert_eq!(slug("a/b C--d."), "a-b-c-d");
}
