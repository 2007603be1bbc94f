use wire::hop::Hop;
use wire::trust::{Accepted, Decoded, stage};

fn promoted(record: Decoded<Hop<'_>>) -> Accepted<Hop<'_>> {
    record.next(stage::Accepted(()))
}

fn main() {}
