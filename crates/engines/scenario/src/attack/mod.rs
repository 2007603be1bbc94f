//! Attacks, one a file that is named as its table: the fields, the checks of them, the actor's action, and the injection that the
//! oracle has to find a receipt of.
//!
//! A new attack is a file here and, in this one, its `mod` and its row of [`with_attacks`]. The keys of scenario files, the
//! schema, cells' paths, attack spaces of a search, plans and receipts follow from these. The actions that an actor can take at all are
//! the part of `adversary`; the facts that count as a receipt of each [`Planned`], the oracle's.

pub(super) mod alter;
pub(super) mod broker_delay;
pub(super) mod broker_drop;
pub(super) mod broker_duplicate;
pub(super) mod broker_forge;
pub(super) mod broker_invent;
pub(super) mod broker_reorder;
pub(super) mod broker_replay;
pub(super) mod broker_retain;
pub(super) mod burst_loss;
pub(super) mod corrupt;
pub(super) mod cut;
pub(super) mod delay;
pub(super) mod duplicate;
pub(super) mod falsehood;
pub(super) mod feed_delay;
pub(super) mod feed_forge;
pub(super) mod feed_replay;
pub(super) mod feed_withhold;
pub(super) mod forge;
pub(super) mod guest_bus;
pub(super) mod half_close;
pub(super) mod inject;
pub(super) mod intent_drop;
pub(super) mod jitter;
pub(super) mod loss;
pub(super) mod malformed;
pub(super) mod mode_confusion;
pub(super) mod reorder;
pub(super) mod reoriginate;
pub(super) mod replay;
pub(super) mod republish;
pub(super) mod reset;
pub(super) mod rogue;
pub(super) mod session_replay;
pub(super) mod stall;
pub(super) mod stream_corrupt;
pub(super) mod stream_delay;
pub(super) mod takeover;
pub(super) mod teammate;
pub(super) mod throttle;

use adversary::plan::{
    BrokerAction, Confusion, DatagramAction, Falsehood as FalsePlace, FeedAction, Forward, Malformed as BrokenRecords,
    Resend, RogueMove, RogueOrders, StreamAction, Takeover as TakenSession, Timed,
};
use evidence::{Planned, Takes};
use wire::command::OrderKind;
use wire::core::Topic;
use wire::id::NodeId;

use super::finding::Finding;
use super::{Direction, Holder, Scenario, Windowed};

/// Appends a list of tables for each attack to [`Scenario`]: key, type, most tables, and a line for the schema. Actors and
/// receipts come in the order of the rows.
macro_rules! with_attacks {
    ($($scenario:tt)*) => {
        crate::attack::declare! {
            { $($scenario)* }
            delay: Delay, 16, "Telemetry datagrams held back.";
            jitter: Jitter, 16, "Telemetry datagrams held back by random times.";
            loss: Loss, 16, "Telemetry datagrams lost, each by itself.";
            burst_loss: BurstLoss, 16, "Telemetry datagrams lost in bursts.";
            duplicate: Duplicate, 16, "Telemetry datagrams sent more than once.";
            reorder: Reorder, 16, "Telemetry datagrams that overtake each other.";
            replay: Replay, 16, "Captured telemetry datagrams sent again.";
            corrupt: Corrupt, 16, "Telemetry datagrams changed on the way.";
            reoriginate: Reoriginate, 16, "Telemetry sent on from the relay's own socket, without a credential.";
            inject: Inject, 16, "Datagrams of the relay's own making.";
            stream_delay: StreamDelay, 16, "Command-plane bytes held back.";
            stall: Stall, 16, "Command-plane bytes kept until the end of the window.";
            throttle: Throttle, 16, "Command-plane bytes let through at a rate.";
            half_close: HalfClose, 16, "One direction of a command-plane connection ended.";
            reset: Reset, 16, "Command-plane connections reset.";
            cut: Cut, 16, "Command-plane connections cut and kept from coming back.";
            stream_corrupt: StreamCorrupt, 16, "Command-plane bytes changed.";
            broker_drop: BrokerDrop, 16, "Publications that a hostile broker does not pass on.";
            broker_delay: BrokerDelay, 16, "Publications that it passes on later.";
            broker_reorder: BrokerReorder, 16, "Publications that it lets others overtake.";
            broker_duplicate: BrokerDuplicate, 16, "Publications that it delivers more than once.";
            broker_replay: BrokerReplay, 16, "Captured publications that it delivers again.";
            broker_retain: BrokerRetain, 16, "Publications that it delivers again to whoever connects.";
            broker_invent: BrokerInvent, 16, "Orders of its own making.";
            broker_forge: BrokerForge, 16, "Acknowledgements of its own making.";
            feed_withhold: FeedWithhold, 16, "Reports that a gateway insider keeps from the display.";
            feed_delay: FeedDelay, 16, "Reports that it passes on later.";
            feed_forge: FeedForge, 16, "Reports that it makes say something else.";
            feed_replay: FeedReplay, 16, "An old report that it says is new.";
            intent_drop: IntentDrop, 16, "What the operator asks for, kept from the gateway.";
            teammate: Teammate, 4, "An admitted teammate forwards a third unit's telemetry.";
            session_replay: SessionReplay, 1, "An admitted teammate sends what it said in an earlier session again.";
            falsehood: Falsehood, 16, "An admitted teammate claims a place or a motion that is not its own.";
            mode_confusion: ModeConfusion, 16, "An admitted teammate's reports are no live product, or in another time base.";
            malformed: Malformed, 16, "An admitted teammate sends records that are authenticated and broken.";
            rogue: Rogue, 16, "A rogue station gives orders under a key that is not its own.";
            takeover: Takeover, 8, "A thief takes somebody's session at the broker.";
            forge: Forge, 16, "A process on a host's shared memory makes messages in another's name.";
            republish: Republish, 16, "A process on a host's shared memory publishes recorded messages again.";
            guest_bus: GuestBus, 4, "An attacker on the bus of a guest's own programs.";
            alter: Alter, 4, "An insider in perception's place makes up where vehicles stand.";
        }
    };
}
pub(super) use with_attacks;

/// Declares the scenario with the rows of [`with_attacks`], and the one list of all its attacks.
macro_rules! declare {
    (
        { $(#[$meta:meta])* pub struct $scenario:ident { $($body:tt)* } }
        $($key:ident: $attack:ident, $most:literal, $doc:literal;)+
    ) => {
        $(pub use attack::$key::$attack;)+

        $(#[$meta])*
        pub struct $scenario {
            $($body)*
            $(
                #[doc = $doc]
                #[serde(default)]
                pub $key: List<$attack, $most>,
            )+
        }

        impl $scenario {
            /// Every attack, kind by kind.
            pub fn attacks(&self) -> Vec<&dyn Attack> {
                let mut all: Vec<&dyn Attack> = Vec::new();
                $(all.extend(self.$key.iter().map(|attack| attack as &dyn Attack));)+
                all
            }
        }
    };
}
pub(super) use declare;

/// Declares attacks on a path: tables with a window and a direction, by one who sees the path.
macro_rules! attacks {
    ($(
        $(#[$doc:meta])* $name:ident $(needs $level:ident)? { $( $(#[$field_doc:meta])* $field:ident : $kind:ty ),* $(,)? }
    )+) => {
        crate::timed::timed! {$(
            $(#[$doc])*
            $name lasts duration_s $(needs $level)? sees OnPath {
                /// Length of the window.
                duration_s: crate::Seconds,
                /// Direction.
                #[serde(default)]
                direction: crate::Direction,
                $( $(#[$field_doc])* $field: $kind, )*
            }
        )+}
    };
}
use attacks;

/// One table of an attack.
pub trait Attack: Windowed {
    /// The actor's action, in a trial of this phase; `None` where the table names an unknown identity, which a checked one does
    /// not.
    fn act(&self, phase_ms: u64) -> Option<Act>;

    /// The injection that the oracle has to find a receipt of; `None` where [`Attack::act`] is.
    fn injection(&self) -> Option<Injection>;

    /// Mistakes in the table, by itself or beside the others of the scenario.
    fn check(&self, _whole: &Scenario) -> Vec<Finding> {
        Vec::new()
    }
}

/// An entry in an actor's plan: the action, by its actor.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    /// An action of the relay on the telemetry path.
    Datagram(Timed<DatagramAction>),
    /// An action of the relay on the command path.
    Stream(Timed<StreamAction>),
    /// An action of the broker's insider.
    Broker(Timed<BrokerAction>),
    /// An action of the gateway's insider.
    Feed(Timed<FeedAction>),
    /// An action of the insider among the teammates.
    Teammate(Deceit),
    /// Orders of the rogue station.
    Orders(RogueOrders),
    /// A session taken by the thief of a certificate.
    Takeover(TakenSession),
    /// An attack on the bus of a guest's own programs, by the guest's adapter.
    GuestBus(guest_bus::BusWindow),
    /// An act of the rogue on a host's shared memory.
    Rogue {
        /// Channel that the rogue writes.
        channel: Topic,
        /// Service with the keys that the rogue holds; none for an impostor.
        holder: Option<Holder>,
        /// The rogue's action on the channel.
        plan: RogueMove,
    },
}

/// Action of the insider among the teammates.
#[derive(Clone, Debug, PartialEq)]
pub enum Deceit {
    /// Forwards another's telemetry.
    Forward(Forward),
    /// Sends broken records.
    Malformed(BrokenRecords),
    /// Sends records of an earlier session again.
    Resend(Resend),
    /// Claims a false place or motion.
    Falsehood(FalsePlace),
    /// Claims another kind of product, or another time.
    Confusion(Confusion),
}

/// An injection that the oracle has to find a receipt of, and the conditions for it to arrive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Injection {
    /// The planned effect.
    pub what: Planned,
    /// Time after its window for which it may still come; `None` until the end of the run.
    pub later_ms: Option<u64>,
    /// Traffic that it takes hold of, where it does not bring everything along.
    pub takes: Option<Takes>,
    /// The processes that have to run, where they are others than for all of its kind.
    pub running: Option<&'static [NodeId]>,
}

impl Injection {
    fn new(what: Planned) -> Self {
        Self { what, later_ms: Some(0), takes: None, running: None }
    }

    fn longer_by(self, ms: u64) -> Self {
        Self { later_ms: Some(ms), ..self }
    }

    fn without_end(self) -> Self {
        Self { later_ms: None, ..self }
    }

    fn taking(self, takes: Takes) -> Self {
        Self { takes: Some(takes), ..self }
    }

    fn judged_by(self, running: &'static [NodeId]) -> Self {
        Self { running: Some(running), ..self }
    }
}

/// An action for the length of a table, on a path.
fn during<A>(windowed: &dyn Windowed, direction: Direction, phase_ms: u64, action: A) -> Timed<A> {
    Timed {
        start_ms: windowed.start_ms(phase_ms),
        duration_ms: windowed.length_ms(),
        direction,
        step: windowed.actor_step(),
        action,
    }
}

/// Publications that come by while a broker acts: all of a direction, or those about one order.
fn publications(direction: Direction, only: Option<OrderKind>) -> Takes {
    Takes::Publications { to: direction.side(), asks: only.map(OrderKind::name), ever: false }
}

/// Publications that a broker has captured at any time before.
fn captured(direction: Direction) -> Takes {
    Takes::Publications { to: direction.side(), asks: None, ever: true }
}
