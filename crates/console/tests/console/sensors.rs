//! The window beside the operator's, without a screen: it says what it is, and how old what it shows is.

use std::sync::Arc;

use console::beside::{Image, Sight};
use console::gui::sensors::{Content, Sensed};
use console::gui::theme;
use eframe::egui::{Theme, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use wire::time::Span;

/// Whether what is drawn of `sensed` says each of `texts`.
fn says(sensed: Option<Sensed>, texts: &[&str]) -> Vec<bool> {
    let mut content = Content::default();
    let draw = move |ui: &mut eframe::egui::Ui| {
        theme::apply(ui.ctx());
        content.draw(ui, sensed.as_ref());
    };
    let mut drawn = Harness::builder().with_size(vec2(760.0, 640.0)).with_theme(Theme::Dark).build_ui(draw);
    drawn.run_steps(3);
    texts.iter().map(|text| drawn.query_all_by_label_contains(text).next().is_some()).collect()
}

fn sensed(age: Option<Span>) -> Option<Sensed> {
    let sight = |name, image| Sight { name, legend: "as seen", image, marks: Vec::new() };
    let image = || Some(Image { width: 4, height: 2, rgb: vec![90; 24] });
    let sights = [sight("colour", image()), sight("depth", image()), sight("thermal", None), sight("LiDAR", image())];
    Some(Sensed { sights: Arc::new(sights), age })
}

#[test]
fn every_sensor_has_its_picture_or_is_said_to_give_none_and_all_is_said_to_be_no_operators() {
    let said = ["TEST BENCH", "over no link", "no operator sees this", "at most 0.18 s old"];
    let drawn = ["SENSOR colour 0 found", "SENSOR depth 0", "SENSOR thermal gave nothing", "SENSOR LiDAR 0 found"];
    for texts in [said, drawn] {
        assert_eq!(says(sensed(Some(Span::ms(180))), &texts), [true; 4], "{texts:?}");
    }
    assert_eq!(says(sensed(Some(Span::ms(180))), &["NOT CURRENT", "unknown"]), [false; 2]);
}

#[test]
fn frames_that_no_newer_one_follows_are_not_current_and_none_is_young_before_its_age_is_known() {
    assert_eq!(says(sensed(Some(Span::ms(1_001))), &["NOT CURRENT: 1.00 s old", "at most"]), [true, false]);
    assert_eq!(says(sensed(None), &["of unknown age", "at most", "NOT CURRENT"]), [true, false, false]);
    assert_eq!(says(None, &["Waiting for the first frame.", "old"]), [true, false]);
}
