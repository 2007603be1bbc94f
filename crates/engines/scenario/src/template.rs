//! The schema of the scenario format, and the commented file that `scenario new` starts with. The unit arms in it, in the twin,
//! rendered and live.

use schemars::generate::SchemaSettings;

use super::extend::OWN;
use super::{Name, Scenario};

/// JSON Schema of a scenario file; draft 7, which TOML editors know.
///
/// A key that a base may give is required of those alone that extend none.
pub fn schema() -> serde_json::Value {
    let mut schema = SchemaSettings::draft07().into_generator().into_root_schema_for::<Scenario>().to_value();
    let required = schema["required"].as_array().cloned().unwrap_or_default();
    let (own_keys, from_base): (Vec<_>, Vec<_>) =
        required.into_iter().partition(|key| key.as_str().is_some_and(|key| OWN.contains(&key)));
    schema["required"] = own_keys.into();
    schema["anyOf"] = serde_json::json!([{ "required": ["extends"] }, { "required": from_base }]);
    schema
}

/// A scenario to start from: it passes `scenario check` as it is.
pub fn template(name: &Name) -> String {
    TEMPLATE.replace("{name}", name.as_str())
}

const TEMPLATE: &str = r#"# A scenario of holdsafe. `holdsafe scenario check FILE` says what is wrong with it,
# `holdsafe scenario schema` prints every key with its type and range.
schema_version = 1
name = "{name}"                          # equal to the file's name
# extends = "armed"                      # a file of scenarios/bases or a scenario: gives what is left out here, such as scene and operator
title = "One line for the table"
description = """
What is done to whom, and what must then happen.
"""
threats = ["A04"]                        # rows of the threat catalogue
stride = ["denial-of-service"]
techniques = ["T0814"]                   # ATT&CK (T0814, T1499.004) or ATLAS (AML.T0015)
interface = "telemetry-link"
evidence = "model"                       # model | stack | live
requirement = "communication-trust"      # perception-integrity | communication-trust | runtime-assurance
# knowledge = "blind"                    # blind | on-path | insider | white-box: what the attack may know and wait for
expected = ["HOLD_SAFE"]                 # committed before the first run
policy = "default"                       # a file of policies/
platform = "ground"                      # a file of platforms/
duration_s = 9.0

[varies]
injection_phase_s = [0.0, 1.0]           # one uniform draw a trial, added to the time of every attack and fault

[scene]
start = { at_m = [-15.0, -5.0], heading_rad = 0.0 }
route = [[-8.0, -5.0], [-1.0, -5.0]]
geofence = [[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [-40.0, 40.0]]

[[scene.object]]
name = "car"
class = "vehicle"
path_m = [[8.0, -3.0]]
heading_rad = 1.2                        # its side in view: end on, the detector does not make it out in time
size_m = [4.2, 1.8, 1.6]
temperature_k = 318.0
colour = [60, 80, 150]

# The operator sees only what is displayed: a step waits for its time and for its conditions.
# Those that are due half a second or more before the attack have to be carried out by then, or the trial is INVALID: an
# attack that no mission met shows nothing. A line `mission = "none"` beside `expected` waives that, `mission = "armed"` demands it.
[[operator.step]]
at_s = 1.0
when_state = "IDLE"
do = "enable"
reason = "start of the mission"

[[operator.step]]
at_s = 2.5
when_state = "READY"
when_track = "vehicle"
do = "arm"
reason = "designated vehicle in view"

# The attack. Other tables: delay, jitter, burst_loss, duplicate, reorder, replay, corrupt, reoriginate, inject on
# datagrams; stream_delay, stall, throttle, half_close, reset, cut, stream_corrupt on the command plane; fault, kill;
# teammate, malformed by a teammate; rogue by a station with a key that is not its own; broker_drop, broker_delay,
# broker_reorder, broker_duplicate, broker_replay, broker_retain, broker_invent, broker_forge by the broker; feed_withhold,
# feed_delay, feed_forge, feed_replay, intent_drop by the gateway. Each of these may be
# a step that waits: name it with `step = "cut"`, and say `when = { enters = "PREPARE_TO_ACT", after_ms = 50 }`,
# `{ begun = "other" }`, `{ ended = "other" }`, `{ datagrams = 20 }`, `{ silence_ms = 300 }` or `{ hears = "READY" }`; `at_s` is
# then the earliest.
[[loss]]
at_s = 4.0
duration_s = 5.0
direction = "both"
share = 1.0
"#;
