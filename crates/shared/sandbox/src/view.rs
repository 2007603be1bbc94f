//! A root folder of a process's own, with the files and folders of its row at their places, and no others.
//!
//! It holds a part that Landlock does not know: sockets in the file system, such as the sockets of a desktop's bus or of a container's daemon.

use std::fs;
use std::io;
use std::os::fd::{AsRawFd, OwnedFd};
use std::path::{Path, PathBuf};

use nix::sched::{CloneFlags, unshare};
use rustix::fs::{Mode, OFlags, open};
use rustix::mount::{
    MountFlags, MountPropagationFlags, UnmountFlags, mount, mount_bind_recursive, mount_change, mount_remount, unmount,
};
use rustix::process::{chdir, pivot_root};

use crate::error::StepError;
use crate::ruleset::{Access, Place};

/// Folder on which the new root stands until it takes the old one's place: any that exists.
const STAND: &str = "/tmp";

/// Replaces the root folder of this process alone by one with `places`.
///
/// # Errors
/// The first place that cannot be shown, or the kernel's reason.
pub(crate) fn replace(places: &[Place]) -> Result<(), StepError> {
    let step = StepError::of_step::<rustix::io::Errno>;
    let refused = |place: &Place, error: io::Error| StepError::Path { path: place.path.clone(), error };
    unshare(CloneFlags::CLONE_NEWNS).map_err(|error| StepError::Namespaces { step: "mounts of its own", error })?;
    mount_change("/", MountPropagationFlags::PRIVATE | MountPropagationFlags::REC).map_err(step("mounts"))?;
    let held: Vec<(OwnedFd, &Place)> = places
        .iter()
        .map(|place| {
            let file = open(&place.path, OFlags::PATH | OFlags::CLOEXEC, Mode::empty());
            file.map(|file| (file, place)).map_err(|error| refused(place, error.into()))
        })
        .collect::<Result<_, _>>()?;
    mount("tmpfs", STAND, "tmpfs", MountFlags::NOSUID | MountFlags::NODEV, c"size=64k,mode=755")
        .map_err(step("new root"))?;
    for (file, place) in &held {
        show(file, place).map_err(|error| refused(place, error))?;
    }
    chdir(STAND).map_err(step("new root"))?;
    // The old root lies on the new one, and goes.
    pivot_root(".", ".").map_err(step("change of root"))?;
    unmount(".", UnmountFlags::DETACH).map_err(step("old root"))?;
    chdir("/").map_err(step("new root"))?;
    mount_remount("/", MountFlags::RDONLY | MountFlags::NOSUID | MountFlags::NODEV, "").map_err(step("new root"))
}

fn show(file: &OwnedFd, place: &Place) -> io::Result<()> {
    let target = PathBuf::from(STAND).join(place.path.strip_prefix("/").unwrap_or(&place.path));
    let held = format!("/proc/self/fd/{}", file.as_raw_fd());
    if fs::metadata(&held)?.is_dir() {
        fs::create_dir_all(&target)?;
    } else {
        fs::create_dir_all(target.parent().unwrap_or(Path::new(STAND)))?;
        fs::write(&target, "")?;
    }
    mount_bind_recursive(held, &target)?;
    let mut flags = MountFlags::BIND | MountFlags::NOSUID | MountFlags::NODEV;
    if place.access != Access::Libraries {
        flags |= MountFlags::NOEXEC;
    }
    if !place.access.writes() {
        flags |= MountFlags::RDONLY;
    }
    Ok(mount_remount(&target, flags, "")?)
}
