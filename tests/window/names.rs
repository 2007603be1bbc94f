//! Sensors by the names of the platform that carries them.

use console::gui::layout::Preset;
use egui_kittest::Node;
use egui_kittest::kittest::NodeT;
use wire::id::UnitId;
use wire::mode::{Cause, Guard, Guards, Mode};
use wire::motion::{Attitude, ReportedMotion};
use wire::sensor::{Modalities, Modality};
use wire::time::Span;

use crate::scenes;
use crate::window::seat;
use crate::yard::Yard;

/// Words for sensors that a satellite lacks.
const OF_VEHICLES: [&str; 6] = ["lidar", "wheel", "odometr", "rgb", "depth", "thermal"];

/// A unit whose sensors and place have failed, one after the other; in an orbit, or on the ground.
fn failed(orbits: bool) -> Yard {
    let mut yard = scenes::nominal();
    let attitude = Some(Attitude::new([0.17, 0.98, 0.1, 0.0]));
    let orbit = ReportedMotion { up_mm: 518_140_000, left_up_mm_s: [0, 0], charge: 790, attitude, sunlit: Some(true) };
    for unit in [UnitId::A, UnitId::B] {
        let actor = yard.actor(unit);
        actor.motion = orbits.then_some(orbit);
        actor
            .tracks
            .iter_mut()
            .for_each(|track| track.contradicted = Modalities::default().with_modality(Modality::Lidar));
    }
    for modality in Modality::ALL {
        let a = yard.actor(UnitId::A);
        (a.mode, a.cause) = (Mode::Degraded, Cause::Lost(Guard::from_modality(modality)));
        a.failing = Guards::default().with_guard(Guard::from_modality(modality)).with_guard(Guard::Localisation);
        yard.run(Span::ms(600));
        let a = yard.actor(UnitId::A);
        (a.mode, a.cause, a.failing) = (Mode::Idle, Cause::Operator, Guards::default());
        yard.run(Span::ms(600));
        let a = yard.actor(UnitId::A);
        (a.mode, a.cause) = (Mode::HoldSafe, Cause::Unrecovered(Guard::from_modality(modality)));
        a.failing = Guards::default().with_guard(Guard::from_modality(modality)).with_guard(Guard::Localisation);
        yard.run(Span::ms(600));
    }
    let a = yard.actor(UnitId::A);
    (a.cause, a.failing) = (Cause::Lost(Guard::Localisation), Guards::default().with_guard(Guard::Localisation));
    yard.run(Span::ms(600));
    yard
}

/// Every text of the terminal's display and of the window in each of its layouts.
fn words(orbits: bool) -> String {
    let mut words = console::text::lines(&failed(orbits).shown());
    for preset in Preset::ALL {
        let mut seated = seat(failed(orbits));
        seated.state_mut().window.layouts_mut().start_from(preset);
        seated.run_steps(3);
        collect_names(&seated.root(), &mut words);
    }
    words.to_lowercase()
}

fn collect_names(node: &Node<'_>, into: &mut String) {
    let this = node.accesskit_node();
    for words in [this.label(), this.value()].into_iter().flatten() {
        into.push_str(&words);
        into.push('\n');
    }
    node.children().for_each(|child| collect_names(&child, into));
}

#[test]
fn satellite_has_no_sensor_of_a_vehicle() {
    let text = words(true);
    for word in OF_VEHICLES {
        let line = text.lines().find(|line| line.contains(word));
        assert_eq!(line, None, "{word}");
    }
    for name in ["magnetometer of unit-a", "star tracker", "sun sensor", "horizon sensor", "against its computed place"]
    {
        assert!(text.contains(name), "{name}: {text}");
    }
    let of_ground = words(false);
    for word in ["lidar", "odometr", "rgb", "depth", "thermal"] {
        assert!(of_ground.contains(word), "{word}: the words of a vehicle are gone, and nothing is compared");
    }
}
