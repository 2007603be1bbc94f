use wire::hop::Hop;
use wire::trust::{Decoded, SignedReport};

fn peek<'a>(record: &'a Decoded<Hop<'a>>, report: &'a Decoded<SignedReport<'a>>) {
    let _ = record.message();
    let _ = &report.message;
}

fn main() {}
