//! Process faults: an end, a hang, a share of the time, or a full disk. The twin and the launcher carry them out.

use evidence::Planned;
use ground_truth::{StepName, Suspension};
use scenario::{Ending, Kill, Process, Scenario, Windowed};
use wire::id::NodeId;
use wire::time::Span;

/// Fault of one process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProcessFault {
    /// The process.
    pub node: NodeId,
    /// Kind of the fault.
    pub kind: ProcessFaultKind,
    /// Time, microseconds; for a fault that waits for its step, the earliest.
    pub at: u64,
    /// Step that the fault belongs to.
    pub step: Option<StepName>,
    /// Time from the call of the step to the fault, microseconds; `None` for a fault that begins at its time.
    pub waits: Option<u64>,
}

/// Kind of a process fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessFaultKind {
    /// The process ends at once.
    Kill {
        /// Time from the end to a restart, microseconds.
        restart: Option<u64>,
    },
    /// The process is kept from running.
    Suspend {
        /// Kind of suspension.
        how: Suspension,
        /// Length, microseconds.
        lasts: u64,
    },
    /// The process's disk takes no more bytes.
    Fill {
        /// Length, microseconds.
        lasts: u64,
    },
}

/// Next event of a process by the plan of its fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// The fault begins.
    Begin,
    /// The process is stopped for a while.
    Halt,
    /// The process goes on, for a while or permanently; or its disk has room again.
    Release,
    /// The process is started again.
    Restart,
}

/// The event after a turn of a suspension of which `left` microseconds are left, and its delay; a slow process is
/// stopped first.
pub fn next_turn(turn: Turn, suspension: Suspension, left: u64) -> (Turn, u64) {
    let share = |permille: u16, period: Span| period.0 * u64::from(permille.min(1000)) / 1000;
    let (next, after) = match (turn, suspension) {
        (Turn::Halt, Suspension::Slow { quota, period }) => (Turn::Release, share(1000 - quota.min(1000), period)),
        (Turn::Begin | Turn::Release | Turn::Restart, Suspension::Slow { quota, period }) => {
            (Turn::Halt, share(quota, period))
        }
        (_, Suspension::Hang) => (Turn::Release, left),
    };
    (next, after.min(left))
}

/// Every fault of processes in a trial.
pub(super) fn process_faults(s: &Scenario, phase_ms: u64) -> Vec<ProcessFault> {
    let fault = |k: &Kill| ProcessFault {
        node: node_of(k.process),
        kind: kind(k),
        at: k.start_ms(phase_ms) * 1000,
        step: k.step_name(),
        waits: k.when.as_ref().map(|trigger| trigger.after_ms.span().0),
    };
    s.kill.iter().map(fault).collect()
}

fn kind(k: &Kill) -> ProcessFaultKind {
    let lasts = k.duration_s.span().0;
    let suspend = |how| ProcessFaultKind::Suspend { how, lasts };
    match k.ending {
        Ending::Kill => ProcessFaultKind::Kill { restart: k.restart_after_s.as_ref().map(|s| s.span().0) },
        Ending::Hang => suspend(Suspension::Hang),
        Ending::Slow => {
            let quota = k.quota.as_ref().map_or(1000, |share| (share.get() * 1000.0) as u16);
            suspend(Suspension::Slow { quota, period: Span::ms(k.period_ms.unsigned()) })
        }
        Ending::Full => ProcessFaultKind::Fill { lasts },
    }
}

/// Injection of a process fault, for which the oracle needs a receipt.
pub(super) fn planned(k: &Kill) -> Planned {
    match k.ending {
        Ending::Kill => Planned::Kill(node_of(k.process)),
        Ending::Hang | Ending::Slow => Planned::Suspend(node_of(k.process)),
        Ending::Full => Planned::Fill(node_of(k.process)),
    }
}

/// The node that a process of a scenario is.
pub fn node_of(process: Process) -> NodeId {
    match process {
        Process::Sim => NodeId::SIM,
        Process::Perception => NodeId::PERCEPTION,
        Process::Autonomy => NodeId::UNIT_A,
        Process::Gateway => NodeId::GATEWAY,
        Process::Broker => NodeId::BROKER,
        Process::Console => NodeId::CONSOLE,
        Process::Adversary => NodeId::RELAY_TELEMETRY,
        Process::Recorder => NodeId::RECORDER,
    }
}
