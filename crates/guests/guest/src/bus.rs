//! Attacks on a guest's own bus: the orders of a step to the guest's adapter, and its receipts.
//!
//! The program under test sees neither. The adapter carries out an order for one step at a time, so that the attack depends on the run's
//! clock alone, and its witness counts arrivals at the attacked end. The adapter is a part of the instrument: a receipt is its word,
//! and its files are pinned by the guest's file. When an attack begins and ends is left to the engine.

use ground_truth::BusAttack;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::guest::Fault;

use crate::Failure;

/// Most orders of one step.
pub const MAX_ORDERS: usize = 4;
/// Most messages that a receipt counts.
const MAX_MESSAGES: u32 = 65_535;
/// Longest reason of a receipt, characters.
const MAX_REASON: usize = 120;

/// An attack that is open in this step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BusOrder {
    /// Number of the order, the same in each step of the trial.
    pub id: u8,
    /// The attack.
    pub attack: BusAttack,
    /// Messages of the attacker a second.
    pub rate_hz: f64,
    /// Size of the falsehood, in the unit of the attack.
    pub amount: f64,
}

/// Result of an order in one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BusReceipt {
    /// Number of the order.
    pub id: u8,
    /// Messages that the attacker put on the bus, at most 65,535.
    pub sent: u32,
    /// Those of them that reached the attacked end, by its witness.
    pub received: u32,
    /// Messages of the honest sender that reached it.
    pub honest: u32,
    /// True if the message in force at the end of the step is the attacker's.
    pub used: bool,
    /// Reason for which the attacked end refused them, or the attacker did not act; at most 120 characters.
    #[serde(default)]
    pub why: Option<String>,
}

impl BusReceipt {
    /// True if the attacked end had the messages offered and refused them.
    pub fn refused(&self) -> bool {
        self.sent > 0 && self.why.is_some()
    }
}

/// The receipts, held against the orders: one each, in the same order, within bounds.
///
/// # Errors
/// The first receipt that is missing, of another order, or out of bounds.
pub(crate) fn check(orders: &[BusOrder], receipts: Vec<BusReceipt>) -> Result<Vec<BusReceipt>, Failure> {
    let ids = |id: &mut dyn Iterator<Item = u8>| id.map(|id| id.to_string()).collect::<Vec<_>>().join(", ");
    if !orders.iter().map(|order| order.id).eq(receipts.iter().map(|receipt| receipt.id)) {
        let (expected, got) = (ids(&mut orders.iter().map(|o| o.id)), ids(&mut receipts.iter().take(8).map(|r| r.id)));
        return Err(Failure::new(
            Fault::Undeclared,
            format!("receipts of the orders [{expected}] expected, got [{got}]"),
        ));
    }
    for receipt in &receipts {
        let most = receipt.sent.max(receipt.received).max(receipt.honest);
        if most > MAX_MESSAGES {
            return Err(Failure::new(
                Fault::Value,
                format!("bus: at most {MAX_MESSAGES} messages expected, got {most}"),
            ));
        }
        if receipt.why.as_ref().is_some_and(|why| why.chars().count() > MAX_REASON) {
            return Err(Failure::new(
                Fault::Value,
                format!("bus: a reason of at most {MAX_REASON} characters expected"),
            ));
        }
    }
    Ok(receipts)
}
