//! No circle between the modules at the top of a crate: each can be read, moved and tested without those that use it.
//!
//! A module depends on the names in its `crate::` paths, and in its `super::` paths where they reach the top; a name that the
//! root re-exports belongs to its module. Left out are tests, and the code in the root itself, which puts a crate together from
//! its modules.

use std::collections::{BTreeMap, BTreeSet};

use super::crates::folders;
use super::{code, root, sources};

#[test]
fn no_crate_has_a_circle_of_modules() {
    let mut circles = Vec::new();
    for folder in folders().into_iter().filter(|folder| root().join(folder).join("src/lib.rs").is_file()) {
        let src = format!("{folder}/src/");
        let files: Vec<_> =
            sources(&src).into_iter().map(|(file, text)| (file[src.len()..].to_owned(), text)).collect();
        let left = circle(Graph::from_files(&files).edges);
        circles.extend(left.into_iter().map(|((from, to), file)| format!("{folder}: {from} → {to} ({file})")));
    }
    assert!(circles.is_empty(), "modules that depend on each other:\n{}", circles.join("\n"));
}

/// A dependency between two modules, with a file that has it.
type Edges = BTreeMap<(String, String), String>;

/// The edges that lie on circles, or between them.
fn circle(mut edges: Edges) -> Edges {
    loop {
        let from: BTreeSet<String> = edges.keys().map(|(from, _)| from.clone()).collect();
        let to: BTreeSet<String> = edges.keys().map(|(_, to)| to.clone()).collect();
        let before = edges.len();
        edges.retain(|(start, end), _| to.contains(start) && from.contains(end));
        if edges.len() == before {
            return edges;
        }
    }
}

struct Graph {
    modules: BTreeSet<String>,
    /// The module of each name that the root re-exports.
    exported: BTreeMap<String, String>,
    edges: Edges,
}

impl Graph {
    /// The graph of a crate of these files, by their paths below `src/`.
    fn from_files(files: &[(String, String)]) -> Self {
        let lib = files.iter().find(|(file, _)| file == "lib.rs").map(|(_, text)| shipped(text)).expect("a lib.rs");
        let modules = declared(&lib);
        let mut this = Self { exported: exports(&lib, &modules), modules, edges: Edges::new() };
        for (file, text) in files {
            let parts: Vec<&str> = file.trim_end_matches(".rs").split('/').filter(|part| *part != "mod").collect();
            if this.modules.contains(parts[0]) && parts.last() != Some(&"tests") {
                named(&shipped(text), parts.len()).iter().for_each(|name| this.depend(parts[0], name, file));
            }
        }
        this
    }

    fn depend(&mut self, from: &str, name: &str, file: &str) {
        if let Some(to) = self.modules.get(name).or_else(|| self.exported.get(name))
            && to != from
        {
            self.edges.entry((from.to_owned(), to.clone())).or_insert_with(|| file.to_owned());
        }
    }
}

/// Code without comments and without items that only tests have. As rustfmt sets it, such an item ends with its line or at the
/// margin.
fn shipped(text: &str) -> String {
    let mut retained = String::new();
    let code = code(text);
    let mut lines = code.lines();
    while let Some(line) = lines.next() {
        if line != "#[cfg(test)]" {
            retained.push_str(line);
            retained.push('\n');
            continue;
        }
        let item = lines.next().unwrap_or_default();
        if !item.ends_with(';') {
            lines.by_ref().find(|line| *line == "}");
        }
    }
    retained
}

/// The modules that a root declares.
fn declared(lib: &str) -> BTreeSet<String> {
    let name = |line: &str| Some(line.strip_suffix(';')?.rsplit_once("mod ")?.1.to_owned());
    lib.lines().filter(|line| line.starts_with("mod ") || line.starts_with("pub")).filter_map(name).collect()
}

/// The names that a root re-exports of its modules.
fn exports(lib: &str, modules: &BTreeSet<String>) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    for item in lib.split("pub use ").skip(1) {
        let path = item.split(';').next().unwrap_or_default();
        let mut words = path.split(|c: char| !is_word(c)).filter(|word| !word.is_empty() && *word != "self");
        let Some(module) = words.next().filter(|first| modules.contains(*first)) else { continue };
        found.extend(words.map(|word| (word.to_owned(), module.to_owned())));
    }
    found
}

/// Text behind each `path` that begins there.
fn text_after<'a>(code: &'a str, path: &str) -> Vec<&'a str> {
    let begins = |at: usize| !code[..at].ends_with(|c: char| is_word(c) || c == '$');
    code.match_indices(path)
        .filter(|(index, _)| begins(*index))
        .map(|(index, found)| &code[index + found.len()..])
        .collect()
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The names at the top of the crate that the code of a file so deep below it uses.
fn named(code: &str, depth: usize) -> BTreeSet<String> {
    let supers = "super::".repeat(depth);
    text_after(code, "crate::").into_iter().chain(text_after(code, &supers)).flat_map(heads).collect()
}

/// The first names of a path, or of each in a group of paths.
fn heads(path: &str) -> Vec<String> {
    let word = |text: &str| text.chars().take_while(|c| is_word(*c)).collect::<String>();
    let Some(group) = path.strip_prefix('{') else { return vec![word(path)] };
    let (mut found, mut depth, mut fresh) = (Vec::new(), 1, true);
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 1 => fresh = true,
            c if fresh && is_word(c) => {
                found.push(word(&group[at..]));
                fresh = false;
            }
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
    found
}

#[test]
fn circles_are_found_through_groups_and_supers() {
    let file = |name: &str, text: &str| (name.to_owned(), text.to_owned());
    let circle_with = |b: &str, d: &str| {
        let lib = "pub mod a;\npub mod b;\nmod c;\nmod d;\npub use b::{Inner, Shown};\n#[cfg(test)]\nmod tests;\n";
        let a = "use crate::{b::{self, Inner}, c};\n// crate::nothing\n";
        let files = [("lib.rs", lib), ("a.rs", a), ("b/deep.rs", b), ("c.rs", ""), ("d.rs", d)];
        let left = circle(Graph::from_files(&files.map(|(name, text)| file(name, text))).edges);
        left.into_keys().map(|(from, to)| format!("{from} {to}")).collect::<Vec<_>>()
    };
    assert_eq!(circle_with("use super::super::a::Outer;\n", ""), ["a b", "b a"]);
    assert_eq!(circle_with("fn f() -> crate::a::Outer {}\n", ""), ["a b", "b a"]);
    assert_eq!(circle_with("use crate::d;\n", "use crate::Shown;\n"), ["b d", "d b"]);
    let none = "use super::a::Inner;\n#[cfg(test)]\nmod tests {\n    use crate::a;\n}\n";
    assert!(circle_with(none, "use crate::root_item;\n").is_empty());
}
