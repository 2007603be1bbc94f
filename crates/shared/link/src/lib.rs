//! The only crate that knows sockets, shared memory, DTLS, MQTT, TLS, MCAP and the OS clock.
//!
//! It moves bytes between a core ([`wire::core::Core`]) and the machine, and logs inputs and outputs. The meaning of a
//! message is left to the cores; permitted addresses are fixed here: every socket takes a [`loopback::LoopbackAddr`].
//!
//! A process is `spec` (its specification) → its core → [`drive::run`].

pub mod bus;
pub mod certificates;
pub mod clock;
pub mod confined;
pub mod crypto;
pub mod display;
pub mod drive;
pub mod dtls;
pub mod files;
#[cfg(feature = "foxglove")]
pub mod foxglove;
pub mod framed;
pub mod guard;
pub mod input_journal;
pub mod instrument;
pub mod load;
pub mod lockstep;
pub mod loopback;
pub mod mcap_frames;
pub mod memory;
pub mod mqtt;
pub mod packets;
pub mod pki;
pub mod process;
pub mod recorder;
pub mod relay;
pub mod sockets;
pub mod spec;
pub mod stream;
pub mod terminal;
pub mod web;
pub mod witness;
