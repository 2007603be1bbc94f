//! The attack on all stages at once: a print in colour and in warmth, by an attacker who knows the detectors, the thermal stage
//! and the rules of corroboration for all, and bears them on a shape that depth and LiDAR take for a vehicle's.
//!
//! The networks' gradients are followed at once, from two beginnings: heated evenly, and as warm as a vehicle where a vehicle
//! is. Of the results, the one that has most views stand as a vehicle after the whole of corroboration is kept: detector, depth,
//! LiDAR and warmth as the platform judges them. It is judged on other views.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use burn::tensor::Device;
use dataset::cells::Split;
use dataset::draw::uniform;
use dataset::example::{Example as Frame, ExampleError};
use dataset::sightings::stands_near;
use ground_truth::print::{COLUMNS, ROWS};
use perception::corroborate::CorroborationLimits;
use perception::corroborate::thermal::{Warmth, judge as fits};
use perception::detector::Detector;
use perception::letterbox::{HEIGHT, WIDTH};
use perception::stages::Stages;
use perception::thermal::blobs;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use wire::sensor::{Class, Detection};

use crate::data::{Example, target};
use crate::descent::Descent;
use crate::harden::gradient;
use crate::interval::wilson;
use crate::net::Net;
use crate::sense::Sense;
use crate::shifts::{BATCH, JUDGED_ON, MADE_ON, STEPS, at_random, claimed, hex};
use crate::train::FRAME;
use crate::victim::Victim;
use crate::views::{FIELDS, SHIFTS, View, steps};

// Fixed before the first attack was made.

/// Strengths: the largest shift of a channel of the coat, of 255, and the most kelvin above the ground that a field may be.
const COATS: [u8; 4] = [0, 8, 16, 32];
const HEATS: [u8; 4] = [0, 10, 20, 30];
/// The design strength.
const DESIGN: (u8, u8) = (32, 30);
/// A strength fails if its share of views that stand is above this with 95 % confidence.
const FAILS: f64 = 0.05;
/// Steps after which, and after every further such number, the suit of that step may be kept.
const SETTLED: usize = 30;
const EVERY: usize = 10;

/// A suit: shifts of the coat, of 255, and kelvin above the ground, field by field.
#[derive(Clone)]
pub(crate) struct Suit {
    pub(crate) shifts: Vec<f32>,
    pub(crate) heat: Vec<f32>,
}

/// Beginning of the heat of a suit.
#[derive(Clone, Copy)]
pub(crate) enum Begins {
    /// All fields as warm as they may be.
    Even,
    /// As a vehicle is: engine, wheels, the rest.
    LikeAVehicle,
    /// Rectangles of fields at random.
    AtRandom(u64),
}

/// The networks that are attacked, with all that judges beside them.
struct Pair {
    colour: Victim,
    thermal: Victim,
    /// The fused network, if there is one beside the colour detector.
    fused: Option<Victim>,
    stages: Stages,
}

impl Pair {
    fn read(colour: &Path, thermal: &Path) -> Result<Self, Box<dyn Error>> {
        let fused = Sense::Fused.model(colour).is_file().then(|| Victim::read(Sense::Fused, colour)).transpose()?;
        let (colour, thermal) = (Victim::read(Sense::Colour, colour)?, Victim::read(Sense::Thermal, thermal)?);
        let stages = colour.stages(&thermal.detector, fused.as_ref());
        Ok(Pair { colour, thermal, fused, stages })
    }
}

/// Knowledge of an attacker.
#[derive(Clone, Copy)]
enum Knows {
    Nothing,
    OtherPair,
    Pair,
}

/// Results of decoys in views that the suit was not made on.
#[derive(Default)]
struct Tally {
    views: u32,
    /// Called a vehicle by the detector alone.
    called: u32,
    /// As warm as a vehicle by the thermal stage alone.
    warm: u32,
    /// Stand as a vehicle after corroboration: with the same print heated evenly, and as made.
    even: u32,
    joint: u32,
    /// Views of each [`Aspect`](crate::views::Aspect), and views in which it stands as made.
    by_aspect: [(u32, u32); 3],
}

/// Attacks the detector in `of[0]` with the thermal stage in `of[1]`, by their own weights and by those in `of[2]` and `of[3]`;
/// writes `page`, and beside it the suit of the design strength.
pub(crate) fn write(paths: [&Path; 4], page: &Path, views: Option<u64>) -> Result<(), Box<dyn Error>> {
    let (own_pair, other) = (Pair::read(paths[0], paths[1])?, Pair::read(paths[2], paths[3])?);
    let made_on = View::some(Split::Tuning, 0, MADE_ON)?;
    let judged_on = View::some(Split::HeldOut, 20_000, views.map_or(JUDGED_ON, |views| views as usize))?;
    eprintln!("{} views rendered", made_on.len() + judged_on.len());
    let grid = HEATS.iter().flat_map(|heat| COATS.iter().map(move |coat| (Knows::Pair, (*coat, *heat))));
    let attacks: Vec<_> = grid.chain([(Knows::OtherPair, DESIGN), (Knows::Nothing, DESIGN)]).collect();
    let attack = |(knows, strength): &(Knows, (u8, u8))| -> Result<(String, Suit), Box<dyn Error>> {
        let (knows, strength) = (*knows, *strength);
        let suit = match knows {
            Knows::Pair => made(&own_pair, &made_on, strength)?,
            Knows::OtherPair => made(&other, &made_on, strength)?,
            Knows::Nothing => {
                let heat = Begins::AtRandom(0).heat(f32::from(strength.1));
                Suit { shifts: at_random(strength.0, SHIFTS), heat }
            }
        };
        let row = row(knows, strength, &judge(&own_pair, &judged_on, &suit, strength)?);
        eprint!("{row}");
        Ok((row, suit))
    };
    let made = parallel::map(parallel::cores(), &attacks, |of| attack(of).map_err(|error| error.to_string()))?;
    for ((knows, strength), (_, suit)) in attacks.iter().zip(&made) {
        if matches!(knows, Knows::Pair) && *strength == DESIGN {
            std::fs::write(page.with_extension("txt"), hex(&suit.shifts, COLUMNS) + &warm_hex(&suit.heat))?;
        }
    }
    let rows: String = made.into_iter().map(|(row, _)| row).collect();
    let text = text(&own_pair, &other, judged_on.len(), &rows);
    std::fs::write(page, &text)?;
    println!("{text}");
    Ok(())
}

/// The suit of this strength that has most of `views` stand as a vehicle.
fn made(pair: &Pair, views: &[View], (coat, heat): (u8, u8)) -> Result<Suit, Box<dyn Error>> {
    let mut best = (0, Suit { shifts: vec![0.0; SHIFTS], heat: vec![0.0; FIELDS] });
    for begins in [Begins::LikeAVehicle, Begins::Even] {
        let (colour, thermal) = (Some((&pair.colour.net, coat)), Some((&pair.thermal.net, heat)));
        let fused = pair.fused.as_ref().map(|fused| &fused.net);
        descend(colour, thermal, fused, views, begins, |step, suit| {
            if step >= SETTLED && step % EVERY == 0 {
                let stand = standing(&pair.stages, views, suit)?;
                if stand >= best.0 {
                    best = (stand, suit.clone());
                }
            }
            Ok(())
        })?;
    }
    Ok(best.1)
}

/// Downhill in each network, by this much at most, to labels that say vehicle; `each` gets the suit after each step, from 1.
pub(crate) fn descend(
    colour: Option<(&Net, u8)>,
    thermal: Option<(&Net, u8)>,
    fused: Option<&Net>,
    views: &[View],
    begins: Begins,
    mut each: impl FnMut(usize, &Suit) -> Result<(), ExampleError>,
) -> Result<(), Box<dyn Error>> {
    let device = Device::default().autodiff();
    let [coat, heat] = [colour, thermal].map(|of| of.map_or(0, |(_, most)| most));
    let mut rng = ChaCha8Rng::seed_from_u64(u64::from(coat) << 8 | u64::from(heat));
    let (bound, hottest) = (f32::from(coat), f32::from(heat));
    let mut shifts = Descent::new(vec![0.0; SHIFTS], -bound, bound);
    let mut warmth = Descent::new(begins.heat(hottest), 0.0, hottest);
    for step in 0..STEPS {
        let left = 1.0 - step as f32 / STEPS as f32;
        let mut down = [vec![0.0; SHIFTS], vec![0.0; FIELDS]];
        let some: Vec<&View> = (0..BATCH).map(|_| &views[rng.next_u32() as usize % views.len()]).collect();
        if let Some((net, _)) = colour.filter(|_| coat > 0) {
            let planes = some.iter().flat_map(|view| view.planes(&shifts.values)).collect();
            let targets = some.iter().map(|view| target(&claimed(view), false)).collect();
            let (gradients, mut sum) = (gradient(net, planes, targets, &device)?, vec![0.0; SHIFTS]);
            some.iter().zip(gradients.chunks_exact(FRAME)).for_each(|(view, of)| view.back(of, &mut sum));
            add(&mut down[0], &sum);
        }
        if let Some((net, _)) = thermal.filter(|_| heat > 0) {
            let planes: Vec<f32> = some.iter().flat_map(|view| view.felt(&warmth.values)).collect();
            let targets = some.iter().map(|view| target(&claimed_warm(view), false)).collect();
            let (gradients, mut sum) = (gradient(net, planes.clone(), targets, &device)?, vec![0.0; FIELDS]);
            let seen = planes.chunks_exact(FRAME).zip(gradients.chunks_exact(FRAME));
            some.iter().zip(seen).for_each(|(view, (seen, of))| view.back_warm(of, seen, &mut sum));
            add(&mut down[1], &sum);
        }
        if let Some(net) = fused {
            let planes: Vec<f32> = some.iter().flat_map(|view| view.sensed(&shifts.values, &warmth.values)).collect();
            let targets = some.iter().map(|view| target(&claimed(view), false)).collect();
            let gradients = gradient(net, planes.clone(), targets, &device)?;
            let mut sums = [vec![0.0; SHIFTS], vec![0.0; FIELDS]];
            let whole = Sense::Fused.inputs() * HEIGHT * WIDTH;
            for (view, (seen, of)) in some.iter().zip(planes.chunks_exact(whole).zip(gradients.chunks_exact(whole))) {
                view.back(&of[..FRAME], &mut sums[0]);
                view.back_warm(&of[FRAME..2 * FRAME], &seen[FRAME..2 * FRAME], &mut sums[1]);
            }
            down.iter_mut().zip(&sums).for_each(|(down, sum)| add(down, sum));
        }
        let [coat_down, heat_down] = down;
        if coat > 0 {
            shifts.step(&coat_down, left);
        }
        if heat > 0 {
            warmth.step(&heat_down, left);
        }
        each(step + 1, &Suit { shifts: shifts.values.clone(), heat: warmth.values.clone() })?;
    }
    Ok(())
}

/// Adds a gradient at the mean size that all have, so that no network drowns another.
fn add(down: &mut [f32], sum: &[f32]) {
    let size = sum.iter().map(|v| v.abs()).sum::<f32>().max(f32::MIN_POSITIVE) / sum.len() as f32;
    down.iter_mut().zip(sum).for_each(|(down, of)| *down += of / size);
}

/// Output that the thermal stage would be asked for if the view's decoys were vehicles.
fn claimed_warm(view: &View) -> Example {
    let mut claimed = claimed(view);
    claimed.labels.retain(|label| label.class != Class::Obstacle);
    claimed
}

impl Begins {
    /// Kelvin above the ground, field by field, none above `hottest`.
    pub(crate) fn heat(self, hottest: f32) -> Vec<f32> {
        let places = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column)));
        match self {
            Begins::Even => vec![hottest; FIELDS],
            Begins::LikeAVehicle => {
                let share = |(row, column): (usize, usize)| match (row, column) {
                    // The shares of `sim::sensor::thermal`, which the attacker knows.
                    (_, column) if column >= COLUMNS * 13 / 20 => 1.0,
                    (row, _) if row >= ROWS * 27 / 40 => 0.8,
                    _ => 0.6,
                };
                places.map(|place| hottest * share(place)).collect()
            }
            Begins::AtRandom(seed) => {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                let mut uniform = || uniform(&mut rng);
                let mut heat = vec![hottest * uniform(); FIELDS];
                for _ in 0..6 {
                    let mut side = |most: usize| {
                        let (a, b) = ((uniform() * most as f32) as usize, (uniform() * most as f32) as usize);
                        a.min(b)..=a.max(b)
                    };
                    let (rows, columns) = (side(ROWS), side(COLUMNS));
                    let level = hottest * uniform();
                    rows.for_each(|row| heat[row * COLUMNS..][columns.clone()].fill(level));
                }
                heat
            }
        }
    }
}

/// Count of the views in which the decoy stands as a vehicle, as the platform judges it.
fn standing(stages: &Stages, views: &[View], suit: &Suit) -> Result<usize, ExampleError> {
    let limits = CorroborationLimits::default();
    let mut count = 0;
    for view in views {
        let frame = view.heated(&suit.shifts, &suit.heat)?;
        count += usize::from(stands_near(stages, &limits, &frame, view.label.object, Class::Vehicle));
    }
    Ok(count)
}

fn judge(pair: &Pair, views: &[View], suit: &Suit, (_, heat): (u8, u8)) -> Result<Tally, Box<dyn Error>> {
    let limits = CorroborationLimits::default();
    let evenly = Begins::Even.heat(f32::from(heat));
    let mut tally = Tally::default();
    for view in views {
        let [even, joint] = [view.heated(&suit.shifts, &evenly)?, view.heated(&suit.shifts, &suit.heat)?];
        let stands = |frame: &Frame| stands_near(&pair.stages, &limits, frame, view.label.object, Class::Vehicle);
        let found = pair.colour.detector.detect(&joint.frame.rgb, limits.score)?;
        let called = found.iter().any(|d| d.class == Class::Vehicle && d.bounds.shared(&view.label.bounds) >= 0.5);
        tally.views += 1;
        tally.called += u32::from(called);
        tally.warm += u32::from(warm(&pair.thermal.detector, &joint, view));
        tally.even += u32::from(stands(&even));
        let stood = u32::from(stands(&joint));
        tally.joint += stood;
        let (views, standing) = &mut tally.by_aspect[view.aspect() as usize];
        (*views, *standing) = (*views + 1, *standing + stood);
    }
    Ok(tally)
}

/// True if the thermal stage would bear out a vehicle where the decoy is.
fn warm(thermal: &Detector, example: &Frame, view: &View) -> bool {
    let claim = Detection { class: Class::Vehicle, score: 1000, bounds: view.label.bounds };
    let blobs = blobs(thermal, &example.frame.thermal, example.frame.width, example.frame.height);
    fits(&claim, blobs.as_deref()) == Warmth::Fits
}

fn row(knows: Knows, strength: (u8, u8), tally: &Tally) -> String {
    let name = match knows {
        Knows::Nothing => "nothing (random fields)",
        Knows::OtherPair => "the other pair",
        Knows::Pair => "this pair",
    };
    let mark = if strength == DESIGN { " (design)" } else { "" };
    let mut row = format!("| {name} | {} | {}{mark} |", strength.0, strength.1);
    for (k, judged) in [(tally.called, false), (tally.warm, false), (tally.even, true), (tally.joint, true)] {
        let [low, high] = wilson(k, tally.views);
        let fails = if judged && low > FAILS { "**" } else { "" };
        let percent = 100.0 * f64::from(k) / f64::from(tally.views.max(1));
        // Writing to a String cannot fail.
        let _ = write!(row, " {fails}{percent:.1}{fails} ({:.1}–{:.1}) |", 100.0 * low, 100.0 * high);
    }
    for (views, standing) in tally.by_aspect {
        let _ = write!(row, " {standing}/{views} |");
    }
    row + "\n"
}

/// Rows of two hexadecimal digits a field, as a scenario takes them.
fn warm_hex(heat: &[f32]) -> String {
    let rows = steps(heat);
    rows.chunks_exact(COLUMNS)
        .map(|row| row.iter().map(|step| format!("{step:02x}")).collect::<String>() + "\n")
        .collect()
}

fn text(own_pair: &Pair, other: &Pair, views: usize, rows: &str) -> String {
    format!(
        "# A print in colour and warmth, against the detector `{:.12}`, the thermal stage `{:.12}` and the fused network `{:.12}`\n\n\
         Written by `trainer joint`. One print of {ROWS} × {COLUMNS} fields on each side of a decoy of a vehicle's size, so that depth and \
         LiDAR bear it out; each field shifts the coat by at most so much of 255 and is at most so many kelvin above the ground. Made on \
         {MADE_ON} views with the gradients of all networks at once, from two beginnings; what has most of those views stand as a \
         vehicle after corroboration is kept, and judged on {views} others, rendered with it in the scene. *Called*: by the detector alone. *Warm*: \
         borne out by the thermal stage alone. *Stands*: as a vehicle after corroboration in a single frame, with the same print heated evenly \
         to the same bound, and as made; of the latter, how many of those that show an end, a corner and a long side (thirds of a quarter turn). In bold what is above {:.0} % with 95 % confidence. The other pair is `{:.12}` and `{:.12}`. Strengths, design \
         strength, steps and views were fixed before the first was made. Shares in per cent, with Wilson's intervals, 95 %.\n\n\
         | attacker knows | coat, of 255 | heat, K | called a vehicle | warm like one | stands, heated evenly | stands, as made | end | corner | side |\n\
         |---|---|---|---|---|---|---|---|---|---|\n{rows}",
        own_pair.colour.sha256,
        own_pair.thermal.sha256,
        own_pair.fused.as_ref().map_or("none", |fused| &fused.sha256),
        100.0 * FAILS,
        other.colour.sha256,
        other.thermal.sha256,
    )
}
