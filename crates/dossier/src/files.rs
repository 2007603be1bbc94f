//! Figures as files: each as SVG, its numbers as CSV and as a LaTeX table, and its caption.

use crate::figure::Figure;

/// A file to be written.
#[derive(Clone, Debug)]
pub struct File {
    /// Its name; no folder.
    pub name: String,
    /// What is in it.
    pub text: String,
}

/// The files of these figures. Figures of the same name are told apart by a number.
pub fn files(figures: &[Figure]) -> Vec<File> {
    let mut taken = std::collections::BTreeMap::<&str, u32>::new();
    let mut all = Vec::new();
    for figure in figures {
        let before = taken.entry(&figure.name).or_default();
        *before += 1;
        let name = if *before == 1 { figure.name.clone() } else { format!("{}-{before}", figure.name) };
        let mut put = |kind: &str, text: String| all.push(File { name: format!("{name}.{kind}"), text });
        put("svg", figure.drawing.file(&figure.title));
        put("csv", figure.table.csv());
        put("tex", figure.table.latex());
        put("txt", format!("{}. {}\n", figure.title, figure.caption));
    }
    all
}
