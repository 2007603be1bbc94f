use wire::hop::Hop;
use wire::trust::{Accepted, Evidence, Record, stage};

fn accepted<'b>(message: Hop<'b>, evidence: Evidence) -> Accepted<Hop<'b>> {
    Record { message, evidence, stage: stage::Accepted(()) }
}

fn main() {}
