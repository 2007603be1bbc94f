//! The scenario's text: each number with a comment that names its source in the recording, and comments for the quantities that it cannot carry.

use core::fmt::Write as _;

use wire::settings::{RANGES, Settings};

use super::Wanted;
use super::error::SceneError;
use super::part::Part;
use super::route::Route;
use super::shown::Shown;
use crate::Terms;
use crate::map::Map;

/// Longest trial, seconds.
pub(super) const LONGEST_S: f64 = 7200.0;
/// Time beside the way: the operator's orders, and the stop at the end, seconds.
const SPARE_S: f64 = 15.0;
/// Longest way a second of the trial, as a share of the speed: bends and way points are taken slowly.
const PACE: f64 = 0.6;
/// Range of the factor on the noise of all sensors: the least that a scenario has, and the greatest at which the judge's tolerances were seen to hold (59
/// trials). From 4 on it takes the noise of odometry for a pose that refused fixes moved (P5).
const NOISE: (f64, f64) = (0.1, 3.0);
/// Factor from which on a stated deviation is named beside the measured noise.
const WANDERS: f64 = 2.0;
/// Longest passage of the recording's own words in a comment, characters.
const MAX_QUOTED: usize = 200;

/// Everything that the text is made of.
pub(super) struct Sources<'a> {
    pub(super) map: &'a Map,
    pub(super) terms: &'a Terms,
    pub(super) wanted: &'a Wanted<'a>,
    pub(super) part: &'a Part,
    /// Median and nine tenths of a flight's heights, metres.
    pub(super) heights: Option<[f64; 2]>,
    pub(super) shown: &'a Shown,
    pub(super) route: &'a Route,
}

/// Writes the scenario.
///
/// # Errors
/// When it would take longer than a trial may.
pub(super) fn write(sources: &Sources<'_>) -> Result<String, SceneError> {
    let setting = speed_setting(sources);
    let speed_m_s = setting.map_or(f64::from(sources.terms.bounds.max_speed_mm_s), f64::from) / 1000.0;
    let seconds = libm::ceil(sources.route.way_m / (PACE * speed_m_s) + SPARE_S);
    if seconds > LONGEST_S {
        return Err(SceneError::Long { seconds });
    }
    let parts = [head(sources, seconds), noise(sources), scene(sources), operator(sources, setting), faults(sources)];
    Ok(parts.concat())
}

/// Words of others on one line of a comment.
fn quoted(text: &str) -> String {
    text.chars().take(MAX_QUOTED).flat_map(char::escape_debug).collect()
}

fn head(sources: &Sources<'_>, seconds: f64) -> String {
    let Sources { map, wanted, part, route, .. } = sources;
    let of_parts = match part.of {
        1 => String::new(),
        of => format!(
            ", from the longest of {of} parts (number {}, {:.1} s after the first fix)",
            part.number, part.start_s
        ),
    };
    format!(
        "# Made by `holdsafe assess` from a recording: the twin drives its route in the closed loop, where the guards act.\n\
         # Recording: {} (SHA-256 {})\n# Map: {}\n\
         # `holdsafe scenario check {name}.toml`, then `holdsafe run {name}.toml`. Add attacks as in `holdsafe scenario new`.\n\
         schema_version = 1\nname = \"{name}\"\ntitle = \"A recorded route in the closed loop\"\n\
         description = \"\"\"\nThe route of a recording of {:.0} s, without an attack. Where a guard trips, route, speed or noise of the recording are beyond the platform's limits.\n\"\"\"\n\
         threats = [\"N0\"]\nstride = []\ntechniques = []\ninterface = \"control\"\nevidence = \"model\"\nrequirement = \"runtime-assurance\"\n\
         expected = [\"NOMINAL\"]                   # no attack is made\npolicy = \"default\"\nplatform = \"{}\"\n\
         # {:.0} m of way at {PACE} of the set speed, and {SPARE_S} s: the recorded way{of_parts} took {:.0} s.\nduration_s = {seconds:.1}\n",
        quoted(wanted.recording),
        quoted(wanted.sha256),
        quoted(&map.title),
        part.seconds(),
        wanted.platform,
        route.way_m,
        part.seconds(),
        name = wanted.name,
    )
}

/// The noise of fixes as a factor on that of the twin.
fn noise(sources: &Sources<'_>) -> String {
    let Sources { shown, wanted, terms, .. } = sources;
    let [fixes, odometry] = shown.periods_s;
    let mut text = format!(
        "\n# Rates: a fix each {fixes:.2} s and odometry each {odometry:.2} s in the recording; the twin reads both each 0.05 s, which no key changes.\n"
    );
    let Some(noise_m) = shown.noise_m else {
        text += "# Noise: too few fixes near each other tell one; the twin's own is kept.\n";
        return text;
    };
    let factor = noise_m / wanted.twin_sigma_m;
    let rounded = libm::round(factor.clamp(NOISE.0, NOISE.1) * 100.0) / 100.0;
    let _infallible = writeln!(
        text,
        "# Noise: fixes scatter by {noise_m:.3} m on each axis beside odometry (median), the twin's by {} m. The factor is on every sensor of the twin.",
        wanted.twin_sigma_m
    );
    if rounded * wanted.twin_sigma_m < noise_m * 0.99 {
        let _infallible = writeln!(
            text,
            "# The factor would be {factor:.1}; {} is the greatest that the judge is made for.",
            NOISE.1
        );
    }
    if noise_m * 1000.0 > f64::from(terms.limits.fix_sigma_mm) {
        let _infallible = writeln!(
            text,
            "# The guards of `{}` believe {} mm at most (`fix_sigma_mm`) and may trip.",
            wanted.platform, terms.limits.fix_sigma_mm
        );
    }
    let _infallible = writeln!(text, "[models]\nnoise = {rounded:?}");
    text
}

fn scene(sources: &Sources<'_>) -> String {
    let Sources { map, route, heights, terms, .. } = sources;
    let zero = if map.fix.latitude.is_some() { "the first fix" } else { "the zero of the fixes" };
    let list =
        |points: &[[f64; 2]]| points.iter().map(|[x, y]| format!("[{x:?}, {y:?}]")).collect::<Vec<_>>().join(", ");
    let lines = |points: &[[f64; 2]]| points.chunks(6).map(|line| format!("    {},\n", list(line))).collect::<String>();
    let (start, heading) = route.start;
    let fence = match &route.fence {
        (_, true) => "The fence is that of the map".to_owned(),
        (_, false) => {
            format!("The fence is none of the recording's: a rectangle {} m around the route", route.margin_m)
        }
    };
    let bends = match terms.limits.curvature_per_km {
        per_km if per_km > 0 && !terms.limits.free => format!(
            "# Bends: `{}` turns within {:.1} m and drives around tighter ones.\n",
            sources.wanted.platform,
            1e3 / f64::from(per_km)
        ),
        _ => String::new(),
    };
    let flown = match (heights, terms.limits.aloft) {
        (Some([median, most]), Some(aloft)) => format!(
            "# Heights: {median:.1} m (median) to {most:.1} m (nine tenths) above the lowest place; the platform flies the whole route at {:.1} m.\n",
            f64::from(aloft.cruise_mm) / 1000.0
        ),
        (None, _) | (_, None) => String::new(),
    };
    format!(
        "\n# World: metres east and north of the point [{:?}, {:?}] from {zero}.\n# Route: places of the body's origin, reduced to {} way points; each recorded place is within \
         {} m of a leg.\n# {fence}.\n{bends}{flown}[scene]\nstart = {{ at_m = {}, heading_rad = {heading:?} }}\nroute = [\n{}]\ngeofence = [{}]\n\n\
         # No recording shows the ground or the objects of its place: the ground is flat, and `[[scene.object]]` adds objects.\n\
         [scene.ground]\namplitude_m = 0.0\n",
        route.shift_m[0],
        route.shift_m[1],
        route.points.len(),
        route.tolerance_m,
        list(&[start]),
        lines(&route.points),
        list(&route.fence.0),
    )
}

/// The recorded speed as an operator sets it, mm/s; none where no setting has it or the platform has it anyway.
fn speed_setting(sources: &Sources<'_>) -> Option<u16> {
    // A body that cannot stand circles at its own speeds, which a setting must not forbid.
    let may = sources.wanted.least_speed_m_s <= 0.0;
    let [speeds, ..] = &RANGES;
    let rounded = libm::ceil(sources.shown.speed_m_s * 10.0) * 100.0;
    let set = rounded.clamp(f64::from(*speeds.start()), f64::from(*speeds.end())) as u16;
    (may && f64::from(set) >= rounded && u32::from(set) < sources.terms.bounds.max_speed_mm_s).then_some(set)
}

/// The operator's orders: the speed of the recording, and the start.
fn operator(sources: &Sources<'_>, setting: Option<u16>) -> String {
    let Sources { shown, terms, .. } = sources;
    let most = f64::from(terms.bounds.max_speed_mm_s) / 1000.0;
    let comment = format!("# Speed: {:.2} m/s or less in 95 % of the recording", shown.speed_m_s);
    let set = match setting {
        Some(speed_mm_s) => {
            let Settings { margin_mm, arm_permille, keep_permille, .. } = Settings::from_bounds(&terms.bounds);
            format!(
                "{comment}; the other values are the platform's.\n[[operator.step]]\nat_s = 1.0\nwhen_state = \"IDLE\"\ndo = \"configure\"\n\
                 values = {{ speed_mm_s = {speed_mm_s}, margin_mm = {margin_mm}, arm_permille = {arm_permille}, keep_permille = {keep_permille} }}\n\
                 reason = \"speed of the recording\"\n\n"
            )
        }
        None => format!("{comment}; the platform's {most} m/s are kept, as no setting is nearer.\n"),
    };
    format!(
        "\n{set}[[operator.step]]\nat_s = 2.5\nwhen_state = \"IDLE\"\ndo = \"enable\"\nreason = \"start of the recorded route\"\n"
    )
}

/// Faults that the recording suggests, as comments: an uncommented one has other expected classes.
fn faults(sources: &Sources<'_>) -> String {
    let Sources { shown, .. } = sources;
    let mut text = String::new();
    let [began, lasted] = shown.silence_s;
    if lasted > WANDERS * shown.periods_s[0] {
        let _infallible = write!(
            text,
            "\n# The longest silence of fixes: {lasted:.2} s, {began:.1} s after the start. As a fault, with `expected = [\"DEGRADED\", \"HOLD_SAFE\"]`:\n\
             # [[fault]]\n# sensor = \"localisation\"\n# kind = \"dropout\"\n# at_s = 8.0\n# duration_s = {lasted:.2}\n"
        );
    }
    let wanders = |stated: &f64| shown.noise_m.is_some_and(|noise| *stated > WANDERS * noise);
    if let Some(stated_m) = shown.stated_m.filter(wanders) {
        let _infallible = write!(
            text,
            "\n# Fixes state a deviation of {stated_m:.2} m (median), more than they scatter: the rest is a bias that wanders slowly. As a fault, with\n\
             # `expected = [\"HOLD_SAFE\"]`:\n# [[fault]]\n# sensor = \"localisation\"\n# kind = \"wander\"\n# at_s = 8.0\n# duration_s = 40.0\n# magnitude = [{:.2}]\n",
            stated_m.min(100.0)
        );
    }
    text
}
