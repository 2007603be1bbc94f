//! Results of many trials, as objects, tables and figures.
//!
//! `campaign` is the plan of many trials with its claims, `report` folds trials into rows, `catalogue` is the table of threats, `story` the
//! summary of one run for a reviewer, `reproduction` the outcomes of runs when their references were committed, `mode` the ways to run a
//! trial. No code here runs or judges one.

pub mod campaign;
pub mod catalogue;
pub mod mode;
pub mod report;
pub mod reproduction;
pub mod summary;
