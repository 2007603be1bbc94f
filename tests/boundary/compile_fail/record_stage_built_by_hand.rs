use wire::hop::Hop;
use wire::trust::{Accepted, Evidence, Record, stage};

fn accepted<'b>(message: Hop<'b>, evidence: Evidence, stage: stage::Accepted) -> Accepted<Hop<'b>> {
    Record { message, evidence, stage }
}

fn main() {}
