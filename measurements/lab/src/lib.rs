//! The `lab` program: measurements for the authors of the platform. No verdict rests on them.
//!
//! `command` is the command line; `bench` measures, a measurement a file, with its objects in `report` and the trials
//! that it runs in `measured`. `records` is the published figures. `leak` is the information in lengths and times,
//! `stages` the time of each stage, `liveness` detectors of silence. `slope` and `waiting` are statistics that only measurements need.

pub mod bench;
pub mod command;
pub mod leak;
pub mod liveness;
pub mod measured;
pub mod records;
pub mod report;
pub mod slope;
pub mod stages;
pub mod waiting;
