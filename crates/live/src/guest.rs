//! A guest in a live run: started by the process of the unit's autonomy, on the real clock.

use std::error::Error;
use std::path::PathBuf;
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
}

/// What the process of the unit's autonomy is told of its guest.
pub(super) fn carried(guest: &Guest) -> Value {
    let program = Program::clone(&guest.program);
    serde_json::json!(Carried { folder: program.folder.clone(), program })
}

/// The attendant of a guest that was carried here.
pub(super) fn attend(carried: Value) -> Result<Attendant, Box<dyn Error>> {
    let Carried { program, folder } = serde_json::from_value(carried)?;
    let program = Arc::new(Program { folder, ..program });
    let launcher = confine::launcher(std::env::current_exe()?, confine::as_service());
    let mut session = Session::new(program, launcher);
    Ok(Box::new(move |request| session.answer(request)))
}
