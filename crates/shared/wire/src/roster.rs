//! The table of one run: the identities that take part in it, each with its public key.
//!
//! The wire has a number for every identity that there can be ([`crate::id`]); a run names a few of them. A core is
//! made only of a sound table, and only for roles that the table names: its units, teammates and operators. From then
//! on a record that claims an identity outside the table has no key to be verified under, and is refused by that name
//! ([`Refusal::Signer`](crate::refusal::Refusal::Signer)). Who may do what is left to the core's configuration.

use crate::id::NodeId;
use crate::sign::Keyring;

/// Reason that the identities of a run are no table, or that a role is not in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RosterError {
    /// Two keys for one identity.
    #[error("public_keys: one key for each identity expected, got a second one for `{got}`")]
    Twice {
        /// Identity with two keys.
        got: NodeId,
    },
    /// A key that is none.
    #[error("public_keys: a point on the curve expected as the key of `{of}`")]
    Key {
        /// Identity with this key.
        of: NodeId,
    },
    /// A role is given to an identity that the run does not name.
    #[error("{field}: an identity with a key in this run expected, got `{got}`")]
    Stranger {
        /// Field of the configuration.
        field: &'static str,
        /// Identity that the run does not name.
        got: NodeId,
    },
    /// A role is given to one identity twice.
    #[error("{field}: each identity once expected, got `{got}` again")]
    Again {
        /// Field of the configuration.
        field: &'static str,
        /// Identity with the role twice.
        got: NodeId,
    },
}

impl Keyring {
    /// The table of a run: each identity once, each with a key that is a point on the curve.
    pub fn of_run(mut self, public_keys: &[(NodeId, [u8; 32])]) -> Result<Self, RosterError> {
        for (node, public) in public_keys {
            if self.names(*node) {
                return Err(RosterError::Twice { got: *node });
            }
            if !self.insert(*node, public) {
                return Err(RosterError::Key { of: *node });
            }
        }
        Ok(self)
    }

    /// Checks that the run names each of `nodes`, which the configuration has in `field`, and `field` each of them
    /// once.
    pub fn cast(&self, field: &'static str, nodes: impl IntoIterator<Item = NodeId>) -> Result<(), RosterError> {
        let mut seen = Vec::new();
        for got in nodes {
            if !self.names(got) {
                return Err(RosterError::Stranger { field, got });
            }
            if seen.contains(&got) {
                return Err(RosterError::Again { field, got });
            }
            seen.push(got);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::UnitId;
    use crate::sign::Key;

    const A: NodeId = NodeId::UNIT_A;
    const B: NodeId = NodeId::UNIT_B;

    fn public(secret: u8) -> [u8; 32] {
        Key::from_bytes(&[secret; 32]).public()
    }

    #[test]
    fn unsound_key_table_is_refused_by_name() {
        let with_keys = |keys: &[(NodeId, [u8; 32])]| Keyring::default().of_run(keys).err();
        assert_eq!(with_keys(&[(A, public(1)), (B, public(2))]), None);
        assert_eq!(with_keys(&[(A, public(1)), (A, public(2))]), Some(RosterError::Twice { got: A }));
        assert_eq!(with_keys(&[(A, public(1)), (B, [2; 32])]), Some(RosterError::Key { of: B }));
    }

    #[test]
    fn role_of_a_stranger_is_refused_by_name() {
        let run = Keyring::default().of_run(&[(A, public(1)), (B, public(2))]).expect("a table");
        let stranger = UnitId::from_name("unit-64").expect("a unit").node();
        assert_eq!(run.cast("units", [A, B]), Ok(()));
        assert_eq!(run.cast("units", [A, stranger]), Err(RosterError::Stranger { field: "units", got: stranger }));
        assert_eq!(run.cast("units", [A, B, A]), Err(RosterError::Again { field: "units", got: A }));
        let refused = RosterError::Stranger { field: "units", got: stranger }.to_string();
        assert_eq!(refused, "units: an identity with a key in this run expected, got `unit-64`");
    }
}
