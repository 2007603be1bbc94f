//! What must hold of every run: determinism, forks, replay of mouths, and that the judge sees what is broken.

mod determinism;
mod forks;
mod mouths;
mod oracle;
