//! Random scenes with their truth, and a detector's quality on them.
//!
//! - [`cells`] lists the conditions of frames, those a model may learn from, and those held out.
//! - [`draw`] makes a scene of a seed, [`example`] a labelled frame of a scene.
//! - [`precision`] is the detector's average precision, [`calibration`] the meaning of its scores, [`warmth`] the thermal
//!   stage, [`sightings`] corroboration of both; [`quality`] measures them all, cell by cell.
//! - [`rides`] drives a unit through scenes in which things move; [`tracking`] scores tracks over a ride, [`likeness`] sets the
//!   noise model beside the stages that it replaces.
//! - [`coco`] writes frames for others to learn from, [`sheet`] a picture of them for people.
//!
//! Sensors are `sim`'s and stages are `perception`'s; this crate copies neither. Files are the command's.

pub mod calibration;
pub mod cells;
pub mod coco;
pub mod draw;
pub mod example;
pub mod likeness;
pub mod precision;
pub mod quality;
pub mod rides;
pub mod sheet;
pub mod sightings;
pub mod tracking;
pub mod warmth;
