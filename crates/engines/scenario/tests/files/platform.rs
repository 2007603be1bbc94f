//! Platform files: each mistake by its message and its place, defaults, and the shipped files.

use std::fs;
use std::path::{Path, PathBuf};

use config::platform::{Body, FixedWing, Limits, Multirotor, Sensors, Vehicle};
use scenario::{
    Name, Problems, find_root, load_platform, parse_platform, platform_files, platform_schema, platform_template,
};

fn root() -> PathBuf {
    find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// Text of a shipped platform.
fn shipped(name: &str) -> String {
    fs::read_to_string(root().join(format!("platforms/{name}.toml"))).unwrap()
}

fn ground() -> String {
    shipped("ground")
}

/// The ground platform with one of its lines changed.
fn parse_changed(line: &str, changed: &str) -> Result<scenario::Platform, Problems> {
    let text = ground();
    assert_eq!(text.matches(line).count(), 1, "{line} is not one line");
    parse_platform("ground.toml", "ground", &text.replace(line, changed))
}

/// Each line of the ground platform with a value just beyond the limit that another value sets, and the reason.
const APART: [(&str, &str, &str); 47] = [
    ("name = \"ground\"", "name = \"grund\"", "the file is named `ground`"),
    ("grant_period_ms = 100", "grant_period_ms = 500", "not shorter than the lease it renews"),
    ("telemetry_period_ms = 100", "telemetry_period_ms = 300", "not shorter than the freshness window"),
    ("telemetry_period_ms = 100", "telemetry_period_ms = 78", "32 reports are over before an order that names one"),
    ("control_period_ms = 50", "control_period_ms = 300", "not shorter than the lease of the set-points it renews"),
    ("challenge_period_ms = 1000", "challenge_period_ms = 3000", "not shorter than the time for which an echo serves"),
    (
        "set_point_lease_ms = 300",
        "set_point_lease_ms = 1001",
        "the plant honours no longer lease: at most 1000 ms expected, got 1001",
    ),
    ("to_degraded_ms = 500", "to_degraded_ms = 1001", "later than the bound to hold-safe"),
    ("\nlease_ms = 500", "\nlease_ms = 651", "after a lost uplink the lease lapses"),
    ("unrecovered_ms = 400", "unrecovered_ms = 601", "after lost localisation the unit holds"),
    ("product_limit_ms = 300", "product_limit_ms = 451", "after a lost product the unit degrades"),
    ("track_limit_ms = 500", "track_limit_ms = 501", "a designated track outlives Td"),
    ("degraded_speed_mm_s = 1000", "degraded_speed_mm_s = 3001", "DEGRADED is faster than the largest speed"),
    ("fence_margin_mm = 1000", "fence_margin_mm = 899", "a fresh position may be off by more than the margin"),
    (
        "fence_margin_mm = 1000",
        "fence_margin_mm = 999",
        "a unit that loses its position at the margin leaves the fence",
    ),
    ("designation_mm = 2000", "designation_mm = 1799", "an object may have left the designated place"),
    (
        "designation_confidence = 600",
        "designation_confidence = 549",
        "a newly designated track may be given up at once",
    ),
    ("teammate_slack_mm = 1500", "teammate_slack_mm = 1439", "an honest teammate's slipping wheels"),
    ("braking_m_s2 = 4.0", "braking_m_s2 = 3.9", "on the steepest ground the brakes miss `braking_mm_s2`"),
    ("max_speed_m_s = 3.0", "max_speed_m_s = 2.9", "the vehicle never reaches `max_speed_mm_s`"),
    ("exclusion_mm = 1500", "exclusion_mm = 1601", "two units may truly stand nearer than that"),
    ("max_curvature_per_m = 0.4 ", "max_curvature_per_m = 0.84 ", "the front wheels steer by more than 45°"),
    ("track_m = 0.9", "track_m = 0.4", "the vehicle tips over at its largest speed and curvature"),
    ("wheel_radius_m = 0.3", "wheel_radius_m = 0.61", "front and rear wheels overlap"),
    ("spring_rate = 30.0", "spring_rate = 5.0", "at rest the springs give by more than their travel"),
    ("chassis_m = [1.6, 0.9, 0.44]", "chassis_m = [1.6, 0.9, 1.2]", "the chassis stands on the ground"),
    ("width = 160", "width = 320", "the shipped networks were trained on images of 160 × 120 pixels"),
    ("height = 120", "height = 240", "the shipped networks were trained on images of 160 × 120 pixels"),
    (
        "field_of_view_deg = 90.0",
        "field_of_view_deg = 60",
        "the shipped networks were trained on images of 160 × 120 pixels",
    ),
    ("pitch_deg = 0.0", "pitch_deg = 5", "corroboration takes the optical axis for level: 0 expected, got 5"),
    ("rings = 16 ", "rings = 32 ", "the LiDAR stage's thresholds are derived for 16 rings"),
    ("azimuths = 360", "azimuths = 720", "the LiDAR stage's thresholds are derived for 16 rings"),
    ("lowest_deg = -15.0", "lowest_deg = -20", "the LiDAR stage's thresholds are derived for 16 rings"),
    ("ring_step_deg = 2.0", "ring_step_deg = 1", "the LiDAR stage's thresholds are derived for 16 rings"),
    ("reaction_ms = 150", "reaction_ms = 149", "the unit reacts no sooner"),
    ("fix_gate_mm = 500", "fix_gate_mm = 761", "a jump of fixes that passes the gate"),
    ("unobserved_mm = 2500", "unobserved_mm = 2399", "without odometry the unit gets further before it stands"),
    ("comfort_mm_s2 = 1000", "comfort_mm_s2 = 3001", "driving plans with stronger brakes than `braking_mm_s2`"),
    ("turning_mm_s = 800", "turning_mm_s = 3001", "turning is faster than the largest speed"),
    ("lookahead_mm = [1500, 4000]", "lookahead_mm = [4001, 4000]", "the shortest lookahead is longer than the longest"),
    ("corridor_mm = 1200", "corridor_mm = 449", "the vehicle is wider than the way that is kept free ahead"),
    ("standoff_mm = 3000", "standoff_mm = 799", "the vehicle's front reaches the obstacle"),
    ("plan_clearance_mm = 1500", "plan_clearance_mm = 499", "a planned way leaves too little room"),
    (
        "action = \"stop\"",
        "action = \"loiter\"",
        "unknown variant `loiter`, expected one of `stop`, `loiter-then-land`, `hold-then-sun`",
    ),
    ("mass_kg = 300.0", "mass_kg = -1", "-1 is out of range, expected 1 to 10000"),
    ("mass_kg = 300.0", "mass_kg = nan", "NaN is not a finite number"),
    ("steering_rad_s = 1.5", "wheels = 6", "unknown field `wheels`"),
];

/// Each change of a line of this shipped platform is refused for its reason, at the value, with a remedy.
fn assert_told(name: &str, mistakes: &[(&str, &str, &str)]) {
    let text = shipped(name);
    for (line, changed, reason) in mistakes {
        assert_eq!(text.matches(line).count(), 1, "{line} is not one line");
        let problems = parse_platform(&format!("{name}.toml"), name, &text.replace(line, changed));
        let problems = problems.err().unwrap_or_else(|| panic!("{changed} is taken"));
        let told = problems.all().iter().find(|problem| problem.message().starts_with(reason));
        let told = told.unwrap_or_else(|| panic!("{changed}: {problems}"));
        let marked = told.marked().unwrap_or_else(|| panic!("{changed}: no place"));
        assert!(changed.contains(marked) || marked.contains(changed), "{changed}: {marked}");
        assert!(!told.remedy().is_empty() && told.line_column().is_some());
    }
}

#[test]
fn mistakes_on_the_ground_are_told_at_their_values() {
    assert_told("ground", &APART);
}

/// The last of each pair still passes: a check that refuses everything finds nothing.
#[test]
fn values_at_their_limit_are_taken() {
    for (line, changed) in [
        ("\nlease_ms = 500", "\nlease_ms = 650"),
        ("unrecovered_ms = 400", "unrecovered_ms = 600"),
        ("designation_mm = 2000", "designation_mm = 1800"),
        ("teammate_slack_mm = 1500", "teammate_slack_mm = 1440"),
        ("exclusion_mm = 1500", "exclusion_mm = 1600"),
        ("fix_gate_mm = 500", "fix_gate_mm = 760"),
        ("unobserved_mm = 2500", "unobserved_mm = 2400"),
        ("corridor_mm = 1200", "corridor_mm = 450"),
    ] {
        parse_changed(line, changed).unwrap_or_else(|problems| panic!("{changed}: {problems}"));
    }
}

/// Each line of the air platform with a value just beyond the limit that another value sets, and the reason.
const APART_ALOFT: [(&str, &str, &str); 20] = [
    ("acceleration_m_s2 = [1.5, 2.5]", "acceleration_m_s2 = [1.5, 1.9]", "the body brakes less than `braking_mm_s2`"),
    ("tilt_deg = 30.0", "tilt_deg = 29.0", "at its greatest tilt the body cannot brake as stated"),
    ("thrust_n = 5.0 ", "thrust_n = 3.0 ", "nine tenths of the rotors' thrust do not hold the body up"),
    ("max_speed_m_s = 3.0", "max_speed_m_s = 2.9", "the body never reaches `max_speed_mm_s`"),
    ("drift_m_s = 0.5", "drift_m_s = 3.1", "the safe motion is faster than the largest speed"),
    (
        "floor_ceiling_mm = [1500, 6000]",
        "floor_ceiling_mm = [2201, 6000]",
        "a height that is wrong by the gate puts the body below",
    ),
    (
        "floor_ceiling_mm = [1500, 6000]",
        "floor_ceiling_mm = [1500, 4799]",
        "a height that is wrong by the gate puts the body within",
    ),
    ("cruise_m = 3.0", "cruise_m = 3.9", "a run begins further from the height that is flown at than the gate"),
    ("height_gate_mm = 800", "height_gate_mm = 1001", "heights are believed that are wrong by more than the margin"),
    ("climb_mm_s = 800", "climb_mm_s = 1001", "the guards' climb is faster than the body's"),
    ("clearance_m = 1.0", "clearance_m = 2.3", "the least height above the surface below is not kept"),
    ("action = \"loiter-then-land\"", "action = \"stop\"", "a body that flies does not stop in the air"),
    ("exclusion_mm = 500", "exclusion_mm = 501", "two units may truly be nearer than that"),
    ("mass_kg = 1.0", "mass_kg = 0", "0 is out of range"),
    ("inertia_kg_m2 = [0.025, 0.025, 0.030]", "inertia_kg_m2 = [0, 0.025, 0.03]", "no body has these moments"),
    ("inertia_kg_m2 = [0.025, 0.025, 0.030]", "inertia_kg_m2 = [0.025, 0.025, 0.05]", "no body has these moments"),
    ("\ntorque_n_m = 0.1", "\ntorque_n_m = 0.0", "rotors without a torque cannot turn the body"),
    ("corridor_mm = 1200", "corridor_mm = 249", "the vehicle is wider than the way that is kept free ahead"),
    ("reaction_ms = 350", "reaction_ms = 149", "the unit reacts no sooner"),
    ("unobserved_mm = 3200", "unobserved_mm = 3149", "without odometry the unit gets further before it stands"),
];

#[test]
fn mistakes_in_the_air_are_told_at_their_values() {
    assert_told("air", &APART_ALOFT);
}

/// Each line of the platform on a fixed wing with a value just beyond the limit that another value sets, and the reason.
const APART_ON_A_WING: [(&str, &str, &str); 10] = [
    ("\nmax_speed_m_s = 3.0", "\nmax_speed_m_s = 2.9", "the body never reaches `max_speed_mm_s`"),
    ("min_speed_m_s = 1.5", "min_speed_m_s = 2.1", "the circle is slower than the least airspeed"),
    ("circle_m_s = 2.0", "circle_m_s = 2.6", "DEGRADED is flown as a circle, which is faster"),
    ("\nbank_deg = 45.0", "\nbank_deg = 20.0", "at its greatest bank and speed the body turns less"),
    ("circle_bank_deg = 13.5", "circle_bank_deg = 14.0", "the circle turns faster than a set-point may ask for"),
    ("stays_m = 5.5", "stays_m = 4.8", "the circle is wider than the place that it keeps to"),
    ("fence_margin_mm = 1000", "fence_margin_mm = 700", "at full speed the body flies further ahead"),
    ("exclusion_mm = 850", "exclusion_mm = 851", "two units may truly be nearer than that"),
    ("clearance_m = 1.0", "clearance_m = 2.3", "the least height above the surface below is not kept"),
    ("action = \"loiter-then-land\"", "action = \"stop\"", "a body that flies does not stop in the air"),
];

#[test]
fn mistakes_on_a_wing_are_told_at_their_values() {
    assert_told("wing", &APART_ON_A_WING);
}

/// Lines of the space platform, each with a value just beyond the limit that another value sets, and the reason that is
/// reported.
const APART_IN_ORBIT: [(&str, &str, &str); 11] = [
    (
        "acceleration_m_s2 = [1.5, 3.5]",
        "acceleration_m_s2 = [1.5, 2.9]",
        "the line of sight brakes less than `braking_mm_s2`",
    ),
    ("wheel_torque_n_m = 0.004", "wheel_torque_n_m = 0.0005", "the wheels cannot brake the line of sight as stated"),
    ("wheel_momentum_n_m_s = 0.015", "wheel_momentum_n_m_s = 0.002", "the wheels saturate at the largest speed"),
    ("max_speed_m_s = 3.0", "max_speed_m_s = 2.9", "the line of sight never reaches `max_speed_mm_s`"),
    ("safe_rate_rad_s = 0.05", "safe_rate_rad_s = 0.01", "the safe motion is slower than the way into it"),
    (
        "battery = [75.0, 0.8, 0.3]",
        "battery = [75.0, 0.2, 0.3]",
        "a run begins below the charge that the safe mode needs",
    ),
    ("97.5000 250.0000", "97.5001 250.0000", "the elements are those of no orbit"),
    ("0  9991\"", "0  999\"", "a line of elements has 69 characters"),
    ("exclusion_mm = 0 ", "exclusion_mm = 1 ", "two units may truly"),
    ("inertia_kg_m2 = [0.06, 0.10, 0.13]", "inertia_kg_m2 = [0.001, 0.001, 0.13]", "no body has these moments"),
    ("action = \"hold-then-sun\"", "action = \"stop\"", "a satellite neither stops nor lands"),
];

#[test]
fn mistakes_in_orbit_are_told_at_their_values() {
    assert_told("space", &APART_IN_ORBIT);
}

#[test]
fn a_body_that_flies_comes_alone_and_with_its_limits_of_height() {
    let text = shipped("air");
    let (before, aloft) = text.split_once("[aloft]").unwrap();
    let problems =
        parse_platform("air.toml", "air", &format!("{before}[safe]{}", aloft.split_once("[safe]").unwrap().1))
            .unwrap_err();
    assert!(
        problems.all().iter().any(|p| p.message().starts_with("a body that flies without limits of height")),
        "{problems}"
    );
    let wing = shipped("wing");
    let wing = wing.split_once("[fixed_wing]").unwrap().1.split_once("[camera]").unwrap().0;
    let both = text.replace("[camera]", &format!("[fixed_wing]{wing}[camera]"));
    let problems = parse_platform("air.toml", "air", &both).unwrap_err();
    assert!(
        problems.all().iter().any(|p| p.message().starts_with("a body on rotors and on a fixed wing")),
        "{problems}"
    );
    let ground = ground().replace("[safe]", &format!("[aloft]{}[safe]", aloft.split_once("[safe]").unwrap().0));
    let problems = parse_platform("ground.toml", "ground", &ground).unwrap_err();
    assert!(
        problems.all().iter().any(|p| p.message().starts_with("limits of height without a body that flies")),
        "{problems}"
    );
}

#[test]
fn remedy_names_the_schema_of_platforms() {
    let problems = parse_changed("mass_kg = 300.0", "mass = 300.0").unwrap_err();
    let remedy = problems.all()[0].remedy();
    assert!(
        remedy.contains("did you mean `mass_kg`?") && remedy.contains("`holdsafe scenario schema --platform`"),
        "{remedy}"
    );
}

/// As written out, and as left out.
#[test]
fn ground_has_the_numbers_of_wire() {
    let text = ground();
    let (bounds, _) = text.split_once("[vehicle]").unwrap();
    for text in [text.as_str(), bounds] {
        let platform = parse_platform("ground.toml", "ground", text).unwrap();
        assert_eq!(platform.vehicle(), Vehicle::GROUND);
        assert_eq!(platform.sensors(), Sensors::GROUND);
        assert_eq!(platform.limits(), Limits::GROUND);
    }
}

#[test]
fn air_has_the_numbers_of_wire() {
    let platform = load_platform(&root().join("platforms/air.toml")).unwrap();
    assert_eq!(platform.body(), Body::Multirotor(Multirotor::SIH));
    let limits = platform.limits();
    assert_eq!((limits.rear_axle_mm, limits.aloft.unwrap().cruise_mm), (0, 3000));
    let platform = load_platform(&root().join("platforms/wing.toml")).unwrap();
    assert_eq!(platform.body(), Body::FixedWing(FixedWing::SLOW_FLYER));
}

#[test]
fn shipped_platforms_load_and_fit_their_schema() {
    let validator = jsonschema::validator_for(&platform_schema()).unwrap();
    let files = platform_files(&root()).unwrap();
    assert!(files.len() >= 4, "{files:?}");
    for file in files {
        load_platform(&file).unwrap_or_else(|problems| panic!("{}", problems.render(false)));
        let value: serde_json::Value = toml::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
        let errors: Vec<String> = validator.iter_errors(&value).map(|e| e.to_string()).collect();
        assert!(errors.is_empty(), "{}: {errors:?}", file.display());
    }
}

#[test]
fn template_passes_its_own_check() {
    let text = platform_template(&Name::new("rover").unwrap());
    let platform = parse_platform("rover.toml", "rover", &text).unwrap();
    assert_eq!((platform.name.as_str(), platform.limits()), ("rover", Limits::GROUND));
}

/// The networks for views from the air were trained with the camera that these two have in flight.
#[test]
fn camera_in_flight_is_that_of_the_networks() {
    for name in ["air", "wing"] {
        let platform = load_platform(&root().join(format!("platforms/{name}.toml"))).unwrap();
        assert_eq!(platform.seen_from().camera, Sensors::ALOFT.camera, "{name}");
        assert!(platform.is_trained_for(), "{name}");
    }
    assert_eq!(load_platform(&root().join("platforms/air.toml")).unwrap().seen_from(), Sensors::ALOFT);
    for (name, trained) in [("ground", true), ("courier", true), ("space", false)] {
        assert_eq!(
            load_platform(&root().join(format!("platforms/{name}.toml"))).unwrap().is_trained_for(),
            trained,
            "{name}"
        );
    }
}
