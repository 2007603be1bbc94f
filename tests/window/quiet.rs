//! A quiet picture: free of saturated colours, and of alarms. No pixels are drawn here, so colours are those of
//! the painted shapes, and their area is an upper bound.

use console::gui::theme::Palette;
use eframe::egui::accesskit::Toggled;
use eframe::egui::epaint::{Color32, ColorMode, Shape, Stroke};
use eframe::egui::{Rect, Theme, vec2};
use egui_kittest::kittest::{NodeT, Queryable};

use crate::painted::{self, Clipped};
use crate::scenes;
use crate::window::{Seated, seat, shows_text, sized, standing};

/// Difference of the largest and the smallest channel from which on a colour is saturated.
const SATURATED: u8 = 70;
/// Most of the window that may be saturated.
const MOST: f32 = 0.003;

/// A colour that is seen, and the area that has it at most, square points.
type Painted = (Color32, f32);

/// The colours of a shape.
fn colors(clipped: &Clipped) -> Vec<Painted> {
    let seen = painted::bounds(clipped);
    let area = if seen.is_positive() { seen.area() } else { 0.0 };
    let line = |stroke: &Stroke, long: f32| (stroke.color, (stroke.width * long).min(area));
    match &clipped.1 {
        Shape::Rect(rect) => {
            let around = 2.0 * (rect.rect.width() + rect.rect.height());
            vec![(rect.fill, area), line(&rect.stroke, around)]
        }
        Shape::Circle(circle) => vec![(circle.fill, area), line(&circle.stroke, std::f32::consts::TAU * circle.radius)],
        Shape::LineSegment { points: [from, to], stroke } => vec![(stroke.color, stroke.width * from.distance(*to))],
        Shape::Path(path) => {
            let long: f32 = path.points.windows(2).map(|ends| ends[0].distance(ends[1])).sum();
            let ColorMode::Solid(color) = path.stroke.color else { panic!("a line without a colour of its own") };
            vec![(path.fill, area), (color, path.stroke.width * long)]
        }
        Shape::Text(text) => {
            let own = |color| if color == Color32::PLACEHOLDER { text.fallback_color } else { color };
            let sections = text.galley.job.sections.iter().map(|section| own(section.format.color));
            sections.map(|color| (text.override_text_color.unwrap_or(color), area)).collect()
        }
        Shape::Band(band) => vec![(band.fill, area), (band.stroke.color, area)],
        Shape::Mesh(mesh) => mesh.vertices.iter().map(|vertex| (vertex.color, area)).collect(),
        Shape::Noop => Vec::new(),
        other => panic!("colours of {other:?} are not known here"),
    }
}

fn is_saturated(color: Color32) -> bool {
    let [r, g, b, _] = color.to_array();
    r.max(g).max(b) - r.min(g).min(b) > SATURATED
}

/// Texts and areas of all that is saturated and seen.
fn saturated(seated: &Seated) -> (Vec<(Color32, String)>, f32) {
    let shapes = painted::shapes(seated);
    let (mut all, mut area) = (Vec::new(), 0.0);
    for clipped in &shapes {
        let loud = colors(clipped).into_iter().filter(|(color, area)| *area > 0.0 && is_saturated(*color));
        for (color, share) in loud {
            let words = if let Shape::Text(text) = &clipped.1 { text.galley.text().to_owned() } else { String::new() };
            all.push((color, words));
            area += share;
        }
    }
    (all, area)
}

/// The selection is that of unit, track, tab and time.
#[test]
fn quiet_picture_is_grey_but_for_simulation_and_selection() {
    for (theme, palette) in [(Theme::Dark, Palette::DARK), (Theme::Light, Palette::LIGHT)] {
        for size in [vec2(1280.0, 800.0), vec2(1920.0, 1080.0)] {
            let seated = sized(scenes::nominal(), size, theme);
            let (all, area) = saturated(&seated);
            let alien = all.iter().filter(|(color, _)| *color != palette.mark);
            assert_eq!(alien.count(), 0, "{theme:?}, {size}: {all:?}");
            let selected = |words: &str| {
                let is = |node: &egui_kittest::Node<'_>| {
                    let this = node.accesskit_node();
                    this.label().is_some_and(|label| label == words) && this.toggled() == Some(Toggled::True)
                };
                seated.root().children_recursive().any(|node| is(&node))
            };
            let said: Vec<&str> =
                all.iter().map(|(_, words)| words.as_str()).filter(|words| !words.is_empty()).collect();
            assert!(said.contains(&"SIMULATION"), "{said:?}");
            assert!(said.iter().all(|words| *words == "SIMULATION" || selected(words)), "{theme:?}, {size}: {said:?}");
            let share = area / Rect::from_min_size(Default::default(), size).area();
            assert!(share < MOST, "{theme:?}, {size}: {:.2} %", 100.0 * share);
        }
    }
    let (all, _) = saturated(&seat(scenes::hold_safe()));
    assert!(all.iter().any(|(color, _)| *color == Palette::DARK.caution), "what is not quiet is coloured");
}

/// Groups that are drawn, by their buttons.
fn groups(seated: &Seated) -> Vec<String> {
    let label = |node: egui_kittest::Node<'_>| node.accesskit_node().label();
    let all = seated.root().children_recursive().filter_map(label);
    all.filter_map(|label| label.strip_prefix("Acknowledge: ").map(str::to_owned)).collect()
}

#[test]
fn own_hold_raises_no_alarm_and_a_contradiction_one() {
    for yard in [scenes::nominal(), standing()] {
        let seated = seat(yard);
        assert_eq!(groups(&seated), Vec::<String>::new());
        assert!(shows_text(&seated, "No alarm in this hour."));
        assert!(seated.state().yard.shown().sound.motif.is_none(), "nothing sounds");
    }
    let seated = seat(scenes::hold_safe());
    assert_eq!(groups(&seated), ["unit-b contradicts itself"]);
    assert_eq!(seated.query_all_by_label_contains("led to: unit-a HOLD_SAFE").count(), 1, "not an alarm of its own");
    assert!(!shows_text(&seated, "unit-a went to HOLD_SAFE"), "nor an event beside it");
    assert!(shows_text(&seated, "1 in this hour"));
    assert_eq!(seated.state().yard.shown().alarms.len(), 1);
}
