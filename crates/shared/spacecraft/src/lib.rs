//! Spacecraft: orbit, Earth, attitude, pointing and power of a small satellite, as pure functions of state and time.
//!
//! Terms: *TEME* is the inertial frame of SGP4 (true equator, mean equinox); *Earth-fixed* turns with the Earth, x to
//! Greenwich and z to the pole; *body* axes are the satellite's, +z the payload's line of sight. Quaternions are scalar
//! first and turn body axes into TEME unless stated otherwise. Units are SI; angles are radians.
//!
//! Numbers that are not stated belong to a 6U cubesat of 10 kg. The crate holds no clock, no randomness and no
//! message: who commands, measures and records is left to its callers. Transcendental functions are `libm`'s, so that
//! machines agree.

pub mod attitude;
pub mod date;
pub mod earth;
pub mod orbit;
pub mod pointing;
pub mod power;
pub mod region;
pub mod vector;
