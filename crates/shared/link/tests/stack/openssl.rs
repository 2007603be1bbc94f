//! Another implementation as a client: `openssl s_client -dtls1_2` with a good certificate and with others.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, SystemTime};

use link::certificates::Fault;
use link::dtls::listen::listen;
use link::dtls::session::{SessionEvent, Settings};
use link::guard::GuardMode;
use link::guard::observe::{ObservationLog, Verdict};
use link::loopback::LoopbackAddr;
use link::pki::{Authority, Credential, Role};
use tokio::sync::mpsc;
use wire::id::PeerId;

use super::network::list;

/// With a good one it gets a session; any other is refused by name.
#[tokio::test]
async fn openssl_needs_a_good_certificate() {
    if !Command::new("openssl").arg("version").output().is_ok_and(|out| out.status.success()) {
        eprintln!("skipped: there is no `openssl` here, so no other implementation was tried");
        return;
    }
    #[expect(clippy::disallowed_methods, reason = "certificates are valid by the wall clock")]
    let now = SystemTime::now();
    let minute = Duration::from_secs(60);
    let authority = Authority::new().unwrap();
    let good = authority.issue(PeerId::UNIT_A, Role::Dials).unwrap();
    let valid_between = |from, to| authority.issue_between(PeerId::UNIT_A, Role::Dials, from, to).unwrap();
    let revoked = authority.issue(PeerId::UNIT_A, Role::Dials).unwrap();
    let cases = [
        (Some(good), None),
        (None, Some(Fault::Missing)),
        (Some(Authority::new().unwrap().issue(PeerId::UNIT_A, Role::Dials).unwrap()), Some(Fault::Foreign)),
        (Some(valid_between(now - 2 * minute, now - minute)), Some(Fault::Expired)),
        (Some(valid_between(now + minute, now + 2 * minute)), Some(Fault::NotYetValid)),
        (Some(authority.issue(PeerId::UNIT_A, Role::Listens).unwrap()), Some(Fault::WrongRole)),
        (Some(revoked.clone()), Some(Fault::Revoked)),
    ];
    let gateway = authority.issue(PeerId::GATEWAY, Role::Listens).unwrap();
    let held = list(&gateway);
    held.replace(authority.revoke(&[&revoked]).unwrap()).unwrap();
    let (log, mut seen) = ObservationLog::new(1024);
    let settings = Settings { log: Some(log), ..Settings::new(GuardMode::Required, Duration::from_secs(60), held) };
    let (to_events, mut events) = mpsc::channel(64);
    let listener = listen(LoopbackAddr::ANY_PORT, gateway, settings, to_events).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for (n, (credential, expected)) in cases.into_iter().enumerate() {
        let mut client = dial(listener.local(), credential.as_ref(), &folder.path().join(n.to_string()));
        let got = loop {
            tokio::select! {
                Some(event) = events.recv() => if let SessionEvent::Opened(handle) = event {
                    assert_eq!(handle.peer, PeerId::UNIT_A);
                    break Ok(());
                },
                Some(seen) = seen.recv() => if seen.verdict == Verdict::Unfinished {
                    break Err(seen.fault);
                },
            }
        };
        client.kill().unwrap();
        client.wait().unwrap();
        assert_eq!(got, expected.map_or(Ok(()), |fault| Err(Some(fault))), "case {n}");
    }
}

/// `openssl s_client` with this certificate, its standard input kept open so that it stays.
fn dial(address: LoopbackAddr, credential: Option<&Credential>, file: &Path) -> Child {
    let mut client = Command::new("openssl");
    client.args(["s_client", "-dtls1_2", "-connect", &address.to_string()]);
    if let Some(credential) = credential {
        let (cert, key) = (file.with_extension("cert"), file.with_extension("key"));
        std::fs::write(&cert, &credential.cert_der).unwrap();
        std::fs::write(&key, &credential.key_pkcs8_der).unwrap();
        client.args(["-certform", "DER", "-keyform", "DER", "-cert"]).arg(cert).arg("-key").arg(key);
    }
    client.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}
