use wire::hop::Hop;
use wire::trust::{Accepted, Evidence, Record};

fn accepted<'b>(message: Hop<'b>, evidence: Evidence) -> Accepted<Hop<'b>> {
    Record { message, evidence, stage: std::marker::PhantomData }
}

fn main() {}
