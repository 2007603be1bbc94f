//! Opening a window, in a build that has one; a build without it names the build that does.

use link::display;

#[cfg(feature = "gui")]
pub(super) use crate::gui::app::run as console;
#[cfg(feature = "gui")]
pub use crate::gui::sensors::run as sensors;
#[cfg(not(feature = "gui"))]
use crate::source::{Looks, Sensors, Source, Wake};

/// No window can be opened, with the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoWindow {
    /// The program was built without it.
    #[error(
        "this build has no window: `cargo run --release --features window -- …`, or look from a terminal with `holdsafe watch`"
    )]
    NotBuilt,
    /// The display, or a library that it takes, is missing.
    #[error(transparent)]
    Display(#[from] display::NoWindow),
    /// The display refused it.
    #[error("the window cannot be opened: {0}")]
    Refused(String),
}

/// Asks, before anything is started, for everything that a window needs.
///
/// # Errors
/// With the first thing missing and its remedy.
pub fn probe() -> Result<(), NoWindow> {
    if !cfg!(feature = "gui") {
        return Err(NoWindow::NotBuilt);
    }
    Ok(display::Environment::from_process().probe()?)
}

/// The console's window, absent from this build.
#[cfg(not(feature = "gui"))]
pub(super) fn console(_: Looks, _: Box<dyn Source>, _: impl FnOnce(Wake) + 'static) -> Result<(), NoWindow> {
    Err(NoWindow::NotBuilt)
}

/// The window of a unit's sensors, absent from this build.
///
/// # Errors
/// Always.
#[cfg(not(feature = "gui"))]
pub fn sensors(_: Box<dyn Sensors>) -> Result<(), NoWindow> {
    Err(NoWindow::NotBuilt)
}
