use wire::hop::Hop;
use wire::trust::{Accepted, Decoded};

fn promoted(record: Decoded<Hop<'_>>) -> Accepted<Hop<'_>> {
    record.pass()
}

fn main() {}
