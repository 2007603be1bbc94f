//! Rights to publish and to subscribe, as one table.
//!
//! An *identity* is the authenticated peer, never a client's word about itself. A *pattern* is a topic filter of the
//! command plane: `hs/cmd/<unit>`, `hs/ack/<unit>`, or either with `+` for every unit. The table grants at most one
//! pattern for each identity and verb, and no right that it does not list:
//!
//! | identity | publish | subscribe |
//! |---|---|---|
//! | `gateway` | `hs/cmd/+` | `hs/ack/+` |
//! | `unit-x` | `hs/ack/unit-x` | `hs/cmd/unit-x` |
//! | any other | none | none |
//!
//! Both brokers ask here: the model in [`crate::Broker`] with subjects, the live one in [`crate::server`] with text.
//! The meaning of a command, and the validity of its signature, belong to the gateway and to autonomy.

use core::fmt;

use thiserror::Error;
use wire::core::Subject;
use wire::id::{PeerId, UnitId};
use wire::policy::Requirement;

/// The longest topic name or filter, in bytes, that is looked at.
pub const MAX_TOPIC_LEN: usize = 64;

/// Use of a topic that an identity asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verb {
    /// Send to a subject.
    Publish,
    /// Receive from the subjects of a pattern.
    Subscribe,
}

impl Verb {
    /// Every verb.
    pub const ALL: [Verb; 2] = [Verb::Publish, Verb::Subscribe];
}

impl fmt::Display for Verb {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Verb::Publish => "publish",
            Verb::Subscribe => "subscribe",
        })
    }
}

/// The two kinds of subject on the command plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// Commands to a unit, `hs/cmd/<unit>`.
    Command,
    /// Acknowledgements of a unit, `hs/ack/<unit>`.
    Ack,
}

/// A topic filter of the closed set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pattern {
    /// One unit's subject.
    One(Subject),
    /// Every unit's subject of a family: the filter that ends in `+`.
    Every(Family),
}

impl Pattern {
    /// Reads a topic filter.
    ///
    /// Every filter that some row of the table could cover has one of the two forms of a pattern, so a filter of any
    /// other form is refused here, by name.
    pub fn parse(filter: &str) -> Result<Self, Refusal> {
        check_text(filter)?;
        if filter.starts_with("$share/") {
            return Err(Refusal::SharedSubscription { got: filter.to_owned() });
        }
        if filter.starts_with('$') {
            return Err(Refusal::ReservedTopic { got: filter.to_owned() });
        }
        match filter {
            "hs/cmd/+" => Ok(Pattern::Every(Family::Command)),
            "hs/ack/+" => Ok(Pattern::Every(Family::Ack)),
            other if other.contains(['+', '#']) => Err(Refusal::FilterTooWide { got: other.to_owned() }),
            other => subject(other).map(Pattern::One),
        }
    }

    /// True if every topic that `requested` matches is matched by this pattern too.
    pub fn covers(self, requested: Pattern) -> bool {
        match (self, requested) {
            (Pattern::One(granted), Pattern::One(asked)) => granted == asked,
            (Pattern::Every(granted), Pattern::Every(asked)) => granted == asked,
            (Pattern::Every(granted), Pattern::One(asked)) => granted == family(asked),
            (Pattern::One(_), Pattern::Every(_)) => false,
        }
    }
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Pattern::One(Subject::Command(_)) | Pattern::Every(Family::Command) => "hs/cmd/",
            Pattern::One(Subject::Ack(_)) | Pattern::Every(Family::Ack) => "hs/ack/",
        })?;
        match self {
            Pattern::One(Subject::Command(unit) | Subject::Ack(unit)) => f.write_str(unit.name()),
            Pattern::Every(_) => f.write_str("+"),
        }
    }
}

/// Reason that the broker did not do as an identity asked.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Refusal {
    /// The table grants this identity another pattern, or none.
    #[error("{peer} may {verb} {}, got {got}", granted(.expected))]
    NotGranted {
        /// Identity that asked.
        peer: PeerId,
        /// Use that it asked for.
        verb: Verb,
        /// Grant of the table for that verb.
        expected: Option<Pattern>,
        /// Pattern that it asked for.
        got: Pattern,
    },
    /// A name outside the command plane, or of no vehicle.
    #[error("expected hs/cmd/<unit> or hs/ack/<unit>, got `{got}`")]
    UnknownTopic {
        /// The topic as it came.
        got: String,
    },
    /// A wildcard filter that no row of the table covers.
    #[error("expected a filter no wider than hs/cmd/+ or hs/ack/+, got `{got}`")]
    FilterTooWide {
        /// The filter as it came.
        got: String,
    },
    /// A shared subscription would take messages away from the unit they are for.
    #[error("expected a plain filter, got the shared subscription `{got}`")]
    SharedSubscription {
        /// The filter as it came.
        got: String,
    },
    /// Topics that begin with `$` belong to the broker, and this one keeps none.
    #[error("expected a topic under hs/, got the reserved `{got}`")]
    ReservedTopic {
        /// The topic as it came.
        got: String,
    },
    /// Longer than any topic of the command plane.
    #[error("expected a topic of 1 to {MAX_TOPIC_LEN} bytes, got {got}")]
    TopicLength {
        /// Length of the topic or filter in bytes.
        got: usize,
    },
}

impl Refusal {
    /// The name of the refusal, as in logs and documents.
    pub fn name(&self) -> &'static str {
        match self {
            Refusal::NotGranted { .. } => "not_granted",
            Refusal::UnknownTopic { .. } => "unknown_topic",
            Refusal::FilterTooWide { .. } => "filter_too_wide",
            Refusal::SharedSubscription { .. } => "shared_subscription",
            Refusal::ReservedTopic { .. } => "reserved_topic",
            Refusal::TopicLength { .. } => "topic_length",
        }
    }
}

/// The table: the grant of `peer` for `verb`, or `None` without one.
pub fn grant(peer: PeerId, verb: Verb) -> Option<Pattern> {
    if peer == PeerId::GATEWAY {
        return Some(Pattern::Every(match verb {
            Verb::Publish => Family::Command,
            Verb::Subscribe => Family::Ack,
        }));
    }
    let unit = vehicle(peer)?;
    Some(Pattern::One(match verb {
        Verb::Publish => Subject::Ack(unit),
        Verb::Subscribe => Subject::Command(unit),
    }))
}

/// Checks that the table grants `got` to `peer` for `verb`.
pub fn permit(peer: PeerId, verb: Verb, got: Pattern) -> Result<(), Refusal> {
    let expected = grant(peer, verb);
    match expected {
        Some(granted) if granted.covers(got) => Ok(()),
        Some(_) | None => Err(Refusal::NotGranted { peer, verb, expected, got }),
    }
}

/// Applies the policy to an answer of the table. If the policy waives the table (`Check::Rights`), an ungranted topic
/// passes; a topic outside the command plane never does.
pub fn apply_policy(rights: Requirement, requested: Result<(), Refusal>) -> Result<(), Refusal> {
    match requested {
        Err(Refusal::NotGranted { .. }) if rights == Requirement::Waived => Ok(()),
        said => said,
    }
}

/// Reads a topic name and asks whether `peer` may publish to it.
pub fn permit_topic(peer: PeerId, topic: &str) -> Result<Subject, Refusal> {
    // The length first: later refusals keep the text, which bounds their log lines.
    check_text(topic)?;
    let subject = subject(topic)?;
    permit(peer, Verb::Publish, Pattern::One(subject))?;
    Ok(subject)
}

/// Reads a topic filter and asks whether `peer` may subscribe to all that it matches.
pub fn permit_filter(peer: PeerId, filter: &str) -> Result<Pattern, Refusal> {
    let pattern = Pattern::parse(filter)?;
    permit(peer, Verb::Subscribe, pattern)?;
    Ok(pattern)
}

fn check_text(topic: &str) -> Result<(), Refusal> {
    match topic.len() {
        1..=MAX_TOPIC_LEN => Ok(()),
        got => Err(Refusal::TopicLength { got }),
    }
}

fn subject(topic: &str) -> Result<Subject, Refusal> {
    Subject::from_topic(topic).ok_or_else(|| match topic.starts_with('$') {
        true => Refusal::ReservedTopic { got: topic.to_owned() },
        false => Refusal::UnknownTopic { got: topic.to_owned() },
    })
}

fn family(subject: Subject) -> Family {
    match subject {
        Subject::Command(_) => Family::Command,
        Subject::Ack(_) => Family::Ack,
    }
}

/// Unit of the certificate; absent where it is no unit's.
fn vehicle(peer: PeerId) -> Option<UnitId> {
    wire::trust::unit_of(peer)
}

fn granted(pattern: &Option<Pattern>) -> String {
    pattern.map_or_else(|| "nothing".to_owned(), |pattern| pattern.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Identities of each kind.
    const PEERS: [&str; 15] = [
        "unit-a",
        "unit-b",
        "unit-c",
        "unit-d",
        "sim",
        "perception",
        "gateway",
        "broker",
        "console",
        "recorder",
        "relay-command",
        "insider-b",
        "insider-command",
        "operator-1",
        "campaign",
    ];
    const UNITS: [&str; 4] = ["unit-a", "unit-b", "unit-c", "unit-d"];

    #[test]
    fn every_role_topic_and_verb_matches_the_table() {
        for peer in PEERS {
            for unit in UNITS {
                let gateway = peer == "gateway";
                let is_own = peer == unit;
                check(peer, Verb::Publish, &format!("hs/cmd/{unit}"), gateway);
                check(peer, Verb::Subscribe, &format!("hs/cmd/{unit}"), is_own);
                check(peer, Verb::Publish, &format!("hs/ack/{unit}"), is_own);
                check(peer, Verb::Subscribe, &format!("hs/ack/{unit}"), gateway);
            }
            check(peer, Verb::Subscribe, "hs/ack/+", peer == "gateway");
            check(peer, Verb::Subscribe, "hs/cmd/+", false);
            check(peer, Verb::Publish, "hs/cmd/+", false);
        }
    }

    #[test]
    fn accepted_filter_matches_granted_topics_only() {
        let filters =
            ["#", "+", "hs/#", "hs/+/unit-a", "hs/cmd/#", "hs/ack/#", "hs/ack/+", "hs/ack/+/#", "hs/+/+", "+/ack/+"];
        let filters = filters.map(str::to_owned).into_iter();
        let exact = UNITS
            .iter()
            .flat_map(|unit| [format!("hs/cmd/{unit}"), format!("hs/ack/{unit}"), format!("hs/cmd/{unit}/#")]);
        let filters: Vec<String> = filters.chain(exact).collect();
        let topics: Vec<String> = ["hs/ack", "hs/ack/unit-a/x", "hs/cmd/sim", "other"]
            .map(str::to_owned)
            .into_iter()
            .chain(UNITS.iter().flat_map(|unit| [format!("hs/cmd/{unit}"), format!("hs/ack/{unit}")]))
            .collect();
        for peer in PEERS.map(peer) {
            for filter in filters.iter().filter(|filter| permit_filter(peer, filter).is_ok()) {
                for topic in topics.iter().filter(|topic| mqtt_matches(filter, topic)) {
                    let subject = Subject::from_topic(topic).expect("an accepted filter matches only subjects");
                    permit(peer, Verb::Subscribe, Pattern::One(subject))
                        .expect("what it matches is granted one by one");
                }
            }
        }
    }

    #[test]
    fn each_refusal_says_its_name_and_what_came() {
        let cases = [
            ("$share/g/hs/ack/+", "shared_subscription"),
            ("$SYS/#", "reserved_topic"),
            ("$SYS/broker/uptime", "reserved_topic"),
            ("#", "filter_too_wide"),
            ("hs/ack/#", "filter_too_wide"),
            ("hs/+/unit-a", "filter_too_wide"),
            ("hs/ack/unit-a/+", "filter_too_wide"),
            ("hs/ack/sim", "unknown_topic"),
            ("hs/ack/unit-a/x", "unknown_topic"),
            ("HS/ack/unit-a", "unknown_topic"),
            ("hs/cmd/unit-a", "not_granted"),
            ("", "topic_length"),
        ];
        for (filter, name) in cases {
            let refusal = permit_filter(PeerId::GATEWAY, filter).expect_err(filter);
            assert_eq!(refusal.name(), name, "{filter}: {refusal}");
        }
        let long = "h".repeat(MAX_TOPIC_LEN + 1);
        assert_eq!(permit_topic(PeerId::GATEWAY, &long), Err(Refusal::TopicLength { got: MAX_TOPIC_LEN + 1 }));
        let refusal = permit_topic(PeerId::UNIT_B, "hs/cmd/unit-a").expect_err("a unit commands nobody");
        assert_eq!(refusal.to_string(), "unit-b may publish hs/ack/unit-b, got hs/cmd/unit-a");
        let refusal = permit_topic(peer("sim"), "hs/cmd/unit-a").expect_err("the simulation commands nobody");
        assert_eq!(refusal.to_string(), "sim may publish nothing, got hs/cmd/unit-a");
    }

    fn check(name: &str, verb: Verb, text: &str, expected: bool) {
        let requested = match verb {
            Verb::Publish => permit_topic(peer(name), text).map(|_| ()),
            Verb::Subscribe => permit_filter(peer(name), text).map(|_| ()),
        };
        assert_eq!(requested.is_ok(), expected, "{name} {verb} {text}: {requested:?}");
    }

    fn peer(name: &str) -> PeerId {
        PeerId::from_name(name).expect("a name of the closed set")
    }

    /// Matching as MQTT 5 section 4.7 has it, for topics that do not begin with `$`.
    fn mqtt_matches(filter: &str, topic: &str) -> bool {
        let (mut levels, mut names) = (filter.split('/'), topic.split('/'));
        loop {
            match (levels.next(), names.next()) {
                (Some("#"), _) | (None, None) => return true,
                (Some(level), Some(name)) if level == "+" || level == name => {}
                _ => return false,
            }
        }
    }
}
