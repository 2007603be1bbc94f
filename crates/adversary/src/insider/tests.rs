//! The insiders as attacks, judged at the receiver by `wire::trust`.

use ground_truth::{Action, Any, Note};
use wire::codec;
use wire::core::{Input, Output};
use wire::event::wire_hash;
use wire::id::{Boot, NodeId, Nonce, PeerId, RecordId, Sequence, SessionId};
use wire::policy::Policy;
use wire::refusal::{Reason, Refusal};
use wire::report::{MAX_REPORT, Report};
use wire::sensor::Pose;
use wire::session::{MAX_SESSION_MESSAGE, SESSION_VERSION, SessionBody, SessionMessage, Teammate};
use wire::sign::{Key, Keyring, Purpose, Signed};
use wire::time::{AgeBound, PeerStamp, Span};
use wire::trust::{SessionGate, SignedReport, Window};

use super::InsiderTeammate;
use crate::plan::{ClaimedMotion, Flaw, Form, Forward, InsiderTeammateConfig, Malformed};
use crate::testing::{at_ms, setup, times, turn};

const UP: SessionId = SessionId(1);
const DOWN: SessionId = SessionId(2);
/// The session nonce that the gateway (or C) announces.
const THEIRS: Nonce = Nonce(77);

#[test]
fn session_records_of_the_insider_are_accepted() {
    let mut insider = teammate([]);
    let mut ages = AgeBound::new(Span::s(3));
    let mut window = Window::new(32, 600);
    ages.issue(Nonce(5), at_ms(0));
    open(&mut insider, UP, PeerId::GATEWAY);
    let mut accepted = 0;
    for ms in (100..1100).step_by(100) {
        for bytes in records(turn(&mut insider, at_ms(ms), &Input::Timeout, &mut Vec::new()), UP) {
            let mut gate = SessionGate {
                policy: &Policy::default(),
                peer: PeerId::UNIT_B,
                ages: &mut ages,
                session: THEIRS,
                window: &mut window,
                freshness: Span::ms(300),
                echo_limit: Span::s(3),
            };
            let (exchange, verdict) = gate.admit(at_ms(ms), &bytes);
            let outer = verdict.unwrap().message().outer;
            accepted += u32::from(matches!(outer.body, SessionBody::Report(_)));
            assert!(exchange.unwrap().echo.is_some());
        }
    }
    assert_eq!(accepted, 10);
}

#[test]
fn verbatim_forward_names_c_and_verifies() {
    let report = forwarded(Form::Verbatim);
    let policy = Policy::default();
    let decoded = SignedReport::decode(at_ms(0), &report).unwrap();
    assert_eq!(decoded.claim().0, NodeId::UNIT_C);
    let fresh = decoded.fresh(&policy, Some(wire::time::Age::on_one_host(at_ms(0), at_ms(0))), Span::ms(1), Span::ZERO);
    let verdict = fresh.unwrap().by_origin(&policy, PeerId::UNIT_B, &ring());
    let refusal = verdict.err().unwrap();
    assert_eq!(refusal, Refusal::Origin { peer: PeerId::UNIT_B, origin: NodeId::UNIT_C });
    let signed = Signed::parse(&report, MAX_REPORT).unwrap();
    assert_eq!(ring().verify(NodeId::UNIT_C, Purpose::Report, &signed), Ok(()));
}

#[test]
fn relabelled_forward_names_b_and_never_verifies() {
    let report = forwarded(Form::Relabelled);
    let signed = Signed::parse(&report, MAX_REPORT).unwrap();
    let read: Report = codec::decode(signed.payload, MAX_REPORT).unwrap();
    assert_eq!((read.origin, read.pose.x_mm), (NodeId::UNIT_B, 9000));
    for signer in [NodeId::UNIT_B, NodeId::UNIT_C] {
        assert_eq!(ring().verify(signer, Purpose::Report, &signed), Err(Refusal::Signature { signer }));
    }
}

#[test]
fn a_re_signed_forward_passes_every_cryptographic_check() {
    let report = forwarded(Form::ReSigned);
    let signed = Signed::parse(&report, MAX_REPORT).unwrap();
    let read: Report = codec::decode(signed.payload, MAX_REPORT).unwrap();
    assert_eq!((read.origin, read.boot, read.pose.x_mm), (NodeId::UNIT_B, Boot(1), 9000));
    assert!(read.sequence.0 > 0 && read.stamp == at_ms(1000).stamp());
    assert_eq!(ring().verify(NodeId::UNIT_B, Purpose::Report, &signed), Ok(()));
}

#[test]
fn drawn_away_c_is_supervised_and_forwarded() {
    let mut insider = teammate([forward(Form::Verbatim)]);
    open(&mut insider, UP, PeerId::GATEWAY);
    open(&mut insider, DOWN, PeerId::UNIT_C);
    let mut events = Vec::new();
    let granted = records(turn(&mut insider, at_ms(100), &Input::Timeout, &mut events), DOWN);
    let lease = Span::ms(500);
    let is_grant = |bytes: &Vec<u8>| body(bytes, |body| matches!(body, SessionBody::Grant(span) if span == lease));
    assert!(granted.iter().any(is_grant), "{granted:?}");
    let report = report_of_c();
    let record = session_message(SessionBody::Report(report.as_slice().into()));
    let out = turn(&mut insider, at_ms(1000), &Input::Record { session: DOWN, bytes: record }, &mut events);
    let is_it = |bytes: &Vec<u8>| body(bytes, |body| matches!(body, SessionBody::Report(got) if got[..] == report[..]));
    assert!(records(out, UP).iter().any(is_it));
    assert_eq!(times(&events, Action::Forward), 1);
}

#[test]
fn b_is_honest_before_and_after_the_window() {
    let mut insider = teammate([Forward { own_reports: false, ..forward(Form::ReSigned) }]);
    open(&mut insider, UP, PeerId::GATEWAY);
    let reports = |insider: &mut InsiderTeammate, ms: u64| {
        let out = records(turn(insider, at_ms(ms), &Input::Timeout, &mut Vec::new()), UP);
        out.iter().filter(|bytes| body(bytes, |body| matches!(body, SessionBody::Report(_)))).count()
    };
    assert_eq!([100, 1100, 1200, 2100].map(|ms| reports(&mut insider, ms)), [1, 0, 0, 1]);
}

#[test]
fn two_forwardings_each_send_every_report() {
    let second = Forward { at_ms: 1500, lag_ms: 300, ..forward(Form::ReSigned) };
    let mut insider = teammate([forward(Form::Verbatim), second]);
    open(&mut insider, UP, PeerId::GATEWAY);
    open(&mut insider, DOWN, PeerId::UNIT_C);
    let mut events = Vec::new();
    let mut forwards = |ms: u64, input: &Input| {
        turn(&mut insider, at_ms(ms), input, &mut events);
        times(&events, Action::Forward)
    };
    let record = session_message(SessionBody::Report(report_of_c().as_slice().into()));
    let heard = Input::Record { session: DOWN, bytes: record };
    assert_eq!(
        [(1200, &heard), (1600, &heard), (1899, &Input::Timeout), (1900, &Input::Timeout)]
            .map(|(ms, input)| forwards(ms, input)),
        [1, 2, 2, 3]
    );
}

#[test]
fn broken_records_are_refused_for_their_flaw() {
    use Reason::{Canonical, Length, Schema};
    let flaws = [Flaw::Length, Flaw::Schema, Flaw::NonCanonical, Flaw::Range, Flaw::Count];
    let expected = [Length, Schema, Canonical, Schema, Schema];
    let run = Malformed { at_ms: 150, flaws: flaws.to_vec(), count: 5, every_ms: 0, step: None };
    let config = InsiderTeammateConfig { malformed: vec![run], ..InsiderTeammateConfig::default() };
    let mut insider = InsiderTeammate::new(setup(NodeId::INSIDER_B, 2), config, at_ms(0)).unwrap();
    open(&mut insider, UP, PeerId::GATEWAY);
    turn(&mut insider, at_ms(100), &Input::Timeout, &mut Vec::new());
    let mut events = Vec::new();
    let broken = records(turn(&mut insider, at_ms(150), &Input::Timeout, &mut events), UP);
    assert_eq!(times(&events, Action::Inject), 5);
    for ((bytes, expected), flaw) in broken.iter().zip(expected).zip(flaws) {
        let outer = codec::decode::<SessionMessage<'_>>(bytes, MAX_SESSION_MESSAGE).map_err(Refusal::from);
        let reason = match outer {
            Err(refusal) => refusal.reason(),
            Ok(SessionMessage { body: SessionBody::Report(report), .. }) => {
                SignedReport::decode(at_ms(0), report).err().unwrap().reason()
            }
            Ok(other) => panic!("{other:?}"),
        };
        assert_eq!(reason, expected, "{flaw:?}");
    }
}

#[test]
fn flawed_record_differs_in_its_flaw_alone() {
    let flaws = [Flaw::Session, Flaw::Version, Flaw::Origin, Flaw::Jump];
    let run = Malformed { at_ms: 150, flaws: flaws.to_vec(), count: 4, every_ms: 0, step: None };
    let config = InsiderTeammateConfig { malformed: vec![run], ..InsiderTeammateConfig::default() };
    let mut insider = InsiderTeammate::new(setup(NodeId::INSIDER_B, 2), config, at_ms(0)).unwrap();
    open(&mut insider, UP, PeerId::GATEWAY);
    turn(&mut insider, at_ms(100), &Input::Timeout, &mut Vec::new());
    let mut last = None;
    for (bytes, flaw) in records(turn(&mut insider, at_ms(150), &Input::Timeout, &mut Vec::new()), UP).iter().zip(flaws)
    {
        let outer = codec::decode::<SessionMessage<'_>>(bytes, MAX_SESSION_MESSAGE).unwrap();
        let SessionBody::Report(report) = outer.body else { panic!("{outer:?}") };
        let (origin, _) = SignedReport::decode(at_ms(150), report).unwrap().claim();
        let jumped = last.is_some_and(|last: Sequence| outer.sequence.0 > last.0 + 1);
        last = Some(outer.sequence);
        let deviations = [outer.session != THEIRS, outer.version != SESSION_VERSION, origin != NodeId::UNIT_B, jumped];
        assert_eq!(deviations, [0, 1, 2, 3].map(|i| flaws[i] == flaw), "{flaw:?}");
    }
}

fn teammate(forwards: impl Into<Vec<Forward>>) -> InsiderTeammate {
    let place = ClaimedMotion { x_mm: 1000, y_mm: 2000, vx_mm_s: 300, vy_mm_s: -400 };
    let config = InsiderTeammateConfig { place, forwards: forwards.into(), ..InsiderTeammateConfig::default() };
    InsiderTeammate::new(setup(NodeId::INSIDER_B, 2), config, at_ms(0)).unwrap()
}

fn forward(form: Form) -> Forward {
    Forward { form, at_ms: 1000, duration_ms: 1000, lag_ms: 0, own_reports: true, step: None }
}

/// Opens a session and says hello to the insider in it.
fn open(insider: &mut InsiderTeammate, session: SessionId, peer: PeerId) {
    turn(insider, at_ms(0), &Input::Opened { session, peer }, &mut Vec::new());
    turn(
        insider,
        at_ms(0),
        &Input::Record { session, bytes: session_message(SessionBody::Hello(THEIRS)) },
        &mut Vec::new(),
    );
}

/// C's report as the insider forwards it when it hears it through the gateway.
fn forwarded(form: Form) -> Vec<u8> {
    let mut insider = teammate([Forward { own_reports: false, ..forward(form) }]);
    open(&mut insider, UP, PeerId::GATEWAY);
    turn(&mut insider, at_ms(990), &Input::Timeout, &mut Vec::new());
    let report = report_of_c();
    let envelope = Teammate { via: PeerId::UNIT_C, age: Span::ms(20), report: report.as_slice().into() };
    let mut events = Vec::new();
    let record = Input::Record { session: UP, bytes: session_message(SessionBody::Teammate(envelope)) };
    let out = records(turn(&mut insider, at_ms(1000), &record, &mut events), UP);
    let mut reports = out.iter().filter_map(|bytes| {
        match codec::decode::<SessionMessage<'_>>(bytes, MAX_SESSION_MESSAGE).unwrap().body {
            SessionBody::Report(report) => Some((wire_hash(bytes), report.to_vec())),
            SessionBody::Hello(_)
            | SessionBody::Grant(_)
            | SessionBody::Teammate(_)
            | SessionBody::Watch(_)
            | SessionBody::Crop(_)
            | SessionBody::Revoked(_) => None,
        }
    });
    let (record, forwarded) = reports.next().unwrap();
    let is_attack = |event: &Any| matches!(event, Any::Instrument(Note::Attack { hash, .. }) if *hash == record);
    assert!(events.iter().any(is_attack), "told by the hash of the very record");
    forwarded
}

fn report_of_c() -> Vec<u8> {
    let report = Report {
        pose: Pose { x_mm: 9000, y_mm: -4000, yaw_mrad: 100 },
        speed_mm_s: 700,
        pose_age: Span::ms(10),
        command_nonce: Nonce(1),
        progress: 10,
        ..Report::bare(RecordId { node: NodeId::UNIT_C, boot: Boot(4), sequence: Sequence(31) }, PeerStamp(123_456))
    };
    key(3).sign(Purpose::Report, &codec::encode(&report))
}

fn key(secret: u8) -> Key {
    Key::from_bytes(&[secret; 32])
}

fn ring() -> Keyring {
    let mut ring = Keyring::default();
    assert!(ring.insert(NodeId::UNIT_B, &key(2).public()) && ring.insert(NodeId::UNIT_C, &key(3).public()));
    ring
}

/// A record of the other end.
fn session_message(body: SessionBody<'_>) -> Vec<u8> {
    codec::encode(&SessionMessage {
        version: SESSION_VERSION,
        session: Nonce(0),
        boot: Boot(1),
        sequence: Sequence(1),
        stamp: PeerStamp(0),
        challenge: Nonce(5),
        echo: None,
        body,
    })
}

fn body(bytes: &[u8], judge: impl Fn(SessionBody<'_>) -> bool) -> bool {
    judge(codec::decode::<SessionMessage<'_>>(bytes, MAX_SESSION_MESSAGE).unwrap().body)
}

fn records(out: Vec<Output>, of: SessionId) -> Vec<Vec<u8>> {
    let bytes = |output| {
        if let Output::Record { session, bytes } = output { (session == of).then_some(bytes) } else { None }
    };
    out.into_iter().filter_map(bytes).collect()
}
