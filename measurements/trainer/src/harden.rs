//! Frames made harder on purpose: by prints on their objects, as an attacker who knows the weights would make them.
//!
//! Learning from the inputs that the present weights are worst at is Madry et al.'s (2018) adversarial training. A few steps of
//! signed gradients go uphill from the true labels (hide) or downhill to false ones (impersonate). Mostly the gradient is
//! averaged over the fields of a print that covers each object's box; now and then it is taken pixel by pixel over the whole
//! frame. The lie of a print on the sides of an object, and the light on it, are not known here: that is left to the attacks that
//! the model is judged by.

use burn::tensor::{Device, Tensor, TensorData};
use dataset::draw::uniform;
use ground_truth::print::{COLUMNS, ROWS};
use perception::letterbox::{HEIGHT, WIDTH};
use rand_chacha::ChaCha8Rng;
use sim::Label;
use wire::sensor::Class;

use crate::data::{Example, Target, target};
use crate::net::{Net, loss};
use crate::train::wanted;

/// Steps of descent for each frame.
const STEPS: usize = 2;
/// A change to single pixels is this much weaker than a print at most.
const PIXEL: f32 = 0.08;
/// Shares of a strength by which a field starts at most, and moves at each step.
const FIRST: f32 = 0.5;
const MOVE: f32 = 0.75;

/// Changes the colour in `planes`, which come first in each frame, to inputs that the weights are worse at, by at most `most` of 255. Each
/// is of an example, perhaps mirrored.
pub(crate) fn perturb(
    net: &Net,
    planes: &mut [f32],
    examples: &[(&Example, bool)],
    rng: &mut ChaCha8Rng,
    most: u8,
    device: &Device,
) -> Result<(), Box<dyn std::error::Error>> {
    let clean = planes.to_vec();
    let frame = planes.len() / examples.len().max(1);
    let mut changes: Vec<Change> = examples.iter().map(|(e, mirrored)| Change::new(e, *mirrored, most, rng)).collect();
    for _ in 0..STEPS {
        apply(&changes, &clean, planes, frame);
        let targets = changes.iter().zip(examples).map(|(c, (_, mirrored))| target(&c.wanted, *mirrored)).collect();
        let gradient = gradient(net, planes.to_vec(), targets, device)?;
        changes.iter_mut().zip(gradient.chunks_exact(frame)).for_each(|(change, of)| change.follow(of));
    }
    apply(&changes, &clean, planes, frame);
    Ok(())
}

fn apply(changes: &[Change], clean: &[f32], planes: &mut [f32], frame: usize) {
    for ((change, clean), plane) in changes.iter().zip(clean.chunks_exact(frame)).zip(planes.chunks_exact_mut(frame)) {
        change.apply(clean, plane);
    }
}

/// Gradient of the loss at frames, in their own order.
pub(crate) fn gradient(
    net: &Net,
    planes: Vec<f32>,
    targets: Vec<Target>,
    device: &Device,
) -> Result<Vec<f32>, Box<dyn std::error::Error>> {
    let shape = [targets.len(), planes.len() / (targets.len() * HEIGHT * WIDTH), HEIGHT, WIDTH];
    let input = Tensor::<4>::from_data(TensorData::new(planes, shape), device).require_grad();
    let gradients = loss(net.forward(input.clone()), wanted(targets, device)).backward();
    let gradient = input.grad(&gradients).ok_or("no gradient at the image")?;
    Ok(gradient.into_data().convert::<f32>().iter::<f32>().collect())
}

/// The change to one frame.
struct Change {
    /// Labels to go downhill to, or uphill from.
    wanted: Example,
    downhill: bool,
    strength: f32,
    /// The field that each pixel belongs to, if any.
    field: Vec<Option<usize>>,
    /// Shift of each field and channel.
    shift: Vec<f32>,
}

impl Change {
    fn new(example: &Example, mirrored: bool, most: u8, rng: &mut ChaCha8Rng) -> Self {
        let mut uniform = || uniform(rng);
        let (downhill, prints, share) = (uniform() < 0.5, uniform() < 0.75, uniform());
        let strength = share * f32::from(most) / 255.0 * if prints { 1.0 } else { PIXEL };
        let fields = if prints { printed(&example.labels, mirrored) } else { (0..HEIGHT * WIDTH).map(Some).collect() };
        let count = fields.iter().flatten().max().map_or(0, |most| most + 1);
        let mut labels = example.labels.clone();
        if downhill {
            labels.iter_mut().for_each(|label| label.class = target_class(label.class));
        }
        Change {
            wanted: Example { image: Vec::new(), labels, ignored: example.ignored.clone() },
            downhill,
            strength,
            field: fields,
            shift: (0..3 * count).map(|_| (2.0 * uniform() - 1.0) * FIRST * strength).collect(),
        }
    }

    fn apply(&self, clean: &[f32], plane: &mut [f32]) {
        for (at, field) in self.field.iter().enumerate() {
            let Some(field) = field else { continue };
            for channel in 0..3 {
                let k = channel * HEIGHT * WIDTH + at;
                plane[k] = (clean[k] + self.shift[3 * field + channel]).clamp(0.0, 1.0);
            }
        }
    }

    /// One step by the sign of the gradient's sum over each field.
    fn follow(&mut self, gradient: &[f32]) {
        let mut sums = vec![0.0; self.shift.len()];
        for (at, field) in self.field.iter().enumerate() {
            let Some(field) = field else { continue };
            (0..3).for_each(|channel| sums[3 * field + channel] += gradient[channel * HEIGHT * WIDTH + at]);
        }
        let step = MOVE * self.strength * if self.downhill { -1.0 } else { 1.0 };
        for (shift, sum) in self.shift.iter_mut().zip(sums) {
            let towards = if sum == 0.0 { 0.0 } else { step.copysign(step * sum) };
            *shift = (*shift + towards).clamp(-self.strength, self.strength);
        }
    }
}

/// The fields of a print that covers each object's box, the smallest on top.
fn printed(labels: &[Label], mirrored: bool) -> Vec<Option<usize>> {
    let mut fields = vec![None; HEIGHT * WIDTH];
    let mut order: Vec<&Label> = labels.iter().collect();
    order.sort_by_key(|label| core::cmp::Reverse(label.pixels));
    for (index, label) in order.into_iter().enumerate() {
        let b = label.bounds;
        let [x0, x1, y0, y1] = [b.x0, b.x1, b.y0, b.y1].map(usize::from);
        for (x, y) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y))) {
            let (row, column) = ((y - y0) * ROWS / (y1 - y0), (x - x0) * COLUMNS / (x1 - x0));
            let x = if mirrored { WIDTH - 1 - x } else { x };
            fields[y * WIDTH + x] = Some((index * ROWS + row) * COLUMNS + column);
        }
    }
    fields
}

/// The class that an object is to be taken for.
fn target_class(class: Class) -> Class {
    match class {
        Class::Vehicle => Class::Decoy,
        Class::Decoy | Class::Obstacle => Class::Vehicle,
        Class::Person => Class::Obstacle,
    }
}
