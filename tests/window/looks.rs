//! Appearance of the window: colours, disabled controls, neighbours.
//!
//! Interaction is in `window`. Colours are checked here too, where the accessibility label does not mention them.

use console::gui::layout::{Pane, Preset};
use console::gui::theme::Palette;
use eframe::egui::accesskit::Role as Kind;
use eframe::egui::epaint::{Color32, ColorMode, Shape};
use eframe::egui::{Pos2, Rect, Vec2, vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use wire::feed::Feed;
use wire::id::{PeerId, UnitId};
use wire::person::Role;
use wire::time::Span;

use crate::bench::Bench;
use crate::painted;
use crate::scenes;
use crate::window::{Seated, click, name_of, open, seat, shows_text, standing};
use crate::yard::Yard;

/// The window over a recording of this.
fn replayed(yard: Yard) -> Seated {
    let mut seated = seat(yard);
    let (_, tape) = scenes::replayed(seated.state().yard.shown());
    seated.state_mut().tape = Some(tape);
    seated.run_steps(3);
    seated
}

/// Description of the map for screen readers.
fn described(seated: &Seated) -> String {
    let node = seated.query_all_by_role(Kind::Canvas).next().expect("a map");
    node.accesskit_node().label().expect("what it says")
}

/// The data of the map on the screen, and how many points of it are a metre.
fn map(seated: &Seated) -> (Rect, f32) {
    let node = seated.query_all_by_role(Kind::Canvas).next().expect("a map");
    let label = described(seated);
    let across: f32 =
        label.split("; ").nth(1).and_then(|text| text.split(' ').next()?.parse().ok()).expect("its width");
    (node.rect(), node.rect().width() / across)
}

/// Everything that is painted on the map's data, one shape after the other.
fn painted(seated: &Seated) -> Vec<Shape> {
    painted_within(seated, map(seated).0)
}

/// Everything that is painted within a part of the window.
fn painted_within(seated: &Seated, rect: Rect) -> Vec<Shape> {
    let inside = |(clip, shape): painted::Clipped| rect.expand(1.0).contains_rect(clip).then_some(shape);
    painted::shapes(seated).into_iter().filter_map(inside).collect()
}

/// Room of axes, scale and legend, left and above, right and below the data.
const AROUND: [Vec2; 2] = [vec2(46.0, 8.0), vec2(10.0, 54.0)];

/// Height of a map from which every unit has its label, points; below it they are counted.
const LEAST_MAP: f32 = 140.0;

/// True if a colour is one of those that say that something is out of normal: more red than blue.
fn warm(color: Color32) -> bool {
    color.r() > color.b().saturating_add(20)
}

/// Words on the map and around it, each with its place. Strong words are painted twice and stand here once.
fn words(seated: &Seated) -> Vec<(String, Rect)> {
    let data = map(seated).0;
    let pane = Rect::from_min_max(data.min - AROUND[0], data.max + AROUND[1]);
    let texts = painted::texts(&painted::shapes(seated));
    texts.into_iter().filter(|text| pane.contains_rect(text.ink)).map(|text| (text.words, text.ink)).collect()
}

#[test]
fn revoking_stands_behind_a_menu_far_from_resuming() {
    let mut yard = Yard::from_bench(Bench::seating(Role::Supervise), &[UnitId::A, UnitId::B]);
    yard.run(Span::s(1));
    let mut seated = seat(yard);
    assert!(!shows_text(&seated, "Revoke operator-2"), "nobody has asked for it");
    click(&mut seated, Kind::Button, "Revoke an identity ...");
    let strike = seated.get_by_role_and_label(Kind::RadioButton, "Revoke operator-2").rect();
    let resume = seated.get_by_role_and_label(Kind::RadioButton, "Resume unit-a").rect();
    assert!(strike.top() > resume.bottom() + 60.0, "{strike} is beside {resume}");
    assert!(seated.state().yard.shown().revocable.iter().all(|(_, requested)| !requested));
}

#[test]
fn disabled_controls_of_a_recording_give_the_reason() {
    let seated = replayed(standing());
    for kind in [Kind::RadioButton, Kind::Button] {
        let left = seated.get_by_role_and_label(Kind::Button, "HOLD unit-a   F1").rect().left();
        let column = seated.query_all_by_role(kind).filter(|node| node.rect().left() >= left);
        let orders = column.filter(|node| {
            let label = node.accesskit_node().label().unwrap_or_default();
            ["HOLD", "Disarm", "Configure", "Enable", "Resume", "Revoke"].iter().any(|verb| label.starts_with(verb))
        });
        let orders: Vec<_> = orders.collect();
        assert!(orders.len() >= 3, "{orders:?}");
        let alive: Vec<_> = orders.into_iter().filter(|node| !node.accesskit_node().is_disabled()).collect();
        assert!(alive.is_empty(), "{alive:?}");
    }
    for (kind, label) in [(Kind::Button, "HOLD unit-a   F1"), (Kind::RadioButton, "Resume unit-a")] {
        let mut seated = replayed(standing());
        seated.get_by_role_and_label(kind, label).hover();
        seated.run_steps(10);
        assert!(shows_text(&seated, "disabled: REPLAY: a recording takes no commands"), "{label}");
    }
}

#[test]
fn recording_shows_times_of_the_run() {
    let mut seated = replayed(scenes::hold_safe());
    // Shown 8.1 s after the recording began, which was 2 s before the run.
    assert!(shows_text(&seated, "run time 6.10 s of 7.00 s"));
    let times_shown = |seated: &Seated| -> Vec<String> {
        let labels = seated.root().children_recursive().filter_map(|node| node.accesskit_node().value());
        // A report has an age, and the plots end at the shown moment, which their axis calls now.
        labels
            .filter(|label| label.contains(" ago") && !label.contains("report") && !label.starts_with("AXIS"))
            .collect()
    };
    for pane in [Pane::Alarms, Pane::History, Pane::Why, Pane::Tracks] {
        open(&mut seated, pane);
        assert_eq!(times_shown(&seated), Vec::<String>::new(), "{pane:?}");
    }
    assert_eq!(name_of(&seated, "SINCE unit-a: "), "SINCE unit-a: 1.3 s, at 00:04.8");
}

#[test]
fn context_bar_explains_links_and_clocks_plainly() {
    let mut yard = scenes::nominal();
    yard.run(Span::s(9));
    yard.bench.feed(&Feed::Session(PeerId::UNIT_C, true));
    let mut seated = seat(yard);
    let said: Vec<String> = ["LINK", "CLOCK"].iter().flat_map(|of| values(&seated, of)).collect();
    assert!(said.len() >= 3 && said.iter().all(|text| !text.contains("ppm") && !text.contains("never")), "{said:?}");
    let all = "LINK unit-a up, report 0.10 s ago; LINK unit-b up, report 0.10 s ago; LINK unit-c up, no report yet";
    for text in [all, "LINK unit-c up, no report yet", "CLOCK in step"] {
        assert!(said.iter().any(|said| said == text), "{text}: {said:?}");
    }
    seated.get_by_label_contains("CLOCK in step").hover();
    seated.run_steps(10);
    assert!(shows_text(&seated, "ages allow for 200 ppm"), "the figure is in the tooltip");
}

fn values(seated: &Seated, of: &str) -> Vec<String> {
    seated.query_all_by_label_contains(of).filter_map(|node| node.value()).collect()
}

#[test]
fn map_layout_fills_the_window() {
    let mut seated = seat(scenes::nominal());
    seated.state_mut().window.layouts_mut().start_from(Preset::Map);
    seated.run_steps(3);
    let (rect, _) = map(&seated);
    let column = seated.get_by_role_and_label(Kind::Button, "HOLD unit-a   F1").rect();
    assert!(rect.left() <= 56.0 && column.left() - rect.right() < 34.0, "{rect} beside {column}");
    assert!(rect.height() > 400.0, "{rect}");
    seated.state_mut().window.layouts_mut().now().open(Pane::Tracks);
    seated.run_steps(2);
    assert!(shows_text(&seated, "TRACK unit-a 1 vehicle fresh"), "the rest is a tab away");
}

/// Circles end at ten metres.
#[test]
fn circles_of_lost_things_are_pale_and_bounded() {
    let seated = seat(scenes::lost());
    let (_, metre) = map(&seated);
    let shown = seated.state().yard.shown();
    let lost = shown.unit(UnitId::A).expect("it was heard");
    assert!(
        lost.tracks.iter().all(|track| track.age() > Span::s(5)),
        "at 3 m/s that is further than they may be drawn"
    );
    let lines: Vec<([Pos2; 2], Color32)> = painted(&seated)
        .into_iter()
        .filter_map(|shape| match shape {
            Shape::LineSegment { points, stroke } => Some((points, stroke.color)),
            _ => None,
        })
        .collect();
    let long = |[a, b]: [Pos2; 2]| a.distance(b);
    // Crosses mark the places of lost things, and a hollow arrow that of the unit. The dashes of a circle are shorter.
    let crosses = lines.iter().filter(|(points, color)| (8.0..20.0).contains(&long(*points)) && warm(*color));
    let mut centres: Vec<Pos2> = crosses.map(|([a, b], _)| a.lerp(*b, 0.5)).collect();
    centres.extend(painted(&seated).into_iter().filter_map(|shape| match shape {
        Shape::Path(path) if path.closed && matches!(path.stroke.color, ColorMode::Solid(color) if warm(color)) => {
            Some(path.visual_bounding_rect().center())
        }
        _ => None,
    }));
    let circles: Vec<_> = lines.iter().filter(|(points, color)| long(*points) < 7.0 && warm(*color)).collect();
    assert!(circles.len() > 50 && centres.len() > 4, "{} dashes about {} places", circles.len(), centres.len());
    for ([at, _], color) in circles {
        assert!(color.a() <= 80, "{color:?}");
        let nearest = centres.iter().map(|centre| centre.distance(*at)).fold(f32::INFINITY, f32::min);
        assert!(nearest <= 10.0 * metre + 4.0, "{} m", nearest / metre);
    }
    assert!(described(&seated).contains("of what is LOST pale, to 10 m at most"), "{}", described(&seated));
}

#[test]
fn map_labels_do_not_overlap() {
    for (name, scene) in scenes::SCENES {
        for preset in Preset::ALL {
            let mut seated = seat(scene());
            seated.state_mut().window.layouts_mut().start_from(preset);
            seated.run_steps(3);
            let all = words(&seated);
            let named = |text: &str| text.chars().any(char::is_alphabetic);
            for (at, (label, place)) in all.iter().enumerate().filter(|(_, (text, _))| named(text)) {
                let overlapping = all
                    .iter()
                    .enumerate()
                    .find(|(other, (_, rect))| *other != at && rect.shrink(0.5).intersects(*place));
                assert!(overlapping.is_none(), "{name}, {preset:?}: {label} lies over {overlapping:?}");
            }
            let units = seated.state().yard.shown().units;
            let labelled = |unit: &UnitId| all.iter().any(|(text, _)| text.starts_with(&format!("{unit}  ")));
            let unlabelled = units.iter().filter(|unit| !labelled(&unit.unit)).count();
            let room = map(&seated).0.height() >= LEAST_MAP;
            assert!(unlabelled == 0 || !room, "{name}, {preset:?}: {unlabelled} units have no label: {all:?}");
            let counted = described(&seated).contains(&format!("{unlabelled} units unlabelled"));
            assert_eq!(unlabelled > 0, counted, "{name}, {preset:?}: {unlabelled}, {}", described(&seated));
        }
    }
}

/// The track's label states its confidence.
#[test]
fn uncertain_track_is_smaller_and_paler() {
    let mut yard = scenes::nominal();
    let tracks = &mut yard.actor(UnitId::A).tracks;
    (tracks[0].confidence, tracks[2].confidence) = (940, 10);
    yard.run(Span::ms(300));
    let seated = seat(yard);
    let discs: Vec<(f32, Color32)> = painted(&seated)
        .into_iter()
        .filter_map(|shape| match shape {
            // What is no way point of the route, and none of its dots.
            Shape::Circle(circle) if circle.stroke.is_empty() && circle.radius > 2.0 => {
                Some((circle.radius, circle.fill))
            }
            _ => None,
        })
        .collect();
    let by_size = |a: &&(f32, Color32), b: &&(f32, Color32)| a.0.total_cmp(&b.0);
    let (least, most) = (discs.iter().min_by(by_size).expect("a disc"), discs.iter().max_by(by_size).expect("a disc"));
    assert!(least.0 < 0.7 * most.0 && f32::from(least.1.a()) < 0.5 * f32::from(most.1.a()), "{least:?}, {most:?}");
    let words = words(&seated);
    let shows = |text: &str| words.iter().any(|(line, _)| line.contains(text));
    assert!(shows("3 decoy 0.01"), "{words:?}");
    assert!(described(&seated).contains("the surer the larger and stronger"));
}

/// The line ends where reports ended and goes on where they went on, more than seven metres further.
#[test]
fn trail_is_not_drawn_across_silence() {
    let (_, patrol) = scenes::LONG[0];
    let seated = seat(patrol());
    let (_, metre) = map(&seated);
    let route = ColorMode::Solid(Palette::DARK.quiet);
    let trail: Vec<Vec<Pos2>> = painted(&seated)
        .into_iter()
        .filter_map(|shape| match shape {
            Shape::Path(path) if !path.closed && path.points.len() > 1 && path.stroke.color != route => {
                [4.0, 2.4, 1.4].contains(&path.stroke.width).then_some(path.points)
            }
            _ => None,
        })
        .collect();
    let steps = trail.iter().flat_map(|points| points.windows(2)).map(|pair| pair[0].distance(pair[1]));
    let longest = steps.fold(0.0, f32::max);
    assert!(longest < 4.0 * metre, "a line over {} m", longest / metre);
    let pieces = trail.iter().filter(|points| points.len() > 12).count();
    assert!(pieces >= 4, "two of the last twenty seconds, one before and one after the gap: {pieces}");
    let ticks = words(&seated).into_iter().filter(|(text, _)| text.starts_with('−') && text.ends_with(" s")).count();
    assert!(ticks >= 3, "{:?}", words(&seated));
}

#[test]
fn map_states_distances_to_the_fence() {
    let seated = seat(scenes::nominal());
    let text = described(&seated);
    assert!(text.contains("unit-a 34.8 m from the fence, stopped at full speed from 3.0 m"), "{text}");
    assert!(text.contains("2 of 5 way points reached; follows unit-a"), "{text}");
    assert!(words(&seated).iter().any(|(text, _)| text == "34.8 m"), "the distance stands beside its line");
    let mut seated = seat(scenes::lost());
    seated.state_mut().window.layouts_mut().start_from(Preset::Map);
    seated.run_steps(3);
    assert!(described(&seated).contains("unit-a was 34.8 m from the fence"), "{}", described(&seated));
    assert!(words(&seated).iter().any(|(text, _)| text == "was 34.8 m"));
    assert!(words(&seated).iter().any(|(text, _)| text == "unit-a  LINK LOST"));
    assert!(words(&seated).iter().any(|(text, _)| text.starts_with("was READY, 1.4 m/s, ≤ 7.")));
}

/// Units and passed objects are told apart by words too.
#[test]
fn passed_object_has_a_mark_without_a_label() {
    let seated = seat(scenes::hold_safe());
    let shown = seated.state().yard.shown();
    let passed = &shown.unit(UnitId::A).expect("it is heard").lost;
    assert_eq!(passed.len(), 1);
    assert!(described(&seated).contains("1 out of view"), "{}", described(&seated));
    assert!(!words(&seated).iter().any(|(text, _)| text.contains("5 obstacle") && !text.starts_with('b')));
}

/// The source is named in the order's progress and in the history.
#[test]
fn order_names_its_source_everywhere() {
    let mut seated = seat(standing());
    assert!(shows_text(&seated, "given by a person"));
    open(&mut seated, Pane::History);
    assert!(shows_text(&seated, "hold to unit-a, given by a person"));
}
