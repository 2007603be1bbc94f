//! Reasons for which a trial could not be run. Those for which a recorded one cannot be read are left to `recording`.

/// Reason for which an engine gave no result.
#[derive(Clone, Debug, thiserror::Error)]
pub enum EngineError {
    /// A defect of ours.
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
    /// An internal defect, in the words of the failed part.
    pub fn failed(error: impl std::fmt::Display) -> Self {
        EngineError::Failed(error.to_string())
    }
}
