//! Checks that an intent passes before its signature is verified, the dearest check, and their order.
//!
//! Each check wraps the stage before it, so that the type of an intent lists the checks passed, innermost first. The
//! signature is asked of these two types alone: an intent that left a check out, or passed two in the other order, has
//! another type. At the gateway the age and the rate belong to the request, which came over a station's own channel; at
//! the unit they are the intent's and its operator's.

use super::stage::{Fresh, InRole, InTime, NotRepeated, NotRevoked, WithinRate, WorthVerifying};

/// Checks before the signature at the unit that is to carry the intent out.
pub type AtUnit = WorthVerifying<WithinRate<NotRepeated<NotRevoked<InRole<InTime>>>>>;

/// Checks before the signature at the gateway, which passes the intent on.
pub type AtGateway = NotRevoked<InRole<WithinRate<Fresh>>>;

/// Everything has been judged that costs less than a signature.
pub trait Screened: sealed::Sealed {}

impl Screened for AtUnit {}
impl Screened for AtGateway {}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::AtUnit {}
    impl Sealed for super::AtGateway {}
}
