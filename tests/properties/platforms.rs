//! Platforms as data: the numbers of a file reach every core that works with them, and the second platform runs.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about one note")]

use adversary::AdversaryConfig;
use config::platform::{Body, Limits, Sensors, Vehicle};
use ground_truth::{Any, Note};
use holdsafe_tests::on_platform;
use serde::Serialize;
use serde::de::DeserializeOwned;
use topology::{MemberRole, RunSecret, Topology, lay_out};
use wire::time::Span;

/// Scenarios that state classes on the courier.
const STATED: [&str; 10] = [
    "brief_silence",
    "delay_edge",
    "fence_start",
    "localisation_drift",
    "localisation_freeze",
    "localisation_jump_small",
    "nominal",
    "rgb_loss",
    "unsafe_values",
    "uplink_loss",
];

fn courier() -> Topology {
    let ready = on_platform("nominal", "courier").remove(0);
    lay_out(&ready.scenario, &ready.setup, 1, &RunSecret::seeded(1))
}

/// A configuration as a live process receives it.
fn roundtrip<T: Serialize + DeserializeOwned>(config: &T) -> T {
    serde_json::from_str(&serde_json::to_string(config).expect("it can be written")).expect("it can be read")
}

#[test]
fn cores_get_the_numbers_of_their_platform() {
    let (mut bodies, mut eyes, mut minds) = (0, 0, 0);
    for member in courier().members {
        match member.role {
            MemberRole::Sim(config) => {
                let Body::Wheeled(vehicle) = roundtrip(&config).body else { panic!("the courier drives on wheels") };
                let Vehicle { mass_kg, max_speed_m_s, .. } = vehicle;
                assert_eq!((mass_kg, max_speed_m_s), (27.0, 1.8));
                assert_eq!(roundtrip(&config).sensors.lidar.up_m, 0.6);
                bodies += 1;
            }
            MemberRole::Perception(config) => {
                let Sensors { camera, lidar } = roundtrip(&config).sensors;
                assert_eq!((camera.forward_m, camera.up_m, lidar.up_m), (0.35, 0.5, 0.6));
                eyes += 1;
            }
            MemberRole::Autonomy(config) => {
                let Limits { rear_axle_mm, curvature_per_km, standoff_mm, .. } = roundtrip(&config).limits;
                assert_eq!((rear_axle_mm, curvature_per_km, standoff_mm), (250, 1000, 1500));
                assert_eq!(member.setup.bounds.max_speed_mm_s, 1500);
                minds += 1;
            }
            MemberRole::Gateway(_) | MemberRole::Console(_) | MemberRole::Recorder | MemberRole::Adversary(_) => {}
        }
    }
    assert!(bodies >= 1 && bodies == eyes && bodies == minds, "{bodies} {eyes} {minds}");
}

/// Scenarios of every interface that the platforms of other domains share with the ground platform.
const SHARED: [&str; 16] = [
    "nominal",
    "uplink_loss",
    "cut_at_arming",
    "replay",
    "teammate",
    "localisation_freeze",
    "localisation_jump",
    "localisation_drift",
    "rgb_loss",
    "thermal_loss",
    "autonomy_ends",
    "rogue_ipc",
    "gateway_hold",
    "evidence_tampered",
    "unsafe_values",
    "fence_start",
];

/// Exceptions are the classes that a scenario states for a platform.
#[test]
#[ignore = "long: every scenario on every platform"]
fn shared_scenarios_end_in_the_same_classes_in_every_domain() {
    for (name, domain) in SHARED.into_iter().flat_map(|name| [(name, "air"), (name, "space")]) {
        for ready in on_platform(name, domain) {
            assert_eq!(ready.scenario.platform.as_str(), domain);
            assert!(!ready.scenario.expected.is_empty(), "{name}: nothing is owed");
            ready.expect(1..3);
        }
    }
}

/// Killed in the air, it needs no message: it holds its place, and then it lands.
#[test]
fn unit_without_autonomy_loiters_and_lands() {
    let ready = on_platform("autonomy_ends", "air").remove(0);
    let run = ready.run(1);
    let margins: Vec<i32> = run
        .evidence
        .entries
        .iter()
        .filter_map(|w| match w.entry.event {
            Any::Instrument(Note::Margins { safe, .. }) => Some(safe),
            _ => None,
        })
        .collect();
    assert!(margins.iter().any(|safe| *safe < 0), "it flew");
    assert!(margins.iter().rev().take(10).all(|safe| *safe > 0), "{margins:?}");
}

/// The courier drives, and never faster than its limit.
#[test]
fn courier_keeps_to_its_own_speed() {
    let run = on_platform("nominal", "courier").remove(0).run(1);
    let speeds = run.evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Truth { speed_mm_s, .. }) => Some(speed_mm_s.abs()),
        _ => None,
    });
    let fastest = speeds.max().expect("truth is told");
    assert!((1_300..1_750).contains(&fastest), "{fastest}");
}

#[test]
fn courier_ends_in_the_stated_classes() {
    for name in STATED {
        for ready in on_platform(name, "courier") {
            assert!(!ready.scenario.expected.is_empty(), "{name}: nothing is stated");
            ready.expect(1..3);
        }
    }
}

/// Rise, set and distance by Skyfield 1.54 of the same elements and stations.
#[test]
fn contact_plan_of_ground_stations_agrees_with_an_independent_program() {
    let ready = on_platform("contact_gap", "space").remove(0);
    let topology = lay_out(&ready.scenario, &ready.setup, 1, &RunSecret::seeded(1));
    let plan: Vec<(u64, u64)> = topology.contacts.iter().map(|contact| (contact.from.0, contact.until.0)).collect();
    assert_eq!(plan.len(), 2, "{plan:?}");
    assert_eq!(plan[0].0, 0);
    assert!(plan[0].1.abs_diff(27_975_700) < 10_000, "sets at {} µs", plan[0].1);
    assert!(plan[1].0.abs_diff(58_439_868) < 10_000, "rises at {} µs", plan[1].0);
    let relays = topology.members.iter().filter_map(|member| match &member.role {
        MemberRole::Adversary(AdversaryConfig::DatagramRelay(config)) => Some(config.medium.clone()),
        MemberRole::Adversary(AdversaryConfig::StreamRelay(config)) => Some(config.medium.clone()),
        _ => None,
    });
    for medium in relays {
        for (ms, travel_us) in [(500, 4_217), (10_500, 4_439), (27_500, 4_822), (60_500, 4_784)] {
            let travel = medium.travel(Span::ms(ms)).expect("it carries then").0;
            assert!(travel.abs_diff(travel_us) < 30, "{travel} µs at {ms} ms");
        }
        assert_eq!(medium.travel(Span::s(40)), None);
    }
}

/// Both ends of the link know the plan, and a platform that no station loses from sight has none.
#[test]
fn unit_and_gateway_know_the_contact_plan() {
    let known = |scenario: &str, platform: &str| {
        let ready = on_platform(scenario, platform).remove(0);
        let topology = lay_out(&ready.scenario, &ready.setup, 1, &RunSecret::seeded(1));
        let contacts = topology.contacts.clone();
        let members = topology.members.iter().filter(|member| match &member.role {
            MemberRole::Autonomy(config) => roundtrip(config).contacts == contacts,
            MemberRole::Gateway(config) => roundtrip(config).contacts == [(wire::id::UnitId::A, contacts.clone())],
            _ => false,
        });
        (contacts.iter().count(), members.count())
    };
    assert_eq!(known("contact_gap", "space"), (2, 2));
    assert_eq!(known("nominal", "space"), (0, 2));
}

/// A plan without a contact would mean a link that always carries.
#[test]
fn stations_that_never_see_the_satellite_are_refused() {
    let (root, folder) = (holdsafe_tests::root(), tempfile::tempdir().unwrap());
    let shipped = std::fs::read_to_string(root.join("scenarios/control/contact_gap.toml")).unwrap();
    let near = shipped.replace("62.0", "-80.0").replace("contact_gap", "passing");
    let far = near.replace("80.7", "-80.7");
    let load = |text: &str| {
        let file = folder.path().join("passing.toml");
        std::fs::write(&file, text).unwrap();
        scenario::Setup::load(&root, &scenario::load_with(&file, Some(&root)).unwrap(), None, false)
    };
    load(&near).expect("one of the two stations sees it");
    let line = load(&far).unwrap_err().render(false);
    assert!(line.contains("no ground station sees the satellite within the trial"), "{line}");
}

#[test]
fn ground_stations_need_an_orbit() {
    let root = holdsafe_tests::root();
    let scenario = holdsafe_tests::shipped("contact_gap").scenario;
    let problems =
        scenario::Setup::load_on(&root, &scenario, &root.join("platforms/air.toml"), None, false).unwrap_err();
    let text = problems.render(false);
    assert!(text.contains("the platform `air` is in no orbit") && text.contains("conditions.station"), "{text}");
}
