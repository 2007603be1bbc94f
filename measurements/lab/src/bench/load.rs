//! `lab load`: many sessions, and then a flood of datagrams that are no records beside one valid stream, on the real
//! accept loop over loopback sockets. It measures and prints; only a datagram that is in no account is a failure.

use evidence::SCHEMA_VERSION;
use link::load::{LoadSettings, Measured, run as load};
use runner::failure::{Exit, Failure};
use runner::{Context, out};
use serde::Serialize;

/// Records a second of the valid stream beside the flood.
const BESIDE: u32 = 50;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Sessions at once.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u64).range(1..=128))]
    sessions: u64,
    /// Records a second of each.
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    rate: u32,
    /// Seconds of that; 0 leaves it out.
    #[arg(long, default_value_t = 120, value_parser = clap::value_parser!(u64).range(0..=3_600))]
    seconds: u64,
    /// Datagrams a second that are no record, beside one valid stream.
    #[arg(long, default_value_t = 30_000, value_parser = clap::value_parser!(u32).range(30..=1_000_000))]
    flood: u32,
    /// Seconds of that; 0 leaves it out.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u64).range(0..=3_600))]
    flood_seconds: u64,
}

#[derive(Serialize)]
struct Told {
    schema_version: u32,
    sessions: Option<Measured>,
    flood: Option<Measured>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let measure = |requested: LoadSettings| {
        let measured = (requested.seconds > 0).then(|| load(requested)).transpose();
        measured.map_err(|error| Failure::new(Exit::Environment, format!("{error}; is the loopback interface there?")))
    };
    let (sessions, rate) = (args.sessions as usize, args.rate);
    let told = Told {
        schema_version: SCHEMA_VERSION,
        sessions: measure(LoadSettings { sessions, rate, flood: 0, seconds: args.seconds })?,
        flood: measure(LoadSettings { sessions: 1, rate: BESIDE, flood: args.flood, seconds: args.flood_seconds })?,
    };
    if context.json {
        out::print_json("bench-load", &told)?;
    } else {
        told.sessions.iter().for_each(|m| out::say(format_args!("{}", text("sessions", m))));
        told.flood.iter().for_each(|m| out::say(format_args!("{}", text("flood", m))));
    }
    let lost = [&told.sessions, &told.flood].into_iter().flatten().any(|m| m.unaccounted != 0);
    Ok(if lost { Exit::Unexpected } else { Exit::Fine })
}

fn text(name: &str, m: &Measured) -> String {
    let share = |n: u64, of: u64| if of == 0 { 0.0 } else { n as f64 / of as f64 * 100.0 };
    let arrived = m.listener.guard.datagrams + m.listener.unknown_peers + m.kernel_dropped;
    format!(
        "{name}: {} sessions x {} records/s for {} s, {} other datagrams/s\n  \
         records: {} sent, {} delivered ({:.3} % not)\n  \
         other datagrams: {} sent, {} refused before the handshake\n  \
         dropped by the kernel at the socket: {} ({:.3} %)\n  \
         in no account: {}\n  \
         resident memory: {} KiB before, {} KiB at most\n",
        m.opened,
        m.settings.rate,
        m.settings.seconds,
        m.settings.flood,
        m.sent,
        m.delivered,
        share(m.sent.saturating_sub(m.delivered), m.sent),
        m.flooded,
        m.listener.unknown_peers,
        m.kernel_dropped,
        share(m.kernel_dropped, arrived),
        m.unaccounted,
        m.resident_kib[0],
        m.resident_kib[1],
    )
}
