//! Processes that died or did not run for a time, and when one could judge again.
//!
//! The marks of a process are its own entries, and the inputs of its core. The broker has no core and writes few entries: its
//! marks are the bytes that clients' ingresses saw come out of it.

use evidence::{Evidence, Micros, Witnessed};
use ground_truth::{Any, Note, Sight, Suspension};
use wire::id::NodeId;

use super::Span;

/// Time for which a dying process's last words may still be on their way into the log.
pub(crate) const LAST_WORDS: Micros = 100_000;
/// Time from the end of a stop to the first entry that is written after it, beyond the period of judging.
const RESUME_SLACK: Micros = 50_000;

/// Times at which `node` did not live: from each end to the start after it, if there is one.
pub(crate) fn dead_spans(evidence: &Evidence, node: NodeId) -> Vec<Span> {
    let ends = evidence
        .entries
        .iter()
        .filter(|w| matches!(w.entry.event, Any::Instrument(Note::Ended { node: n, .. }) if n == node));
    let restart_after = |end: Micros| {
        let mut later = evidence.entries.iter().filter(|w| w.at >= end);
        later.find(|w| matches!(w.entry.event, Any::Instrument(Note::Restarted { node: n, .. }) if n == node))
    };
    ends.map(|w| (w.at, restart_after(w.at).map_or(Micros::MAX, |w| w.at))).collect()
}

/// True if `node` did not live at that time.
pub(crate) fn is_dead(evidence: &Evidence, node: NodeId, time: Micros) -> bool {
    dead_spans(evidence, node).iter().any(|(from, to)| (*from..*to).contains(&time))
}

/// True if a process left no mark in that time.
pub(crate) fn left_no_mark(evidence: &Evidence, node: NodeId, (from, to): Span) -> bool {
    let from = from.saturating_add(LAST_WORDS);
    !evidence.entries.iter().filter(|w| w.at > from && w.at < to.min(evidence.duration)).any(|w| match w.entry.event {
        Any::Instrument(Note::StreamSaw { sight: Sight::Delivered, .. }) if node == NodeId::BROKER => true,
        _ => is_mark(w, node),
    })
}

/// True if an entry is a mark of that process.
pub(crate) fn is_mark(w: &Witnessed, node: NodeId) -> bool {
    match w.entry.event {
        // A process that writes little by itself would make any stop credible: the inputs of its core are marks, too.
        Any::Instrument(Note::Ran { node: ran }) => ran == node && w.entry.node == NodeId::CAMPAIGN,
        _ => w.entry.node == node,
    }
}

/// Time at which the process that `w` says was stopped or ended runs again, at the latest after one of its stops.
pub(crate) fn runs_again(evidence: &Evidence, w: &Witnessed) -> Micros {
    let mut later = evidence.entries.iter().filter(|l| l.at >= w.at);
    match w.entry.event {
        Any::Instrument(Note::Suspended { node, how, .. }) => {
            let is_resume = |l: &&Witnessed| {
                matches!(
                    l.entry.event,
                    Any::Instrument(Note::Suspended { node: n, on: false, .. }) if n == node
                )
            };
            // At the end of a run every process is let go on, to close its account.
            let end = later.find(is_resume).map_or(evidence.duration, |l| l.at.min(evidence.duration));
            match how {
                Suspension::Hang => end,
                Suspension::Slow { quota, period } => {
                    // A slow process runs in every period; a bound can only count one of its stops.
                    end.min(w.at + period.0 * u64::from(1000_u16.saturating_sub(quota)) / 1000)
                }
            }
        }
        Any::Instrument(Note::Ended { node, .. }) => {
            let is_restart =
                |l: &&Witnessed| matches!(l.entry.event, Any::Instrument(Note::Restarted { node: n, .. }) if n == node);
            later.find(is_restart).map_or(Micros::MAX, |l| l.at)
        }
        Any::Instrument(Note::DiskFull { node, .. }) => {
            let has_room = |l: &&Witnessed| {
                matches!(
                    l.entry.event,
                    Any::Instrument(Note::DiskFull { node: n, on: false }) if n == node
                )
            };
            later.find(has_room).map_or(Micros::MAX, |l| l.at)
        }
        _ => w.at,
    }
}

/// Time at which `wanted` could next judge or act: `time`, or one judgement after it runs again where it hung then.
pub(crate) fn can_judge(evidence: &Evidence, wanted: NodeId, time: Micros) -> Micros {
    let hung = evidence.entries.iter().filter(|w| {
        matches!(
            w.entry.event,
            Any::Instrument(Note::Suspended { node, how: Suspension::Hang, on: true }) if node == wanted
        ) && w.at <= time
    });
    let judges_from = hung.map(|w| runs_again(evidence, w)).max().map(|runs| runs + judgement_after_stop(evidence));
    time.max(judges_from.unwrap_or(0))
}

/// Duration of one judgement of the guards after a unit runs again, with the messages under way.
pub(crate) fn judgement_after_stop(evidence: &Evidence) -> Micros {
    evidence.bounds.control_period_ms * 1000 + RESUME_SLACK
}
