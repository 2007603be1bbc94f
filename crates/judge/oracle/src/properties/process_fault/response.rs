//! Table of the required responses, stated before any run.

use wire::bounds::Bounds;
use wire::id::NodeId;
use wire::mode::Mode;

use evidence::Under;
use evidence::process_fault::From;

/// Response required when one process is killed while the platform is READY or holds authority.
#[derive(Clone, Copy, Debug)]
pub struct RequiredResponse {
    /// The process; a process of the unit under test by its name in unit A.
    pub node: NodeId,
    /// Mode that the platform ends in.
    pub ends_in: Mode,
    /// Event from which the bounds count.
    pub from: From,
    /// Latest time at which READY and authority must have ended, ms; none where no loss is expected.
    pub restricted: Option<fn(&Bounds) -> u64>,
    /// Latest time in `ends_in`, ms.
    pub settled: Option<fn(&Bounds) -> u64>,
    /// Reason for this response.
    pub reason: &'static str,
}

fn td(b: &Bounds) -> u64 {
    b.to_degraded_ms
}

/// *Th*.
pub(super) fn th(b: &Bounds) -> u64 {
    b.to_hold_safe_ms
}

/// The seal limit and one judgement of the guards.
fn unsealed(b: &Bounds) -> u64 {
    b.seal_limit_ms + b.control_period_ms
}

/// Every process that can be killed.
pub const REQUIRED_RESPONSES: [RequiredResponse; 8] = [
    RequiredResponse {
        node: NodeId::SIM,
        ends_in: Mode::HoldSafe,
        from: From::Kill,
        restricted: Some(td),
        settled: Some(th),
        reason: "no localisation and no frames: degraded after the product limit, held when driving blind is not made \
                 good; the plant dies with its world",
    },
    RequiredResponse {
        node: NodeId::PERCEPTION,
        ends_in: Mode::HoldSafe,
        from: From::Kill,
        restricted: Some(td),
        settled: Some(th),
        reason: "every stage and all tracks are lost at once: degraded, and with no measured range left, held",
    },
    RequiredResponse {
        node: NodeId::UNIT_A,
        ends_in: Mode::HoldSafe,
        from: From::Kill,
        restricted: None,
        settled: Some(th),
        reason: "nobody renews the set-point: the plant brakes when its lease ends; read from ground truth",
    },
    RequiredResponse {
        node: NodeId::GATEWAY,
        ends_in: Mode::HoldSafe,
        from: From::Kill,
        restricted: Some(th),
        settled: Some(th),
        reason: "no more grants: the supervision lease lapses",
    },
    RequiredResponse {
        node: NodeId::RELAY_TELEMETRY,
        ends_in: Mode::HoldSafe,
        from: From::Kill,
        restricted: Some(th),
        settled: Some(th),
        reason: "the telemetry link is cut both ways: the supervision lease lapses",
    },
    RequiredResponse {
        node: NodeId::BROKER,
        ends_in: Mode::HoldSafe,
        from: From::Hold,
        restricted: Some(th),
        settled: Some(th),
        reason: "commands do not come through, telemetry and grants do: READY goes on, unused authority expires, and a \
                 HOLD that stays unacknowledged ends the grants",
    },
    RequiredResponse {
        node: NodeId::RECORDER,
        ends_in: Mode::Degraded,
        from: From::Kill,
        restricted: Some(unsealed),
        settled: Some(unsealed),
        reason: "no sealed log for the seal limit: no authority, reduced speed; driving does not depend on it",
    },
    RequiredResponse {
        node: NodeId::CONSOLE,
        ends_in: Mode::Ready,
        from: From::Kill,
        restricted: None,
        settled: None,
        reason: "supervision is the gateway's lease and no bound asks for a person: READY goes on, nothing new can be \
                 armed or confirmed, unused authority expires",
    },
];

/// Response required for `node` in a run with this unit under test.
pub fn required_response(tested: Under, node: NodeId) -> Option<&'static RequiredResponse> {
    let process = |response: &RequiredResponse| match response.node {
        NodeId::UNIT_A => tested.node(),
        NodeId::SIM => tested.sim,
        NodeId::PERCEPTION => tested.perception,
        other => other,
    };
    REQUIRED_RESPONSES.iter().find(|response| process(response) == node)
}
