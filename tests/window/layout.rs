//! The painter's own check of every layout: no text is small, cut in the banner or lies on another, and none lies on
//! HOLD, which has one place.

use console::gui::layout::Preset;
use eframe::egui::accesskit::Role as Kind;
use eframe::egui::epaint::Shape;
use eframe::egui::{Rect, Theme, Vec2, vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use wire::id::UnitId;
use wire::time::Span;

use crate::painted::{self, Clipped, Text};
use crate::scenes::{self, SCENES, Scene};
use crate::window::{Seat, Seated, sized};

/// Sizes of windows, from the least on.
const SIZES: [Vec2; 5] =
    [vec2(1024.0, 700.0), vec2(1280.0, 800.0), vec2(1366.0, 768.0), vec2(1920.0, 1080.0), vec2(3840.0, 2160.0)];
/// Least size of a text, points.
const LEAST: f32 = 13.0;
/// Ink that two neighbours may share, points: rounding.
const SHARED: f32 = 0.6;

/// Flaws of texts by themselves: the size of one, or one upon another.
pub(crate) fn text_flaws(texts: &[Text]) -> Vec<String> {
    let small = texts.iter().filter(|text| text.size < LEAST);
    let mut flaws: Vec<String> = small.map(|text| format!("{:?} has {} px", text.words, text.size)).collect();
    let beyond = texts.iter().filter(|text| text.beyond);
    flaws.extend(beyond.map(|text| format!("{:?} leaves its pane, {}", text.words, text.ink)));
    for (at, text) in texts.iter().enumerate() {
        let over = texts[..at].iter().filter(|under| lies_on(text, under));
        flaws
            .extend(over.map(|under| format!("{:?} on {:?}, {} and {}", text.words, under.words, text.ink, under.ink)));
    }
    flaws
}

/// True if a row of a text lies on one of another.
fn lies_on(text: &Text, under: &Text) -> bool {
    let shrunk = |row: &Rect| row.shrink(SHARED);
    text.rows.iter().map(shrunk).any(|row| under.rows.iter().map(shrunk).any(|other| row.intersects(other)))
}

/// Side of a filled rectangle from which on it is a pane, a bar or a button, and no symbol, points.
const SYMBOL: f32 = 16.0;

/// True if a pane, a bar or a button was painted over a text.
fn is_covered(shapes: &[Clipped], text: &Text) -> bool {
    let over = |(clip, shape): &Clipped| match shape {
        Shape::Rect(rect) if rect.fill.is_opaque() && rect.rect.size().min_elem() > SYMBOL => {
            rect.rect.intersect(*clip).intersects(text.ink.shrink(SHARED))
        }
        _ => false,
    };
    shapes[text.nth + 1..].iter().any(over)
}

/// Flaws of the present frame.
fn flaws(seated: &Seated) -> Vec<String> {
    let shapes = painted::shapes(seated);
    let texts = painted::texts(&shapes);
    let mut flaws = text_flaws(&texts);
    flaws.extend(
        texts.iter().filter(|text| is_covered(&shapes, text)).map(|text| format!("{:?} is covered", text.words)),
    );
    flaws.extend(banner_flaws(seated, &texts));
    flaws.extend(hold_flaws(seated, &shapes, &texts));
    let rail = hold(seated).left();
    let cut = texts.iter().filter(|text| text.cut && text.ink.left() >= rail);
    flaws.extend(cut.map(|text| format!("the column of orders cuts {:?}", text.words)));
    flaws
}

/// The banner has every answer and every detail of it, whole. In a narrow one the time stands in the mode's block.
fn banner_flaws(seated: &Seated, texts: &[Text]) -> Vec<String> {
    let [mode, since, truth] =
        ["MODE unit-", "SINCE unit-", "IS THIS TRUE unit-"].map(|part| seated.get_by_label_contains(part).rect());
    let within = mode.union(truth).expand(2.0);
    let banner: Vec<&Text> = texts.iter().filter(|text| within.contains_rect(text.ink)).collect();
    let cut = banner.iter().filter(|text| text.cut).map(|text| format!("the banner cuts {:?}", text.words));
    let mut flaws: Vec<String> = cut.collect();
    let answers = seated.state().yard.shown().banner(UnitId::A);
    for answer in [&answers.why, &answers.next, &answers.truth] {
        let wanted = std::iter::once(&answer.headline).chain(answer.details.iter().map(|(_, detail)| detail));
        let missing = wanted.filter(|words| !banner.iter().any(|text| text.words == **words));
        flaws.extend(missing.map(|words| format!("the banner lacks {words:?}")));
    }
    let known = answers.since.headline.trim_start_matches("the ");
    let time = |text: &&&Text| since.expand(2.0).contains_rect(text.ink) && text.words.contains(known);
    if banner.iter().find(time).is_none() {
        flaws.push(format!("the banner lacks the time {known:?}"));
    }
    flaws
}

/// Where HOLD is.
fn hold(seated: &Seated) -> Rect {
    seated.get_by_role_and_label(Kind::Button, "HOLD unit-a   F1").rect()
}

/// Shapes on HOLD other than its own words.
fn hold_flaws(seated: &Seated, shapes: &[Clipped], texts: &[Text]) -> Vec<String> {
    let rect = hold(seated);
    let Some(own) = texts.iter().find(|text| text.words == "HOLD unit-a" && rect.contains_rect(text.ink)) else {
        return vec!["HOLD has no words".to_owned()];
    };
    let words = |nth: &usize| texts.iter().find(|text| text.nth == *nth).map(|text| text.words.as_str());
    let over = (own.nth + 1..shapes.len()).filter(|nth| painted::bounds(&shapes[*nth]).intersects(rect.shrink(SHARED)));
    let dead = seated.get_by_role_and_label(Kind::Button, "HOLD unit-a   F1").accesskit_node().is_disabled();
    let alien = over.filter(|nth| match (words(nth), &shapes[*nth].1) {
        (Some(words), _) => !words.starts_with("F1 · "),
        // Its second painting is no text of its own.
        (None, Shape::Text(text)) => text.galley.text() != "HOLD unit-a",
        // Where it cannot be pressed it is struck out.
        (None, Shape::LineSegment { .. }) => !dead,
        _ => true,
    });
    alien.map(|nth| format!("over HOLD lies {:?}", shapes[nth].1)).collect()
}

/// Every flaw of a scene at these sizes and in each preset.
fn flaws_of((name, make): Scene, sizes: &[Vec2], theme: Theme) -> Vec<String> {
    let mut all = Vec::new();
    let mut seated = sized(make(), sizes[0], theme);
    for size in sizes {
        seated.set_size(*size);
        for preset in Preset::ALL {
            seated.state_mut().window.layouts_mut().start_from(preset);
            seated.run_steps(3);
            all.extend(flaws(&seated).into_iter().map(|flaw| format!("{name} {size} {preset:?} {theme:?}: {flaw}")));
        }
    }
    all
}

/// Both themes take turns: none of this depends on colours.
#[test]
fn no_text_is_small_cut_or_covered() {
    let theme = |at: usize| if at.is_multiple_of(2) { Theme::Dark } else { Theme::Light };
    let each = SCENES.into_iter().enumerate();
    let flaws: Vec<String> = each.flat_map(|(at, scene)| flaws_of(scene, &SIZES, theme(at))).collect();
    assert!(flaws.is_empty(), "{} flaws:\n{}", flaws.len(), flaws.join("\n"));
}

/// The whole of it: both themes for each.
#[test]
#[ignore = "long: every scene, size, layout and theme"]
fn no_text_is_small_cut_or_covered_in_either_theme() {
    let scenes = SCENES.into_iter().chain(scenes::LONG);
    let flaws: Vec<String> = scenes
        .flat_map(|scene| [Theme::Dark, Theme::Light].map(|theme| flaws_of(scene, &SIZES, theme)))
        .flatten()
        .collect();
    assert!(flaws.is_empty(), "{} flaws:\n{}", flaws.len(), flaws.join("\n"));
}

/// A state of the window beside its scene, and how it is entered.
type State = (&'static str, fn(&mut Seat));

/// Each of them.
const STATES: [State; 5] = [
    ("live", |_| ()),
    ("replay", |seat| seat.tape = Some(scenes::replayed(seat.yard.shown()).1)),
    ("behind", |seat| seat.behind = Some(Span::s(3))),
    ("not taken", |seat| seat.untaken = true),
    ("invalid", |seat| seat.invalid = Some("event 7: expected a seal".to_owned())),
];

#[test]
fn hold_has_one_place_in_every_state() {
    let mut places = SIZES.map(|_| None);
    for (name, make) in SCENES {
        let mut seated = sized(make(), SIZES[0], Theme::Dark);
        for (size, place) in SIZES.iter().zip(&mut places) {
            seated.set_size(*size);
            for (state, enter) in STATES {
                let seat = seated.state_mut();
                (seat.tape, seat.behind, seat.untaken, seat.invalid) = (None, None, false, None);
                enter(seat);
                seated.run_steps(2);
                let rect = hold(&seated);
                assert_eq!(rect, *place.get_or_insert(rect), "{name}, {state} at {size}");
            }
        }
    }
}

/// A change of mode is named below the plots, within their pane.
#[test]
fn changes_of_mode_are_named_below_the_plots() {
    let mut seated = sized(scenes::hold_safe(), SIZES[0], Theme::Dark);
    for size in SIZES {
        seated.set_size(size);
        for preset in [Preset::Operate, Preset::Examine] {
            seated.state_mut().window.layouts_mut().start_from(preset);
            seated.run_steps(3);
            let axis = seated.get_by_label_contains("AXIS ").rect();
            let shapes = painted::shapes(&seated);
            let texts = painted::texts(&shapes);
            let named = |text: &&Text| text.words == "HOLD_SAFE" && axis.expand(1.0).contains_rect(text.ink);
            let ink = texts.iter().find(named).filter(|text| !is_covered(&shapes, text));
            assert!(ink.is_some_and(|text| text.ink.height() > LEAST / 2.0), "{preset:?} at {size}: {ink:?}");
        }
    }
}
