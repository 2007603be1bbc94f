//! The messages of `wire` and the signatures around them.

use ground_truth::Entry;
use minicbor::{Decode, Encode};
use wire::audit::{Head, MAX_ENTRY, Seal};
use wire::codec::{self, Malformed};
use wire::command::{Ack, Confirmation, Intent, MAX_ORDER, Order, Request};
use wire::core::{Input, Output};
use wire::crop::{Crop, MAX_CROP};
use wire::drive::{Act, Drive};
use wire::feed::Feed;
use wire::id::NodeId;
use wire::policy::Policy;
use wire::report::{MAX_REPORT, Report};
use wire::sensor::{Candidates, Frames, Navigation};
use wire::session::{MAX_SESSION_MESSAGE, SessionMessage};
use wire::sign::{Key, Keyring, MAX_SIGNED_PAYLOAD, Purpose, Signed};
use wire::time::{Age, Instant, Span};
use wire::track::Tracks;
use wire::trust::{Revocation, RevocationList, SignedReport};

/// Bytes that are looked at as a message of any kind.
const MAX_MESSAGE: usize = 64 * 1024;
/// Bytes of a signature's encoding that follow its head: the signature itself.
const SIGNATURE: usize = 64;

/// The key that the seeds are signed with.
pub(super) const SECRET: [u8; 32] = [7; 32];

const PURPOSES: [Purpose; 6] =
    [Purpose::Report, Purpose::Intent, Purpose::Confirmation, Purpose::Ack, Purpose::Head, Purpose::Revocation];

/// Bytes that are taken as a message are its one encoding; those that are not are refused at a place within them.
pub fn message(bytes: &[u8]) -> bool {
    let accepted = [
        canonical::<Report>(bytes, MAX_REPORT),
        canonical::<SessionMessage<'_>>(bytes, MAX_SESSION_MESSAGE),
        canonical::<Intent>(bytes, MAX_ORDER),
        canonical::<Confirmation>(bytes, MAX_ORDER),
        canonical::<Order<'_>>(bytes, MAX_ORDER),
        canonical::<Ack>(bytes, MAX_ORDER),
        canonical::<Request<'_>>(bytes, MAX_MESSAGE),
        canonical::<Feed<'_>>(bytes, MAX_MESSAGE),
        canonical::<Crop>(bytes, MAX_CROP),
        canonical::<Frames<'_>>(bytes, MAX_MESSAGE),
        canonical::<Candidates>(bytes, MAX_MESSAGE),
        canonical::<Navigation>(bytes, MAX_MESSAGE),
        canonical::<Tracks>(bytes, MAX_MESSAGE),
        canonical::<Drive>(bytes, MAX_MESSAGE),
        canonical::<Act>(bytes, MAX_MESSAGE),
        canonical::<Entry>(bytes, MAX_ENTRY),
        canonical::<Seal>(bytes, MAX_MESSAGE),
        canonical::<Head>(bytes, MAX_MESSAGE),
        canonical::<Revocation>(bytes, MAX_ORDER),
        canonical::<Input>(bytes, MAX_MESSAGE),
        canonical::<Output>(bytes, MAX_MESSAGE),
    ];
    accepted.contains(&true)
}

fn canonical<'b, M: Decode<'b, ()> + Encode<()>>(bytes: &'b [u8], max: usize) -> bool {
    let kind = std::any::type_name::<M>();
    match codec::decode::<M>(bytes, max) {
        Ok(message) => {
            assert!(codec::encode(&message) == bytes && bytes.len() <= max, "{kind}: another encoding");
            return true;
        }
        Err(Malformed::TooLong { max: limit, got }) => assert!(limit == max && got == bytes.len() && got > max),
        Err(Malformed::Schema { at } | Malformed::NonCanonical { at }) => {
            assert!(bytes.len() <= max && at <= bytes.len(), "{kind}: refused at {at}, behind its end");
        }
    }
    false
}

/// Bytes accepted as signed are of the one profile; only those that the key signed for this purpose verify for it.
pub fn signature(bytes: &[u8]) -> bool {
    let key = Key::from_bytes(&SECRET);
    let mut keys = Keyring::default();
    assert!([NodeId::UNIT_A, NodeId::AUTHORITY].into_iter().all(|node| keys.insert(node, &key.public())));
    let mut verified = false;
    if let Ok(signed) = Signed::parse(bytes, MAX_MESSAGE) {
        assert!(signed.payload.len() <= MAX_SIGNED_PAYLOAD);
        let our_bytes = key.sign(Purpose::Report, signed.payload);
        let (head, one) = (our_bytes.len() - SIGNATURE, bytes.len() - SIGNATURE);
        assert_eq!(our_bytes[..head], bytes[..one], "another profile");
        for purpose in PURPOSES {
            if keys.verify(NodeId::UNIT_A, purpose, &signed).is_ok() {
                assert_eq!(key.sign(purpose, signed.payload), bytes, "the key never signed this for {purpose:?}");
                verified = true;
            }
        }
    }
    let now = Instant(1);
    let (policy, age) = (Policy::default(), Some(Age::on_one_host(now, now)));
    let report = SignedReport::decode(now, bytes).and_then(|r| r.fresh(&policy, age, Span::ZERO, Span::ZERO));
    if report.and_then(|report| report.by_signature(&policy.of_display(), &keys)).is_ok() {
        let payload = Signed::parse(bytes, MAX_REPORT).map(|signed| signed.payload).unwrap_or_default();
        assert_eq!(key.sign(Purpose::Report, payload), bytes, "a report that nobody signed");
    }
    if let Ok(Some(of)) = RevocationList::new(&[], now).revoke(&keys, now, bytes) {
        assert_eq!(Revocation { of }.sign(&key), bytes, "a revocation that the authority never made");
    }
    verified
}
