//! Views of one decoy, among what else a scene has: where prints are made, and where they are judged.
//!
//! Scenes are drawn as for measurements, and the decoys in them are all the attacker's: of one size and coat, which it knows. What
//! it makes is judged on other views, rendered anew with the print in the scene.

use dataset::cells::{self, Split};
use dataset::draw;
use dataset::example::{Example, ExampleError, counts};
use perception::grid::{HEIGHT, WIDTH};
use sim::Label;
use sim::print::{COLUMNS, Print, ROWS};
use sim::scene::{Scene, Start};
use wire::sensor::Class;

/// Channels of all fields of a print.
pub(crate) const SHIFTS: usize = 3 * ROWS * COLUMNS;
/// The attacker's decoy: of a vehicle's size, in a coat of its own.
const SIZE: [f32; 3] = [4.2, 1.8, 1.6];
const COAT: [u8; 3] = [60, 80, 150];
/// As warm as the ground, and as warm as a vehicle, kelvin.
pub(crate) const COLD: f32 = 288.0;
pub(crate) const HEATED: f32 = 318.0;

/// A scene from one place, in which a decoy can be made out.
pub(crate) struct View {
    scene: Scene,
    start: Start,
    noise: u64,
    /// With a print that changes nothing.
    pub(crate) plain: Example,
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
            let plain = frame(&scene, start, k, &[0.0; SHIFTS], COLD)?;
            let decoy = plain.frame.labels.iter().find(|label| label.class == Class::Decoy && counts(label)).copied();
            views.extend(decoy.map(|label| View { scene, start, noise: k, plain, label }));
        }
        Ok(views)
    }

    /// The frame with this print on the decoys, and these as warm as that.
    pub(crate) fn printed(&self, shifts: &[f32], kelvin: f32) -> Result<Example, ExampleError> {
        frame(&self.scene, self.start, self.noise, shifts, kelvin)
    }

    /// The colour image in 0..1 as it should come out with this print, without rendering it anew.
    pub(crate) fn planes(&self, shifts: &[f32]) -> Vec<f32> {
        let frame = &self.plain.frame;
        let mut planes = vec![0.0; 3 * HEIGHT * WIDTH];
        crate::train::paint(&frame.rgb, false, 1.0, &mut planes);
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

    /// From the gradient at the image to that at the print, added to `sum`.
    pub(crate) fn back(&self, gradient: &[f32], sum: &mut [f32]) {
        for (at, skin) in self.plain.frame.skin.iter().enumerate() {
            let Some(skin) = skin else { continue };
            for channel in 0..3 {
                sum[3 * usize::from(skin.field) + channel] += gradient[channel * HEIGHT * WIDTH + at] * skin.light;
            }
        }
    }
}

fn frame(scene: &Scene, start: Start, noise: u64, shifts: &[f32], kelvin: f32) -> Result<Example, ExampleError> {
    let mut scene = scene.clone();
    for decoy in scene.objects.iter_mut().filter(|object| object.class == Class::Decoy) {
        (decoy.print, decoy.kelvin) = (print(shifts), kelvin);
    }
    Example::of(scene, start, noise)
}

/// As it can be printed: whole steps.
pub(crate) fn print(shifts: &[f32]) -> Option<Print> {
    Print::new(shifts.chunks_exact(3).map(|shift| core::array::from_fn(|c| libm::roundf(shift[c]) as i8)).collect())
}
