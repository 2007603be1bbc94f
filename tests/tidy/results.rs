//! Kinds of the objects that the programs print: each has a golden file for its version.

use std::collections::BTreeSet;
use std::fs;

use super::{code, root, sources};

/// Crates whose tests hold objects against golden files.
const HELD_IN: [&str; 4] = ["crates/reports/results", "crates/judge/recording", "crates/holdsafe", "measurements/lab"];

/// The kinds that the programs name where they print or write an object.
fn kinds() -> BTreeSet<String> {
    // A trial's end is written by `recording`, its kind in the object.
    let mut kinds = BTreeSet::from(["verdict".to_owned()]);
    for (_, text) in ["crates/holdsafe", "measurements/lab"].iter().flat_map(|name| sources(&format!("{name}/src"))) {
        let code = code(&text);
        let words = |from: &str| from.split('"').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
        kinds.extend(code.split("print_json(\"").skip(1).filter_map(|rest| Some(rest.split_once('"')?.0.to_owned())));
        kinds
            .extend(code.split("give(context, \"").skip(1).filter_map(|rest| Some(rest.split_once('"')?.0.to_owned())));
        let written = code.split("write_result(").skip(1).filter_map(|rest| rest.split_once(')'));
        kinds.extend(written.filter_map(|(arguments, _)| words(arguments).into_iter().nth(1)));
    }
    kinds
}

#[test]
fn every_printed_kind_has_a_golden_file() {
    let (kinds, version) = (kinds(), evidence::SCHEMA_VERSION);
    assert!(kinds.len() > 30 && kinds.contains("matrix") && kinds.contains("runs"), "{kinds:?}");
    for kind in &kinds {
        let named = HELD_IN.map(|name| format!("{name}/tests/golden/{kind}-v{version}.json"));
        let held = named.iter().filter(|file| root().join(file).exists()).count();
        assert_eq!(held, 1, "{kind} has no golden file of version {version}, or several");
    }
    for folder in HELD_IN {
        for file in fs::read_dir(root().join(format!("{folder}/tests/golden"))).expect("a folder") {
            let name = file.expect("an entry").file_name().to_string_lossy().into_owned();
            let kind = name.rsplit_once("-v").map(|(kind, _)| kind.to_owned());
            assert!(kind.is_some_and(|kind| kinds.contains(&kind)), "{folder}: {name} is of no kind that is printed");
        }
    }
}
