use console::model::Model;
use wire::id::PeerId;
use wire::policy::Waived;
use wire::trust::{Decoded, SignedReport};

fn shown(model: &mut Model, report: &Decoded<SignedReport<'_>>) {
    model.report(report, PeerId::UNIT_A, Waived::default(), None);
}

fn main() {}
