//! The text of a file, if it is a regular one of a bounded size.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use super::Problem;

/// The largest file that is read.
pub const MAX_FILE_BYTES: u64 = 256 * 1024;

/// The text of a regular file of at most [`MAX_FILE_BYTES`], with lines ended by LF whichever way the file ends them; `file` is
/// its name in messages.
pub(super) fn read_text(path: &Path, file: &str) -> Result<String, Problem> {
    let meta = fs::metadata(path).map_err(|e| {
        if e.kind() == std::io::ErrorKind::NotFound {
            let remedy =
                "check the path; `holdsafe scenario list` lists the scenarios, `holdsafe scenario new NAME` starts one";
            Problem::with_file(file, "no such file", remedy)
        } else {
            Problem::with_file(file, format!("cannot be read: {e}"), "check the path and its permissions")
        }
    })?;
    if !meta.is_file() {
        return Err(Problem::with_file(file, "not a regular file", "name the file itself"));
    }
    let too_large = |len: u64| {
        let message = format!("{len} bytes, at most {MAX_FILE_BYTES} are read");
        Problem::with_file(file, message, "a scenario is a few kilobytes of TOML; is this the right file?")
    };
    if meta.len() > MAX_FILE_BYTES {
        return Err(too_large(meta.len()));
    }
    let unreadable =
        |e: std::io::Error| Problem::with_file(file, format!("cannot be read: {e}"), "check its permissions");
    let mut bytes = Vec::new();
    File::open(path).and_then(|f| f.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(too_large(bytes.len() as u64));
    }
    let text = String::from_utf8(bytes).map_err(|e| {
        let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        Problem::with_file(file, format!("line {line} is not UTF-8"), "save the file as UTF-8 text")
    })?;
    Ok(text.replace("\r\n", "\n"))
}
