//! A recording of a console on the bench, opened as `holdsafe watch --window` does it.

use std::fs::{self, File};
use std::path::PathBuf;

use console::process::ProcessConfig;
use console::process::player::{Player, READING};
use link::input_journal::{Header, Writer};
use wire::id::{Boot, NodeId, UnitId};
use wire::mode::Mode;
use wire::person::Role;
use wire::policy::Policy;
use wire::time::{Instant, Span};

use crate::bench::{Bench, making};

/// The recording of `bench`, in a folder of this name.
fn recorded(bench: &Bench, name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(folder.join("inputs")).unwrap();
    let (setup, config) =
        making(&[UnitId::A, UnitId::B], Policy::default(), Role::Supervise, vec![], Bench::revocations());
    let config = ProcessConfig { setup, config, window: None };
    fs::write(folder.join(READING), serde_json::to_vec(&config.to_read()).unwrap()).unwrap();
    let header = Header { node: NodeId::CONSOLE, boot: Boot(1), started: bench.journal[0].0 };
    let log = File::create(folder.join("inputs").join(format!("{}.cbor", NodeId::CONSOLE))).unwrap();
    let mut log = Writer::new(log, header, 1 << 24).unwrap();
    for (now, input, outputs) in &bench.journal {
        log.input(*now, input).unwrap();
        outputs.iter().for_each(|output| log.output(output).unwrap());
    }
    log.flush().unwrap();
    folder
}

/// Else at the first change of mode, and at its beginning where there is none.
#[test]
fn recording_opens_where_a_unit_first_holds() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Idle, Span::s(2));
    let folder = recorded(&bench, "unchanged");
    assert_eq!(Player::open(&folder).unwrap().0.position(), Span::ZERO);
    let begun = bench.journal[0].0;
    bench.reports(Mode::Ready, Span::s(2));
    let mode = |player: &Player| player.shown().units[0].state.get().0.mode;
    assert_eq!(mode(&Player::open(&recorded(&bench, "enabled")).unwrap().0), Mode::Ready);
    let before = bench.now;
    bench.reports(Mode::HoldSafe, Span::s(2));
    let (mut player, _) = Player::open(&recorded(&bench, "changed")).unwrap();
    assert_eq!(mode(&player), Mode::HoldSafe);
    assert!(
        player.position() >= before.since(begun) && player.position() < before.since(begun) + Span::s(1),
        "{}",
        player.position()
    );
    player.step(-1);
    assert_eq!(mode(&player), Mode::Ready, "just before it");
}

#[test]
fn recording_counts_time_from_the_runs_start() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Idle, Span::s(3));
    let (mut player, _) = Player::open(&recorded(&bench, "timed")).unwrap();
    let begun = bench.journal[0].0;
    assert_eq!((player.lead(), player.shown().marks.began), (Span::ZERO, Some(begun)));
    let run = Instant(begun.0 + 1_200_000);
    player.count_from(run);
    assert_eq!((player.lead(), player.shown().marks.began), (Span::ms(1200), Some(run)));
}
