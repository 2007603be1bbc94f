//! The error of a search.

use scenario::SettingsError;
use twin::part::make::AssemblyError;

/// A search cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum SearchError {
    /// A sequence that does not fit the scenario.
    #[error(transparent)]
    Unfit(#[from] SettingsError),
    /// An action type that does not fit the scenario by itself.
    #[error("action type {kind} of attack space {space} does not fit `{scenario}`: {error}")]
    ActionType {
        /// Name of the action type.
        kind: String,
        /// Name of the attack space.
        space: String,
        /// Name of the scenario.
        scenario: String,
        /// The setting or entry that does not fit.
        error: Box<SettingsError>,
    },
    /// A run that cannot be started.
    #[error(transparent)]
    Start(#[from] AssemblyError),
    /// The user wants it to stop.
    #[error("stopped")]
    Stopped,
    /// An optimizer that cannot go on.
    #[error("{reason}")]
    Proposer {
        /// Its name, its answer and the fault, in words.
        reason: String,
    },
}
