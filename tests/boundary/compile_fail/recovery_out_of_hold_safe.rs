use autonomy::health::Healthy;
use autonomy::state::{HoldSafe, Ready};

fn by_itself(stopped: HoldSafe, healthy: Healthy) -> Ready {
    stopped.recover(healthy)
}

fn main() {}
