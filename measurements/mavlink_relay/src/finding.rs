//! Known causes of findings: `findings.toml`. A cause is looked up for a measured finding alone and makes none.

use serde::Deserialize;

use crate::attack::{Attack, Link};

/// The committed list.
const LIST: &str = include_str!("../findings.toml");

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Finding {
    attack: Attack,
    link: Link,
    /// Name and version of the receiver.
    receiver: String,
    cause: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    finding: Vec<Finding>,
}

/// The cause of this finding in a line, if it is known.
pub fn explained(attack: Attack, link: Link, receiver: &str) -> Option<String> {
    let list: List = toml::from_str(LIST).ok()?;
    let known = |f: &Finding| f.attack == attack && f.link == link && f.receiver == receiver;
    list.finding.into_iter().find(known).map(|f| f.cause)
}
