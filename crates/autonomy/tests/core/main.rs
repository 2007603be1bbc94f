//! The whole core, driven through its inputs: bytes in, bytes out, on a virtual clock.

#![expect(clippy::unwrap_used, clippy::wildcard_enum_match_arm, reason = "a test says what it expects and no more")]

mod bench;
mod commands;
mod modes;
mod pilot;
mod stored;
mod teammates;

/// The committed snapshot of `Machine::step`. With `HOLDSAFE_RENEW` set it is written again; then read the diff.
#[test]
fn the_committed_table_is_the_snapshot_of_step() {
    let drawn = autonomy::transition::table::markdown();
    if std::env::var_os("HOLDSAFE_RENEW").is_some() {
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/state-machine.md"), &drawn).unwrap();
    }
    let committed = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/state-machine.md")).unwrap();
    assert!(drawn == committed, "docs/state-machine.md is not what step does");
}
