//! A row with its signature: over fixed words and the row's canonical text, which is its JSON without blanks, in the order of the fields.

use serde::{Deserialize, Serialize};

use crate::bounds::{self, RowFault};
use crate::key::{self, ContributorKey};
use crate::row::BoardRow;

/// Words before the row in the signed message, so that the signature serves for nothing else.
const PURPOSE: &str = "holdsafe guest board row v1\n";

/// A row with the contributor's signature.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignedRow {
    /// Row.
    pub row: BoardRow,
    /// Ed25519 signature of `row.contributor.key`, hexadecimal.
    pub signature: String,
}

impl SignedRow {
    /// The row, signed by its contributor, with the public key in it.
    ///
    /// # Errors
    /// The row is out of its bounds.
    pub fn new(mut row: BoardRow, key: &ContributorKey) -> Result<Self, RowFault> {
        row.contributor.key = key.public();
        bounds::check(&row)?;
        Ok(Self { signature: key.sign(message(&row).as_bytes()), row })
    }

    /// Checks bounds, counts and signature.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self) -> Result<(), RowFault> {
        bounds::check(&self.row)?;
        let key = &self.row.contributor.key;
        if !key::is_public(key) {
            return Err(RowFault::Key);
        }
        let good = key::verifies(key, message(&self.row).as_bytes(), &self.signature);
        good.then_some(()).ok_or(RowFault::Signature)
    }

    /// The one text of the row and its signature, without an end of line.
    pub(crate) fn line(&self) -> String {
        canonical(self)
    }
}

fn message(row: &BoardRow) -> String {
    format!("{PURPOSE}{}", canonical(row))
}

/// Numbers are whole and keys are text, so that every value has a text.
fn canonical(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}
