//! Confinement of a service by its row of the table of rights, at the places that its specification names.
//!
//! The launcher makes the files that a service writes ([`prepare`]), since a confined one can make none. The layers are `sandbox`'s.

use std::io;
use std::path::{Path, PathBuf};

use sandbox::{Level, Rights, table};
use serde::{Deserialize, Serialize};

use crate::files;
use crate::spec::{ServiceSpec, SpecError};

/// Settings of a service's confinement that its links do not tell.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Confinement {
    /// Process that holds the namespaces of the service's host; none where the machine gives none.
    #[serde(default)]
    pub host: Option<u32>,
    /// Models and libraries of others that it reads.
    #[serde(default)]
    pub models: Vec<PathBuf>,
    /// True if it opens a window.
    #[serde(default)]
    pub window: bool,
}

/// Makes the files that the service of `spec` will write, empty and readable by their owner only.
///
/// # Errors
/// When one is there already or cannot be made.
pub fn prepare(spec: &ServiceSpec) -> io::Result<()> {
    let journal = (spec.journal_bytes > 0).then(|| spec.journal());
    let witness = spec.witness.as_ref().map(|_| spec.witness_log());
    journal.into_iter().chain(witness).try_for_each(|path| files::create(&path).map(drop))
}

/// Confines this process as `service`, which reads `models` and takes part in no run.
///
/// # Errors
/// The process cannot be confined as far as its machine allows, or the table has no such service.
pub fn reader(service: &str, models: Vec<PathBuf>) -> Result<Level, SpecError> {
    let row = table::row(service).ok_or_else(|| SpecError::NoRow(service.to_owned()))?;
    Ok(sandbox::enter(&row, &Rights { models, ..Rights::default() })?)
}

/// Confines this process as `service`, as far as `spec` asks for it.
pub(crate) fn enter(service: &str, spec: &ServiceSpec) -> Result<Level, SpecError> {
    let Some(confinement) = &spec.confinement else { return Ok(Level::none("not asked for")) };
    let row = table::row(service).ok_or_else(|| SpecError::NoRow(service.to_owned()))?;
    Ok(sandbox::enter(&row, &rights(spec, confinement))?)
}

fn rights(spec: &ServiceSpec, confinement: &Confinement) -> Rights {
    let folder = |socket: &Path| socket.parent().map(Path::to_owned);
    let streams = spec.mqtt.as_ref().map(|dial| dial.remote);
    let relayed = spec.relay.as_ref().and_then(|relay| relay.stream).map(|leg| leg.upstream);
    let socket = spec.recorder.as_ref().map(|recorder| &recorder.socket).or(spec.instrument.as_ref());
    Rights {
        host: confinement.host,
        models: confinement.models.clone(),
        journal: (spec.journal_bytes > 0).then(|| spec.journal()),
        witness: spec.witness.as_ref().map(|_| spec.witness_log()),
        recording: spec.recorder.as_ref().map(|recorder| recorder.directory.clone()),
        bus: spec.bus.iter().map(|bus| bus.root.clone()).collect(),
        log: socket.and_then(|socket| folder(socket)),
        connects: streams.into_iter().chain(relayed).map(|at| at.socket().port()).collect(),
        window: confinement.window,
    }
}
