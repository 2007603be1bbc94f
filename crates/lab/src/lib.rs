//! What only the authors of the platform measure, and the tables of it: what lengths and times tell an observer (`leak`), how long each
//! stage takes (`stages`), detectors of silence (`liveness`), and all that `holdsafe bench` measures besides (`bench`, a measurement a file, with its objects in `report` and the trials that it runs in `measured`).
//! No verdict rests on it.

pub mod bench;
pub mod leak;
pub mod liveness;
pub mod measured;
pub mod report;
pub mod stages;
