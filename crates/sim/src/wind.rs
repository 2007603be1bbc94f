//! Wind over a scene: a mean and gusts on it, as data. The gusts are made where a body flies (`plant::air`).

use serde::{Deserialize, Serialize};

use crate::limits::{SceneError, check_range};

/// Wind over a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Wind {
    /// Mean towards the east, m/s.
    pub east_m_s: f32,
    /// Mean towards the north, m/s.
    pub north_m_s: f32,
    /// Deviation of the horizontal gusts, m/s.
    pub gust_m_s: f32,
    /// Length of the gusts, metres; 0: 50 m.
    pub length_m: f32,
}

impl Wind {
    /// # Errors
    /// A value that is no number or out of range.
    pub fn check(&self) -> Result<(), SceneError> {
        check_range("wind.east_m_s", self.east_m_s, -20.0, 20.0)?;
        check_range("wind.north_m_s", self.north_m_s, -20.0, 20.0)?;
        check_range("wind.gust_m_s", self.gust_m_s, 0.0, 10.0)?;
        check_range("wind.length_m", self.length_m, 0.0, 1000.0)
    }
}
