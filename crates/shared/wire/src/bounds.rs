//! The time bounds of a platform: one file each, fixed before measuring (`docs/reference/bounds.md` names the two that
//! were not). A scenario may tighten them.

use crate::time::Span;

/// Bounds and periods of one platform. Derived in `docs/reference/bounds.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// *Tf*: the oldest a record may be when it is accepted, ms.
    pub freshness_ms: u64,
    /// *Td*: from a loss to DEGRADED with authority revoked, ms.
    pub to_degraded_ms: u64,
    /// *Th*: from a loss of trust to HOLD_SAFE, ms.
    pub to_hold_safe_ms: u64,
    /// Length of a supervision lease, ms.
    pub lease_ms: u64,
    /// Period of grants, ms.
    pub grant_period_ms: u64,
    /// Period of telemetry, ms.
    pub telemetry_period_ms: u64,
    /// Period of control: guards, set-points, ms.
    pub control_period_ms: u64,
    /// Age at which a perception product or a localisation reading counts as lost, ms.
    pub product_limit_ms: u64,
    /// Length of a set-point's lease at the plant, ms.
    pub set_point_lease_ms: u64,
    /// Period of new challenges, ms.
    pub challenge_period_ms: u64,
    /// Longest time that an echo may serve, ms.
    pub echo_limit_ms: u64,
    /// Oldest nonce that a command may repeat, ms.
    pub command_limit_ms: u64,
    /// Longest time that unused authority lives, ms.
    pub authority_ms: u64,
    /// Time for which guards must hold before DEGRADED may end, ms.
    pub hysteresis_ms: u64,
    /// Longest time that a loss may last before DEGRADED becomes HOLD_SAFE, ms; only for losses that driving depends
    /// on.
    pub unrecovered_ms: u64,
    /// Largest age of the recorder's newest seal over the unit's log, ms.
    pub seal_limit_ms: u64,
    /// Largest distance from a designated position to a true object of the class at an act (P11), mm.
    pub designation_mm: u32,
    /// Confidence from which a track can be designated, permille.
    pub designation_confidence: u16,
    /// Confidence below which a designated track is given up, permille; lower than the above, so that a track at the
    /// threshold does not come and go.
    pub designation_keep: u16,
    /// Least angle between the outermost lines of sight along which a track was borne out before it can be designated,
    /// milliradians; 0 asks for none.
    pub designation_bearings_mrad: u32,
    /// Longest time that a designated track may go without an update, ms; at most *Td*.
    pub track_limit_ms: u64,
    /// Largest speed of the unit, mm/s.
    pub max_speed_mm_s: u32,
    /// Speed while degraded, mm/s.
    pub degraded_speed_mm_s: u32,
    /// Deceleration that the plant is sure to reach, mm/s².
    pub braking_mm_s2: u32,
    /// Distance from the fence that is kept beyond the stopping distance, mm.
    pub fence_margin_mm: u32,
    /// Two units claimed nearer than this cannot both be there, mm.
    pub exclusion_mm: u32,
    /// A teammate's claimed displacement may exceed its claimed speed's by this, mm.
    pub teammate_slack_mm: u32,
    /// Width of the anti-replay window, records, at most 64.
    pub replay_window: u8,
    /// Largest step of a sequence.
    pub sequence_jump: u64,
}

impl Bounds {
    /// The ground platform of `platforms/ground.toml`; a test holds the two equal.
    pub const GROUND: Bounds = Bounds {
        freshness_ms: 300,
        to_degraded_ms: 500,
        to_hold_safe_ms: 1000,
        lease_ms: 500,
        grant_period_ms: 100,
        telemetry_period_ms: 100,
        control_period_ms: 50,
        product_limit_ms: 300,
        set_point_lease_ms: 300,
        challenge_period_ms: 1000,
        echo_limit_ms: 3000,
        command_limit_ms: 2500,
        authority_ms: 5000,
        hysteresis_ms: 1000,
        unrecovered_ms: 400,
        seal_limit_ms: 1000,
        designation_mm: 2000,
        designation_confidence: 600,
        designation_keep: 450,
        designation_bearings_mrad: 0,
        track_limit_ms: 500,
        max_speed_mm_s: 3000,
        degraded_speed_mm_s: 1000,
        braking_mm_s2: 3000,
        fence_margin_mm: 1000,
        exclusion_mm: 1500,
        teammate_slack_mm: 1500,
        replay_window: 32,
        sequence_jump: 600,
    };

    /// Largest age of an accepted record, *Tf*.
    pub fn freshness(&self) -> Span {
        Span::ms(self.freshness_ms)
    }

    /// Age at which a product counts as lost.
    pub fn product_limit(&self) -> Span {
        Span::ms(self.product_limit_ms)
    }

    /// Longest time that an echo may serve.
    pub fn echo_limit(&self) -> Span {
        Span::ms(self.echo_limit_ms)
    }
}
