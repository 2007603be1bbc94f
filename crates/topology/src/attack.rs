//! From a scenario's attack tables to the adversary's plans, the sim's faults, and the injections that need a receipt.

pub(super) mod broker;
pub(super) mod gateway;
mod needs;
pub(super) mod planned;

use adversary::plan::{
    Content, Damage, DatagramAction, DatagramRelayConfig, Direction, Flaw, Form, Forward, InsiderTeammateConfig,
    Malformed, On, Place, Step, StreamAction, StreamRelayConfig, Tampering, Timed, Wait,
};
use evidence::cue::{Cue, Watched};
use scenario::{Forwarding, Magnitude, Scenario, ThirdUnit, Trigger, Windowed};
use sim::fault::{Disturbance, Fault};
use wire::event::Sensor;
use wire::step::StepName;

use super::script::mode;
use super::start::{start_ms, step_name};

fn timed<A>(of: &dyn Windowed, direction: scenario::Direction, phase_ms: u64, action: A) -> Timed<A> {
    Timed {
        start_ms: start_ms(of, phase_ms),
        duration_ms: (of.duration_s().get() * 1000.0) as u64,
        direction: match direction {
            scenario::Direction::Up => Direction::Up,
            scenario::Direction::Down => Direction::Down,
            scenario::Direction::Both => Direction::Both,
        },
        step: step(of),
        action,
    }
}

/// The step that a table is a part of, as its actor is told of it.
pub(super) fn step(of: &dyn Windowed) -> Option<Step> {
    let wait = of.timing().when.and_then(|when| {
        let on = match when.trigger()? {
            Trigger::Enters { .. } | Trigger::Begun(_) | Trigger::Ended(_) => On::Cue,
            Trigger::Passes(count) => On::Passes(count),
            Trigger::Silence(ms) => On::Silence(ms),
            Trigger::Hears(state) => On::Hears(mode(state)),
        };
        Some(Wait { on, after_ms: when.after_ms.unsigned() })
    });
    Some(Step { name: step_name(of)?, wait })
}

/// Events for which the instrument plane is watched, and the step then called.
pub(super) fn cues(s: &Scenario, phase_ms: u64) -> Vec<Cue> {
    let cue = |of: &dyn Windowed| {
        let on = match of.timing().when?.trigger()? {
            Trigger::Enters { mode: to, from, nth } => Watched::Enters { to: mode(to), from: from.map(mode), nth },
            Trigger::Begun(name) => Watched::Step { step: StepName::new(name.as_str())?, begun: true },
            Trigger::Ended(name) => Watched::Step { step: StepName::new(name.as_str())?, begun: false },
            // Its actor sees it by itself.
            Trigger::Passes(_) | Trigger::Silence(_) | Trigger::Hears(_) => return None,
        };
        Some(Cue { step: step_name(of)?, on, from: start_ms(of, phase_ms) * 1000 })
    };
    s.windows().into_iter().filter_map(cue).collect()
}

fn permille(share: scenario::Share) -> u16 {
    (share.get() * 1000.0) as u16
}

/// The plan of the relay on the telemetry path.
pub(super) fn datagrams(s: &Scenario, phase: u64) -> DatagramRelayConfig {
    let mut actions = Vec::new();
    let mut add = |of: &dyn Windowed, direction, action| actions.push(timed(of, direction, phase, action));
    for a in s.delay.iter() {
        let growth_us_per_s = (a.growth_ms_per_s.get() * 1000.0) as u64;
        add(a, a.direction, DatagramAction::Delay { ms: a.by_ms.unsigned(), growth_us_per_s });
    }
    for a in s.jitter.iter() {
        add(a, a.direction, DatagramAction::Jitter { ms: a.up_to_ms.unsigned() });
    }
    for a in s.loss.iter() {
        add(a, a.direction, DatagramAction::Loss { permille: permille(a.share) });
    }
    for a in s.burst_loss.iter() {
        let action = DatagramAction::BurstLoss {
            enter_permille: permille(a.enter),
            leave_permille: permille(a.leave),
            loss_permille: permille(a.share),
        };
        add(a, a.direction, action);
    }
    for a in s.duplicate.iter() {
        let (copies, every_ms) = (a.copies.unsigned() as u32, a.every_ms.unsigned());
        add(a, a.direction, DatagramAction::Duplicate { copies, every_ms, permille: 1000 });
    }
    for a in s.reorder.iter() {
        let action = DatagramAction::Reorder { permille: permille(a.share), hold_ms: a.hold_ms.unsigned() };
        add(a, a.direction, action);
    }
    for a in s.replay.iter() {
        let (lag_ms, count) = (a.lag_ms.unsigned(), a.count.unsigned() as u32);
        add(a, a.direction, DatagramAction::Replay { lag_ms, count, every_ms: a.every_ms.unsigned() });
    }
    for a in s.corrupt.iter() {
        let action = DatagramAction::Corrupt { permille: permille(a.share), damage: damage(a.damage) };
        add(a, a.direction, action);
    }
    for a in s.reoriginate.iter() {
        let (count, every_ms) = (a.count.unsigned() as u32, a.every_ms.unsigned());
        add(a, a.direction, DatagramAction::Reoriginate { count, every_ms });
    }
    for a in s.inject.iter() {
        let (count, every_ms) = (a.count.unsigned() as u32, a.every_ms.unsigned());
        add(a, a.direction, DatagramAction::Inject { content: content(a.content), count, every_ms });
    }
    actions.extend(conditions(s));
    DatagramRelayConfig { actions }
}

/// Manipulation of the recorder's insider: one of the scenario's, in turn by the seed, at a place that the seed draws.
pub(super) fn tampering(s: &Scenario, seed: u64) -> Option<(Tampering, u64)> {
    let at = (seed % s.tamper.len().max(1) as u64) as usize;
    let does = match s.tamper.get(at)?.does {
        scenario::Tampered::Edit => Tampering::Edit,
        scenario::Tampered::Swap => Tampering::Swap,
        scenario::Tampered::Delete => Tampering::Delete,
        scenario::Tampered::Truncate => Tampering::Truncate,
        scenario::Tampered::Omit => Tampering::Omit,
        scenario::Tampered::Rechain => Tampering::Rechain,
        scenario::Tampered::CutAtSeal => Tampering::CutAtSeal,
        scenario::Tampered::Feign => Tampering::Feign,
        scenario::Tampered::Retime => Tampering::Retime,
    };
    Some((does, seed))
}

/// The link's own weather, carried out by the same relay; `planned` does not know it.
pub(super) fn conditions(s: &Scenario) -> impl Iterator<Item = Timed<DatagramAction>> {
    let duration_ms = (s.duration_s.get() * 1000.0) as u64;
    let all_along = move |action| Timed { start_ms: 0, duration_ms, direction: Direction::Both, step: None, action };
    let loss = Some(permille(*s.conditions.loss)).filter(|p| *p > 0);
    let jitter = Some(s.conditions.jitter_ms.unsigned()).filter(|ms| *ms > 0);
    let loss = loss.map(|permille| all_along(DatagramAction::Loss { permille }));
    loss.into_iter().chain(jitter.map(|ms| all_along(DatagramAction::Jitter { ms })))
}

fn damage(damage: scenario::Damage) -> Damage {
    match damage {
        scenario::Damage::Flip => Damage::Flip,
        scenario::Damage::Truncate => Damage::Truncate,
        scenario::Damage::Extend => Damage::Extend,
        scenario::Damage::Splice => Damage::Splice,
    }
}

fn content(content: scenario::Content) -> Content {
    match content {
        scenario::Content::Alert => Content::PlaintextAlert,
        scenario::Content::CloseNotify => Content::CloseNotify,
        scenario::Content::PlainData => Content::AppData,
        scenario::Content::Garbage => Content::Garbage,
        scenario::Content::Noise => Content::Noise,
        scenario::Content::SilentHello => Content::ClientHello,
        scenario::Content::MalformedHello => Content::ClientHelloTruncated,
    }
}

/// The plan of the relay on the command path.
pub(super) fn stream(s: &Scenario, phase: u64) -> StreamRelayConfig {
    let mut actions = Vec::new();
    let mut add = |of: &dyn Windowed, direction, action| actions.push(timed(of, direction, phase, action));
    s.stream_delay.iter().for_each(|a| add(a, a.direction, StreamAction::Delay { ms: a.by_ms.unsigned() }));
    s.stall.iter().for_each(|a| add(a, a.direction, StreamAction::Stall));
    for a in s.throttle.iter() {
        add(a, a.direction, StreamAction::Throttle { bytes_per_s: a.bytes_per_s.unsigned() });
    }
    s.half_close.iter().for_each(|a| add(a, a.direction, StreamAction::HalfClose));
    s.reset.iter().for_each(|a| add(a, a.direction, StreamAction::Reset));
    s.cut.iter().for_each(|a| add(a, a.direction, StreamAction::Cut));
    for a in s.stream_corrupt.iter() {
        add(a, a.direction, StreamAction::Corrupt { permille: permille(a.share) });
    }
    StreamRelayConfig { actions }
}

/// The plan of the insider who holds unit B's credentials, when the scenario has one.
pub(super) fn teammate(s: &Scenario, phase: u64) -> Option<InsiderTeammateConfig> {
    let unit = s.unit.iter().find(|u| u.role == scenario::Role::Insider)?;
    let [x, y] = unit.start.at_m;
    let place = Place { x_mm: (x.get() * 1000.0) as i32, y_mm: (y.get() * 1000.0) as i32, vx_mm_s: 0, vy_mm_s: 0 };
    let forwards = s.teammate.iter().map(|t| Forward {
        form: match t.form {
            Forwarding::Verbatim => Form::Verbatim,
            Forwarding::Relabelled => Form::Relabelled,
            Forwarding::ReSigned => Form::ReSigned,
        },
        at_ms: start_ms(t, phase),
        duration_ms: (t.duration_s.get() * 1000.0) as u64,
        lag_ms: t.lag_ms.unsigned(),
        own_reports: t.form == Forwarding::Verbatim,
        step: step(t),
    });
    let malformed = s.malformed.iter().map(|m| Malformed {
        at_ms: start_ms(m, phase),
        flaws: m.flaws.iter().copied().map(flaw).collect(),
        count: m.count.unsigned() as u32,
        every_ms: m.every_ms.unsigned(),
        step: step(m),
    });
    let mut config = InsiderTeammateConfig {
        place,
        forwards: forwards.collect(),
        malformed: malformed.collect(),
        ..InsiderTeammateConfig::default()
    };
    super::peer::plan(s, phase, &mut config);
    Some(config)
}

fn flaw(flaw: scenario::Flaw) -> Flaw {
    match flaw {
        scenario::Flaw::Length => Flaw::Length,
        scenario::Flaw::Schema => Flaw::Schema,
        scenario::Flaw::NonCanonical => Flaw::NonCanonical,
        scenario::Flaw::Range => Flaw::Range,
        scenario::Flaw::Count => Flaw::Count,
        scenario::Flaw::Noise => Flaw::Noise,
        scenario::Flaw::Session => Flaw::Session,
        scenario::Flaw::Version => Flaw::Version,
        scenario::Flaw::Jump => Flaw::Jump,
        scenario::Flaw::Origin => Flaw::Origin,
    }
}

/// True if unit C reports through the insider only.
pub(super) fn third_is_silent(s: &Scenario) -> bool {
    s.teammate.iter().any(|t| t.c == ThirdUnit::Silent)
}

/// The sim's faults.
pub(super) fn faults(s: &Scenario, phase: u64) -> Vec<Fault> {
    let fault = |f: &scenario::Fault| Fault {
        sensor: sensor(f.sensor),
        disturbance: disturbance(f.kind, f.magnitude.as_deref()),
        start_ms: start_ms(f, phase),
        duration_ms: (f.duration_s.get() * 1000.0) as u64,
        step: step_name(f),
        waits_ms: f.when.as_ref().map(|when| when.after_ms.unsigned()),
    };
    s.fault.iter().map(fault).collect()
}

fn sensor(sensor: scenario::Sensor) -> Sensor {
    match sensor {
        scenario::Sensor::Rgb => Sensor::Rgb,
        scenario::Sensor::Depth => Sensor::Depth,
        scenario::Sensor::Thermal => Sensor::Thermal,
        scenario::Sensor::Lidar => Sensor::Lidar,
        scenario::Sensor::Odometry => Sensor::Odometry,
        scenario::Sensor::Localisation => Sensor::Localisation,
    }
}

fn disturbance(kind: scenario::FaultKind, magnitude: Option<&Magnitude>) -> Disturbance {
    let number = |i: usize| magnitude.and_then(|m| m.get(i)).map_or(0.0, |n| n.get());
    let mm = |i: usize| (number(i) * 1000.0) as i32;
    match kind {
        scenario::FaultKind::Dropout => Disturbance::Dropout,
        scenario::FaultKind::Freeze => Disturbance::Freeze,
        scenario::FaultKind::Skew => Disturbance::Skew { frames: number(0) as u8 },
        scenario::FaultKind::Chaff => Disturbance::Chaff { count: number(0) as u8 },
        scenario::FaultKind::Perturbation => Disturbance::Perturbation { strength: number(0) as u8 },
        scenario::FaultKind::Noise => Disturbance::Noise { factor: number(0) as u16 },
        scenario::FaultKind::Occlusion => Disturbance::Occlusion { permille: (number(0) * 1000.0) as u16 },
        scenario::FaultKind::Drift => Disturbance::Drift { east_mm_s: mm(0), north_mm_s: mm(1) },
        scenario::FaultKind::Jump => Disturbance::Jump { east_mm: mm(0), north_mm: mm(1) },
        scenario::FaultKind::TimeStep => Disturbance::TimeStep { us: (number(0) * 1e6) as i64 },
        // A millisecond a second is a thousand parts per million.
        scenario::FaultKind::TimeDrift => Disturbance::TimeDrift { ppm: mm(0) },
    }
}

/// True if there is an injection that needs a receipt.
pub fn is_attacked(s: &Scenario) -> bool {
    !planned::of(s, 0).is_empty()
}
