//! Five questions, answered by the names of the banner's parts and without a press: the trouble, since when, why, the
//! next step, the age of the picture.
//!
//! The answers are held against the acts of the scripted units (`yard`), not against the console's own model.

use console::gui::ConsoleWindow;
use eframe::egui::{Theme, vec2};
use egui_kittest::kittest::NodeT;
use wire::id::UnitId;
use wire::mode::{Cause, Guard, Mode};

use crate::scenes::{self, SCENES};
use crate::window::{Seated, name_of, sized};
use crate::yard::{self, Actor, Yard};

/// Beginnings of the banner's parts.
const PARTS: [&str; 5] = ["MODE", "SINCE", "WHY", "DO NEXT", "IS THIS TRUE"];

/// The unit's place between being heard and being lost, as the script has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Heard {
    Never,
    /// Now, or as if it were: under the ablation no value grows old.
    Now,
    Stale,
    Lost,
    Planned,
}

/// How long ago the unit reported, seconds; it reports ten times a second until the script silences it.
fn heard(yard: &Yard, actor: &Actor) -> Heard {
    let shown = yard.shown();
    let Some(unit) = shown.unit(actor.unit) else { return Heard::Never };
    match unit.state.age().as_ms() {
        _ if actor.contact.is_some() && !actor.heard => Heard::Planned,
        _ if shown.marks.ablation.is_some() => Heard::Now,
        ms if ms > 2_000.0 => Heard::Lost,
        ms if ms > 500.0 => Heard::Stale,
        _ => Heard::Now,
    }
}

/// Words that each part has to contain, in the order of [`PARTS`].
fn answers(yard: &Yard, actor: &Actor) -> [Vec<String>; 5] {
    let says = |words: &[&str]| words.iter().map(|words| (*words).to_owned()).collect::<Vec<_>>();
    let (name, mode) = (actor.unit.name(), actor.mode.name());
    let prepared = yard.shown().prepared.is_some();
    let next = |words: &str| if prepared { says(&["Confirm or withdraw: ", " s left"]) } else { says(&[words]) };
    match heard(yard, actor) {
        Heard::Never => [
            says(&["NOTHING RECEIVED", "its mode is not known"]),
            says(&["the start"]),
            says(&["No report was ever accepted"]),
            says(&["Hold by other means"]),
            says(&["Nothing is known of it"]),
        ],
        Heard::Planned => [
            says(&["OUT OF CONTACT", "was READY"]),
            says(&[" s to contact"]),
            says(&["Between contacts, as planned"]),
            says(&["Nothing yet, HOLD goes out in "]),
            says(&["Old, as planned", "oldest value ≤ "]),
        ],
        Heard::Lost => [
            says(&["LINK LOST", &format!("was {mode}")]),
            says(&["not known, for it is not heard"]),
            says(&["No report for "]),
            says(&["Stay away from it", "it holds by itself within 0.5 s", "HOLD withholds its permission"]),
            says(&["No: it is old, oldest value ≤ "]),
        ],
        Heard::Stale => [
            says(&[&format!("was {mode}, stale")]),
            says(&["not known, for it is not heard"]),
            says(&["No report for "]),
            says(&["Stay away from it"]),
            says(&["No: it is stale, oldest value ≤ "]),
        ],
        Heard::Now => {
            let truth =
                if yard.shown().marks.ablation.is_some() { "Fresh, but not verified" } else { "Fresh and verified" };
            [says(&[mode]), says(&[" s, at "]), why(actor), next(&step(name, actor)), says(&[truth, "oldest value ≤ "])]
        }
    }
}

fn why(actor: &Actor) -> Vec<String> {
    let words = match (actor.cause, actor.mode) {
        (Cause::Start, _) => "Not enabled since its start",
        (Cause::Operator, Mode::HoldSafe) => "An operator held it",
        (Cause::Operator, Mode::PrepareToAct) => "Armed by an operator",
        (Cause::Operator, _) => "by an operator",
        (Cause::Lost(Guard::Thermal), _) => "Thermal camera: nothing for more than 0.3 s",
        (Cause::Lost(Guard::Teammates), _) => "unit-b contradicts itself, it moved faster than its body can",
        (cause, _) => panic!("a scene with {cause:?} needs its words here"),
    };
    vec![words.to_owned()]
}

/// The step that the mode asks of the operator.
fn step(name: &str, actor: &Actor) -> String {
    match (actor.mode, actor.failing.iter().next()) {
        (Mode::Ready, _) => "Nothing is asked of you".to_owned(),
        (Mode::PrepareToAct, _) => "Act on track 1, or let it end, authority ends in ".to_owned(),
        (Mode::HoldSafe, Some(_)) => "Check unit-b, then Resume, Resume waits: Teammates fails".to_owned(),
        (Mode::HoldSafe, None) => format!("Resume {name} to let it go on"),
        (Mode::Degraded, Some(_)) => "Check its thermal camera, READY waits: Thermal camera fails".to_owned(),
        (Mode::Degraded, None) => "Wait".to_owned(),
        (Mode::Idle, _) => format!("Enable {name} to start it"),
    }
}

#[test]
fn five_questions_are_answered_without_a_press() {
    let mut asked = 0;
    for (scene, make) in SCENES {
        let mut seated = sized(make(), vec2(1280.0, 800.0), Theme::Dark);
        let actors = seated.state().yard.actors.len();
        for at in 0..actors {
            let unit = seated.state().yard.actors[at].unit;
            seated.state_mut().window = ConsoleWindow::new(unit, yard::site());
            seated.run_steps(2);
            let yard = &seated.state().yard;
            for (part, wanted) in PARTS.iter().zip(answers(yard, &yard.actors[at])) {
                let said = name_of(&seated, &format!("{part} {unit}: "));
                assert!(wanted.iter().all(|words| said.contains(words)), "{scene}: {said:?} lacks one of {wanted:?}");
                asked += 1;
            }
            assert_bound_holds(&seated, unit, scene);
        }
    }
    assert!(asked > 150, "{asked}");
}

/// The age in *Is this true?* is none that is younger than the unit's last report.
fn assert_bound_holds(seated: &Seated, unit: UnitId, scene: &str) {
    let shown = seated.state().yard.shown();
    let Some(of) = shown.unit(unit) else { return };
    let said = name_of(seated, &format!("IS THIS TRUE {unit}: "));
    let bound = said.split("≤ ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
    let bound = bound.unwrap_or_else(|| panic!("{scene}: no age in {said:?}"));
    assert!(bound * 1000.0 >= of.state.age().as_ms(), "{scene}: {said:?}, {}", of.state.age());
}

/// Of a unit that is not heard no value stands as if it were so.
#[test]
fn no_value_stands_without_was_beyond_late() {
    for make in [scenes::stale, scenes::lost] {
        let seated = sized(make(), vec2(1280.0, 800.0), Theme::Dark);
        let name =
            |node: egui_kittest::Node<'_>| node.accesskit_node().label().or_else(|| node.accesskit_node().value());
        let names: Vec<String> = seated.root().children_recursive().filter_map(name).collect();
        let begins = ["PLOT unit-a ", "GUARD ", "UNIT unit-a ", "MODE unit-a: "];
        for begin in begins {
            let said: Vec<&String> = names.iter().filter(|name| name.starts_with(begin)).collect();
            // An age grows, and a guard that was not judged has no value.
            let dated = |name: &&&String| !name.contains("Age of report") && !name.contains("not judged");
            let bare: Vec<_> = said.iter().filter(dated).filter(|name| !name.contains("was ")).collect();
            assert!(!said.is_empty() && bare.is_empty(), "{begin}{bare:?}");
        }
    }
}
