use wire::time::{Instant, PeerStamp, Span};

fn age(now: Instant, stamp: PeerStamp) -> Span {
    now.since(stamp)
}

fn main() {}
