//! Views of one decoy, among the other objects of a scene: prints and heat are made on some of them and judged on others.
//!
//! Scenes are drawn as for measurements, and the decoys in them are all the attacker's: of one size and coat, which it knows. Its
//! prints and heat are judged on other views, rendered again with the print in the scene.

use config::platform::Sensors;
use dataset::cells::{self, Split};
use dataset::draw;
use dataset::example::{Example, ExampleError, counts};
use ground_truth::MAX_STRENGTH;
use ground_truth::perturbation::{self, Perturbation};
use ground_truth::print::{COLUMNS, Print, ROWS, STEPS_PER_K};
use perception::bands::{BANDS, bands};
use perception::fused;
use perception::letterbox::{HEIGHT, WIDTH};
use sim::Label;
use sim::scene::{Scene, StartPose};
use wire::sensor::Class;

use crate::train::{FRAME, paint};

/// Fields of a print, and the channels of all of them.
pub(crate) const FIELDS: usize = ROWS * COLUMNS;
pub(crate) const SHIFTS: usize = 3 * FIELDS;
/// The attacker's decoy: of a vehicle's size, in its own coat.
const SIZE: [f32; 3] = [4.2, 1.8, 1.6];
const COAT: [u8; 3] = [60, 80, 150];
/// As warm as the ground, and as warm as a vehicle, kelvin.
pub(crate) const COLD: f32 = 288.0;
pub(crate) const HEATED: f32 = 318.0;

/// Side of an object that a view shows, by thirds of a quarter turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Aspect {
    /// An end, front or rear.
    End,
    /// Between.
    Corner,
    /// A long side.
    Side,
}

/// A scene from one place, in which a decoy can be made out.
pub(crate) struct View {
    scene: Scene,
    start: StartPose,
    noise: u64,
    /// With a print that leaves the coat as it is.
    pub(crate) plain: Example,
    /// The thermal plane with all decoys as cold as the ground.
    cold: Vec<u8>,
    /// The decoy that is judged.
    pub(crate) label: Label,
}

impl View {
    /// The first `count` views of a split from `number` on, in the cells that are learnt from.
    pub(crate) fn some(split: Split, number: u64, count: usize) -> Result<Vec<View>, ExampleError> {
        let learnt: Vec<_> = cells::all()?.iter().filter(|cell| cell.learnt).collect();
        let mut views = Vec::with_capacity(count);
        for k in number.. {
            if views.len() == count {
                break;
            }
            let (mut scene, start) = draw::scene(learnt[k as usize % learnt.len()], split, k)?;
            for decoy in scene.objects.iter_mut().filter(|object| object.class == Class::Decoy) {
                (decoy.size, decoy.colour) = (SIZE, COAT);
            }
            if scene.objects.iter().all(|object| object.class != Class::Decoy) {
                continue;
            }
            let plain = frame(&scene, start, k, print(&[0.0; SHIFTS], &[]), COLD)?;
            let decoy = plain.frame.labels.iter().find(|label| label.class == Class::Decoy && counts(label)).copied();
            let Some(label) = decoy else { continue };
            let cold = frame(&scene, start, k, print(&[0.0; SHIFTS], &[0.0; FIELDS]), COLD)?.frame.thermal;
            views.push(View { scene, start, noise: k, plain, cold, label });
        }
        Ok(views)
    }

    /// The side of the decoy that it shows.
    pub(crate) fn aspect(&self) -> Aspect {
        let object = &self.scene.objects[usize::from(self.label.object.0)];
        let [x, y] = object.path[0];
        let sight = libm::atan2f(y - self.start.north, x - self.start.east);
        match libm::fabsf(libm::sinf(object.heading - sight)) {
            sine if sine < 0.5 => Aspect::End,
            sine if sine < 0.866 => Aspect::Corner,
            _ => Aspect::Side,
        }
    }

    /// The frame with this print on the decoys, and these as warm as that.
    pub(crate) fn printed(&self, shifts: &[f32], kelvin: f32) -> Result<Example, ExampleError> {
        frame(&self.scene, self.start, self.noise, print(shifts, &[]), kelvin)
    }

    /// The frame with this added to its image, the decoys as warm as that.
    pub(crate) fn perturbed(&self, shifts: &[f32], kelvin: f32) -> Result<Example, ExampleError> {
        let mut example = self.printed(&[0.0; SHIFTS], kelvin)?;
        if let Some(pattern) = Perturbation::new(whole(shifts)) {
            pattern.add(MAX_STRENGTH, WIDTH, &mut example.frame.rgb);
        }
        Ok(example)
    }

    /// The frame with this print on the decoys, its fields a given number of kelvin above the ground.
    pub(crate) fn heated(&self, shifts: &[f32], heat: &[f32]) -> Result<Example, ExampleError> {
        frame(&self.scene, self.start, self.noise, print(shifts, heat), COLD)
    }

    /// The colour image in 0..1 as it should come out with this print, without rendering it again.
    pub(crate) fn planes(&self, shifts: &[f32]) -> Vec<f32> {
        let frame = &self.plain.frame;
        let mut planes = vec![0.0; 3 * HEIGHT * WIDTH];
        paint(&frame.rgb, false, 1.0, &mut planes);
        for (at, skin) in frame.skin.iter().enumerate() {
            let Some(skin) = skin else { continue };
            for channel in 0..3 {
                let coat = f32::from(skin.paint[channel]);
                let shift = (coat + shifts[3 * usize::from(skin.field) + channel]).clamp(0.0, 255.0) - coat;
                let plane = &mut planes[channel * HEIGHT * WIDTH + at];
                *plane = (*plane + shift * skin.light / 255.0).clamp(0.0, 1.0);
            }
        }
        planes
    }

    /// The colour image in 0..1 with this added to it.
    pub(crate) fn planes_perturbed(&self, shifts: &[f32]) -> Vec<f32> {
        let mut planes = vec![0.0; FRAME];
        paint(&self.plain.frame.rgb, false, 1.0, &mut planes);
        for (k, value) in planes.iter_mut().enumerate() {
            *value = (*value + shifts[shift_at(k)] / 255.0).clamp(0.0, 1.0);
        }
        planes
    }

    /// Gradient from the gradient at the image to that at the shifts added to it, added to `sum`.
    pub(crate) fn back_perturbed(gradient: &[f32], sum: &mut [f32]) {
        gradient.iter().enumerate().for_each(|(k, of)| sum[shift_at(k)] += of);
    }

    /// Input of the thermal network with the view's decoys a given number of kelvin above the ground, field by field, without rendering it
    /// again.
    pub(crate) fn felt(&self, heat: &[f32]) -> Vec<f32> {
        let skins = self.plain.frame.skin.iter();
        let warmer = skins.zip(self.cold.chunks_exact(2)).flat_map(|(skin, cold)| {
            let above = skin.map_or(0.0, |skin| heat[usize::from(skin.field)] * skin.heat * 100.0);
            ((f32::from(u16::from_le_bytes([cold[0], cold[1]])) + above) as u16).to_le_bytes()
        });
        felt(&warmer.collect::<Vec<u8>>())
    }

    /// Input of the fused network with this print and this heat, without rendering it again.
    pub(crate) fn sensed(&self, shifts: &[f32], heat: &[f32]) -> Vec<f32> {
        let image = fused::image(&self.plain.frames()).unwrap_or_default();
        let near = image.chunks_exact(fused::PLANES).map(|pixel| f32::from(pixel[6]) / 255.0);
        self.planes(shifts).into_iter().chain(self.felt(heat)).chain(near).collect()
    }

    /// Gradient at the heat from the gradient at the input of the thermal network to that at the heat, a kelvin, added to `sum`.
    /// A band that is at its end does not change.
    pub(crate) fn back_warm(&self, gradient: &[f32], seen: &[f32], sum: &mut [f32]) {
        for (at, skin) in self.plain.frame.skin.iter().enumerate() {
            let Some(skin) = skin else { continue };
            for (band, (low, high)) in BANDS.into_iter().enumerate() {
                let k = band * HEIGHT * WIDTH + at;
                let changes = seen[k] > 0.0 && seen[k] < 1.0;
                let share = if changes { 100.0 * skin.heat / (high - low) as f32 } else { 0.0 };
                sum[usize::from(skin.field)] += gradient[k] * share;
            }
        }
    }

    /// Gradient at the print from that at the image, added to `sum`.
    pub(crate) fn back(&self, gradient: &[f32], sum: &mut [f32]) {
        for (at, skin) in self.plain.frame.skin.iter().enumerate() {
            let Some(skin) = skin else { continue };
            for channel in 0..3 {
                sum[3 * usize::from(skin.field) + channel] += gradient[channel * HEIGHT * WIDTH + at] * skin.light;
            }
        }
    }
}

/// The shift that a value of the planes takes: their channel, and the field that their pixel lies in.
fn shift_at(k: usize) -> usize {
    3 * perturbation::field(k % (HEIGHT * WIDTH), WIDTH, HEIGHT) + k / (HEIGHT * WIDTH)
}

/// Input of the thermal network from a plane, as planes in 0..1.
fn felt(plane: &[u8]) -> Vec<f32> {
    let mut planes = vec![0.0; FRAME];
    let bands = bands(plane, WIDTH as u16, HEIGHT as u16).unwrap_or_default();
    paint(&bands, false, 1.0, &mut planes);
    planes
}

fn frame(
    scene: &Scene,
    start: StartPose,
    noise: u64,
    print: Option<Print>,
    kelvin: f32,
) -> Result<Example, ExampleError> {
    let mut scene = scene.clone();
    for decoy in scene.objects.iter_mut().filter(|object| object.class == Class::Decoy) {
        (decoy.print, decoy.kelvin) = (print.clone(), kelvin);
    }
    Example::from_scene(&Sensors::GROUND, scene, start, noise)
}

/// As it can be printed: whole steps. Without `heat` its object is as warm as it is.
pub(crate) fn print(shifts: &[f32], heat: &[f32]) -> Option<Print> {
    let print = Print::new(whole(shifts))?;
    if heat.is_empty() { Some(print) } else { print.heated(steps(heat)) }
}

/// Shifts of red, green and blue in whole steps.
fn whole(shifts: &[f32]) -> Vec<[i8; 3]> {
    shifts.chunks_exact(3).map(|shift| core::array::from_fn(|c| libm::roundf(shift[c]) as i8)).collect()
}

/// Kelvin as a print's fields can be heated.
pub(crate) fn steps(heat: &[f32]) -> Vec<u8> {
    heat.iter().map(|kelvin| libm::roundf(kelvin * STEPS_PER_K) as u8).collect()
}
