//! Measurements for the authors of the platform: `bench` has one a file. No verdict rests on them.
//!
//! `leak` shows the links' lengths and times as an observer sees them, `stages` the delay of each stage, `liveness` detectors of silence. `measured` runs the
//! trials of `bench`, `report` has its objects and tables.

pub mod bench;
pub mod leak;
pub mod liveness;
pub mod measured;
pub mod report;
pub mod stages;
