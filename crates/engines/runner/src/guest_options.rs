//! `--autonomy GUEST.TOML`: a guest, a third-party program that drives in place of the unit's mission and navigation.

use std::convert::Infallible;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use guest::pool::Pool;
use guest::{Conduct, Guest, Program};
use scenario::{Problem, Problems};

use super::failure::{Exit, Failure};
use super::quoted;

/// Name of the guest without a file: a naive follower of the route, which the program `holdsafe` is too, as a service.
pub const FOLLOWER: &str = "follower";
/// File of the follower, with `PROGRAM` in place of the program's path.
const FOLLOWER_FILE: &str = include_str!("guest_options/follower.toml");
/// The largest guest file, bytes.
const MAX_FILE: u64 = 64 << 10;
/// The largest pinned file, bytes.
const MAX_PINNED: u64 = 1 << 30;

/// The options that name a guest.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct GuestOptions {
    /// A guest that drives in place of the unit's own mission and navigation, by its file (docs/researcher/guests.md); `follower` is built in.
    #[arg(long, value_name = "GUEST.TOML")]
    autonomy: Option<PathBuf>,
    /// Give the guest's set-points to the plant as they are, without the platform's guards.
    #[arg(long, requires = "autonomy")]
    bare: bool,
}

/// The option on a verb that takes no guest: it is refused with the reason.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct NoGuest {
    #[arg(long = "autonomy", hide = true, value_name = "GUEST.TOML", value_parser = refused)]
    _autonomy: Option<Infallible>,
}

fn refused(_: &str) -> Result<Infallible, &'static str> {
    Err(
        "this verb forks and repeats runs, which the process of a guest cannot follow; run, campaign, matrix and guest compare take one",
    )
}

/// A guest with the options that named it.
#[derive(Clone, Debug)]
pub struct LoadedGuest {
    /// The guest.
    pub guest: Guest,
    /// Command line options that reproduce it.
    pub options: String,
}

impl GuestOptions {
    /// The named guest, its file and pins checked.
    ///
    /// # Errors
    /// A mistake in the file, with its place.
    pub fn load(&self) -> Result<Option<LoadedGuest>, Failure> {
        let Some(file) = &self.autonomy else { return Ok(None) };
        let conduct = if self.bare { Conduct::Bare } else { Conduct::Guarded };
        Ok(Some(LoadedGuest { guest: guest(file, conduct)?, options: options(file, conduct) }))
    }
}

/// The command line options that name a guest.
pub fn options(file: &Path, conduct: Conduct) -> String {
    let bare = if conduct == Conduct::Bare { " --bare" } else { "" };
    format!(" --autonomy {}{bare}", quoted(&file.to_string_lossy()))
}

/// The guest of a file, or the one that is built in.
///
/// # Errors
/// A mistake in the file, with its place.
pub fn guest(file: &Path, conduct: Conduct) -> Result<Guest, Failure> {
    let program = Arc::new(program(file)?);
    let helper = std::env::current_exe()?;
    let (arguments, level) = confine::best(&helper, &confine::as_service()).map_err(Failure::internal)?;
    Ok(Guest {
        program,
        conduct,
        repeatable: true,
        unconfined: (!level.namespaces).then(|| level.to_string()),
        launcher: Arc::new(Pool::new(confine::launcher(helper, arguments, None))),
    })
}

fn program(file: &Path) -> Result<Program, Failure> {
    if file == Path::new(FOLLOWER) {
        return follower();
    }
    let name = file.display().to_string();
    let unread = |reason: String| {
        Problems::from(Problem::with_file(&name, reason, "`holdsafe guest new NAME` writes a guest to start from"))
    };
    let bytes = link::files::read(file, MAX_FILE).map_err(|e| unread(e.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|_| unread("UTF-8 expected".to_owned()))?;
    let folder = file.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    let folder = std::path::absolute(if folder.as_os_str().is_empty() { Path::new(".") } else { &folder })?;
    if folder.to_str().is_none() {
        return Err(unread("a folder whose name is UTF-8 expected".to_owned()).into());
    }
    parsed(&name, &text, &folder)
}

/// The follower, which is this program. Its folder is the folder of the guest, and so visible to the guest wherever it is.
fn follower() -> Result<Program, Failure> {
    let path = std::env::current_exe()?;
    let parts = path.parent().filter(|folder| folder.to_str().is_some()).zip(path.file_name().and_then(OsStr::to_str));
    let Some((folder, name)) = parts else {
        let message = format!("{}: a program whose path is UTF-8 expected; move it", path.display());
        return Err(Failure::new(Exit::Environment, message));
    };
    // A string of JSON is one of TOML.
    let program = serde_json::to_string(&format!("./{name}")).map_err(Failure::internal)?;
    parsed(FOLLOWER, &FOLLOWER_FILE.replace("PROGRAM", &program), folder)
}

/// The program of a guest file's text, in its folder.
fn parsed(name: &str, text: &str, folder: &Path) -> Result<Program, Failure> {
    let read = |path: &Path| link::files::read(path, MAX_PINNED).map_err(|e| e.to_string());
    let program = Program::parse(text, folder, read).map_err(|mistake| {
        Problems::from(match mistake.at {
            Some(place) => Problem::new(name, text, place, mistake.message, mistake.remedy),
            None => Problem::with_file(name, mistake.message, mistake.remedy),
        })
    })?;
    Ok(program)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_follower_starts_this_program() {
        let program = program(Path::new(FOLLOWER)).unwrap();
        assert_eq!(program.name, FOLLOWER);
        assert_eq!(program.command[1..], ["service", FOLLOWER]);
        let path = std::fs::canonicalize(std::env::current_exe().unwrap()).unwrap();
        assert_eq!(std::fs::canonicalize(&program.command[0]).unwrap(), path);
        assert!(program.digests.len() > 1, "the program's own bytes are not in its digests");
    }
}
