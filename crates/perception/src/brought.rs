//! A user's detector in place of the shipped one: its file, its decoding, and its faults in a run.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::head::Head;
use crate::model::ModelRef;
use crate::sight::{Faults, Sight, Watched};

/// A detector in place of the shipped one.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Brought {
    /// File of the detector, pinned by hash.
    pub model: ModelRef,
    /// Decoding of its output.
    pub head: Head,
    /// The loaded detector. It cannot be sent: each process that uses one has loaded its own.
    #[serde(skip)]
    pub loaded: Option<Arc<dyn Sight>>,
    /// Faults of the detector in this run.
    #[serde(skip)]
    pub faults: Faults,
}

impl Brought {
    /// A detector with this file and decoding, not loaded.
    pub fn new(model: ModelRef, head: Head) -> Self {
        Self { model, head, loaded: None, faults: Faults::default() }
    }

    /// The configuration for its own run, without faults.
    #[must_use]
    pub fn for_run(&self) -> Self {
        Self { faults: Faults::default(), ..self.clone() }
    }

    /// The loaded detector, with its faults noted in this.
    pub(crate) fn watched(&self) -> Option<Arc<dyn Sight>> {
        let sight = Arc::clone(self.loaded.as_ref()?);
        Some(Arc::new(Watched { sight, faults: self.faults.clone() }))
    }
}

/// File and head identify a detector, loaded or not.
impl PartialEq for Brought {
    fn eq(&self, other: &Self) -> bool {
        (&self.model, &self.head) == (&other.model, &other.head)
    }
}
