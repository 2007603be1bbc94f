use autonomy::fork::Fork;
use autonomy::state::Machine;
use wire::id::WorldId;

fn carried(machine: &Machine) -> Machine {
    machine.fork(&Fork { world: WorldId(2) })
}

fn main() {}
