use wire::session::SessionMessage;
use wire::trust::{Accepted, Decoded, stage};

fn promoted(record: Decoded<SessionMessage<'_>>) -> Accepted<SessionMessage<'_>> {
    record.next(stage::Accepted(()))
}

fn main() {}
