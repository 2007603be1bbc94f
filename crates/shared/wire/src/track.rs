//! Corroborated tracks and their provenance, perception to autonomy.

use minicbor::{Decode, Encode};

use crate::codec::List;
use crate::crop::{CAMERAS, Crop};
use crate::id::{FrameId, TrackId};
use crate::sensor::{Class, Modalities, ProductMode};
use crate::time::Instant;

/// A track: an object that several frames and more than one modality agree on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Track {
    /// Identity within the tracker's boot.
    #[n(0)]
    pub id: TrackId,
    /// Class with the highest accumulated evidence.
    #[n(1)]
    pub class: Class,
    /// East, millimetres, world frame.
    #[n(2)]
    pub x_mm: i32,
    /// North, millimetres, world frame.
    #[n(3)]
    pub y_mm: i32,
    /// Velocity east, mm/s.
    #[n(4)]
    pub vx_mm_s: i32,
    /// Velocity north, mm/s.
    #[n(5)]
    pub vy_mm_s: i32,
    /// One standard deviation of position, millimetres.
    #[n(6)]
    pub sigma_mm: u16,
    /// Confidence in permille.
    #[n(7)]
    pub confidence: u16,
    /// Modalities that supported the track in one of its last five frames.
    #[n(8)]
    pub supported: Modalities,
    /// Modalities that contradicted it in three of its last five frames.
    #[n(9)]
    pub vetoed: Modalities,
    /// Stamp of the last frame that updated the track, on the vehicle host's clock.
    #[n(10)]
    pub updated: Instant,
    /// The frame of that update.
    #[n(11)]
    pub frame: FrameId,
    /// Pixels across the smaller side of that update's detection; zero without an image.
    #[n(12)]
    pub across_px: u16,
}

/// The newest product of one perception stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Encode, Decode)]
pub struct StageProduct {
    /// Frame of the newest product.
    #[n(0)]
    pub frame: FrameId,
    /// Stamp of the product, on the vehicle host's clock.
    #[n(1)]
    pub stamp: Instant,
}

/// Something that stands above the ground near the unit, by LiDAR alone: of no class, and no ground for an act. A body
/// that must not touch things keeps clear of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Nearby {
    /// Number within perception's boot, counted apart from the numbers of tracks.
    #[n(0)]
    pub number: u32,
    /// East of the middle of its returns, millimetres, world frame.
    #[n(1)]
    pub x_mm: i32,
    /// North, millimetres, world frame.
    #[n(2)]
    pub y_mm: i32,
    /// Velocity east, mm/s; zero of a thing that stands.
    #[n(3)]
    pub vx_mm_s: i32,
    /// Velocity north, mm/s; zero of a thing that stands.
    #[n(4)]
    pub vy_mm_s: i32,
    /// Largest horizontal extent of its returns, millimetres.
    #[n(5)]
    pub width_mm: u16,
}

/// Most things nearby that a message tells of.
pub const NEARBY: usize = 32;

/// Tracks of one processed frame. Liveness downstream rests on these products, never on a bare heartbeat.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Tracks {
    /// Frame that caused this message.
    #[n(0)]
    pub frame: FrameId,
    /// Stamp of the frame.
    #[n(1)]
    pub stamp: Instant,
    /// Source of the products.
    #[n(2)]
    pub mode: ProductMode,
    /// Newest product of each modality's stage, indexed as [`crate::sensor::Modality`]; absent before the first.
    #[n(3)]
    pub products: [Option<StageProduct>; 4],
    /// At most 16 tracks, oldest first.
    #[n(4)]
    pub tracks: List<Track, 16>,
    /// Crops of one of them, now and then; none without images.
    #[n(5)]
    pub crops: List<Crop, CAMERAS>,
    /// Things near the unit by LiDAR, oldest first; absent where it gave no product for the frame.
    #[n(6)]
    pub nearby: Option<List<Nearby, NEARBY>>,
}
