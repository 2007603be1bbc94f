//! `lab plant`: responses of a platform's body to steps of its set-point and to wind, as JSON, for a referee of the physics (`tools/referee/multirotor.py`).
//!
//! The body flies alone in an empty scene; no verdict is made here.

use std::sync::Arc;

use config::platform::Body;
use evidence::SCHEMA_VERSION;
use runner::failure::{Exit, Failure};
use runner::plan::platform_of;
use runner::{Context, out};
use scenario::load_platform;
use serde::Serialize;
use sim::fidelity::Fidelity;
use sim::plant::{BodyMotion, Plant, SetPoint};
use sim::scene::Scene;
use sim::wind::Wind;
use sim::world::{STEP, World};
use wire::time::{Instant, Span};

/// Steps between two samples: 20 a second.
const SAMPLED: u64 = 5;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The platform, by name or by file.
    #[arg(value_name = "PLATFORM", default_value = "air")]
    platform: String,
}

#[derive(Serialize)]
struct Responses {
    schema_version: u32,
    platform: String,
    body: Body,
    flights: Vec<Flight>,
}

/// A response to one set-point from a hover.
#[derive(Serialize)]
struct Flight {
    name: &'static str,
    /// Velocity asked for, level frame, m/s, and turn, rad/s.
    along: [f32; 3],
    turn: f32,
    /// Wind towards east, m/s.
    wind: f32,
    samples: Vec<Sample>,
}

#[derive(Serialize)]
struct Sample {
    seconds: f64,
    /// World frame, m/s.
    velocity: [f32; 3],
    /// World frame, relative to the start, metres.
    position: [f32; 3],
    /// Body to world, w x y z.
    attitude: [f32; 4],
}

/// Name, velocity, turn, wind.
const FLIGHTS: [(&str, [f32; 3], f32, f32); 5] = [
    ("ahead", [3.0, 0.0, 0.0], 0.0, 0.0),
    ("left and up", [0.0, 2.0, 0.5], 0.0, 0.0),
    ("turn", [2.0, 0.0, 0.0], 0.6, 0.0),
    ("hover in wind", [0.0, 0.0, 0.0], 0.0, 3.0),
    ("against wind", [-2.0, 0.0, 0.0], 0.0, 2.0),
];

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let platform = load_platform(&platform_of(context, &args.platform)?.file)?;
    let body = platform.body();
    if !matches!(body, Body::Multirotor(_)) {
        return Err(Failure::new(Exit::Usage, "the referee is there for a body on rotors, and this platform has none"));
    }
    let flights = FLIGHTS.into_iter().map(|flight| fly(&body, flight)).collect::<Result<Vec<_>, _>>()?;
    let name = platform.name.as_str().to_owned();
    let responses = Responses { schema_version: SCHEMA_VERSION, platform: name, body, flights };
    out::print_json("bench-plant", &responses)?;
    Ok(Exit::Fine)
}

fn fly(body: &Body, (name, along, turn, wind): (&'static str, [f32; 3], f32, f32)) -> Result<Flight, Failure> {
    let air = Wind { east_m_s: wind, ..Wind::default() };
    let mut world = World::new(Arc::new(Scene { objects: Vec::new(), wind: air, ..Scene::default() }));
    let start = world.scene().start;
    let mut plant = Plant::from_body(&mut world, &start, body, &Fidelity::SHIPPED, 1)
        .map_err(|e| Failure::new(Exit::Usage, e.to_string()))?;
    let origin = plant.state(&world).position;
    let samples = (1..=800 / SAMPLED).map(|k| {
        for step in (k - 1) * SAMPLED + 1..=k * SAMPLED {
            let now = Instant(step * STEP.0);
            plant.accept(now, SetPoint { motion: BodyMotion::Velocity { along, turn }, until: now + Span::ms(300) });
            plant.step(now, &mut world);
        }
        let (state, flight) = (plant.state(&world), plant.flight(&world));
        let q = flight.map(|flight| flight.attitude).unwrap_or_default();
        Sample {
            seconds: (k * SAMPLED * STEP.0) as f64 / 1e6,
            velocity: state.velocity.to_array(),
            position: (state.position - origin).to_array(),
            attitude: [q.w, q.x, q.y, q.z],
        }
    });
    Ok(Flight { name, along, turn, wind, samples: samples.collect() })
}
