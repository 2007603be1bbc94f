//! What must hold of every run: the link model is like the real stack, determinism, forks, replay of mouths, and that the judge sees what is broken.

mod conformance;
mod determinism;
mod forks;
mod fuzzing;
mod mouths;
mod oracle;
mod takeovers;
