//! A process's reading of its launcher's messages.

use link::clock::HostClock;
use link::loopback::LoopbackAddr;
use link::pki::{Authority, Role};
use link::spec::{BusSpec, ChannelSpec, Control, DtlsDial, MAX_SPEC, MqttDial, ServiceSpec, SpecError};
use wire::core::{Subject, Topic};
use wire::id::{Boot, NodeId, PeerId, UnitId};

fn spec() -> ServiceSpec {
    let clock = HostClock { zero_us: 42, drift_ppm: -7 };
    let credential = Authority::new().unwrap().issue(PeerId::UNIT_A, Role::Dials).unwrap();
    let mut spec = ServiceSpec::new(NodeId::UNIT_A, Boot(2), u64::MAX, clock, "/run/somewhere".into());
    spec.bus.push(BusSpec {
        root: "/run/somewhere/vehicle".into(),
        prefix: "hs_abc_v_".into(),
        subscribe: vec![ChannelSpec { scope: "unit-a".into(), topic: Topic::Tracks, cipher: None }],
        publish: Vec::new(),
        publishers: 2,
    });
    let remote = LoopbackAddr::on_port(5684);
    spec.dial = Some(DtlsDial { remote, expect: PeerId::GATEWAY, credential: credential.clone() });
    let subscribe = vec![Subject::Command(UnitId::A)];
    let expect = PeerId::from_name("broker").unwrap();
    spec.mqtt = Some(MqttDial { remote, own: PeerId::UNIT_A, expect, credential, subscribe, on_demand: false });
    spec.config = serde_json::json!({ "anything": [1, 2, 3] });
    spec
}

fn written(spec: &ServiceSpec) -> Vec<u8> {
    let mut bytes = Vec::new();
    spec.write(&mut bytes).unwrap();
    bytes
}

/// The rest of the pipe is left unread.
#[test]
fn specification_arrives_as_written() {
    let mut bytes = written(&spec());
    bytes.extend(b"quiesce\n");
    let mut pipe = bytes.as_slice();
    let read = ServiceSpec::read(&mut pipe).unwrap();
    assert_eq!(pipe, b"quiesce\n");
    assert_eq!(serde_json::to_value(&read).unwrap(), serde_json::to_value(spec_of(&read)).unwrap());
    assert_eq!(read.mqtt.unwrap().subscribe, [Subject::Command(UnitId::A)]);
    assert_eq!(read.seed, u64::MAX);
}

/// A fresh specification with the credentials of `other`, which differ from call to call.
fn spec_of(other: &ServiceSpec) -> ServiceSpec {
    let mut fresh = spec();
    fresh.dial.clone_from(&other.dial);
    fresh.mqtt.clone_from(&other.mqtt);
    fresh
}

#[test]
fn a_specification_cut_at_any_byte_is_refused() {
    let bytes = written(&spec());
    for cut in 0..bytes.len() {
        assert!(matches!(ServiceSpec::read(&bytes[..cut]), Err(SpecError::Io(_))), "cut at {cut}");
    }
}

/// Lengths, fields, addresses and names.
#[test]
fn values_outside_bounds_are_refused() {
    let too_long = ((MAX_SPEC + 1) as u32).to_be_bytes();
    assert!(matches!(ServiceSpec::read(too_long.as_slice()), Err(SpecError::TooLong(_))));
    let good = serde_json::to_string(&spec()).unwrap();
    let cases = [
        ("127.0.0.1:5684", "192.0.2.1:5684"),
        ("127.0.0.1:5684", "localhost:5684"),
        ("\"seed\"", "\"sead\""),
        ("hs/cmd/unit-a", "hs/cmd/#"),
        ("\"tracks\"", "\"everything\""),
        ("\"node\":\"unit-a\"", "\"node\":\"root\""),
        ("\"guard\":\"required\"", "\"guard\":\"off\""),
    ];
    for (from, to) in cases {
        assert!(good.contains(from), "{from}");
        let json = good.replace(from, to);
        let mut bytes = (json.len() as u32).to_be_bytes().to_vec();
        bytes.extend(json.as_bytes());
        assert!(matches!(ServiceSpec::read(bytes.as_slice()), Err(SpecError::Json(_))), "{to}");
    }
}

/// Keys are not printed.
#[test]
fn controls_are_two_words_and_keys_hidden() {
    assert_eq!(Control::parse("quiesce\n"), Some(Control::Quiesce));
    assert_eq!(Control::parse("finish"), Some(Control::Finish));
    assert_eq!(Control::parse("FINISH\n"), None);
    assert_eq!(Control::parse(""), None);
    let spec = spec();
    let key = &spec.dial.as_ref().unwrap().credential.key_pkcs8_der;
    assert!(!format!("{spec:?}").contains(&format!("{:?}", &key[..8]).replace(['[', ']'], "")));
}
