//! `lab sensing`: rides through random scenes, sensed both ways: accuracy of the tracks, and likeness of the noise
//! model's findings to findings of the stages that it replaces.
//!
//! It measures and prints; no test asserts its numbers.

use dataset::cells::{self, Cell, Split};
use dataset::example::frames;
use dataset::likeness::{Found, Given, Likeness, RANGES_M, Stage, bin, departures};
use dataset::rides::{self, FRAMES};
use dataset::tracking::{Follower, Tracking};
use evidence::SCHEMA_VERSION;
use parallel::progress::Progress;
use perception::corroborate::CorroborationLimits;
use perception::fused::Disputed;
use perception::stages::{StageClaims, Stages};
use results::report::started;
use runner::custom_detector::DetectorOptions;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, out, plan};
use serde::Serialize;
use sim::NoiseModel;
use sim::ride::Ride;
use sim::scene::Scene;
use stats::mean::Mean;
use topology::{RunSecret, lay_out};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Ride through this scenario's scene as its trials draw it, from the start of its platform; without it, through random ones.
    #[arg(value_name = "SCENARIO", conflicts_with_all = ["cell", "split"])]
    scenario: Option<String>,
    /// Rides of each cell, five seconds each; the first has the number that --seed gives.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u64).range(2..=100_000))]
    rides: u64,
    /// Conditions, as in measurements/dataset/cells.toml; clear alone without it. The noise model is of clear air.
    #[arg(long, value_name = "NAME", default_values_t = ["clear".to_owned()])]
    cell: Vec<String>,
    /// Split of seeds, shapes, paints and grounds.
    #[arg(long, value_name = "SPLIT", default_value = "held-out")]
    split: Split,
    #[command(flatten)]
    bring: DetectorOptions,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    split: String,
    rows: Vec<Row>,
}

/// One cell, or one scenario's scene.
#[derive(Serialize)]
struct Row {
    cell: String,
    rides: u64,
    rendered: Way,
    stand_in: Way,
    /// Measures in which the noise model departs from the stages by more than is allowed.
    departs: Vec<String>,
}

/// One of the two ways of sensing.
#[derive(Default, Serialize)]
struct Way {
    tracking: Tracking,
    /// Mean of the metric over frames, by ride, metres.
    gospa_m: Option<Mean>,
    likeness: Likeness,
    #[serde(skip)]
    by_ride: Vec<f64>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let grounds = grounds(context, args)?;
    let stages = args.bring.stages()?;
    let progress = Progress::new("rides", grounds.len() * args.rides as usize, context.talk);
    let mut rows = Vec::new();
    for ground in &grounds {
        let (mut rendered, mut stand_in) = (Way::default(), Way::default());
        for number in context.seed..context.seed + args.rides {
            if context.stop.is_requested() {
                return Err(Failure::new(Exit::Interrupted, "interrupted"));
            }
            let (scene, drive) = ground.ride(number)?;
            ride(&stages, &scene, drive, &mut rendered, &mut stand_in);
            progress.step();
        }
        let (rendered, stand_in) = (rendered.done(), stand_in.done());
        let departs = departs(&rendered.likeness, &stand_in.likeness);
        rows.push(Row { cell: ground.name().to_owned(), rides: args.rides, rendered, stand_in, departs });
    }
    progress.finish();
    let split = if args.scenario.is_some() { "trials'" } else { args.split.name() }.to_owned();
    let measured = Measured { schema_version: SCHEMA_VERSION, seed: context.seed, split, rows };
    if context.json {
        out::print_json("bench-sensing", &measured)?;
    } else {
        out::say(format_args!("{}", tables(&measured)));
    }
    Ok(Exit::Fine)
}

/// Scene of the rides.
enum Grounds {
    /// Random scenes under one set of conditions.
    Random(&'static Cell, Split),
    /// The scene of a scenario.
    Shipped(Box<Planned>),
}

fn grounds(context: &Context, args: &Args) -> Result<Vec<Grounds>, Failure> {
    if let Some(name) = &args.scenario {
        let wanted = PlanOptions { rendered: true, ..PlanOptions::default() };
        let planned = plan::plan(context, &plan::file_of(context, name)?, &wanted)?.1;
        if planned.iter().any(|planned| planned.variation.scenario.is_of_stacks()) {
            return Err(Failure::new(Exit::Usage, format!("`{name}` runs on the real stacks and has no scene")));
        }
        return Ok(planned.into_iter().map(|planned| Grounds::Shipped(Box::new(planned))).collect());
    }
    Ok(cells::chosen(&args.cell)
        .map_err(|e| Failure::new(Exit::Usage, e.to_string()))?
        .into_iter()
        .map(|cell| Grounds::Random(cell, args.split))
        .collect())
}

impl Grounds {
    fn name(&self) -> &str {
        match self {
            Grounds::Random(cell, _) => &cell.name,
            Grounds::Shipped(planned) => planned.variation.scenario.name.as_str(),
        }
    }

    fn ride(&self, number: u64) -> Result<(Scene, Ride), Failure> {
        match self {
            Grounds::Random(cell, split) => {
                rides::ride(cell, *split, number, NoiseModel::default()).map_err(Failure::internal)
            }
            Grounds::Shipped(planned) => {
                let (scenario, setup) = (&planned.variation.scenario, &planned.setup);
                let topology = lay_out(scenario, setup, number, &RunSecret::seeded(number));
                let config = topology.world().ok_or_else(|| Failure::internal("a topology without a sim"))?;
                let drive = Ride::new(&config.scene, YARD, config.noise, config.seed);
                Ok((config.scene.clone(), drive.map_err(Failure::internal)?))
            }
        }
    }
}

fn ride(stages: &Stages, scene: &Scene, mut ride: Ride, rendered: &mut Way, stand_in: &mut Way) {
    let limits = CorroborationLimits::default();
    let mut followers = [Follower::default(), Follower::default()];
    for way in [&mut *rendered, &mut *stand_in] {
        way.likeness.begin(scene.objects.len());
    }
    for _ in 0..FRAMES {
        let shot = ride.shoot();
        let seen = stages.candidates(&frames(&shot.shown, shot.frame, shot.stamp), limits.score);
        let stood_in = StageClaims { candidates: shot.stand_in.clone(), disputed: Disputed::default() };
        let ways = [(&mut *rendered, &seen), (&mut *stand_in, &stood_in)];
        for (follower, (way, found)) in followers.iter_mut().zip(ways) {
            follower.take(found, &limits, &shot, scene);
            way.likeness.take(&found.candidates, &limits, &shot, scene);
        }
    }
    for (follower, way) in followers.iter().zip([rendered, stand_in]) {
        way.tracking = way.tracking.merged(&follower.score());
        way.by_ride.push(follower.score().gospa());
    }
}

/// Motion in a shipped scenario: m/s, and 1/m.
const YARD: (f32, f32) = (0.6, 0.0);

impl Way {
    fn done(self) -> Self {
        Way { gospa_m: Some(Mean::from_values(&self.by_ride)), ..self }
    }
}

fn departs(rendered: &Likeness, stand_in: &Likeness) -> Vec<String> {
    let stages = Stage::ALL.into_iter().zip(rendered.stages.iter().zip(&stand_in.stages));
    stages
        .flat_map(|(stage, (a, b))| departures(a, b).into_iter().map(move |d| format!("{}, {d}", stage.name())))
        .collect()
}

fn tables(measured: &Measured) -> String {
    let mut tracks = started();
    tracks.set_header([
        "cell",
        "way",
        "GOSPA, m (± 95 %)",
        "followed",
        "right class",
        "off, m",
        "stray a frame",
        "switches",
    ]);
    let mut stages = started();
    let head = ["cell", "stage", "way"].map(str::to_owned).into_iter().chain((0..=RANGES_M.len()).map(bin));
    let tail = ["hidden in part", "stray a frame", "misses in a row", "off", "right class", "of hidden", "score"]
        .map(str::to_owned);
    stages.set_header(head.chain(tail));
    for row in &measured.rows {
        for (name, way) in [("rendered", &row.rendered), ("noise model", &row.stand_in)] {
            tracks.add_row(track_row(&row.cell, name, way));
        }
        for (k, stage) in Stage::ALL.into_iter().enumerate() {
            for (name, way) in [("rendered", &row.rendered), ("noise model", &row.stand_in)] {
                stages.add_row(stage_row(&row.cell, stage, name, &way.likeness.stages[k]));
            }
        }
    }
    let rides = measured.rows.first().map_or(0, |row| row.rides);
    let rows = measured.rows.iter().filter(|row| !row.departs.is_empty());
    let departs: String =
        rows.map(|row| format!("\n{}: the noise model departs: {}", row.cell, row.departs.join("; "))).collect();
    format!("{tracks}\n{stages}{departs}\n{rides} rides of {FRAMES} frames a cell, {} seeds", measured.split)
}

fn track_row(cell: &str, name: &str, way: &Way) -> [String; 8] {
    let t = &way.tracking;
    let spread = way.gospa_m.map_or(0.0, |mean| 1.96 * mean.standard_error);
    let share = |part: u32, of: u32| format!("{:.3}", f64::from(part) / f64::from(of.max(1)));
    [
        cell.to_owned(),
        name.to_owned(),
        format!("{:.2} ± {spread:.2}", t.gospa()),
        share(t.followed, t.shown),
        share(t.named, t.followed),
        format!("{:.2}", t.error_m()),
        share(t.stray, t.frames),
        format!("{} in {} followed", t.switches, t.followed),
    ]
}

fn stage_row(cell: &str, stage: Stage, name: &str, given: &Given) -> Vec<String> {
    let share = |found: &Found| found.share().map_or("–".to_owned(), |s| format!("{s:.3} of {}", found.asked));
    let mut row = vec![cell.to_owned(), stage.name().to_owned(), name.to_owned()];
    row.extend(given.whole.iter().map(share));
    let unit = if stage == Stage::Lidar { "m" } else { "px" };
    row.extend([
        share(&given.partly),
        format!("{:.3}", given.strays()),
        format!("{:.1}", given.burst()),
        format!("{:.2} {unit}", given.error()),
        format!("{:.3}", given.all().named()),
        format!("{:.3}", given.partly.named()),
        format!("{:.2}", given.score()),
    ]);
    row
}
