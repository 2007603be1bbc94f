//! Conversion of a scenario's attack tables to the adversary's plans, the sim's faults, and the injections that need a
//! receipt.

mod needs;
pub(super) mod planned;

use adversary::plan::{
    ClaimedMotion, DatagramAction, DatagramRelayConfig, Direction, InsiderBrokerConfig, InsiderGatewayConfig,
    InsiderTeammateConfig, Medium, StreamRelayConfig, Tampering, Timed,
};
use evidence::cue::{Cue, Watched};
use ground_truth::{FaultKind, StepName};
use scenario::{Act, Deceit, Magnitude, Scenario, ThirdUnit, Trigger, Windowed};
use sim::fault::{Disturbance, Fault};

/// Acts of all attacks, kind by kind.
pub(super) fn acts(s: &Scenario, phase: u64) -> impl Iterator<Item = Act> {
    s.attacks().into_iter().filter_map(move |attack| attack.act(phase))
}

/// Steps that wait for an event on the instrument plane, each with its event.
pub(super) fn cues(s: &Scenario, phase_ms: u64) -> Vec<Cue> {
    let cue = |windowed: &dyn Windowed| {
        let on = match windowed.timing().when?.trigger()? {
            Trigger::Enters { mode: to, from, nth } => Watched::Enters { to, from, nth },
            Trigger::Begun(name) => Watched::Step { step: StepName::new(name.as_str())?, begun: true },
            Trigger::Ended(name) => Watched::Step { step: StepName::new(name.as_str())?, begun: false },
            // The step's own actor sees these on its link: no cue is needed.
            Trigger::Passes(_) | Trigger::Silence(_) | Trigger::Hears(_) => return None,
        };
        Some(Cue { step: windowed.step_name()?, on, from: windowed.start_ms(phase_ms) * 1000 })
    };
    s.windows().into_iter().filter_map(cue).collect()
}

/// The plan of the relay on the telemetry path.
pub(super) fn datagrams(s: &Scenario, phase: u64, medium: Medium) -> DatagramRelayConfig {
    let planned = acts(s, phase).filter_map(|act| if let Act::Datagram(action) = act { Some(action) } else { None });
    DatagramRelayConfig { actions: planned.chain(conditions(s)).collect(), medium }
}

/// The plan of the relay on the command path.
pub(super) fn stream(s: &Scenario, phase: u64, medium: Medium) -> StreamRelayConfig {
    let planned = acts(s, phase).filter_map(|act| if let Act::Stream(action) = act { Some(action) } else { None });
    StreamRelayConfig { actions: planned.collect(), medium }
}

/// The plan of the hostile broker, when the scenario has one.
pub(super) fn broker(s: &Scenario, phase: u64) -> Option<InsiderBrokerConfig> {
    let planned = acts(s, phase).filter_map(|act| if let Act::Broker(action) = act { Some(action) } else { None });
    Some(InsiderBrokerConfig { actions: planned.collect() }).filter(|config| !config.actions.is_empty())
}

/// The plan of the gateway insider, when the scenario has one.
pub(super) fn gateway(s: &Scenario, phase: u64) -> Option<InsiderGatewayConfig> {
    let planned = acts(s, phase).filter_map(|act| if let Act::Feed(action) = act { Some(action) } else { None });
    Some(InsiderGatewayConfig { actions: planned.collect() }).filter(|config| !config.actions.is_empty())
}

/// Manipulation of the recorder's insider: one of the scenario's, in turn by the seed, at a place that the seed draws.
pub(super) fn tampering(s: &Scenario, seed: u64) -> Option<(Tampering, u64)> {
    let at = (seed % s.tamper.len().max(1) as u64) as usize;
    Some((s.tamper.get(at)?.does, seed))
}

/// The link's own weather, carried out by the same relay; `planned` does not know it.
pub(super) fn conditions(s: &Scenario) -> impl Iterator<Item = Timed<DatagramAction>> {
    let duration_ms = (s.duration_s.get() * 1000.0) as u64;
    let all_along = move |action| Timed { start_ms: 0, duration_ms, direction: Direction::Both, step: None, action };
    let loss = Some(s.conditions.loss.permille()).filter(|p| *p > 0);
    let jitter = Some(s.conditions.jitter_ms.unsigned()).filter(|ms| *ms > 0);
    let loss = loss.map(|permille| all_along(DatagramAction::Loss { permille }));
    loss.into_iter().chain(jitter.map(|ms| all_along(DatagramAction::Jitter { ms })))
}

/// The plan of the insider who holds unit B's credentials, when the scenario has one.
pub(super) fn teammate(s: &Scenario, phase: u64) -> Option<InsiderTeammateConfig> {
    let unit = s.unit.iter().find(|u| u.role == scenario::Role::Insider)?;
    let [x, y] = unit.start.at_m;
    let place =
        ClaimedMotion { x_mm: (x.get() * 1000.0) as i32, y_mm: (y.get() * 1000.0) as i32, vx_mm_s: 0, vy_mm_s: 0 };
    let mut config = InsiderTeammateConfig { place, ..InsiderTeammateConfig::default() };
    for act in acts(s, phase) {
        let Act::Teammate(deceit) = act else { continue };
        match deceit {
            Deceit::Forward(forward) => config.forwards.push(forward),
            Deceit::Malformed(records) => config.malformed.push(records),
            Deceit::Resend(resend) => config.resend = Some(resend),
            Deceit::Falsehood(falsehood) => config.falsehoods.push(falsehood),
            Deceit::Confusion(confusion) => config.confusions.push(confusion),
        }
    }
    Some(config)
}

/// True if unit C reports through the insider only.
pub(super) fn third_is_silent(s: &Scenario) -> bool {
    s.teammate.iter().any(|t| t.c == ThirdUnit::Silent)
}

/// The sim's faults.
pub(super) fn faults(s: &Scenario, phase: u64) -> Vec<Fault> {
    let fault = |f: &scenario::Fault| Fault {
        sensor: f.sensor,
        disturbance: disturbance(f.kind, f.magnitude.as_deref()),
        start_ms: f.start_ms(phase),
        duration_ms: f.length_ms(),
        step: f.step_name(),
        waits_ms: f.when.as_ref().map(|trigger| trigger.after_ms.unsigned()),
    };
    s.fault.iter().map(fault).collect()
}

fn disturbance(kind: FaultKind, magnitude: Option<&Magnitude>) -> Disturbance {
    let number = |i: usize| magnitude.and_then(|m| m.get(i)).map_or(0.0, |n| n.get());
    let mm = |i: usize| (number(i) * 1000.0) as i32;
    match kind {
        FaultKind::Dropout => Disturbance::Dropout,
        FaultKind::Freeze => Disturbance::Freeze,
        FaultKind::Skew => Disturbance::Skew { frames: number(0) as u8 },
        FaultKind::Chaff => Disturbance::Chaff { count: number(0) as u8 },
        FaultKind::Perturbation => Disturbance::Perturbation { strength: number(0) as u8 },
        FaultKind::Noise => Disturbance::Noise { factor: number(0) as u16 },
        FaultKind::Occlusion => Disturbance::Occlusion { permille: (number(0) * 1000.0) as u16 },
        FaultKind::Drift => Disturbance::Drift { east_mm_s: mm(0), north_mm_s: mm(1) },
        FaultKind::Jump => Disturbance::Jump { east_mm: mm(0), north_mm: mm(1) },
        FaultKind::TimeStep => Disturbance::TimeStep { us: (number(0) * 1e6) as i64 },
        // A millisecond a second is a thousand parts per million.
        FaultKind::TimeDrift => Disturbance::TimeDrift { ppm: mm(0) },
        FaultKind::Scale => Disturbance::Scale { permille: mm(0) as u16 },
        FaultKind::Wander => Disturbance::Wander { deviation_mm: mm(0) as u32 },
    }
}

/// True if there is an injection that needs a receipt.
pub fn is_attacked(s: &Scenario) -> bool {
    !planned::plans(s, 0).is_empty()
}
