//! Acceptance: the only ways from ordered to accepted.
//!
//! Evidence: the mark of live, synthetic or replayed that a sensor product carries under its producer's name. Which
//! messages are products is a property of their types, and stands here; no caller states it. A statement about an
//! intent needs the intent in place of order and product (`statement`).

use super::{Attributed, BusMessage, Ordered, Record, SessionRecord, SignedReport, Statement};
use crate::audit::Seal;
use crate::bearing::Bearings;
use crate::command::{Intent, IntentHash, Request};
use crate::drive::{Act, Drive};
use crate::feed::Feed;
use crate::id::CommandId;
use crate::policy::{Check, Policy};
use crate::refusal::Refusal;
use crate::sensor::{Candidates, Frames, Navigation, ProductMode};
use crate::track::Tracks;

/// A message on shared memory that is a live product, or no sensor product.
#[derive(Debug)]
pub struct Live(());
/// A record that may influence state.
#[derive(Debug)]
pub struct Accepted(());

/// A message that can be accepted: a sensor product, with its mode, or none.
pub trait Provenance {
    /// Mode of the product, if it is a sensor product.
    fn product(&self) -> Option<ProductMode>;
}

impl Provenance for SignedReport<'_> {
    fn product(&self) -> Option<ProductMode> {
        Some(self.report.product)
    }
}

impl Provenance for Candidates {
    fn product(&self) -> Option<ProductMode> {
        Some(self.mode)
    }
}

impl Provenance for Bearings {
    fn product(&self) -> Option<ProductMode> {
        Some(self.mode)
    }
}

impl Provenance for Tracks {
    fn product(&self) -> Option<ProductMode> {
        Some(self.mode)
    }
}

/// Messages that carry no mode.
macro_rules! no_product {
    ($($message:ty),*) => {
        $(impl Provenance for $message {
            fn product(&self) -> Option<ProductMode> {
                None
            }
        })*
    };
}

no_product!(SessionRecord<'_>, Intent, Frames<'_>, Navigation, Seal, Drive, Act, Feed<'_>, Request<'_>);

impl<S, M> Record<S, M> {
    /// Checks that a `product` is live: no other may influence a live platform.
    fn live<T>(self, policy: &Policy, product: Option<ProductMode>, earned: T) -> Result<Record<T, M>, Refusal> {
        match product {
            None => Ok(self.next(earned)),
            Some(mode) => self.check(policy, Check::Product, earned, |_, _| match mode {
                ProductMode::Live => Ok(()),
                got @ (ProductMode::Synthetic | ProductMode::Replay) => Err(Refusal::Product { got }),
            }),
        }
    }
}

impl<'b, M: Provenance> Attributed<BusMessage<'b, M>> {
    /// Provenance, before order: a message refused for it leaves the window unchanged.
    pub fn of_live(self, policy: &Policy) -> Result<Record<Live, BusMessage<'b, M>>, Refusal> {
        let body = self.message.message.product();
        self.live(policy, body, Live(()))
    }
}

impl<M: Provenance> Ordered<M> {
    /// Judges provenance, the last check of a record that is in order.
    pub fn accept(self, policy: &Policy) -> Result<Record<Accepted, M>, Refusal> {
        let product = self.message.product();
        self.live(policy, product, Accepted(()))
    }
}

impl<M> Ordered<BusMessage<'_, M>> {
    /// The body of a message on shared memory, after provenance and order.
    pub fn accept_body(self) -> Record<Accepted, M> {
        self.next(Accepted(())).map(|bus| bus.message)
    }
}

impl<M: Statement> Attributed<M> {
    /// The statement is about this very intent. Cannot be waived.
    pub fn about_intent(self, command: CommandId, intent: &IntentHash) -> Result<Record<Accepted, M>, Refusal> {
        if self.message.subject() == (command, *intent) {
            Ok(self.next(Accepted(())))
        } else {
            Err(Refusal::Confirmation { expected: command })
        }
    }
}
