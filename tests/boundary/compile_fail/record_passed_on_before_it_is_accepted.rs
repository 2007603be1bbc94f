use wire::hop::Hop;
use wire::trust::{Accepted, Framed};

fn believed(_: Accepted<Hop<'_>>) {}

fn hasty(framed: Framed<'_>) {
    believed(framed.decode_hop().unwrap());
}

fn main() {}
