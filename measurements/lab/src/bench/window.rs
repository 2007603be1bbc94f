//! `lab window`: cost and admissions of the anti-replay window by its width.
//!
//! The window is `wire`'s own, fed as a receiver would be: a sender's records, some lost, some late; then each that
//! came once more, and each that was lost, as an attacker who had withheld it would release it. Freshness is left out,
//! to isolate the effect of order, and counted beside.

use evidence::SCHEMA_VERSION;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use runner::failure::{Exit, Failure};
use runner::{Context, out};
use serde::Serialize;
use wire::bounds::Bounds;
use wire::id::{Boot, Sequence};
use wire::trust::Window;

/// Widths, in records; the bitmap holds 64.
const WIDTHS: [u8; 6] = [1, 4, 8, 16, 32, 64];
/// Shares of records lost, percent.
const LOSSES: [u64; 4] = [0, 5, 10, 20];
/// Shares of records that come late, percent.
const LATE: [u64; 4] = [0, 5, 10, 20];
/// The latest that one may come, ms: as long as the widest window is.
const LATEST_MS: u64 = 6_400;
/// Largest delay of a second sending of a record that was seen or withheld, ms.
const AGAIN_MS: u64 = 20_000;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Records of each cell.
    #[arg(long, default_value_t = 20_000, value_parser = clap::value_parser!(u64).range(100..=1_000_000))]
    records: u64,
}

/// One cell of the sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
struct Row {
    width: u8,
    loss_percent: u64,
    late_percent: u64,
    /// First arrivals, and of these refused.
    arrived: u64,
    refused: u64,
    /// First arrivals no older than *Tf*, and of these refused.
    fresh: u64,
    fresh_refused: u64,
    /// Second arrivals, and of these accepted: has to be none.
    replays: u64,
    replays_accepted: u64,
    /// Lost records that were released later, those accepted, and the oldest of these, ms.
    withheld: u64,
    withheld_accepted: u64,
    withheld_oldest_ms: u64,
}

#[derive(Serialize)]
struct Swept {
    schema_version: u32,
    seed: u64,
    records: u64,
    rows: Vec<Row>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let cells = WIDTHS.iter().flat_map(|w| LOSSES.iter().flat_map(move |l| LATE.iter().map(move |r| (*w, *l, *r))));
    let rows: Vec<Row> = cells.map(|cell| sweep(cell, args.records, context.seed, &Bounds::GROUND)).collect();
    let leaks = rows.iter().any(|row| row.replays_accepted > 0);
    let swept = Swept { schema_version: SCHEMA_VERSION, seed: context.seed, records: args.records, rows };
    if context.json {
        out::print_json("bench-window", &swept)?;
    } else {
        out::say(format_args!("{}", table(&swept.rows)));
    }
    Ok(if leaks { Exit::Unexpected } else { Exit::Fine })
}

/// An arrival: its time, in microseconds, its record, and its kind.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Arrival {
    at: u64,
    sequence: u64,
    kind: Kind,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    First,
    Again,
    Withheld,
}

fn sweep((width, loss, late): (u8, u64, u64), records: u64, seed: u64, bounds: &Bounds) -> Row {
    let mut row = Row { width, loss_percent: loss, late_percent: late, ..Row::default() };
    let period = bounds.telemetry_period_ms * 1000;
    let mut window = Window::new(width, bounds.sequence_jump);
    for arrival in arrivals(records, period, (loss, late), seed) {
        let accepted = window.admit(Boot(1), Sequence(arrival.sequence)).is_ok();
        let age = arrival.at - arrival.sequence * period;
        match arrival.kind {
            Kind::First => {
                let fresh = age <= bounds.freshness_ms * 1000;
                row.arrived += 1;
                row.refused += u64::from(!accepted);
                row.fresh += u64::from(fresh);
                row.fresh_refused += u64::from(fresh && !accepted);
            }
            Kind::Again => {
                row.replays += 1;
                row.replays_accepted += u64::from(accepted);
            }
            Kind::Withheld => {
                row.withheld += 1;
                row.withheld_accepted += u64::from(accepted);
                row.withheld_oldest_ms = row.withheld_oldest_ms.max(if accepted { age / 1000 } else { 0 });
            }
        }
    }
    row
}

/// All arrivals, in order of time. A record that comes again does so after it came first.
fn arrivals(records: u64, period: u64, (loss, late): (u64, u64), seed: u64) -> Vec<Arrival> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut below = |n: u64| rng.next_u64() % n;
    let mut all = Vec::new();
    for sequence in 1..=records {
        let (lost, held) = (below(100) < loss, below(100) < late);
        let (on_time, lateness, repeated) = (below(20_000), below(LATEST_MS * 1000), 1 + below(AGAIN_MS * 1000));
        let first = sequence * period + if held { lateness } else { on_time };
        if lost {
            all.push(Arrival { at: sequence * period + repeated, sequence, kind: Kind::Withheld });
        } else {
            all.push(Arrival { at: first, sequence, kind: Kind::First });
            // Only an accepted record can be replayed; one that the window refused first time it refuses again.
            all.push(Arrival { at: first + repeated, sequence, kind: Kind::Again });
        }
    }
    all.sort_unstable();
    all
}

fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "width  loss %  late %   refused of late and all   of fresh   replays accepted   withheld accepted   oldest ms\n",
    );
    for row in rows {
        text.push_str(&format!(
            "{:>5}  {:>6}  {:>6}   {:>9} of {:>9}   {:>3} of {:>6}   {:>3} of {:>8}   {:>6} of {:>6}   {:>9}\n",
            row.width,
            row.loss_percent,
            row.late_percent,
            row.refused,
            row.arrived,
            row.fresh_refused,
            row.fresh,
            row.replays_accepted,
            row.replays,
            row.withheld_accepted,
            row.withheld,
            row.withheld_oldest_ms,
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wider window refuses fewer late records and admits older ones.
    #[test]
    fn no_width_admits_a_record_twice() {
        let of = |width| sweep((width, 10, 20), 2_000, 1, &Bounds::GROUND);
        let rows: Vec<Row> = WIDTHS.iter().map(|width| of(*width)).collect();
        assert!(rows.iter().all(|row| row.replays_accepted == 0 && row.replays > 1_000));
        assert!(rows.windows(2).all(|pair| pair[0].refused > pair[1].refused));
        assert!(rows.windows(2).all(|pair| pair[0].withheld_accepted < pair[1].withheld_accepted));
        // The oldest of a sample: a wider window lets in none that is younger, and may let in the same one.
        assert!(rows.windows(2).all(|pair| pair[0].withheld_oldest_ms <= pair[1].withheld_oldest_ms));
        let fresh: Vec<u64> = rows.iter().map(|row| row.fresh_refused).collect();
        assert!(fresh[0] > 0 && fresh[1..].iter().all(|refused| *refused == 0), "{fresh:?}");
    }

    /// Without loss and lateness every record is accepted once.
    #[test]
    fn every_width_accepts_a_perfect_stream_once() {
        for width in WIDTHS {
            let row = sweep((width, 0, 0), 500, 1, &Bounds::GROUND);
            assert_eq!((row.arrived, row.refused, row.replays_accepted), (500, 0, 0));
        }
    }
}
