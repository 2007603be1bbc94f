use wire::policy::Policy;
use wire::sign::Keyring;
use wire::trust::{Fresh, SignedReport};

fn hasty(report: Fresh<SignedReport<'_>>, policy: &Policy, keys: &Keyring) {
    let _ = report.by_signature(policy, keys);
}

fn main() {}
