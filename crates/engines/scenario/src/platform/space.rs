//! The table of a platform in an orbit, and its checks: a satellite in place of `[vehicle]`.
//!
//! Ranges are held by the types; the values' meaning is given by `config::platform`.

use config::platform::{Line, Satellite};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spacecraft::region::Region;

use super::Platform;
use super::check::{at_least, at_most, inertia, unless};
use super::tables::SafeAction;
use crate::finding::Finding;
use crate::value::{Located, Real, Text};

/// A small satellite on three wheels, in place of `[vehicle]`. Speeds apply to the point that its payload looks at, in metres of the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SatelliteTable {
    /// Moments of inertia about x, y and z, kg·m².
    pub inertia_kg_m2: Located<[Real<1, 1_000_000>; 3]>,
    /// Greatest torque of a wheel, N·m.
    pub wheel_torque_n_m: Located<Real<0, 1_000>>,
    /// Greatest momentum of a wheel, N·m·s.
    pub wheel_momentum_n_m_s: Located<Real<0, 10_000>>,
    /// Greatest dipole of a magnetic torquer, A·m².
    pub torquer_a_m2: Real<0, 1_000_000>,
    /// Natural frequency of the attitude controller, rad/s, and its damping ratio.
    pub controller: [Real<10, 10_000>; 2],
    /// Greatest speed of a set-point, m/s.
    pub max_speed_m_s: Located<Real<100, 30_000>>,
    /// Greatest turn of a set-point, rad/s.
    pub max_turn_rad_s: Real<10, 6_000>,
    /// Change of the speed that the controller follows, speeding up and braking, m/s².
    pub acceleration_m_s2: Located<[Real<100, 20_000>; 2]>,
    /// Rate and acceleration of a slew to the sun, rad/s and rad/s².
    pub slew: Located<[Real<1, 1_000>; 2]>,
    /// Greatest rate of the safe motion, rad/s.
    pub safe_rate_rad_s: Located<Real<1, 1_000>>,
    /// Time for which the body keeps pointing at its place without set-points, payload shut, seconds. Its array then
    /// turns to the sun.
    pub hold_s: Real<0, 3_600_000>,
    /// Least angle between the open payload's line of sight and the sun, degrees.
    pub keep_out_deg: Real<1_000, 90_000>,
    /// Capacity of the battery, W·h; the charge at the start of a run and the least of its safe mode, as shares.
    pub battery: Located<[Real<1, 10_000_000>; 3]>,
    /// Power of the array at normal incidence, and of the loads, W.
    pub power_w: [Real<0, 10_000_000>; 2],
    /// Two lines of orbital elements (TLE).
    pub elements: Located<[Text<69>; 2]>,
    /// Start of a run after the elements' epoch, and the time after that at which the satellite is overhead, seconds.
    pub start_overhead_s: Located<[Real<0, 600_000_000>; 2]>,
    /// Metres on the ground for each metre of the map.
    pub scale_m: Located<Real<1_000, 100_000_000>>,
    /// Distance from the line of sight to a catalogued place that is still in view, m.
    pub view_m: Located<Real<1_000, 1_000_000>>,
}

impl SatelliteTable {
    /// The body as the simulation knows it; none while its lines are no elements.
    pub(super) fn body(&self) -> Option<Satellite> {
        let line = |k: usize| Line::try_from(self.elements[k].as_str().to_owned()).ok();
        Some(Satellite {
            inertia_kg_m2: self.inertia_kg_m2.map(|i| i.get()),
            wheel_torque_n_m: self.wheel_torque_n_m.get(),
            wheel_momentum_n_m_s: self.wheel_momentum_n_m_s.get(),
            torquer_a_m2: self.torquer_a_m2.get(),
            controller: self.controller.map(|c| c.get()),
            max_speed_m_s: self.max_speed_m_s.get(),
            max_turn_rad_s: self.max_turn_rad_s.get(),
            acceleration_m_s2: self.acceleration_m_s2.map(|a| a.get()),
            slew: self.slew.map(|s| s.get()),
            safe_rate_rad_s: self.safe_rate_rad_s.get(),
            hold_s: self.hold_s.get(),
            keep_out_deg: self.keep_out_deg.get(),
            battery: self.battery.map(|share| share.get()),
            power_w: self.power_w.map(|w| w.get()),
            elements: [line(0)?, line(1)?],
            start_overhead_s: self.start_overhead_s.map(|s| s.get()),
            scale_m: self.scale_m.get(),
            view_m: self.view_m.get(),
        })
    }
}

/// Every mistake in the table.
pub(super) fn check(platform: &Platform, table: &SatelliteTable) -> Vec<Finding> {
    let Some(body) = table.body() else {
        let short = unless(
            &table.elements,
            false,
            || "a line of elements has 69 characters of ASCII".to_owned(),
            "give the two lines as they are published",
        );
        return short.into_iter().collect();
    };
    let mixed = platform.multirotor.is_some() || platform.aloft.is_some();
    if let Some(found) = unless(
        &table.elements,
        !mixed,
        || "a satellite beside a body on rotors or limits of height".to_owned(),
        "take out `[multirotor]` and `[aloft]`",
    ) {
        return vec![found];
    }
    let Ok(region) = Region::new(&body.pass()) else {
        let none =
            unless(&table.elements, false, || "the elements are those of no orbit".to_owned(), "check the lines");
        return none.into_iter().collect();
    };
    let height_m = region.moment_at(body.start_overhead_s[1]).local_m[2];
    [turns(platform, table, &body, height_m), keeps(table, &body)].into_iter().flatten().collect()
}

/// The wheels against the speeds that are asked of them.
fn turns(platform: &Platform, table: &SatelliteTable, body: &Satellite, height_m: f64) -> Vec<Finding> {
    let b = &platform.bounds;
    let per_m = body.scale_m / height_m;
    let largest = body.inertia_kg_m2.into_iter().fold(0.0, f64::max);
    let [_, slower] = body.acceleration_m_s2;
    // The ground passes below at 7.6 km/s.
    let passes = 7600.0 / height_m;
    let rate = body.max_speed_m_s * per_m + passes;
    let found = [
        inertia(&table.inertia_kg_m2, body.inertia_kg_m2),
        at_least(
            &table.acceleration_m_s2,
            (slower, b.braking_mm_s2.get() as f64 / 1000.0),
            "m/s²",
            "the line of sight brakes less than `braking_mm_s2`",
            "state stronger braking, or lower `braking_mm_s2`",
        ),
        at_least(
            &table.wheel_torque_n_m,
            (1000.0 * body.wheel_torque_n_m, 1000.0 * largest * slower * per_m),
            "mN·m",
            "the wheels cannot brake the line of sight as stated (largest moment, map's scale by the height)",
            "state stronger wheels, or less braking",
        ),
        at_least(
            &table.wheel_momentum_n_m_s,
            (1000.0 * body.wheel_momentum_n_m_s, 1000.0 * largest * rate),
            "mN·m·s",
            "the wheels saturate at the largest speed while the ground passes below",
            "state larger wheels, or a lower speed",
        ),
        at_most(
            &b.exclusion_mm,
            (b.exclusion_mm.get() as f64, 0.0),
            "mm",
            "two units may truly look at one place",
            "state 0",
        ),
        at_least(
            &table.max_speed_m_s,
            (body.max_speed_m_s, b.max_speed_mm_s.get() as f64 / 1000.0),
            "m/s",
            "the line of sight never reaches `max_speed_mm_s`, from which the margins are derived",
            "lower `max_speed_mm_s`, or state a faster body",
        ),
        at_least(
            &table.safe_rate_rad_s,
            (1000.0 * body.safe_rate_rad_s, 1000.0 * rate.max(body.slew[0])),
            "mrad/s",
            "the safe motion is slower than the way into it (the ground that passes below, the slew to the sun)",
            "raise it, or slow the slew",
        ),
    ];
    found.into_iter().flatten().collect()
}

fn keeps(table: &SatelliteTable, body: &Satellite) -> Vec<Finding> {
    let [_, start, least] = body.battery;
    let found = [at_most(
        &table.battery,
        (least, start),
        "",
        "a run begins below the charge that the safe mode needs",
        "raise the charge, or lower the least",
    )];
    found.into_iter().flatten().collect()
}

/// The safe action of a satellite.
pub(super) fn safe(platform: &Platform) -> Vec<Finding> {
    let action = &platform.safe.action;
    let suns = || "a satellite neither stops nor lands".to_owned();
    unless(action, **action == SafeAction::HoldThenSun, suns, "state `action = \"hold-then-sun\"`")
        .into_iter()
        .collect()
}
