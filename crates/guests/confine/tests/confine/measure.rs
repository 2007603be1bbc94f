//! Figures of the start and of the exchange. By hand: `cargo test --release -p confine -- --ignored --nocapture measure`.

use std::time::{Duration, Instant};

use guest::Patience;

use crate::Case;

/// Starts measured.
const STARTS: usize = 20;
/// Exchanges measured.
const EXCHANGES: u32 = 10_000;

#[expect(clippy::disallowed_methods, reason = "a measurement of real time")]
fn timed(run: impl FnOnce()) -> Duration {
    let begin = Instant::now();
    run();
    begin.elapsed()
}

fn start_to_ready(name: &str, case: &Case) {
    let mut times: Vec<Duration> = (0..STARTS)
        .map(|_| {
            let mut channel = None;
            let time = timed(|| {
                let mut started = case.launch().expect("a start");
                started.exchange("start", Patience::Start).expect("an answer");
                channel = Some(started);
            });
            drop(channel);
            time
        })
        .collect();
    times.sort();
    println!(
        "{name}: start to ready, n = {STARTS}: median {:?}, from {:?} to {:?}",
        times[STARTS / 2],
        times[0],
        times[STARTS - 1]
    );
}

#[test]
#[ignore = "a measurement"]
fn measures_of_start_and_exchange() {
    let shell = "while read line; do echo ok; done";
    start_to_ready("sh", &Case::shell(shell, ""));
    start_to_ready("sh without namespaces", &Case::shell(shell, "").plain());
    let echo = "for line in sys.stdin: give(line[:-1])\n";
    let Some(case) = Case::python(echo, "") else { return };
    start_to_ready("python", &case);
    let mut channel = case.launch().unwrap();
    channel.exchange("start", Patience::Start).unwrap();
    let line = "x".repeat(300);
    let time = timed(|| (0..EXCHANGES).for_each(|_| drop(channel.exchange(&line, Patience::Step).unwrap())));
    println!(
        "python echo of 300 bytes, n = {EXCHANGES}: {:.0} exchanges a second",
        f64::from(EXCHANGES) / time.as_secs_f64()
    );
}
