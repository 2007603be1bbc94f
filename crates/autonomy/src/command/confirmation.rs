//! The second step of an order away from safe: a reason, and the same operator's signature over this very intent.

use wire::command::{Confirmation, Intent};
use wire::policy::{Check, Policy, Requirement, Waived};
use wire::refusal::Refusal;
use wire::sign::Keyring;
use wire::time::Instant;
use wire::trust::{Decoded, SignedStatement};

use super::Claimed;

/// Complete: an order with its second step, and with the waivers used for it.
#[derive(Debug)]
pub(super) struct Confirmed(Waived);

impl Confirmed {
    /// Judges the `confirmation` that came with an intent at `now`. Towards safe none is needed.
    pub(super) fn judge(
        policy: &Policy,
        keys: &Keyring,
        now: Instant,
        (claim, claimed): (&Intent, &Claimed),
        confirmation: Option<&[u8]>,
    ) -> Result<Confirmed, Refusal> {
        if claim.kind.towards_safe() {
            return Ok(Confirmed(Waived::default()));
        }
        if claim.reason.as_str().trim().is_empty() {
            return Err(Refusal::NoReason);
        }
        match policy.check(Check::Confirmation) {
            Requirement::Waived => Ok(Confirmed(Waived::default().with_check(Check::Confirmation))),
            Requirement::Required => {
                let bytes = confirmation.ok_or(Refusal::Confirmation { expected: claim.id })?;
                let statement = Decoded::<SignedStatement<'_, Confirmation>>::parse_statement(now, bytes)?;
                let attributed = statement.by_signer(policy, claim.id.operator, keys)?;
                Ok(Confirmed(attributed.about_intent(claim.id, &claimed.intent)?.evidence().waived))
            }
        }
    }

    /// Checks that were waived.
    pub(super) fn waived(&self) -> Waived {
        self.0
    }
}
