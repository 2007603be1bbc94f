//! The files that a guest sees: the machine's, none of them writable; no devices but those without a state; a `/proc` of its own
//! processes; and temporary folders in memory, empty and bounded.

use std::ffi::{CStr, CString};
use std::fs;
use std::io;
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use rustix::fs::{CWD, FileType, Mode, OFlags, mknodat, open};
use rustix::mount::{MountFlags, MountPropagationFlags, mount, mount_bind, mount_change, mount_remount};
use rustix::process::geteuid;

use super::error::StartError;
use super::limits::kernel;

/// Folders of the machine that the guest sees replaced.
const COVERED: [&str; 5] = ["/proc", "/dev", "/run", "/tmp", "/var/tmp"];
/// Devices that a guest may use.
const DEVICES: [&str; 5] = ["null", "zero", "full", "random", "urandom"];
/// Size of a temporary folder.
const SIZE: &str = "size=64m,nr_inodes=4096,mode=1777";
/// First kernel with a `pid_max` for each namespace.
const COUNTED_BY_NAMESPACE: (u32, u32) = (6, 14);
/// Most processes of a namespace under root, whom no other limit binds: the smallest number that the kernel takes.
const PIDS: &str = "301";
/// Most mounts that a report names.
const NAMED: usize = 3;

/// Replaces the view of this process and those that it starts; `hidden` is shown empty. Gives the parts that the kernel refused.
///
/// # Errors
/// The first part without which the view would be the launcher's.
pub(super) fn replace(folder: &Path, hidden: Option<&Path>) -> Result<Vec<String>, StartError> {
    let step = StartError::of_step::<io::Error>;
    // Otherwise the mounts below would propagate to the machine's own namespace.
    mount_change("/", MountPropagationFlags::PRIVATE | MountPropagationFlags::REC)
        .map_err(|error| step("mounts")(error.into()))?;
    let guest_folder = Kept::open_folder(folder).map_err(step("folder"))?;
    let table = fs::read_to_string("/proc/self/mountinfo").map_err(step("table of mounts"))?;
    let mut refused = read_only(&table);
    for place in ["/tmp", "/var/tmp"].into_iter().filter(|place| is_folder(place)) {
        memory(place, SIZE).map_err(step("temporary folder"))?;
    }
    if is_folder("/run") {
        memory("/run", "size=64k,mode=755").map_err(step("/run"))?;
    }
    // A hidden place below a temporary folder is covered already, and no folder any more.
    if let Some(hidden) = hidden.and_then(Path::to_str).filter(|hidden| is_folder(hidden)) {
        memory(hidden, "size=64k,mode=755").map_err(step("hidden folder"))?;
    }
    guest_folder.remount().map_err(step("folder in a temporary one"))?;
    if is_folder("/run") {
        mount_remount("/run", hardened(""), "").map_err(|error| step("/run")(error.into()))?;
    }
    devices().map_err(step("/dev"))?;
    processes(&mut refused).map_err(step("/proc"))?;
    Ok(refused)
}

/// The guest's folder, held while its place is covered.
struct Kept {
    folder: OwnedFd,
    places: Vec<PathBuf>,
}

impl Kept {
    fn open_folder(folder: &Path) -> io::Result<Self> {
        let real = fs::canonicalize(folder)?;
        let covered = |path: &Path| COVERED.iter().any(|place| path.starts_with(place));
        let places = [folder.to_owned(), real].into_iter().filter(|path| covered(path)).collect();
        Ok(Self { folder: open(folder, OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC, Mode::empty())?, places })
    }

    /// Shows the folder at its places again.
    fn remount(&self) -> io::Result<()> {
        for place in self.places.iter().filter(|place| !place.exists()) {
            fs::create_dir_all(place)?;
            mount_bind(held(&self.folder), place.as_path())?;
            mount_remount(place.as_path(), hardened(""), "")?;
        }
        Ok(())
    }
}

fn held(file: &OwnedFd) -> String {
    format!("/proc/self/fd/{}", file.as_raw_fd())
}

fn is_folder(place: &str) -> bool {
    fs::symlink_metadata(place).is_ok_and(|found| found.is_dir())
}

fn memory(place: &str, options: &str) -> io::Result<()> {
    let options = CString::new(options)?;
    Ok(mount("tmpfs", place, "tmpfs", MountFlags::NOSUID | MountFlags::NODEV, options.as_c_str())?)
}

/// Flags of a mount that is only read, without devices: its own, which may be locked, and these.
fn hardened(options: &str) -> MountFlags {
    let own =
        if options.split(',').any(|option| option == "noexec") { MountFlags::NOEXEC } else { MountFlags::empty() };
    MountFlags::BIND | MountFlags::RDONLY | MountFlags::NOSUID | MountFlags::NODEV | own
}

/// Makes every mount of the table read-only, but those that are covered afterwards.
fn read_only(table: &str) -> Vec<String> {
    let mut refused: Vec<String> = Vec::new();
    for line in table.lines() {
        let mut fields = line.split(' ');
        let (Some(place), Some(options)) = (fields.nth(4), fields.next()) else { continue };
        let place = unescaped(place);
        if COVERED.iter().any(|covered| Path::new(&place).starts_with(covered)) {
            continue;
        }
        if let Err(error) = mount_remount(place.as_str(), hardened(options), "") {
            refused.push(format!("{place} is not read-only ({error})"));
        }
    }
    if refused.len() > NAMED {
        let more = refused.len() - NAMED;
        refused.truncate(NAMED);
        refused.push(format!("{more} other mounts are not read-only"));
    }
    refused
}

/// A path of the table, in which blanks are octal numbers.
fn unescaped(place: &str) -> String {
    // The backslash last: what it unescapes must not be read as another escape.
    [("\\040", " "), ("\\011", "\t"), ("\\012", "\n"), ("\\134", "\\")]
        .into_iter()
        .fold(place.to_owned(), |place, (octal, plain)| place.replace(octal, plain))
}

fn devices() -> io::Result<()> {
    let held_open = |name: &&str| {
        let device = open(format!("/dev/{name}"), OFlags::PATH | OFlags::CLOEXEC, Mode::empty());
        Some((name.to_string(), device.ok()?))
    };
    let found: Vec<(String, OwnedFd)> = DEVICES.iter().filter_map(held_open).collect();
    memory("/dev", "size=64k,mode=755")?;
    for (name, device) in &found {
        let place = format!("/dev/{name}");
        // Created without being opened: a mount with a file that was just open for writing cannot become read-only.
        mknodat(CWD, place.as_str(), FileType::RegularFile, Mode::RUSR, 0)?;
        mount_bind(held(device), place.as_str())?;
        // Read-only: the device is the machine's own file, of which a guest under root could change mode and times.
        mount_remount(place.as_str(), MountFlags::BIND | MountFlags::RDONLY | MountFlags::NOSUID, "")?;
    }
    for (name, to) in [("fd", ""), ("stdin", "/0"), ("stdout", "/1"), ("stderr", "/2")] {
        symlink(format!("/proc/self/fd{to}"), format!("/dev/{name}"))?;
    }
    fs::create_dir("/dev/shm")?;
    memory("/dev/shm", SIZE)?;
    Ok(mount_remount("/dev", MountFlags::BIND | MountFlags::RDONLY | MountFlags::NOSUID | MountFlags::NODEV, "")?)
}

/// A `/proc` of the namespace. A kernel that refuses one, as in most containers, leaves an empty one.
fn processes(refused: &mut Vec<String>) -> io::Result<()> {
    let flags = MountFlags::NOSUID | MountFlags::NODEV | MountFlags::NOEXEC;
    if let Err(error) = mount("proc", "/proc", "proc", flags, None::<&CStr>) {
        refused.push(format!("/proc is empty ({error})"));
        return memory("/proc", "size=64k,mode=755");
    }
    if geteuid().is_root() {
        // An older kernel would take the number for the whole machine.
        let counted = kernel() >= COUNTED_BY_NAMESPACE && fs::write("/proc/sys/kernel/pid_max", PIDS).is_ok();
        let most = if counted { PIDS } else { "any number of" };
        refused.push(format!("a guest of root may start {most} processes, whatever its limit"));
    }
    Ok(mount_remount("/proc", flags | MountFlags::BIND | MountFlags::RDONLY, "")?)
}
