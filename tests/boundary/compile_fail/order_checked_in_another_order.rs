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

fn role_after_admitted(unit: Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let young = intent.in_time(&unit.policy, None, Span::s(1))?;
    let admitted = young.admitted(&unit.policy, &unit.revoked, now)?.by_role(&unit.policy, &unit.operators)?;
    let new = admitted.not_repeated(&unit.policy, &unit.counters, HASH)?;
    let needed = new.within_rate(&unit.policy, &unit.rates, WHO, now)?.worth_verifying(&unit.policy, &unit.rates, now)?;
    needed.by_operator(&unit.policy, &unit.keys, signed)?;
    Ok(())
}

fn rate_before_repetition(unit: Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let young = intent.in_time(&unit.policy, None, Span::s(1))?;
    let admitted = young.by_role(&unit.policy, &unit.operators)?.admitted(&unit.policy, &unit.revoked, now)?;
    let needed = admitted.within_rate(&unit.policy, &unit.rates, WHO, now)?.worth_verifying(&unit.policy, &unit.rates, now)?;
    let new = needed.not_repeated(&unit.policy, &unit.counters, HASH)?;
    new.by_operator(&unit.policy, &unit.keys, signed)?;
    Ok(())
}

fn out_of_its_counter(mut unit: Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let young = intent.in_time(&unit.policy, None, Span::s(1))?;
    let admitted = young.by_role(&unit.policy, &unit.operators)?.admitted(&unit.policy, &unit.revoked, now)?;
    let new = admitted.not_repeated(&unit.policy, &unit.counters, HASH)?;
    let needed = new.within_rate(&unit.policy, &unit.rates, WHO, now)?.worth_verifying(&unit.policy, &unit.rates, now)?;
    needed.by_operator(&unit.policy, &unit.keys, signed)?.unrepeated(&unit.policy, &mut unit.counters, HASH)?;
    Ok(())
}

fn by_the_way_of_a_request(mut unit: Unit, intent: Decoded<Intent>, signed: &Signed<'_>, now: Instant) -> Verdict {
    let fresh = intent.fresh(&unit.policy, None, Span::s(1), Span::ZERO)?;
    let needed = fresh.within_rate(&unit.policy, &unit.rates, WHO, now)?;
    let admitted = needed.by_role(&unit.policy, &unit.operators)?.admitted(&unit.policy, &unit.revoked, now)?;
    let attributed = admitted.by_operator(&unit.policy, &unit.keys, signed)?;
    attributed.accept_once(&unit.policy, &mut unit.counters, HASH)?;
    Ok(())
}

fn main() {}
