use autonomy::health::Healthy;
use autonomy::state::PrepareToAct;
use wire::mode::Cause;

fn twice(held: PrepareToAct, one: Healthy, other: Healthy) {
    let _ = held.give_up(one, Cause::Expired);
    let _ = held.give_up(other, Cause::Expired);
}

fn main() {}
