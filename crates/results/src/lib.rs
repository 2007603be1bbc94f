//! Results: what many trials come to, as objects, tables and figures.
//!
//! `campaign` is the plan of many trials with its claims, `report` folds trials into rows, `catalogue` is the table of threats, `story` one run
//! told for a reviewer, `reproduction` what runs came to when their references were committed, `mode` the ways to run a trial. Nothing here runs or judges one.

pub mod campaign;
pub mod catalogue;
pub mod mode;
pub mod report;
pub mod reproduction;
pub mod story;
