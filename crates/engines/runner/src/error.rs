//! Reasons for which a trial could not be run. The reasons for which a recorded trial cannot be read are left to `recording`.

/// Reason for which an engine gave no result.
#[derive(Clone, Debug, thiserror::Error)]
pub enum EngineError {
    /// A defect of this program.
    #[error("{0}")]
    Failed(String),
    /// The host lacks something.
    #[error("{0}; `holdsafe doctor` checks what a run needs")]
    Environment(String),
    /// The user stopped it.
    #[error("stopped")]
    Stopped,
}

impl EngineError {
    /// An internal defect, with the message of the failed part.
    pub fn failed(error: impl std::fmt::Display) -> Self {
        EngineError::Failed(error.to_string())
    }
}
