//! The command path through a broker against real MQTT clients over loopback: admitted peers, rights of each identity,
//! delivery. `suite` has the obligations of any broker at this place. The broker of this workspace (`embedded`, which
//! has more) and Debian's mosquitto with the same rights (`mosquitto`) both keep them.
//!
//! No test waits for time to pass. That a message did *not* arrive is shown by order: a marker that was sent
//! after it, on the same path, arrives first.

mod client;
mod embedded;
mod mosquitto;
mod suite;
