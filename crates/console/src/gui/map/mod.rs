//! The map from above, north up: the planned site, the units with the way that they have come, their tracks, and how
//! far each may have gone since it was seen.
//!
//! Data fills the pane but for its left and lower edge, where numbers, scale, legend and buttons stand. Seeing is
//! `camera`'s; the planned site is `plan`'s, `fence`'s and `contour`'s; moving things are `things`' and `trail`'s; labels
//! are `writing`'s, their words `words`', their places `labels`'; `paint` draws the rest.

mod camera;
mod contour;
mod fence;
mod labels;
mod legend;
mod paint;
mod plan;
mod things;
mod trail;
mod words;
mod writing;

use eframe::egui::{Id, Role, Sense, Ui, WidgetInfo};
use wire::event::Freshness;
use wire::report::ReportedTrack;

pub(super) use self::camera::Camera;
pub(super) use self::writing::Sides;

use self::camera::View;
use self::labels::Obstacles;
use self::paint::Dimension;
use self::things::Thing;
use self::trail::Trail;
use self::writing::{LeftOut, Writing};
use super::keys;
use super::marks::Tone;
use super::theme::Palette;
use super::view_state::ViewState;
use crate::shown::{Shown, ShownUnit};
use crate::site::{GroundPoint, Site};

/// Click distance, points.
const REACH: f32 = 14.0;

/// Draws the map.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, site: &Site, shown: &Shown) {
    let pane = ui.available_rect_before_wrap();
    ui.allocate_rect(pane, Sense::hover());
    let data = legend::data(pane);
    let id: Id = ui.scope_id().with("map");
    let response = ui.interact(data, id, Sense::click_and_drag());
    let fitted = Camera::over(&visible_places(site, shown), data);
    let followed = shown.unit(view_state.unit).map(unit_place);
    let view = camera::steer(ui, &response, view_state, fitted, followed);

    let palette = Palette::current(ui);
    let painter = ui.painter_at(data);
    painter.rect_filled(data, 0.0, palette.ground);
    let contours = plan::draw(&painter, palette, site, shown, view_state, &view);
    let trails: Vec<Trail> =
        shown.units.iter().map(|unit| Trail::new(unit, shown, &view, unit.unit == view_state.unit)).collect();
    trails.iter().for_each(|trail| trail.draw(&painter, palette));
    let dimension = dimension(view_state, site, shown, &view);
    dimension.iter().for_each(|dimension| paint::dimension(&painter, palette, dimension));
    let things = things::all(view_state, site, shown, &view);
    let crowded = paint::things(&painter, palette, &things);
    let obstacles = obstacles(site, &view, &trails, dimension.as_ref());
    let last = std::mem::take(&mut view_state.label_sides);
    let writing = Writing { painter: &painter, palette, obstacles, last };
    let (sides, left_out) = writing.write(&things, dimension.as_ref(), &trails);
    view_state.label_sides = sides;

    let track = response.interact_pointer_pos().and_then(|to| things::nearest_track(&things, to, REACH));
    if let Some((unit, track)) = track.filter(|_| response.clicked()) {
        view_state.look_at(unit, track);
    }
    let description = describe(view_state, site, shown, &things, &view, left_out);
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, description.clone()));
    if response.has_focus() {
        keys::frame(ui, data);
    }
    legend::axes(&ui.painter_at(pane), palette, site, &view);
    legend::footer(ui, view_state, site, shown, view, &notes(left_out, crowded), contours);
}

/// True if a track is less sure than an arming of its unit asks for.
pub(super) fn unsure(unit: &ShownUnit, track: &ReportedTrack, shown: &Shown) -> bool {
    track.confidence < unit.settings(&shown.bounds).arm_permille
}

/// A place by its millimetres.
fn place(x_mm: i32, y_mm: i32) -> GroundPoint {
    [x_mm as f32 / 1000.0, y_mm as f32 / 1000.0]
}

fn unit_place(unit: &ShownUnit) -> GroundPoint {
    let pose = unit.pose.get().0;
    place(pose.x_mm, pose.y_mm)
}

fn visible_places(site: &Site, shown: &Shown) -> Vec<GroundPoint> {
    site.fence.iter().chain(&site.route).copied().chain(shown.units.iter().map(unit_place)).collect()
}

/// The chosen unit's distance to the fence.
fn dimension(view_state: &ViewState, site: &Site, shown: &Shown, view: &View) -> Option<Dimension> {
    let unit = shown.unit(view_state.unit)?;
    let at = unit_place(unit);
    let nearest = fence::nearest(&site.fence, at)?;
    let was = if unit.pose.freshness() > Freshness::Late { "was " } else { "" };
    let outside = if nearest.metres < 0.0 { " outside" } else { "" };
    let tone = match (was.is_empty(), outside.is_empty()) {
        (_, false) => Tone::Alarm,
        (true, true) => Tone::Normal,
        (false, true) => Tone::Weak,
    };
    let text = format!("{was}{}{outside}", words::distance(site, nearest.metres.abs()));
    Some(Dimension { ends: [view.position(at), view.position(nearest.on)], text, tone })
}

fn obstacles(site: &Site, view: &View, trails: &[Trail], dimension: Option<&Dimension>) -> Obstacles {
    let mut obstacles = Obstacles {
        area: view.rect,
        solid: Vec::new(),
        units: Vec::new(),
        tracks: Vec::new(),
        lines: Vec::new(),
        leaders: Vec::new(),
    };
    plan::paths(site, view).iter().for_each(|path| obstacles.add_path(path));
    trails.iter().flat_map(Trail::paths).for_each(|path| obstacles.add_path(path));
    dimension.iter().for_each(|dimension| obstacles.add_path(&dimension.ends));
    obstacles
}

/// Notes of the row below the data on all that is left out.
fn notes(LeftOut { units, tracks }: LeftOut, crowded: bool) -> Vec<String> {
    let mut notes = Vec::new();
    if units > 0 {
        notes.push(format!("{units} units unlabelled"));
    }
    if tracks > 0 {
        notes.push(format!("{tracks} unlabelled"));
    }
    if crowded {
        notes.push("circles of units only".to_owned());
    }
    notes
}

/// Description of the map for screen readers.
fn describe(
    view_state: &ViewState,
    site: &Site,
    shown: &Shown,
    things: &[Thing],
    view: &View,
    left_out: LeftOut,
) -> String {
    let units = shown.units.len();
    let worse = things.iter().filter(|thing| thing.freshness != Freshness::Fresh).count();
    let passed = things.iter().filter(|thing| thing.is_passed()).count();
    let [east, north] = view.camera.center.map(|metres| words::coordinate(site, metres));
    let unit = words::axis_unit(site);
    let across = words::coordinate(site, view.rect.width() / view.camera.scale);
    let mut parts = vec![
        format!("MAP {units} units, {} tracks, {worse} not fresh", things.len() - units),
        format!("{across} {unit} across about ({east}, {north}) {unit}, north up"),
    ];
    if passed > 0 {
        parts.push(format!("{passed} out of view"));
    }
    parts.extend(distances(view_state, site, shown));
    if let Some((reached, all)) = plan::reached(site, shown) {
        parts.push(format!("{reached} of {all} way points reached"));
    }
    if view_state.follow {
        parts.push(format!("follows {}", view_state.unit));
    }
    parts.extend(notes(left_out, false));
    parts.push(format!("circles at {}/s", words::distance(site, things::fastest(shown))));
    parts.push(legend::WORDS.to_owned());
    parts.join("; ")
}

/// The distance of each unit to the fence, the chosen one's beside the distance that it needs.
fn distances(view_state: &ViewState, site: &Site, shown: &Shown) -> Vec<String> {
    let mut all = Vec::new();
    for unit in &shown.units {
        let Some(nearest) = fence::nearest(&site.fence, unit_place(unit)) else { continue };
        let was = if unit.pose.freshness() > Freshness::Late { "was " } else { "" };
        let side = if nearest.metres < 0.0 { "outside of" } else { "from" };
        let far = words::distance(site, nearest.metres.abs());
        let needs = fence::stops_within(&unit.settings(&shown.bounds), &shown.bounds);
        let needs = if unit.unit == view_state.unit {
            format!(", stopped at full speed from {}", words::distance(site, needs))
        } else {
            String::new()
        };
        all.push(format!("{} {was}{far} {side} the fence{needs}", unit.unit));
    }
    all
}
