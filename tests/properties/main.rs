//! What must hold of every run: the link model is like the real stack, determinism, forks,
//! replay of mouths, that the judge sees what is broken, and that parsers keep their promises.

mod conformance;
mod determinism;
mod forks;
mod fuzzing;
mod mouths;
mod oracle;
mod parsers;
mod takeovers;
