//! A passive observer who sees every byte of a link: the marks readable there.
//!
//! Unit, gateway and operator exchange the messages of a mission, over a real association or through the real broker. None of their content,
//! no key and no session secret may be read on the path. The clear text of a handshake is reported, not hidden: with DTLS 1.2 the
//! certificates of both ends, with TLS 1.3 the name of the end that is dialled and no other.
//!
//! On a bus the observer is a process of the host that listens on a channel of real shared memory and maps it. A channel that the policy
//! makes confidential shows it no content; one that only tags protect is the control. With a right that has ended it hears no message.
//!
//! The receipt: the observer saw the bytes that arrived at the ends, and the same search finds every mark in the plain text
//! there. An observer behind the secure layer is the control in which it has to be found.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use broker::watched::{Papers, Watched, watch};
use link::guard::observe::digest;
use link::guard::record::{Split, split};
use link::memory::overheard::{Overheard, Stranger, overheard};
use link::memory::{Pair, Party, clear};
use link::pki::{Authority, Credential, Role, dns_name};
use live::leftovers::Marked;
use live::remains::Remains;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use scenario::stack::{Observe, Observed, Stand};
use wire::core::Side;
use wire::id::{PeerId, UnitId};

use super::StackError;
use super::judge::Showing;
use super::search::Search;
use super::words::{Mark, Speakers};

/// First bytes of a certificate, by which it is recognized.
const MARK: usize = 64;

/// Bytes before the private scalar in the PKCS #8 form of a P-256 key (RFC 5915: version 1, then an octet string of
/// 32).
const BEFORE_SCALAR: [u8; 5] = [2, 1, 1, 4, 32];

/// Beginnings of a key or certificate as text.
const AS_TEXT: [&str; 2] = ["-----BEGIN ", "PRIVATE KEY"];

/// Looks at a link while it is used.
pub(super) fn observed(one: &Observe, seed: u64) -> Result<Showing, StackError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let units = [UnitId::A, UnitId::B, UnitId::C];
    let unit = units[rng.next_u32() as usize % units.len()];
    let peer = PeerId::from_name(unit.name()).ok_or(StackError::NotOneCell)?;
    let authority = Authority::new()?;
    let ends = Ends {
        unit: (peer, authority.issue(peer, Role::Dials)?),
        gateway: (PeerId::GATEWAY, authority.issue(PeerId::GATEWAY, Role::Both)?),
        broker: (PeerId::BROKER, authority.issue(PeerId::BROKER, Role::Listens)?),
    };
    let mut speakers = Speakers::new(unit, rng);
    let seen = match one.link {
        Observed::Telemetry => over_dtls(&ends, &mut speakers)?,
        Observed::Command => over_the_broker(&ends, unit, &mut speakers)?,
        Observed::Bus => over_a_bus(*one.at, &mut speakers)?,
    };
    let mut secrets = seen.secrets.clone();
    secrets.extend(speakers.keys());
    secrets.extend(ends.keys());
    Ok(judged(one, &seen, &ends, &secrets))
}

/// Participants, each with its certificate.
struct Ends {
    unit: (PeerId, Credential),
    gateway: (PeerId, Credential),
    broker: (PeerId, Credential),
}

impl Ends {
    fn all(&self) -> [&(PeerId, Credential); 3] {
        [&self.unit, &self.gateway, &self.broker]
    }

    /// Their private keys, also as text. The public half is in the certificate, so that it is no mark.
    fn keys(&self) -> Vec<Mark> {
        let mut marks: Vec<Mark> =
            AS_TEXT.iter().map(|text| Mark::new("a key or certificate as text", *text)).collect();
        for (peer, credential) in self.all() {
            let der = &credential.key_pkcs8_der;
            let position = der.windows(BEFORE_SCALAR.len()).position(|window| window == BEFORE_SCALAR);
            let from = position.map_or(0, |index| index + BEFORE_SCALAR.len());
            let scalar = der.get(from..from + 32).unwrap_or_default();
            let hex: String = scalar.iter().map(|byte| format!("{byte:02x}")).collect();
            marks.push(Mark::new(format!("the private key of {peer}"), scalar));
            marks.push(Mark::new(format!("the private key of {peer} as text"), hex));
        }
        marks
    }
}

/// Traffic of a trial as an observer on the path sees it, and as the ends have it.
struct Sight {
    /// Bytes on the path, direction by direction.
    path: Vec<Vec<Vec<u8>>>,
    /// Hashes of the arrivals at the ends, direction by direction; none of a direction that arrived otherwise.
    arrived: Vec<Option<Vec<u8>>>,
    /// Further bytes that the observer sees, which represent no message.
    beside: Vec<Vec<u8>>,
    /// Plain text at the ends.
    plain: Vec<Vec<u8>>,
    /// Messages sent.
    said: Vec<Mark>,
    /// Session secrets.
    secrets: Vec<Mark>,
    /// Number of messages sent.
    messages: u64,
}

fn over_dtls(ends: &Ends, speakers: &mut Speakers) -> Result<Sight, StackError> {
    let parties = [&ends.unit, &ends.gateway].map(|(_, credential)| Party::honest(credential.clone()));
    let mut pair = Pair::open([&parties[0], &parties[1]], PeerId::GATEWAY, clear())?;
    if pair.peer(Side::Client).is_err() || pair.peer(Side::Server).is_err() {
        return Err(StackError::NoAssociation);
    }
    let (pairs, said) = speakers.session();
    let mut path = vec![pair.take(Side::Client), pair.take(Side::Server)];
    let mut plain = Vec::new();
    for records in &pairs {
        for (from, record) in [Side::Client, Side::Server].into_iter().zip(records) {
            let datagram = pair.send(from, record).ok_or(StackError::NoAssociation)?;
            plain.extend(pair.put(from.opposite(), &datagram));
            path[from as usize].push(datagram);
        }
    }
    let observed = |pair: &mut Pair, side| pair.observed(side).iter().flat_map(|seen| seen.digest).collect::<Vec<u8>>();
    let arrived = vec![Some(observed(&mut pair, Side::Server)), Some(observed(&mut pair, Side::Client))];
    let secret = |bytes: Vec<u8>| Mark::new("the association's master secret", bytes);
    let secrets = pair.secrets()?.into_iter().map(secret).collect();
    let beside = Vec::new();
    Ok(Sight { path, arrived, beside, plain, said, secrets, messages: 2 * pairs.len() as u64 })
}

/// Place of a channel's memory. Where this process is killed, the next live run or `doctor` removes it.
struct Place(Marked);

impl Place {
    fn new() -> Result<Self, StackError> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let name = format!("h{}_{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let (prefix, folder) = (format!("hs_{name}_"), std::env::temp_dir().join(format!("holdsafe-{name}")));
        let domains = vec![(format!("{prefix}bus_"), folder.join("bus"))];
        Ok(Place(Marked::begin(Remains { prefix, domains, folder, scratch: None }).map_err(StackError::Place)?))
    }

    /// Prefix and root of its one domain.
    fn domain(&self) -> (&str, &Path) {
        let [(prefix, root), ..] = &self.0.remains().domains[..] else { return ("", Path::new("")) };
        (prefix, root)
    }
}

fn over_a_bus(stand: Stand, speakers: &mut Speakers) -> Result<Sight, StackError> {
    let (orders, said) = speakers.commands();
    let messages: Vec<Vec<u8>> = orders.into_iter().map(|(_, bytes)| bytes).collect();
    let key = speakers.channel_key();
    let stranger = if stand == Stand::Late { Stranger::Late } else { Stranger::Keyless };
    let place = Place::new()?;
    let Overheard { read, carried, heard, mapped } =
        overheard(place.domain(), &messages, (stand != Stand::Behind).then_some(key), stranger)?;
    let secrets = vec![Mark::new("the channel's key", key)];
    // A late observer that hears no message has no path: its receipt is the plain text at the readers.
    let (path, arrived) = match stand {
        Stand::Late if heard.is_empty() => (Vec::new(), Vec::new()),
        Stand::Path | Stand::Behind | Stand::Late => {
            (vec![heard], vec![Some(digests(carried.iter().map(Vec::as_slice)))])
        }
    };
    Ok(Sight { path, arrived, beside: mapped, plain: read, said, secrets, messages: messages.len() as u64 })
}

fn over_the_broker(ends: &Ends, who: UnitId, speakers: &mut Speakers) -> Result<Sight, StackError> {
    let (orders, mut said) = speakers.commands();
    said.extend(orders.iter().take(2).map(|(subject, _)| Mark::new("a topic", subject.topic())));
    let [unit, gateway, broker] = ends.all().map(|(_, credential)| credential.clone());
    let Watched { seen, delivered, secrets } = watch(&Papers { broker, gateway, unit, who }, &orders)?;
    let arrived = seen.iter().map(|one| one.arrived.then(|| digests([&one.bytes[..]]))).collect();
    let path = seen.into_iter().map(|one| vec![one.bytes]).collect();
    let secrets = secrets.into_iter().map(|bytes| Mark::new("a secret of a TLS session", bytes)).collect();
    // Topics go to the broker and come out as no payload.
    let plain = delivered.into_iter().chain(orders.iter().map(|(subject, _)| subject.topic().into_bytes())).collect();
    let beside = Vec::new();
    Ok(Sight { path, arrived, beside, plain, said, secrets, messages: orders.len() as u64 })
}

fn digests<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> Vec<u8> {
    pieces.into_iter().flat_map(digest).collect()
}

/// The records of datagrams, as a guard tells of them.
fn records(datagrams: &[Vec<u8>]) -> Vec<u8> {
    let pieces = datagrams.iter().flat_map(|datagram| split(datagram));
    digests(pieces.map(|piece| match piece {
        Split::Record(record) => record.bytes,
        Split::Remainder(bytes) => bytes,
    }))
}

fn judged(one: &Observe, seen: &Sight, ends: &Ends, secrets: &[Mark]) -> Showing {
    let mut showing = Showing::new(true);
    for (direction, arrived) in seen.path.iter().zip(&seen.arrived) {
        showing.did(&match one.link {
            Observed::Telemetry => records(direction),
            Observed::Command | Observed::Bus => digests(direction.iter().map(Vec::as_slice)),
        });
        if let Some(arrived) = arrived {
            showing.saw(arrived);
        }
    }
    let plain = || seen.plain.iter().map(Vec::as_slice);
    let path = || seen.path.iter().flatten().chain(&seen.beside).map(Vec::as_slice);
    let readable = Search::new(&seen.said).read_in(plain());
    for mark in &seen.said {
        showing.did(mark.what.as_bytes());
        if readable.contains(mark.what.as_str()) {
            showing.saw(mark.what.as_bytes());
        }
    }
    showing.delivered = seen.messages;
    let marks: Vec<Mark> = seen.said.iter().chain(secrets).cloned().collect();
    let search = Search::new(&marks);
    let read = match (*one.at, one.link) {
        (Stand::Behind, Observed::Telemetry | Observed::Command) => search.read_in(plain()),
        (Stand::Path | Stand::Late | Stand::Behind, _) => search.read_in(path()),
    };
    showing.read.extend(read.into_iter().map(|name| format!("{name} can be read")));
    if *one.at == Stand::Late && seen.path.iter().all(Vec::is_empty) {
        showing.refused_n("time", seen.messages);
    }
    if *one.at == Stand::Path {
        in_the_clear(one.link, ends, &path, &mut showing);
    }
    showing
}

/// Names and certificates that anyone on the path can read, against those that the protocol cannot hide.
fn in_the_clear<'a, I>(link: Observed, ends: &Ends, path: &dyn Fn() -> I, showing: &mut Showing)
where
    I: Iterator<Item = &'a [u8]>,
{
    let contains = |bytes: &[u8]| path().any(|piece| piece.windows(bytes.len()).any(|window| window == bytes));
    let (mut texts, mut known) = (BTreeSet::new(), BTreeSet::new());
    for (peer, credential) in ends.all() {
        if contains(dns_name(*peer).as_bytes()) || contains(peer.uri().as_bytes()) {
            texts.insert(format!("the name of {peer}"));
        }
        if credential.cert_der.get(..MARK).is_some_and(&contains) {
            texts.insert(format!("the certificate of {peer}"));
        }
    }
    let certified: &[PeerId] = match link {
        Observed::Telemetry => &[ends.unit.0, ends.gateway.0],
        Observed::Command | Observed::Bus => &[],
    };
    let dialled = match link {
        Observed::Telemetry => Some(ends.gateway.0),
        Observed::Command => Some(ends.broker.0),
        Observed::Bus => None,
    };
    known.extend(dialled.map(|peer| format!("the name of {peer}")));
    for peer in certified {
        known.extend([format!("the name of {peer}"), format!("the certificate of {peer}")]);
    }
    showing.read.extend(texts.difference(&known).map(|name| format!("{name} can be read")));
    showing.in_the_clear.extend(texts.intersection(&known).cloned());
}
