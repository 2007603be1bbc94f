//! The conditions under which sensors measure: light, fog, rain, a camera that shakes.
//!
//! [`Weather::CLEAR`] changes no reading by a single bit. The optics are textbook laws with few figures: contrast falls
//! with distance by Koschmieder's law (5 % of it is left at the visibility), a laser's return twice as fast. Values
//! that the laws do not give are named assumptions beside their constants. Only the rendered sensors know weather; the
//! noise model that represents them has been fitted to none, so a scene with weather is refused there.

use serde::{Deserialize, Serialize};

use crate::limits::{SceneError, check_range};

/// `-ln 0.05`: extinction per metre is this over the visibility (Koschmieder 1924, with a contrast threshold of 5 %).
const KOSCHMIEDER: f32 = 2.996;
/// Extinction of long-wave infrared in fog as a share of that of light. An assumption: it is near 1 in dense fog and
/// far below it in haze.
const INFRARED: f32 = 0.5;
/// Extinction of light by rain, per metre, is this times the rate to the power of [`RAIN_POWER`]: 1.076 R^0.67 dB/km
/// (Carbonneau and Wisely 1998).
const RAIN_PER_M: f32 = 1.076 / 4_343.0;
const RAIN_POWER: f32 = 0.67;
/// Share of a heavy rain's (50 mm/h) beams that return from a drop nearby. An assumption.
const DROPS: f32 = 0.02;
/// Heaviest rain that the model is for, mm/h.
const HEAVY: f32 = 50.0;

/// Light, air and camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Weather {
    /// Light as a share of a clear noon's; a camera's gain compensates at the price of noise.
    pub light: f32,
    /// Meteorological visibility, metres; `None` in clear air.
    pub visibility_m: Option<f32>,
    /// Rate of rain, mm/h.
    pub rain_mm_h: f32,
    /// Smear of the colour image along its rows by motion during exposure, pixels.
    pub smear_px: u16,
}

impl Default for Weather {
    fn default() -> Self {
        Weather::CLEAR
    }
}

impl Weather {
    /// A clear noon.
    pub const CLEAR: Weather = Weather { light: 1.0, visibility_m: None, rain_mm_h: 0.0, smear_px: 0 };

    /// True if it is a clear noon.
    pub fn is_clear(&self) -> bool {
        *self == Weather::CLEAR
    }

    pub(crate) fn check(&self) -> Result<(), SceneError> {
        check_range("weather.light", self.light, 0.02, 1.5)?;
        check_range("weather.visibility_m", self.visibility_m.unwrap_or(1e3), 5.0, 1e5)?;
        check_range("weather.rain_mm_h", self.rain_mm_h, 0.0, HEAVY)?;
        check_range("weather.smear_px", f32::from(self.smear_px), 0.0, 16.0)
    }

    fn rain_per_m(&self) -> f32 {
        if self.rain_mm_h > 0.0 { RAIN_PER_M * libm::powf(self.rain_mm_h, RAIN_POWER) } else { 0.0 }
    }

    fn fog_per_m(&self) -> f32 {
        self.visibility_m.map_or(0.0, |metres| KOSCHMIEDER / metres)
    }

    /// Share of the light that comes through a given number of metres of air.
    pub(crate) fn clarity(&self, metres: f32) -> f32 {
        libm::expf(-(self.fog_per_m() + self.rain_per_m()) * metres)
    }

    /// Share of a warm object's contrast that comes through.
    pub(crate) fn warmth(&self, metres: f32) -> f32 {
        libm::expf(-(INFRARED * self.fog_per_m() + self.rain_per_m()) * metres)
    }

    /// True if a pulse comes back from so far: spread by the square of the range and dimmed both ways, it has to be as
    /// strong as one from `reach`, the greatest range in clear air.
    pub(crate) fn returns(&self, metres: f32, reach: f32) -> bool {
        let clarity = self.clarity(metres);
        clarity * clarity * reach * reach >= metres * metres
    }

    /// Share of beams that a drop sends back.
    pub(crate) fn drops(&self) -> f32 {
        DROPS * self.rain_mm_h / HEAVY
    }

    /// Factor on the colour camera's noise: gain makes up for light that lacks, and amplifies the noise of the sensor.
    pub(crate) fn gain(&self) -> f32 {
        (1.0 / self.light).clamp(1.0, 6.0)
    }

    /// Brightness of the image: the gain makes up for a part of the missing light.
    pub(crate) fn brightness(&self) -> f32 {
        if self.light >= 1.0 { self.light } else { libm::sqrtf(self.light) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clear air takes none.
    #[test]
    fn contrast_at_visibility_is_a_twentieth() {
        let fog = Weather { visibility_m: Some(40.0), ..Weather::CLEAR };
        assert!((fog.clarity(40.0) - 0.05).abs() < 1e-3);
        assert_eq!([Weather::CLEAR.clarity(60.0), Weather::CLEAR.warmth(60.0), Weather::CLEAR.gain()], [1.0; 3]);
        assert!(Weather::CLEAR.returns(60.0, 60.0) && fog.returns(15.0, 60.0) && !fog.returns(30.0, 60.0));
    }

    #[test]
    fn weather_beyond_the_model_is_refused_by_name() {
        let dark = Weather { light: 0.0, ..Weather::CLEAR };
        assert!(matches!(dark.check(), Err(SceneError::OutOfRange { field: "weather.light", .. })));
        let opaque = Weather { visibility_m: Some(f32::NAN), ..Weather::CLEAR };
        assert!(matches!(opaque.check(), Err(SceneError::OutOfRange { field: "weather.visibility_m", .. })));
    }
}
