//! `lab growth`: cost of a simulated second of the twin by its size: objects in view, platforms at one gateway, and
//! platforms abreast, each with its own control.
//!
//! It measures and prints; no test asserts its numbers. Rounds go through all rows, so that each sees the same machine;
//! a row's figure is the median of its rounds. The formats bound the length of a row: a scene has at most 64 objects, a
//! perception keeps 16 tracks, a report carries 8, a gateway has two whole platforms (`ARCHITECTURE.md`, *Cost of the
//! twin*). Platforms abreast take turns of 100 ms on one thread, so that each finds the caches as the others left
//! them.

use crate::report::{Grown, Growth, GrowthRow, growth_table};
use ground_truth::Any;
use parallel::progress::Progress;
use results::mode::Mode;
use results::report::Spread;
use runner::error::EngineError;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, batch, out, plan};
use scenario::{Settings, Variation};
use serde_json::{Value, json};
use twin::trial::{conclude, start};
use wire::event::Event;

/// Numbers of objects before the unit.
const OBJECTS: [usize; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Numbers of platforms abreast.
const ABREAST: [usize; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Length of a turn of one of them, microseconds.
const TURN_US: u64 = 100_000;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Rounds through all rows.
    #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    rounds: u32,
    /// Trials of each row in a round.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1_000))]
    trials: u64,
}

/// One row to be measured.
struct Place {
    of: Grown,
    n: usize,
    planned: Planned,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let places = places(context)?;
    let progress = Progress::new("rounds", args.rounds as usize, context.talk);
    let mut costs = vec![Vec::new(); places.len()];
    for _ in 0..args.rounds {
        for (place, costs) in places.iter().zip(&mut costs) {
            costs.push(cost(context, place, args.trials)?);
        }
        progress.step();
    }
    progress.finish();
    let row = |(place, costs): (&Place, Vec<f64>)| {
        Ok(GrowthRow {
            of: place.of,
            n: place.n,
            tracks: tracks(context, &place.planned)?,
            us: Spread::from_values(costs),
        })
    };
    let rows = places.iter().zip(costs).map(row).collect::<Result<_, Failure>>()?;
    let growth = Growth::new(context.seed, args.trials, rows);
    if context.json {
        out::print_json("bench-growth", &growth)?;
    } else {
        out::say(format_args!("{}", growth_table(&growth)));
    }
    Ok(Exit::Fine)
}

fn places(context: &Context) -> Result<Vec<Place>, Failure> {
    let wanted = PlanOptions::default();
    let planned = plan::plan(context, &plan::file_of(context, "nominal")?, &wanted)?.1;
    let [nominal] = planned.as_slice() else {
        return Err(Failure::internal("`nominal` has more than one variation"));
    };
    let place = |of, n, path: &str, value| {
        let variation = &nominal.variation;
        let scenario =
            variation.with_settings(&Settings::one(path, value)).map_err(|error| plan::unfit(variation, &error))?;
        let variation = Variation { scenario, ..variation.clone() };
        Ok(Place { of, n, planned: plan::prepare(context, variation, &wanted)? })
    };
    let third = json!({ "name": "unit-c", "role": "honest", "start": { "at_m": [-20.0, -16.0] } });
    let units = [Value::Array(Vec::new()), json!([third])];
    let objects = OBJECTS.map(|n| place(Grown::Objects, n, "scene.object", persons(n)));
    let platforms = (1..).zip(units).map(|(n, units)| place(Grown::Platforms, n, "unit", units));
    let abreast = ABREAST.map(|n| place(Grown::Abreast, n, "unit", Value::Array(Vec::new())));
    objects.into_iter().chain(platforms).chain(abreast).collect()
}

/// Persons side by side on arcs before the end of the route, none behind another.
fn persons(n: usize) -> Value {
    let person = |i: usize| {
        let angle = (i as f64 + 0.5) / n as f64 - 0.5;
        let (east, north) = (-1.0 + 13.0 * libm::cos(angle), -5.0 + 13.0 * libm::sin(angle));
        json!({
            "name": format!("person-{i}"), "class": "person", "path_m": [[east, north]], "size_m": [0.2, 0.2, 1.7],
            "temperature_k": 306.0,
        })
    };
    (0..n).map(person).collect()
}

/// CPU microseconds of a simulated second of a whole row.
fn cost(context: &Context, place: &Place, trials: u64) -> Result<f64, Failure> {
    let before = batch::cpu_seconds(Mode::Twin);
    for i in 0..trials {
        if context.stop.is_requested() {
            return Err(EngineError::Stopped.into());
        }
        trial(place, context.seed.wrapping_add(i * place.twins() as u64))?;
    }
    let spent = batch::cpu_seconds(Mode::Twin) - before;
    Ok(spent / (trials as f64 * place.planned.variation.scenario.duration_s.get()) * 1e6)
}

impl Place {
    /// Number of twins.
    fn twins(&self) -> usize {
        match self.of {
            Grown::Objects | Grown::Platforms => 1,
            Grown::Abreast => self.n,
        }
    }
}

/// Runs and judges its twins in turns, each under its own seed.
fn trial(place: &Place, seed: u64) -> Result<(), EngineError> {
    let (scenario, setup) = (&place.planned.variation.scenario, &place.planned.setup);
    let seeds = (0..place.twins() as u64).map(|i| seed.wrapping_add(i));
    let started = seeds.map(|seed| start(scenario, setup, seed, false));
    let mut twins = started.collect::<Result<Vec<_>, _>>().map_err(|e| EngineError::Failed(e.to_string()))?;
    let duration = (scenario.duration_s.get() * 1e6) as u64;
    for turn in 1..=duration.div_ceil(TURN_US) {
        twins.iter_mut().for_each(|(_, twin)| twin.run_until((turn * TURN_US).min(duration)));
    }
    for (topology, twin) in twins {
        conclude(topology, twin, setup);
    }
    Ok(())
}

/// The most tracks that the display shows at a time in the first trial.
fn tracks(context: &Context, planned: &Planned) -> Result<u8, Failure> {
    let (scenario, setup) = (&planned.variation.scenario, &planned.setup);
    let (topology, twin) =
        start(scenario, setup, context.seed, false).map_err(|e| EngineError::Failed(e.to_string()))?;
    let shown = conclude(topology, twin, setup).evidence.entries.into_iter().filter_map(|witnessed| {
        if let Any::Service(Event::Displayed { tracks_fresh, .. }) = witnessed.entry.event {
            Some(tracks_fresh)
        } else {
            None
        }
    });
    Ok(shown.max().unwrap_or_default())
}
