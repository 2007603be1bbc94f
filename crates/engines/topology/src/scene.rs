//! Conversion of a scenario's world to the sim's.

use scenario::Scenario;
use sim::fidelity::Fidelity;
use sim::limits::SceneError;
use sim::scene::{Disguise, Ground, Object, Scene, StartPose};
use sim::weather::Weather;
use sim::wind::Wind;

/// The sim's scene, every object shifted by `shift_m`; `start` replaces the platform's own for a teammate, who stays
/// where it is.
pub(super) fn build_scene(scenario: &Scenario, shift_m: (f64, f64), start: Option<&scenario::Pose>) -> Scene {
    let world = scenario.scene();
    let own_pose: &scenario::Pose = &world.start;
    let pose = start.unwrap_or(own_pose);
    let route = if start.is_some() { Vec::new() } else { world.route.iter().map(|p| metres(p)).collect() };
    let start = StartPose {
        east: pose.at_m[0].get() as f32,
        north: pose.at_m[1].get() as f32,
        heading: pose.heading_rad.get() as f32,
    };
    let route = if route.is_empty() { vec![[start.east, start.north]] } else { route };
    Scene {
        start,
        route,
        geofence: world.geofence.iter().map(metres).collect(),
        objects: world.object.iter().map(|o| object(o, shift_m)).collect(),
        ground: Ground {
            seed: u64::from(world.ground.seed),
            amplitude: world.ground.amplitude_m.get() as f32,
            wavelength: world.ground.wavelength_m.get() as f32,
            kelvin: world.ground.temperature_k.get() as f32,
        },
        weather: weather(&world.weather),
        wind: wind(&scenario.wind),
        perturbation: world.perturbation.as_ref().and_then(scenario::Perturbation::pattern),
    }
}

/// Reason that a scenario's scene cannot be run without rendering, if it cannot.
pub fn needs_rendering(scenario: &Scenario) -> Option<SceneError> {
    // An attack on the stacks has no scene.
    scenario.scene.as_ref()?;
    build_scene(scenario, (0.0, 0.0), None).unrendered().err()
}

/// Error of the models.
pub(super) fn fidelity(models: &scenario::Models) -> Fidelity {
    let scenario::Models { noise, load, grip } = models;
    Fidelity { noise: noise.get() as f32, load: load.get() as f32, grip: grip.get() as f32 }
}

/// A point in millimetres, as configurations carry it.
pub(super) fn millimetres(point: [f32; 2]) -> (i32, i32) {
    ((point[0] * 1000.0) as i32, (point[1] * 1000.0) as i32)
}

fn metres(point: &scenario::Point) -> [f32; 2] {
    [point[0].get() as f32, point[1].get() as f32]
}

fn object(object: &scenario::Object, (east, north): (f64, f64)) -> Object {
    let shifted = |p: &scenario::Point| [(p[0].get() + east) as f32, (p[1].get() + north) as f32];
    Object {
        class: object.class,
        size: object.size_m.map(|e| e.get() as f32),
        kelvin: object.temperature_k.get() as f32,
        heated: object.heated_s.as_ref().map(|times| times.map(|time| time.get() as f32)),
        colour: object.colour,
        disguise: Disguise { paint: object.painted_as, warmth: object.warm_as },
        print: object.print.as_ref().and_then(scenario::Print::cut),
        path: object.path_m.iter().map(shifted).collect(),
        heading: object.heading_rad.get() as f32,
        speed: object.speed_m_s.get() as f32,
        departs: object.departs_s.get() as f32,
        closed: object.closed,
        yields: object.yields,
    }
}

fn weather(weather: &scenario::Weather) -> Weather {
    Weather {
        light: weather.light.get() as f32,
        visibility_m: weather.visibility_m.map(|v| v.get() as f32),
        rain_mm_h: weather.rain_mm_h.get() as f32,
        smear_px: weather.smear_px,
    }
}

fn wind(wind: &scenario::Wind) -> Wind {
    Wind {
        east_m_s: wind.east_m_s.get() as f32,
        north_m_s: wind.north_m_s.get() as f32,
        gust_m_s: wind.gust_m_s.get() as f32,
        length_m: wind.length_m.get() as f32,
    }
}

/// Map of a unit: everything that stands still.
pub(super) fn map(world: &Scene) -> Vec<autonomy::MapBox> {
    let objects = world.objects.iter().filter(|o| o.speed == 0.0);
    objects
        .filter_map(|o| {
            let (x_mm, y_mm) = millimetres(*o.path.first()?);
            let [length, width, height] = o.size.map(|edge| (edge * 1000.0) as u32);
            let heading_mrad = (o.heading * 1000.0) as i32;
            Some(autonomy::MapBox { x_mm, y_mm, heading_mrad, half_mm: [length / 2, width / 2], top_mm: height })
        })
        .collect()
}
