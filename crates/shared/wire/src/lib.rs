//! Messages between holdsafe's services, and the checks they pass before they are believed.
//!
//! No I/O, no clock, no service. Senders, receivers and messages:
//!
//! | message | from | to | over | module |
//! |---|---|---|---|---|
//! | `Frames`, `Candidates` | sim | perception | shared memory | [`sensor`] |
//! | `Bearings` | sim | perception | shared memory | [`bearing`] |
//! | `Navigation` | sim | perception, autonomy | shared memory | [`sensor`] |
//! | `Tracks` | perception | autonomy | shared memory | [`track`] |
//! | `Drive`, `Act` | autonomy | sim | shared memory | [`drive`] |
//! | `SessionMessage` with `Report` | autonomy | gateway | DTLS | [`session`], [`report`] |
//! | `SessionMessage` with `Grant`, `Teammate` | gateway | autonomy | DTLS | [`session`] |
//! | `Order` | gateway | autonomy | MQTT over TLS | [`command`] |
//! | `Ack` | autonomy | gateway | MQTT over TLS | [`command`] |
//! | `Feed` | gateway | console | shared memory | [`feed`] |
//! | `Request` | console | gateway | shared memory | [`command`] |
//! | `Entry` | everyone | recorder | instrument plane | [`audit`], [`event`] |
//! | `Seal` | recorder | autonomy | shared memory | [`audit`] |
//! | `Request`, `Answer` | autonomy, a guest | each other | the process that holds the guest | [`guest`] |
//!
//! A reviewer of trust starts at [`trust`], then reads `gateway/src/admit.rs` and `autonomy/src/transition.rs`.

pub mod account;
pub mod audit;
pub mod bearing;
pub mod bounds;
pub mod bus;
pub mod codec;
pub mod command;
pub mod core;
pub mod crop;
pub mod drive;
pub mod event;
pub mod feed;
pub mod guest;
pub mod id;
pub mod measured;
pub mod mode;
pub mod motion;
pub mod person;
pub mod plain;
pub mod policy;
pub mod refusal;
pub mod report;
pub mod roster;
pub mod sensor;
pub mod session;
pub mod settings;
pub mod sign;
pub mod time;
pub mod track;
pub mod trust;
