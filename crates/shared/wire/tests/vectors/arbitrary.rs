//! Any bytes at all, and any report or session record at all.

use minicbor::bytes::ByteSlice;
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use wire::bus::{ChannelKey, HEADER_LEN, Sender};
use wire::codec;
use wire::command::{Confirmation, Intent};
use wire::core::Topic;
use wire::crop::{CAMERAS, Pictured};
use wire::event::Inconsistency;
use wire::id::{Boot, CommandId, NodeId, Nonce, PeerId, Sequence, TrackId, UnitId};
use wire::measured::Measured;
use wire::mode::{Cause, Guard, Guards, Mode};
use wire::motion::{Attitude, ReportedMotion};
use wire::policy::Policy;
use wire::refusal::Reason;
use wire::report::{MAX_REPORT, Report, ReportedAuthority, ReportedContact, ReportedTrack};
use wire::sensor::{Candidates, Class, Frames, Modalities, Navigation, Pose, ProductMode};
use wire::session::{MAX_SESSION_MESSAGE, SessionBody, SessionMessage, Teammate};
use wire::settings::{RANGES, Settings};
use wire::time::{AgeBound, Echo, Instant, PeerStamp, Span};
use wire::track::Tracks;
use wire::trust::{BusGate, Decoded, Received, SessionGate, SignedReport, SignedStatement, Window};

use crate::values;

/// Offers `bytes` to every way into the boundary; only a panic is an error here.
fn offer(bytes: &[u8]) {
    for (_, values) in values::all() {
        if let Some(value) = values.first() {
            let _ = (value.decode)(bytes, MAX_SESSION_MESSAGE);
        }
    }
    let (policy, now) = (Policy::default(), Instant(1_000_000));
    let _ = Received::new(now, bytes).frame(MAX_SESSION_MESSAGE);
    let _ = SignedReport::decode(now, bytes);
    let _ = Decoded::<Intent>::parse(now, bytes, MAX_REPORT);
    let _ = Decoded::<SignedStatement<'_, Confirmation>>::parse_statement(now, bytes);
    let mut gate = SessionGate {
        policy: &policy,
        peer: PeerId::UNIT_A,
        ages: &mut AgeBound::new(Span::s(3)),
        session: Nonce(1),
        window: &mut Window::new(32, 600),
        freshness: Span::ms(300),
        echo_limit: Span::s(3),
    };
    let _ = gate.admit(now, bytes);
    let gate = |topic| BusGate::new(topic, NodeId::SIM, ChannelKey([1; 32]), Span::ms(300));
    let _ = gate(Topic::Frames).admit::<Frames<'_>>(&policy, now, bytes);
    let _ = gate(Topic::Candidates).admit::<Candidates>(&policy, now, bytes);
    let _ = gate(Topic::Navigation).admit::<Navigation>(&policy, now, bytes);
    let _ = gate(Topic::Tracks).admit::<Tracks>(&policy, now, bytes);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn no_bytes_make_a_decoder_panic(bytes in vec(any::<u8>(), 0..512)) {
        offer(&bytes);
    }

    #[test]
    fn damaged_messages_never_panic_a_decoder(
        which in any::<prop::sample::Index>(),
        damage in vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let vectors: Vec<Vec<u8>> = values::all().into_iter().flat_map(|(_, v)| v).map(|v| v.bytes).collect();
        let mut bytes = which.get(&vectors).clone();
        for (at, byte) in damage {
            let position = at.index(bytes.len());
            bytes[position] = byte;
        }
        offer(&bytes);
        let mut sender = Sender::new(Topic::Tracks, NodeId::SIM, Boot(1), ChannelKey([1; 32]));
        let sealed = sender.seal(Instant(1_000_000), &bytes);
        prop_assert_eq!(&sealed[HEADER_LEN..HEADER_LEN + bytes.len()], &bytes[..]);
        offer(&sealed);
    }

    #[test]
    fn a_report_survives_its_encoding(report in report()) {
        let bytes = codec::encode(&report);
        prop_assert!(bytes.len() <= MAX_REPORT);
        prop_assert_eq!(codec::decode::<Report>(&bytes, MAX_REPORT), Ok(report));
    }

    #[test]
    fn a_session_record_survives_its_encoding(
        numbers in any::<[u64; 5]>(),
        boot in any::<u32>(),
        echo in option::of(any::<(u64, u64)>()),
        kind in 0..6u8,
        content in vec(any::<u8>(), 0..MAX_REPORT),
        peer in identity(),
    ) {
        let [session, sequence, stamp, challenge, extra] = numbers;
        let report: &ByteSlice = content.as_slice().into();
        let via = PeerId::from_name(peer.name()).expect("one set of names for both");
        let body = match kind {
            0 => SessionBody::Hello(Nonce(extra)),
            1 => SessionBody::Report(report),
            2 => SessionBody::Grant(Span(extra)),
            3 => SessionBody::Revoked(report),
            4 => SessionBody::Crop(report),
            _ => SessionBody::Teammate(Teammate { via, age: Span(extra), report }),
        };
        let echo = echo.map(|(nonce, seen)| Echo { nonce: Nonce(nonce), seen: PeerStamp(seen) });
        let outer = SessionMessage {
            version: 1,
            session: Nonce(session),
            boot: Boot(boot),
            sequence: Sequence(sequence),
            stamp: PeerStamp(stamp),
            challenge: Nonce(challenge),
            echo,
            body,
        };
        let bytes = codec::encode(&outer);
        prop_assert!(bytes.len() <= MAX_SESSION_MESSAGE, "{} bytes", bytes.len());
        prop_assert_eq!(codec::decode::<SessionMessage<'_>>(&bytes, MAX_SESSION_MESSAGE), Ok(outer));
    }
}

fn identity() -> impl Strategy<Value = NodeId> {
    prop::sample::select(NodeId::all().collect::<Vec<_>>())
}

fn guard() -> impl Strategy<Value = Guard> {
    prop::sample::select(Guard::ALL.to_vec())
}

fn cause() -> impl Strategy<Value = Cause> {
    prop_oneof![
        prop::sample::select(vec![Cause::Start, Cause::Operator, Cause::Recovered, Cause::Acted, Cause::Expired]),
        guard().prop_map(Cause::Lost),
        guard().prop_map(Cause::Unrecovered),
    ]
}

fn command() -> impl Strategy<Value = CommandId> {
    (identity(), any::<u32>(), any::<u64>()).prop_map(|(operator, boot, sequence)| CommandId {
        operator,
        boot: Boot(boot),
        sequence: Sequence(sequence),
    })
}

fn pose() -> impl Strategy<Value = Pose> {
    any::<(i32, i32, i16)>().prop_map(|(x_mm, y_mm, yaw_mrad)| Pose { x_mm, y_mm, yaw_mrad })
}

fn track() -> impl Strategy<Value = ReportedTrack> {
    let class = prop::sample::select(Class::ALL.to_vec());
    let place = any::<(u32, i32, i32)>();
    let evidence = any::<(u16, u8, u64, u8, u16, u16)>();
    (place, class, evidence).prop_map(|((id, x_mm, y_mm), class, nearest)| {
        let (confidence, supported, age, contradicted, bearings_mrad, across_px) = nearest;
        ReportedTrack {
            id: TrackId(id),
            class,
            x_mm,
            y_mm,
            confidence,
            supported: Modalities(supported),
            age: Span(age),
            contradicted: Modalities(contradicted),
            bearings_mrad,
            across_px,
        }
    })
}

/// Any value for any guard.
fn measured(seed: u32, value: i32) -> Measured {
    let some = |at: usize| (seed >> at & 1 == 1).then_some(value.rotate_left(at as u32));
    let measured =
        Guard::ALL.iter().enumerate().fold(Measured::default(), |m, (index, guard)| m.with_value(*guard, some(index)));
    measured.claimed((seed & 1 << 20 != 0).then_some((UnitId::C, Inconsistency::Exclusion)))
}

/// None, or values all over their ranges.
fn settings(seed: u32) -> Option<Settings> {
    let key_of = |k: usize| {
        let range = &RANGES[k];
        range.start() + (seed >> (7 * k)) as u16 % (range.end() - range.start() + 1)
    };
    let (speed_mm_s, margin_mm, arm_permille, keep_permille) = (key_of(0), key_of(1), key_of(2), key_of(3));
    seed.is_multiple_of(2).then_some(Settings { speed_mm_s, margin_mm, arm_permille, keep_permille })
}

/// None, or any numbers.
fn motion(up: u64, velocity: i32, charge: u16) -> Option<ReportedMotion> {
    let left_up_mm_s = [velocity, velocity.rotate_left(16)];
    let attitude = charge.is_multiple_of(2).then_some(Attitude([velocity; 4]));
    let sunlit = charge.is_multiple_of(3).then_some(velocity > 0);
    up.is_multiple_of(2).then_some(ReportedMotion { up_mm: up.cast_signed(), left_up_mm_s, charge, attitude, sunlit })
}

fn report() -> impl Strategy<Value = Report> {
    let product = prop::sample::select(vec![ProductMode::Live, ProductMode::Synthetic, ProductMode::Replay]);
    let state = (product, prop::sample::select(Mode::ALL.to_vec()), cause(), any::<u16>());
    let authority = option::of(any::<(u32, u64)>());
    let last = option::of((command(), option::of(prop::sample::select(Reason::ALL.to_vec()))));
    let numbers = any::<(u32, u64, u64, i32, u64, u64, u16)>();
    (identity(), numbers, state, pose(), authority, last, vec(track(), 0..=8)).prop_map(
        |(origin, (boot, sequence, stamp, speed_mm_s, age, nonce, progress), state, pose, authority, last, tracks)| {
            let (product, mode, cause, failing) = state;
            Report {
                origin,
                boot: Boot(boot),
                sequence: Sequence(sequence),
                stamp: PeerStamp(stamp),
                product,
                mode,
                cause,
                failing: Guards(failing),
                pose,
                speed_mm_s,
                pose_age: Span(age),
                authority: authority.map(|(track, left)| ReportedAuthority { track: TrackId(track), left: Span(left) }),
                command_nonce: Nonce(nonce),
                last_command: last,
                progress,
                tracks: tracks.into_iter().collect(),
                watched: (sequence % 2 == 0)
                    .then_some(wire::time::Echo { nonce: Nonce(nonce), seen: PeerStamp(sequence) }),
                sessions_lost: boot,
                measured: measured(boot, speed_mm_s),
                settings: settings(boot),
                motion: motion(stamp, speed_mm_s, progress),
                contact: sequence.is_multiple_of(3).then_some(ReportedContact {
                    left: Span(age),
                    next: sequence.is_multiple_of(2).then_some(Span(nonce)),
                }),
                pictured: sequence.is_multiple_of(2).then(|| Pictured {
                    track: TrackId(boot),
                    age: Span(age),
                    crops: [[progress as u8; 32].into(); CAMERAS].into_iter().collect(),
                }),
            }
        },
    )
}
