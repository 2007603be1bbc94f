//! Unknown peers at a listener's cookie exchange, by the thousand: their cost is bounded, and honest ends see no effect.

use std::time::Duration;

use link::dtls::listen::{HALF_OPEN, PEERS};
use link::guard::observe::{Verdict, digest};
use link::memory::listener::{Crowd, genuine_hello, storm};
use link::pki::{Authority, Role};
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use scenario::stack::{Flood, Storm};
use wire::id::PeerId;

use super::StackError;
use super::judge::Showing;

/// Place of a ClientHello's random in its datagram: behind record and message headers and the version.
const RANDOM: std::ops::Range<usize> = 27..59;

/// Unknown peers come while one honest unit has a session and another opens one.
pub(super) fn stormed(one: &Storm, seed: u64) -> Result<Showing, StackError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let authority = Authority::new()?;
    let gateway = authority.issue(PeerId::GATEWAY, Role::Listens)?;
    let units = [authority.issue(PeerId::UNIT_A, Role::Dials)?, authority.issue(PeerId::UNIT_B, Role::Dials)?];
    let genuine = genuine_hello(&units[0], PeerId::GATEWAY)?;
    let datagrams: Vec<Vec<u8>> =
        (0..one.count.unsigned()).map(|_| unknown_peer(one.content, &genuine, &mut rng)).collect();
    let crowd = if one.content == Flood::Proving { Crowd::Proving } else { Crowd::Silent };
    let every = Duration::from_micros(one.every_us.unsigned());
    let honest = [(&units[0], PeerId::GATEWAY), (&units[1], PeerId::GATEWAY)];
    let stormed = storm(&gateway, honest, &datagrams, every, crowd)?;

    let mut showing = Showing::new(true);
    for datagram in &stormed.put {
        showing.did_hash(u64::from_be_bytes(digest(datagram)));
    }
    for seen in &stormed.seen {
        showing.saw_hash(u64::from_be_bytes(seen.digest));
        if !matches!(seen.verdict, Verdict::Passed) {
            *showing.guard_refused.entry(seen.verdict.logged().name().to_owned()).or_default() += 1;
        }
    }
    let stats = stormed.stats;
    let (sent, out) = stormed.honest;
    showing.delivered = out;
    if out < sent {
        showing.missed.push(format!("{} of {sent} honest records did not come out in time", sent - out));
    }
    if stormed.newcomer.is_none() {
        showing.missed.push("an honest newcomer got no session".to_owned());
    }
    // One session of each honest unit, and none of anybody else.
    if stats.opened > 2 {
        showing.breaches.push(format!("{} sessions were opened, by two honest units", stats.opened));
    }
    let (shaking, peers) = (stats.most_shaking, stats.most_peers);
    if shaking > HALF_OPEN as u64 || peers > PEERS as u64 {
        showing.breaches.push(format!("{shaking} handshakes and {peers} peers at once: no bound held"));
    }
    Ok(showing)
}

fn unknown_peer(content: Flood, genuine: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut hello = genuine.to_vec();
    if let Some(random) = hello.get_mut(RANDOM) {
        rng.fill_bytes(random);
    }
    match content {
        Flood::Hello | Flood::Proving => hello,
        Flood::Broken => {
            hello.truncate(RANDOM.end + rng.next_u32() as usize % (genuine.len() - RANDOM.end));
            hello
        }
        Flood::Noise => {
            let mut noise = vec![0; 16 + rng.next_u32() as usize % 512];
            rng.fill_bytes(&mut noise);
            // First byte that no handshake record has.
            noise[0] |= 0x80;
            noise
        }
    }
}
