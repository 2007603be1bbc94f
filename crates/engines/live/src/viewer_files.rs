//! Files of a run's folder for its viewers: the planned site, and the console's keys and true events.
//!
//! The console reads the latter two, and names them (`console::process::player`). The other files of the folder are left to
//! `recording`.

use console::moment::{Happened, MAX_MOMENTS};
use console::process::player::{DISPLAY, READING, TRUTH};
use evidence::{Witnessed, truth};
use link::input_journal::{Header, Writer};
use recording::RunFolder;
use topology::Topology;
use twin::JournalEntry;
use wire::id::{Boot, NodeId};
use wire::time::Instant;

/// Most bytes of a display's journal.
const MAX_DISPLAY: u64 = 256 << 20;

/// Writes the site as it was planned, before the run begins.
pub(super) fn write_site(run: &RunFolder, topology: &Topology) -> std::io::Result<()> {
    recording::write::write_site(run, &crate::site(topology))
}

/// Writes the file needed to replay the console's input journal: no secret but the key of its feed, which is void by then.
/// Beside it the true events.
///
/// # Errors
/// When a file cannot be written.
pub fn write_console(run: &RunFolder, topology: &Topology, entries: &[Witnessed]) -> std::io::Result<()> {
    let Some(console) = crate::console(topology) else { return Ok(()) };
    std::fs::write(run.path().join(READING), serde_json::to_vec(&console.to_read())?)?;
    let done = truth::on_console_clock(entries).into_iter().take(MAX_MOMENTS);
    let done: Vec<Happened> = done.map(|one| Happened { at_us: one.at_us, what: one.action }).collect();
    std::fs::write(run.path().join(TRUTH), serde_json::to_vec(&done)?)
}

/// Writes the inputs of the console of a run in the twin, beside the files of [`write_console`].
///
/// # Errors
/// When a file cannot be written.
pub fn write_display(
    run: &RunFolder,
    topology: &Topology,
    entries: &[Witnessed],
    turns: &[JournalEntry],
) -> std::io::Result<()> {
    if turns.is_empty() {
        return Ok(());
    }
    write_console(run, topology, entries)?;
    let file = std::io::BufWriter::new(std::fs::File::create(run.path().join(DISPLAY))?);
    let header = Header { node: NodeId::CONSOLE, boot: Boot(1), started: Instant(0) };
    let mut journal = Writer::new(file, header, MAX_DISPLAY)?;
    for turn in turns {
        journal.input(turn.now, &turn.input)?;
        turn.outputs.iter().try_for_each(|output| journal.output(output))?;
    }
    journal.flush()
}
