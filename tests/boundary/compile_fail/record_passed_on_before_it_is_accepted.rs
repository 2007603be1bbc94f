use wire::session::SessionMessage;
use wire::trust::{Accepted, Framed};

fn believed(_: Accepted<SessionMessage<'_>>) {}

fn hasty(framed: Framed<'_>) {
    believed(framed.decode_session_message().unwrap());
}

fn main() {}
