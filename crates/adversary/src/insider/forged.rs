//! Content that a rogue puts into a message of another producer. The layout is public (`wire::bus`,
//! `docs/reference/telemetry.cddl`); the right to send it is not decided here.

use wire::bus::{self, HEADER_LEN};
use wire::codec;
use wire::core::Topic;
use wire::drive::{Act, Drive};
use wire::id::{Boot, CommandId, FrameId, NodeId, Sequence, TrackId, WorldId};
use wire::sensor::{Class, Modalities, Modality, Navigation, ProductMode};
use wire::time::{Instant, Span};
use wire::track::{StageProduct, Track, Tracks};

use crate::plan::{Says, Spot};

/// Identity of a fabricated track: far above what a tracker gives in a run.
const FABRICATED: TrackId = TrackId(900_000);
/// Time between two frames.
const FRAME: Span = Span::ms(100);

/// The newest genuine message of a channel, and when it was heard.
#[derive(Clone, Copy)]
pub(super) struct Heard<'a> {
    pub(super) at: Instant,
    pub(super) bytes: &'a [u8],
}

/// The boot that a message says it is of.
pub(super) fn boot(bytes: &[u8]) -> Boot {
    let field = bytes.get(2..6).and_then(|b| <[u8; 4]>::try_from(b).ok());
    Boot(field.map_or(0, u32::from_le_bytes))
}

/// A body for `topic` with the planned content at `now`; none where the content is made from a genuine message and none
/// was heard.
pub(super) fn body(now: Instant, topic: Topic, statement: Says, last: Option<Heard<'_>>) -> Option<Vec<u8>> {
    match statement {
        Says::Echo if topic == Topic::Act && last.is_none() => Some(act(now)),
        Says::Echo => echo(now, topic, last?.bytes),
        Says::Beat => {
            let tracks: Tracks = read(last?.bytes)?;
            Some(codec::encode(&Tracks { tracks: codec::List::default(), ..tracks }))
        }
        Says::Vehicle(spot) => Some(vehicle(now, ProductMode::Live, spot, last)),
        Says::Synthetic(spot) => Some(vehicle(now, ProductMode::Synthetic, spot, last)),
        Says::PlayedBack(spot) => Some(vehicle(now, ProductMode::Replay, spot, last)),
        Says::Elsewhere(spot) => {
            let mut reading: Navigation = read(last?.bytes)?;
            reading.stamp = now;
            if let Some(fix) = &mut reading.fix {
                fix.pose.x_mm = fix.pose.x_mm.saturating_add(spot.x_mm);
                fix.pose.y_mm = fix.pose.y_mm.saturating_add(spot.y_mm);
            }
            Some(codec::encode(&reading))
        }
        Says::Recorded { .. } | Says::Altered(_) | Says::Moved(_) => None,
    }
}

/// The genuine message that a rogue passes on, changed; none where it does not wait for one.
pub(super) fn passed_on(bytes: &[u8], statement: Says) -> Option<Vec<u8>> {
    match statement {
        Says::Altered(spot) => altered(bytes, spot),
        Says::Moved(spot) => moved(bytes, spot),
        Says::Echo
        | Says::Beat
        | Says::Vehicle(_)
        | Says::Synthetic(_)
        | Says::PlayedBack(_)
        | Says::Elsewhere(_)
        | Says::Recorded { .. } => None,
    }
}

/// A genuine tracks message with its vehicles at another place.
fn moved(bytes: &[u8], spot: Spot) -> Option<Vec<u8>> {
    let mut tracks: Tracks = read(bytes)?;
    for track in tracks.tracks.0.iter_mut().filter(|track| track.class == Class::Vehicle) {
        (track.x_mm, track.y_mm) = (spot.x_mm, spot.y_mm);
    }
    Some(codec::encode(&tracks))
}

/// A genuine tracks message with one vehicle that is not there, seen by every modality in that frame, in place of those
/// that are.
fn altered(bytes: &[u8], spot: Spot) -> Option<Vec<u8>> {
    let tracks: Tracks = read(bytes)?;
    let other_tracks = tracks.tracks.iter().copied().filter(|track| track.class != Class::Vehicle);
    let track = fabricated(tracks.stamp, tracks.frame, spot);
    Some(codec::encode(&Tracks { tracks: [track].into_iter().chain(other_tracks).collect(), ..tracks }))
}

/// The last body; where its kind has its own time, with that made new.
fn echo(now: Instant, topic: Topic, bytes: &[u8]) -> Option<Vec<u8>> {
    match topic {
        Topic::Navigation => read::<Navigation>(bytes).map(|m| codec::encode(&Navigation { stamp: now, ..m })),
        Topic::Drive => read::<Drive>(bytes).map(|m| codec::encode(&Drive { stamp: now, ..m })),
        Topic::Act => read::<Act>(bytes).map(|m| codec::encode(&Act { stamp: now, ..m })),
        Topic::Frames | Topic::Candidates | Topic::Tracks | Topic::Feed | Topic::Intents | Topic::Seals => {
            bus::body(bytes).map(<[u8]>::to_vec)
        }
    }
}

/// A picture with one vehicle, every stage at work, the frames counted on from the last one heard.
fn vehicle(now: Instant, mode: ProductMode, spot: Spot, last: Option<Heard<'_>>) -> Vec<u8> {
    let since = last.map_or(Span::ZERO, |heard| now.since(heard.at));
    let before = last.and_then(|heard| read::<Tracks>(heard.bytes)).map_or(0, |tracks| tracks.frame.0);
    let frame = FrameId(before + 1 + since.0 / FRAME.0);
    let product = Some(StageProduct { frame, stamp: now });
    let tracks = [fabricated(now, frame, spot)].into_iter().collect();
    let crops = codec::List::default();
    codec::encode(&Tracks { frame, stamp: now, mode, products: [product; 4], tracks, crops, nearby: None })
}

/// An act under the first authority of a run, for which no act was heard that could be said again.
fn act(now: Instant) -> Vec<u8> {
    let command = CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(2) };
    codec::encode(&Act { stamp: now, world: WorldId(0), authority: 1, track: TrackId(1), x_mm: 0, y_mm: 0, command })
}

fn fabricated(stamp: Instant, frame: FrameId, spot: Spot) -> Track {
    Track {
        id: FABRICATED,
        class: Class::Vehicle,
        x_mm: spot.x_mm,
        y_mm: spot.y_mm,
        vx_mm_s: 0,
        vy_mm_s: 0,
        sigma_mm: 50,
        confidence: 1000,
        supported: Modality::ALL.into_iter().fold(Modalities::default(), Modalities::with_modality),
        vetoed: Modalities::default(),
        updated: stamp,
        frame,
        across_px: 24,
    }
}

fn read<'b, M: minicbor::Decode<'b, ()>>(bytes: &'b [u8]) -> Option<M> {
    debug_assert!(HEADER_LEN < bytes.len(), "only what came over a channel is kept");
    minicbor::decode(bus::body(bytes)?).ok()
}
