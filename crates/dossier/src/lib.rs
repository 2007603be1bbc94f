//! What a reviewer is handed, made from results as `holdsafe … --json` prints them and from nothing else.
//!
//! Every output is a pure function of [`Results`](results::Results): no clock, no chance and no other file reaches it, so the same results
//! give the same bytes. Nothing here judges a trial or computes a bound; what a result does not say is not said.

pub mod objects;
pub mod results;
