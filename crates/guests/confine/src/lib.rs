//! Guests' programs as confined processes, and the exchange of lines with them.
//!
//! Beside `link` the one crate that knows processes and real time. The crate `guest` has the requests and answers; here a line is bytes. A guest's process
//! comes about in two stages, both of the helper program ([`inside`]): the *entry* takes namespaces of its own and starts the *warden*,
//! which is the first process in them. The warden hides the machine, gives up all rights, starts the guest and waits for its end.
//! When the warden ends, the kernel ends every process of its namespace, and it ends with its socket to the launcher: no process
//! of a guest survives its channel, or a launcher that is killed. [`level()`] says how much of this a machine gives.
//!
//! Not hidden from a guest: files that its user may read, outside of `/proc`, `/dev`, `/run`, temporary folders and the folder that its
//! launcher hides. It can tell them to the launcher, and to any process that reads a named pipe that its user may write.

mod channel;
mod deadline;
pub mod inside;
mod launch;
mod level;
mod process;
mod spec;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use guest::{Failure, Launcher};

pub use level::Level;

/// The arguments with which holdsafe itself is the helper.
pub fn as_service() -> Vec<String> {
    ["service", "confine"].map(str::to_owned).to_vec()
}

/// Starts guests by means of the program `helper`, which calls [`inside::main`] when its arguments are as of `leading`: for holdsafe,
/// [`as_service`]. A guest sees the folder `hidden` empty.
pub fn launcher(helper: PathBuf, leading: Vec<String>, hidden: Option<PathBuf>) -> Arc<dyn Launcher> {
    Arc::new(launch::Helper { program: helper, leading, hidden })
}

/// The arguments with which guests are confined best on this machine, and the level that they reach, found by trying: without namespaces
/// where their parts are refused one by one, as by AppArmor's rules for users other than root.
///
/// # Errors
/// The helper starts with neither.
pub fn best(helper: &Path, leading: &[String]) -> Result<(Vec<String>, Level), Failure> {
    let refused = match level(helper.to_owned(), leading.to_vec()) {
        Ok(level) => return Ok((leading.to_vec(), level)),
        Err(refused) => refused,
    };
    let plain = [leading, &[inside::PLAIN.to_owned()]].concat();
    let mut level = level(helper.to_owned(), plain.clone())?;
    level.why.insert(0, refused.why);
    Ok((plain, level))
}

/// The level that guests of a launcher with this helper reach on this machine, found by trying; see [`launcher`].
///
/// # Errors
/// The helper could not be started.
pub fn level(helper: PathBuf, leading: Vec<String>) -> Result<Level, Failure> {
    launch::Helper { program: helper, leading, hidden: None }.level()
}
