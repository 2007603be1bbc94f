//! Summaries of trials as results: the object of `run --json`, the rows of the reference evaluation, the table.
//!
//! Twin n and live n are never added; INVALID trials are never dropped: each bound is given once over the valid trials
//! and once with INVALID counted as failure. No code here judges a trial.

mod ablate;
mod accepted;
mod assess;
mod campaign;
#[cfg(feature = "parquet")]
mod columns;
mod confusion;
mod consistent;
mod cost;
mod curve;
mod explain;
mod guest;
mod layout;
mod live;
mod matrix;
mod mission;
mod plot;
mod property;
mod rare;
mod reference;
mod run;
mod search;
mod table;
mod twins;
mod worlds;

pub use ablate::{Ablation, AttackRow, CheckRow, Compared, Defects, Overlap, Quiet, Worth, ablation_table};
pub use accepted::AcceptedRate;
pub use assess::{AssessObject, Assessed, InjectionRow, TestRow, assess_table};
pub use campaign::{CampaignObject, CampaignRow, ClaimRow, ClaimVerdicts, Fold, RateBounds, Tallies, campaign_table};
#[cfg(feature = "parquet")]
pub use columns::{TableError, TrialTable};
pub use confusion::{Confusion, ConfusionRow, Named, confusion_table};
pub use cost::{Spread, StageCost, TwinCost, cost_table};
pub use curve::{CurveLine, CurveObject, CurvePoint, Reading, curve_table};
pub use explain::stage_name;
pub use explain::{ExplainObject, diagram, explained, explained_in_seconds, kept_out};
pub use guest::{Comparison, ComparisonRow, ComparisonTotal, GuestChecked, comparison_table};
pub use layout::{Table, width, wrap_labelled};
pub use live::BenchLive;
pub use matrix::{Kind, Matrix, MatrixRow, MatrixRun, matrix_table};
pub use mission::{MissionSummary, ProgressSummary};
pub use plot::svg;
pub use property::property_statement;
pub use rare::{RareObject, RareQuestion, rare_table};
pub use reference::{LiveLatency, PAPER, PaperRow, Reference, ReferenceRow};
pub use run::{CellSummary, HostSpoilt, LatencySummary, RunObject, RunsObject, Summary};
pub use search::{Confirmed, FindingRow, SearchObject, search_table};
pub use table::{latency_table, new_table, reference_table, run_table, scenario_line, started};
pub use twins::{Beside, Told, TwinPair, twins_table};
pub use worlds::{Apart, Holds, InWorlds, Tally, WorldsRow, worlds_table};
