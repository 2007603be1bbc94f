//! Orders: at most once, never late, never by halves, never by another.

use config::setup::Ablation;
use sha2::{Digest, Sha256};
use wire::command::{CommandKind, Intent};
use wire::core::Input;
use wire::crop::{Crop, PIXELS, Pixels};
use wire::event::{Account, Event, Interface};
use wire::id::{Boot, FrameId, NodeId, Nonce, PeerId, Sequence, TrackId, UnitId};
use wire::mode::Mode;
use wire::policy::{Check, Policy, Requirement};
use wire::refusal::Reason;
use wire::session::SessionBody;
use wire::settings::Settings;
use wire::time::Span;
use wire::trust::Revocation;

use crate::bench::{Bench, TRACK, key_of, order_bytes};

fn idle() -> Bench {
    let mut bench = Bench::new();
    bench.run(2000);
    bench
}

fn executed(bench: &Bench) -> Vec<Option<Reason>> {
    let entry = |e: &Event| match e {
        Event::Executed { refused, .. } => Some(*refused),
        _ => None,
    };
    bench.events.iter().filter_map(entry).collect()
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
fn away_from_safe_needs_reason_and_second_signature() {
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

/// Stripped of its confirmation, an order does not use up the whole one.
#[test]
fn stripped_order_leaves_the_whole_one_usable() {
    let mut bench = idle();
    let intent = bench.intent(CommandKind::Enable, "for a reason");
    bench.publish(order_bytes(&intent, false));
    bench.publish(order_bytes(&intent, true));
    assert_eq!(executed(&bench), [Some(Reason::Confirmation), None]);
}

#[test]
fn foreign_misaddressed_and_invented_nonce_orders_are_refused() {
    let mut bench = idle();
    let mut intent = bench.intent(CommandKind::Hold, "");
    intent.unit = UnitId::B;
    bench.publish(order_bytes(&intent, false));
    intent = bench.intent(CommandKind::Hold, "");
    intent.id.operator = NodeId::UNIT_B; // And signed by it.
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

/// The mode is the one after the order.
#[test]
fn every_order_gets_a_signed_answer_with_mode() {
    let mut bench = idle();
    bench.order(CommandKind::Enable);
    bench.order(CommandKind::Enable);
    let answers: Vec<_> = bench.acks.iter().map(|ack| (ack.refused, ack.mode)).collect();
    assert_eq!(answers, [(None, Mode::Ready), (Some(Reason::Interlock), Mode::Ready)]);
}

#[test]
fn order_of_an_earlier_boot_is_late() {
    let mut before = idle();
    let enable = before.signed_order(CommandKind::Enable);
    let mut after = Bench::of_boot(2);
    after.run(2000);
    after.publish(enable.clone());
    assert_eq!(executed(&after), [Some(Reason::Late)], "the same seed issues other nonces after a restart");
    before.publish(enable);
    assert_eq!(executed(&before), [None]);
}

/// Orders given before the loss that lead to safety still hold.
#[test]
fn session_loss_voids_orders_away_from_safe() {
    let mut bench = idle();
    let (enable, hold) = (bench.signed_order(CommandKind::Enable), bench.signed_order(CommandKind::Hold));
    bench.feed(&Input::SessionLost);
    bench.publish(enable);
    assert_eq!((executed(&bench), bench.core.mode()), (vec![Some(Reason::Late)], Mode::Idle));
    bench.run(200);
    assert_eq!(bench.report.as_ref().unwrap().sessions_lost, 1, "the unit says so");
    assert_eq!(bench.order(CommandKind::Enable), None, "given anew it is obeyed");
    bench.publish(hold);
    assert_eq!(bench.core.mode(), Mode::HoldSafe, "a HOLD is never void");
    assert!(bench.events.iter().any(|e| matches!(e, Event::SessionLost { peer: PeerId::UNIT_A })));
}

#[test]
fn executed_orders_do_not_repeat_after_session_loss() {
    for kind in [CommandKind::Hold, CommandKind::Disarm] {
        let mut bench = idle();
        let order = bench.signed_order(kind);
        bench.publish(order.clone());
        for _ in 0..3 {
            bench.feed(&Input::SessionLost);
            bench.publish(order.clone());
        }
        let repeated = Some(Reason::Duplicate);
        assert_eq!(executed(&bench), [None, repeated, repeated, repeated], "{kind:?}");
    }
}

/// A HOLD from far ahead is obeyed and moves no counter.
#[test]
fn counter_run_ahead_is_refused_except_hold() {
    let mut bench = idle();
    let mut ahead = |kind, sequence| {
        let mut intent = bench.intent(kind, "for a reason");
        intent.id.sequence = Sequence(sequence);
        bench.publish(order_bytes(&intent, true));
    };
    ahead(CommandKind::Resume, u64::MAX);
    ahead(CommandKind::Resume, 5);
    ahead(CommandKind::Resume, 5 + 65);
    ahead(CommandKind::Hold, u64::MAX);
    ahead(CommandKind::Resume, 6);
    let reasons = [Some(Reason::Jump), Some(Reason::Interlock), Some(Reason::Jump), None, None];
    assert_eq!(executed(&bench), reasons);
    bench.run(200);
    let (heard, _) = bench.report.as_ref().unwrap().last_command.unwrap();
    assert_eq!(heard.sequence, Sequence(6), "the operator's console is not led to the far end");
}

/// Refusals of the flooding operator are not reported one by one.
#[test]
fn flooding_operator_is_cut_off_other_is_heard() {
    let mut bench = idle();
    let flood = |bench: &mut Bench, kind: CommandKind, from: u64| {
        for sequence in from..from + 60 {
            let mut intent = bench.intent(kind, "for a reason");
            (intent.id.operator, intent.id.sequence) = (NodeId::OPERATOR_2, Sequence(sequence));
            bench.publish(order_bytes(&intent, !kind.towards_safe()));
        }
    };
    flood(&mut bench, CommandKind::Resume, 1);
    assert_eq!(executed(&bench).len(), 8 + 8, "the burst is answered, and as many refusals for the rate");
    let rate = Account::Refused(Interface::Commands, Reason::Rate);
    let refusals = |bench: &Bench| {
        bench.events.iter().filter(|e| matches!(e, Event::Refused { reason: Reason::Rate, .. })).count()
    };
    assert_eq!(refusals(&bench), 8);
    assert_eq!(bench.order(CommandKind::Enable), None, "the other operator has a rate of its own");
    flood(&mut bench, CommandKind::Hold, 100);
    assert_eq!(bench.core.mode(), Mode::HoldSafe, "the first hold of a flood holds");
    bench.run(200);
    assert_eq!(bench.order(CommandKind::Resume), None);
    assert_eq!(bench.order(CommandKind::Hold), None, "and the other operator's is executed beside it");
    bench.feed(&wire::core::Input::Finish);
    let counted = bench.events.iter().find_map(|e| match e {
        Event::Count { account, n } if *account == rate => Some(*n),
        _ => None,
    });
    assert_eq!(counted, Some(52 + 52), "every one is counted");
}

/// The flood is under the operator's own key.
#[test]
fn disarm_flood_does_not_keep_hold_out() {
    let mut bench = Bench::in_mode(Mode::Ready);
    let mut passed = 0;
    while bench.order(CommandKind::Disarm).is_none() {
        passed += 1;
    }
    assert_eq!(passed, 8, "in READY they stop nothing");
    assert_eq!(bench.core.mode(), Mode::Ready);
    assert_eq!(bench.order(CommandKind::Hold), None);
    assert_eq!(bench.core.mode(), Mode::HoldSafe);
}

/// Unsigned orders, `n` of them, in the operator's name and with the unit's own nonce.
fn forge(bench: &mut Bench, kind: CommandKind, n: u64) {
    for sequence in 0..n {
        let mut intent = bench.intent(kind, "for a reason");
        intent.id.sequence = Sequence(1 + sequence % 60);
        let mut order = order_bytes(&intent, false);
        // The last byte of the signature, before the missing confirmation.
        let last = order.len() - 2;
        order[last] ^= 1;
        bench.publish(order);
    }
}

/// The closing account of the command plane: received, accepted, and refused by reason.
fn account(bench: &mut Bench) -> (u64, u64, Vec<(Reason, u64)>) {
    bench.feed(&wire::core::Input::Finish);
    let counts: Vec<(Account, u64)> = bench
        .events
        .iter()
        .filter_map(|e| match e {
            Event::Count { account, n } => Some((*account, *n)),
            _ => None,
        })
        .collect();
    let total_of = |wanted| counts.iter().find(|(account, _)| *account == wanted).map_or(0, |(_, n)| *n);
    let refused = counts.iter().filter_map(|(account, n)| match account {
        Account::Refused(Interface::Commands, reason) => Some((*reason, *n)),
        _ => None,
    });
    (
        total_of(Account::Received(Interface::Commands)),
        total_of(Account::Accepted(Interface::Commands)),
        refused.collect(),
    )
}

/// A flood of forged orders is neither logged nor answered nor verified one by one.
#[test]
fn forged_order_flood_is_counted_one_by_one() {
    let mut bench = idle();
    let (events, acks) = (bench.events.len(), bench.acks.len());
    forge(&mut bench, CommandKind::Enable, 500);
    forge(&mut bench, CommandKind::Hold, 500);
    assert_eq!(bench.acks.len() - acks, 8, "answered");
    assert_eq!(bench.events.len() - events, 2 * 8, "written: why, and what was asked");
    assert_eq!(bench.order(CommandKind::Hold), None, "no forgery keeps the operator's hold out");
    bench.run(3000);
    assert_eq!(bench.order(CommandKind::Resume), None, "and when it is over the rest is heard again");
    let (received, accepted, refused) = account(&mut bench);
    assert_eq!((received, accepted), (1002, 2));
    let verified_or_not = [(Reason::Signature, 16 + 500), (Reason::Rate, 500 - 16)];
    assert_eq!(refused, verified_or_not, "a forged hold is always verified, of the others so many");
}

/// Log entries and answers are bounded for any flaw of the flood.
#[test]
fn every_flood_is_told_boundedly_and_adds_up() {
    let mut bench = idle();
    let enable = bench.signed_order(CommandKind::Enable);
    bench.publish(enable.clone());
    let (events, acks) = (bench.events.len(), bench.acks.len());
    for n in 0..300 {
        let mut intent = bench.intent(CommandKind::Hold, "");
        match n % 4 {
            0 => intent.nonce = Nonce(1),
            1 => intent.unit = UnitId::B,
            2 => intent.id.operator = NodeId::UNIT_B,
            _ => {}
        }
        if n % 4 == 3 {
            bench.publish(enable.clone())
        } else {
            bench.publish(order_bytes(&intent, false))
        }
        bench.publish(vec![0xff]);
    }
    assert!(bench.acks.len() - acks <= 8);
    assert!(bench.events.len() - events <= 2 * 8);
    let (received, accepted, refused) = account(&mut bench);
    assert_eq!((received, accepted), (601, 1));
    assert_eq!(refused.iter().map(|(_, n)| n).sum::<u64>(), 600, "{refused:?}");
    for (reason, n) in [(Reason::Late, 75), (Reason::Unit, 75), (Reason::Role, 75), (Reason::Duplicate, 75)] {
        assert!(refused.contains(&(reason, n)), "{reason:?}: {refused:?}");
    }
}

/// The reported counter follows to where a HOLD moved the unit's.
#[test]
fn reported_counter_never_runs_backwards() {
    let mut bench = idle();
    let reported = |bench: &mut Bench, kind, boot, sequence| {
        let mut intent = bench.intent(kind, "for a reason");
        (intent.id.boot, intent.id.sequence) = (Boot(boot), Sequence(sequence));
        bench.publish(order_bytes(&intent, !kind.towards_safe()));
        bench.run(200);
        let (id, _) = bench.report.as_ref().unwrap().last_command.unwrap();
        (id.boot.0, id.sequence.0)
    };
    assert_eq!(reported(&mut bench, CommandKind::Enable, 1, 50), (1, 50));
    assert_eq!(reported(&mut bench, CommandKind::Hold, 1, 3), (1, 50), "an old hold is obeyed and says nothing of it");
    assert_eq!(bench.core.mode(), Mode::HoldSafe);
    assert_eq!(reported(&mut bench, CommandKind::Hold, 9, 1), (5, 0), "so that whoever goes on above it is heard");
    assert_eq!(reported(&mut bench, CommandKind::Resume, 9, 2), (9, 2));
    assert_eq!(bench.core.mode(), Mode::Ready);
}

#[test]
fn only_the_authority_revokes_an_operator() {
    let mut bench = idle();
    let revocation = Revocation { of: NodeId::OPERATOR };
    let forged = revocation.sign(&key_of(NodeId::OPERATOR_2));
    bench.downlink(SessionBody::Revoked(forged.as_slice().into()));
    assert_eq!(bench.order(CommandKind::Enable), None);
    let signed = revocation.sign(&key_of(NodeId::AUTHORITY));
    bench.downlink(SessionBody::Revoked(signed.as_slice().into()));
    bench.downlink(SessionBody::Revoked(signed.as_slice().into()));
    assert_eq!(bench.events.iter().filter(|e| matches!(e, Event::Struck { .. })).count(), 1);
    assert_eq!(bench.order(CommandKind::Hold), Some(Reason::Revoked), "also towards safe: the lease is what stops");
}

#[test]
fn values_change_only_in_idle_and_jointly_safe() {
    let narrow = Settings { speed_mm_s: 3000, margin_mm: 300, arm_permille: 600, keep_permille: 450 };
    let slow = Settings { speed_mm_s: 1000, margin_mm: 600, ..narrow };
    let mut bench = idle();
    assert_eq!(bench.order(CommandKind::Configure(narrow)), Some(Reason::Joint));
    assert_eq!(bench.order(CommandKind::Configure(slow)), None);
    assert_eq!(bench.order(CommandKind::Enable), None);
    assert_eq!(bench.order(CommandKind::Configure(narrow)), Some(Reason::Joint), "also where no value may change");
    assert_eq!(bench.order(CommandKind::Configure(slow)), Some(Reason::Interlock));
    bench.run(500);
    assert_eq!(bench.driven(), 1000, "the speed that was set is the speed that is driven");
    let mut policy = Policy::default();
    policy.boundary.insert(Check::Joint, Requirement::Waived);
    let mut waived = Bench::with_policy(policy, None);
    waived.run(2000);
    assert_eq!(waived.order(CommandKind::Configure(narrow)), None);
}

#[test]
fn plan_keeps_the_operators_margin() {
    let driven = |margin_mm| {
        let mut bench = idle();
        let settings = Settings { speed_mm_s: 1000, margin_mm, arm_permille: 600, keep_permille: 450 };
        assert_eq!(bench.order(CommandKind::Configure(settings)), None);
        assert_eq!(bench.order(CommandKind::Enable), None);
        bench.run(500);
        bench.driven()
    };
    assert_eq!(
        driven(3000),
        1000,
        "the way point is 5 m inside the fence: room for 3 m and what the plan keeps beyond"
    );
    assert_eq!(driven(5000), 0, "no way leads there without tripping the guard");
}

#[test]
fn armings_name_a_report_that_the_unit_made() {
    let mut bench = Bench::new();
    bench.run(500);
    let early = bench.shown;
    bench.reach(Mode::Ready);
    let arm = |bench: &mut Bench, shown| {
        let intent = Intent { shown, ..bench.intent(CommandKind::Arm(TRACK), "for a reason") };
        bench.publish(order_bytes(&intent, true));
        bench.acks.last().unwrap().refused
    };
    assert_eq!(arm(&mut bench, None), Some(Reason::Shown));
    assert_eq!(arm(&mut bench, Some([7; 32])), Some(Reason::Shown), "another's report, or none");
    bench.run(1400);
    assert_eq!(arm(&mut bench, early), Some(Reason::Shown), "a report that is too old");
    assert_eq!(bench.order(CommandKind::Arm(TrackId(900))), Some(Reason::Shown), "no track of the report");
    bench.run(100);
    let newest = bench.shown;
    assert_eq!(arm(&mut bench, newest), None);
    assert_eq!(bench.core.mode(), Mode::PrepareToAct);
    let mut policy = Policy::default();
    policy.boundary.insert(Check::Shown, Requirement::Waived);
    let mut waived = Bench::with_policy(policy, Some(Ablation { scenario: "test".into() }));
    waived.reach(Mode::Ready);
    assert_eq!(arm(&mut waived, None), None);
}

/// The operator saw it where it was.
#[test]
fn moved_track_carries_no_consent() {
    let mut bench = Bench::in_mode(Mode::PrepareToAct);
    let confirm = |bench: &mut Bench, shown| {
        let intent = Intent { shown, ..bench.intent(CommandKind::Confirm(TRACK), "for a reason") };
        bench.publish(order_bytes(&intent, true));
        bench.acks.last().unwrap().refused
    };
    let before = bench.shown;
    bench.place.0 += 1_600;
    bench.run(300);
    assert_eq!(confirm(&mut bench, before), Some(Reason::Shown));
    assert_eq!(bench.core.mode(), Mode::PrepareToAct, "authority stands, for the track where it is");
    bench.place.0 -= 200;
    bench.run(100);
    assert_eq!(confirm(&mut bench, before), None, "within the limit");
    assert!(bench.events.iter().any(|event| matches!(event, Event::Acted { .. })));
}

/// Each is sent once, and the report names its hash.
#[test]
fn crops_are_vouched_for_by_the_report() {
    let mut bench = idle();
    assert_eq!(bench.report.as_ref().unwrap().pictured, None);
    let crop = |shade| Crop {
        track: TRACK,
        frame: FrameId(1),
        scale: 1,
        pixels: Pixels::Warmth(1, 2, [shade; PIXELS].into()),
    };
    bench.cropped = [crop(1), crop(2)].into_iter().collect();
    bench.run(500);
    let sent: Vec<[u8; 32]> = bench.crops.iter().map(|bytes| Sha256::digest(bytes).into()).collect();
    let pictured = bench.report.as_ref().unwrap().pictured.clone().expect("crops have come");
    assert_eq!((sent.len(), pictured.track), (2, TRACK));
    assert!(pictured.crops.iter().map(|hash| **hash).eq(sent), "{pictured:?}");
    assert!(pictured.age >= Span::ms(200), "and how old they are: {}", pictured.age);
}
