//! Reports under B's key: B's own, and C's in the form in which the insider forwards them.
//!
//! All of them share B's one sequence and B's key. The time and the receiver are left to `teammate`.

use wire::codec;
use wire::id::{Boot, NodeId, Nonce, RecordId, Sequence};
use wire::mode::Mode;
use wire::report::{MAX_REPORT, Report};
use wire::sensor::Pose;
use wire::sign::{Key, Purpose, Signed};
use wire::time::{Echo, Instant, Span};

use crate::plan::{ClaimedMotion, Form};

/// Age of the claimed localisation in B's own reports.
const POSE_AGE: Span = Span::ms(20);

/// Key, boot and sequence under which the reports are made.
#[derive(Clone, Debug)]
pub(super) struct Voice {
    pub(super) key: Key,
    origin: Instant,
    place: ClaimedMotion,
    boot: Boot,
    sequence: Sequence,
}

impl Voice {
    /// B's voice under `key`, standing at `place` at `now`.
    pub(super) fn new(key: Key, boot: Boot, place: ClaimedMotion, now: Instant) -> Self {
        Self { key, origin: now, place, boot, sequence: Sequence(0) }
    }

    /// C's signed report in the form in which it is forwarded; `None` when it is unreadable.
    pub(super) fn in_form(
        &mut self,
        now: Instant,
        form: Form,
        their_bytes: &[u8],
        watched: Option<Echo>,
    ) -> Option<Vec<u8>> {
        match form {
            Form::Verbatim => Some(their_bytes.to_vec()),
            Form::Relabelled => {
                let payload = self.as_ours(now, their_bytes, watched)?;
                Some(under_signature(&payload, their_bytes.last_chunk::<64>()?))
            }
            Form::ReSigned => {
                let payload = self.as_ours(now, their_bytes, watched)?;
                Some(self.key.sign(Purpose::Report, &payload))
            }
        }
    }

    /// The content of C's report under B's name, boot, sequence and stamp.
    fn as_ours(&mut self, now: Instant, their_bytes: &[u8], watched: Option<Echo>) -> Option<Vec<u8>> {
        let signed = Signed::parse(their_bytes, MAX_REPORT).ok()?;
        let mut report: Report = codec::decode(signed.payload, MAX_REPORT).ok()?;
        self.sequence = self.sequence.next();
        report.origin = NodeId::UNIT_B;
        report.boot = self.boot;
        report.sequence = self.sequence;
        report.stamp = now.stamp();
        report.watched = watched;
        Some(codec::encode(&report))
    }

    /// Restarts B's counters under this boot.
    pub(super) fn restart(&mut self, boot: Boot) {
        (self.boot, self.sequence) = (boot, Sequence(0));
    }

    /// B's own report, true in everything.
    pub(super) fn own_report(&mut self, now: Instant, nonce: Nonce, watched: Option<Echo>) -> Report {
        self.sequence = self.sequence.next();
        Report {
            pose: pose(&self.place, now.since(self.origin)),
            speed_mm_s: speed(&self.place),
            pose_age: POSE_AGE,
            command_nonce: nonce,
            watched,
            ..Report::bare(RecordId { node: NodeId::UNIT_B, boot: self.boot, sequence: self.sequence }, now.stamp())
        }
    }
}

/// The mode in a signed report that the unit under test made; `None` for another's or an unreadable one.
pub(super) fn mode_in(signed: &[u8]) -> Option<Mode> {
    let signed = Signed::parse(signed, MAX_REPORT).ok()?;
    let report: Report = codec::decode(signed.payload, MAX_REPORT).ok()?;
    (report.origin == NodeId::UNIT_A).then_some(report.mode)
}

/// The identity of a signed report; `None` when it is unreadable.
pub(super) fn id(signed: &[u8]) -> Option<RecordId> {
    let signed = Signed::parse(signed, MAX_REPORT).ok()?;
    codec::decode::<Report>(signed.payload, MAX_REPORT).ok().map(|report| report.id())
}

/// Pose that B claims after `elapsed`.
fn pose(place: &ClaimedMotion, elapsed: Span) -> Pose {
    let along = |from: i32, per_s: i32| {
        let value = i64::from(from) + i64::from(per_s) * (elapsed.0 / 1000) as i64 / 1000;
        value.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    };
    let yaw = libm::atan2(f64::from(place.vy_mm_s), f64::from(place.vx_mm_s));
    Pose {
        x_mm: along(place.x_mm, place.vx_mm_s),
        y_mm: along(place.y_mm, place.vy_mm_s),
        yaw_mrad: (yaw * 1000.0) as i16,
    }
}

fn speed(place: &ClaimedMotion) -> i32 {
    libm::hypot(f64::from(place.vx_mm_s), f64::from(place.vy_mm_s)) as i32
}

/// A COSE_Sign1 of the one profile (`wire::sign`) with a signature that was made over something else.
pub(super) fn under_signature(payload: &[u8], signature: &[u8; 64]) -> Vec<u8> {
    let mut encoder = minicbor::Encoder::new(Vec::with_capacity(payload.len() + 80));
    let written = encoder
        .array(4)
        .and_then(|e| e.bytes(&[0xa1, 0x01, 0x27]))
        .and_then(|e| e.map(0))
        .and_then(|e| e.bytes(payload))
        .and_then(|e| e.bytes(signature))
        .map(|_| ());
    debug_assert!(written.is_ok(), "writing to a Vec cannot fail");
    encoder.into_writer()
}
