//! What must hold of every run: the link model is like the real stack, determinism, forks,
//! replay of mouths, the probability of what is rare, that the judge sees what is broken, that an explanation needs nobody else, and that parsers keep their promises.

mod conformance;
mod determinism;
mod explained;
mod forks;
mod fuzzing;
mod mouths;
mod oracle;
mod parsers;
mod rare;
mod takeovers;
mod trunk;
