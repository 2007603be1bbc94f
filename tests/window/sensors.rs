//! The sensor window beside the operator's, without a screen: it states its source and the age of its pictures.

use std::sync::Arc;

use console::gui::sensors::Content;
use console::gui::theme;
use console::sidecar::{Image, Sight};
use console::source::Sensed;
use eframe::egui::{Theme, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use wire::time::Span;

/// True if the drawing of `sensed` contains each of `texts`.
fn contains_texts(sensed: Option<Sensed>, texts: &[&str]) -> Vec<bool> {
    drawn(sensed, None, texts)
}

fn drawn(sensed: Option<Sensed>, trouble: Option<&'static str>, texts: &[&str]) -> Vec<bool> {
    let mut content = Content::default();
    let draw = move |ui: &mut eframe::egui::Ui| {
        theme::apply(ui.ctx());
        content.draw(ui, sensed.as_ref(), trouble);
    };
    let mut drawn = Harness::builder().with_size(vec2(760.0, 640.0)).with_theme(Theme::Dark).build_ui(draw);
    drawn.run_steps(3);
    texts.iter().map(|text| drawn.query_all_by_label_contains(text).next().is_some()).collect()
}

/// At least and at most a given number of microseconds old.
fn sensed(at_least: u64, at_most: Option<u64>) -> Option<Sensed> {
    let sight = |name, image| Sight { name, legend: "as seen".into(), image, marks: Vec::new() };
    let image = || Some(Image { width: 4, height: 2, rgb: vec![90; 24] });
    let sights = [sight("colour", image()), sight("depth", image()), sight("thermal", None), sight("LiDAR", image())];
    Some(Sensed { sights: Arc::new(sights), at_least: Span(at_least), at_most: at_most.map(Span) })
}

/// All pictures are marked as outside the operator's view.
#[test]
fn every_sensor_is_shown_or_named_missing() {
    // A written record represents 100 ms, and is rounded up.
    let phrases = ["TEST BENCH", "over no link", "no operator sees this", "at most 0.29 s old"];
    let drawn = ["SENSOR colour 0 found", "SENSOR depth 0", "SENSOR thermal gave nothing", "SENSOR LiDAR 0 found"];
    for texts in [phrases, drawn] {
        assert_eq!(contains_texts(sensed(30_000, Some(180_001)), &texts), [true; 4], "{texts:?}");
    }
    assert_eq!(contains_texts(sensed(30_000, Some(180_001)), &["NOT CURRENT", "unknown"]), [false; 2]);
}

/// A frame counts as young only once its age is known.
#[test]
fn frames_without_successor_are_not_current() {
    let not_current = |at_least, at_most, says_so| contains_texts(sensed(at_least, at_most), &[says_so])[0];
    assert!(not_current(900_000, Some(1_000_001), "NOT CURRENT: at most 1.11 s old"));
    assert!(not_current(1_000_001, Some(1_200_000), "NOT CURRENT: at least 1.00 s old"));
    assert!(not_current(1_000_001, None, "NOT CURRENT: at least 1.00 s old"));
    assert_eq!(contains_texts(sensed(0, None), &["of unknown age", "at most", "NOT CURRENT"]), [true, false, false]);
    assert_eq!(contains_texts(None, &["Waiting for the first frame.", "old"]), [true, false]);
}

#[test]
fn missing_pictures_are_explained_beside_the_last() {
    assert_eq!(drawn(sensed(0, Some(0)), Some("cut off"), &["cut off", "SENSOR colour"]), [true, true]);
    assert_eq!(drawn(None, Some("cut off"), &["cut off"]), [true]);
}
