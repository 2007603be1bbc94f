use wire::command::Intent;
use wire::id::NodeId;
use wire::policy::Policy;
use wire::refusal::Refusal;
use wire::sign::{Keyring, Signed};
use wire::time::{Instant, Span};
use wire::trust::{Decoded, Rates, Roll};

struct Gateway {
    policy: Policy,
    operators: Vec<NodeId>,
    roll: Roll,
    rates: Rates,
    keys: Keyring,
}

fn hasty(gateway: &Gateway, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Result<(), Refusal> {
    let Gateway { policy, operators, roll, rates, keys } = gateway;
    let fresh = intent.fresh(policy, None, Span::s(1), Span::ZERO)?;
    let needed = fresh.within_rate(policy, rates, NodeId::CONSOLE, now)?;
    let _ = (operators, needed.standing(policy, roll, now)?.by_operator(policy, keys, signed)?);
    Ok(())
}

fn main() {}
