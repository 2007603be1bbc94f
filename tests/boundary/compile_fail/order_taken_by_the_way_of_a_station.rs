use wire::command::Intent;
use wire::id::NodeId;
use wire::policy::Policy;
use wire::refusal::Refusal;
use wire::sign::{Keyring, Signed};
use wire::time::{Instant, Span};
use wire::trust::{Counters, Decoded, Rates, Roll};

struct Unit {
    policy: Policy,
    operators: Vec<NodeId>,
    roll: Roll,
    counters: Counters,
    rates: Rates,
    keys: Keyring,
}

fn hasty(unit: &mut Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Result<(), Refusal> {
    let Unit { policy, operators, roll, counters, rates, keys } = unit;
    let fresh = intent.fresh(policy, None, Span::s(1), Span::ZERO)?;
    let needed = fresh.within_rate(policy, rates, operators[0], now)?;
    let admitted = needed.by_role(policy, operators)?.standing(policy, roll, now)?;
    admitted.by_operator(policy, keys, signed)?.once(policy, counters, &[0; 32])?;
    Ok(())
}

fn main() {}
