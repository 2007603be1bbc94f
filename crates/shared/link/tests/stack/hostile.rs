//! Malformed ClientHellos.

use std::panic::catch_unwind;

use dtls::handshake::handshake_message_client_hello::HandshakeMessageClientHello;
use link::guard::hello::opens_association;

use super::network::genuine_hello;

/// Record header and handshake header.
const HEADERS: usize = 13 + 12;

/// Truncations, every single-byte change, and length fields that lie.
fn mutations(genuine: &[u8]) -> Vec<Vec<u8>> {
    let mut all: Vec<Vec<u8>> = (0..genuine.len()).map(|n| genuine[..n].to_vec()).collect();
    for index in 0..genuine.len() {
        for value in [0, 1, 0x7f, 0x80, 0xff, genuine[index].wrapping_add(1), genuine[index].wrapping_sub(1)] {
            let mut changed = genuine.to_vec();
            changed[index] = value;
            all.push(changed);
        }
    }
    // Shorter bodies whose outer lengths are right, so that only the inner ones lie.
    for body in 0..genuine.len() - HEADERS {
        let mut cut = genuine[..HEADERS + body].to_vec();
        let (record, message) = ((12 + body) as u16, (body as u32).to_be_bytes());
        cut[11..13].copy_from_slice(&record.to_be_bytes());
        cut[14..17].copy_from_slice(&message[1..]);
        cut[22..25].copy_from_slice(&message[1..]);
        for last in 0..4.min(body) {
            let mut lying = cut.clone();
            let index = lying.len() - 1 - last;
            lying[index] = 0xff;
            all.push(lying);
        }
        all.push(cut);
    }
    all
}

#[tokio::test(start_paused = true)]
async fn accepted_hello_never_panics_the_library() {
    let genuine = genuine_hello().await;
    assert!(opens_association(&genuine));
    let quiet = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let library_panics = |datagram: &[u8]| {
        let body = datagram.get(HEADERS..).unwrap_or(&[]).to_vec();
        catch_unwind(|| HandshakeMessageClientHello::unmarshal(&mut body.as_slice()).is_ok()).is_err()
    };
    let mutations = mutations(&genuine);
    let passed: Vec<_> = mutations.iter().filter(|m| opens_association(m)).collect();
    let passed_and_panics = passed.iter().filter(|m| library_panics(m)).count();
    let stopped = mutations.iter().filter(|m| !opens_association(m) && library_panics(m)).count();
    std::panic::set_hook(quiet);
    assert!(!passed.is_empty());
    assert_eq!(passed_and_panics, 0);
    assert!(stopped > 0, "without the guard the library would have panicked");
}
