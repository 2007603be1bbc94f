//! campaign

pub mod report;
pub mod scenario;
pub mod stats;
pub mod trial;
