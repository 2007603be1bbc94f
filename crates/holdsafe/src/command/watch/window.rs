//! `holdsafe watch --window RUN`: a recorded run in the console's window, to look at, and beside it the unit's sensor
//! frames and the reasons for its changes of mode.

use console::process::{open, replay};
use runner::failure::{Exit, Failure};
use runner::{Context, checked};

use super::Args;
use super::beside::Beheld;

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let checked = checked::open_one_run(&args.run)?;
    checked::print_marks(context, &[&checked]);
    let mut recorded =
        replay::open(checked.path()).map_err(|error| Failure::new(Exit::NoEvidence, error.to_string()))?;
    open::probe().map_err(|window| Failure::new(Exit::Environment, window.to_string()))?;
    if let Some(reason) = checked.invalid() {
        recorded = recorded.invalid(reason.to_owned());
    }
    if let Some(beheld) = Beheld::open(&checked, || args.bring.stages())? {
        recorded = recorded.sidecar(Box::new(beheld));
    }
    let stop = context.stop.clone();
    recorded.show(move || stop.is_requested()).map_err(|window| Failure::new(Exit::Environment, window.to_string()))?;
    Ok(args.unverified.exit(&[&checked], Exit::Fine))
}
