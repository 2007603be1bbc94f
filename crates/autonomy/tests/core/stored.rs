//! Time-tagged orders: neither early nor late, at most once, and void when the unit is not as it was.

use wire::command::{CommandKind, Intent, MAX_AHEAD, TimeTag};
use wire::core::Input;
use wire::event::Event;
use wire::id::{CommandId, NodeId, TrackId, WorldId};
use wire::mode::Mode;
use wire::refusal::Reason;
use wire::session::SessionBody;
use wire::time::Span;
use wire::trust::Revocation;

use crate::bench::{Bench, key_of, order_bytes};

const SECOND: TimeTag = TimeTag { after: Span::s(1), within: Span::ms(200) };
/// Longest time from a nonce's issue to the order that repeats it, and the time between two steps of the bench,
/// milliseconds.
const EARLIER: u64 = 600;

fn tagged(bench: &mut Bench, kind: CommandKind, tag: TimeTag) -> Vec<u8> {
    let intent = Intent { tag: Some(tag), ..bench.intent(kind, "for a reason") };
    order_bytes(&intent, !kind.towards_safe())
}

/// Gives an order for later; gives the unit's answer: the reason, or the time that is left.
fn store(bench: &mut Bench, kind: CommandKind, tag: TimeTag) -> Result<Span, Reason> {
    let bytes = tagged(bench, kind, tag);
    bench.publish(bytes);
    let ack = bench.acks.last().unwrap();
    ack.refused.map_or(Ok(()), Err).map(|()| ack.due.unwrap())
}

/// A unit that holds, and is supervised again.
fn holding() -> Bench {
    let mut bench = Bench::in_mode(Mode::Ready);
    assert_eq!(bench.order(CommandKind::Hold), None);
    bench.run(200);
    bench
}

/// The answer that carries an order out, or refuses it at its time.
fn answer(bench: &Bench) -> Option<Option<Reason>> {
    bench.acks.last().filter(|ack| ack.due.is_none()).map(|ack| ack.refused)
}

#[test]
fn stored_hold_is_executed_in_its_window_once() {
    let mut bench = Bench::in_mode(Mode::Ready);
    let left = store(&mut bench, CommandKind::Hold, SECOND).unwrap();
    assert!(left <= SECOND.after && left >= Span::ms(1000 - EARLIER), "{left}");
    bench.run(left.0 / 1000 - 50);
    assert_eq!(bench.core.mode(), Mode::Ready, "not early");
    bench.run(150);
    assert_eq!((bench.core.mode(), answer(&bench)), (Mode::HoldSafe, Some(None)));
    assert_eq!(bench.order(CommandKind::Resume), None);
    bench.run(2000);
    assert_eq!(bench.core.mode(), Mode::Ready, "and not again");
}

/// A delay on the way does not move the window.
#[test]
fn window_counts_from_the_nonce() {
    let mut bench = Bench::in_mode(Mode::Ready);
    let order = tagged(&mut bench, CommandKind::Hold, SECOND);
    bench.run(500);
    bench.publish(order);
    assert!(bench.acks.last().unwrap().due.unwrap() <= Span::ms(500));
    let order = tagged(&mut bench, CommandKind::Hold, SECOND);
    bench.run(1300);
    bench.publish(order);
    assert_eq!(answer(&bench), Some(Some(Reason::Late)), "its window is over, though its nonce is young enough");
}

#[test]
fn order_that_rests_on_the_display_cannot_wait() {
    let mut bench = Bench::in_mode(Mode::Ready);
    for kind in [CommandKind::Arm(TrackId(1)), CommandKind::Confirm(TrackId(1))] {
        assert_eq!(store(&mut bench, kind, SECOND), Err(Reason::TimeTag));
    }
    let too_far = TimeTag { after: MAX_AHEAD, within: Span(1) };
    assert_eq!(store(&mut bench, CommandKind::Hold, too_far), Err(Reason::TimeTag));
    let overflowing = TimeTag { after: Span(u64::MAX), within: Span(u64::MAX) };
    assert_eq!(store(&mut bench, CommandKind::Hold, overflowing), Err(Reason::TimeTag));
}

#[test]
fn fifth_stored_order_of_one_operator_is_refused() {
    let mut bench = Bench::in_mode(Mode::Ready);
    let later = TimeTag { after: Span::s(60), within: Span::s(1) };
    let answers: Vec<_> = (0..5).map(|_| store(&mut bench, CommandKind::Hold, later).err()).collect();
    assert_eq!(answers, [None, None, None, None, Some(Reason::Full)]);
    assert_eq!(bench.order(CommandKind::Hold), None, "one for now has a place of its own");
}

#[test]
fn stored_resumption_is_carried_out() {
    let mut bench = holding();
    let left = store(&mut bench, CommandKind::Resume, SECOND).unwrap();
    bench.run(left.0 / 1000 + 100);
    assert_eq!((bench.core.mode(), answer(&bench)), (Mode::Ready, Some(None)));
}

#[test]
fn hold_voids_a_stored_resumption_though_the_mode_stays() {
    let mut bench = holding();
    store(&mut bench, CommandKind::Resume, SECOND).unwrap();
    assert_eq!(bench.order(CommandKind::Hold), None);
    let void = bench.events.iter().any(|event| {
        matches!(event, Event::Executed { kind: CommandKind::Resume, refused: Some(Reason::Interlock), .. })
    });
    assert!(void, "its operator is told");
    bench.run(2000);
    assert_eq!(bench.core.mode(), Mode::HoldSafe);
}

#[test]
fn change_of_mode_voids_orders_away_from_safe() {
    let mut bench = Bench::in_mode(Mode::Ready);
    let later = TimeTag { after: Span::s(2), within: Span::s(1) };
    store(&mut bench, CommandKind::Resume, later).unwrap();
    store(&mut bench, CommandKind::Disarm, later).unwrap();
    assert_eq!(bench.order(CommandKind::Hold), None);
    bench.acks.clear();
    bench.run(2500);
    let answered: Vec<_> = bench.acks.iter().map(|ack| ack.refused).collect();
    assert_eq!((bench.core.mode(), answered), (Mode::HoldSafe, vec![None]), "the disarming alone");
}

#[test]
fn lost_session_at_the_broker_voids_a_stored_resumption() {
    let mut bench = holding();
    store(&mut bench, CommandKind::Resume, SECOND).unwrap();
    bench.feed(&Input::SessionLost);
    bench.run(2000);
    assert_eq!(bench.core.mode(), Mode::HoldSafe);
}

#[test]
fn operator_revoked_meanwhile_has_no_stored_order_carried_out() {
    let mut bench = holding();
    store(&mut bench, CommandKind::Resume, SECOND).unwrap();
    let revocation = Revocation { of: NodeId::OPERATOR };
    let signed = revocation.sign(&key_of(NodeId::AUTHORITY));
    bench.downlink(SessionBody::Revoked(signed.as_slice().into()));
    bench.run(2000);
    assert_eq!((bench.core.mode(), answer(&bench)), (Mode::HoldSafe, Some(Some(Reason::Revoked))));
}

/// Supervision is needed at its time, not when it was stored.
#[test]
fn stored_resumption_is_refused_without_a_lease() {
    let mut bench = holding();
    store(&mut bench, CommandKind::Resume, SECOND).unwrap();
    bench.no_grants = true;
    bench.run(2000);
    assert_eq!((bench.core.mode(), answer(&bench)), (Mode::HoldSafe, Some(Some(Reason::Interlock))));
}

/// A unit that was kept from running through the whole window.
#[test]
fn missed_window_is_made_up_towards_safe_only() {
    let mut bench = holding();
    store(&mut bench, CommandKind::Resume, SECOND).unwrap();
    bench.now += Span::s(5);
    bench.feed(&Input::Timeout);
    assert_eq!(answer(&bench), Some(Some(Reason::Late)));
    let mut bench = Bench::in_mode(Mode::Ready);
    store(&mut bench, CommandKind::Hold, SECOND).unwrap();
    bench.now += Span::s(5);
    bench.feed(&Input::Timeout);
    assert_eq!((bench.core.mode(), answer(&bench)), (Mode::HoldSafe, Some(None)));
}

#[test]
fn fork_carries_its_stored_orders_on() {
    let mut bench = Bench::in_mode(Mode::Ready);
    let left = store(&mut bench, CommandKind::Hold, SECOND).unwrap();
    bench.core = bench.core.fork(WorldId(2));
    bench.run(left.0 / 1000 + 100);
    assert_eq!((bench.core.mode(), answer(&bench)), (Mode::HoldSafe, Some(None)));
}

#[test]
fn stranger_cannot_have_an_order_stored() {
    let mut bench = Bench::in_mode(Mode::Ready);
    let intent = Intent { tag: Some(SECOND), ..bench.intent(CommandKind::Hold, "") };
    let of_unit_b = CommandId { operator: NodeId::UNIT_B, ..intent.id };
    bench.publish(order_bytes(&Intent { id: of_unit_b, ..intent }, false));
    assert_eq!(bench.acks.last().unwrap().refused, Some(Reason::Role));
    bench.run(2000);
    assert_eq!(bench.core.mode(), Mode::Ready);
}
