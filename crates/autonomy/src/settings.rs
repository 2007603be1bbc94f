//! Joint safety of an operator's settings, and the bounds under them.
//!
//! Each value is in its range by the schema (`wire::settings`). Here: that a unit which loses its place at full speed
//! at the margin still comes to rest inside the fence, that a wing has the speed of its circle, and that a track which may be armed on is not given up at once.
//! Derived in `docs/reference/bounds.md`. In which mode settings may change is left to `transition`.

use config::platform::Limits;
use wire::bounds::Bounds;
use wire::refusal::Refusal;
use wire::settings::Settings;

/// Allowance left for the error of the last fix, mm.
const ERROR_MM: u32 = 400;
/// A navigation period and a step of the plant with its actuators, milliseconds.
const READING_AND_PLANT_MS: u64 = 100;
/// Distance of the confidence to arm above the one to keep, permille.
const APART_PERMILLE: u32 = 100;

/// The settings go together, or the value that is too small for the others.
pub fn jointly_safe(settings: &Settings, bounds: &Bounds, limits: &Limits) -> Result<(), Refusal> {
    at_least("speed in mm/s", limits.least_speed_mm_s, settings.speed_mm_s)?;
    let margin = least_margin_mm(settings.speed_mm_s, bounds, limits);
    at_least("margin in mm", margin, settings.margin_mm)?;
    at_least("confidence to arm in permille", u32::from(settings.keep_permille) + APART_PERMILLE, settings.arm_permille)
}

/// The bounds of the platform under these settings; none is loosened beyond the limits of [`jointly_safe`].
pub fn tighten_bounds(settings: &Settings, platform: &Bounds) -> Bounds {
    let speed = u32::from(settings.speed_mm_s);
    Bounds {
        max_speed_mm_s: platform.max_speed_mm_s.min(speed),
        degraded_speed_mm_s: platform.degraded_speed_mm_s.min(speed),
        fence_margin_mm: u32::from(settings.margin_mm),
        designation_confidence: settings.arm_permille,
        designation_keep: settings.keep_permille,
        ..*platform
    }
}

/// Way driven blind before the brakes take hold, beyond the guard's own allowance, and the fix's error.
fn least_margin_mm(speed_mm_s: u16, bounds: &Bounds, limits: &Limits) -> u32 {
    let blind_ms = (bounds.product_limit_ms + bounds.control_period_ms).max(bounds.set_point_lease_ms);
    // A slower body reacts later, which is no time in which its place may be older.
    let reaction_ms = u64::from(limits.reaction_ms).min(READING_AND_PLANT_MS + bounds.control_period_ms);
    let beyond_ms = blind_ms.saturating_sub(reaction_ms) as f64;
    (f64::from(speed_mm_s) * beyond_ms / 1000.0) as u32 + ERROR_MM
}

fn at_least(what: &'static str, least: u32, got: u16) -> Result<(), Refusal> {
    let got = u32::from(got);
    if got >= least { Ok(()) } else { Err(Refusal::Joint { what, least, got }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLATFORM: Settings = Settings { speed_mm_s: 3000, margin_mm: 1000, arm_permille: 600, keep_permille: 450 };

    #[test]
    fn platform_bounds_are_narrowly_jointly_safe() {
        let bounds = Bounds::GROUND;
        assert_eq!(jointly_safe(&PLATFORM, &bounds, &Limits::GROUND), Ok(()));
        assert_eq!(tighten_bounds(&PLATFORM, &bounds), bounds);
        let narrow = Settings { margin_mm: 999, ..PLATFORM };
        let refusal = Refusal::Joint { what: "margin in mm", least: 1000, got: 999 };
        assert_eq!(jointly_safe(&narrow, &bounds, &Limits::GROUND), Err(refusal));
    }

    /// A margin that suffices at walking pace is too narrow at full speed.
    #[test]
    fn narrow_margin_suffices_at_walking_pace() {
        let slow = Settings { speed_mm_s: 500, margin_mm: 500, ..PLATFORM };
        assert_eq!(jointly_safe(&slow, &Bounds::GROUND, &Limits::GROUND), Ok(()));
        assert!(jointly_safe(&Settings { speed_mm_s: 1500, ..slow }, &Bounds::GROUND, &Limits::GROUND).is_err());
    }

    /// DEGRADED is flown as a circle there, at a speed that the setting must not forbid.
    #[test]
    fn wing_is_set_no_slower_than_its_circle() {
        let limits = Limits { free: true, least_speed_mm_s: 1800, ..Limits::GROUND };
        let set = |speed_mm_s| jointly_safe(&Settings { speed_mm_s, ..PLATFORM }, &Bounds::GROUND, &limits);
        assert_eq!(set(1800), Ok(()));
        assert_eq!(set(1799), Err(Refusal::Joint { what: "speed in mm/s", least: 1800, got: 1799 }));
    }

    #[test]
    fn armable_track_is_not_given_up_at_once() {
        let flicker = Settings { arm_permille: 600, keep_permille: 600, ..PLATFORM };
        assert!(matches!(
            jointly_safe(&flicker, &Bounds::GROUND, &Limits::GROUND),
            Err(Refusal::Joint { least: 700, got: 600, .. })
        ));
    }
}
