//! Landlock: the files, ports, signals and local sockets that a process keeps.

use std::path::PathBuf;

use landlock::{
    ABI, Access as _, AccessFs, AccessNet, BitFlags, CompatLevel, Compatible, NetPort, PathBeneath, PathFd,
    RestrictionStatus, Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetError, RulesetStatus, Scope,
};

/// Newest interface of the kernel that is asked for. An older kernel holds a part, and reports it.
const NEWEST: ABI = ABI::V6;

/// Uses of a file or folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    /// Reads it.
    Read,
    /// Reads it, and maps programs from it.
    Libraries,
    /// Writes to a file that exists.
    Append,
    /// Makes, reads and writes files in a folder.
    Files,
    /// Shared memory and sockets of the bus: makes and removes files, folders and sockets in a folder.
    Bus,
    /// Connects to a socket in a folder.
    Connect,
    /// Makes a socket in a folder.
    Listen,
}

impl Access {
    /// True if the place is changed.
    pub(crate) fn writes(self) -> bool {
        match self {
            Self::Read | Self::Libraries | Self::Connect => false,
            Self::Append | Self::Files | Self::Bus | Self::Listen => true,
        }
    }

    fn rights(self) -> BitFlags<AccessFs> {
        let files = AccessFs::ReadFile | AccessFs::WriteFile | AccessFs::Truncate | AccessFs::MakeReg;
        match self {
            Self::Read | Self::Libraries => AccessFs::ReadFile | AccessFs::ReadDir,
            Self::Append => AccessFs::WriteFile.into(),
            Self::Files => files | AccessFs::ReadDir | AccessFs::RemoveFile,
            Self::Bus => {
                files
                    | AccessFs::ReadDir
                    | AccessFs::RemoveFile
                    | AccessFs::RemoveDir
                    | AccessFs::MakeDir
                    | AccessFs::MakeSock
            }
            Self::Connect => AccessFs::ReadDir.into(),
            Self::Listen => AccessFs::MakeSock | AccessFs::RemoveFile | AccessFs::ReadDir,
        }
    }
}

/// A file or folder that a process keeps.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// Absolute.
    pub(crate) path: PathBuf,
    pub(crate) access: Access,
}

/// TCP ports that a process keeps.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ports {
    /// True if it may listen on a port of the kernel's choice.
    pub(crate) listens: bool,
    /// Ports that it may connect to.
    pub(crate) connects: Vec<u16>,
}

/// Leaves this process `places` and `ports`, and its own signals and abstract sockets; the reason where the kernel holds a part.
pub(crate) fn apply(places: &[Place], ports: &Ports) -> Result<Option<String>, RulesetError> {
    let mut ruleset = Ruleset::default()
        .set_compatibility(CompatLevel::BestEffort)
        .handle_access(AccessFs::from_all(NEWEST))?
        .handle_access(AccessNet::from_all(NEWEST))?
        .scope(Scope::from_all(NEWEST))?
        .create()?;
    for place in places {
        // A file takes fewer rights than a folder.
        let folder = place.path.is_dir();
        let rights = place.access.rights() & if folder { BitFlags::all() } else { AccessFs::from_file(NEWEST) };
        match PathFd::new(&place.path) {
            Ok(file) => ruleset = ruleset.add_rule(PathBeneath::new(file, rights))?,
            Err(why) => return Ok(Some(format!("Landlock: {why}"))),
        }
    }
    if ports.listens {
        ruleset = ruleset.add_rule(NetPort::new(0, AccessNet::BindTcp))?;
    }
    for port in &ports.connects {
        ruleset = ruleset.add_rule(NetPort::new(*port, AccessNet::ConnectTcp))?;
    }
    let RestrictionStatus { ruleset, .. } = ruleset.restrict_self()?;
    Ok(match ruleset {
        RulesetStatus::FullyEnforced => None,
        RulesetStatus::PartiallyEnforced => Some("Landlock of this kernel lacks ports or signals".into()),
        RulesetStatus::NotEnforced => Some("no Landlock in this kernel".into()),
    })
}
