//! Commands in documents: the program has each of them.

use super::documents::{Documented, documented};
use super::{lab, root};

/// `--help` behind a command makes the parser check its verbs, options and values without running it.
#[test]
fn documented_commands_are_understood() {
    let all = documented(&root(), "lab", false);
    assert!(all.len() > 40, "{} commands found", all.len());
    for Documented { place, features, arguments } in &all {
        assert_eq!(*features, None, "{place}: there are no features");
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).chain(["--help"]).collect();
        let output = lab(&arguments);
        assert!(output.status.success(), "{place}: {}", String::from_utf8_lossy(&output.stderr));
    }
}
