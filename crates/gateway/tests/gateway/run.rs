//! The identities of one run at the gateway: a stranger is one that the wire has a number for and the run no key.

use gateway::fanout::{Interest, InterestError};
use gateway::{Gateway, GatewayError};
use wire::codec;
use wire::command::{Ack, CommandKind};
use wire::core::{Input, Subject};
use wire::event::{Event, Interface};
use wire::id::{NodeId, PeerId, UnitId};
use wire::mode::Mode;
use wire::policy::{Check, Policy};
use wire::refusal::Reason;
use wire::roster::RosterError;
use wire::session::MAX_TEAMMATES;
use wire::sign::Purpose;
use wire::time::{Instant, Span};

use crate::bench::{Bench, config, intent, key_of, setup, sign, signed_intent, waiving};

fn unit(number: usize) -> UnitId {
    UnitId::all().nth(number).unwrap()
}

/// Unit 64, well-formed on the wire and not in the run.
fn stranger() -> UnitId {
    let decoded: UnitId = codec::decode(&[0x18, 91], 2).unwrap();
    assert_eq!(decoded.name(), "unit-64");
    decoded
}

/// Reason and particulars of the newest refusal at `interface`.
fn refused(bench: &Bench, interface: Interface) -> Option<(Reason, String)> {
    bench.events.iter().rev().find_map(|event| match event {
        Event::Refused { at: place, reason, detail, .. } if *place == interface => {
            Some((*reason, detail.as_str().to_owned()))
        }
        _ => None,
    })
}

#[test]
fn stranger_session_and_report_are_refused_by_name() {
    let mut bench = Bench::new(waiving(&[Check::Origin]));
    let session = bench.open(1, stranger().node());
    assert_eq!(bench.ended, [session]);
    assert_eq!(bench.deliver(session, vec![1, 2, 3]), Some(Reason::Role));
    assert!(refused(&bench, Interface::Uplink).unwrap().1.contains("unit-64"));
    let b = bench.reporting(2, NodeId::UNIT_B);
    let now = bench.now;
    let mut report = bench.units.get_mut(&b).unwrap().next_report(now);
    report.origin = stranger().node();
    assert_eq!(bench.carry(b, &sign(stranger().node(), &report)), Some(Reason::Signer));
    let text = refused(&bench, Interface::Uplink).unwrap().1;
    assert_eq!(text, "signer: a known signer expected, got unit-64");
    bench.assert_conserved();
}

#[test]
fn stranger_in_a_command_is_refused_by_name() {
    let mut bench = Bench::new(Policy::default());
    bench.reporting(1, NodeId::UNIT_A);
    let mut addressed = intent(1, CommandKind::Hold, "");
    addressed.unit = stranger();
    assert_eq!(bench.stage(&signed_intent(&addressed)), Some(Reason::Unit));
    let mut order = intent(2, CommandKind::Hold, "");
    order.id.operator = stranger().node();
    let signed = key_of(stranger().node()).sign(Purpose::Intent, &codec::encode(&order));
    assert_eq!(bench.stage(&signed), Some(Reason::Role));
    assert!(refused(&bench, Interface::Requests).unwrap().1.contains("unit-64"));
    let ack = Ack { id: order.id, intent: [0; 32], refused: None, mode: Mode::HoldSafe, due: None };
    let bytes = key_of(stranger().node()).sign(Purpose::Ack, &codec::encode(&ack));
    bench.give(&Input::Published { subject: Subject::Ack(stranger()), bytes });
    let (reason, text) = refused(&bench, Interface::Acks).unwrap();
    assert_eq!((reason, text.as_str()), (Reason::Unit, "unit: one of this gateway's expected, got unit-64"));
}

#[test]
fn gateway_without_sound_table_is_not_made() {
    let made = |edit: &dyn Fn(&mut config::setup::Setup, &mut gateway::GatewayConfig)| {
        let (mut setup, mut config) = (setup(Policy::default()), config());
        edit(&mut setup, &mut config);
        Gateway::new(setup, config, Instant(0)).map(drop)
    };
    let (field, got) = ("units", stranger().node());
    assert_eq!(made(&|_, _| {}), Ok(()));
    assert_eq!(
        made(&|_, config| config.units.push(stranger())),
        Err(GatewayError::Roster(RosterError::Stranger { field, got }))
    );
    let operator = NodeId::INSIDER_OPERATOR;
    assert_eq!(
        made(&|_, config| config.operators.push(operator)),
        Err(GatewayError::Roster(RosterError::Stranger { field: "operators", got: operator }))
    );
    assert_eq!(
        made(&|setup, _| setup.public_keys.push(setup.public_keys[0])),
        Err(GatewayError::Roster(RosterError::Twice { got: NodeId::UNIT_A }))
    );
    assert_eq!(
        made(&|_, config| config.interests[0].hears.push(stranger())),
        Err(GatewayError::Interest(InterestError::Stranger(stranger())))
    );
}

/// Each of 64 units hears the next three.
#[test]
fn each_unit_hears_its_interest_set_alone() {
    let (all, mut config): (Vec<UnitId>, _) = (UnitId::all().collect(), config());
    let hears = |n: usize| (1..=MAX_TEAMMATES).map(|step| unit((n + step) % all.len())).collect::<Vec<_>>();
    config.interests = (0..all.len()).map(|n| Interest { unit: unit(n), hears: hears(n) }).collect();
    let mut setup = setup(Policy::default());
    setup.public_keys.retain(|(node, _)| node.unit().is_none());
    setup.public_keys.extend(all.iter().map(|unit| (unit.node(), key_of(unit.node()).public())));
    config.units.clone_from(&all);
    let mut bench = Bench::from_setup(setup, config);
    let sessions: Vec<_> = (1..).zip(&all).map(|(id, unit)| bench.open(id, unit.node())).collect();
    sessions.iter().for_each(|session| assert_eq!(bench.hello(*session), None));
    bench.pass(Span::ms(100));
    sessions.iter().for_each(|session| assert_eq!(bench.report(*session), None));
    for (n, session) in sessions.iter().enumerate() {
        let mut heard: Vec<PeerId> = bench.units[session].teammates.iter().map(|(via, ..)| *via).collect();
        let mut expected: Vec<PeerId> = hears(n).into_iter().map(UnitId::peer).collect();
        heard.sort();
        expected.sort();
        assert_eq!(heard, expected, "{}", unit(n));
    }
    bench.assert_conserved();
}
