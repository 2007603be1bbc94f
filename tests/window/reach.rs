//! Ways beyond the first look: from a guard to its plot, from unit to unit, to every control without a
//! pointer, along a recording, and to another recording beside it.

use std::sync::Arc;

use console::gui::ConsoleWindow;
use console::gui::layout::{Pane, Preset};
use console::source::{Beside, Seek};
use eframe::egui::accesskit::Role as Kind;
use eframe::egui::{Key, Theme, Vec2, pos2, vec2};
use egui_kittest::Node;
use egui_kittest::kittest::{NodeT, Queryable};
use wire::command::CommandKind;
use wire::id::UnitId;
use wire::person::{Act, Order};
use wire::time::Span;

use crate::layout::text_flaws;
use crate::painted;
use crate::scenes;
use crate::window::{Seated, name_of, open, press, seat, shows_text, sized, standing, tab_to};
use crate::yard::{self, Yard};

/// Controls, by their kind.
const CONTROLS: [Kind; 6] =
    [Kind::Button, Kind::RadioButton, Kind::CheckBox, Kind::TextInput, Kind::Slider, Kind::SpinButton];
/// Most presses of Tab that lead around the window.
const AROUND: usize = 400;

/// The window over a recording of this.
fn replayed(yard: Yard, size: Vec2) -> Seated {
    let mut seated = sized(yard, size, Theme::Dark);
    let (_, tape) = scenes::replayed(seated.state().yard.shown());
    seated.state_mut().tape = Some(tape);
    seated.run_steps(3);
    seated
}

#[test]
fn guard_leads_to_its_plot() {
    for (preset, by_key) in [(Preset::Operate, false), (Preset::Operate, true), (Preset::Map, false)] {
        let mut seated = seat(scenes::nominal());
        seated.state_mut().window.layouts_mut().start_from(preset);
        open(&mut seated, Pane::Why);
        assert!(!shows_text(&seated, "PLOT unit-a Thermal camera"), "nobody has asked for it");
        if by_key {
            tab_to(&mut seated, "GUARD Thermal camera");
            press(&mut seated, Key::Enter);
        } else {
            seated.get_by_label_contains("GUARD Thermal camera").click();
        }
        seated.run_steps(4);
        assert!(name_of(&seated, "PLOT unit-a Thermal camera").ends_with("84 of 300 ms, most 300"), "{preset:?}");
        let drawn = painted::texts(&painted::shapes(&seated));
        let named =
            drawn.iter().filter(|text| text.words.starts_with("Thermal camera") && text.words != "Thermal camera");
        assert!(named.count() > 0, "{preset:?}: with a button that closes it");
    }
}

#[test]
fn keys_choose_units() {
    let mut seated = seat(scenes::eight());
    let unit = |seated: &Seated| name_of(seated, "MODE unit-").chars().skip(5).take(6).collect::<String>();
    assert_eq!(unit(&seated), "unit-a", "{}", name_of(&seated, "MODE"));
    assert!(shows_text(&seated, "F3: unit-6 is worse"));
    press(&mut seated, Key::F3);
    let worst = unit(&seated);
    assert_eq!((worst.as_str(), name_of(&seated, "MODE ").contains("LINK LOST")), ("unit-6", true));
    let mut met = vec![worst.clone()];
    for _ in 0..7 {
        press(&mut seated, Key::F2);
        met.push(unit(&seated));
    }
    assert_eq!(met[1..3], ["unit-a", "unit-d"], "the worst first");
    press(&mut seated, Key::F2);
    assert_eq!(unit(&seated), worst, "around");
    met.sort();
    met.dedup();
    assert_eq!(met.len(), 8, "{met:?}");
    press(&mut seated, Key::F2);
    press(&mut seated, Key::F1);
    let hold = Act::Now(Order::Command(UnitId::A, CommandKind::Hold));
    assert_eq!(seated.state().acts, [hold], "HOLD goes to the unit that the banner is about");
}

/// Controls that are enabled and in sight.
fn controls(seated: &Seated) -> Vec<String> {
    let window = seated.ctx.content_rect();
    let is = |node: &Node<'_>| {
        let this = node.accesskit_node();
        CONTROLS.contains(&this.role()) && !this.is_disabled() && window.intersects(node.rect())
    };
    let names = seated.root().children_recursive().filter(is).filter_map(|node| node.accesskit_node().label());
    names.collect()
}

#[test]
fn every_control_in_sight_is_reached_by_tab() {
    for (name, mut seated) in [
        ("standing", seat(standing())),
        ("hold-safe", seat(scenes::hold_safe())),
        ("eight", sized(scenes::eight(), vec2(1920.0, 1080.0), Theme::Dark)),
        ("replay", replayed(scenes::hold_safe(), vec2(1280.0, 800.0))),
    ] {
        let wanted = controls(&seated);
        assert!(wanted.len() > 15, "{name}: {wanted:?}");
        let mut reached = Vec::new();
        for _ in 0..AROUND {
            press(&mut seated, Key::Tab);
            let focused = seated.root().children_recursive().find(|node| node.is_focused());
            let label = focused.and_then(|node| node.accesskit_node().label());
            if label.is_some() && label == reached.first().cloned() {
                break;
            }
            reached.extend(label);
        }
        let missed: Vec<_> = wanted.iter().filter(|label| !reached.contains(label)).collect();
        assert!(missed.is_empty(), "{name}: Tab does not lead to {missed:?}");
    }
}

#[test]
fn scrubber_is_dragged_through_a_recording() {
    let mut seated = replayed(scenes::hold_safe(), vec2(1366.0, 768.0));
    let length = seated.state().tape.as_ref().map_or(Span::ZERO, |tape| tape.length);
    let rect = seated.get_by_role_and_label(Kind::Slider, "time of the run").rect().shrink2(vec2(8.0, 0.0));
    let at = |share: f32| pos2(rect.left() + rect.width() * share, rect.center().y);
    seated.drag_at(at(0.2));
    seated.run_steps(2);
    for share in [0.4, 0.75] {
        seated.hover_at(at(share));
        seated.run_steps(2);
        let Some(Seek::To(to)) = seated.state().seeks.last() else { panic!("{:?}", seated.state().seeks) };
        let off = (to.as_ms() / length.as_ms() - f64::from(share)).abs();
        assert!(off < 0.01, "{share}: {to} of {length}");
    }
    seated.drop_at(at(0.75));
    seated.run_steps(2);
    let sought = seated.state().seeks.len();
    seated.hover_at(at(0.1));
    seated.run_steps(2);
    assert_eq!(seated.state().seeks.len(), sought, "a pointer that only passes by seeks nothing");
    assert!(seated.state().acts.is_empty());
}

/// Two recordings at the same time of their runs: each part stands there twice.
#[test]
fn two_recordings_stand_side_by_side() {
    for size in [vec2(1366.0, 768.0), vec2(1920.0, 1080.0)] {
        let mut seated = replayed(scenes::hold_safe(), size);
        let (other, _) = scenes::replayed(scenes::nominal().shown());
        let (own, name) = ("teammate, full policy".to_owned(), "nominal".to_owned());
        seated.state_mut().beside = Some(Beside { own, name, shown: Arc::new(other), site: Arc::new(yard::site()) });
        seated.state_mut().window = ConsoleWindow::new(UnitId::A, yard::site());
        seated.run_steps(3);
        let middle = size.x / 2.0;
        for (part, [left, right]) in [
            ("MODE unit-a: ", ["HOLD_SAFE", "READY"]),
            ("WHY unit-a: ", ["unit-b contradicts itself", "Put in READY by an operator"]),
            ("SINCE unit-a: ", ["1.", "4."]),
            ("DO NEXT unit-a: ", ["Nothing: this has happened"; 2]),
            ("IS THIS TRUE unit-a: ", ["It was, then"; 2]),
        ] {
            let mut both: Vec<_> = seated.query_all_by_label_contains(part).collect();
            both.sort_by(|a, b| a.rect().left().total_cmp(&b.rect().left()));
            let said: Vec<String> = both.iter().filter_map(Node::value).collect();
            assert!(said.len() == 2 && said[0].contains(left) && said[1].contains(right), "{part}{said:?}");
            assert!(both[0].rect().right() <= middle && both[1].rect().left() >= middle, "{part} at {size}");
        }
        assert_eq!(seated.query_all_by_role(Kind::Canvas).count(), 2, "two maps");
        let texts = painted::texts(&painted::shapes(&seated));
        for name in ["teammate, full policy", "nominal"] {
            assert!(texts.iter().any(|text| text.words == name), "{name}");
        }
        assert!(shows_text(&seated, "MARK REPLAY") && !shows_text(&seated, "HOLD unit-a   F1"));
        assert_eq!(text_flaws(&texts), Vec::<String>::new(), "{size}");
        press(&mut seated, Key::F1);
        assert!(seated.state().acts.is_empty(), "a recording takes no commands");
    }
}
