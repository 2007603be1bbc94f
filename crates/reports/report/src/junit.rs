//! JUnit XML, as build servers show it: a suite for each row of a matrix, each scenario and each search, a case for each variation and
//! each finding.
//!
//! A case fails by trials outside their expected classes; where these are all INVALID it is an error, since there is no evidence. There
//! is no time in it: results carry none that would be the same twice. Values without a place in the format (n, bounds, seed, the line
//! that runs it again) stand as `key: value` in the case's `system-out`.

use std::collections::BTreeMap;

use evidence::trial::Outcome;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};
use results::report::{FindingRow, SearchObject};

use crate::reader::{FoundResult, Given, Results};
use crate::tried::{Tried, class_counts, tried};

/// A suite's name, and its cases.
#[derive(Default)]
struct Suite {
    properties: Vec<(&'static str, String)>,
    cases: Vec<Case>,
}

struct Case {
    name: String,
    verdict: Verdict,
    out: String,
}

enum Verdict {
    Passed,
    /// `failure`: message, and details.
    Failed(String, String),
    /// `error`: the evidence does not hold.
    NoEvidence(String, String),
}

type Xml = Writer<Vec<u8>>;

/// Text of the JUnit file.
pub fn junit(results: &Results) -> String {
    let suites: Vec<(String, Suite)> = results.files().iter().flat_map(suites).collect();
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    write(&mut xml, &suites).expect("invariant: writing to memory cannot fail");
    String::from_utf8(xml.into_inner()).expect("invariant: what was written are strings") + "\n"
}

fn suites(file: &Given) -> Vec<(String, Suite)> {
    let source = || vec![("file", file.file.clone()), ("sha256", file.sha256.clone())];
    if let FoundResult::Search(search) = &file.found {
        return vec![(format!("search {}, {}", search.scenario, search.alphabet), searched(search, source()))];
    }
    let mut order = Vec::new();
    let mut suites: BTreeMap<String, Suite> = BTreeMap::new();
    for one in tried(file) {
        let name = one.row.map_or_else(|| one.scenario.to_owned(), |row| format!("{} {}", row.id, row.threat));
        let suite = suites.entry(name.clone()).or_insert_with(|| {
            order.push(name);
            Suite { properties: source(), cases: Vec::new() }
        });
        suite.cases.push(case(&one));
    }
    order.into_iter().map(|name| (name.clone(), suites.remove(&name).unwrap_or_default())).collect()
}

fn case(one: &Tried) -> Case {
    let odd: Vec<(Outcome, u64)> = one.unexpected().collect();
    let count: u64 = odd.iter().map(|(_, n)| n).sum();
    let told_odd = class_counts(&odd.iter().copied().collect());
    let message = format!("{count} of {} trials not as expected ({told_odd}); expected {}", one.n, one.expected_told());
    let detail = one.findings.iter().copied().chain([one.reproduce.as_str()]).collect::<Vec<_>>().join("\n");
    let verdict = match odd.as_slice() {
        [] => Verdict::Passed,
        [(Outcome::Invalid, _)] => Verdict::NoEvidence(message, detail),
        _ => Verdict::Failed(message, detail),
    };
    Case { name: one.name(), verdict, out: lines(one) }
}

/// Values for which the format has no attribute.
fn lines(one: &Tried) -> String {
    let percent = |share: f64| format!("{:.2} %", share * 100.0);
    let known = [
        ("n", Some(one.n.to_string())),
        ("outcomes", Some(class_counts(&one.outcomes))),
        ("expected", Some(one.expected_told())),
        ("unsafe below (95 %)", one.unsafe_upper_95.map(percent)),
        ("unsafe below, all together (95 %)", one.unsafe_upper_95_simultaneous.map(percent)),
        ("different decisions", one.distinct_decisions.map(|n| n.to_string())),
        ("mechanism really runs there", one.counts.map(|counts| if counts { "yes" } else { "no" }.to_owned())),
        ("ablation", one.watermark.map(str::to_owned)),
        ("seed", one.seed.map(|seed| seed.to_string())),
        ("reproduce", Some(one.reproduce.clone()).filter(|line| !line.is_empty())),
    ];
    known.into_iter().filter_map(|(key, value)| Some(format!("{key}: {}\n", value?))).collect()
}

fn searched(search: &SearchObject, mut properties: Vec<(&'static str, String)>) -> Suite {
    properties.push(("seed", search.seed.to_string()));
    properties.push(("draws", search.draws.to_string()));
    let hunt = &search.hunt;
    let manner = format!("{} trials, {}, {}", hunt.trials, hunt.strategy, search.policy);
    let outcomes = class_counts(&hunt.outcomes);
    let whole = Case { name: manner, verdict: Verdict::Passed, out: format!("outcomes: {outcomes}\n") };
    let found = |finding: &FindingRow| {
        let message = format!("{} {}: {}", finding.outcome.name(), finding.broken, finding.word);
        let detail = finding.finding.clone().unwrap_or_default();
        let out = format!("{}reproduce: {}\n", ablation(search), finding.reproduce);
        // What gets through without a check shows what the check is worth.
        let verdict = if search.watermark.is_some() { Verdict::Passed } else { Verdict::Failed(message, detail) };
        Case { name: finding.name.clone(), verdict, out }
    };
    Suite { properties, cases: [whole].into_iter().chain(search.findings.iter().map(found)).collect() }
}

fn ablation(search: &SearchObject) -> String {
    search.watermark.as_ref().map(|reason| format!("ablation: {reason}\n")).unwrap_or_default()
}

fn write(xml: &mut Xml, suites: &[(String, Suite)]) -> std::io::Result<()> {
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let all = || suites.iter().flat_map(|(_, suite)| &suite.cases);
    let head = xml.create_element("testsuites").with_attribute(("name", "holdsafe"));
    let [tests, failures, errors] = counts(all());
    head.with_attributes([("tests", &*tests), ("failures", &*failures), ("errors", &*errors)])
        .write_inner_content(|xml| suites.iter().try_for_each(|(name, suite)| write_suite(xml, &clean(name), suite)))?;
    Ok(())
}

fn counts<'a>(cases: impl Iterator<Item = &'a Case> + Clone) -> [String; 3] {
    let count = |selects: fn(&Case) -> bool| cases.clone().filter(|case| selects(case)).count().to_string();
    [
        count(|_| true),
        count(|case| matches!(case.verdict, Verdict::Failed(..))),
        count(|case| matches!(case.verdict, Verdict::NoEvidence(..))),
    ]
}

fn write_suite(xml: &mut Xml, name: &str, suite: &Suite) -> std::io::Result<()> {
    let [tests, failures, errors] = counts(suite.cases.iter());
    let head = xml.create_element("testsuite").with_attribute(("name", name));
    let head = head.with_attributes([("tests", &*tests), ("failures", &*failures), ("errors", &*errors)]);
    head.write_inner_content(|xml| {
        xml.create_element("properties").write_inner_content(|xml| {
            suite.properties.iter().try_for_each(|(key, value)| {
                let property = xml.create_element("property");
                property.with_attributes([("name", *key), ("value", &*clean(value))]).write_empty()?;
                Ok(())
            })
        })?;
        suite.cases.iter().try_for_each(|case| write_case(xml, name, case))
    })?;
    Ok(())
}

fn write_case(xml: &mut Xml, suite: &str, case: &Case) -> std::io::Result<()> {
    let head = xml.create_element("testcase").with_attributes([("name", &*clean(&case.name)), ("classname", suite)]);
    head.write_inner_content(|xml| {
        let verdict_text = match &case.verdict {
            Verdict::Passed => None,
            Verdict::Failed(message, detail) => Some(("failure", message, detail)),
            Verdict::NoEvidence(message, detail) => Some(("error", message, detail)),
        };
        if let Some((element, message, detail)) = verdict_text {
            let kind = if element == "error" { "INVALID" } else { "unexpected" };
            let element = xml.create_element(element);
            let element = element.with_attributes([("type", kind), ("message", &*clean(message))]);
            element.write_text_content(BytesText::new(&clean(detail)))?;
        }
        xml.create_element("system-out").write_text_content(BytesText::new(&clean(&case.out)))?;
        Ok(())
    })?;
    Ok(())
}

/// The text without the characters that XML 1.0 cannot write. A result may come from anywhere.
fn clean(text: &str) -> String {
    let writable =
        |c: char| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..);
    text.chars().map(|c| if writable(c) { c } else { '\u{fffd}' }).collect()
}
