//! The command path through a broker against real MQTT clients over loopback: who gets in, what each identity may do,
//! what arrives. `suite` is what any broker at this place owes, and both keep it: ours (`embedded`, which owes more) and
//! Debian's mosquitto with the same rights (`mosquitto`).
//!
//! Nothing here waits for time to pass. That something did *not* arrive is shown by order: a marker that was sent
//! after it, on the same path, arrives first.

mod client;
mod embedded;
mod mosquitto;
mod suite;
