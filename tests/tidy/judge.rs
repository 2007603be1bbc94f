//! The judge's rooms: facts read neither receipts nor properties, and those two do not read each other. And its table of properties, which
//! the documents follow.

use std::fs;

use oracle::{Breach, PROPERTIES};

use super::{code, root, sources};

#[test]
fn rooms_of_the_judge_read_facts_only() {
    let rooms =
        [("facts", ["receipts", "properties"]), ("receipts", ["properties"; 2]), ("properties", ["receipts"; 2])];
    for (room, closed) in rooms {
        for (file, text) in sources(&format!("crates/judge/oracle/src/{room}")) {
            let code = code(&text);
            for other in closed {
                assert!(!code.contains(&format!("crate::{other}")), "{file} reads {other}");
                assert!(!code.contains("use crate::{"), "{file} imports from the root: name the room");
            }
        }
    }
}

#[test]
fn architecture_has_every_property() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("a readable file");
    let rows = text.lines().filter_map(|line| line.strip_prefix("| P")?.split_once(" |"));
    let names: Vec<String> = rows.map(|(number, _)| format!("P{number}")).collect();
    assert_eq!(names, PROPERTIES.map(|row| row.name.to_owned()));
}

#[test]
fn outcomes_page_has_the_properties_of_each_class() {
    let text = fs::read_to_string(root().join("docs/reference/outcomes.md")).expect("a readable file");
    for (breach, class) in [(Breach::Unsafe, "a safety property is violated"), (Breach::Late, "a time bound is missed")]
    {
        let names: Vec<&str> = PROPERTIES.iter().filter(|row| row.breach == breach).map(|row| row.name).collect();
        let stated = format!("{class} ({})", names.join(", "));
        assert!(text.contains(&stated), "the page does not say: {stated}");
    }
}
