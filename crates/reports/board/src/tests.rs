//! Hostile files: each is refused, with the row and the reason; and files of several contributors.

use std::collections::BTreeMap;

use evidence::trial::Outcome;
use guest::Conduct;

use super::*;

fn key(number: u8) -> ContributorKey {
    ContributorKey::from_bytes(&[number; 32])
}

/// A row of `n` trials, harmful where it is bare.
fn row(conduct: Conduct, scenario: &str, n: u64) -> BoardRow {
    let class = if conduct == Conduct::Bare { Outcome::Late } else { Outcome::HoldSafe };
    let log = |i| digest(format!("{} {scenario} {i}", conduct.name()).as_bytes());
    let trials: Vec<BoardTrial> = (0..n).map(|i| BoardTrial { class, log: log(i) }).collect();
    let some_digest = digest(b"input");
    BoardRow {
        guest: GuestIdentity {
            name: "mine".to_owned(),
            files: BTreeMap::from([(String::new(), digest(b"file")), ("mine.py".to_owned(), digest(b"program"))]),
        },
        conduct,
        scenario: scenario.to_owned(),
        cell: None,
        platform: "ground".to_owned(),
        world: None,
        inputs: Inputs { scenario: some_digest.clone(), policy: some_digest.clone(), platform: some_digest.clone() },
        seed: 7,
        outcomes: BoardRow::counted(&trials),
        availability: Availability { routed: n, passed: 2 * n, points: 3 * n, steps: 90, ..Availability::default() },
        trials,
        repeatable: true,
        waived: None,
        program: ProgramIdentity {
            version: "0.1.0".to_owned(),
            commit: "not recorded".to_owned(),
            sources: some_digest,
        },
        host: Host { target: "x86_64-linux".to_owned(), build: "debug".to_owned(), confined: true },
        contributor: Contributor { name: "A. Tester".to_owned(), key: String::new() },
    }
}

fn signed(row: BoardRow) -> SignedRow {
    SignedRow::new(row, &key(1)).expect("a row within its bounds")
}

/// Two attacks, bare and guarded.
fn board() -> Board {
    let mut board = Board::default();
    for (conduct, scenario) in [(Conduct::Guarded, "jump"), (Conduct::Bare, "freeze"), (Conduct::Bare, "jump")] {
        board.add(signed(row(conduct, scenario, 2))).expect("added");
    }
    board
}

fn fault(text: &str) -> String {
    Board::verified(text).expect_err("a fault").to_string()
}

/// Lines of the file exchanged.
fn exchanged(text: &str, one: usize, two: usize) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    lines.swap(one, two);
    lines.join("\n") + "\n"
}

#[test]
fn written_board_is_read_as_it_was() {
    for board in [Board::default(), board()] {
        assert_eq!(Board::verified(&board.text()), Ok(board));
    }
    let names: Vec<String> = board().rows().iter().map(|signed| signed.row.title()).collect();
    assert_eq!(names[0], "mine bare, freeze, own scene, seed 7");
    assert_eq!(names[2], "mine guarded, jump, own scene, seed 7");
}

#[test]
fn altered_counts_are_refused_with_their_row() {
    let text = board().text();
    let counts = text.replacen("{\"LATE\":2}", "{\"LATE\":1}", 1);
    assert_eq!(
        fault(&counts),
        "row 1 (mine bare, freeze, own scene, seed 7): outcomes: LATE 1 is stated, the trials have 2"
    );
    let harmless = text.lines().map(|line| match line.contains("guarded") {
        true => line.to_owned(),
        false => line.replace("\"LATE\"", "\"NOMINAL\""),
    });
    let harmless = harmless.collect::<Vec<_>>().join("\n") + "\n";
    assert!(fault(&harmless).starts_with("row 1 (mine bare, freeze, own scene, seed 7): signature: not the"));
    let passed = text.replacen("\"passed\":4", "\"passed\":7", 1);
    assert!(fault(&passed).contains("availability.passed: at most 6 expected, got 7"));
}

#[test]
fn every_altered_byte_is_refused() {
    let text = board().text();
    for index in 0..text.len() {
        let mut bytes = text.clone().into_bytes();
        bytes[index] = if bytes[index] == b'1' { b'2' } else { b'1' };
        let changed = String::from_utf8(bytes).expect("ASCII");
        assert!(Board::verified(&changed).is_err(), "byte {index}");
    }
}

#[test]
fn every_shortened_file_is_refused() {
    let text = board().text();
    assert!((0..text.len()).all(|length| Board::verified(&text[..length]).is_err()));
    assert!(Board::verified(&(text + "\n")).is_err());
}

#[test]
fn reordered_and_repeated_rows_are_refused() {
    let text = board().text();
    assert!(
        fault(&exchanged(&text, 1, 2)).contains("row 2 (mine bare, freeze, own scene, seed 7): order: the row belongs")
    );
    let line = text.lines().nth(1).expect("a row");
    let doubled = text.replacen(line, &format!("{line}\n{line}"), 1);
    assert!(fault(&doubled).contains("row 2 (mine bare, freeze, own scene, seed 7): duplicate: row 1 is of the same"));
    let mut board = board();
    let repeated = board.add(signed(row(Conduct::Bare, "jump", 1))).expect_err("a duplicate with fewer trials");
    assert!(repeated.to_string().contains("duplicate: row 2 is of the same guest"), "{repeated}");
}

#[test]
fn other_spellings_of_a_row_are_refused() {
    let text = board().text();
    for (from, to, reason) in [
        ("\"seed\":7", "\"seed\":7,\"seed\":7", "row 1: duplicate field `seed`"),
        ("{\"LATE\":2}", "{\"LATE\":9,\"LATE\":2}", "row 1: another spelling than the canonical one"),
        ("\"seed\":7", "\"seed\": 7", "row 1: another spelling than the canonical one"),
        ("\"seed\":7", "\"seed\":7.0", "row 1: invalid type: floating point `7.0`, expected u64"),
        ("\"seed\":7", "\"seed\":-7", "row 1: invalid value: integer `-7`, expected u64"),
        ("\"seed\":7", "\"seed\":\"7\"", "row 1: invalid type: string \"7\", expected u64"),
        ("\"seed\":7", "\"sead\":7", "row 1: unknown field `sead`"),
        ("\"seed\":7,", "", "row 1: missing field `seed`"),
        ("\"conduct\":\"bare\"", "\"conduct\":\"brave\"", "row 1: unknown variant `brave`"),
        ("\"LATE\":2", "\"LATER\":2", "row 1: unknown variant `LATER`"),
        ("\"cell\"", "\"cell\"", ""),
    ] {
        let changed = text.replacen(from, to, 1);
        match reason {
            "" => assert_eq!(changed, text, "an absent cell has no text"),
            _ => assert!(fault(&changed).contains(reason), "{}", fault(&changed)),
        }
    }
}

#[test]
fn deep_and_huge_files_are_refused() {
    let text = board().text();
    let deep = text.replacen("\"seed\":7", &format!("\"seed\":{}", "[".repeat(100_000)), 1);
    assert!(fault(&deep).contains("row 1: invalid type: sequence") || fault(&deep).contains("recursion"));
    let long = text.replacen("\"seed\":7", &format!("\"seed\":{}7", " ".repeat(300_000)), 1);
    assert!(fault(&long).contains("bytes, at most 262144 expected"), "{}", fault(&long));
    let huge = " ".repeat(MAX_FILE_BYTES as usize + 1);
    assert_eq!(fault(&huge), "16777217 bytes, at most 16777216 expected");
    let (head, _) = text.split_once('\n').expect("a head");
    let many = format!("{head}\n{}{{}}\n]}}\n", "{},\n".repeat(MAX_ROWS));
    assert!(fault(&many).starts_with("4097 rows, at most 4096 expected"));
}

#[test]
fn unknown_versions_and_other_files_are_named() {
    let text = board().text();
    let newer = text.replacen("\"schema_version\":1", "\"schema_version\":2", 1);
    assert_eq!(fault(&newer), "line 1: schema_version 1 expected, got 2; a newer holdsafe reads it");
    for other in ["", "\n", "{}\n", "[]\n", "{\"kind\":\"guests\",\"schema_version\":1,\"rows\":[\n]}\n"] {
        assert!(matches!(Board::verified(other), Err(BoardError::Head)), "{other}");
    }
    let indented = text.replacen("[", "[ ", 1);
    assert_eq!(Board::verified(&indented), Err(BoardError::Head));
}

#[test]
fn signature_counts_for_its_key_alone() {
    let mut forged = signed(row(Conduct::Bare, "jump", 2));
    forged.row.contributor.key = key(2).public();
    assert_eq!(forged.check(), Err(RowFault::Signature));
    // Under a key of small order, one signature fits any message.
    forged.row.contributor.key = format!("01{}", "00".repeat(31));
    forged.signature = format!("01{}", "00".repeat(63));
    assert_eq!(forged.check(), Err(RowFault::Key));
    let board = board();
    assert_eq!(board.strangers(&[key(1).public()]), []);
    assert_eq!(board.strangers(&[key(2).public()]).len(), 3);
}

#[test]
fn rows_out_of_bounds_cannot_be_signed() {
    type Change = fn(&mut BoardRow);
    let changes: [(Change, &str); 12] = [
        (|row| row.trials.clear(), "trials: 1 to 1000 expected, got none"),
        (|row| row.trials[1].log = row.trials[0].log.clone(), "seeds 7 and 8 have one log"),
        (|row| row.trials[1].log.push('0'), "trials.log: 64 hexadecimal digits"),
        (|row| row.seed = u64::MAX, "seed: at most"),
        (|row| row.scenario = "a | b".to_owned(), "scenario: 1 to 64 letters"),
        (|row| row.guest.name = "../mine".to_owned(), "guest.name: 1 to 64 letters"),
        (|row| row.cell = Some("a | b".to_owned()), "cell: 1 to 128 letters"),
        (|row| row.contributor.name = "\u{202e}evil".to_owned(), "contributor.name: 1 to 64 letters"),
        (|row| row.contributor.name = "x".repeat(65), "contributor.name: 1 to 64 letters"),
        (|row| row.availability.routed = u64::MAX, "availability.routed: at most 2 expected"),
        (|row| row.outcomes.extend([(Outcome::Stuck, 0)]), "outcomes: STUCK 0 is stated"),
        (|row| row.guest.files.extend([("x".to_owned(), "0".to_owned())]), "guest.files: 64 hexadecimal"),
    ];
    for (change, reason) in changes {
        let mut changed = row(Conduct::Bare, "jump", 2);
        change(&mut changed);
        let fault = SignedRow::new(changed, &key(1)).expect_err(reason).to_string();
        assert!(fault.contains(reason), "{fault}");
    }
}

#[test]
fn merged_files_have_each_row_once() {
    let other_row = SignedRow::new(row(Conduct::Bare, "jump", 3), &key(2)).expect("a row");
    let mut other = board();
    other.add(other_row).expect("another contributor's row is no duplicate");
    let mut merged = board();
    assert_eq!(merged.merge(other.clone()), Ok(1));
    assert_eq!(other.merge(board()), Ok(0));
    assert_eq!((merged.text(), Board::verified(&merged.text())), (other.text(), Ok(other)));
}

#[test]
fn table_sets_bare_beside_guarded() {
    let shown = ShownBoard::new(&board());
    assert_eq!(shown.rows.len(), 2);
    let markdown = shown.markdown();
    let line = markdown.lines().nth(3).expect("a second row");
    let author = format!("A. Tester ({})", &key(1).public()[..8]);
    let expected = format!(
        "| 2, 3 | mine | jump | ground, own scene | 2 of 2 (15.8 to 100.0 %) | 67 % | 0 of 2 (0.0 to 84.2 %) | 67 % |  | {author} |"
    );
    assert_eq!(line, expected);
}

#[test]
fn replay_compares_logs_or_intervals() {
    let stated = row(Conduct::Bare, "jump", 20);
    let mut repeated = stated.trials.clone();
    assert_eq!(Replay::new(&stated, &repeated).verdict, ReplayVerdict::Reproduced);
    assert_eq!(Replay::new(&stated, &repeated[..5]).verdict, ReplayVerdict::Reproduced);
    repeated[3].log = digest(b"another log");
    let replay = Replay::new(&stated, &repeated);
    assert_eq!((replay.verdict, replay.same_logs, replay.differing[0].seed), (ReplayVerdict::Differs, 19, 10));
    let unsteady = BoardRow { repeatable: false, ..stated };
    assert_eq!(Replay::new(&unsteady, &repeated).verdict, ReplayVerdict::WithinInterval);
    repeated.iter_mut().for_each(|trial| trial.class = Outcome::Nominal);
    assert_eq!(Replay::new(&unsteady, &repeated).verdict, ReplayVerdict::Differs);
}
