//! The unit's own pose at a frame's stamp, from localisation and odometry: candidates are seen in the body frame,
//! tracks live in the world frame.

use wire::sensor::Navigation;
use wire::time::{Instant, Span};

/// A planar pose in the world frame: metres and the heading's cosine and sine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    east: f64,
    north: f64,
    cos: f64,
    sin: f64,
    /// Standard deviation of position as localisation states it, metres.
    pub sigma: f64,
}

impl Placement {
    /// The world frame's own pose, without error.
    #[cfg(test)]
    pub(crate) const ORIGIN: Placement = Placement { east: 0.0, north: 0.0, cos: 1.0, sin: 0.0, sigma: 0.0 };

    /// The placement moved a given number of metres to the east.
    #[cfg(test)]
    pub(crate) fn moved(self, east: f64) -> Self {
        Placement { east: self.east + east, ..self }
    }

    /// A point of the body frame (metres forward, metres left) in the world frame (metres east, metres north).
    pub fn to_world(&self, [forward, left]: [f64; 2]) -> [f64; 2] {
        [self.east + self.cos * forward - self.sin * left, self.north + self.sin * forward + self.cos * left]
    }

    /// A way in the world frame (metres east, metres north) in the body frame (metres forward, metres left).
    pub fn turned_back(&self, [east, north]: [f64; 2]) -> [f64; 2] {
        [self.cos * east + self.sin * north, self.cos * north - self.sin * east]
    }
}

/// The newest localisation fix with the odometry that carries it forward.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ego {
    newest: Option<Navigation>,
}

impl Ego {
    /// Takes a reading that has a fix; one without leaves the last fix to grow old.
    pub fn note(&mut self, reading: &Navigation) {
        if reading.fix.is_some() && self.newest.is_none_or(|n| reading.stamp >= n.stamp) {
            self.newest = Some(*reading);
        }
    }

    /// The pose at `stamp`, dead-reckoned from the last fix; `None` without a fix within `limit` of it.
    pub fn pose_at(&self, stamp: Instant, limit: Span) -> Option<Placement> {
        let newest = self.newest?;
        let fix = newest.fix?;
        let duration = stamp.since(newest.stamp).max(newest.stamp.since(stamp));
        if duration > limit {
            return None;
        }
        let seconds = if stamp >= newest.stamp { duration.0 as f64 } else { -(duration.0 as f64) } / 1e6;
        let (speed, rate) = newest
            .odometry
            .map_or((0.0, 0.0), |o| (f64::from(o.speed_mm_s) / 1000.0, f64::from(o.yaw_rate_mrad_s) / 1000.0));
        let yaw = f64::from(fix.pose.yaw_mrad) / 1000.0;
        let (sin_mid, cos_mid) = libm::sincos(yaw + 0.5 * rate * seconds);
        let (sin, cos) = libm::sincos(yaw + rate * seconds);
        Some(Placement {
            east: f64::from(fix.pose.x_mm) / 1000.0 + cos_mid * speed * seconds,
            north: f64::from(fix.pose.y_mm) / 1000.0 + sin_mid * speed * seconds,
            cos,
            sin,
            sigma: f64::from(fix.sigma_mm) / 1000.0,
        })
    }
}
