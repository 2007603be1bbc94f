//! Permitted displays, and their freshness.

use console::shown::Origin;
use proptest::prelude::*;
use wire::core::{Core, Input};
use wire::event::{Event, Freshness};
use wire::feed::{AcceptedReport, Feed};
use wire::id::{Boot, NodeId, PeerId, UnitId};
use wire::mode::Mode;
use wire::person::Role;
use wire::policy::{DisplayRule, Policy, Requirement, Waived};
use wire::refusal::Reason;
use wire::report::Report;
use wire::time::{Echo, Instant, PeerStamp, Span};

use crate::bench::{Bench, report, sign};

/// An absent unit is shown all the same once it reports.
#[test]
fn absent_unit_is_not_called_silent() {
    let mut bench = Bench::awaiting(&[UnitId::B]);
    bench.pass(Span::s(1));
    let shown = bench.console.shown(bench.now);
    assert_eq!((shown.silent, shown.units.len()), (vec![UnitId::B], 0));
    let report = bench.next(Mode::Ready);
    bench.heard(&report, Span::ms(20));
    let shown = bench.console.shown(bench.now);
    assert_eq!(shown.silent, [UnitId::B]);
    assert_eq!(shown.units.iter().map(|unit| unit.unit).collect::<Vec<_>>(), [UnitId::A]);
}

#[test]
fn a_busy_host_is_named_for_ten_seconds() {
    let mut bench = Bench::new(Policy::default(), vec![]);
    bench.pass(Span::s(1));
    bench.give(&Input::HostWait { wait: Span::ms(163) });
    bench.pass(Span::s(9));
    let named = |bench: &Bench| {
        (bench.texts.last().unwrap().contains("HOST BUSY"), bench.pictures.last().unwrap()["host_wait_ms"].clone())
    };
    assert_eq!(named(&bench), (true, 163.into()));
    bench.pass(Span::s(2));
    assert_eq!(named(&bench), (false, serde_json::Value::Null));
}

/// Another's report is never shown as the unit's own, nor its own as another's.
#[test]
fn reports_of_another_session_are_never_confused() {
    for (via, origin) in [(PeerId::UNIT_A, Origin::Direct), (PeerId::UNIT_C, Origin::Relayed(PeerId::UNIT_C))] {
        let mut bench = Bench::new(Policy::default(), vec![]);
        let report = bench.next(Mode::Ready);
        let signed = sign(report.origin, &report);
        let (received, age) = (bench.now, Some(Span::ms(20)));
        let waived = Waived::default();
        let brought = AcceptedReport { via, unit: UnitId::A, received, age, waived, report: signed[..].into() };
        bench.feed(&Feed::Accepted(brought));
        let shown = bench.console.shown(bench.now);
        assert_eq!(shown.units.iter().map(|unit| unit.origin).collect::<Vec<_>>(), [origin]);
    }
}

/// Labels go from fresh to late to stale to lost at their limits.
#[test]
fn silent_unit_ages_through_every_label() {
    let mut bench = Bench::new(Policy::default(), vec![]);
    let report = bench.next(Mode::Ready);
    bench.heard(&report, Span::ms(20));
    let heard = bench.now;
    bench.pass(Span::s(3));
    let mut labels: Vec<(Freshness, Span)> = Vec::new();
    for (at, freshness, age) in bench.displayed() {
        assert_eq!(age, at.since(heard) + Span::ms(20));
        if labels.last().is_none_or(|(last, _)| *last != freshness) {
            labels.push((freshness, at.since(heard)));
        }
    }
    let over_limit = |ms: u64| Span::ms(ms - 20) + Span(1);
    let expected = [
        (Freshness::Fresh, Span::ZERO),
        (Freshness::Late, over_limit(300)),
        (Freshness::Stale, over_limit(500)),
        (Freshness::Lost, over_limit(2000)),
    ];
    assert_eq!(labels, expected);
}

#[test]
fn display_is_reported_at_least_every_200_ms() {
    let mut bench = Bench::new(Policy::default(), vec![]);
    bench.reports(Mode::Ready, Span::s(3));
    let displayed = bench.displayed();
    assert!(displayed.windows(2).all(|pair| pair[1].0.since(pair[0].0) <= Span::ms(200)));
    assert!(displayed.iter().all(|(_, freshness, _)| *freshness == Freshness::Fresh));
    assert!(displayed.len() < 40, "{}", displayed.len());
}

/// A restart takes none back.
#[test]
fn lost_sessions_show_their_owners_count() {
    let mut bench = Bench::new(Policy::default(), vec![]);
    let heard = |bench: &mut Bench, boot: u32, sessions_lost: u32| {
        bench.pass(Span::ms(100));
        let report = bench.next(Mode::Ready);
        bench.heard(&Report { boot: Boot(boot), sessions_lost, ..report }, Span::ms(20));
        bench.console.shown(bench.now).losses
    };
    assert_eq!(heard(&mut bench, 1, 0), []);
    assert_eq!(heard(&mut bench, 1, 2), [(PeerId::UNIT_A, 2)]);
    assert_eq!(heard(&mut bench, 2, 0), [(PeerId::UNIT_A, 2)]);
    assert_eq!(heard(&mut bench, 2, 1), [(PeerId::UNIT_A, 3)]);
    assert_eq!(heard(&mut bench, 3, 1), [(PeerId::UNIT_A, 4)], "the first of another boot is not the one before");
    bench.feed(&Feed::SessionsLost(1));
    bench.feed(&Feed::SessionsLost(1));
    let shown = bench.console.shown(bench.now);
    assert_eq!(shown.losses, [(PeerId::UNIT_A, 4), (PeerId::GATEWAY, 1)]);
    assert!(console::text::lines(&shown).contains("ALARM    unit-a LOST its command session 4 times"));
    let displayed = bench.events.iter().filter_map(|(_, event)| match event {
        Event::LossesShown { peer, times } => Some((*peer, *times)),
        _ => None,
    });
    assert_eq!(
        displayed.collect::<Vec<_>>(),
        [(PeerId::UNIT_A, 2), (PeerId::UNIT_A, 3), (PeerId::UNIT_A, 4), (PeerId::GATEWAY, 1)]
    );
}

#[test]
fn mode_is_reported_as_soon_as_shown() {
    let mut bench = Bench::new(Policy::default(), vec![]);
    bench.reports(Mode::Ready, Span::ms(300));
    let report = bench.next(Mode::HoldSafe);
    bench.heard(&report, Span::ms(20));
    let (time, event) = *bench.events.last().unwrap();
    assert!(matches!(event, Event::Displayed { mode: Mode::HoldSafe, .. }), "{event:?}");
    assert_eq!(time, bench.now);
    let shown = bench.console.shown(bench.now);
    assert_eq!(shown.units[0].since, bench.now);
}

#[test]
fn what_the_gateway_says_is_checked_again() {
    let mut bench = Bench::new(Policy::default(), vec![]);
    let now = bench.now;
    let good = bench.with_challenge(report(1, now.0, Mode::Ready));
    let unwatched = report(1, now.0, Mode::Ready);
    let cases = [
        (Reason::NoEcho, sign(NodeId::UNIT_A, &unwatched), UnitId::A, Some(Span::ms(1))),
        (Reason::Signature, sign(NodeId::UNIT_B, &good), UnitId::A, Some(Span::ms(1))),
        (Reason::Unit, sign(NodeId::UNIT_A, &good), UnitId::B, Some(Span::ms(1))),
        (Reason::Stale, sign(NodeId::UNIT_A, &good), UnitId::A, Some(Span::ms(2001))),
        (Reason::NoEcho, sign(NodeId::UNIT_A, &good), UnitId::A, None),
        (Reason::Schema, vec![0xff; 50], UnitId::A, Some(Span::ms(1))),
    ];
    for (reason, signed, unit, age) in cases {
        bench.heard_as(&signed, unit, age, now);
        assert_eq!(bench.refusals().pop(), Some(reason));
    }
    let mut forged = bench.gateway.clone();
    let mut bytes = forged.seal(now, &wire::codec::encode(&Feed::Session(PeerId::UNIT_A, true)));
    *bytes.last_mut().unwrap() ^= 1;
    bench.give(&wire::core::Input::Bus { topic: wire::core::Topic::Feed, bytes });
    assert_eq!(bench.refusals().pop(), Some(Reason::Tag));
    assert!(bench.console.shown(now).units.is_empty());
    assert!(bench.displayed().is_empty());
}

#[test]
fn gateway_can_only_make_reports_older() {
    let mut bench = Bench::new(Policy::default(), vec![]);
    let report = bench.next(Mode::Ready);
    bench.pass(Span::ms(800));
    bench.heard(&report, Span::ZERO);
    let (_, freshness, age) = *bench.displayed().last().unwrap();
    assert_eq!(freshness, Freshness::Stale);
    assert!(age >= Span::ms(800) && age < Span::ms(801), "{age}");
    let young = bench.next(Mode::Ready);
    bench.heard(&young, Span::ms(400));
    assert_eq!(bench.displayed().last().unwrap().1, Freshness::Late, "what the gateway says makes it older");
}

#[test]
fn an_echo_under_another_signature_lowers_no_age() {
    let mut bench = Bench::new(Policy::default(), vec![]);
    bench.pass(Span::ms(500));
    let echo = bench.watched.unwrap();
    // As if the challenge had been seen half a second before it was made: every later stamp would look younger.
    let early = Echo { seen: PeerStamp(echo.seen.0 - 500_000), ..echo };
    let forged = Report { watched: Some(early), stamp: echo.seen, ..bench.next(Mode::Ready) };
    bench.heard_as(&sign(NodeId::UNIT_B, &forged), UnitId::A, Some(Span::ZERO), bench.now);
    assert_eq!(bench.refusals().pop(), Some(Reason::Signature));
    let report = bench.next(Mode::Ready);
    bench.pass(Span::ms(400));
    bench.heard(&report, Span::ZERO);
    let (_, freshness, age) = *bench.displayed().last().unwrap();
    assert_eq!(freshness, Freshness::Late, "{age}");
}

/// The fault that the paper describes: an old picture without a sign of its age.
#[test]
fn waived_ageing_keeps_an_old_picture_fresh() {
    let waived = [(DisplayRule::AgeOut, Requirement::Waived)];
    let policy = Policy { name: "no-age-out".into(), display: waived.into_iter().collect(), ..Policy::default() };
    let mut bench = Bench::new(policy, vec![]);
    bench.reports(Mode::Ready, Span::ms(100));
    bench.pass(Span::s(10));
    let (_, freshness, age) = *bench.displayed().last().unwrap();
    assert_eq!((freshness, age), (Freshness::Fresh, Span::ms(20)));
    assert!(bench.texts.last().unwrap().starts_with("ABLATION"));
}

/// No control characters; one with each report, and at most twenty a second.
#[test]
fn text_is_plain_and_rate_limited() {
    let mut bench = Bench::new(Policy::default(), vec![]);
    bench.feed(&Feed::Refused(Reason::Stale, Some(PeerId::UNIT_B), 1));
    bench.feed(&Feed::Session(PeerId::UNIT_A, true));
    bench.reports(Mode::Ready, Span::s(2));
    assert!((20..=41).contains(&bench.texts.len()), "{}", bench.texts.len());
    assert!(bench.texts.iter().flat_map(|text| text.chars()).all(|c| c == '\n' || !c.is_control()));
    let last = bench.texts.last().unwrap();
    for word in ["unit-a   READY", "stale 1", "unit-a up", "unit-b   nothing received", "vehicle"] {
        assert!(last.contains(word), "no `{word}` in\n{last}");
    }
}

#[test]
fn json_values_carry_freshness_and_age() {
    let mut bench = Bench::seating(Role::View);
    bench.reports(Mode::Ready, Span::s(1));
    let unit = |bench: &Bench| bench.pictures.last().unwrap()["units"][0].clone();
    let value = unit(&bench);
    for part in ["state", "place"] {
        assert_eq!(value[part]["freshness"], "fresh", "{part}");
    }
    assert_eq!((&value["state"]["value"]["mode"], &value["tracks"][0]["value"]["id"]), (&"READY".into(), &4.into()));
    bench.pass(Span::s(5));
    let value = unit(&bench);
    for part in [&value["state"], &value["place"], &value["tracks"][0]] {
        assert!(part["freshness"] == "LOST" && part["age_ms"].as_u64() >= Some(4_800), "{part}");
    }
    assert_eq!(bench.pictures.len(), bench.texts.len());
}

#[test]
fn a_fork_goes_on_as_the_original_does() {
    let mut bench = Bench::new(Policy::default(), vec![]);
    bench.reports(Mode::Ready, Span::ms(300));
    let mut fork = bench.console.clone();
    for _ in 0..20 {
        let time = bench.console.deadline().unwrap();
        assert_eq!(fork.deadline(), Some(time));
        bench.console.handle(time, &wire::core::Input::Timeout);
        fork.handle(time, &wire::core::Input::Timeout);
        while let Some(output) = bench.console.output() {
            assert_eq!(fork.output(), Some(output));
        }
    }
}

/// A step of the network against the display.
#[derive(Clone, Debug)]
enum Move {
    /// Silence for so long, ms.
    Gap(u64),
    /// The next report comes; it is so old, ms, and its stamp is off by this much, µs.
    Next { age: u64, stamp: i64 },
    /// An earlier report comes again, with an age that would make it look young.
    Again { back: usize },
}

fn moves() -> impl Strategy<Value = Vec<Move>> {
    let one = prop_oneof![
        (0u64..900).prop_map(Move::Gap),
        (0u64..300, -5_000_000i64..5_000_000).prop_map(|(age, stamp)| Move::Next { age, stamp }),
        (0u64..300).prop_map(|age| Move::Next { age, stamp: 0 }),
        (0usize..6).prop_map(|back| Move::Again { back }),
    ];
    prop::collection::vec(one, 1..60)
}

/// The reference: claimed send time of each report, and required label of an age.
#[derive(Default)]
struct Reference {
    /// Each report's signed bytes, the latest instant at which its content can have been true, and whether it was
    /// accepted.
    told: Vec<(Vec<u8>, Instant, bool)>,
}

pub(crate) fn label(age: Span) -> Freshness {
    match age.0 {
        0..=300_000 => Freshness::Fresh,
        300_001..=500_000 => Freshness::Late,
        500_001..=2_000_000 => Freshness::Stale,
        _ => Freshness::Lost,
    }
}

/// Feeds the report of A, said to be so old; whether it was accepted.
fn hear(bench: &mut Bench, signed: &[u8], age: Span) -> bool {
    let refused = bench.refusals().len();
    bench.heard_as(signed, UnitId::A, Some(age), bench.now);
    bench.refusals().len() == refused
}

impl Reference {
    /// A shown value is at least as old as the report behind it, and labelled for that age.
    fn check(&self, bench: &Bench) -> Result<(), TestCaseError> {
        let shown = bench.console.shown(bench.now);
        let Some(unit) = shown.units.first() else { return Ok(()) };
        let (_, made, _) = &self.told[unit.report.sequence.0 as usize - 1];
        let least = bench.now.since(*made);
        prop_assert!(unit.state.age() >= least, "shown {} where it is {least} old", unit.state.age());
        prop_assert_eq!(unit.state.freshness(), label(unit.state.age()));
        for track in &unit.tracks {
            prop_assert!(track.age() >= least + Span::ms(50));
            prop_assert_eq!(track.freshness(), label(track.age()));
        }
        prop_assert!(unit.pose.age() >= least + Span::ms(10));
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// No replay and no stamp makes a value younger.
    #[test]
    fn labels_are_never_too_fresh(moves in moves()) {
        let mut bench = Bench::new(Policy::default(), vec![]);
        let mut reference = Reference::default();
        let mut clock = bench.now.0 as i64;
        for one in moves {
            let before = bench.console.shown(bench.now).units.first().map(|unit| (unit.report, unit.state.age()));
            match one {
                Move::Gap(ms) => bench.pass(Span::ms(ms)),
                Move::Next { age, stamp } => {
                    clock = (bench.now.0 as i64 + stamp).max(1);
                    let sequence = reference.told.len() as u64 + 1;
                    let signed = sign(NodeId::UNIT_A, &bench.with_challenge(report(sequence, clock as u64, Mode::Ready)));
                    let made = (bench.now - Span::ms(age)).max(Instant(clock as u64));
                    let accepted = hear(&mut bench, &signed, Span::ms(age));
                    reference.told.push((signed, made, accepted));
                }
                Move::Again { back } => {
                    let Some((signed, _, heard)) = reference.told.iter_mut().rev().nth(back) else { continue };
                    let accepted = hear(&mut bench, &signed.clone(), Span::ZERO);
                    prop_assert!(!(accepted && *heard), "accepted twice");
                    *heard |= accepted;
                    // What was refused, its stamp lying ahead, is no replay once its time has come.
                    if !accepted {
                        let shown = bench.console.shown(bench.now);
                        let after = shown.units.first().map(|unit| (unit.report, unit.state.age()));
                        prop_assert_eq!(before, after, "a replay changed the picture");
                    }
                }
            }
            reference.check(&bench)?;
        }
        // The oracle was informed of what was shown.
        for (_, freshness, age) in bench.displayed() {
            prop_assert_eq!(freshness, label(age));
        }
        prop_assert!(clock > 0);
    }
}
