//! What only the authors of the platform measure, and the tables of it: what lengths and times tell an observer (`leak`), how long each
//! stage takes (`stages`), detectors of silence (`liveness`), and the objects that `holdsafe bench` prints (`report`). No verdict rests on it.

pub mod leak;
pub mod liveness;
pub mod report;
pub mod stages;
