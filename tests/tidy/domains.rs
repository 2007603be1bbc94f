//! One pattern for every domain: the boundary, the links' services, the adversary, the judge and the state machine know no kind of body.
//!
//! A name of a domain or of its parts in them would be a second copy of the pattern. The kinds of body are the simulation's, the limits that go
//! with them the platform file's and the navigation's.

use crate::{code, sources};

/// Words that belong to one domain.
const WORDS: [&str; 24] = [
    "fixed_wing",
    "FixedWing",
    "multirotor",
    "Multirotor",
    "rotor",
    "wheeled",
    "Wheeled",
    "wheelbase",
    "satellite",
    "Satellite",
    "spacecraft",
    "orbit",
    "altitude",
    "barometer",
    "Aloft",
    "aloft",
    "quadrotor",
    "aircraft",
    "airspeed",
    "Vehicle::GROUND",
    "platform::Body",
    "Body::Multi",
    "gimbal",
    "eclipse",
];

/// Parts of the pattern.
const ONE_FOR_ALL: [&str; 9] = [
    "crates/shared/wire/src/trust/",
    "crates/shared/wire/src/session.rs",
    "crates/gateway/src/",
    "crates/broker/src/",
    "crates/adversary/src/",
    "crates/judge/oracle/src/",
    "crates/autonomy/src/transition",
    "crates/autonomy/src/command",
    "crates/shared/link/src/",
];

/// Domain words in this code.
fn domain_words(text: &str) -> Vec<&'static str> {
    let code = code(text);
    WORDS.into_iter().filter(|word| code.contains(word)).collect()
}

#[test]
fn the_pattern_knows_no_domain() {
    let files: Vec<(String, String)> = sources("crates")
        .into_iter()
        .filter(|(name, _)| ONE_FOR_ALL.iter().any(|part| name.starts_with(part)))
        .collect();
    assert!(files.len() > 150, "{} files: the parts have moved", files.len());
    for part in ONE_FOR_ALL {
        assert!(files.iter().any(|(name, _)| name.starts_with(part)), "{part}: nothing is there");
    }
    let found: Vec<String> = files
        .iter()
        .filter(|(_, text)| !domain_words(text).is_empty())
        .map(|(name, text)| format!("{name}: {:?}", domain_words(text)))
        .collect();
    assert_eq!(found, Vec::<String>::new());
}

#[test]
fn a_domain_in_the_pattern_is_found() {
    assert_eq!(domain_words("if body == Body::Multirotor(x) { /* rotor */ }"), ["Multirotor", "rotor", "Body::Multi"]);
    assert_eq!(domain_words("let x = 1; // a satellite"), Vec::<&str>::new());
}
