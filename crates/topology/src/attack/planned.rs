//! Injections for which the oracle has to find receipts: one plan for each table, with the window in which it is carried out.

use evidence::{Micros, Plan, Planned, Takes};
use scenario::{Direction, Order, OrderForgery, Scenario, Way, Windowed};
use wire::event::{Action, FaultKind};
use wire::id::{NodeId, ObjectId, PeerId};
use wire::stream::StreamEffect;

use super::{needs, sensor};
use crate::start::{start_ms, step_name};
use crate::{process, scene};

/// Everything planned of a scenario; the steps last, each once.
pub(crate) fn of(s: &Scenario, phase: u64) -> Vec<Plan> {
    let mut all = Planner { phase, plans: Vec::new() };
    all.datagrams(s);
    all.streams(s);
    all.broker(s);
    all.gateway(s);
    all.insiders(s);
    s.fault.iter().for_each(|f| all.add(f, 0, fault(s, f)));
    s.kill.iter().for_each(|k| all.add(k, 0, process::planned(k)));
    all.plans.extend(disguises(s));
    let mut steps: Vec<_> = s.windows().into_iter().filter_map(step_name).collect();
    steps.sort_unstable();
    steps.dedup();
    all.plans.extend(steps.into_iter().map(|step| Plan::from(Planned::Step(step))));
    all.plans
}

/// A perturbation has an aim, which its scene tells; any other fault is of a sensor alone.
fn fault(s: &Scenario, fault: &scenario::Fault) -> Planned {
    let aim = s.scene.as_ref().and_then(|scene| scene.perturbation.as_ref()).map(|p| scene::class(p.aims_at));
    match (kind(fault.kind), aim) {
        (FaultKind::Perturbation, Some(aim)) => Planned::Perturbation(aim),
        (kind, _) => Planned::Fault(sensor(fault.sensor), kind),
    }
}

/// Objects that bear another's paint, or a print, stand there from the start.
fn disguises(s: &Scenario) -> impl Iterator<Item = Plan> {
    // What runs on the stacks has no scene.
    let objects = s.scene.iter().flat_map(|scene| scene.object.iter().enumerate());
    objects.flat_map(|(index, object)| {
        let id = ObjectId(index as u16);
        let paint = object.painted_as.filter(|paint| *paint != object.class);
        let paint = paint.map(|class| Planned::Disguise(id, scene::class(class)));
        let print = object.print.as_ref().map(|print| Planned::Print(id, scene::class(print.aims_at)));
        paint.into_iter().chain(print).map(Plan::from)
    })
}

struct Planner {
    phase: u64,
    plans: Vec<Plan>,
}

impl Planner {
    /// A table's plan: from its start for its length, and `more_ms` beyond for an effect that ends later by itself.
    fn add(&mut self, of: &dyn Windowed, more_ms: u64, what: Planned) {
        let from = start_ms(of, self.phase) * 1000;
        let length = (of.duration_s().get() * 1e6) as Micros;
        let needs = needs::of(what);
        self.plans.push(Plan { what, from, until: from + length + more_ms * 1000, step: step_name(of), needs });
    }

    /// The same for an injection that takes hold only of this.
    fn taking(&mut self, of: &dyn Windowed, more_ms: u64, what: Planned, takes: Takes) {
        self.add(of, more_ms, what);
        if let Some(plan) = self.plans.last_mut() {
            plan.needs.takes = Some(takes);
        }
    }

    fn datagrams(&mut self, s: &Scenario) {
        let action = Planned::Action;
        let records = |direction| Takes::Records(needs::side(direction));
        s.delay.iter().for_each(|a| self.taking(a, 0, action(Action::Delay), records(a.direction)));
        s.jitter.iter().for_each(|a| self.taking(a, 0, action(Action::Delay), records(a.direction)));
        s.loss.iter().for_each(|a| self.taking(a, 0, action(Action::Drop), records(a.direction)));
        s.burst_loss.iter().for_each(|a| self.taking(a, 0, action(Action::Drop), records(a.direction)));
        for a in s.duplicate.iter() {
            let more_ms = a.copies.unsigned() * a.every_ms.unsigned();
            self.taking(a, more_ms, action(Action::Duplicate), records(a.direction));
        }
        s.reorder.iter().for_each(|a| self.taking(a, 0, action(Action::Reorder), records(a.direction)));
        s.replay.iter().for_each(|a| self.taking(a, 0, action(Action::Replay), records(a.direction)));
        s.corrupt.iter().for_each(|a| self.taking(a, 0, action(Action::Corrupt), records(a.direction)));
        s.reoriginate.iter().for_each(|a| self.taking(a, 0, action(Action::Reoriginate), records(Direction::Up)));
        s.inject.iter().for_each(|a| self.add(a, 0, action(Action::Inject)));
    }

    fn streams(&mut self, s: &Scenario) {
        let deed = Planned::Stream;
        s.stream_delay.iter().for_each(|a| self.taking(a, 0, deed(StreamEffect::Held), Takes::Pieces));
        s.stall.iter().for_each(|a| self.taking(a, 0, deed(StreamEffect::Held), Takes::Pieces));
        s.throttle.iter().for_each(|a| self.taking(a, 0, deed(StreamEffect::Held), Takes::Pieces));
        s.stream_corrupt.iter().for_each(|a| self.taking(a, 0, deed(StreamEffect::Damaged), Takes::Pieces));
        s.half_close.iter().for_each(|a| self.add(a, 0, deed(StreamEffect::HalfClosed)));
        s.reset.iter().for_each(|a| self.add(a, 0, deed(StreamEffect::Reset)));
        s.cut.iter().for_each(|a| self.add(a, 0, deed(StreamEffect::Reset)));
    }

    fn broker(&mut self, s: &Scenario) {
        let action = Planned::Broker;
        let about = |direction, only: Option<Order>| Takes::Publications {
            to: needs::side(direction),
            asks: only.map(needs::asks),
            ever: false,
        };
        let ever = |direction| Takes::Publications { to: needs::side(direction), asks: None, ever: true };
        s.broker_drop.iter().for_each(|a| self.taking(a, 0, action(Action::Drop), about(a.direction, a.only)));
        for a in s.broker_delay.iter() {
            self.taking(a, a.by_ms.unsigned(), action(Action::Delay), about(a.direction, a.only));
        }
        for a in s.broker_reorder.iter() {
            self.taking(a, a.hold_ms.unsigned(), action(Action::Reorder), about(a.direction, None));
        }
        s.broker_duplicate.iter().for_each(|a| self.taking(a, 0, action(Action::Duplicate), about(a.direction, None)));
        for a in s.broker_replay.iter() {
            let more_ms = a.count.unsigned() * a.every_ms.unsigned();
            self.taking(a, more_ms, action(Action::Replay), ever(a.direction));
        }
        s.broker_retain.iter().for_each(|a| self.taking(a, 0, action(Action::Replay), ever(a.direction)));
        for a in s.broker_invent.iter() {
            let more_ms = a.count.unsigned() * a.every_ms.unsigned();
            match a.forgery {
                OrderForgery::OwnKey => self.add(a, more_ms, action(Action::Inject)),
                OrderForgery::Altered | OrderForgery::Spliced => {
                    self.taking(a, more_ms, action(Action::Inject), ever(Direction::Down));
                }
            }
        }
        s.broker_forge.iter().for_each(|a| self.taking(a, 0, action(Action::Inject), about(Direction::Down, None)));
    }

    fn gateway(&mut self, s: &Scenario) {
        s.feed_withhold.iter().for_each(|a| self.taking(a, 0, Planned::Feed(Action::Drop), Takes::Reports));
        for a in s.feed_delay.iter() {
            self.taking(a, 0, Planned::Late(a.by_ms.unsigned() * 1000), Takes::Reports);
        }
        s.feed_forge.iter().for_each(|a| self.taking(a, 0, Planned::Feed(Action::Forge), Takes::Reports));
        s.feed_replay.iter().for_each(|a| self.taking(a, 0, Planned::Feed(Action::Republish), Takes::Reports));
        for a in s.intent_drop.iter() {
            self.taking(a, 0, Planned::Swallowed, Takes::Orders(a.only.map(needs::asks)));
        }
    }

    fn insiders(&mut self, s: &Scenario) {
        let action = Planned::Action;
        s.teammate.iter().for_each(|t| self.add(t, t.lag_ms.unsigned(), action(Action::Forward)));
        // The insider has one session to replay (`peer`).
        let anew = s.session_replay.first().map(|r| (start_ms(r, self.phase) * 1000, action(Action::Resend)));
        // How long it takes to dial again is up to the gateway.
        let anew = anew.map(|(from, what)| Plan { from, needs: needs::of(what), ..Plan::from(what) });
        self.plans.extend(anew);
        s.falsehood.iter().for_each(|f| self.add(f, 0, action(Action::Lie)));
        s.mode_confusion.iter().for_each(|c| self.add(c, 0, action(Action::Confuse)));
        s.malformed.iter().for_each(|m| self.add(m, m.count.unsigned() * m.every_ms.unsigned(), Planned::Malformed));
        for r in s.rogue.iter() {
            self.add(r, r.count.unsigned() * r.every_ms.unsigned(), Planned::Rogue);
            let judges: &[NodeId] = match r.way {
                Way::Station => &[NodeId::GATEWAY],
                Way::Broker => &[NodeId::BROKER],
            };
            if let Some(plan) = self.plans.last_mut() {
                plan.needs.running = judges;
            }
        }
        for t in s.takeover.iter() {
            let whose = PeerId::from_name(t.certificate.as_str()).map(Planned::Takeover);
            whose.into_iter().for_each(|what| self.add(t, 0, what));
        }
        s.forge.iter().for_each(|f| self.add(f, 0, action(Action::Forge)));
        s.alter.iter().for_each(|a| self.add(a, 0, action(Action::Forge)));
        s.republish.iter().for_each(|r| self.add(r, 0, action(Action::Republish)));
    }
}

fn kind(kind: scenario::FaultKind) -> FaultKind {
    match kind {
        scenario::FaultKind::Dropout => FaultKind::Dropout,
        scenario::FaultKind::Freeze => FaultKind::Freeze,
        scenario::FaultKind::Skew => FaultKind::Skew,
        scenario::FaultKind::Chaff => FaultKind::Chaff,
        scenario::FaultKind::Perturbation => FaultKind::Perturbation,
        scenario::FaultKind::Noise => FaultKind::Noise,
        scenario::FaultKind::Occlusion => FaultKind::Occlusion,
        scenario::FaultKind::Drift => FaultKind::Drift,
        scenario::FaultKind::Jump => FaultKind::Jump,
        scenario::FaultKind::TimeStep => FaultKind::TimeStep,
        scenario::FaultKind::TimeDrift => FaultKind::TimeDrift,
    }
}
