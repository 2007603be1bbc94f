use wire::report::Report;
use wire::trust::Accepted;

fn forwarded(record: &Accepted<Report>) -> Vec<u8> {
    wire::codec::encode(record)
}

fn main() {}
