use autonomy::health::Healthy;
use wire::policy::Waived;

fn all_is_well() -> Healthy {
    Healthy { waived: Waived::default() }
}

fn main() {}
