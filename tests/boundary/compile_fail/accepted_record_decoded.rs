use wire::report::Report;
use wire::trust::Accepted;

fn believed_as_sent(bytes: &[u8]) {
    let _ = wire::codec::decode::<Accepted<Report>>(bytes, 1024);
}

fn main() {}
