use wire::session::SessionMessage;
use wire::trust::{Decoded, SignedReport};

fn peek<'a>(record: &'a Decoded<SessionMessage<'a>>, report: &'a Decoded<SignedReport<'a>>) {
    let _ = record.message();
    let _ = &report.message;
}

fn main() {}
