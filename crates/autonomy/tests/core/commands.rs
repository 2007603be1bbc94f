//! Orders: at most once, never late, never by halves, never by another.

use wire::command::CommandKind;
use wire::event::Event;
use wire::id::{NodeId, Nonce, UnitId};
use wire::mode::Mode;
use wire::refusal::Reason;

use crate::bench::{Bench, order_bytes};

fn idle() -> Bench {
    let mut bench = Bench::new();
    bench.run(2000);
    bench
}

fn executed(bench: &Bench) -> Vec<Option<Reason>> {
    let of = |e: &Event| match e {
        Event::Executed { refused, .. } => Some(*refused),
        _ => None,
    };
    bench.events.iter().filter_map(of).collect()
}

#[test]
fn a_repeated_order_is_carried_out_once() {
    let mut bench = idle();
    let enable = bench.signed_order(CommandKind::Enable);
    bench.publish(enable.clone());
    bench.order(CommandKind::Hold);
    bench.publish(enable);
    assert_eq!(executed(&bench), [None, None, Some(Reason::Duplicate)]);
    assert_eq!(bench.core.mode(), Mode::HoldSafe);
}

#[test]
fn an_order_that_was_held_back_is_refused() {
    let mut bench = idle();
    let enable = bench.signed_order(CommandKind::Enable);
    bench.run(2600);
    bench.publish(enable);
    assert_eq!(executed(&bench), [Some(Reason::Late)]);
    assert_eq!(bench.core.mode(), Mode::Idle);
}

#[test]
fn away_from_safe_takes_a_reason_and_a_second_signed_step() {
    let mut bench = idle();
    let intent = bench.intent(CommandKind::Enable, "for a reason");
    bench.publish(order_bytes(&intent, false));
    let intent = bench.intent(CommandKind::Enable, "  ");
    bench.publish(order_bytes(&intent, true));
    assert_eq!(executed(&bench), [Some(Reason::Confirmation), Some(Reason::NoReason)]);
    assert_eq!(bench.report.as_ref().unwrap().last_command, None, "refused at the boundary: no trace in the state");
    let intent = bench.intent(CommandKind::Hold, "");
    bench.publish(order_bytes(&intent, false));
    assert_eq!(bench.core.mode(), Mode::HoldSafe, "towards safe takes neither");
}

#[test]
fn an_order_stripped_of_its_confirmation_does_not_use_up_the_whole_one() {
    let mut bench = idle();
    let intent = bench.intent(CommandKind::Enable, "for a reason");
    bench.publish(order_bytes(&intent, false));
    bench.publish(order_bytes(&intent, true));
    assert_eq!(executed(&bench), [Some(Reason::Confirmation), None]);
}

#[test]
fn orders_of_others_for_others_and_of_invented_nonces_are_refused() {
    let mut bench = idle();
    let mut intent = bench.intent(CommandKind::Hold, "");
    intent.unit = UnitId::B;
    bench.publish(order_bytes(&intent, false));
    intent = bench.intent(CommandKind::Hold, "");
    intent.id.operator = NodeId::UNIT_B;
    bench.publish(order_bytes(&intent, false));
    intent = bench.intent(CommandKind::Hold, "");
    intent.nonce = Nonce(1);
    bench.publish(order_bytes(&intent, false));
    let mut forged = bench.signed_order(CommandKind::Hold);
    let last = forged.len() - 2;
    forged[last] ^= 1;
    bench.publish(forged);
    let reasons = [Reason::Unit, Reason::Role, Reason::Late, Reason::Signature].map(Some);
    assert_eq!(executed(&bench), reasons);
    assert_eq!(bench.core.mode(), Mode::Idle);
}

#[test]
fn every_order_is_answered_under_signature_with_the_mode_after_it() {
    let mut bench = idle();
    bench.order(CommandKind::Enable);
    bench.order(CommandKind::Enable);
    let answers: Vec<_> = bench.acks.iter().map(|ack| (ack.refused, ack.mode)).collect();
    assert_eq!(answers, [(None, Mode::Ready), (Some(Reason::Interlock), Mode::Ready)]);
}
