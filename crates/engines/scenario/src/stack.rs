//! Actions on the real stacks in memory: each table is a cell of its scenario, with its own expected classes.
//!
//! There is no platform in such a scenario, so none of these has a time; the seed varies the values that are not written here.
//! `stacks` carries the tables out.

use evidence::trial::Outcome;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::policy::Requirement;

use super::Scenario;
use super::value::{List, Located, Whole};

/// One of the two links.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Link {
    /// DTLS 1.2 between platform and gateway.
    Telemetry,
    /// TLS 1.3 between platform or gateway and broker.
    Command,
}

/// Place of the adversary: an end of a handshake, or between both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Hand {
    /// It dials.
    Dials,
    /// It listens.
    Listens,
    /// It edits the messages of two honest ends to each other.
    Relays,
}

/// Certificate that an impostor presents.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Certificate {
    /// A good one: the control.
    Sound,
    /// None.
    Missing,
    /// One that only itself has signed.
    SelfSigned,
    /// One of another authority.
    Foreign,
    /// One that has ended.
    Expired,
    /// One that has not begun.
    NotYetValid,
    /// One on the revocation list.
    Revoked,
    /// A good one that comes onto the list while its session stands.
    RevokedLater,
    /// One for the other end of a handshake.
    WrongRole,
    /// One of another identity than the one that was dialled.
    OtherName,
    /// One of two identities.
    TwoNames,
}

/// An impostor with this certificate opens or accepts a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Impostor {
    /// The link.
    pub link: Link,
    /// The end.
    pub end: Located<Hand>,
    /// The certificate.
    pub certificate: Located<Certificate>,
    /// The expected classes.
    pub expected: Located<List<Outcome, 9>>,
}

/// Level that a handshake is brought down to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Lower {
    /// DTLS 1.0, TLS 1.2.
    Version,
    /// A weaker suite: a shorter tag in DTLS, RSA key exchange in TLS.
    Suite,
    /// A suite without authenticated encryption.
    Cbc,
    /// A pre-shared key in place of certificates.
    PreSharedKey,
    /// No extended master secret.
    MasterSecret,
}

/// An adversary offers less than the pinned protocol, or makes it look as if an honest end did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Downgrade {
    /// The link.
    pub link: Link,
    /// Place of the adversary.
    pub by: Located<Hand>,
    /// The level.
    pub to: Located<Lower>,
    /// The expected classes.
    pub expected: Located<List<Outcome, 9>>,
}

/// Action on the records of an open association.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Deed {
    /// Records that passed are put in again.
    Replay,
    /// Each is put in several times as it passes.
    Duplicate,
    /// Records are inserted in another order, within the replay window.
    Reorder,
    /// Records are kept for a minute and then put in.
    Withhold,
    /// One bit is flipped.
    Flip,
    /// The end is cut off.
    Truncate,
    /// Bytes are put behind.
    Extend,
    /// The head of one is put before the body of another.
    Splice,
    /// A plaintext fatal alert is put in.
    Alert,
    /// A plaintext close notification is inserted.
    Close,
    /// Plaintext application data is put in.
    Data,
}

/// An adversary without a key handles the datagrams of an open association.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Handle {
    /// The action.
    pub deed: Deed,
    /// Count of the records, or of the repetitions.
    pub count: Whole<1, 512>,
    /// Requirement that the target's guard drops records that no key protects.
    #[serde(default = "required")]
    #[schemars(with = "String")]
    pub guard: Requirement,
    /// The expected classes.
    pub expected: Located<List<Outcome, 9>>,
}

/// Datagrams that unknown peers send.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Flood {
    /// Sound ClientHellos, and then silence to any answer.
    Hello,
    /// ClientHellos that are cut off.
    Broken,
    /// Random bytes.
    Noise,
    /// Sound ClientHellos of peers that show that they receive, begin again, and then stay silent.
    Proving,
}

/// Unknown peers send to a listener, each from its own address.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Storm {
    /// Their datagrams.
    pub content: Flood,
    /// Count of the peers.
    pub count: Whole<1, 4000>,
    /// Time between two of them, microseconds.
    pub every_us: Whole<10, 1_000_000>,
    /// The expected classes.
    pub expected: Located<List<Outcome, 9>>,
}

/// Place that is observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Observed {
    /// DTLS 1.2 between platform and gateway.
    Telemetry,
    /// TLS 1.3 between platform or gateway and broker.
    Command,
    /// A channel in the shared memory of the control room's host.
    Bus,
}

/// Place of an observer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stand {
    /// On the path between the two ends; on a bus, a process without the key of a confidential channel.
    Path,
    /// Behind the secure layer of an end, where everything is plain; on a bus, beside a channel that tags alone protect: the control.
    Behind,
    /// On a bus, with the channel's key, after the time of its rights.
    Late,
}

/// An observer sees every byte and does no more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Observe {
    /// The link.
    pub link: Observed,
    /// The place.
    pub at: Located<Stand>,
    /// The expected classes.
    pub expected: Located<List<Outcome, 9>>,
}

fn required() -> Requirement {
    Requirement::Required
}

/// A word as the file writes it.
fn word(value: impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

/// True if there is such a downgrade: a listener follows the dialling end, the suite of the telemetry link is one, and TLS 1.3
/// has neither the old constructions nor keys that were agreed upon before.
pub fn can_be_lowered(link: Link, hand: Hand, to: Lower) -> bool {
    match (link, hand) {
        (Link::Telemetry, Hand::Dials) => true,
        (Link::Telemetry, Hand::Relays) => matches!(to, Lower::Version | Lower::Suite | Lower::MasterSecret),
        (Link::Telemetry, Hand::Listens) => false,
        (Link::Command, Hand::Dials | Hand::Listens) => to == Lower::Version,
        (Link::Command, Hand::Relays) => matches!(to, Lower::Version | Lower::Suite),
    }
}

impl Scenario {
    /// True if it runs on the real stacks in memory, without a platform.
    pub fn is_of_stacks(&self) -> bool {
        !(self.impostor.is_empty()
            && self.downgrade.is_empty()
            && self.handle.is_empty()
            && self.storm.is_empty()
            && self.observe.is_empty())
    }

    /// Each of its cells, by name, as a scenario with that one of these tables alone.
    pub(super) fn stack_cells(&self) -> Vec<(String, Scenario)> {
        let mut cells = Vec::new();
        let bare = || {
            let mut bare = self.clone();
            (bare.impostor, bare.downgrade, bare.handle, bare.storm, bare.observe) = Default::default();
            bare
        };
        let mut add = |label: String, expected: &Located<List<Outcome, 9>>, put: &dyn Fn(&mut Scenario)| {
            let mut cell = bare();
            cell.expected = expected.clone();
            put(&mut cell);
            cells.push((label, cell));
        };
        for one in &self.impostor {
            let label = format!("{}/{}/{}", word(one.link), word(*one.end), word(*one.certificate));
            add(label, &one.expected, &|cell| cell.impostor = List::from_first([one.clone()]));
        }
        for one in &self.downgrade {
            let label = format!("{}/{}/{}", word(one.link), word(*one.by), word(*one.to));
            add(label, &one.expected, &|cell| cell.downgrade = List::from_first([one.clone()]));
        }
        for one in &self.handle {
            let guard = if one.guard == Requirement::Waived { "/guard-off" } else { "" };
            let label = format!("{}{guard}", word(one.deed));
            add(label, &one.expected, &|cell| cell.handle = List::from_first([one.clone()]));
        }
        for one in &self.storm {
            let label = format!("{}/{}us", word(one.content), one.every_us.get());
            add(label, &one.expected, &|cell| cell.storm = List::from_first([one.clone()]));
        }
        for one in &self.observe {
            let label = format!("{}/{}", word(one.link), word(*one.at));
            add(label, &one.expected, &|cell| cell.observe = List::from_first([one.clone()]));
        }
        cells
    }
}
