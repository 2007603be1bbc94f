//! Crops: the part of a camera's image that shows one track, as an operator sees it.
//!
//! A crop travels from perception through autonomy and the gateway to the console, unsigned: the unit's signed report
//! names its hash ([`Pictured`]), and none that no report names is shown. Cutting is left to perception.

use minicbor::{Decode, Encode, bytes::ByteArray};

use crate::codec::List;
use crate::id::{FrameId, TrackId};
use crate::time::Span;

/// Pixels in a row of a crop.
pub const WIDTH: usize = 24;
/// Rows of a crop.
pub const HEIGHT: usize = 18;
/// Pixels of a crop.
pub const PIXELS: usize = WIDTH * HEIGHT;
/// Longest encoded crop in bytes: leaves room for the session message in one 1,200-byte datagram.
pub const MAX_CROP: usize = 1024;
/// Most crops of one track: one a camera.
pub const CAMERAS: usize = 3;

/// SHA-256 of an encoded crop.
pub type CropHash = ByteArray<32>;

/// A track as one camera shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Crop {
    /// The track in its middle.
    #[n(0)]
    pub track: TrackId,
    /// The frame that it was cut from.
    #[n(1)]
    pub frame: FrameId,
    /// Pixels of the camera, each way, in one of the crop.
    #[n(2)]
    pub scale: u8,
    /// Pixels, row by row from the top.
    #[n(3)]
    pub pixels: Pixels,
}

/// Pixels of a crop, by camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
#[expect(clippy::large_enum_variant, reason = "a box would be one allocation a crop")]
pub enum Pixels {
    /// Colour: five bits of red, six of green, five of blue, little-endian.
    #[n(0)]
    Colour(#[n(0)] ByteArray<{ 2 * PIXELS }>),
    /// Temperature: shares, of 255, of the way from the least to the most, centikelvin.
    #[n(1)]
    Warmth(#[n(0)] u16, #[n(1)] u16, #[n(2)] ByteArray<PIXELS>),
    /// Depth: zero without a return, else 255 to one from the nearest to the farthest, millimetres.
    #[n(2)]
    Depth(#[n(0)] u16, #[n(1)] u16, #[n(2)] ByteArray<PIXELS>),
}

impl Pixels {
    /// Pixels as an image: red, green and blue of each.
    pub fn rgb(&self) -> Vec<u8> {
        let channel = |packed: u16, from: u16, bits: u16| (packed >> from << (8 - bits)) as u8;
        match self {
            Pixels::Colour(packed) => {
                let pixels = packed.chunks_exact(2).map(|two| u16::from_le_bytes([two[0], two[1]]));
                pixels.flat_map(|p| [channel(p, 11, 5), channel(p & 0x7ff, 5, 6), channel(p & 0x1f, 0, 5)]).collect()
            }
            Pixels::Warmth(.., shades) | Pixels::Depth(.., shades) => shades.iter().flat_map(|s| [*s; 3]).collect(),
        }
    }
}

/// Crops that a report vouches for.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Pictured {
    /// The track that they show.
    #[n(0)]
    pub track: TrackId,
    /// Age of their frame when the report was made.
    #[n(1)]
    pub age: Span,
    /// Hashes of the crops.
    #[n(2)]
    pub crops: List<CropHash, CAMERAS>,
}
