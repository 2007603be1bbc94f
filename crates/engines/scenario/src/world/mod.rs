//! Drawn worlds: scenes by family and seed, to drive in places that were not arranged.
//!
//! A *family* is a rule with ranges, a *draw* a scene that the rule and a seed give: the same on every machine. A draw stands only if a body of the
//! platform's width gets from the start to every way point (`fair`), and is repeated otherwise. `plan` has the parts of a world, each family a file;
//! `held_out` has the two with ranges that are fixed before any run and which stay away from development. Actors keep to their paths; in three worlds of four
//! they stop before the unit.

mod aisles;
mod campus;
mod chance;
mod contacts;
mod crossing;
mod depot;
mod fair;
mod held_out;
mod inspection;
mod kind;
mod perimeter;
mod plan;
mod site;
mod street;
#[cfg(test)]
mod tests;
mod trees;
mod yard;

use core::fmt;

use super::value::List;
use super::{MAX_STATIONS, Platform, Scene, Station};
pub(crate) use chance::Chance;
pub use kind::{Kind, Misplaced};

/// Most still things of a drawn world; a scene has room for 64 objects, and the moving ones need the rest.
const MOST_STILL: usize = 54;
/// Draws of one world before it is given up.
const MOST_DRAWS: u64 = 21;
/// Share of the worlds in which moving objects yield to the unit.
const YIELD: f64 = 0.75;
/// Room beside a body on either side, metres.
const SPARE_M: f64 = 0.15;

/// A rule by which worlds are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Rounds in a street between parked cars.
    Street,
    /// A store with racks in rows, and pallets in the aisles.
    Aisles,
    /// Rounds along a fence, through gates.
    Perimeter,
    /// A crossing of two streets with people and vehicles.
    Crossing,
    /// A slope with trees.
    Trees,
    /// A yard with obstacles between the way points.
    Yard,
    /// Rows of parked vans.
    Depot,
    /// Buildings with paths between them.
    Campus,
    /// Rounds in the air along the walls of structures.
    Inspection,
    /// Passes in an orbit: a pass with a plan of the payload and several contacts.
    Contacts,
    /// A large site with way points far apart.
    Site,
    /// Held out: an open square with people.
    Plaza,
    /// Held out: lanes along a quay between containers.
    Quay,
}

impl Family {
    /// Every family.
    pub const ALL: [Self; 13] = [
        Self::Street,
        Self::Aisles,
        Self::Perimeter,
        Self::Crossing,
        Self::Trees,
        Self::Yard,
        Self::Depot,
        Self::Campus,
        Self::Inspection,
        Self::Contacts,
        Self::Site,
        Self::Plaza,
        Self::Quay,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Street => "street",
            Self::Aisles => "aisles",
            Self::Perimeter => "perimeter",
            Self::Crossing => "crossing",
            Self::Trees => "trees",
            Self::Yard => "yard",
            Self::Depot => "depot",
            Self::Campus => "campus",
            Self::Inspection => "inspection",
            Self::Contacts => "contacts",
            Self::Site => "site",
            Self::Plaza => "plaza",
            Self::Quay => "quay",
        }
    }

    /// The family with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|family| family.name() == name)
    }

    /// True if it is kept for one run at the end, and no number of the program is chosen by it.
    pub fn is_held_out(self) -> bool {
        matches!(self, Self::Plaza | Self::Quay)
    }

    fn plan(self, chance: &mut Chance) -> plan::Plan {
        match self {
            Self::Street => street::plan(chance),
            Self::Aisles => aisles::plan(chance),
            Self::Perimeter => perimeter::plan(chance),
            Self::Crossing => crossing::plan(chance),
            Self::Trees => trees::plan(chance),
            Self::Yard => yard::plan(chance),
            Self::Depot => depot::plan(chance),
            Self::Campus => campus::plan(chance),
            Self::Inspection => inspection::plan(chance),
            Self::Contacts => contacts::plan(chance),
            Self::Site => site::plan(chance),
            Self::Plaza => held_out::plaza(chance),
            Self::Quay => held_out::quay(chance),
        }
    }
}

/// The room that a body needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Its width, metres.
    pub width_m: f64,
    /// Distance that its middle keeps from the geofence, metres.
    pub fence_m: f64,
}

impl Body {
    /// That of a platform.
    pub fn from_platform(platform: &Platform) -> Self {
        let [_, width_mm] = platform.limits().body_mm;
        let fence_mm = platform.bounds.fence_margin_mm.get() + platform.guards.fence_spare_mm.get();
        Self { width_m: f64::from(width_mm) / 1000.0, fence_m: fence_mm as f64 / 1000.0 }
    }
}

/// No draw of a world could be driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unfair {
    /// Its family.
    pub family: Family,
    /// Its seed.
    pub seed: u64,
    /// Draws that were refused.
    pub draws: u64,
    /// The body that none of them had room for.
    pub body: Body,
}

impl fmt::Display for Unfair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { family, seed, draws, body } = self;
        let reach = body.width_m / 2.0 + SPARE_M;
        let name = family.name();
        write!(f, "{name} of seed {seed}: expected a way for half a width of {reach:.2} m, got none in {draws} draws")
    }
}

impl std::error::Error for Unfair {}

/// The world of a family and a seed that a body can drive.
///
/// # Errors
/// No draw of it has a way.
pub fn draw(family: Family, seed: u64, body: &Body) -> Result<Scene, Unfair> {
    let fair = (0..MOST_DRAWS).map(|number| attempt(family, seed, number)).find(|scene| fair::holds(scene, body));
    fair.ok_or(Unfair { family, seed, draws: MOST_DRAWS, body: *body })
}

/// The ground stations of a world of [`Family::Contacts`] with this seed, for the orbit of a platform; none for one in no orbit.
pub fn stations(seed: u64, platform: &Platform) -> List<Station, MAX_STATIONS> {
    contacts::stations(seed, platform)
}

fn attempt(family: Family, seed: u64, number: u64) -> Scene {
    let mut chance = Chance::new(family as u64, seed, number);
    let ground = chance.integer(1, 1_000_000) as u32;
    let plan = family.plan(&mut chance);
    plan.yielding(chance.happens(YIELD)).scene(ground)
}

/// The text of a scene file.
///
/// # Panics
/// Never: every part of a scene has a form in TOML.
pub fn print(scene: &Scene) -> String {
    toml::to_string(scene).expect("invariant: every part of a scene has a form in TOML")
}
