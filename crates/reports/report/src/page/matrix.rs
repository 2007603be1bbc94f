//! The threat matrix as a figure for files, a bar a threat and kind of evidence, and the content of its rows in words.

use evidence::trial::Outcomes;
use results::report::{Kind, Matrix, MatrixRow};

use super::words::percent;
use crate::Dossier;
use crate::figure::{Bar, Figure, Segment, Table, bar_table, bars, class_of_outcome};
use crate::reader::FoundResult;
use crate::tried::class_counts;

pub(super) fn figures(dossier: &Dossier) -> Vec<Figure> {
    matrices(dossier).enumerate().flat_map(|(i, matrix)| drawn(i, matrix)).collect()
}

fn matrices(dossier: &Dossier) -> impl Iterator<Item = &Matrix> {
    dossier.results.files().iter().filter_map(|g| if let FoundResult::Matrix(m) = &g.found { Some(m) } else { None })
}

/// One figure for the rows under a full policy, one for those with a check waived.
fn drawn(i: usize, matrix: &Matrix) -> Vec<Figure> {
    let figure = |ablation: bool| {
        let kinds = matrix.rows.iter().flat_map(|row| row.kinds.iter().map(move |kind| (row, kind)));
        let all: Vec<Bar> = kinds.filter(|(_, k)| k.ablation == ablation).map(|(row, kind)| bar(row, kind)).collect();
        let (name, title) = if ablation {
            ("matrix-ablation", "Threats with a check waived (ABLATION)")
        } else {
            ("matrix", "Threats")
        };
        (!all.is_empty()).then(|| Figure {
            name: if i == 0 { name.to_owned() } else { format!("{name}-{}", i + 1) },
            title: format!("{title}: how trials ended"),
            caption: format!(
                "Shares of the nine classes by threat and place of evidence; at the right n, trials outside the classes that were expected, and the \
                 exact upper 95 % bound on the unsafe rate of the worst run. What stands \
                 in several rows is counted in each. Seed {}.",
                matrix.seed
            ),
            drawing: bars(&all, None),
            table: bar_table(&all, "threat, evidence", "n, not expected, bound"),
        })
    };
    [figure(false), figure(true)].into_iter().flatten().collect()
}

fn bar(row: &MatrixRow, kind: &Kind) -> Bar {
    let place =
        if kind.counts { kind.evidence.name().to_owned() } else { format!("{}, no mechanism", kind.evidence.name()) };
    let off = if kind.unexpected > 0 { format!(", {} NOT EXPECTED", kind.unexpected) } else { String::new() };
    Bar {
        name: format!("{} {place}", row.id),
        parts: parts(&kind.outcomes),
        said: format!("n {}{off}, < {}", kind.n, percent(kind.unsafe_upper_95)),
    }
}

/// The parts of a bar of outcomes.
fn parts(outcomes: &Outcomes) -> Vec<Segment> {
    let part = |(class, n): (&evidence::trial::Outcome, &u64)| Segment {
        name: class.name().to_owned(),
        class: class_of_outcome(class.name()),
        amount: *n as f64,
    };
    outcomes.iter().map(part).collect()
}

/// Every threat in words.
pub(super) fn words_of(dossier: &Dossier) -> Table {
    let mut rows = Table::new(&[
        "id",
        "threat",
        "boundary",
        "STRIDE",
        "techniques",
        "must come of it",
        "evidence: n, outcomes",
        "open",
    ]);
    for row in matrices(dossier).flat_map(|matrix| &matrix.rows) {
        let line = |k: &Kind| {
            let ablation = if k.ablation { " ABLATION" } else { "" };
            format!("{}{ablation}: {}, {}", k.evidence.name(), k.n, class_counts(&k.outcomes))
        };
        let kinds: Vec<String> = row.kinds.iter().map(line).collect();
        rows.rows.push(vec![
            row.id.clone(),
            unmarked(&row.threat),
            row.interface.clone(),
            row.stride.clone(),
            row.techniques.join(", "),
            unmarked(&row.containment),
            kinds.join("; "),
            row.open.clone().unwrap_or_default(),
        ]);
    }
    rows
}

/// The catalogue's words without their marks of emphasis, which a cell has no use for.
pub(super) fn unmarked(words: &str) -> String {
    words.replace('*', "")
}
