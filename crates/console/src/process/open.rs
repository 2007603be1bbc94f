//! Opening a window, in a build that has one; a build without it names the build that does.

use link::display;

#[cfg(feature = "gui")]
pub(super) use crate::gui::app::run as console;
#[cfg(feature = "gui")]
pub use crate::gui::sensors::run as sensors;
use crate::source::NoWindow;
#[cfg(not(feature = "gui"))]
use crate::source::{Looks, Sensors, Source, Wake};

/// Asks, before anything is started, for everything that a window needs.
///
/// # Errors
/// With the first thing missing and its remedy.
pub fn probe() -> Result<(), NoWindow> {
    if !cfg!(feature = "gui") {
        return Err(NoWindow::NotBuilt);
    }
    display::Environment::from_process().probe().map_err(|missing| NoWindow::Display(missing.to_string()))
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
