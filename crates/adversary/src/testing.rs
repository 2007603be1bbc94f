//! Helpers of this crate's tests: a setup, and a turn of a core.

use config::setup::Setup;
use ground_truth::{Action, Any, Entry, Note};
use wire::bounds::Bounds;
use wire::core::{Core, Input, Output};
use wire::event::{Account, Event};
use wire::id::{Boot, NodeId, WorldId};
use wire::policy::Policy;
use wire::sign::Secret;
use wire::time::{Instant, Span};

pub(crate) fn setup(node: NodeId, secret: u8) -> Setup {
    Setup {
        node,
        boot: Boot(1),
        world: WorldId(0),
        seed: 7,
        policy: Policy::default(),
        bounds: Bounds::GROUND,
        secret: Secret([secret; 32]),
        public_keys: Vec::new(),
        channels: Vec::new(),
        ablation: None,
        verifier: None,
    }
}

/// Milliseconds after an arbitrary zero.
pub(crate) fn at_ms(ms: u64) -> Instant {
    Instant(5_000_000) + Span::ms(ms)
}

/// Feeds one input. Gives the outputs apart from the journal; the journal's entries are added to `events`.
pub(crate) fn turn(core: &mut dyn Core, now: Instant, input: &Input, events: &mut Vec<Any>) -> Vec<Output> {
    core.handle(now, input);
    let mut out = Vec::new();
    while let Some(output) = core.output() {
        if let Output::Audit { bytes } = output {
            events.push(Entry::decode(&bytes).unwrap().event);
        } else {
            out.push(output);
        }
    }
    out
}

/// Number of times that the journal has `action`.
pub(crate) fn times(events: &[Any], wanted: Action) -> usize {
    events
        .iter()
        .filter(|event| matches!(event, Any::Instrument(Note::Attack { action, .. }) if *action == wanted))
        .count()
}

/// Value in the closing account.
pub(crate) fn counted(events: &[Any], wanted: Account) -> u64 {
    let count = |event: &Any| {
        if let Any::Service(Event::Count { account, n }) = event { (*account == wanted).then_some(*n) } else { None }
    };
    events.iter().find_map(count).unwrap_or(0)
}
