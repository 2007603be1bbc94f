//! The transitions: the only place where a next state is built.
//!
//! [`Machine::step`] takes the machine, one [`Stimulus`] and the [`Context`] it is judged in, and gives the next
//! machine with its [`Effect`]s. Its arms make no decision themselves: each calls one typed, consuming transition, with
//! the proofs that it needs as arguments.
//!
//! The diagram and the whole table are drawn from this code by [`table`] and committed as `docs/state-machine.md`.
//!
//! Guarantees by construction:
//! - `Ready` cannot be entered without [`Healthy`], which only `health` gives, and only when no required guard fails.
//! - `PrepareToAct` cannot be entered without an accepted [`Arm`] order, [`Healthy`] and the ordered track
//!   [`Designated`].
//! - Leaving `PrepareToAct` moves its authority out; there is no state that could hold it elsewhere.
//! - `HoldSafe` cannot be left without an accepted [`Resume`] order and [`Healthy`].
//!
//! The guards are left to `health`, the acceptance of an order to `command`, logging to the core.
//!
//! An illegal transition does not compile; Idle cannot be armed:
//! ```compile_fail,E0599
//! # use autonomy::{command::given::{Arm, Given}, state::Idle};
//! fn from_idle(idle: Idle, order: &Given<'_, Arm>) { idle.arm(order); }
//! ```
//! and an order to disarm does not lead out of HoldSafe:
//! ```compile_fail,E0308
//! # use autonomy::{command::given::{Disarm, Given}, health::Healthy, state::HoldSafe};
//! fn resume(held: HoldSafe, order: &Given<'_, Disarm>, healthy: Healthy) { held.resume(order, healthy); }
//! ```

pub mod authority;
pub mod state;
pub mod table;

use arrayvec::ArrayVec;
use wire::id::{CommandId, TrackId, WorldId};
use wire::mode::{Because, Cause, Guard, Guards, Mode};
use wire::policy::Waived;
use wire::refusal::Refusal;
use wire::settings::Settings;
use wire::time::{Instant, Span};

use crate::command::Ordered;
use crate::command::consent::Consented;
use crate::command::given::{Arm, Command, Configure, Confirm, Disarm, Enable, Given, Hold, Resume};
use crate::designation::Designated;
use crate::health::{Condition, Health, Healthy, SubsystemLoss, TrustLoss};
use authority::{ActAuthority, Mint, Revoked, Spent};
use state::{Degraded, HoldSafe, Idle, Machine, PrepareToAct, Ready, Started, Stopped};

/// Stimulus of the machine.
#[derive(Clone, Copy, Debug)]
pub enum Stimulus<'a> {
    /// The guards were judged again (they are in the context).
    Judged,
    /// An operator's order passed the trust boundary. Towards safe, it is always carried out; away from safe, only
    /// from the mode it belongs to and with the guards it needs.
    Ordered(&'a Ordered),
}

/// Context in which a step is judged.
#[derive(Debug)]
pub struct Context<'a> {
    /// Time of the step.
    pub now: Instant,
    /// The guards as judged now.
    pub health: &'a Health,
    /// The track in question (the one ordered, else the one held): fit for designation, or why not.
    pub designation: &'a Result<Designated, Because>,
    /// Source of authority.
    pub mint: &'a mut Mint,
    /// Durations of losses and recoveries.
    pub timing: Timing,
}

impl Context<'_> {
    /// The designation of this very track.
    fn designation_of(&self, track: TrackId) -> Result<&Designated, Because> {
        match self.designation {
            Ok(designated) if designated.track() == track => Ok(designated),
            Ok(_) => Err(Because::Itself),
            Err(because) => Err(*because),
        }
    }
}

/// Durations of losses and recoveries.
#[derive(Clone, Copy, Debug)]
pub struct Timing {
    /// All guards have to hold for so long before Degraded may end.
    pub hysteresis: Span,
    /// A loss that driving depends on may last so long before Degraded becomes HoldSafe.
    pub unrecovered: Span,
}

/// Effects of a step, beside the next machine.
#[derive(Debug, PartialEq, Eq)]
pub enum Effect {
    /// The mode changed.
    Transition {
        /// Mode before.
        from: Mode,
        /// Mode after.
        to: Mode,
        /// Cause of the change.
        cause: Cause,
        /// The first link of the chain behind the cause.
        because: Because,
        /// All guards that failed at the time, waived ones too.
        failing: Guards,
    },
    /// Authority began, and may be used once.
    Minted {
        /// Serial of the authority.
        authority: u32,
        /// World it is bound to.
        world: WorldId,
        /// Track it is bound to.
        track: TrackId,
        /// Command that asked for it.
        command: CommandId,
        /// Checks that were waived in its evidence.
        waived: Waived,
    },
    /// Authority ended unused.
    Revoked(Revoked),
    /// Authority was used.
    Acted(Spent),
    /// The order was not carried out.
    Refused(Refusal),
    /// An operator's values hold from now on.
    Configured(Settings),
}

/// At most: an authority's beginning or end, a transition, a refusal.
pub type Effects = ArrayVec<Effect, 3>;

/// Reason that a state was left; absent if it was kept.
type Why = Option<(Cause, Because)>;

/// The next machine, and why it is another one.
type Next = (Machine, Why);

/// Reason that the unit has to stop: the proof that [`HoldSafe`] needs.
#[derive(Debug)]
pub enum Stop<'a> {
    /// Trust is lost.
    Trust(TrustLoss),
    /// Driving has lacked its basis for too long.
    Blind(SubsystemLoss),
    /// An operator orders it.
    Order(Given<'a, Hold>),
}

impl Stop<'_> {
    fn cause_chain(&self) -> (Cause, Because) {
        match self {
            Stop::Trust(loss) => (Cause::Lost(loss.guard()), loss.reason()),
            Stop::Blind(loss) => (Cause::Unrecovered(loss.blinding().unwrap_or(loss.guard())), loss.reason()),
            Stop::Order(order) => order.cause_chain(),
        }
    }
}

// The typed transitions: each consumes a state and the proofs that the next one needs.

impl Idle {
    /// The operator enables the mission.
    pub fn enable(self, _order: &Given<'_, Enable>, healthy: Healthy) -> Ready {
        let Idle { started: Started } = self;
        Ready { healthy }
    }

    /// Stops before it ever started.
    pub fn hold(self, _stop: &Stop<'_>) -> HoldSafe {
        HoldSafe { stopped: Stopped }
    }
}

impl Ready {
    /// The guards still hold.
    #[must_use]
    pub fn reaffirm(self, healthy: Healthy) -> Ready {
        Ready { healthy }
    }

    /// Mints authority on the ordered track; gives the state back where the policy admits none.
    pub fn arm(
        self,
        mint: &mut Mint,
        now: Instant,
        order: &Given<'_, Arm>,
        healthy: Healthy,
        consented: &Consented<'_>,
    ) -> Result<PrepareToAct, Ready> {
        match ActAuthority::mint(mint, now, order, &healthy, consented) {
            Some(authority) => Ok(PrepareToAct { healthy, authority }),
            None => Err(self.reaffirm(healthy)),
        }
    }

    /// A subsystem is lost.
    pub fn degrade(self, loss: &SubsystemLoss, now: Instant) -> Degraded {
        Degraded::from_loss(loss, now)
    }

    /// Stops for a reason.
    pub fn hold(self, _stop: &Stop<'_>) -> HoldSafe {
        HoldSafe { stopped: Stopped }
    }
}

impl PrepareToAct {
    /// The guards and the designation still hold.
    #[must_use]
    pub fn reaffirm(self, healthy: Healthy, _designated: &Designated) -> PrepareToAct {
        PrepareToAct { healthy, ..self }
    }

    /// Uses the authority: everything it was minted from holds again, and the operator confirms.
    pub fn act(self, confirm: &Given<'_, Confirm>, healthy: Healthy, consented: &Consented<'_>) -> (Ready, Spent) {
        let spent = self.authority.spend(confirm, &healthy, consented);
        (Ready { healthy }, spent)
    }

    /// Gives the authority up while all guards hold: disarmed, expired, or its track lost.
    pub fn give_up(self, healthy: Healthy, cause: Cause) -> (Ready, Revoked) {
        (Ready { healthy }, self.authority.revoke(cause))
    }

    /// A subsystem is lost.
    pub fn degrade(self, loss: &SubsystemLoss, cause: Cause, now: Instant) -> (Degraded, Revoked) {
        (Degraded::from_loss(loss, now), self.authority.revoke(cause))
    }

    /// Stops, and revokes the authority.
    pub fn hold(self, stop: &Stop<'_>) -> (HoldSafe, Revoked) {
        (HoldSafe { stopped: Stopped }, self.authority.revoke(stop.cause_chain().0))
    }
}

impl Degraded {
    fn from_loss(loss: &SubsystemLoss, now: Instant) -> Degraded {
        Degraded { blind: loss.blinding().map(|_| now), whole: None }
    }

    /// A guard still fails. Gives the time for which driving has lacked its basis.
    fn endure(self, loss: &SubsystemLoss, now: Instant) -> (Degraded, Option<Span>) {
        let blind = loss.blinding().map(|_| self.blind.unwrap_or(now));
        (Degraded { blind, whole: None }, blind.map(|since| now.since(since)))
    }

    /// Every guard holds. Gives for how long.
    fn mend(self, now: Instant) -> (Degraded, Span) {
        let whole = self.whole.unwrap_or(now);
        (Degraded { blind: None, whole: Some(whole) }, now.since(whole))
    }

    /// Every guard has held long enough.
    pub fn recover(self, healthy: Healthy) -> Ready {
        Ready { healthy }
    }

    /// Stops for a reason.
    pub fn hold(self, _stop: &Stop<'_>) -> HoldSafe {
        HoldSafe { stopped: Stopped }
    }
}

impl HoldSafe {
    /// The operator consents to go on.
    pub fn resume(self, _order: &Given<'_, Resume>, healthy: Healthy) -> Ready {
        let HoldSafe { stopped: Stopped } = self;
        Ready { healthy }
    }
}

// The step: which transition, from what was judged or ordered.

impl Machine {
    /// Takes one stimulus: at most one transition. The effects are in the order in which they came about.
    #[must_use]
    pub fn step(self, stimulus: Stimulus<'_>, ctx: &mut Context<'_>) -> (Machine, Effects) {
        let from = self.mode();
        let mut effects = Effects::new();
        let (machine, reason) = match stimulus {
            Stimulus::Judged => self.judged(ctx, &mut effects),
            Stimulus::Ordered(order) => self.ordered(order, ctx, &mut effects),
        };
        if let Some((cause, because)) = reason {
            let failing = ctx.health.failing();
            effects.push(Effect::Transition { from, to: machine.mode(), cause, because, failing });
        }
        (machine, effects)
    }

    fn judged(self, ctx: &Context<'_>, effects: &mut Effects) -> Next {
        match self {
            Machine::Idle(idle) => (Machine::Idle(idle), None),
            Machine::Ready(ready) => ready.judged(ctx),
            Machine::PrepareToAct(held) => held.judged(ctx, effects),
            Machine::Degraded(degraded) => degraded.judged(ctx),
            Machine::HoldSafe(stopped) => (Machine::HoldSafe(stopped), None),
        }
    }

    fn ordered(self, order: &Ordered, ctx: &mut Context<'_>, effects: &mut Effects) -> Next {
        match order.command() {
            Command::Hold(order) => self.stop(order, effects),
            Command::Disarm(order) => self.disarm(&order, ctx, effects),
            Command::Enable(order) => self.enable(&order, ctx, effects),
            Command::Resume(order) => self.resume(&order, ctx, effects),
            Command::Arm(order) => self.arm(&order, ctx, effects),
            Command::Confirm(order) => self.confirm(&order, ctx, effects),
            Command::Configure(order) => self.configure(&order, effects),
        }
    }

    fn stop(self, order: Given<'_, Hold>, effects: &mut Effects) -> Next {
        let stop = Stop::Order(order);
        let held = match self {
            Machine::Idle(idle) => idle.hold(&stop),
            Machine::Ready(ready) => ready.hold(&stop),
            Machine::PrepareToAct(held) => {
                let (stopped, revoked) = held.hold(&stop);
                effects.push(Effect::Revoked(revoked));
                stopped
            }
            Machine::Degraded(degraded) => degraded.hold(&stop),
            Machine::HoldSafe(stopped) => return (Machine::HoldSafe(stopped), None),
        };
        (Machine::HoldSafe(held), Some(stop.cause_chain()))
    }

    fn disarm(self, order: &Given<'_, Disarm>, ctx: &Context<'_>, effects: &mut Effects) -> Next {
        match self {
            Machine::PrepareToAct(held) => match ctx.health.verdict() {
                Condition::Healthy(healthy) => {
                    let (ready, revoked) = held.give_up(healthy, Cause::Operator);
                    effects.push(Effect::Revoked(revoked));
                    (Machine::Ready(ready), Some(order.cause_chain()))
                }
                Condition::Subsystem(loss) => held.lose_subsystem(&loss, ctx.now, effects),
                Condition::Trust(loss) => held.lose_trust(loss, effects),
            },
            // There is no authority to give up, which is what was asked for.
            kept @ (Machine::Idle(_) | Machine::Ready(_) | Machine::Degraded(_) | Machine::HoldSafe(_)) => (kept, None),
        }
    }

    fn enable(self, order: &Given<'_, Enable>, ctx: &Context<'_>, effects: &mut Effects) -> Next {
        match (self, ctx.health.verdict()) {
            (Machine::Idle(idle), Condition::Healthy(healthy)) => {
                (Machine::Ready(idle.enable(order, healthy)), Some(order.cause_chain()))
            }
            (kept, Condition::Healthy(_) | Condition::Subsystem(_) | Condition::Trust(_)) => kept.interlock(effects),
        }
    }

    fn resume(self, order: &Given<'_, Resume>, ctx: &Context<'_>, effects: &mut Effects) -> Next {
        match (self, ctx.health.verdict()) {
            (Machine::HoldSafe(stopped), Condition::Healthy(healthy)) => {
                (Machine::Ready(stopped.resume(order, healthy)), Some(order.cause_chain()))
            }
            (kept, Condition::Healthy(_) | Condition::Subsystem(_) | Condition::Trust(_)) => kept.interlock(effects),
        }
    }

    fn arm(self, order: &Given<'_, Arm>, ctx: &mut Context<'_>, effects: &mut Effects) -> Next {
        let designation = ctx.designation;
        match (self, ctx.health.verdict(), designation) {
            (Machine::Ready(ready), Condition::Healthy(healthy), Ok(designated)) => {
                let consented = match order.consented(designated) {
                    Ok(consented) => consented,
                    Err(refusal) => return Machine::Ready(ready).refuse(refusal, effects),
                };
                match ready.arm(ctx.mint, ctx.now, order, healthy, &consented) {
                    Ok(held) => {
                        effects.push(minted(held.authority()));
                        (Machine::PrepareToAct(held), Some(order.cause_chain()))
                    }
                    Err(ready) => Machine::Ready(ready).interlock(effects),
                }
            }
            (kept, Condition::Healthy(_) | Condition::Subsystem(_) | Condition::Trust(_), Ok(_) | Err(_)) => {
                kept.interlock(effects)
            }
        }
    }

    fn confirm(self, order: &Given<'_, Confirm>, ctx: &Context<'_>, effects: &mut Effects) -> Next {
        match (self, ctx.health.verdict(), ctx.designation_of(order.track())) {
            (Machine::PrepareToAct(held), Condition::Healthy(healthy), Ok(designated))
                if held.track() == order.track() && !held.expired(ctx.now) =>
            {
                let consented = match order.consented(designated) {
                    Ok(consented) => consented,
                    Err(refusal) => return Machine::PrepareToAct(held).refuse(refusal, effects),
                };
                let (ready, spent) = held.act(order, healthy, &consented);
                effects.push(Effect::Acted(spent));
                (Machine::Ready(ready), Some((Cause::Acted, Because::Command(order.id()))))
            }
            (kept, Condition::Healthy(_) | Condition::Subsystem(_) | Condition::Trust(_), Ok(_) | Err(_)) => {
                kept.interlock(effects)
            }
        }
    }

    /// Values are set before the mission begins and never under way: the limits of the guards do not change beneath
    /// them.
    fn configure(self, order: &Given<'_, Configure>, effects: &mut Effects) -> Next {
        match self {
            Machine::Idle(idle) => {
                effects.push(Effect::Configured(order.settings()));
                (Machine::Idle(idle), None)
            }
            kept @ (Machine::Ready(_) | Machine::PrepareToAct(_) | Machine::Degraded(_) | Machine::HoldSafe(_)) => {
                kept.interlock(effects)
            }
        }
    }

    fn interlock(self, effects: &mut Effects) -> Next {
        let mode = self.mode();
        self.refuse(Refusal::Interlock { mode }, effects)
    }

    fn refuse(self, refusal: Refusal, effects: &mut Effects) -> Next {
        effects.push(Effect::Refused(refusal));
        (self, None)
    }
}

impl Ready {
    fn judged(self, ctx: &Context<'_>) -> Next {
        match ctx.health.verdict() {
            Condition::Healthy(healthy) => (Machine::Ready(self.reaffirm(healthy)), None),
            Condition::Subsystem(loss) => {
                let reason = (Cause::Lost(loss.guard()), loss.reason());
                (Machine::Degraded(self.degrade(&loss, ctx.now)), Some(reason))
            }
            Condition::Trust(loss) => {
                let stop = Stop::Trust(loss);
                (Machine::HoldSafe(self.hold(&stop)), Some(stop.cause_chain()))
            }
        }
    }
}

impl PrepareToAct {
    fn expired(&self, now: Instant) -> bool {
        self.authority().left(now) == Span::ZERO
    }

    fn judged(self, ctx: &Context<'_>, effects: &mut Effects) -> Next {
        match (ctx.health.verdict(), ctx.designation_of(self.track())) {
            (Condition::Trust(loss), Ok(_) | Err(_)) => self.lose_trust(loss, effects),
            (Condition::Subsystem(loss), Ok(_) | Err(_)) => self.lose_subsystem(&loss, ctx.now, effects),
            (Condition::Healthy(healthy), Err(because)) => {
                self.end(healthy, Cause::Lost(Guard::Designation), because, effects)
            }
            (Condition::Healthy(healthy), Ok(_)) if self.expired(ctx.now) => {
                self.end(healthy, Cause::Expired, Because::Itself, effects)
            }
            (Condition::Healthy(healthy), Ok(designated)) => {
                (Machine::PrepareToAct(self.reaffirm(healthy, designated)), None)
            }
        }
    }

    fn end(self, healthy: Healthy, cause: Cause, reason: Because, effects: &mut Effects) -> Next {
        let (ready, revoked) = self.give_up(healthy, cause);
        effects.push(Effect::Revoked(revoked));
        (Machine::Ready(ready), Some((cause, reason)))
    }

    fn lose_subsystem(self, loss: &SubsystemLoss, now: Instant, effects: &mut Effects) -> Next {
        let cause = Cause::Lost(loss.guard());
        let (degraded, revoked) = self.degrade(loss, cause, now);
        effects.push(Effect::Revoked(revoked));
        (Machine::Degraded(degraded), Some((cause, loss.reason())))
    }

    fn lose_trust(self, loss: TrustLoss, effects: &mut Effects) -> Next {
        let stop = Stop::Trust(loss);
        let (stopped, revoked) = self.hold(&stop);
        effects.push(Effect::Revoked(revoked));
        (Machine::HoldSafe(stopped), Some(stop.cause_chain()))
    }
}

impl Degraded {
    fn judged(self, ctx: &Context<'_>) -> Next {
        match ctx.health.verdict() {
            Condition::Healthy(healthy) => match self.mend(ctx.now) {
                (mended, held) if held >= ctx.timing.hysteresis => {
                    (Machine::Ready(mended.recover(healthy)), Some((Cause::Recovered, Because::Itself)))
                }
                (mended, _) => (Machine::Degraded(mended), None),
            },
            Condition::Subsystem(loss) => match self.endure(&loss, ctx.now) {
                (enduring, Some(blind)) if blind >= ctx.timing.unrecovered => {
                    let stop = Stop::Blind(loss);
                    (Machine::HoldSafe(enduring.hold(&stop)), Some(stop.cause_chain()))
                }
                (enduring, Some(_) | None) => (Machine::Degraded(enduring), None),
            },
            Condition::Trust(loss) => {
                let stop = Stop::Trust(loss);
                (Machine::HoldSafe(self.hold(&stop)), Some(stop.cause_chain()))
            }
        }
    }
}

fn minted(authority: &ActAuthority) -> Effect {
    Effect::Minted {
        authority: authority.serial(),
        world: authority.world(),
        track: authority.track(),
        command: authority.command(),
        waived: authority.waived(),
    }
}
