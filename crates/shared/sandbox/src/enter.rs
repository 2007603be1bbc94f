//! Confinement of the calling process by the row of its service.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use rustix::process::{DumpableBehavior, Signal, set_dumpable_behavior, set_parent_process_death_signal};
use rustix::thread::{LinkNameSpaceType, move_into_link_name_space, set_no_new_privs};

use crate::error::StepError;
use crate::level::Level;
use crate::ruleset::{Access, Place, Ports};
use crate::table::{Log, Network, Read, ServiceRights, Write};
use crate::{calls, limits, ruleset, view};

/// Folder of the kernel's shared memory.
const SHARED_MEMORY: &str = "/dev/shm";
/// Folders of the machine's libraries, as far as they exist.
const LIBRARIES: [&str; 5] = ["/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib"];
/// Description of the CPU's caches.
const PROCESSOR: &str = "/sys/devices/system/cpu";
/// Tables of the sockets of a network namespace.
const COUNTERS: &str = "/proc/net";

/// Places and ports of one process, by the words of the table.
#[derive(Clone, Debug, Default)]
pub struct Rights {
    /// Process that made the namespaces of its host; see [`crate::host`].
    pub host: Option<u32>,
    /// Detector, labels and library that the user brought.
    pub models: Vec<PathBuf>,
    /// Its own journal.
    pub journal: Option<PathBuf>,
    /// Its own witness.
    pub witness: Option<PathBuf>,
    /// Folder of the recording.
    pub recording: Option<PathBuf>,
    /// Roots of the bus.
    pub bus: Vec<PathBuf>,
    /// Folder of the recorder's socket.
    pub log: Option<PathBuf>,
    /// Ports that it connects to.
    pub connects: Vec<u16>,
    /// True if it opens a window: it then keeps the machine's files, and makes any call that does no harm to others.
    pub window: bool,
}

/// Error of a confinement that the machine should allow.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The process has other threads, which would keep their rights.
    #[error("confinement: one thread expected, got {0}")]
    Threads(usize),
    /// The namespaces of its host could not be entered.
    #[error("confinement: namespaces of process {host}: {why}")]
    Host {
        /// Process.
        host: u32,
        /// Reason.
        why: io::Error,
    },
    /// A layer that the kernel has, and refuses here.
    #[error("confinement: {0}")]
    Layer(String),
}

/// Gives up all rights but `row`'s at the places of `rights`, permanently. Call it on the only thread of the process.
///
/// # Errors
/// A place is missing or a layer was refused; the process has then given up some rights and is to end.
pub fn enter(row: &ServiceRights, rights: &Rights) -> Result<Level, Error> {
    let layer = |reason: String| Error::Layer(reason);
    let step = |error: StepError| Error::Layer(error.to_string());
    let threads = fs::read_dir("/proc/self/task").map_or(1, Iterator::count);
    if threads != 1 {
        return Err(Error::Threads(threads));
    }
    let mut level = Level::default();
    if let Some(host) = rights.host {
        join(host, rights.window).map_err(|why| Error::Host { host, why })?;
    }
    let places = places(row, rights);
    match (rights.host, rights.window) {
        (Some(_), false) => {
            view::replace(&places).map_err(step)?;
            level.namespaces = true;
        }
        (Some(_), true) => level.why.push("the window needs the machine's files".into()),
        (None, _) => level.why.push("no namespaces: datagrams and sockets of the file system are not confined".into()),
    }
    // Entering the host's user namespace gave all capabilities in it.
    if rights.host.is_some() {
        limits::give_up_rights().map_err(|error| layer(format!("rights: {error}")))?;
    }
    // Set after the change of capabilities, which clears the death signal. No other process of the user may trace this
    // one.
    set_parent_process_death_signal(Some(Signal::KILL)).map_err(|error| layer(error.to_string()))?;
    set_dumpable_behavior(DumpableBehavior::NotDumpable).map_err(|error| layer(error.to_string()))?;
    set_no_new_privs(true).map_err(|error| layer(error.to_string()))?;
    limits::set(row, rights.window).map_err(step)?;
    level.limits = true;
    if rights.window {
        calls::apply_fatal().map_err(|error| layer(error.to_string()))?;
        level.why.push("and its drivers' system calls".into());
        return Ok(level);
    }
    match ruleset::apply(&places, &ports(row, rights)).map_err(|error| layer(error.to_string()))? {
        None => level.landlock = true,
        Some(why) => level.why.push(why),
    }
    match calls::apply(row) {
        Ok(()) => level.calls = true,
        Err(why) => level.why.push(format!("no filter of system calls ({why})")),
    }
    Ok(level)
}

/// Moves this process into the namespaces that `host` made; one with a window keeps the machine's network, over which a display may come.
fn join(host: u32, window: bool) -> io::Result<()> {
    let namespaces = [
        ("user", LinkNameSpaceType::User),
        ("mnt", LinkNameSpaceType::Mount),
        ("net", LinkNameSpaceType::Network),
        ("ipc", LinkNameSpaceType::InterProcessCommunication),
    ];
    let open = |name: &str| File::open(format!("/proc/{host}/ns/{name}"));
    let joined = namespaces.iter().filter(|(name, _)| !(window && *name == "net"));
    // Opened before the first is entered: in the mount namespace of the host the paths may lead elsewhere.
    let held: Vec<_> = joined.map(|(name, kind)| Ok((open(name)?, *kind))).collect::<io::Result<_>>()?;
    for (namespace, kind) in held {
        move_into_link_name_space(std::os::fd::AsFd::as_fd(&namespace), Some(kind))?;
    }
    Ok(())
}

fn ports(row: &ServiceRights, rights: &Rights) -> Ports {
    let allows = |network| row.network.contains(&network);
    Ports {
        listens: allows(Network::TcpListens),
        connects: if allows(Network::TcpConnects) { rights.connects.clone() } else { Vec::new() },
    }
}

/// The places of a row. The launcher names more than a row allows to some, as the journal to a broker that keeps none.
fn places(row: &ServiceRights, rights: &Rights) -> Vec<Place> {
    let mut places = Vec::new();
    let mut keep = |path: &Path, access| places.push(Place { path: path.to_owned(), access });
    for read in &row.read {
        match read {
            Read::Model => rights.models.iter().for_each(|model| keep(model, Access::Read)),
            Read::Libraries if rights.models.is_empty() => {}
            Read::Libraries => existing(&LIBRARIES).for_each(|folder| keep(folder, Access::Libraries)),
            Read::Processor => existing(&[PROCESSOR]).for_each(|folder| keep(folder, Access::Read)),
            Read::Counters => existing(&[COUNTERS]).for_each(|folder| keep(folder, Access::Read)),
        }
    }
    for write in &row.write {
        let (place, access) = match write {
            Write::Journal => (&rights.journal, Access::Append),
            Write::Witness => (&rights.witness, Access::Append),
            Write::Recording => (&rights.recording, Access::Files),
        };
        place.iter().for_each(|place| keep(place, access));
    }
    if row.bus && !rights.bus.is_empty() {
        rights.bus.iter().for_each(|root| keep(root, Access::Bus));
        keep(Path::new(SHARED_MEMORY), Access::Bus);
    }
    match (row.log, &rights.log) {
        (Some(Log::Sends), Some(folder)) => keep(folder, Access::Connect),
        (Some(Log::Receives), Some(folder)) => keep(folder, Access::Listen),
        (None, _) | (_, None) => {}
    }
    places
}

fn existing<'a>(folders: &'a [&str]) -> impl Iterator<Item = &'a Path> {
    folders.iter().map(Path::new).filter(|folder| folder.is_dir())
}
