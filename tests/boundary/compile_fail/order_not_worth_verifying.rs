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

fn hasty(unit: &Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Result<(), Refusal> {
    let Unit { policy, operators, roll, counters, rates, keys } = unit;
    let young = intent.in_time(policy, None, Span::s(1))?;
    let admitted = young.by_role(policy, operators)?.standing(policy, roll, now)?;
    let new = admitted.not_repeated(policy, counters, &[0; 32])?;
    new.within_rate(policy, rates, operators[0], now)?.by_operator(policy, keys, signed)?;
    Ok(())
}

fn main() {}
