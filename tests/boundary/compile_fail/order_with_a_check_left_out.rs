use wire::command::Intent;
use wire::id::NodeId;
use wire::policy::Policy;
use wire::refusal::Refusal;
use wire::sign::{Keyring, Signed};
use wire::time::{Instant, Span};
use wire::trust::{Counters, Decoded, Rates, RevocationList};

const HASH: &[u8; 32] = &[0; 32];
const WHO: NodeId = NodeId::OPERATOR;

struct Unit {
    policy: Policy,
    operators: Vec<NodeId>,
    revoked: RevocationList,
    counters: Counters,
    rates: Rates,
    keys: Keyring,
}

type Verdict = Result<(), Refusal>;

fn without_a_role(unit: Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let young = intent.in_time(&unit.policy, None, Span::s(1))?;
    let admitted = young.admitted(&unit.policy, &unit.revoked, now)?;
    let new = admitted.not_repeated(&unit.policy, &unit.counters, HASH)?;
    let needed = new.within_rate(&unit.policy, &unit.rates, WHO, now)?.worth_verifying(&unit.policy, &unit.rates, now)?;
    needed.by_operator(&unit.policy, &unit.keys, signed)?;
    Ok(())
}

fn of_the_revoked(unit: Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let young = intent.in_time(&unit.policy, None, Span::s(1))?;
    let admitted = young.by_role(&unit.policy, &unit.operators)?;
    let new = admitted.not_repeated(&unit.policy, &unit.counters, HASH)?;
    let needed = new.within_rate(&unit.policy, &unit.rates, WHO, now)?.worth_verifying(&unit.policy, &unit.rates, now)?;
    needed.by_operator(&unit.policy, &unit.keys, signed)?;
    Ok(())
}

fn again(unit: Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let young = intent.in_time(&unit.policy, None, Span::s(1))?;
    let admitted = young.by_role(&unit.policy, &unit.operators)?.admitted(&unit.policy, &unit.revoked, now)?;
    let needed = admitted.within_rate(&unit.policy, &unit.rates, WHO, now)?.worth_verifying(&unit.policy, &unit.rates, now)?;
    needed.by_operator(&unit.policy, &unit.keys, signed)?;
    Ok(())
}

fn beyond_its_rate(unit: Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let young = intent.in_time(&unit.policy, None, Span::s(1))?;
    let admitted = young.by_role(&unit.policy, &unit.operators)?.admitted(&unit.policy, &unit.revoked, now)?;
    let new = admitted.not_repeated(&unit.policy, &unit.counters, HASH)?;
    let needed = new.worth_verifying(&unit.policy, &unit.rates, now)?;
    needed.by_operator(&unit.policy, &unit.keys, signed)?;
    Ok(())
}

fn not_worth_verifying(unit: Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let young = intent.in_time(&unit.policy, None, Span::s(1))?;
    let admitted = young.by_role(&unit.policy, &unit.operators)?.admitted(&unit.policy, &unit.revoked, now)?;
    let new = admitted.not_repeated(&unit.policy, &unit.counters, HASH)?;
    let needed = new.within_rate(&unit.policy, &unit.rates, WHO, now)?;
    needed.by_operator(&unit.policy, &unit.keys, signed)?;
    Ok(())
}

fn main() {}
