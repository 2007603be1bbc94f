//! P1's guards at an act, by the reports of others than the unit, each just within and just beyond its guard's limit.

use ground_truth::{Any, Note};
use oracle::Property;
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::NodeId;
use wire::mode::{Cause, Mode};
use wire::sensor::Class;

use super::log::Log;

/// True if P1 is broken where `change` is made to a log and the unit acts at `ms`, every guard good in its own entry.
fn broken(ms: u64, change: impl Fn(&mut Log) -> &mut Log) -> bool {
    let mut log = Log::whole();
    change(log.cut_display(4000));
    log.confirm_and_act(ms, Class::Vehicle, 100).breaks().contains(&Property::P1)
}

/// The unit would not come to rest inside the fence.
#[test]
fn p1_act_without_room_to_stop() {
    let fence = |mm: i32| {
        broken(5000, |log| {
            for w in log.entries.iter_mut().filter(|w| w.at == 5_000_000) {
                if let Any::Instrument(Note::Truth { fence_mm, .. }) = &mut w.entry.event {
                    *fence_mm = mm;
                }
            }
            log
        })
    };
    // At 1 m/s: 0.15 s of reaction, and 1 m/s at 3 m/s².
    assert_eq!((fence(316), fence(315)), (false, true));
    let truth = |ms: u64| {
        broken(ms, |log| {
            log.remove_between(4950, 7000, |w| matches!(w.entry.event, Any::Instrument(Note::Truth { .. })))
        })
    };
    assert_eq!((truth(5150), truth(5151)), (false, true), "the plant's last entry is of 4.9 s");
}

#[test]
fn p1_act_of_a_mislocated_unit() {
    let off = |mm: i32, ms: u64| {
        broken(ms, |log| {
            log.remove_between(4900, 7000, |w| matches!(w.entry.event, Any::Service(Event::Located { .. })));
            for w in log.entries.iter_mut().filter(|w| w.at == 4_900_000) {
                if let Any::Service(Event::Located { pose_y_mm, .. }) = &mut w.entry.event {
                    *pose_y_mm = mm;
                }
            }
            log
        })
    };
    assert_eq!((off(1000, 5000), off(1001, 5000)), (false, true));
    assert_eq!((off(1001, 5400), off(1001, 5401)), (true, false), "what it said long ago says nothing of now");
}

#[test]
fn p1_act_without_a_holdable_lease() {
    let silent = |node: NodeId, ms: u64| {
        broken(ms, |log| log.remove_between(5000, 5950, |w| Some(w.entry.node) == node.guard()))
    };
    // A lease; and Tf until the gateway grants no more. 50 ms are the log's.
    assert_eq!([5550, 5551].map(|ms| silent(NodeId::UNIT_A, ms)), [false, true]);
    assert_eq!([5850, 5851].map(|ms| silent(NodeId::GATEWAY, ms)), [false, true]);
}

#[test]
fn p1_act_without_sensor_or_perception() {
    let sensor = |until: u64, ms: u64| broken(ms, |log| log.thermal_fault(4000, until));
    assert_eq!([4500, 4501].map(|ms| sensor(9000, ms)), [false, true]);
    assert_eq!([4599, 4600].map(|ms| sensor(4600, ms)), [true, false], "it is whole again");
    let killed = |ms: u64| broken(ms, |log| log.killed(4000, NodeId::PERCEPTION));
    assert_eq!([4500, 4501].map(killed), [false, true]);
}

#[test]
fn p1_an_act_that_no_seal_covers() {
    let seal = |ms: u64| broken(ms, |log| log.remove_between(4000, 9000, |w| w.entry.node == NodeId::RECORDER));
    assert_eq!([5050, 5051].map(seal), [false, true]);
}

/// The act follows a HOLD or a DISARM without new authority.
#[test]
fn p1_act_in_wrong_mode_or_without_authority() {
    let left = |ms: u64| broken(5000, |log| log.transition(ms, Mode::PrepareToAct, Mode::Ready, Cause::Expired));
    assert_eq!([4951, 4950].map(left), [false, true]);
    for kind in [CommandKind::Hold, CommandKind::Disarm] {
        let ended = |ms: u64| broken(5000, |log| log.command(ms, 9, kind));
        assert_eq!([4999, 5001].map(ended), [true, false], "{}", kind.name());
        let before = broken(5000, |log| log.command(1999, 9, kind));
        assert!(!before, "{} before it was armed", kind.name());
    }
}
