//! The error of a recording that no scenario can express.

use scenario::Problems;

use super::route::{MAX_POINTS, REACH_M, WIDEST_M};
use super::text::LONGEST_S;
use crate::error::TrackError;

/// No scenario is made of a recording.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// An input of the map is missing.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// The platform is in an orbit.
    #[error("platform `{platform}` is in an orbit, and has no route on the ground: name another with --platform")]
    Orbit {
        /// Its name.
        platform: String,
    },
    /// The vehicle flies and the platform does not.
    #[error(
        "the map's vehicle flies and platform `{platform}` does not: name one that flies, such as --platform platforms/air.toml"
    )]
    NoFlight {
        /// Its name.
        platform: String,
    },
    /// The vehicle has wheels and the platform flies.
    #[error(
        "the map's vehicle has wheels and platform `{platform}` flies: name one on wheels, such as --platform platforms/ground.toml"
    )]
    NoWheels {
        /// Its name.
        platform: String,
    },
    /// A route in the air without heights.
    #[error(
        "platform `{platform}` flies and the map gives no heights: a route in the air cannot be told from one on the ground; add `height` to [fix], such as \
         height = {{ field = \"alt\", unit = \"mm\" }}"
    )]
    NoHeight {
        /// Name of the platform.
        platform: String,
    },
    /// Heights beyond the platform's.
    #[error(
        "the recording flies at {:.1} m (median) to {:.1} m (nine tenths) above its lowest place, platform `{platform}` at {} to {} m: a route has no heights of \
         its own; name a platform with a `floor_ceiling_mm` that holds these",
        heights_m[0], heights_m[1], band_m[0], band_m[1]
    )]
    Height {
        /// Median and nine tenths of the heights, metres above the lowest place.
        heights_m: [f64; 2],
        /// Floor and ceiling of the platform, metres.
        band_m: [f64; 2],
        /// Name of the platform.
        platform: String,
    },
    /// Speed beyond the platform's.
    #[error(
        "the recording moves at up to {speed_m_s:.1} m/s in 95 % of the time, platform `{platform}` at {most_m_s} m/s at most: name a platform that is made \
         for this speed (docs/reference/platforms.md)"
    )]
    Fast {
        /// Speed that 95 % of the samples do not exceed, m/s.
        speed_m_s: f64,
        /// Highest speed of the platform, m/s.
        most_m_s: f64,
        /// Name of the platform.
        platform: String,
    },
    /// Speed below that of a platform that cannot stand.
    #[error(
        "the recording flies at up to {speed_m_s:.1} m/s in 95 % of the time, platform `{platform}` at {least_m_s} m/s at least: name a platform that can stand, \
         such as --platform platforms/air.toml"
    )]
    Slow {
        /// Speed that 95 % of the samples do not exceed, m/s.
        speed_m_s: f64,
        /// Least speed of the platform, m/s.
        least_m_s: f64,
        /// Name of the platform.
        platform: String,
    },
    /// No motion.
    #[error(
        "the longest part of the recording stays within {within_m:.1} m of its start, and a route has {REACH_M} m or more"
    )]
    Still {
        /// Greatest distance from the start, metres.
        within_m: f64,
    },
    /// A route beyond the world.
    #[error(
        "the route and the fence around it are {extent_m:.0} m long or wide, and a scenario's world is {WIDEST_M} m each way: cut the recording, as by `ros2 bag \
         convert` with `start_time_ns` and `end_time_ns`, to a shorter stretch"
    )]
    Wide {
        /// The larger of length and width, metres.
        extent_m: f64,
    },
    /// A route of too many bends.
    #[error(
        "the route needs {points} way points or more to stay within {tolerance_m} m of the recorded one, and a scenario has {MAX_POINTS}: cut the recording to a shorter \
         stretch"
    )]
    Winding {
        /// Way points at the coarsest tolerance.
        points: usize,
        /// The coarsest tolerance, metres.
        tolerance_m: f64,
    },
    /// A trial beyond the longest.
    #[error(
        "the route takes {seconds:.0} s at the recorded speed, and a trial lasts {LONGEST_S} s at most: cut the recording to a shorter stretch"
    )]
    Long {
        /// Time that the trial would take, seconds.
        seconds: f64,
    },
    /// A place of the route beyond the map's fence.
    #[error(
        "the route leaves the map's [fence] at {:.1} m east and {:.1} m north of the recording's zero: correct the fence, or take it out to get one around the \
         route",
        place_m[0], place_m[1]
    )]
    Outside {
        /// The first such place, metres on the recording's axes.
        place_m: [f64; 2],
    },
    /// A fence with too many corners.
    #[error("the map's [fence] has {corners} corners, and a scenario's has {MAX_POINTS} at most: give a simpler one")]
    Corners {
        /// Its corners.
        corners: usize,
    },
    /// A file that a check of scenarios refuses.
    #[error("the scenario that was made is refused, which is an error of this program: {problems}")]
    Refused {
        /// The problems.
        problems: Problems,
    },
}
