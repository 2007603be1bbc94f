//! Whether a window can be opened here: a display that answers, and the libraries that the window loads at run time.
//!
//! Asked before anything is started, because what is missing would else be learned one piece at a time, the last of them
//! by a panic. Opening the window is left to the console.

use std::ffi::OsString;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixStream};
use std::path::{Path, PathBuf};

/// What the window loads on X11 when it starts, and the Debian package that has it.
const LIBRARIES: [(&str, &str); 6] = [
    ("libX11.so.6", "libx11-6"),
    ("libXcursor.so.1", "libxcursor1"),
    ("libXi.so.6", "libxi6"),
    ("libX11-xcb.so.1", "libx11-xcb1"),
    ("libxkbcommon-x11.so.0", "libxkbcommon-x11-0"),
    ("libGL.so.1", "libgl1"),
];

/// Where the dynamic loader looks, on the systems that we know.
const FOLDERS: [&str; 9] = [
    "/lib/x86_64-linux-gnu",
    "/usr/lib/x86_64-linux-gnu",
    "/lib/aarch64-linux-gnu",
    "/usr/lib/aarch64-linux-gnu",
    "/usr/local/lib",
    "/lib64",
    "/usr/lib64",
    "/lib",
    "/usr/lib",
];

/// Why no window can be opened, with the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoWindow {
    /// No display is named.
    #[error("no display: set DISPLAY, or look from a terminal with `holdsafe watch`")]
    NoDisplay,
    /// The display named does not answer.
    #[error("the display {0} does not answer: is it running, and is DISPLAY right?")]
    Silent(String),
    /// Libraries are missing.
    #[error("the window's libraries are missing: apt-get install {}", .0.join(" "))]
    Libraries(Vec<&'static str>),
}

/// The part of the environment that decides where a window opens.
#[derive(Clone, Debug, Default)]
pub struct Environment {
    /// `DISPLAY`.
    pub x11: Option<String>,
    /// `WAYLAND_DISPLAY`.
    pub wayland: Option<OsString>,
    /// Folders with libraries that come before the system's: `LD_LIBRARY_PATH`.
    pub folders: Vec<PathBuf>,
}

impl Environment {
    /// This process's.
    pub fn own() -> Self {
        let named = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
        let folders = named("LD_LIBRARY_PATH").map(|path| std::env::split_paths(&path).collect());
        Self {
            x11: named("DISPLAY").and_then(|display| display.into_string().ok()),
            wayland: named("WAYLAND_DISPLAY"),
            folders: folders.unwrap_or_default(),
        }
    }

    /// Whether a window can be opened. On Wayland the window itself says what it lacks.
    ///
    /// # Errors
    /// With what is missing and how to come by it.
    pub fn probe(&self) -> Result<(), NoWindow> {
        if self.wayland.is_some() {
            return Ok(());
        }
        let display = self.x11.as_ref().ok_or(NoWindow::NoDisplay)?;
        let missing: Vec<&str> =
            LIBRARIES.iter().filter(|(library, _)| !self.has(library)).map(|(_, package)| *package).collect();
        if !missing.is_empty() {
            return Err(NoWindow::Libraries(missing));
        }
        if answers(display) { Ok(()) } else { Err(NoWindow::Silent(display.clone())) }
    }

    fn has(&self, library: &str) -> bool {
        let system = FOLDERS.iter().map(Path::new);
        self.folders.iter().map(PathBuf::as_path).chain(system).any(|folder| folder.join(library).exists())
    }
}

/// Whether somebody listens at the display `[host]:number[.screen]`. One that names a host is not tried: that is a
/// connection elsewhere, and the window makes it itself.
fn answers(display: &str) -> bool {
    let Some((host, number)) = display.rsplit_once(':') else { return false };
    let number = number.split('.').next().unwrap_or_default();
    let Ok(number) = number.parse::<u16>() else { return false };
    if !host.is_empty() && host != "unix" {
        return true;
    }
    let path = format!("/tmp/.X11-unix/X{number}");
    let hidden = SocketAddr::from_abstract_name(&path).and_then(|at| UnixStream::connect_addr(&at));
    hidden.is_ok() || UnixStream::connect(&path).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(display: Option<&str>) -> Environment {
        Environment { x11: display.map(str::to_owned), ..Environment::default() }
    }

    #[test]
    fn without_a_display_it_says_so_in_one_line_with_the_remedy() {
        let why = at(None).probe().expect_err("no display");
        assert_eq!(why, NoWindow::NoDisplay);
        assert!(why.to_string().contains("holdsafe watch") && !why.to_string().contains('\n'));
        let packages = NoWindow::Libraries(vec!["libxi6", "libgl1"]).to_string();
        assert!(packages.ends_with("apt-get install libxi6 libgl1"), "{packages}");
    }

    #[test]
    fn a_display_that_does_not_answer_or_is_none_is_found_out_without_panic() {
        for display in [":65535", "", ":", ":x", "nowhere", "unix:65534.0", ":x.2.3.4", ":99999"] {
            assert!(!answers(display), "{display}");
        }
    }

    #[test]
    fn a_library_that_is_nowhere_is_missing() {
        assert!(!at(None).has("libthis-is-no-library.so.1"));
    }
}
