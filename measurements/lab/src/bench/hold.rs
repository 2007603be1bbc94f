//! `lab hold`: live duration of an operator's HOLD, from the hand to the unit and back to the display.
//!
//! A person without a window holds and resumes, over and over, in one long null attack. Each stage's time is the
//! recording's. With `--cut` the unit's connection to the broker is cut before the first and stays so: then the time is
//! that until the display reports a missing answer. It measures and prints; no test asserts its numbers.

use evidence::{SCHEMA_VERSION, Witnessed};
use ground_truth::Any;
use results::report::started;
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::{Context, out, plan};
use scenario::Settings;
use serde::Serialize;
use serde_json::json;
use stats::Sample;
use wire::codec::Text;
use wire::command::CommandKind;
use wire::event::{Event, Freshness, ShownAs};
use wire::feed::CommandStage;
use wire::id::{CommandId, NodeId, UnitId};
use wire::mode::Mode;
use wire::person::{Act, Order};

/// Time of the first HOLD: by then the script has the unit driving. Microseconds.
const FIRST_US: u64 = 8_000_000;
/// Time from one HOLD to the next; in between the unit is resumed and drives again.
const CYCLE_US: u64 = 2_500_000;
/// Time from a HOLD to the two steps that resume.
const RESUME_US: [u64; 2] = [1_200_000, 1_300_000];

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of HOLDs; 59 for a bound on the 95th percentile.
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=1_000))]
    holds: u64,
    /// Cut the link that they go over.
    #[arg(long)]
    cut: bool,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    cut: bool,
    given: u64,
    /// Stages of those given while the unit was driving; with the link cut, of all.
    stages: Vec<Stage>,
}

#[derive(Serialize)]
struct Stage {
    stage: &'static str,
    from_the_hand_ms: Sample,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let nominal = scenario::load(&plan::file_of(context, "nominal")?)?;
    let seconds = (FIRST_US + args.holds * CYCLE_US) as f64 / 1e6;
    let wanted = PlanOptions { rendered: true, ..PlanOptions::default() };
    let mut planned = plan::of_scenario(context, &nominal.soak(seconds, 0.0), &wanted)?;
    let Some(mut one) = planned.pop() else {
        return Err(Failure::new(Exit::NoEvidence, "nothing to run"));
    };
    if args.cut {
        let variation = &one.variation;
        one.variation.scenario =
            variation.with_settings(&cut(seconds)).map_err(|error| plan::unfit(variation, &error))?;
    }
    let hands: Vec<u64> = (0..args.holds).map(|n| FIRST_US + n * CYCLE_US).collect();
    let acts = hands.iter().flat_map(|at| cycle(*at, args.cut)).collect();
    let log = crate::measured::live_acts(&one.variation.scenario, &one.setup, context.seed, &context.stop, acts)?;
    let holds: Vec<Hold> = hands.iter().filter_map(|hand| Hold::find(&log, *hand)).collect();
    let stage = |(stage, at): (&'static str, fn(&Hold) -> Option<u64>)| {
        let counted = holds.iter().filter(|hold| args.cut || hold.held.is_some());
        let taken = counted.filter_map(|hold| Some((at(hold)?.saturating_sub(hold.hand)) as f64 / 1000.0));
        Stage { stage, from_the_hand_ms: Sample::from_values(taken) }
    };
    let stages = if args.cut { UNANSWERED.map(stage).into() } else { ANSWERED.map(stage).into() };
    let measured =
        Measured { schema_version: SCHEMA_VERSION, seed: context.seed, cut: args.cut, given: args.holds, stages };
    if context.json {
        out::print_json("bench-hold", &measured)?;
    } else {
        out::say(format_args!("{}", table(&measured)));
    }
    Ok(Exit::Fine)
}

/// A stage and the time at which a HOLD came to it.
type At = (&'static str, fn(&Hold) -> Option<u64>);

/// The stages of one that is answered.
const ANSWERED: [At; 6] = [
    ("the console's core has it", |hold| Some(hold.core)),
    ("the gateway has sent it", |hold| hold.sent),
    ("the unit has executed it", |hold| hold.executed),
    ("the unit is in HOLD_SAFE", |hold| hold.held),
    ("the console has the acknowledgement", |hold| hold.acknowledged),
    ("the display shows HOLD_SAFE, fresh", |hold| hold.shown),
];
/// And of one that is not.
const UNANSWERED: [At; 3] = [
    ("the console's core has it", |hold| Some(hold.core)),
    ("the gateway has sent it", |hold| hold.sent),
    ("the display says NOT ACKNOWLEDGED", |hold| hold.unanswered),
];

/// The link of commands, cut from a second before the first HOLD to the end.
fn cut(seconds: f64) -> Settings {
    let at_s = FIRST_US as f64 / 1e6 - 1.0;
    Settings::one("cut", json!([{ "at_s": at_s, "duration_s": seconds - at_s, "direction": "both" }]))
}

/// A HOLD at this time, and the two steps that end it, where they can.
fn cycle(at: u64, cut: bool) -> Vec<(u64, Act)> {
    let hold = (at, Act::Now(Order::Command(UnitId::A, CommandKind::Hold)));
    let resume = Order::Command(UnitId::A, CommandKind::Resume);
    let ends =
        [(at + RESUME_US[0], Act::Prepare(resume)), (at + RESUME_US[1], Act::Confirm(resume, Text::new("measured")))];
    std::iter::once(hold).chain(ends.into_iter().filter(|_| !cut)).collect()
}

/// Times at which a HOLD came to each stage, microseconds of the run.
struct Hold {
    /// Planned time of the person's HOLD: delays of the launcher and the pipe are in the stages after it.
    hand: u64,
    core: u64,
    sent: Option<u64>,
    executed: Option<u64>,
    held: Option<u64>,
    acknowledged: Option<u64>,
    shown: Option<u64>,
    /// Time at which the display reported that it is not acknowledged.
    unanswered: Option<u64>,
}

impl Hold {
    /// The one that was given at `hand`.
    fn find(log: &[Witnessed], hand: u64) -> Option<Self> {
        let of_cycle = || log.iter().filter(move |w| (hand..hand + CYCLE_US).contains(&w.at));
        let (core, id) = of_cycle().find_map(|w| {
            let Any::Service(Event::Act { act: Some(Act::Now(_)), command: Some(id), .. }) = w.entry.event else {
                return None;
            };
            Some((w.at, id))
        })?;
        let first = |stage: &dyn Fn(NodeId, &Any, CommandId) -> bool| {
            of_cycle().find(|w| stage(w.entry.node, &w.entry.event, id)).map(|w| w.at)
        };
        let held = first(&|node, event, _| {
            node == NodeId::UNIT_A && matches!(event, Any::Service(Event::Transition { to: Mode::HoldSafe, .. }))
        });
        Some(Self {
            hand,
            core,
            sent: first(&|_, event, id| {
                matches!(
                    event,
                    Any::Service(Event::Staged { command, stage: CommandStage::Sent }) if *command == id
                )
            }),
            executed: first(&|_, event, id| {
                matches!(
                    event,
                    Any::Service(Event::Executed { command, refused: None, .. }) if *command == id
                )
            }),
            held,
            acknowledged: first(
                &|_, event, id| matches!(event, Any::Service(Event::Acknowledged { command, .. }) if *command == id),
            ),
            shown: first(&|_, event, _| {
                let shown = (UnitId::A, Mode::HoldSafe, Freshness::Fresh);
                matches!(
                    event,
                    Any::Service(Event::Displayed { unit, mode, freshness, .. }) if (*unit, *mode, *freshness) == shown
                )
            }),
            unanswered: first(&|_, event, id| {
                let shown = Event::CommandShown { command: id, shown: ShownAs::NotAcknowledged };
                *event == Any::Service(shown)
            }),
        })
    }
}

fn table(measured: &Measured) -> String {
    let mut table = started();
    table.set_header(["from the hand until", "n", "mean ms", "p95 ms", "p95 below, ms (95 %)"]);
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.1}"));
    for Stage { stage, from_the_hand_ms: sample } in &measured.stages {
        let (mean, p95, bound) = (number(sample.mean), number(sample.p95), number(sample.p95_upper_95));
        table.add_row([(*stage).to_owned(), sample.n.to_string(), mean, p95, bound]);
    }
    let run = if measured.cut { "run whose command link is cut" } else { "null attack" };
    format!("{table}\n{} given in one live {run}, rendered, seed {}", measured.given, measured.seed)
}
