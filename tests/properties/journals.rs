//! Every core, fed its input journal again, gives the same bytes: no other input reaches a result.

use holdsafe_tests::variations;
use twin::clock::HostClock;
use twin::part::make::part;
use twin::trial::start;
use wire::core::Core;

#[test]
fn every_core_reproduces_its_outputs_bytewise() {
    for name in ["nominal", "replay", "teammate", "thermal_loss"] {
        let ready = variations(name).into_iter().next().expect("a variation");
        let (topology, mut twin) = start(&ready.scenario, &ready.setup, 7, true).expect("a shipped scenario starts");
        twin.run_until(topology.duration);
        twin.finish(1_500_000);
        let journals = twin.journals().expect("they were asked for");
        for (member, journal) in topology.members.iter().zip(journals) {
            let draw = topology.clocks[member.host as usize];
            let now = HostClock { zero: draw.zero_us, drift_ppm: draw.drift_ppm }.read(0);
            let mut core = part(member, now).expect("a core is made twice");
            while core.output().is_some() {}
            for (i, entry) in journal.iter().enumerate() {
                core.handle(entry.now, &entry.input);
                let outputs: Vec<_> = std::iter::from_fn(|| core.output()).collect();
                assert_eq!(outputs, entry.outputs, "{name}: {} at input {i}", member.node());
            }
            assert!(!journal.is_empty(), "{name}: {} was never fed", member.node());
        }
    }
}
