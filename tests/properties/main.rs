//! Properties of every run: the link model agrees with the real stack, determinism, forks, replay of input journals, the probability of rare
//! events, the oracle's detection of broken properties, explanations from the services' logs alone, platforms as data, and the promises of parsers.

mod conformance;
mod determinism;
mod explained;
mod forks;
mod fuzzing;
mod journals;
mod oracle;
mod parsers;
mod platforms;
mod rare;
mod takeovers;
mod trunk;
