//! The helper's two stages: the entry, which takes namespaces, and the warden, which is the first process in them and starts the guest.
//!
//! Standard input and output are the guest's. Standard error is the socket to the launcher. Both stages are the same program; the second
//! has one argument more. Only the second stage reads the specification.

mod entry;
mod error;
mod filter;
mod limits;
mod view;
mod warden;

use std::fs::{self, File};
use std::io::{self, Write};
use std::process::ExitCode;

/// Argument before the warden's own.
const WARDEN: &str = "warden";
/// Argument of the entry to take no namespaces.
pub(crate) const PLAIN: &str = "--no-namespaces";

/// The stage that the program's arguments ask for.
pub fn main() -> ExitCode {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let done = match arguments.iter().position(|word| word == WARDEN) {
        Some(at) => warden::main(arguments.get(at + 1).filter(|reason| !reason.is_empty()).cloned()),
        None => entry::main(&mut arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            // The launcher reads this as the reason for a failed start.
            let _unread = writeln!(io::stderr(), "{why}");
            ExitCode::FAILURE
        }
    }
}

/// The null device. The entry opens it before the warden starts. While the warden replaces `/dev` the device is
/// missing, and an open file in the new folder would keep it from becoming read-only.
fn null() -> io::Result<File> {
    File::options().read(true).write(true).open("/dev/null")
}

/// Closes the guest's standard input and output in this process, so that the guest alone holds them.
fn let_go(null: &File) -> io::Result<()> {
    rustix::stdio::dup2_stdin(null)?;
    rustix::stdio::dup2_stdout(null)?;
    Ok(())
}

/// Closes descriptors that a library of the launcher may have left open.
fn close_others() -> io::Result<()> {
    let open: Vec<i32> = fs::read_dir("/proc/self/fd")?
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok())
        .filter(|fd| *fd > 2)
        .collect();
    for fd in open {
        // The descriptor of the listing itself is closed already.
        let _closed = nix::unistd::close(fd);
    }
    Ok(())
}
