//! `holdsafe bench growth`: what a simulated second of the twin costs as there is more in it: objects in view, and platforms.
//!
//! It measures and prints; no test asserts its numbers. Rounds go through all rows, so that each sees the same machine; a
//! row's figure is the median of its rounds. How far a row goes is what the formats bound: a scene has at most 32 objects, a
//! perception at most 16 tracks, a company two whole platforms (unit B is an insider without a body).

use serde_json::{Value, json};
use wire::event::Event;

use super::engine::{self, EngineError};
use super::failure::{Exit, Failure};
use super::plan::{self, Planned, Wanted};
use super::{Context, batch, campaign, out};
use crate::progress::Progress;
use crate::report::{Grown, Growth, GrowthRow, Mode, SCHEMA_VERSION, Spread, growth_table};
use crate::scenario::{Settings, Variation};
use crate::twin::trial::{conclude, start};

/// How many objects stand before the unit.
const OBJECTS: [usize; 6] = [1, 2, 4, 8, 16, 32];

#[derive(Debug, clap::Args)]
pub(super) struct Args {
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
            costs.push(cost(context, &place.planned, args.trials)?);
        }
        progress.step();
    }
    progress.finish();
    let row = |(place, costs): (&Place, Vec<f64>)| {
        Ok(GrowthRow { of: place.of, n: place.n, tracks: tracks(context, &place.planned)?, us: Spread::of(costs) })
    };
    let rows = places.iter().zip(costs).map(row).collect::<Result<_, Failure>>()?;
    let growth = Growth { schema_version: SCHEMA_VERSION, seed: context.seed, trials: args.trials, rows };
    if context.json {
        out::print_json(&growth)?;
    } else {
        out::say(format_args!("{}", growth_table(&growth)));
    }
    Ok(Exit::Fine)
}

fn places(context: &Context) -> Result<Vec<Place>, Failure> {
    let wanted = Wanted::default();
    let planned = plan::plan(context, &plan::file_of(context, "nominal")?, &wanted)?.1;
    let [nominal] = planned.as_slice() else {
        return Err(Failure::new(Exit::Internal, "`nominal` has more than one variation"));
    };
    let place = |of, n, path: &str, value| {
        let variation = &nominal.variation;
        let scenario =
            variation.with(&Settings::one(path, value)).map_err(|why| campaign::space::unfit(variation, why))?;
        let variation = Variation { scenario, ..variation.clone() };
        Ok(Place { of, n, planned: plan::prepare(context, variation, &wanted)? })
    };
    let third = json!({ "name": "unit-c", "role": "honest", "start": { "at_m": [-20.0, -16.0] } });
    let units = [Value::Array(Vec::new()), json!([third])];
    let objects = OBJECTS.map(|n| place(Grown::Objects, n, "scene.object", persons(n)));
    let platforms = (1..).zip(units).map(|(n, units)| place(Grown::Platforms, n, "unit", units));
    objects.into_iter().chain(platforms).collect()
}

/// Persons side by side on arcs before the end of the route, none behind another.
fn persons(n: usize) -> Value {
    let person = |i: usize| {
        let angle = (i as f64 + 0.5) / n as f64 - 0.5;
        let (east, north) = (-1.0 + 13.0 * libm::cos(angle), -5.0 + 13.0 * libm::sin(angle));
        json!({
            "name": format!("person-{i}"), "class": "person", "path_m": [[east, north]], "size_m": [0.3, 0.3, 1.7],
            "temperature_k": 306.0,
        })
    };
    (0..n).map(person).collect()
}

/// CPU microseconds of a simulated second.
fn cost(context: &Context, planned: &Planned, trials: u64) -> Result<f64, Failure> {
    let (scenario, setup) = (&planned.variation.scenario, &planned.setup);
    let before = batch::cpu_seconds(Mode::Twin);
    for i in 0..trials {
        if context.stop.asked() {
            return Err(EngineError::Stopped.into());
        }
        engine::trial(Mode::Twin, scenario, setup, context.seed.wrapping_add(i), &context.stop)?;
    }
    let spent = batch::cpu_seconds(Mode::Twin) - before;
    Ok(spent / (trials as f64 * scenario.duration_s.get()) * 1e6)
}

/// The most tracks that the display shows at a time in the first trial.
fn tracks(context: &Context, planned: &Planned) -> Result<u8, Failure> {
    let (scenario, setup) = (&planned.variation.scenario, &planned.setup);
    let (cast, twin) = start(scenario, setup, context.seed, false).map_err(|e| EngineError::Failed(e.to_string()))?;
    let shown = conclude(cast, twin, setup).evidence.entries.into_iter().filter_map(|witnessed| {
        if let Event::Displayed { tracks_fresh, .. } = witnessed.entry.event { Some(tracks_fresh) } else { None }
    });
    Ok(shown.max().unwrap_or_default())
}
