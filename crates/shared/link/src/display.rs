//! Check for a usable window system: a display that answers, and the libraries that the window loads at run time.
//!
//! It runs before any process starts, because missing parts would otherwise be found one at a time, the last of them by
//! a panic. Opening the window is left to the console.

use std::ffi::{OsStr, OsString};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixStream};
use std::path::{Path, PathBuf};

/// Libraries that the window loads on X11 when it starts, each with its Debian package.
const X11: [(&str, &str); 6] = [
    ("libX11.so.6", "libx11-6"),
    ("libXcursor.so.1", "libxcursor1"),
    ("libXi.so.6", "libxi6"),
    ("libX11-xcb.so.1", "libx11-xcb1"),
    ("libxkbcommon-x11.so.0", "libxkbcommon-x11-0"),
    ("libGL.so.1", "libgl1"),
];

/// Libraries that the window loads on Wayland, with the keyboard's, which it loads at the first key.
const WAYLAND: [(&str, &str); 4] = [
    ("libwayland-client.so.0", "libwayland-client0"),
    ("libwayland-egl.so.1", "libwayland-egl1"),
    ("libxkbcommon.so.0", "libxkbcommon0"),
    ("libEGL.so.1", "libegl1"),
];

/// Search folders of the dynamic loader, on the known systems.
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

/// Reason for which no window can be opened, with the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoWindow {
    /// No display is named.
    #[error("no display: set DISPLAY or WAYLAND_DISPLAY, or look from a terminal with `holdsafe watch`")]
    NoDisplay,
    /// The display named does not answer.
    #[error("the display {display} does not answer: is it running, and is {named} right?")]
    Silent {
        /// The display's name.
        display: String,
        /// The variable that names it.
        named: &'static str,
    },
    /// Libraries are missing.
    #[error("the window's libraries are missing: apt-get install {}", .0.join(" "))]
    Libraries(Vec<&'static str>),
}

/// The part of the environment that decides where a window opens.
#[derive(Clone, Debug, Default)]
pub struct Environment {
    /// `DISPLAY`.
    pub x11: Option<String>,
    /// `WAYLAND_DISPLAY`, which goes before the other.
    pub wayland: Option<OsString>,
    /// Folder of that socket: `XDG_RUNTIME_DIR`.
    pub runtime: Option<PathBuf>,
    /// Folders with libraries that come before the system's: `LD_LIBRARY_PATH`.
    pub folders: Vec<PathBuf>,
}

impl Environment {
    /// The environment of this process.
    pub fn from_process() -> Self {
        let named = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
        let folders = named("LD_LIBRARY_PATH").map(|path| std::env::split_paths(&path).collect());
        Self {
            x11: named("DISPLAY").and_then(|display| display.into_string().ok()),
            wayland: named("WAYLAND_DISPLAY"),
            runtime: named("XDG_RUNTIME_DIR").map(PathBuf::from),
            folders: folders.unwrap_or_default(),
        }
    }

    /// Checks that a window can be opened.
    ///
    /// # Errors
    ///
    /// The missing part, and how to install it.
    pub fn probe(&self) -> Result<(), NoWindow> {
        let (libraries, display, answers) = match (&self.wayland, &self.x11) {
            (Some(name), _) => (&WAYLAND[..], name.display().to_string(), self.compositor_answers(name)),
            (None, Some(display)) => (&X11[..], display.clone(), answers(display)),
            (None, None) => return Err(NoWindow::NoDisplay),
        };
        let missing: Vec<&str> =
            libraries.iter().filter(|(library, _)| !self.has_library(library)).map(|(_, package)| *package).collect();
        match (missing.is_empty(), answers) {
            (false, _) => Err(NoWindow::Libraries(missing)),
            (true, false) => Err(NoWindow::Silent { display, named: self.display_variable() }),
            (true, true) => Ok(()),
        }
    }

    /// The variable that names the display.
    fn display_variable(&self) -> &'static str {
        if self.wayland.is_some() { "WAYLAND_DISPLAY" } else { "DISPLAY" }
    }

    /// True if a compositor listens there: a socket by this name in the user's folder, or by its whole path.
    fn compositor_answers(&self, name: &OsStr) -> bool {
        let folder = self.runtime.as_deref().unwrap_or(Path::new("/"));
        UnixStream::connect(folder.join(name)).is_ok()
    }

    fn has_library(&self, library: &str) -> bool {
        let system = FOLDERS.iter().map(Path::new);
        // The loader's cache also has libraries in folders that this list lacks.
        let cached = || std::fs::read("/etc/ld.so.cache").is_ok_and(|cache| cache_names(&cache, library));
        self.folders.iter().map(PathBuf::as_path).chain(system).any(|folder| folder.join(library).exists()) || cached()
    }
}

/// True if the loader's cache has a library of this name: zero bytes separate its names.
fn cache_names(cache: &[u8], library: &str) -> bool {
    cache.split(|byte| *byte == 0).any(|name| name == library.as_bytes())
}

/// True if a server listens at the display `[host]:number[.screen]`. One that names a host is not tried: that is a
/// connection elsewhere, and the window makes it itself.
fn answers(display: &str) -> bool {
    let Some((host, number)) = display.rsplit_once(':') else { return false };
    let number = number.split('.').next().unwrap_or_default();
    let Ok(number) = number.parse::<u16>() else { return false };
    if !host.is_empty() && host != "unix" {
        return true;
    }
    let path = format!("/tmp/.X11-unix/X{number}");
    let hidden = SocketAddr::from_abstract_name(&path).and_then(|address| UnixStream::connect_addr(&address));
    hidden.is_ok() || UnixStream::connect(&path).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_display(display: Option<&str>) -> Environment {
        Environment { x11: display.map(str::to_owned), ..Environment::default() }
    }

    #[test]
    fn missing_display_is_reported_with_its_remedy() {
        let error = with_display(None).probe().expect_err("no display");
        assert_eq!(error, NoWindow::NoDisplay);
        assert!(error.to_string().contains("holdsafe watch") && !error.to_string().contains('\n'));
        let packages = NoWindow::Libraries(vec!["libxi6", "libgl1"]).to_string();
        assert!(packages.ends_with("apt-get install libxi6 libgl1"), "{packages}");
    }

    #[test]
    fn silent_or_invalid_display_is_refused_without_panic() {
        for display in [":65535", "", ":", ":x", "nowhere", "unix:65534.0", ":x.2.3.4", ":99999"] {
            assert!(!answers(display), "{display}");
        }
    }

    /// Its socket is in the user's folder or at a path; a compositor that has ended is not found.
    #[test]
    fn compositor_is_found_by_name_or_path() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("wayland-7");
        let listens = std::os::unix::net::UnixListener::bind(&path).expect("a socket");
        let named = Environment { runtime: Some(folder.path().to_owned()), ..Environment::default() };
        assert!(
            named.compositor_answers(OsStr::new("wayland-7"))
                && Environment::default().compositor_answers(path.as_os_str())
        );
        assert!(
            !named.compositor_answers(OsStr::new("wayland-8"))
                && !Environment::default().compositor_answers(OsStr::new("wayland-7"))
        );
        drop(listens);
        assert!(!named.compositor_answers(OsStr::new("wayland-7")), "its socket is still there");
    }

    #[test]
    fn a_library_that_is_nowhere_is_missing() {
        assert!(!with_display(None).has_library("libthis-is-no-library.so.1"));
        let cache = b"glibc-ld.so.cache1.1\0libGL.so.1\0/opt/libGL.so.1\0";
        assert!(cache_names(cache, "libGL.so.1") && !cache_names(cache, "libGL.so") && !cache_names(cache, "GL.so.1"));
    }
}
