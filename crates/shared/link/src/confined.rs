//! Confinement of a service by its row of the table of rights, with the files, ports and folders of its specification.
//!
//! The launcher creates the files that a service writes ([`prepare`]), since a confined service can create none. The layers are left to
//! `sandbox`.

use std::io;
use std::path::{Path, PathBuf};

use sandbox::{Level, Rights, table};

use crate::files;
use crate::spec::{Confinement, ServiceSpec, SpecError};

/// Makes the files that the service of `spec` will write, empty and readable by their owner only.
///
/// # Errors
/// When one is there already or cannot be made.
pub fn prepare(spec: &ServiceSpec) -> io::Result<()> {
    let journal = (spec.journal_bytes > 0).then(|| spec.journal());
    let witness = spec.witness.as_ref().map(|_| spec.guard_log());
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

/// First call of every service's `main`: reads its specification from standard input as [`ServiceSpec::from_stdin`], then gives up
/// the rights that the table does not give to `service`.
///
/// # Errors
///
/// As [`ServiceSpec::read`] and [`confine`].
pub fn from_stdin(service: &str) -> Result<ServiceSpec, SpecError> {
    confine(ServiceSpec::from_stdin()?, service)
}

/// The specification in a process that has given up the rights that the table does not give to `service`, as far as it asks for
/// confinement.
///
/// # Errors
///
/// The process cannot be confined as far as its machine allows, or the table has no such service.
pub fn confine(mut spec: ServiceSpec, service: &str) -> Result<ServiceSpec, SpecError> {
    spec.level = match &spec.confinement {
        None => Level::none("not asked for"),
        Some(confinement) => {
            let row = table::row(service).ok_or_else(|| SpecError::NoRow(service.to_owned()))?;
            sandbox::enter(&row, &rights(&spec, confinement))?
        }
    };
    Ok(spec)
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
        witness: spec.witness.as_ref().map(|_| spec.guard_log()),
        recording: spec.recorder.as_ref().map(|recorder| recorder.directory.clone()),
        bus: spec.bus.iter().map(|bus| bus.root.clone()).collect(),
        log: socket.and_then(|socket| folder(socket)),
        connects: streams.into_iter().chain(relayed).map(|address| address.socket().port()).collect(),
        window: confinement.window,
    }
}
