//! The sensors in the places of the modalities, by the names that people have for them: one list for each kind of
//! platform.
//!
//! Tracks, guards and faults know four places ([`Modality`]) on every platform. Logs, files and policies keep the names
//! of the places; words for people name the sensor that is mounted there.

use wire::mode::{Cause, Guard};
use wire::motion::ReportedMotion;
use wire::sensor::Modality;

/// Sensors of a kind of platform.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Suite {
    /// Sensors of a vehicle on the ground or in the air, which looks at objects: cameras and a LiDAR.
    #[default]
    Scene,
    /// Sensors of a satellite, which looks at the sky ([`wire::bearing::Bearings`]).
    Sky,
}

impl Suite {
    /// Suite of a unit that reports this motion: only a satellite reports sunlight.
    pub fn from_motion(motion: Option<&ReportedMotion>) -> Self {
        if motion.is_some_and(|motion| motion.sunlit.is_some()) { Suite::Sky } else { Suite::Scene }
    }

    /// Name of the sensor in this place.
    pub fn sensor(self, modality: Modality) -> &'static str {
        match (self, modality) {
            (Suite::Scene, place) => place.name(),
            (Suite::Sky, Modality::Rgb) => "star tracker",
            (Suite::Sky, Modality::Depth) => "sun sensor",
            (Suite::Sky, Modality::Thermal) => "horizon sensor",
            (Suite::Sky, Modality::Lidar) => "magnetometer",
        }
    }

    /// Letter of the sensor in this place.
    pub fn letter(self, modality: Modality) -> char {
        let letters = match self {
            Suite::Scene => ['R', 'D', 'T', 'L'],
            Suite::Sky => ['T', 'S', 'H', 'M'],
        };
        letters[modality as usize]
    }

    /// Reference that fixes are held against.
    pub fn reckoning(self) -> &'static str {
        match self {
            Suite::Scene => "odometry",
            Suite::Sky => "computed place",
        }
    }

    /// Name of the guard, by the sensor that it watches over.
    pub fn guard(self, guard: Guard) -> &'static str {
        Modality::ALL
            .into_iter()
            .find(|place| Guard::from_modality(*place) == guard)
            .map_or(guard.name(), |place| self.sensor(place))
    }

    /// Label of the cause, with the guard's name.
    pub fn cause(self, cause: Cause) -> String {
        match cause {
            Cause::Lost(guard) => format!("lost:{}", self.guard(guard)),
            Cause::Unrecovered(guard) => format!("unrecovered:{}", self.guard(guard)),
            Cause::Start | Cause::Operator | Cause::Recovered | Cause::Acted | Cause::Expired => cause.label(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vehicles_keep_the_names_of_the_places() {
        for guard in Guard::ALL {
            assert_eq!(Suite::Scene.guard(guard), guard.name());
            assert_eq!(Suite::Scene.cause(Cause::Lost(guard)), Cause::Lost(guard).label());
        }
    }

    #[test]
    fn sensors_of_a_satellite_have_names_of_their_own() {
        let names = Modality::ALL.map(|place| Suite::Sky.sensor(place));
        assert_eq!(names, ["star tracker", "sun sensor", "horizon sensor", "magnetometer"]);
        assert_eq!(Suite::Sky.cause(Cause::Unrecovered(Guard::Lidar)), "unrecovered:magnetometer");
        assert_eq!(Suite::Sky.guard(Guard::Geofence), Guard::Geofence.name());
    }
}
