//! Guests' programs as confined processes, and the exchange of lines with them.
//!
//! Beside `link` the one crate that knows processes and real time. The crate `guest` has the requests and answers; here a line is bytes. A guest's process
//! comes about in two stages, both of the helper program ([`inside`]): the *entry* takes namespaces of its own and starts the *warden*,
//! which is the first process in them. The warden hides the machine, gives up all rights, starts the guest and waits for its end.
//! When the warden ends, the kernel ends every process of its namespace, and it ends with its socket to the launcher: no process
//! of a guest survives its channel, or a launcher that is killed. [`level()`] says how much of this a machine gives.
//!
//! Not hidden from a guest: files that its user may read, outside of `/proc`, `/dev`, `/run` and temporary folders. It can tell them to
//! the launcher alone.

mod channel;
mod deadline;
pub mod inside;
mod launch;
mod level;
mod process;
mod spec;

use std::path::PathBuf;
use std::sync::Arc;

use guest::{Failure, Launcher};

pub use level::Level;

/// The arguments with which holdsafe itself is the helper.
pub fn as_service() -> Vec<String> {
    ["service", "confine"].map(str::to_owned).to_vec()
}

/// Starts guests by means of the program `helper`, which calls [`inside::main`] when its arguments are those of `leading`: for holdsafe,
/// [`as_service`].
pub fn launcher(helper: PathBuf, leading: Vec<String>) -> Arc<dyn Launcher> {
    Arc::new(launch::Helper { program: helper, leading })
}

/// The level that guests of a launcher with this helper reach on this machine, found by trying; see [`launcher`].
///
/// # Errors
/// The helper could not be started.
pub fn level(helper: PathBuf, leading: Vec<String>) -> Result<Level, Failure> {
    launch::Helper { program: helper, leading }.level()
}
