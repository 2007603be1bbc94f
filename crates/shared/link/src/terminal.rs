//! Lines on stdout and stderr, for every program of the workspace.
//!
//! `println!` and `eprintln!` panic when the stream is gone. A reader that went away is no failure here: the exit code still
//! tells how the command ended.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write};

/// Writes a line to stdout. An error other than a reader that went away is reported on stderr.
pub fn say(line: Arguments<'_>) {
    match writeln!(std::io::stdout(), "{line}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => note(format_args!("stdout: {error}")),
        Ok(()) | Err(_) => {}
    }
}

/// Writes a line to stderr, if anybody reads it; [`crate::note!`] takes a format string.
pub fn note(line: Arguments<'_>) {
    // There is no third stream to report this on.
    let _unread = writeln!(std::io::stderr(), "{line}");
}

/// Writes a formatted line to stderr, and goes on where stderr is closed.
#[macro_export]
macro_rules! note {
    ($($what:tt)*) => {
        $crate::terminal::note(format_args!($($what)*))
    };
}
