//! JUnit XML. The XSD's relevant requirements are the place of elements and their attributes: it demands no order and no type but
//! text. So these are read off the XSD and checked; a complete validator is run by hand (`schemas/README.md`).

use std::collections::{BTreeMap, BTreeSet};

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use report::junit;

use super::{everything, hostile, read, read_results};

/// Content that the XSD allows in an element.
#[derive(Debug, Default)]
struct Allowed {
    children: BTreeSet<String>,
    attributes: BTreeSet<String>,
    required: BTreeSet<String>,
}

/// An element of a file.
#[derive(Debug)]
struct Element {
    name: String,
    parent: Option<String>,
    attributes: BTreeMap<String, String>,
    text: String,
}

fn attributes(start: &BytesStart) -> BTreeMap<String, String> {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
    let attribute = |a: quick_xml::events::attributes::Attribute| {
        (
            text(a.key.as_ref()),
            a.normalized_value(quick_xml::XmlVersion::Implicit1_0).expect("well-formed").into_owned(),
        )
    };
    start.attributes().map(|a| attribute(a.expect("well-formed"))).collect()
}

/// Every element, in order; panics where the text is not well-formed.
fn elements(text: &str) -> Vec<Element> {
    let mut reader = Reader::from_str(text);
    let (mut open, mut all): (Vec<usize>, Vec<Element>) = (Vec::new(), Vec::new());
    loop {
        let event = reader.read_event().expect("well-formed");
        let is_empty = matches!(event, Event::Empty(_));
        match event {
            Event::Start(start) | Event::Empty(start) => {
                let name = String::from_utf8(start.name().as_ref().to_vec()).expect("UTF-8");
                let parent = open.last().map(|i| all[*i].name.clone());
                all.push(Element { name, parent, attributes: attributes(&start), text: String::new() });
                if !is_empty {
                    open.push(all.len() - 1);
                }
            }
            Event::Text(text) => {
                if let Some(i) = open.last() {
                    all[*i].text.push_str(&text.decode().expect("UTF-8"));
                }
            }
            Event::End(_) => drop(open.pop()),
            Event::Eof => return all,
            // What is escaped in a text is not asked for.
            Event::CData(_)
            | Event::Comment(_)
            | Event::Decl(_)
            | Event::PI(_)
            | Event::DocType(_)
            | Event::GeneralRef(_) => {}
        }
    }
}

/// The elements that the XSD declares at its top, which are all that it has.
fn schema() -> BTreeMap<String, Allowed> {
    let mut allowed: BTreeMap<String, Allowed> = BTreeMap::new();
    let mut current = String::new();
    for element in elements(&read("schemas/junit-10.xsd")) {
        let named = |key: &str| element.attributes.get(key).cloned();
        match element.name.as_str() {
            "xs:element" if element.parent.as_deref() == Some("xs:schema") => {
                current = named("name").expect("a name");
                allowed.entry(current.clone()).or_default();
            }
            "xs:complexType" if element.parent.as_deref() == Some("xs:schema") => current.clear(),
            "xs:element" => {
                let Some(allowance) = allowed.get_mut(&current) else { continue };
                allowance.children.extend(named("ref"));
            }
            "xs:attribute" => {
                let Some(allowance) = allowed.get_mut(&current) else { continue };
                allowance.attributes.extend(named("name"));
                allowance.required.extend(named("name").filter(|_| named("use").as_deref() == Some("required")));
            }
            _ => {}
        }
    }
    allowed
}

/// Violations of the XSD by a file.
fn against_schema(text: &str) -> Vec<String> {
    let schema = schema();
    let mut wrong = Vec::new();
    for element in elements(text) {
        let Some(allowed) = schema.get(&element.name) else {
            wrong.push(format!("no element {}", element.name));
            continue;
        };
        let texts: BTreeSet<String> = element.attributes.keys().cloned().collect();
        wrong.extend(texts.difference(&allowed.attributes).map(|a| format!("{} has no {a}", element.name)));
        wrong.extend(allowed.required.difference(&texts).map(|a| format!("{} lacks {a}", element.name)));
        if let Some(parent) = &element.parent
            && !schema.get(parent).is_some_and(|p| p.children.contains(&element.name))
        {
            wrong.push(format!("{} in {parent}", element.name));
        }
    }
    wrong
}

fn write_report(name: &str, text: String) -> String {
    std::fs::write(std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name), &text).expect("a file below target/");
    text
}

/// A wrong file is noticed.
#[test]
fn junit_file_satisfies_the_xsd() {
    let text = write_report("holdsafe.junit.xml", junit(&everything()));
    assert_eq!(against_schema(&text), Vec::<String>::new());
    let wrong = text.replacen("testcase name", "testcase title", 1).replacen("system-out", "skipped-out", 2);
    assert_eq!(against_schema(&wrong).len(), 3, "{:?}", against_schema(&wrong));
}

#[test]
fn suite_counts_failures_and_errors() {
    let all = elements(&write_report("matrix.junit.xml", junit(&read_results(&["matrix.json"]))));
    let suite =
        |id: &str| all.iter().find(|e| e.name == "testsuite" && e.attributes["name"].starts_with(id)).expect("a suite");
    let counts =
        |element: &Element| ["tests", "failures", "errors"].map(|key| element.attributes[key].clone()).join(" ");
    assert_eq!(counts(suite("A01")), "4 0 0");
    assert_eq!(counts(suite("A04")), "9 1 0");
    assert_eq!(counts(suite("A40")), "1 0 1");
    let whole = all.iter().find(|e| e.name == "testsuites").expect("the whole");
    let count = |name: &str| all.iter().filter(|e| e.name == name).count();
    assert_eq!(counts(whole), format!("{} {} {}", count("testcase"), count("failure"), count("error")));
}

#[test]
fn failure_names_expectation_and_reproduction_line() {
    let all = elements(&write_report("runs.junit.xml", junit(&read_results(&["runs.json"]))));
    let failure = all.iter().find(|e| e.name == "failure").expect("a failure");
    assert_eq!(failure.attributes["message"], "2 of 2 trials not as expected (HOLD_SAFE 2); expected DEGRADED");
    assert_eq!(failure.text, "holdsafe run loss --trials 1 --seed 1");
    let error = all.iter().find(|e| e.name == "error").expect("an error");
    assert!(error.attributes["type"] == "INVALID" && error.text.starts_with("P10 at "), "{error:?}");
    let out = all.iter().find(|e| e.name == "system-out").expect("an output");
    assert!(out.text.contains("n: 3\n") && out.text.contains("unsafe below (95 %): 63.16 %\n"), "{}", out.text);
}

#[test]
fn result_text_cannot_break_the_xml() {
    let text = write_report("hostile.junit.xml", junit(&hostile("\"></testcase>&amp;]]>\u{0}\u{1b}\u{ffff}\r é")));
    assert_eq!(against_schema(&text), Vec::<String>::new());
    assert!(!text.contains(['\u{0}', '\u{1b}', '\u{ffff}']));
}
