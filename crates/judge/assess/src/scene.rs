//! A scenario out of a recording: its route, speed and noise in a file that the twin runs on in the closed loop.
//!
//! `part` takes the longest part of the readings, `route` reduces it to way points, `shown` measures speed, noise and rates, `text` writes the
//! file with the source of each number. A quantity that a scenario cannot express is an error, or a comment where the scenario is right without it.
//! Objects, relief and light of the place are in no recording, which the file states.

mod error;
mod part;
mod route;
mod shown;
mod text;

pub use error::SceneError;

use crate::Terms;
use crate::log::Log;
use crate::map::{Map, Vehicle};
use crate::track;
use part::Part;
use route::Route;
use shown::Shown;

/// The scenario that is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// Its name, that of its file without `.toml`.
    pub name: &'a str,
    /// The platform's name, that of a file in `platforms/`.
    pub platform: &'a str,
    /// The recording's name, for a comment.
    pub recording: &'a str,
    /// SHA-256 of the recording in hexadecimal digits, for a comment.
    pub sha256: &'a str,
    /// Least speed of a platform that cannot stand, m/s; 0 of any other.
    pub least_speed_m_s: f64,
    /// Deviation of the twin's receiver on each axis, metres, to which the recording's noise is compared.
    pub twin_sigma_m: f64,
}

/// The text of a scenario that follows the recording's route: it passes the checks of a scenario file.
///
/// # Errors
/// When an input of the map is missing, or the recording shows a quantity that no scenario of this platform can express.
pub fn scenario_text(log: &Log<'_>, map: &Map, terms: &Terms, wanted: &Wanted<'_>) -> Result<String, SceneError> {
    check_body(map, terms, wanted.platform)?;
    let track = track::track(log, map, &terms.bounds).map_err(|error| error.because_of(&log.end))?;
    let part = Part::longest(&track, terms)?;
    let heights =
        if terms.limits.aloft.is_some() { Some(part::heights(log, map, terms, wanted.platform)?) } else { None };
    let shown = Shown::of_part(&part, &track.facts);
    check_speed(&shown, terms, wanted)?;
    let route = Route::of_part(&part, map, terms)?;
    let sources = text::Sources { map, terms, wanted, part: &part, heights, shown: &shown, route: &route };
    let text = text::write(&sources)?;
    // A file that a check refuses must not leave the program as a good one.
    let file = format!("{}.toml", wanted.name);
    scenario::parse(&file, wanted.name, &text).map_err(|problems| SceneError::Refused { problems })?;
    Ok(text)
}

/// Holds the kind of vehicle against the platform's body.
fn check_body(map: &Map, terms: &Terms, platform: &str) -> Result<(), SceneError> {
    let (free, flies) = (terms.limits.free, terms.limits.aloft.is_some());
    let platform = platform.to_owned();
    match map.vehicle {
        _ if free && !flies => Err(SceneError::Orbit { platform }),
        Vehicle::Multirotor | Vehicle::FixedWing if !flies => Err(SceneError::NoFlight { platform }),
        Vehicle::Wheeled if flies => Err(SceneError::NoWheels { platform }),
        Vehicle::Multirotor | Vehicle::FixedWing | Vehicle::Wheeled | Vehicle::Other => Ok(()),
    }
}

fn check_speed(shown: &Shown, terms: &Terms, wanted: &Wanted<'_>) -> Result<(), SceneError> {
    let (speed_m_s, platform) = (shown.speed_m_s, wanted.platform.to_owned());
    let most_m_s = f64::from(terms.bounds.max_speed_mm_s) / 1000.0;
    if speed_m_s > most_m_s {
        return Err(SceneError::Fast { speed_m_s, most_m_s, platform });
    }
    match speed_m_s < wanted.least_speed_m_s {
        true => Err(SceneError::Slow { speed_m_s, least_m_s: wanted.least_speed_m_s, platform }),
        false => Ok(()),
    }
}
