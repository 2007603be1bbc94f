//! Handshakes that must not succeed: with a certificate that is no good, or below the pinned protocol.
//!
//! The adversary's half of the receipt is its own bytes: the record with its certificate, or the hello that is too low. The
//! target's half is the arrival there, and the name under which it refused.

use std::time::Duration;

use link::clock::wall;
use link::dtls::DtlsError;
use link::guard::observe::digest;
use link::guard::record::{Split, split};
use link::memory::rogue::Manner;
use link::memory::tls::{self, shake};
use link::memory::{Pair, Party, Tap, clear};
use link::pki::{Authority, Credential, Role};
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use scenario::stack::{Certificate, Downgrade, Hand, Impostor, Link, Lower};
use wire::core::Side;
use wire::id::PeerId;

use super::StackError;
use super::judge::Showing;

/// First bytes of a certificate, by which the record that carries it is recognized.
const MARK: usize = 64;

/// Trial of an impostor: a peer with the scenario's certificate at one end of a link.
pub(super) fn impostor(one: &Impostor, seed: u64) -> Result<Showing, StackError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let listens = *one.end == Hand::Listens;
    let (holder, role) = match (one.link, listens) {
        (_, false) => (any_of(&mut rng, &[PeerId::UNIT_A, PeerId::UNIT_B, PeerId::UNIT_C]), Role::Dials),
        (Link::Telemetry, true) => (PeerId::GATEWAY, Role::Listens),
        (Link::Command, true) => (broker()?, Role::Listens),
    };
    let authority = Authority::new()?;
    let papers = Papers::made(&authority, *one.certificate, holder, role, &mut rng)?;
    match one.link {
        Link::Telemetry => over_dtls(&authority, *one.certificate, papers, listens),
        Link::Command => over_tls(&authority, *one.certificate, papers, listens),
    }
}

/// Certificate that an impostor shows, and the list by which it may be refused.
struct Papers {
    credential: Credential,
    list: Option<Vec<u8>>,
}

impl Papers {
    fn made(
        authority: &Authority,
        certificate: Certificate,
        holder: PeerId,
        role: Role,
        rng: &mut ChaCha8Rng,
    ) -> Result<Self, StackError> {
        let other_role = if role == Role::Dials { Role::Listens } else { Role::Dials };
        let other = any_of(rng, &[PeerId::UNIT_A, PeerId::GATEWAY, PeerId::UNIT_B]);
        let other = if other == holder { PeerId::UNIT_C } else { other };
        let now = wall();
        let (near, far) = (some_seconds(rng, 5, 3_600), some_seconds(rng, 3_601, 7_200));
        let mut list = None;
        let credential = match certificate {
            Certificate::Sound | Certificate::Missing | Certificate::RevokedLater => authority.issue(holder, role)?,
            Certificate::SelfSigned => authority.self_signed(holder, role)?,
            Certificate::Foreign => {
                // The adversary trusts the real root, so that its own check does not end the handshake first.
                let our_credential = authority.issue(holder, role)?;
                let their_credential = Authority::new()?.issue(holder, role)?;
                Credential { root_der: our_credential.root_der, list_der: our_credential.list_der, ..their_credential }
            }
            Certificate::Expired => authority.issue_between(holder, role, now - far, now - near)?,
            Certificate::NotYetValid => authority.issue_between(holder, role, now + near, now + far)?,
            Certificate::Revoked => {
                let credential = authority.issue(holder, role)?;
                list = Some(authority.revoke(&[&credential])?);
                credential
            }
            Certificate::WrongRole => authority.issue(holder, other_role)?,
            Certificate::OtherName => authority.issue(other, role)?,
            Certificate::TwoNames => authority.issue_names(&[holder, other], role)?,
        };
        Ok(Self { credential, list })
    }
}

fn over_dtls(
    authority: &Authority,
    certificate: Certificate,
    papers: Papers,
    listens: bool,
) -> Result<Showing, StackError> {
    let honest = Party {
        list: papers.list,
        ..Party::honest(match listens {
            true => authority.issue(PeerId::UNIT_A, Role::Dials)?,
            false => authority.issue(PeerId::GATEWAY, Role::Listens)?,
        })
    };
    let manner = match certificate {
        Certificate::Missing => Some(Manner::NoCertificate),
        Certificate::Sound | Certificate::RevokedLater => None,
        Certificate::SelfSigned
        | Certificate::Foreign
        | Certificate::Expired
        | Certificate::NotYetValid
        | Certificate::Revoked
        | Certificate::WrongRole
        | Certificate::OtherName
        | Certificate::TwoNames => Some(Manner::Certificate),
    };
    let adversary = Party { manner, ..Party::honest(papers.credential) };
    let parties = if listens { [&honest, &adversary] } else { [&adversary, &honest] };
    let (from, target) = if listens { (Side::Server, Side::Client) } else { (Side::Client, Side::Server) };
    let mut pair = Pair::open(parties, PeerId::GATEWAY, clear())?;
    let mut showing = Showing::new(certificate != Certificate::Sound);
    // Without a certificate what gives it away is its hello.
    let mark = if certificate == Certificate::Missing {
        None
    } else {
        adversary.credential.cert_der.get(..MARK).map(<[u8]>::to_vec)
    };
    evidence(&mut showing, &mut pair, from, target, mark.as_deref());
    if certificate == Certificate::RevokedLater {
        pair.peer(target).map_err(|_| StackError::NoAssociation)?;
        let list = authority.revoke(&[&adversary.credential])?;
        pair.revoke(target, list).map_err(link::pki::PkiError::from)?;
        match pair.verify_peer(target) {
            Ok(peer) => showing.breaches.push(format!("the session of {peer}, who is revoked, stands")),
            Err(refused) => showing.refused(refused.fault.name()),
        }
        return Ok(showing);
    }
    judged(&mut showing, certificate != Certificate::Sound, pair.peer(target));
    Ok(showing)
}

/// Both halves of the receipt of a handshake over DTLS: the first record that left with `mark` in it, or without one the
/// first that left at all, and the observation at the target. The adversary's repetitions after its refusal are not
/// observed.
fn evidence(showing: &mut Showing, pair: &mut Pair, from: Side, target: Side, mark: Option<&[u8]>) {
    let left = pair.take(from);
    let records = left.iter().flat_map(|datagram| split(datagram)).filter_map(|piece| match piece {
        Split::Record(record) => Some(record),
        Split::Remainder(_) => None,
    });
    let marked = |bytes: &[u8]| mark.is_none_or(|mark| bytes.windows(mark.len()).any(|w| w == mark));
    if let Some(record) = records.into_iter().find(|record| marked(record.bytes)) {
        showing.did_hash(u64::from_be_bytes(digest(record.bytes)));
    }
    for seen in pair.observed(target) {
        showing.saw_hash(u64::from_be_bytes(seen.digest));
    }
}

/// Notes the result of the handshake at the target. A `refusable` peer that passed is a breach.
fn judged(showing: &mut Showing, refusable: bool, peer: Result<Option<PeerId>, &DtlsError>) {
    match peer {
        Ok(Some(peer)) if refusable => showing.breaches.push(format!("somebody passed for {peer}")),
        Ok(_) => showing.delivered += 1,
        Err(error) => match error.fault() {
            Some(fault) => showing.refused(fault.name()),
            None => showing.missed.push(format!("a handshake was not refused but came to nothing: {error}")),
        },
    }
}

fn over_tls(
    authority: &Authority,
    certificate: Certificate,
    papers: Papers,
    listens: bool,
) -> Result<Showing, StackError> {
    let honest = match listens {
        true => authority.issue(PeerId::UNIT_A, Role::Dials)?,
        false => authority.issue(broker()?, Role::Listens)?,
    };
    let honest = tls::Party { credential: honest, list: papers.list, manner: tls::Manner::Honest };
    let manner =
        if certificate == Certificate::Missing { tls::Manner::NoCertificate } else { tls::Manner::Certificate };
    let adversary = tls::Party { credential: papers.credential, list: None, manner };
    let parties = if listens { [&honest, &adversary] } else { [&adversary, &honest] };
    shaken(parties, listens, certificate != Certificate::Sound, &mut |_, piece| piece)
}

/// Shakes hands over TLS, the adversary being the one who listens or dials, or `tap` itself.
fn shaken(parties: [&tls::Party; 2], listens: bool, attacked: bool, tap: tls::Tap<'_>) -> Result<Showing, StackError> {
    let target = if listens { 0 } else { 1 };
    let mut showing = Showing::new(attacked);
    let mut left = Vec::new();
    let mut noting = |side: Side, piece: Vec<u8>| {
        let piece = tap(side, piece);
        left.push((side as usize, piece.clone()));
        piece
    };
    let shaken = shake(parties, broker()?, b"connect", &mut noting)?;
    for (_, piece) in left.iter().filter(|(side, _)| *side != target) {
        showing.did(piece);
    }
    for piece in &shaken.received[target] {
        showing.saw_hash(wire::event::wire_hash(piece));
    }
    match &shaken.ends[target] {
        Ok(peer) if attacked => {
            let peer = peer.map_or_else(|| "nobody".to_owned(), |peer| peer.to_string());
            showing.breaches.push(format!("somebody passed for {peer}"));
        }
        Ok(_) => showing.delivered += 1,
        Err(refused) => showing.refused(refused.fault.name()),
    }
    if attacked && target == 1 && !shaken.delivered.is_empty() {
        showing.breaches.push(format!("{} bytes of somebody who was refused were delivered", shaken.delivered.len()));
    }
    Ok(showing)
}

/// Trial of a downgrade: a peer offers less than the pinned protocol, or a relay edits an honest hello so that it does.
pub(super) fn downgrade(one: &Downgrade, seed: u64) -> Result<Showing, StackError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let authority = Authority::new()?;
    let unit = authority.issue(any_of(&mut rng, &[PeerId::UNIT_A, PeerId::UNIT_B, PeerId::UNIT_C]), Role::Dials)?;
    match one.link {
        Link::Telemetry => {
            let gateway = Party::honest(authority.issue(PeerId::GATEWAY, Role::Listens)?);
            let manner = (*one.by == Hand::Dials).then_some(match *one.to {
                Lower::Version => Manner::Certificate,
                Lower::Suite => Manner::ShortTag,
                Lower::Cbc => Manner::Cbc,
                Lower::PreSharedKey => Manner::PreSharedKey,
                Lower::MasterSecret => Manner::NoMasterSecret,
            });
            let edits = *one.by == Hand::Relays || *one.to == Lower::Version;
            lowered_dtls([&Party { manner, ..Party::honest(unit) }, &gateway], edits.then_some(*one.to))
        }
        Link::Command => {
            let party = |credential, manner| tls::Party { credential, list: None, manner };
            let manner = |hand: Hand| if *one.by == hand { tls::Manner::Tls12 } else { tls::Manner::Honest };
            let broker = party(authority.issue(broker()?, Role::Listens)?, manner(Hand::Listens));
            let edits = (*one.by == Hand::Relays).then_some(*one.to);
            let mut tap = move |side, mut piece: Vec<u8>| {
                if let (Side::Client, Some(to)) = (side, edits) {
                    lower_tls(&mut piece, to);
                }
                piece
            };
            let parties = [&party(unit, manner(Hand::Dials)), &broker];
            shaken(parties, *one.by == Hand::Listens, true, &mut tap)
        }
    }
}

/// Trial of a handshake over DTLS, with its hellos lowered on the way as `edits` states.
fn lowered_dtls(parties: [&Party; 2], edits: Option<Lower>) -> Result<Showing, StackError> {
    let (done, claims) = std::sync::mpsc::channel();
    let tap: Tap = Box::new(move |side, mut datagram| {
        if side == Side::Client && is_hello(&datagram, 13) {
            if let Some(to) = edits {
                lower_dtls(&mut datagram, to);
            }
            // The receiver lives until the handshake is over.
            let _ = done.send(datagram.clone());
        }
        vec![datagram]
    });
    let mut pair = Pair::open(parties, PeerId::GATEWAY, tap)?;
    let mut showing = Showing::new(true);
    // Records after the target's refusal are not observed, so the first hello counts.
    if let Some(hello) = claims.try_iter().next() {
        showing.did_hash(u64::from_be_bytes(digest(&hello)));
    }
    for seen in pair.observed(Side::Server) {
        showing.saw_hash(u64::from_be_bytes(seen.digest));
    }
    judged(&mut showing, true, pair.peer(Side::Server));
    Ok(showing)
}

/// True if a ClientHello begins behind a record header of this length.
fn is_hello(bytes: &[u8], header: usize) -> bool {
    bytes.first() == Some(&22) && bytes.get(header) == Some(&1)
}

/// Lowers the offer of a ClientHello in a DTLS record. Its lengths stay as they are.
fn lower_dtls(datagram: &mut [u8], to: Lower) {
    // Headers of a DTLS record and of a handshake message (RFC 6347, 4.1 and 4.2.2).
    const VERSION: usize = 13 + 12;
    match to {
        Lower::Version => {
            if let Some(minor) = datagram.get_mut(VERSION + 1) {
                // 254.255 is DTLS 1.0, 254.253 DTLS 1.2.
                *minor = 255;
            }
        }
        Lower::Suite | Lower::Cbc | Lower::PreSharedKey => {
            // Behind version, random, an empty session identifier and a cookie.
            let cookie = datagram.get(VERSION + 35).copied().map_or(0, usize::from);
            // TLS_ECDHE_ECDSA_WITH_AES_128_CCM_8: a tag of 8 bytes in place of 16.
            suites(datagram, VERSION + 36 + cookie, [0xc0, 0xae]);
        }
        // `extended_master_secret` (RFC 7627), an extension without content.
        Lower::MasterSecret => rename(datagram, [0, 0x17, 0, 0]),
    }
}

/// Lowers the offer of a ClientHello in a TLS record, the header of which is shorter. Its lengths stay as they are.
fn lower_tls(piece: &mut [u8], to: Lower) {
    if !is_hello(piece, 5) {
        return;
    }
    // Headers of a TLS record and of a handshake message (RFC 8446, 5.1 and 4).
    const VERSION: usize = 5 + 4;
    match to {
        // Without its list of versions a hello is one of TLS 1.2.
        Lower::Version => rename(piece, [0, 0x2b, 0, 3]),
        Lower::Suite | Lower::Cbc | Lower::PreSharedKey | Lower::MasterSecret => {
            let session = piece.get(VERSION + 34).copied().map_or(0, usize::from);
            // TLS_RSA_WITH_AES_128_CBC_SHA, a suite that TLS 1.3 does not have.
            suites(piece, VERSION + 35 + session, [0, 0x2f]);
        }
    }
}

/// Replaces every suite of the list at `at` by `suite`.
fn suites(hello: &mut [u8], at: usize, suite: [u8; 2]) {
    let Some(length) = hello.get(at..at + 2).map(|l| usize::from(u16::from_be_bytes([l[0], l[1]]))) else { return };
    for offered in hello.iter_mut().skip(at + 2).take(length).collect::<Vec<_>>().chunks_exact_mut(2) {
        (*offered[0], *offered[1]) = (suite[0], suite[1]);
    }
}

/// Gives the extension that begins with `head` an unknown type.
fn rename(hello: &mut [u8], head: [u8; 4]) {
    // The last match: extensions are at the end, random bytes that may look like `head` before them.
    if let Some(index) = hello.windows(4).rposition(|w| w == head) {
        hello[index] = 0xfa;
    }
}

fn broker() -> Result<PeerId, StackError> {
    PeerId::from_name("broker").ok_or(StackError::NotOneCell)
}

fn any_of<T: Copy>(rng: &mut ChaCha8Rng, all: &[T]) -> T {
    all[rng.next_u32() as usize % all.len()]
}

fn some_seconds(rng: &mut ChaCha8Rng, from: u64, to: u64) -> Duration {
    Duration::from_secs(from + rng.next_u64() % (to - from + 1))
}
