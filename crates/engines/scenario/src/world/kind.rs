//! The kinds of body, and the kinds that each family has room for.

use core::fmt;

use config::platform::Body;

use super::Family;
use crate::Platform;

/// A kind of body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// On wheels.
    Wheels,
    /// On rotors.
    Rotors,
    /// On a fixed wing.
    Wing,
    /// A satellite: in orbit.
    Satellite,
}

impl Kind {
    /// That of a platform.
    pub fn from_platform(platform: &Platform) -> Self {
        match platform.body() {
            Body::Wheeled(_) => Self::Wheels,
            Body::Multirotor(_) => Self::Rotors,
            Body::FixedWing(_) => Self::Wing,
            Body::Satellite(_) => Self::Satellite,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Wheels => "wheels",
            Self::Rotors => "rotors",
            Self::Wing => "a fixed wing",
            Self::Satellite => "a satellite",
        }
    }
}

impl Family {
    /// Kinds of body that have room in its worlds and a mission there. Rotors go where wheels do: what is lower than they fly does not stop them.
    pub fn kinds(self) -> &'static [Kind] {
        match self {
            Self::Inspection => &[Kind::Rotors],
            Self::Contacts => &[Kind::Satellite],
            Self::Street
            | Self::Aisles
            | Self::Perimeter
            | Self::Crossing
            | Self::Trees
            | Self::Yard
            | Self::Depot
            | Self::Campus
            | Self::Site
            | Self::Plaza
            | Self::Quay => &[Kind::Wheels, Kind::Rotors],
        }
    }

    /// The families that development drives in with such a body.
    pub fn developed_for(kind: Kind) -> Vec<Self> {
        Self::ALL.into_iter().filter(|family| !family.is_held_out() && family.kinds().contains(&kind)).collect()
    }

    /// Checks that the family suits this platform.
    ///
    /// # Errors
    /// The family is for another kind of body.
    pub fn check_for(self, platform: &Platform) -> Result<(), Misplaced> {
        let got = Kind::from_platform(platform);
        let misplaced = || Misplaced { family: self, platform: platform.name.as_str().to_owned(), got };
        if self.kinds().contains(&got) { Ok(()) } else { Err(misplaced()) }
    }
}

/// A family for another kind of body.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Misplaced {
    /// The family.
    pub family: Family,
    /// Name of the platform.
    pub platform: String,
    /// Kind of its body.
    pub got: Kind,
}

impl fmt::Display for Misplaced {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { family, platform, got } = self;
        let expected: Vec<&str> = family.kinds().iter().map(|kind| kind.name()).collect();
        let (name, expected, got) = (family.name(), expected.join(" or "), got.name());
        write!(f, "worlds of `{name}` expect {expected}, got {got}, `{platform}`")
    }
}

impl std::error::Error for Misplaced {}
