//! A guest in a live run: started by the process of the unit's autonomy, on the real clock.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use guest::{Guest, Program, Session};
use link::drive::Attendant;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A guest as the specification of a process carries it.
#[derive(Debug, Serialize, Deserialize)]
struct Carried {
    program: Program,
    folder: PathBuf,
    /// The run's own folder, which has the truth in it.
    hidden: PathBuf,
}

/// What the process of the unit's autonomy is told of its guest.
pub(super) fn carried(guest: &Guest, run: &Path) -> Value {
    let program = Program::clone(&guest.program);
    let hidden = std::path::absolute(run).unwrap_or_else(|_| run.to_owned());
    serde_json::json!(Carried { folder: program.folder.clone(), program, hidden })
}

/// The attendant of a guest that was carried here.
pub(super) fn attend(carried: Value) -> Result<Attendant, Box<dyn Error>> {
    let Carried { program, folder, hidden } = serde_json::from_value(carried)?;
    let program = Arc::new(Program { folder, ..program });
    let helper = std::env::current_exe()?;
    let (arguments, _) = confine::best(&helper, &confine::as_service())?;
    let launcher = confine::launcher(helper, arguments, Some(hidden));
    let mut session = Session::new(program, launcher);
    Ok(Box::new(move |request| session.answer(request)))
}
