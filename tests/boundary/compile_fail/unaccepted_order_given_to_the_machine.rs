use autonomy::state::Machine;
use autonomy::transition::{Context, Stimulus};
use wire::command::Intent;

fn obey(machine: Machine, context: &mut Context<'_>, intent: &Intent) {
    let _ = machine.step(Stimulus::Ordered(intent), context);
}

fn main() {}
