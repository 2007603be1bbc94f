//! The display as a page for a browser: markup, styles and the script that draws one [`picture`](crate::picture) after
//! the other.
//!
//! A view, as the window is, and one that can only look. Age is bounded as everywhere: by the page's own clock, from
//! the moment at which it asked for a picture. Serving it is left to `link`.

/// Text of the page.
pub const HTML: &str = include_str!("page/index.html");
/// Styles of the page, for dark and light rooms.
pub const CSS: &str = include_str!("page/page.css");
/// Its script. It asks for `picture` ten times a second: `{"held_ms", "picture"}`, where `held_ms` is the upper bound
/// of the time the picture has been ready, or null where that is unknown. And once for `site`: [`crate::site::Site`].
pub const JS: &str = include_str!("page/page.js");
