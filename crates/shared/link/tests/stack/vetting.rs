//! The peer that a certificate proves, at both ends of both links: each fault of a certificate has a distinct name.

use std::time::{Duration, SystemTime};

use link::certificates::Fault;
use link::dtls::DtlsError;
use link::memory::rogue::Manner;
use link::memory::{Pair, Party, clear, tls};
use link::pki::{Authority, Credential, Role};
use wire::core::Side;
use wire::id::PeerId;

/// Chains that `holder` may present, each with its expected fault. The sound one has none.
fn presented(authority: &Authority, holder: PeerId, role: Role) -> Vec<(Credential, Option<Vec<u8>>, Option<Fault>)> {
    #[expect(clippy::disallowed_methods, reason = "certificates are valid by the wall clock")]
    let now = SystemTime::now();
    let (minute, hour) = (Duration::from_secs(60), Duration::from_secs(3600));
    let other_role = if role == Role::Dials { Role::Listens } else { Role::Dials };
    let sound = || authority.issue(holder, role).unwrap();
    let of_this_run =
        |credential: Credential| Credential { root_der: sound().root_der, list_der: sound().list_der, ..credential };
    let revoked = sound();
    let list = authority.revoke(&[&revoked]).unwrap();
    let foreign = of_this_run(Authority::new().unwrap().issue(holder, role).unwrap());
    let valid_between = |from, to| authority.issue_between(holder, role, from, to).unwrap();
    vec![
        (sound(), None, None),
        (sound(), Some(list.clone()), None),
        (foreign, None, Some(Fault::Foreign)),
        (authority.self_signed(holder, role).unwrap(), None, Some(Fault::SelfSigned)),
        (valid_between(now - hour, now - minute), None, Some(Fault::Expired)),
        (valid_between(now + minute, now + hour), None, Some(Fault::NotYetValid)),
        (revoked, Some(list), Some(Fault::Revoked)),
        (authority.issue(holder, other_role).unwrap(), None, Some(Fault::WrongRole)),
        (authority.issue_names(&[holder, PeerId::UNIT_B], role).unwrap(), None, Some(Fault::NoName)),
        (authority.issue_names(&[], role).unwrap(), None, Some(Fault::NoName)),
    ]
}

fn broker() -> PeerId {
    PeerId::from_name("broker").unwrap()
}

fn fault(error: &DtlsError) -> Option<Fault> {
    error.fault()
}

/// At both ends of the link.
#[test]
fn telemetry_refuses_each_bad_certificate_by_name() {
    let authority = Authority::new().unwrap();
    let honest = |peer, role| Party::honest(authority.issue(peer, role).unwrap());
    let rogue = |credential| Party { manner: Some(Manner::Certificate), ..Party::honest(credential) };
    for (credential, list, expected) in presented(&authority, PeerId::UNIT_A, Role::Dials) {
        let gateway = Party { list, ..honest(PeerId::GATEWAY, Role::Listens) };
        let pair = Pair::open([&rogue(credential), &gateway], PeerId::GATEWAY, clear()).unwrap();
        let got = pair.peer(Side::Server).map_err(fault);
        assert_eq!(got, expected.map_or(Ok(Some(PeerId::UNIT_A)), |fault| Err(Some(fault))));
    }
    for (credential, list, expected) in presented(&authority, PeerId::GATEWAY, Role::Listens) {
        let unit = Party { list, ..honest(PeerId::UNIT_A, Role::Dials) };
        let pair = Pair::open([&unit, &rogue(credential)], PeerId::GATEWAY, clear()).unwrap();
        let got = pair.peer(Side::Client).map_err(fault);
        // A listener without the dialled name is refused for that first.
        let expected = expected.map_or(Ok(Some(PeerId::GATEWAY)), |fault| Err(Some(fault)));
        let nameless = got == Err(Some(Fault::WrongName)) && expected == Err(Some(Fault::NoName));
        assert!(got == expected || nameless, "got {got:?}, expected {expected:?}");
    }
    let other = rogue(authority.issue(PeerId::UNIT_B, Role::Listens).unwrap());
    let pair = Pair::open([&honest(PeerId::UNIT_A, Role::Dials), &other], PeerId::GATEWAY, clear()).unwrap();
    assert_eq!(pair.peer(Side::Client).map_err(fault), Err(Some(Fault::WrongName)));
}

/// No weaker parameters are agreed upon.
#[test]
fn weaker_dialler_is_refused_by_name() {
    let authority = Authority::new().unwrap();
    let gateway = Party::honest(authority.issue(PeerId::GATEWAY, Role::Listens).unwrap());
    for (manner, expected) in [
        (Manner::NoCertificate, Fault::Missing),
        (Manner::ShortTag, Fault::Suite),
        (Manner::Cbc, Fault::Suite),
        (Manner::PreSharedKey, Fault::Suite),
        (Manner::NoMasterSecret, Fault::MasterSecret),
    ] {
        let unit = authority.issue(PeerId::UNIT_A, Role::Dials).unwrap();
        let unit = Party { manner: Some(manner), ..Party::honest(unit) };
        let pair = Pair::open([&unit, &gateway], PeerId::GATEWAY, clear()).unwrap();
        assert_eq!(pair.peer(Side::Server).map_err(fault), Err(Some(expected)), "{manner:?}");
    }
}

#[test]
fn revoked_certificate_ends_a_standing_session() {
    let authority = Authority::new().unwrap();
    let unit = Party::honest(authority.issue(PeerId::UNIT_A, Role::Dials).unwrap());
    let gateway = Party::honest(authority.issue(PeerId::GATEWAY, Role::Listens).unwrap());
    let pair = Pair::open([&unit, &gateway], PeerId::GATEWAY, clear()).unwrap();
    assert_eq!(pair.verify_peer(Side::Server), Ok(PeerId::UNIT_A));
    let list = authority.revoke(&[&unit.credential]).unwrap();
    pair.revoke(Side::Server, list.clone()).unwrap();
    pair.revoke(Side::Client, list).unwrap();
    assert_eq!(pair.verify_peer(Side::Server).map_err(|refused| refused.fault), Err(Fault::Revoked));
    assert_eq!(pair.verify_peer(Side::Client), Ok(PeerId::GATEWAY), "the list names the unit alone");
}

/// At both ends of the plane.
#[test]
fn command_plane_refuses_each_bad_certificate_by_name() {
    let authority = Authority::new().unwrap();
    let party = |credential, list, manner| tls::Party { credential, list, manner };
    let honest = |peer, role, list| party(authority.issue(peer, role).unwrap(), list, tls::Manner::Honest);
    let shake = |parties: [&tls::Party; 2]| tls::shake(parties, broker(), b"connect", &mut |_, piece| piece).unwrap();
    for (credential, list, expected) in presented(&authority, PeerId::UNIT_A, Role::Dials) {
        let listener = honest(broker(), Role::Listens, list);
        let shaken = shake([&party(credential, None, tls::Manner::Certificate), &listener]);
        let got = shaken.ends[1].as_ref().map(|peer| *peer).map_err(|refused| refused.fault);
        assert_eq!(got, expected.map_or(Ok(Some(PeerId::UNIT_A)), Err));
        assert_eq!(shaken.delivered.is_empty(), expected.is_some(), "not a byte of a refused one");
    }
    for (credential, list, expected) in presented(&authority, broker(), Role::Listens) {
        let unit = honest(PeerId::UNIT_A, Role::Dials, list);
        let shaken = shake([&unit, &party(credential, None, tls::Manner::Certificate)]);
        let got = shaken.ends[0].as_ref().map(|peer| *peer).map_err(|refused| refused.fault);
        let expected = expected.map_or(Ok(Some(broker())), Err);
        let nameless = got == Err(Fault::WrongName) && expected == Err(Fault::NoName);
        assert!(got == expected || nameless, "got {got:?}, expected {expected:?}");
    }
    let unit = authority.issue(PeerId::UNIT_A, Role::Dials).unwrap();
    let listener = honest(broker(), Role::Listens, None);
    for (manner, expected) in [(tls::Manner::NoCertificate, Fault::Missing), (tls::Manner::Tls12, Fault::Version)] {
        let shaken = shake([&party(unit.clone(), None, manner), &listener]);
        assert_eq!(shaken.ends[1].as_ref().map_err(|refused| refused.fault), Err(expected));
    }
    let old = party(authority.issue(broker(), Role::Listens).unwrap(), None, tls::Manner::Tls12);
    let shaken = shake([&honest(PeerId::UNIT_A, Role::Dials, None), &old]);
    assert_eq!(shaken.ends[0].as_ref().map_err(|refused| refused.fault), Err(Fault::Version));
}
