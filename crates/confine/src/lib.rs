//! Guests' programs as confined processes, and the exchange of lines with them.
//!
//! Beside `link` the one crate that knows processes. The crate `guest` has the requests and answers; here a line is bytes. A guest's process
//! comes about in two stages, both of the helper program ([`inside`]): the *entry* takes namespaces of its own and starts the *warden*,
//! which is the first process in them. The warden hides the machine, gives up all rights, starts the guest and waits for its end.
//! When the warden ends, the kernel ends every process of its namespace, and it ends with its socket to the launcher: nothing
//! of a guest survives its channel, nor a launcher that is killed. [`level`] says how much of this a machine gives.
//!
//! Not hidden from a guest: files that its user may read, outside of `/proc`, `/dev`, `/run` and temporary folders. It can tell them to
//! nobody but the launcher.

mod channel;
pub mod inside;
mod launch;
pub mod level;
mod spec;

use std::path::PathBuf;
use std::sync::Arc;

use guest::Launcher;

pub use level::Level;

/// Starts guests by means of `helper`, the holdsafe program, as `HELPER service confine`.
pub fn launcher(helper: PathBuf) -> Arc<dyn Launcher> {
    launcher_by(helper, vec!["service".into(), "confine".into()])
}

/// Starts guests by means of another program that calls [`inside::main`] when it is given the arguments `leading`.
pub fn launcher_by(helper: PathBuf, leading: Vec<String>) -> Arc<dyn Launcher> {
    Arc::new(launch::Helper { program: helper, leading })
}
