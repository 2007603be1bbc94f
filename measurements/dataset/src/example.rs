//! One labelled frame with the scene that it is of.

use config::platform::Sensors;
use minicbor::bytes::ByteSlice;
use sim::limits::SceneError;
use sim::scene::{Scene, StartPose};
use sim::{Label, Labelled, render};
use wire::id::FrameId;
use wire::sensor::Frames;
use wire::time::Instant;

use crate::cells::{Cell, CellsError, Split};
use crate::draw;

/// An object that shows fewer columns, rows or pixels than these is too small to be asked for: at 0.5 shared over united
/// area, an edge that lies between two pixels decides.
const LEAST: (u16, u16, u32) = (3, 6, 20);
/// Stream that the noise of a frame is drawn from, apart from that of its scene.
const NOISE: u64 = 0x6e6f_6973;

/// Reason for the lack of an example.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExampleError {
    /// The cells are of no use.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// The scene cannot be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// A frame, its scene and its place in the set.
#[derive(Clone, Debug)]
pub struct Example {
    /// The scene.
    pub scene: Scene,
    /// Viewpoint.
    pub start: StartPose,
    /// The sensors, over the viewpoint.
    pub sensors: Sensors,
    /// Their output, with its labels.
    pub frame: Labelled,
}

impl Example {
    /// Frame `number` of a cell's split, taken with `sensors`.
    ///
    /// # Errors
    /// `cells.toml` was edited into something else.
    pub fn new(sensors: &Sensors, cell: &Cell, split: Split, number: u64) -> Result<Self, ExampleError> {
        let (scene, start) = draw::scene(cell, split, number)?;
        Example::from_scene(sensors, scene, start, number)
    }

    /// The frame of any scene, with the noise of frame `number`.
    ///
    /// # Errors
    /// The scene cannot be built.
    pub fn from_scene(sensors: &Sensors, scene: Scene, start: StartPose, number: u64) -> Result<Self, ExampleError> {
        let frame = render(sensors, &scene, start, number ^ NOISE)?;
        Ok(Example { scene, start, sensors: *sensors, frame })
    }

    /// As perception gets it.
    pub fn frames(&self) -> Frames<'_> {
        frames(&self.frame, FrameId(1), Instant(1))
    }
}

/// Planes as perception gets them.
pub fn frames(frame: &Labelled, number: FrameId, stamp: Instant) -> Frames<'_> {
    Frames {
        frame: number,
        stamp,
        width: frame.width,
        height: frame.height,
        rgb: plane(&frame.rgb),
        depth: plane(&frame.depth),
        thermal: plane(&frame.thermal),
        lidar: plane(&frame.lidar),
    }
}

/// True if an object shows enough of itself to be asked for.
pub fn counts(label: &Label) -> bool {
    let b = &label.bounds;
    b.x1 - b.x0 >= LEAST.0 && b.y1 - b.y0 >= LEAST.1 && label.pixels >= LEAST.2
}

fn plane(bytes: &[u8]) -> Option<&ByteSlice> {
    Some(bytes.into())
}
