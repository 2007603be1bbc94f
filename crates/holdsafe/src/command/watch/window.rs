//! `holdsafe watch --window RUN`: a recorded run in the console's window, to look at, and beside it the unit's sensor
//! frames and the reasons for its changes of mode, or with `--compare` another run.

use console::process::{open, replay};
use recording::Checked;
use runner::failure::{Exit, Failure};
use runner::{Context, checked};

use super::Args;
use super::beside::Beheld;

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let checked = checked::open_one_run(&args.run)?;
    let compared = args.compare.as_deref().map(checked::open_one_run).transpose()?;
    let both: Vec<&Checked> = std::iter::once(&checked).chain(&compared).collect();
    checked::print_marks(context, &both);
    let mut recorded = open_recording(&checked, args)?;
    if let Some(other) = &compared {
        recorded = recorded.beside(open_recording(other, args)?);
    }
    open::probe().map_err(|window| Failure::new(Exit::Environment, window.to_string()))?;
    let stop = context.stop.clone();
    recorded.show(move || stop.is_requested()).map_err(|window| Failure::new(Exit::Environment, window.to_string()))?;
    Ok(args.unverified.exit(&both, Exit::Fine))
}

/// A recording with the evidence beside it, marked where it is none.
fn open_recording(checked: &Checked, args: &Args) -> Result<replay::Recorded, Failure> {
    let mut recorded =
        replay::open(checked.path()).map_err(|error| Failure::new(Exit::NoEvidence, error.to_string()))?;
    if let Some(reason) = checked.invalid() {
        recorded = recorded.invalid(reason.to_owned());
    }
    if let Some(beheld) = Beheld::open(checked, || args.bring.stages())? {
        recorded = recorded.sidecar(Box::new(beheld));
    }
    Ok(recorded)
}
