use wire::trust::{Accepted, Ordered, SignedReport};

fn hasty(ordered: Ordered<SignedReport<'_>>) -> Accepted<SignedReport<'_>> {
    ordered.accept_message()
}

fn main() {}
