use wire::command::Intent;
use wire::id::NodeId;
use wire::policy::Policy;
use wire::refusal::Refusal;
use wire::sign::{Keyring, Signed};
use wire::time::{Instant, Span};
use wire::trust::{Decoded, Rates, RevocationList};

const WHO: NodeId = NodeId::CONSOLE;

struct Gateway {
    policy: Policy,
    operators: Vec<NodeId>,
    revoked: RevocationList,
    rates: Rates,
    keys: Keyring,
}

type Verdict = Result<(), Refusal>;

fn without_a_role(gateway: Gateway, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let fresh = intent.fresh(&gateway.policy, None, Span::s(1), Span::ZERO)?;
    let admitted = fresh.within_rate(&gateway.policy, &gateway.rates, WHO, now)?.admitted(&gateway.policy, &gateway.revoked, now)?;
    admitted.by_operator(&gateway.policy, &gateway.keys, signed)?;
    Ok(())
}

fn of_the_revoked(gateway: Gateway, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let fresh = intent.fresh(&gateway.policy, None, Span::s(1), Span::ZERO)?;
    let admitted = fresh.within_rate(&gateway.policy, &gateway.rates, WHO, now)?.by_role(&gateway.policy, &gateway.operators)?;
    admitted.by_operator(&gateway.policy, &gateway.keys, signed)?;
    Ok(())
}

fn beyond_its_rate(gateway: Gateway, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let fresh = intent.fresh(&gateway.policy, None, Span::s(1), Span::ZERO)?;
    let admitted = fresh.by_role(&gateway.policy, &gateway.operators)?.admitted(&gateway.policy, &gateway.revoked, now)?;
    admitted.by_operator(&gateway.policy, &gateway.keys, signed)?;
    Ok(())
}

fn main() {}
