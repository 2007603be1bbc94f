//! Limits by number, and rights that a process gives up permanently.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use rustix::thread::{CapabilitySet, CapabilitySets, remove_capability_from_bounding_set, set_capabilities};

use crate::error::StepError;
use crate::table::ServiceRights;

/// Address space of a service with a window, MiB. OpenGL in software takes 64 MiB of it a thread for its heap and 8 for its stack, with up to 32
/// threads, and ends by an invalid access where it gets none.
const WINDOW_MIB: u64 = 4096;

/// Gives up every right of the process in its user namespace.
///
/// # Errors
/// The kernel's.
pub fn give_up_rights() -> rustix::io::Result<()> {
    for right in CapabilitySet::all() {
        match remove_capability_from_bounding_set(right) {
            // This kernel has no such right.
            Ok(()) | Err(rustix::io::Errno::INVAL) => {}
            Err(why) => return Err(why),
        }
    }
    let none = CapabilitySet::empty();
    set_capabilities(None, CapabilitySets { effective: none, permitted: none, inheritable: none })
}

/// Sets the limits of a row, with room for a window where there is one. The launcher may raise one again, to free a full disk, and the process may not: the filter of calls lets it ask for
/// limits and set none.
pub(crate) fn set(row: &ServiceRights, window: bool) -> Result<(), StepError> {
    let memory_mib = if window { row.memory_mib.max(WINDOW_MIB) } else { row.memory_mib };
    let all = [
        (Resource::Core, 0),
        (Resource::As, memory_mib << 20),
        (Resource::Nofile, row.descriptors),
        (Resource::Fsize, row.file_mib << 20),
    ];
    for (resource, most) in all {
        let maximum = getrlimit(resource).maximum;
        let current = maximum.map_or(most, |maximum| maximum.min(most));
        setrlimit(resource, Rlimit { current: Some(current), maximum }).map_err(|error| StepError::Limit {
            resource,
            most,
            error: error.into(),
        })?;
    }
    Ok(())
}
