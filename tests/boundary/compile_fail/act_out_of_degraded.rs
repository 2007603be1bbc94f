use autonomy::designation::Designated;
use autonomy::health::Healthy;
use autonomy::state::Degraded;

fn act(degraded: Degraded, order: (), healthy: Healthy, designated: &Designated) {
    let _ = degraded.act(order, healthy, designated);
}

fn main() {}
