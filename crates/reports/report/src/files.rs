//! Figures as files: each as SVG and, with feature `pdf`, as PDF, its numbers as CSV and as a LaTeX table, and its caption.

use crate::figure::Figure;
#[cfg(feature = "pdf")]
use crate::pdf::{PdfError, Press};

/// Error without the feature `pdf`: the other formats cannot fail.
#[cfg(not(feature = "pdf"))]
type PdfError = std::convert::Infallible;

/// A file to be written.
#[derive(Clone, Debug)]
pub struct File {
    /// Its name; no folder.
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// The files of these figures. Figures of the same name are distinguished by a number.
///
/// # Errors
/// When one of them has no page of PDF.
pub fn files(figures: &[Figure]) -> Result<Vec<File>, PdfError> {
    #[cfg(feature = "pdf")]
    let press = Press::default();
    let mut map = std::collections::BTreeMap::<&str, u32>::new();
    let mut all = Vec::new();
    for figure in figures {
        let before = map.entry(&figure.name).or_default();
        *before += 1;
        let name = if *before == 1 { figure.name.clone() } else { format!("{}-{before}", figure.name) };
        let mut put = |kind: &str, bytes: Vec<u8>| all.push(File { name: format!("{name}.{kind}"), bytes });
        let svg = figure.drawing.file(&figure.title);
        #[cfg(feature = "pdf")]
        put("pdf", press.page(&svg)?);
        put("svg", svg.into_bytes());
        put("csv", figure.table.csv().into_bytes());
        put("tex", figure.table.latex().into_bytes());
        put("txt", format!("{}. {}\n", figure.title, figure.caption).into_bytes());
    }
    Ok(all)
}
