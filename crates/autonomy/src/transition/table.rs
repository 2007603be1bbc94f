//! The transition table and its diagram, drawn from [`Machine::step`] itself.
//!
//! For every state and every stimulus, `step` is run once for each of the 2,048 sets of failing guards. The result
//! is written as a decision list: the first row that matches counts, a row without guards is for all that are left. The
//! list is exact, not a summary: a row stands only where all sets that reach it come out alike.
//!
//! The machines and orders in it are real: the states are stepped to, the orders pass through the command gate.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use wire::codec::{self, Text};
use wire::command::{CommandKind, Confirmation, Intent, Order};
use wire::id::{Boot, CommandId, NodeId, Nonce, Sequence, TrackId, UnitId, WorldId};
use wire::mode::{Because, Cause, Guard, Guards, Mode};
use wire::policy::{Policy, Waived};
use wire::settings::Settings;
use wire::sign::{Key, Keyring, Purpose};
use wire::time::{Instant, Span};
use wire::trust::RevocationList;

use super::authority::Mint;
use super::state::Machine;
use super::{Context, Effect, Stimulus, Timing};
use crate::command::{CommandGate, Ordered};
use crate::designation::Designated;
use crate::health::{Findings, Health};

/// The track that is designated, and another.
const TRACK: TrackId = TrackId(1);
const OTHER: TrackId = TrackId(2);
const VALUES: Settings = Settings { speed_mm_s: 3000, margin_mm: 1000, arm_permille: 600, keep_permille: 450 };
const LIFETIME: Span = Span::ms(5000);
const TIMING: Timing = Timing { hysteresis: Span::ms(1000), unrecovered: Span::ms(400) };

/// The order in which guards are distinguished. It puts those first that decide most.
const ORDER: [Guard; 13] = [
    Guard::Geofence,
    Guard::Lease,
    Guard::Teammates,
    Guard::Localisation,
    Guard::Drift,
    Guard::TimeBase,
    Guard::Lidar,
    Guard::Tracks,
    Guard::Depth,
    Guard::Thermal,
    Guard::Rgb,
    Guard::SealedLog,
    Guard::Designation,
];

/// A state with the conditions on which its decisions depend besides stimulus and guards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Start {
    Idle,
    Ready,
    ReadyUnderUnadmittedPolicy,
    PrepareToAct,
    PrepareToActExpired,
    Degraded,
    DegradedBlindTooLong,
    DegradedWholeLongEnough,
    HoldSafe,
}

const STARTS: [Start; 9] = [
    Start::Idle,
    Start::Ready,
    Start::ReadyUnderUnadmittedPolicy,
    Start::PrepareToAct,
    Start::PrepareToActExpired,
    Start::Degraded,
    Start::DegradedBlindTooLong,
    Start::DegradedWholeLongEnough,
    Start::HoldSafe,
];

impl Start {
    fn name(self) -> &'static str {
        match self {
            Start::Idle => "IDLE",
            Start::Ready => "READY",
            Start::ReadyUnderUnadmittedPolicy => "READY, policy admits no authority",
            Start::PrepareToAct => "PREPARE_TO_ACT",
            Start::PrepareToActExpired => "PREPARE_TO_ACT, authority expired",
            Start::Degraded => "DEGRADED",
            Start::DegradedBlindTooLong => "DEGRADED, blind for the unrecovered time",
            Start::DegradedWholeLongEnough => "DEGRADED, whole for the hysteresis time",
            Start::HoldSafe => "HOLD_SAFE",
        }
    }
}

/// A stimulus, in words and as an order.
const STIMULI: [(&str, Option<CommandKind>); 10] = [
    ("guards judged", None),
    ("Hold", Some(CommandKind::Hold)),
    ("Disarm", Some(CommandKind::Disarm)),
    ("Enable", Some(CommandKind::Enable)),
    ("Resume", Some(CommandKind::Resume)),
    ("Arm", Some(CommandKind::Arm(TRACK))),
    ("Arm another track", Some(CommandKind::Arm(OTHER))),
    ("Confirm", Some(CommandKind::Confirm(TRACK))),
    ("Confirm another track", Some(CommandKind::Confirm(OTHER))),
    ("Configure", Some(CommandKind::Configure(VALUES))),
];

/// Result of one step.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Outcome {
    from: Mode,
    to: Mode,
    cause: &'static str,
    effects: String,
}

/// A row: sets of failing guards, each of which suffices, and the outcome.
struct Row {
    failing: Vec<Vec<Guard>>,
    outcome: Outcome,
}

/// The whole document: diagram and table, as committed in `docs/state-machine.md`.
pub fn markdown() -> String {
    let (diagram, table) = drawn();
    format!("{INTRODUCTION}\n{diagram}\n{READING}\n{table}")
}

/// The diagram alone, a block of Mermaid text.
pub fn diagram() -> String {
    drawn().0
}

fn drawn() -> (String, String) {
    let bench = Bench::new();
    let mut table = String::from(
        "| state | stimulus | failing guards (first match) | next | cause | effects |\n|---|---|---|---|---|---|\n",
    );
    let mut edges = BTreeSet::new();
    for start in STARTS {
        for (stimulus, (name, _)) in STIMULI.iter().enumerate() {
            for row in bench.rows(start, stimulus) {
                let Outcome { from, to, cause, effects } = &row.outcome;
                if from != to {
                    let label = if *cause == "operator" { *name } else { *cause };
                    edges.insert((*from, *to, label));
                }
                let next = if cause.is_empty() { "stays" } else { to.name() };
                let line =
                    format!("| {} | {name} | {} | {next} | {cause} | {effects} |", start.name(), guards(&row.failing));
                table.push_str(&line);
                table.push('\n');
            }
        }
    }
    (states(&edges), table)
}

const INTRODUCTION: &str = "\
# The state machine

Drawn from `Machine::step` by `autonomy::transition::table`; a test holds this file equal to it. Do not edit.
";

const READING: &str = "\
## Every state, stimulus and set of guards

Rows of one state and stimulus are a decision list over all 2,048 sets of failing guards: the first row that matches
counts, and a row with `otherwise` is for all sets that are left. `lost` names the most telling guard that fails: trust
before subsystem, and among them in the order of `health::TRUST` and `health::SUBSYSTEM`.
";

fn guards(failing: &[Vec<Guard>]) -> String {
    let set = |guards: &Vec<Guard>| guards.iter().map(|g| g.name()).collect::<Vec<_>>().join(" and ");
    match failing {
        [only] if only.is_empty() => "otherwise".into(),
        sets => sets.iter().map(set).collect::<Vec<_>>().join(", or "),
    }
}

fn states(edges: &BTreeSet<(Mode, Mode, &str)>) -> String {
    let mut text = String::from("```mermaid\nstateDiagram-v2\n    [*] --> IDLE\n");
    for (from, to) in Mode::ALL.into_iter().flat_map(|from| Mode::ALL.map(|to| (from, to))) {
        let labels: Vec<&str> = edges.iter().filter(|e| (e.0, e.1) == (from, to)).map(|e| e.2).collect();
        if !labels.is_empty() {
            writeln!(text, "    {} --> {} : {}", from.name(), to.name(), labels.join(", "))
                .expect("a String takes all");
        }
    }
    text + "```\n"
}

/// Everything that steps are tried with.
struct Bench {
    orders: Vec<Option<Ordered>>,
    health: Vec<Health>,
    designation: [Result<Designated, Because>; 2],
}

impl Bench {
    fn new() -> Bench {
        let orders = STIMULI.iter().zip(1..).map(|((_, kind), n)| kind.map(|kind| ordered(kind, n))).collect();
        let health = (0..1 << Guard::ALL.len()).map(|set| health(Guards(set))).collect();
        Bench { orders, health, designation: [Ok(Designated::assumed(TRACK)), Err(Because::Itself)] }
    }

    /// The decision list for one state and stimulus.
    fn rows(&self, start: Start, stimulus: usize) -> Vec<Row> {
        let outcomes: Vec<Outcome> = (0..self.health.len()).map(|set| self.outcome(start, stimulus, set)).collect();
        let mut rows = Vec::new();
        decide(&outcomes, &mut Vec::new(), &mut Vec::new(), &mut rows);
        rows
    }

    fn outcome(&self, start: Start, stimulus: usize, set: usize) -> Outcome {
        let (machine, mut mint, now) = self.machine(start);
        let from = machine.mode();
        let stimulus = self.orders[stimulus].as_ref().map_or(Stimulus::Judged, Stimulus::Ordered);
        let lost = Guards(set as u16).contains(Guard::Designation);
        let (machine, effects) = self.step(machine, &mut mint, now, stimulus, set, lost);
        let mut cause = "";
        let mut words = Vec::new();
        for effect in &effects {
            match effect {
                Effect::Transition { cause: why, .. } => cause = name(*why),
                Effect::Minted { .. } => words.push("authority minted"),
                Effect::Revoked(_) => words.push("authority revoked"),
                Effect::Acted(_) => words.push("acts"),
                Effect::Refused(_) => words.push("refused: interlock"),
                Effect::Configured(_) => words.push("values set"),
            }
        }
        Outcome { from, to: machine.mode(), cause, effects: words.join(", ") }
    }

    /// A machine in the state `start`, stepped there, with its mint and the time it then is.
    fn machine(&self, start: Start) -> (Machine, Mint, Instant) {
        let mut mint = Mint::assumed(start != Start::ReadyUnderUnadmittedPolicy, WorldId(0), LIFETIME);
        let (t0, whole, blind) = (Instant(1_000_000), 0, 1 << Guard::Localisation as usize);
        let enable = |mint: &mut Mint| self.ordered(Machine::start(), mint, t0, 3);
        let degraded = |mint: &mut Mint| {
            let ready = enable(mint);
            self.step(ready, mint, t0, Stimulus::Judged, blind, false).0
        };
        let arm = |mint: &mut Mint| {
            let ready = enable(mint);
            self.ordered(ready, mint, t0, 5)
        };
        let (machine, now) = match start {
            Start::Idle => (Machine::start(), t0),
            Start::Ready | Start::ReadyUnderUnadmittedPolicy => (enable(&mut mint), t0),
            Start::PrepareToAct => (arm(&mut mint), t0),
            Start::PrepareToActExpired => (arm(&mut mint), t0 + LIFETIME),
            Start::Degraded => (degraded(&mut mint), t0),
            Start::DegradedBlindTooLong => (degraded(&mut mint), t0 + TIMING.unrecovered),
            Start::DegradedWholeLongEnough => {
                let lost = degraded(&mut mint);
                let mended = self.step(lost, &mut mint, t0, Stimulus::Judged, whole, false).0;
                (mended, t0 + TIMING.hysteresis)
            }
            Start::HoldSafe => (self.ordered(Machine::start(), &mut mint, t0, 1), t0),
        };
        (machine, mint, now)
    }

    fn ordered(&self, machine: Machine, mint: &mut Mint, now: Instant, stimulus: usize) -> Machine {
        let order = self.orders[stimulus].as_ref().expect("invariant: all stimuli but the first are orders");
        self.step(machine, mint, now, Stimulus::Ordered(order), 0, false).0
    }

    fn step(
        &self,
        machine: Machine,
        mint: &mut Mint,
        now: Instant,
        stimulus: Stimulus<'_>,
        set: usize,
        designation_lost: bool,
    ) -> (Machine, super::Effects) {
        let designation = &self.designation[usize::from(designation_lost)];
        let mut ctx = Context { now, health: &self.health[set], designation, mint, timing: TIMING };
        machine.step(stimulus, &mut ctx)
    }
}

/// Splits the sets that fail `fail` and hold `hold` guard by guard until all that are left come out alike.
fn decide(outcomes: &[Outcome], fail: &mut Vec<Guard>, hold: &mut Vec<Guard>, rows: &mut Vec<Row>) {
    let reached = |set: usize| {
        let set = Guards(set as u16);
        fail.iter().all(|g| set.contains(*g)) && !hold.iter().any(|g| set.contains(*g))
    };
    let mut reaching = (0..outcomes.len()).filter(|set| reached(*set)).map(|set| &outcomes[set]);
    let first = reaching.next().expect("invariant: fail and hold are disjoint");
    if reaching.all(|outcome| outcome == first) {
        match rows.last_mut().filter(|row| row.outcome == *first && !fail.is_empty()) {
            Some(row) => row.failing.push(fail.clone()),
            None => rows.push(Row { failing: vec![fail.clone()], outcome: first.clone() }),
        }
        return;
    }
    let next = ORDER[fail.len() + hold.len()];
    fail.push(next);
    decide(outcomes, fail, hold, rows);
    fail.pop();
    hold.push(next);
    decide(outcomes, fail, hold, rows);
    hold.pop();
}

fn name(cause: Cause) -> &'static str {
    match cause {
        Cause::Start => "start",
        Cause::Operator => "operator",
        Cause::Lost(Guard::Designation) => "designation lost",
        Cause::Lost(guard) if crate::health::TRUST.contains(&guard) => "trust lost",
        Cause::Lost(_) => "subsystem lost",
        Cause::Recovered => "recovered",
        Cause::Acted => "acted",
        Cause::Expired => "expired",
        Cause::Unrecovered(_) => "unrecovered",
    }
}

/// Health in which exactly the guards of `set` fail; designation is no part of it.
fn health(set: Guards) -> Health {
    let failing = set.iter().filter(|guard| *guard != Guard::Designation);
    let findings =
        failing.fold(Findings::default(), |findings, guard| findings.with_finding(guard, Some(Because::Itself)));
    Health::judge(findings, Guards::default(), Waived::default())
}

/// An order that has passed the command gate.
fn ordered(kind: CommandKind, n: u64) -> Ordered {
    use sha2::Digest;
    let (operator, nonce, now, policy) = (NodeId::OPERATOR, Nonce(n), Instant(0), Policy::default());
    let key = Key::from_bytes(&[1; 32]);
    let mut keys = Keyring::default();
    keys.insert(operator, &key.public());
    let mut gate = CommandGate::new(UnitId::A, vec![operator], Span::s(1));
    gate.issue(nonce, now);
    let report = b"of both tracks";
    gate.reported(report, [TRACK, OTHER].into_iter().map(|track| (track, (0, 0))));
    let shown = kind.rests_on_display().map(|_| sha2::Sha256::digest(report).into());
    let id = CommandId { operator, boot: Boot(1), sequence: Sequence(n) };
    gate.admit(
        &policy,
        &keys,
        &RevocationList::new(&[], now),
        now,
        &signed_order(&key, &Intent { id, unit: UnitId::A, nonce, kind, reason: Text::new("table"), tag: None, shown }),
    )
    .expect("invariant: the order is signed, in time and confirmed")
}

/// An order as an operator's console sends it: the signed intent and, away from safe, its signed confirmation.
pub(crate) fn signed_order(key: &Key, intent: &Intent) -> Vec<u8> {
    use minicbor::bytes::ByteSlice;
    use sha2::Digest;
    let signed = key.sign(Purpose::Intent, &codec::encode(intent));
    let hash = sha2::Sha256::digest(&signed).into();
    let confirmation = key.sign(Purpose::Confirmation, &codec::encode(&Confirmation { id: intent.id, intent: hash }));
    let confirmation = (!intent.kind.towards_safe()).then(|| <&ByteSlice>::from(confirmation.as_slice()));
    codec::encode(&Order { intent: <&ByteSlice>::from(signed.as_slice()), confirmation })
}

#[cfg(test)]
mod tests {
    use wire::refusal::Refusal;

    use super::*;

    #[test]
    fn only_arm_with_all_guards_enters_preparetoact() {
        let bench = Bench::new();
        for (start, stimulus) in every_pair() {
            for set in 0..bench.health.len() {
                let outcome = bench.outcome(start, stimulus, set);
                if outcome.to == Mode::PrepareToAct && outcome.from != Mode::PrepareToAct {
                    assert_eq!((start, STIMULI[stimulus].0, set), (Start::Ready, "Arm", 0));
                }
            }
        }
    }

    #[test]
    fn act_needs_authority_confirmation_and_every_guard() {
        let bench = Bench::new();
        for (start, stimulus) in every_pair() {
            for set in 0..bench.health.len() {
                if bench.outcome(start, stimulus, set).effects.contains("acts") {
                    assert_eq!((start, STIMULI[stimulus].0, set), (Start::PrepareToAct, "Confirm", 0));
                }
            }
        }
    }

    /// The designation of another track also keeps no authority.
    #[test]
    fn other_tracks_designation_grants_no_act() {
        let mut bench = Bench::new();
        let held = |bench: &Bench| bench.machine(Start::PrepareToAct);
        let (judged, confirmed) = (held(&bench), held(&bench));
        bench.designation[0] = Ok(Designated::assumed(OTHER));
        let (machine, mut mint, now) = judged;
        let (machine, effects) = bench.step(machine, &mut mint, now, Stimulus::Judged, 0, false);
        assert!(machine.authority().is_none(), "{effects:?}");
        assert!(effects.iter().any(|e| matches!(e, Effect::Revoked(_))), "{effects:?}");
        let (machine, mut mint, now) = confirmed;
        let confirm = bench.orders[7].as_ref().expect("Confirm");
        let (_, effects) = bench.step(machine, &mut mint, now, Stimulus::Ordered(confirm), 0, false);
        assert!(matches!(effects[..], [Effect::Refused(Refusal::Interlock { .. })]), "{effects:?}");
    }

    #[test]
    fn authority_carries_its_world_and_serial_number() {
        let bench = Bench::new();
        let mut mint = Mint::assumed(true, WorldId(7), LIFETIME);
        let mut machine = bench.ordered(Machine::start(), &mut mint, Instant(1_000_000), 3);
        for serial in [1, 2] {
            let held = bench.ordered(machine, &mut mint, Instant(1_000_000), 5);
            let authority_id = held.authority().map(|authority| (authority.world(), authority.serial()));
            assert_eq!(authority_id, Some((WorldId(7), serial)));
            machine = bench.ordered(held, &mut mint, Instant(1_000_000), 2);
        }
    }

    #[test]
    fn any_failing_guard_ends_authority_and_is_named() {
        let bench = Bench::new();
        for set in 1..bench.health.len() {
            let (machine, mut mint, now) = bench.machine(Start::PrepareToAct);
            let failing = Guards(set as u16);
            let lost = failing.contains(Guard::Designation);
            let (machine, effects) = bench.step(machine, &mut mint, now, Stimulus::Judged, set, lost);
            assert!(machine.authority().is_none(), "{failing:?}");
            let Some(Effect::Transition { cause: Cause::Lost(named), .. }) = effects.last() else {
                panic!("{failing:?} gave {effects:?}");
            };
            assert!(failing.contains(*named), "{failing:?} gave {named:?}");
            assert!(effects.iter().any(|e| matches!(e, Effect::Revoked(r) if r.cause == Cause::Lost(*named))));
        }
    }

    #[test]
    fn hold_safe_is_left_by_resume_alone() {
        let bench = Bench::new();
        for (stimulus, (name, _)) in STIMULI.iter().enumerate() {
            for set in 0..bench.health.len() {
                if bench.outcome(Start::HoldSafe, stimulus, set).to != Mode::HoldSafe {
                    assert_eq!((*name, set & !(1 << Guard::Designation as usize)), ("Resume", 0));
                }
            }
        }
    }

    fn every_pair() -> impl Iterator<Item = (Start, usize)> {
        STARTS.into_iter().flat_map(|start| (0..STIMULI.len()).map(move |stimulus| (start, stimulus)))
    }
}
