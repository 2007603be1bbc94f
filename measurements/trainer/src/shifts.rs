//! The attack that has a decoy taken for a vehicle by shifts of colour, printed on it or added to every image (`means`), made on
//! one set of views and judged on another.
//!
//! One print or pattern serves every view, so it is made from the mean gradient of many (expectation over transformation, Athalye
//! et al. 2018). Beside the attacker who knows the weights stand one who only sees the scores of some detections (random search
//! over rectangles of fields, after Andriushchenko et al. 2020), one who knows another model's weights, and one who draws at
//! random. Shape is a vehicle's throughout; the decoy is judged cold, and heated like a vehicle.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use burn::tensor::Device;
use dataset::cells::Split;
use dataset::example::{Example as Frame, counts};
use dataset::quality::LEAST;
use dataset::sightings::stands_near;
use perception::corroborate::CorroborationLimits;
use perception::detector::Detector;
use perception::letterbox::{HEIGHT, WIDTH};
use perception::stages::Stages;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use wire::sensor::Class;

use config::platform::Sensors;

use crate::data::{Example, target};
use crate::descent::Descent;
use crate::harden::gradient;
use crate::interval::wilson;
use crate::means::Means;
use crate::net::Net;
use crate::sense::Sense;
use crate::train::FRAME;
use crate::victim::Victim;
use crate::views::{COLD, HEATED, View};

// Fixed before the first print was made, as strengths and design strength are (`means`).

/// Counts of the views that one is made on, of those that a step looks at, and of the steps.
pub(crate) const MADE_ON: usize = 64;
pub(crate) const BATCH: usize = 8;
pub(crate) const STEPS: usize = 60;
/// Looks at all of a fixed few views that an attacker without weights has.
const QUERIES: usize = 400;
/// Views that it is judged on.
pub(crate) const JUDGED_ON: usize = 299;

/// Knowledge of an attacker.
#[derive(Clone, Copy, PartialEq)]
enum Knows {
    Nothing,
    Scores,
    OtherWeights,
    Weights,
}

/// Results of the decoy in views that the shifts were not made on.
#[derive(Clone, Copy, Default)]
struct Tally {
    views: u32,
    /// Called a decoy by the detector, and called a vehicle.
    decoy: u32,
    vehicle: u32,
    /// Stands as a vehicle after corroboration, cold and heated.
    cold: u32,
    heated: u32,
}

/// Attacks `directory/detector.onnx`, by its own weights, by its scores and by the weights in `other`; writes a page and the
/// shifts of the design strength.
pub(crate) fn write(means: Means, directory: &Path, other: &Path, views: Option<u64>) -> Result<(), Box<dyn Error>> {
    let [own_victim, other] = [Victim::read(Sense::Colour, directory)?, Victim::read(Sense::Colour, other)?];
    let stages = own_victim.stages(&Arc::new(Detector::thermal(&Sensors::GROUND.camera)?), None);
    let made_on = View::some(Split::Tuning, 0, MADE_ON)?;
    let judged_on = View::some(Split::HeldOut, 20_000, views.map_or(JUDGED_ON, |views| views as usize))?;
    eprintln!("{} views rendered", made_on.len() + judged_on.len());
    let mut rows = String::new();
    let design = means.design();
    let white = means.strengths().map(|strength| (Knows::Weights, strength));
    for (knows, strength) in
        white.into_iter().chain([Knows::OtherWeights, Knows::Scores, Knows::Nothing].map(|k| (k, design)))
    {
        let shifts = match knows {
            Knows::Nothing => at_random(strength, means.shifts()),
            Knows::Scores => by_scores(means, &own_victim, &made_on[..BATCH], strength)?,
            Knows::OtherWeights => by_weights(means, &other.net, &made_on, strength)?,
            Knows::Weights => by_weights(means, &own_victim.net, &made_on, strength)?,
        };
        let row = row(means, knows, strength, &judge(means, &own_victim, &stages, &judged_on, &shifts)?);
        eprint!("{row}");
        rows += &row;
        if (knows, strength) == (Knows::Weights, design) {
            std::fs::write(directory.join(means.name()).with_extension("txt"), hex(&shifts, means.fields()[1]))?;
        }
    }
    let text = page(means, &own_victim, &other, judged_on.len(), &rows);
    std::fs::write(directory.join(format!("{}s.md", means.name())), &text)?;
    println!("{text}");
    Ok(())
}

/// Downhill to labels that say vehicle, by the mean gradient of some views at each step.
fn by_weights(means: Means, net: &Net, views: &[View], strength: u8) -> Result<Vec<f32>, Box<dyn Error>> {
    let device = Device::default().autodiff();
    let mut rng = ChaCha8Rng::seed_from_u64(u64::from(strength));
    let bound = f32::from(strength);
    let mut descent = Descent::new(vec![0.0; means.shifts()], -bound, bound);
    for step in 0..STEPS {
        let some: Vec<&View> = (0..BATCH).map(|_| &views[rng.next_u32() as usize % views.len()]).collect();
        let planes = some.iter().flat_map(|view| means.planes(view, &descent.values)).collect();
        let targets = some.iter().map(|view| target(&claimed(view), false)).collect();
        let gradients = gradient(net, planes, targets, &device)?;
        let mut sum = vec![0.0; means.shifts()];
        some.iter().zip(gradients.chunks_exact(FRAME)).for_each(|(view, of)| means.back(view, of, &mut sum));
        descent.step(&sum, 1.0 - step as f32 / STEPS as f32);
    }
    Ok(descent.values)
}

/// Labels that the view would have if its decoys were vehicles.
pub(crate) fn claimed(view: &View) -> Example {
    let (mut labels, ignored): (Vec<_>, Vec<_>) = view.plain.frame.labels.iter().copied().partition(counts);
    labels.iter_mut().filter(|label| label.class == Class::Decoy).for_each(|label| label.class = Class::Vehicle);
    Example { image: Vec::new(), labels, ignored }
}

/// Rectangles of fields at one end of the bound or the other, kept if the scores say that it helps.
fn by_scores(means: Means, target: &Victim, views: &[View], strength: u8) -> Result<Vec<f32>, Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(u64::from(strength));
    let mut best = at_random(strength, means.shifts());
    let [all_rows, all_columns] = means.fields();
    let mut most = f32::MIN;
    for query in 0..QUERIES {
        let mut shifts = best.clone();
        // Ever smaller: half of all at first, a field at the end.
        let side = |of: usize| (of as f32 * 0.7 * (1.0 - query as f32 / QUERIES as f32)) as usize + 1;
        let (rows, columns) = (side(all_rows), side(all_columns));
        let (top, left) =
            (uniform_below(&mut rng, all_rows - rows + 1), uniform_below(&mut rng, all_columns - columns + 1));
        let end: [f32; 3] = core::array::from_fn(|_| if rng.next_u32() & 1 == 0 { -1.0 } else { 1.0 });
        for (row, column) in (top..top + rows).flat_map(|row| (left..left + columns).map(move |column| (row, column))) {
            let index = 3 * (row * all_columns + column);
            (0..3).for_each(|c| shifts[index + c] = end[c] * f32::from(strength));
        }
        let mut score = 0.0;
        for view in views {
            score += margin(means, target, view, &shifts)?;
        }
        if score > most {
            (most, best) = (score, shifts);
        }
    }
    Ok(best)
}

/// Margin of the best vehicle where the decoy is over the best decoy, permille.
fn margin(means: Means, target: &Victim, view: &View, shifts: &[f32]) -> Result<f32, Box<dyn Error>> {
    let planes = means.planes(view, shifts);
    let byte = |k: usize| libm::roundf(planes[(k % 3) * HEIGHT * WIDTH + k / 3] * 255.0) as u8;
    let rgb: Vec<u8> = (0..FRAME).map(byte).collect();
    let found = target.detector.detect(&rgb, LEAST)?;
    let best = |class| {
        let detections = found.iter().filter(|d| d.class == class && d.bounds.shared(&view.label.bounds) >= 0.5);
        detections.map(|d| f32::from(d.score)).fold(0.0, f32::max)
    };
    Ok(best(Class::Vehicle) - best(Class::Decoy))
}

pub(crate) fn at_random(strength: u8, shifts: usize) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(u64::from(strength));
    (0..shifts).map(|_| if rng.next_u32() & 1 == 0 { -f32::from(strength) } else { f32::from(strength) }).collect()
}

fn uniform_below(rng: &mut ChaCha8Rng, n: usize) -> usize {
    rng.next_u32() as usize % n
}

fn judge(
    means: Means,
    target: &Victim,
    stages: &Stages,
    views: &[View],
    shifts: &[f32],
) -> Result<Tally, Box<dyn Error>> {
    let limits = CorroborationLimits::default();
    let mut tally = Tally::default();
    for view in views {
        let [cold, heated] = [means.frame(view, shifts, COLD)?, means.frame(view, shifts, HEATED)?];
        let found = target.detector.detect(&cold.frame.rgb, limits.score)?;
        let called = |class| found.iter().any(|d| d.class == class && d.bounds.shared(&view.label.bounds) >= 0.5);
        let stands = |frame: &Frame| stands_near(stages, &limits, frame, view.label.object, Class::Vehicle);
        tally.views += 1;
        tally.decoy += u32::from(called(Class::Decoy));
        tally.vehicle += u32::from(called(Class::Vehicle));
        tally.cold += u32::from(stands(&cold));
        tally.heated += u32::from(stands(&heated));
    }
    Ok(tally)
}

fn row(means: Means, knows: Knows, strength: u8, tally: &Tally) -> String {
    let name = match knows {
        Knows::Nothing => "nothing (random fields)",
        Knows::Scores => "scores of 8 views, 400 looks",
        Knows::OtherWeights => "the other model's weights",
        Knows::Weights => "the weights",
    };
    let mark = if strength == means.design() { " (design)" } else { "" };
    let mut row = format!("| {name} | {strength}{mark} |");
    for k in [tally.decoy, tally.vehicle, tally.cold, tally.heated] {
        let [low, high] = wilson(k, tally.views);
        let percent = 100.0 * f64::from(k) / f64::from(tally.views.max(1));
        // Writing to a String cannot fail.
        let _ = write!(row, " {percent:.1} ({:.1}–{:.1}) |", 100.0 * low, 100.0 * high);
    }
    row + "\n"
}

/// Rows of six hexadecimal digits a field; 80 is no shift.
pub(crate) fn hex(shifts: &[f32], columns: usize) -> String {
    let byte = |shift: &f32| format!("{:02x}", (libm::roundf(*shift) as i32 + 128) as u8);
    shifts.chunks_exact(3 * columns).map(|row| row.iter().map(byte).collect::<String>() + "\n").collect()
}

fn page(means: Means, own_victim: &Victim, other: &Victim, views: usize, rows: &str) -> String {
    let kind = match means {
        Means::Print => "Prints on a decoy",
        Means::Perturbation => "Perturbations of the colour image",
    };
    format!(
        "# {kind}, against the detector `{:.12}`\n\n\
         Written by `trainer {}s`. {}, made on {MADE_ON} \
         views to have it called a vehicle and judged on {views} others. Strength: by how much \
         of 255 a channel is shifted at most. *Called*: by the detector alone. *Stands*: as a vehicle after \
         corroboration in a single frame, with the decoy as cold as the ground or as warm as a vehicle. The other model is \
         `{:.12}`. Strengths, design strength, steps and views were fixed before the first was made. Shares in per cent, \
         with Wilson's intervals, 95 %.\n\n\
         | attacker knows | strength | called decoy | called vehicle | stands, cold | stands, heated |\n|---|---|---|---|---|---|\n{rows}",
        own_victim.sha256,
        means.name(),
        means.title(),
        other.sha256,
    )
}
