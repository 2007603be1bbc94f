//! A search for what nobody wrote down: words over an alphabet of attacks, tried on a scenario, until something breaks; and
//! each finding as the smallest word that shows it.
//!
//! Terms: a *move* is a kind of attack of an `Alphabet`; a *letter* one move with its moment and its numbers; a
//! *word* what an adversary does in one trial. A *cause* is the class of a trial with the first property it broke.
//! `word` is the word and the scenario that it makes, `tried` one trial of it, `coverage` what that showed, `moments` when it may
//! matter, `learned` what all of it taught, `draw` the strategies, `vary` words made from others, `hunt` the loop, `exhaust` every
//! word up to a length, `shrink` the smallest, `interior` one away from its edge, `sample` words drawn at random to hold live
//! runs against. Which properties there are, whether one broke and how near it came to that is `oracle`'s.

mod coverage;
mod draw;
mod exhaust;
mod hunt;
mod interior;
mod learned;
mod moments;
pub mod rare;
mod sample;
mod shrink;
mod tried;
mod vary;
mod word;

pub use coverage::Coverage;
pub use draw::Strategy;
pub use hunt::{Found, HuntRow, Hunted, NearestRow, Quest};
pub use moments::Moments;
pub use sample::{Drawn, Stratum};
pub use shrink::{Margin, Shrunk};
pub use tried::{Cause, Ground, Test, Tried, ends_in};
pub use word::{Letter, Word};
