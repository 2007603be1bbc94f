//! Situations that a person at the window meets, by name: for tests, and for the images in `docs/operator/console`.

use console::act::{Act, Order};
use console::moment::Moment;
use console::shown::Shown;
use console::source::Tape;
use wire::command::CommandKind;
use wire::feed::Feed;
use wire::id::{PeerId, TrackId, UnitId};
use wire::mode::{Cause, Guard, Guards, Mode};
use wire::motion::{Attitude, ReportedMotion};
use wire::person::Role;
use wire::policy::{DisplayRule, Policy, Requirement};
use wire::refusal::Reason;
use wire::report::{ReportedContact, ReportedTrack};
use wire::sensor::Class;
use wire::time::{Instant, Span};

use crate::yard::Yard;

/// A situation, made again.
pub(crate) type Scene = (&'static str, fn() -> Yard);

/// Every one.
pub(crate) const SCENES: [Scene; 16] = [
    ("nominal", nominal),
    ("authority", authority),
    ("degraded", degraded),
    ("hold-safe", hold_safe),
    ("armed", armed),
    ("arming", arming),
    ("stale", stale),
    ("lost", lost),
    ("silent", silent),
    ("ablation", ablation),
    ("view-only", view_only),
    ("crowd", crowd),
    ("eight", eight),
    ("flood", flood),
    ("aloft", aloft),
    ("between-contacts", between_contacts),
];

/// Scenes of more than a minute, which not every test makes.
pub(crate) const LONG: [Scene; 1] = [("patrol", patrol)];

/// Two units have driven for more than a minute, one of them around; for four seconds it was not heard.
pub(crate) fn patrol() -> Yard {
    let mut yard = nominal();
    let a = yard.actor(UnitId::A);
    (a.speed_mm_s, a.turn_mrad) = (1_900, 10);
    let b = yard.actor(UnitId::B);
    (b.speed_mm_s, b.turn_mrad) = (900, -8);
    yard.run(Span::s(30));
    yard.actor(UnitId::A).heard = false;
    yard.run(Span::s(4));
    yard.actor(UnitId::A).heard = true;
    yard.run(Span::s(29));
    yard
}

/// Two units drive; the mission was enabled a while ago.
pub(crate) fn nominal() -> Yard {
    let mut yard = Yard::new();
    let a = yard.actor(UnitId::A);
    (a.mode, a.speed_mm_s, a.cause) = (Mode::Idle, 0, Cause::Start);
    yard.run(Span::s(1));
    yard.bench.order(CommandKind::Enable).expect("a unit that stands ready");
    yard.run(Span::ms(4_300));
    yard
}

/// Authority is held on a vehicle.
pub(crate) fn authority() -> Yard {
    let mut yard = nominal();
    yard.bench.order(CommandKind::Arm(TrackId(1))).expect("a fresh and confident track");
    yard.run(Span::ms(1_500));
    yard
}

/// The thermal stage has stopped.
pub(crate) fn degraded() -> Yard {
    let mut yard = nominal();
    let a = yard.actor(UnitId::A);
    (a.mode, a.cause, a.speed_mm_s) = (Mode::Degraded, Cause::Lost(Guard::Thermal), 900);
    a.failing = Guards::default().with_guard(Guard::Thermal);
    yard.run(Span::ms(2_200));
    yard
}

/// A teammate's claims contradict each other: its records are refused, trust is lost.
pub(crate) fn hold_safe() -> Yard {
    let mut yard = authority();
    // Each is reported with how many there were of its reason.
    let counted = |n: usize| if n.is_multiple_of(3) { n as u64 / 3 + 1 } else { (n - n / 3) as u64 };
    for n in 0..23 {
        let reason = [Reason::Origin, Reason::Replayed, Reason::Replayed][n % 3];
        yard.bench.feed(&Feed::Refused(reason, Some(PeerId::UNIT_B), counted(n)));
    }
    let b = yard.actor(UnitId::B);
    b.heard = false;
    let a = yard.actor(UnitId::A);
    (a.mode, a.cause, a.speed_mm_s, a.authority) = (Mode::HoldSafe, Cause::Lost(Guard::Teammates), 0, None);
    a.failing = Guards::default().with_guard(Guard::Teammates);
    a.tracks.truncate(3);
    yard.run(Span::ms(1_300));
    yard
}

/// Two units fly.
pub(crate) fn aloft() -> Yard {
    let mut yard = nominal();
    for (unit, up_mm, nose) in [(UnitId::A, 2_960, 0.06), (UnitId::B, 3_020, -0.03)] {
        let attitude = Some(Attitude::new([1.0, 0.02, nose, 0.0]));
        let motion = ReportedMotion { up_mm, left_up_mm_s: [20, -40], charge: 830, attitude, sunlit: None };
        yard.actor(unit).motion = Some(motion);
    }
    yard.run(Span::ms(500));
    yard
}

/// A satellite has gone out of contact as planned; another one is in contact.
pub(crate) fn between_contacts() -> Yard {
    let mut yard = nominal();
    let attitude = Some(Attitude::new([0.17, 0.98, 0.1, 0.0]));
    let orbit = ReportedMotion { up_mm: 518_140_000, left_up_mm_s: [0, 0], charge: 790, attitude, sunlit: Some(true) };
    let contact = |left, next| Some(ReportedContact { left: Span::s(left), next: Some(Span::s(next)) });
    let a = yard.actor(UnitId::A);
    (a.motion, a.contact) = (Some(orbit), contact(1, 31));
    let b = yard.actor(UnitId::B);
    (b.motion, b.contact) = (Some(ReportedMotion { sunlit: Some(false), ..orbit }), contact(212, 5_400));
    yard.run(Span::s(1));
    yard.actor(UnitId::A).heard = false;
    yard.bench.feed(&Feed::Session(PeerId::UNIT_A, false));
    yard.run(Span::s(6));
    yard
}

/// A resume waits to be confirmed.
pub(crate) fn armed() -> Yard {
    let mut yard = nominal();
    yard.bench.act(Act::Now(Order::Command(UnitId::A, CommandKind::Hold))).expect("a hold");
    yard.run(Span::s(3));
    yard.bench.act(Act::Prepare(Order::Command(UnitId::A, CommandKind::Resume))).expect("a unit that can go on");
    yard.run(Span::ms(2_600));
    yard
}

/// An arming waits to be confirmed, below the images of its track.
pub(crate) fn arming() -> Yard {
    let mut yard = nominal();
    yard.picture(UnitId::A);
    yard.run(Span::ms(600));
    let order = Order::Command(UnitId::A, CommandKind::Arm(TrackId(1)));
    yard.bench.act(Act::Prepare(order)).expect("a fresh and confident track");
    yard.run(Span::ms(300));
    yard
}

/// Silence for 0.9 seconds.
pub(crate) fn stale() -> Yard {
    let mut yard = authority();
    yard.wait(Span::ms(900));
    yard
}

/// One unit is cut off, and orders to it go unanswered.
pub(crate) fn lost() -> Yard {
    let mut yard = nominal();
    let a = yard.actor(UnitId::A);
    (a.heard, a.obeys) = (false, false);
    yard.bench.feed(&Feed::Session(PeerId::UNIT_A, false));
    yard.run(Span::s(3));
    yard.bench.act(Act::Now(Order::Command(UnitId::A, CommandKind::Hold))).expect("a hold");
    yard.run(Span::s(4));
    yard
}

/// No report was ever received.
pub(crate) fn silent() -> Yard {
    let mut yard = Yard::new();
    yard.actors.iter_mut().for_each(|actor| actor.heard = false);
    yard.run(Span::s(2));
    yard
}

/// The paper's fault: a display that does not age, three seconds after the last report.
pub(crate) fn ablation() -> Yard {
    let display = [(DisplayRule::AgeOut, Requirement::Waived)].into();
    let policy = Policy { name: "display-age-waived".into(), display, ..Policy::default() };
    let mut yard = Yard::with_role(&[UnitId::A, UnitId::B], policy, Role::Supervise);
    yard.run(Span::s(3));
    yard.wait(Span::s(3));
    yard
}

/// A console that may only look.
pub(crate) fn view_only() -> Yard {
    let mut yard = Yard::with_role(&[UnitId::A, UnitId::B], Policy::default(), Role::View);
    yard.run(Span::s(3));
    yard
}

/// Four units and two hundred tracks, most of them lost.
pub(crate) fn crowd() -> Yard {
    let units = ["unit-a", "unit-b", "unit-c", "unit-d"].map(|name| UnitId::from_name(name).expect("a unit"));
    let mut yard = Yard::with_role(&units, Policy::default(), Role::Supervise);
    for round in 0..7 {
        for (at, actor) in yard.actors.iter_mut().enumerate() {
            let like = actor.tracks[0];
            actor.tracks = (0..8).map(|n| scattered(like, at as u32, round * 8 + n)).collect();
        }
        yard.run(Span::ms(600));
    }
    yard
}

/// Eight units: one is lost, one holds, one is degraded, the rest go on.
pub(crate) fn eight() -> Yard {
    let units: Vec<UnitId> = UnitId::all().take(8).collect();
    let mut yard = Yard::with_role(&units, Policy::default(), Role::Supervise);
    for (at, actor) in yard.actors.iter_mut().enumerate() {
        actor.tracks.truncate(usize::from(at % 2 == 0));
        (actor.mode, actor.cause) = if at == 7 { (Mode::Idle, Cause::Start) } else { (Mode::Ready, Cause::Operator) };
    }
    yard.actor(units[7]).speed_mm_s = 0;
    yard.run(Span::s(12));
    let d = yard.actor(units[3]);
    (d.mode, d.cause, d.failing) =
        (Mode::Degraded, Cause::Lost(Guard::Thermal), Guards::default().with_guard(Guard::Thermal));
    let a = yard.actor(UnitId::A);
    (a.mode, a.cause, a.speed_mm_s) = (Mode::HoldSafe, Cause::Lost(Guard::Teammates), 0);
    a.failing = Guards::default().with_guard(Guard::Teammates);
    yard.actor(units[5]).heard = false;
    yard.bench.feed(&Feed::Session(units[5].peer(), false));
    yard.run(Span::s(4));
    yard
}

/// Fifty thousand refusals a second at the gateway, of every kind.
pub(crate) fn flood() -> Yard {
    let mut yard = nominal();
    yard.flood = 50_000;
    yard.run(Span::s(8));
    yard
}

/// The `n`th of many tracks around a unit, in a spiral.
fn scattered(like: ReportedTrack, unit: u32, n: u32) -> ReportedTrack {
    let angle = f64::from(n) * 2.4 + f64::from(unit);
    let far = 2_500.0 * libm::sqrt(f64::from(n) + 1.0);
    let center = [(-16_000, -16_000), (16_000, 16_000), (-16_000, 16_000), (16_000, -16_000)][unit as usize % 4];
    ReportedTrack {
        id: TrackId(unit * 1000 + n),
        class: Class::ALL[n as usize % 4],
        x_mm: center.0 + (far * libm::cos(angle)) as i32,
        y_mm: center.1 + (far * libm::sin(angle)) as i32,
        confidence: (500 + (n * 37) % 480) as u16,
        ..like
    }
}

/// The picture as of a recording.
pub(crate) fn replayed(mut shown: Shown) -> (Shown, Tape) {
    shown.marks.replay = true;
    shown.marks.began = Some(Instant((shown.at.0 + 2_000_000).saturating_sub(8_100_000)));
    let moment = |ms, name: &str, truth| Moment { at: Span::ms(ms), what: name.to_owned(), truth };
    let moments = vec![
        moment(1_020, "unit-a READY: operator", false),
        moment(5_300, "unit-a PREPARE_TO_ACT: operator", false),
        moment(6_700, "insider-b: sends a report of unit-b that is a lie", true),
        moment(6_900, "unit-a HOLD_SAFE: unit-b contradicts itself", false),
    ];
    (shown, Tape { at: Span::ms(8_100), length: Span::s(9), lead: Span::s(2), moments, playing: false })
}
