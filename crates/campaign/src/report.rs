//! From trials to results: the object of `run --json`, the rows of the reference evaluation, the table.
//!
//! Twin n and live n are never added; INVALID trials are never dropped: each bound is given once over the valid trials
//! and once with INVALID counted as failure. Nothing here judges a trial.

mod ablate;
mod agreement;
mod campaign;
mod columns;
mod cost;
mod curve;
mod explain;
mod growth;
mod kill;
mod liveness;
mod matrix;
mod minima;
mod mission;
mod plot;
mod rare;
mod reference;
mod run;
mod search;
mod table;
mod transitions;
mod worth;

pub use ablate::{Ablation, AttackRow, CheckRow, Compared, Defects, Overlap, Quiet, Worth, ablation_table};
pub use agreement::{AgreementObject, StratumRow, WordRow, agreement_table};
pub use campaign::{CampaignObject, CampaignRow, Claims, Fold, campaign_table};
pub use columns::{TableError, TrialTable};
pub use cost::{Spread, StageCost, TwinCost, cost_table};
pub use curve::{CurveLine, CurveObject, CurvePoint, Reading, curve_table};
pub(crate) use explain::stage_name;
pub use explain::{ExplainObject, diagram, explained, explained_in_seconds, kept_out};
pub use growth::{Fit, Grown, Growth, GrowthRow, growth_table};
pub use kill::{KillRow, Times, kill_table};
pub use liveness::{LivenessObject, LivenessRow, liveness_svg, liveness_table};
pub use matrix::{Kind, Matrix, MatrixRow, MatrixRun, matrix_table};
pub use minima::{MinimaObject, MinimaRow, minima_table};
pub use mission::MissionSummary;
pub use plot::svg;
pub use rare::{Asked, RareObject, rare_table};
pub use reference::{LiveLatency, PAPER, PaperRow, Reference, ReferenceRow};
pub use run::{CellSummary, HostSpoilt, LatencySummary, Mode, RunObject, Summary};
pub use search::{Confirmed, FindingRow, SearchObject, search_table};
pub(crate) use table::started;
pub use table::{latency_table, reference_table, run_table};
pub use transitions::{TransitionCell, TransitionRow, transition_table};
pub use worth::{HuntsRow, WeaknessRow, WorthObject, worth_table};
