//! `lab mavlink`: attacks of a relay on a MAVLink 2 link between ends of other authors, beside the published signing rules.
//!
//! The sender is pymavlink, the receivers are pymavlink and the reader of the public `mavlink` crate. Each attack meets an unsigned
//! and a signed link at each receiver (`mavlink_relay`). A message whose arrival the receiving socket did not report makes its
//! cell INVALID.

mod ends;

use std::path::PathBuf;

use evidence::SCHEMA_VERSION;
use mavlink_relay::attack::Link;
use mavlink_relay::class::Verdict;
use mavlink_relay::end::Receiver;
use mavlink_relay::expected::{self, Row};
use mavlink_relay::library;
use mavlink_relay::trial::{self, Trial};
use parallel::progress::Progress;
use runner::failure::{Exit, Failure};
use runner::{Context, out};

use crate::report::{MavlinkObject, MavlinkRow, mavlink_table};
use ends::{Behind, Pymavlink, Python};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Messages of the attacker in each cell.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    messages: u32,
    /// Python interpreter that has pymavlink.
    #[arg(long, value_name = "PATH", default_value = "python3")]
    python: PathBuf,
    /// Break the receivers: with a key, they accept unsigned messages too. Shows that the classes follow the receiver.
    #[arg(long)]
    accept_unsigned: bool,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let script = context.root()?.join("tools").join("mavlink").join("end.py");
    let python = Python { program: args.python.clone(), script };
    if !python.has_pymavlink() {
        let missing = format!("{}: no pymavlink; install it: pip install pymavlink==2.4.50", args.python.display());
        return Err(Failure::new(Exit::Environment, missing));
    }
    let measured = measured(context, args, &python)?;
    match context.json {
        true => out::print_json("bench-mavlink", &measured)?,
        false => out::say(format_args!("{}", mavlink_table(&measured))),
    }
    Ok(exit(&measured))
}

fn measured(context: &Context, args: &Args, python: &Python) -> Result<MavlinkObject, Failure> {
    let rows = expected::rows().map_err(Failure::internal)?;
    let mut sender = Pymavlink::new(python).map_err(Failure::internal)?;
    let mut our_pymavlink = Pymavlink::new(python).map_err(Failure::internal)?;
    let mut library = Behind::new().map_err(Failure::internal)?;
    let mut object = MavlinkObject {
        schema_version: SCHEMA_VERSION,
        seed: context.seed,
        messages: args.messages,
        accept_unsigned: args.accept_unsigned,
        sender: String::new(),
        rows: Vec::new(),
    };
    let progress = Progress::new("cells", rows.len() * Link::ALL.len() * 2, context.talk);
    for (row, link) in rows.iter().flat_map(|row| Link::ALL.map(|link| (row, link))) {
        let trial = run_trial(context, args, row, link);
        let mut cell = |receiver: &mut dyn Receiver| {
            if context.stop.is_requested() {
                return Err(Failure::from(runner::error::EngineError::Stopped));
            }
            let counted = trial::run(trial, &mut sender, receiver);
            progress.step();
            Ok(counted)
        };
        let at_pymavlink = cell(&mut our_pymavlink)?;
        let at_library = cell(&mut library)?;
        let name = format!("pymavlink {}", our_pymavlink.version);
        object.rows.push(MavlinkRow::new(row, link, &name, at_pymavlink));
        object.rows.push(MavlinkRow::new(row, link, library::NAME, at_library));
    }
    progress.finish();
    object.sender = format!("pymavlink {}", sender.version);
    Ok(object)
}

fn run_trial(context: &Context, args: &Args, row: &Row, link: Link) -> Trial {
    let (rounds, accept_unsigned) = (args.messages, args.accept_unsigned);
    Trial { attack: row.name, link, rounds, seed: context.seed, accept_unsigned }
}

/// A finding without an explanation is unexpected; one with it is known.
fn exit(measured: &MavlinkObject) -> Exit {
    let any = |found: &dyn Fn(&MavlinkRow) -> bool| measured.rows.iter().any(found);
    if any(&|row| row.verdict == Verdict::Invalid) {
        return Exit::NoEvidence;
    }
    match any(&|row| row.verdict == Verdict::Finding && row.explanation.is_none()) {
        true => Exit::Unexpected,
        false => Exit::Fine,
    }
}
