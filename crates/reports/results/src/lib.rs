//! Results: trials folded into objects, tables and figures.
//!
//! `campaign` is the plan of many trials with its claims, `report` folds trials into rows, `catalogue` is the table of
//! threats, `summary` describes one run to a reviewer, `reproduction` compares with the committed references, `mode`
//! names the three ways to run a trial. This crate neither runs nor judges a trial.

pub mod campaign;
pub mod catalogue;
pub mod mode;
pub mod report;
pub mod reproduction;
pub mod summary;
