//! Facts about a recording, which show how far the model of the guards fits it. They are found by `track`.

/// Facts that tell how far the guards' model fits.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Facts {
    /// Fixes that were used.
    pub fixes: u64,
    /// Fixes that were not: invalid, not finite, without a heading, or with a stamp that does not increase.
    pub fixes_unused: u64,
    /// Median time between fixes, seconds.
    pub fix_period_s: f64,
    /// Samples of odometry.
    pub odometry: u64,
    /// Median time between them, seconds.
    pub odometry_period_s: f64,
    /// Median of the deviation that fixes state, metres.
    pub sigma_m: Option<f64>,
    /// Way by odometry, metres.
    pub way_m: f64,
    /// Way sideways to the body axis, metres; absent where the map does not give it.
    pub sideways_m: Option<f64>,
    /// Highest speed along the body axis, m/s.
    pub speed_m_s: f64,
    /// Samples of odometry with a stamp that does not increase.
    #[serde(default, skip_serializing_if = "is_none")]
    pub odometry_unused: u64,
    /// Place of the receiver that was used, metres ahead and to the left of the rear axle's middle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lever_m: Option<[f64; 2]>,
    /// Parts that were judged apart; absent for one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parts: Option<u64>,
    /// Set-points, and those above the platform's highest speed.
    pub setpoints: Option<(u64, u64)>,
}

fn is_none(count: &u64) -> bool {
    *count == 0
}
