//! The oracle's requirements on a session that was taken over or cut: three witnesses, an alarm, and no order from before.

use evidence::trial::Outcome;
use evidence::{Plan, Planned};
use ground_truth::{Any, Note};
use oracle::Property;
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::{NodeId, PeerId, TrackId};

use crate::oracle::{Log, command};

const TAKEN: Any = Any::Service(Event::TakenOver { peer: PeerId::UNIT_A });
const LOST: Any = Any::Service(Event::SessionLost { peer: PeerId::UNIT_A });

/// A log in which the thief says at 4 s that it joins, and the broker and the unit, where they are among `nodes`, that the
/// unit's session was taken and is lost.
fn takeover_log(nodes: &[NodeId]) -> Log {
    let mut log = Log::whole();
    let planned = Plan { from: 4_000_000, until: 5_000_000, ..Plan::from(Planned::Takeover(PeerId::UNIT_A)) };
    log.planned.push(planned);
    log.add(4000, NodeId::IMPOSTOR, Note::Joins { certificate: PeerId::UNIT_A });
    for (node, ms, event) in [(NodeId::BROKER, 4100, TAKEN), (NodeId::UNIT_A, 4101, LOST)] {
        if nodes.contains(&node) {
            log.add(ms, node, event);
        }
    }
    log
}

fn shown(log: &mut Log, ms: u64) {
    log.add(ms, NodeId::CONSOLE, Event::LossesShown { peer: PeerId::UNIT_A, times: 1 });
}

#[test]
fn takeover_needs_thief_broker_and_owner() {
    let both = [NodeId::BROKER, NodeId::UNIT_A];
    for (who, receipt) in [(&both[..], true), (&both[..1], false), (&both[1..], false), (&[], false)] {
        let mut log = takeover_log(who);
        shown(&mut log, 4300);
        assert_eq!(log.judge().receipt, receipt, "{who:?}");
    }
    let mut log = takeover_log(&both);
    shown(&mut log, 4300);
    assert_eq!((log.breaks(), log.judge().outcome), (vec![], Outcome::Rejected));
    log.planned[0].what = Planned::Takeover(PeerId::GATEWAY);
    assert!(!log.judge().receipt, "it was another's session");
}

#[test]
fn p7_fresh_display_silent_about_session_loss() {
    let both = [NodeId::BROKER, NodeId::UNIT_A];
    assert_eq!(takeover_log(&both).breaks(), [Property::P7]);
    let mut late = takeover_log(&both);
    shown(&mut late, 5200);
    assert_eq!(late.breaks(), [Property::P7]);
    let mut blind = takeover_log(&both);
    blind.cut_display(0);
    assert_eq!(blind.breaks(), [], "nothing is shown as fresh");
    let mut doubled = takeover_log(&both);
    shown(&mut doubled, 4300);
    doubled.add(6000, NodeId::UNIT_A, LOST);
    assert_eq!(doubled.breaks(), [Property::P7], "once is not twice");
}

#[test]
fn p8_order_from_before_a_session_loss() {
    let executed = |kind: CommandKind| {
        let mut log = takeover_log(&[NodeId::BROKER, NodeId::UNIT_A]);
        shown(&mut log, 4300);
        log.add(4000, NodeId::CONSOLE, Event::Intended { command: command(7), kind, tag: None });
        log.add(4600, NodeId::UNIT_A, Event::Executed { command: command(7), kind, refused: None });
        if kind == CommandKind::Disarm {
            log.disarmed(4600);
        }
        log.breaks()
    };
    assert_eq!(executed(CommandKind::Arm(TrackId(2))), [Property::P8]);
    assert_eq!(executed(CommandKind::Disarm), [], "what leads to safety is not voided");
}
