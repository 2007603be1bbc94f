//! The display as a page for a browser: markup, styles and the scripts that draw one [`picture`](crate::picture) after
//! the other.
//!
//! A view, as the window is, and one that can only look: its answers, names and readings are the picture's own. Age is
//! bounded as everywhere: by the page's own clock, from the moment at which it asked for the picture. Serving it is left
//! to `link`.

/// Path below the page's address, media type and text of each file of the page.
///
/// Its script asks for `picture` ten times a second: `{"held_ms", "picture"}`, where `held_ms` is the upper bound of the
/// time the picture has been ready, or null where that is unknown. And once for `site`: [`crate::site::Site`].
pub const FILES: [(&str, &str, &str); 5] = [
    ("", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("page.css", "text/css; charset=utf-8", include_str!("page/page.css")),
    ("ages.js", "text/javascript; charset=utf-8", include_str!("page/ages.js")),
    ("charts.js", "text/javascript; charset=utf-8", include_str!("page/charts.js")),
    ("page.js", "text/javascript; charset=utf-8", include_str!("page/page.js")),
];
