use wire::session::SessionMessage;
use wire::trust::{Accepted, Evidence, Record, stage};

fn accepted<'b>(message: SessionMessage<'b>, evidence: Evidence, stage: stage::Accepted) -> Accepted<SessionMessage<'b>> {
    Record { message, evidence, stage }
}

fn main() {}
