use autonomy::health::Healthy;
use autonomy::state::{Machine, Ready};

fn ready(healthy: Healthy) -> Machine {
    Machine::Ready(Ready { healthy })
}

fn main() {}
