//! A drawing's SVG as a page of PDF, for documents that take no SVG.
//!
//! Words stay words: they can be searched for and copied. The fonts are carried along, so that a page is the same wherever it is
//! made, byte for byte.

use std::sync::Arc;

use svg2pdf::usvg::fontdb::Database;
use svg2pdf::usvg::{Options, Tree};
use svg2pdf::{ConversionOptions, PageOptions};

/// Reason for the lack of a PDF.
#[derive(Debug, thiserror::Error)]
pub enum PdfError {
    /// The drawing is no SVG.
    #[error("no SVG: {0}")]
    Svg(#[from] svg2pdf::usvg::Error),
    /// SVG that cannot be drawn.
    #[error("the SVG has no PDF: {0}")]
    Pdf(svg2pdf::ConversionError),
}

/// Makes PDF of SVG.
#[derive(Debug)]
pub struct Press {
    options: Options<'static>,
}

impl Default for Press {
    fn default() -> Self {
        let mut fonts = Database::new();
        for font in [epaint_default_fonts::UBUNTU_LIGHT, epaint_default_fonts::HACK_REGULAR] {
            fonts.load_font_data(font.to_vec());
        }
        // Figures ask for `sans-serif`, and the first font's family is Ubuntu.
        fonts.set_sans_serif_family("Ubuntu");
        let options = Options { fontdb: Arc::new(fonts), font_family: "Ubuntu".to_owned(), ..Options::default() };
        Self { options }
    }
}

impl Press {
    /// Page of the size of the drawing: a pixel is a point.
    ///
    /// # Errors
    /// Text that is not SVG, or SVG that cannot be drawn.
    pub fn page(&self, svg: &str) -> Result<Vec<u8>, PdfError> {
        let tree = Tree::from_str(svg, &self.options)?;
        let conversion = ConversionOptions { embed_text: true, ..ConversionOptions::default() };
        svg2pdf::to_pdf(&tree, conversion, PageOptions { dpi: 72.0 }).map_err(PdfError::Pdf)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Drawing;

    #[test]
    fn drawing_is_a_stable_page_of_its_size() {
        let svg = Drawing::new(310.0, 120.0).file("x");
        let page = Press::default().page(&svg).expect("a page");
        assert!(page.starts_with(b"%PDF-1.7") && page.ends_with(b"%%EOF"));
        let text = String::from_utf8_lossy(&page);
        assert!(text.contains("/MediaBox [0 0 310 120]"), "{text}");
        assert_eq!(page, Press::default().page(&svg).expect("a page"));
    }

    #[test]
    fn what_is_no_svg_is_an_error() {
        for bad in ["", "<svg", "<html/>", "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"-1\" height=\"2\"/>"] {
            assert!(Press::default().page(bad).is_err(), "{bad}");
        }
    }
}
