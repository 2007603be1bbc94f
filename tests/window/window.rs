//! The window, without a screen: output is read from the accessibility tree, input is given by role and label.
//!
//! Behind it is the real console. The harness refuses controls without a name and glyphs that the fonts lack.

use console::act::{Act, Alarm, Order, PREPARED_FOR};
use console::gui::layout::{Pane, Preset};
use console::gui::{ConsoleWindow, Picture, Wish, theme};
use console::life::Life;
use console::sidecar::{Image, Mark, Sidecar, Sight};
use console::source::{Beside, Seek, Tape};
use eframe::egui::accesskit::Role as Kind;
use eframe::egui::{Event, Key, Modifiers, Theme, Vec2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use wire::command::CommandKind;
use wire::id::{NodeId, TrackId, UnitId};
use wire::mode::{Guard, Guards, Mode};
use wire::report::ReportedTrack;
use wire::settings::Settings;
use wire::time::{Instant, Span};

use crate::bench::Bench;
use crate::scenes::{self, SCENES};
use crate::yard::{self, Yard};

const REASON: &str = "Reason: it goes into the signed order";
const LAPTOP: Vec2 = vec2(1366.0, 768.0);
/// The least size of the window.
const LEAST: Vec2 = vec2(1024.0, 700.0);

/// A window over a yard. Interaction reaches the console, and is kept.
pub(crate) struct Seat {
    pub(crate) yard: Yard,
    pub(crate) window: ConsoleWindow,
    pub(crate) tape: Option<Tape>,
    pub(crate) beside: Option<Beside>,
    pub(crate) behind: Option<Span>,
    pub(crate) untaken: bool,
    sidecar: Option<Sidecar>,
    pub(crate) invalid: Option<String>,
    pub(crate) acts: Vec<Act>,
    pub(crate) seeks: Vec<Seek>,
}

pub(crate) type Seated = Harness<'static, Seat>;

pub(crate) fn seat(yard: Yard) -> Seated {
    sized(yard, LAPTOP, Theme::Dark)
}

pub(crate) fn sized(yard: Yard, size: Vec2, theme: Theme) -> Seated {
    let window = ConsoleWindow::new(UnitId::A, yard::site());
    let seat = Seat {
        yard,
        window,
        tape: None,
        beside: None,
        behind: None,
        untaken: false,
        sidecar: None,
        invalid: None,
        acts: Vec::new(),
        seeks: Vec::new(),
    };
    let draw = |ui: &mut eframe::egui::Ui, seat: &mut Seat| {
        theme::apply(ui.ctx());
        let mut shown = seat.yard.shown();
        if let Some(tape) = &seat.tape {
            // The recording began `at` before the shown moment, and the run's time `lead` after that.
            let began = Instant((shown.at.0 + tape.lead.0).saturating_sub(tape.at.0));
            (shown.marks.replay, shown.marks.began) = (true, Some(began));
        }
        shown.marks.invalid.clone_from(&seat.invalid);
        let picture = Picture {
            shown: &shown,
            behind: seat.behind,
            untaken: seat.untaken,
            tape: seat.tape.as_ref(),
            sidecar: seat.sidecar.as_ref(),
            beside: seat.beside.as_ref(),
        };
        for wish in seat.window.draw(ui, &picture) {
            match wish {
                Wish::Act(act) => {
                    seat.acts.push(act);
                    // Its effect is in the next picture.
                    let _ = seat.yard.bench.act(act);
                }
                Wish::Seek(to) => seat.seeks.push(to),
            }
        }
    };
    let mut seated = Harness::builder().with_size(size).with_theme(theme).build_ui_state(draw, seat);
    seated.run_steps(3);
    seated
}

pub(crate) fn press(seated: &mut Seated, key: Key) {
    seated.key_press(key);
    seated.run_steps(2);
}

pub(crate) fn click(seated: &mut Seated, kind: Kind, label: &str) {
    seated.get_by_role_and_label(kind, label).click();
    seated.run_steps(3);
}

fn type_into(seated: &mut Seated, label: &str, text: &str) {
    seated.get_by_role_and_label(Kind::TextInput, label).focus();
    seated.run_steps(2);
    seated.get_by_role_and_label(Kind::TextInput, label).type_text(text);
    seated.run_steps(2);
}

fn held(seated: &Seated) -> usize {
    let hold = |act: &&Act| matches!(act, Act::Now(Order::Command(UnitId::A, CommandKind::Hold)));
    seated.state().acts.iter().filter(hold).count()
}

/// The name of the one element whose name begins so.
pub(crate) fn name_of(seated: &Seated, begin: &str) -> String {
    let name = |node: egui_kittest::Node<'_>| node.accesskit_node().label().or_else(|| node.accesskit_node().value());
    let mut names = seated.root().children_recursive().filter_map(name).filter(|name| name.starts_with(begin));
    let first = names.next().unwrap_or_else(|| panic!("nothing begins with {begin:?}"));
    assert_eq!(names.next(), None, "more than one begins with {begin:?}");
    first
}

pub(crate) fn shows_text(seated: &Seated, text: &str) -> bool {
    seated.query_all_by_label_contains(text).next().is_some()
}

const RESUME: Order = Order::Command(UnitId::A, CommandKind::Resume);

/// Held, and the hold long over: a resume may be chosen.
pub(crate) fn standing() -> Yard {
    let mut yard = scenes::nominal();
    yard.bench.act(Act::Now(Order::Command(UnitId::A, CommandKind::Hold))).unwrap();
    yard.run(Span::s(2));
    yard
}

/// Turns to a pane.
pub(crate) fn open(seated: &mut Seated, pane: Pane) {
    seated.state_mut().window.layouts_mut().now().open(pane);
    seated.run_steps(2);
}

/// The button is present in every scene and layout.
#[test]
fn hold_is_one_button_away_everywhere() {
    for (name, make) in SCENES.into_iter().filter(|(name, _)| *name != "view-only") {
        for preset in Preset::ALL {
            let mut seated = seat(make());
            seated.state_mut().window.layouts_mut().start_from(preset);
            seated.run_steps(2);
            click(&mut seated, Kind::Button, "HOLD unit-a   F1");
            assert_eq!(held(&seated), 1, "{name}, {preset:?}");
        }
    }
}

#[test]
fn hold_is_one_key_away_in_every_scene() {
    for (name, make) in SCENES.into_iter().filter(|(name, _)| *name != "view-only") {
        let mut seated = seat(make());
        press(&mut seated, Key::F1);
        assert_eq!(held(&seated), 1, "{name}");
    }
}

#[test]
fn hold_key_works_during_typing_and_confirmation() {
    let mut seated = seat(scenes::armed());
    open(&mut seated, Pane::History);
    for label in [REASON, "Search"] {
        let before = held(&seated);
        type_into(&mut seated, label, "because");
        assert!(seated.get_by_role_and_label(Kind::TextInput, label).is_focused(), "{label}");
        press(&mut seated, Key::F1);
        assert_eq!(held(&seated), before + 1, "while typing into {label}");
    }
    let order = Act::Confirm(RESUME, wire::codec::Text::new("because"));
    assert!(!seated.state().acts.contains(&order), "holding confirms nothing");
}

#[test]
fn held_key_is_one_act() {
    let mut seated = seat(scenes::nominal());
    let down = |key, repeat| Event::Key { key, physical_key: None, pressed: true, repeat, modifiers: Modifiers::NONE };
    for repeat in [false, true, true, true] {
        seated.event(down(Key::F1, repeat));
        seated.run_steps(1);
    }
    assert_eq!(held(&seated), 1, "F1");
    seated.key_up(Key::F1);
    for key in [Key::Enter, Key::Space] {
        let before = held(&seated);
        seated.get_by_role_and_label(Kind::Button, "HOLD unit-a   F1").focus();
        seated.run_steps(1);
        for repeat in [false, true, true, true] {
            seated.event(down(key, repeat));
            seated.run_steps(1);
        }
        assert_eq!(held(&seated), before + 1, "{key:?} on the button");
        seated.key_up(key);
        seated.run_steps(1);
    }
}

/// The order has a reason, and is followed to its effect.
#[test]
fn leaving_safe_is_chosen_armed_and_confirmed() {
    let mut seated = seat(standing());
    click(&mut seated, Kind::RadioButton, "Resume unit-a");
    assert!(seated.state().acts.is_empty(), "choosing does nothing");
    assert!(shows_text(&seated, "DRIVES ON by itself"), "the consequence is spelt out");
    click(&mut seated, Kind::Button, "Arm: resume unit-a");
    assert_eq!(seated.state().acts, [Act::Prepare(RESUME)]);
    assert!(shows_text(&seated, "ARMED: resume unit-a, 10.0 s left"), "the countdown is seen");
    let confirm = "CONFIRM: resume unit-a   F9";
    assert!(seated.get_by_role_and_label(Kind::Button, confirm).accesskit_node().is_disabled(), "without a reason");
    press(&mut seated, Key::F9);
    assert_eq!(seated.state().acts.len(), 1, "nor by key");
    type_into(&mut seated, REASON, "way is clear");
    click(&mut seated, Kind::Button, confirm);
    assert_eq!(seated.state().acts[1..], [Act::Confirm(RESUME, wire::codec::Text::new("way is clear"))]);
    seated.state_mut().yard.run(Span::s(1));
    seated.run_steps(2);
    assert!(shows_text(&seated, "MODE unit-a: READY"));
    let shown = seated.state().yard.shown();
    assert_eq!(shown.commands.last().map(|command| command.life), Some(Life::Executed));
    let done = seated.query_all_by_label_contains("done · effect within").next().expect("the newest order");
    done.hover();
    seated.run_steps(10);
    for stage in ["staged +", "confirmed +", "sent +", "answered +", "effect +"] {
        assert!(shows_text(&seated, stage), "{stage}");
    }
}

/// The order as its control has it.
fn capital(order: &str) -> String {
    let (first, rest) = order.split_at(1);
    first.to_uppercase() + rest
}

/// Chooses a track in the table.
fn choose_track(seated: &mut Seated) {
    open(seated, Pane::Tracks);
    seated.get_by_label_contains("TRACK unit-a 1 vehicle fresh").click();
    seated.run_steps(3);
}

/// The orders are all that lead away from safe.
#[test]
fn every_order_completes_by_role_and_label() {
    let idle = || {
        let mut yard = Yard::new();
        yard.actor(UnitId::A).mode = Mode::Idle;
        yard.run(Span::s(1));
        yard
    };
    let striking = || {
        let mut yard = Yard::from_bench(Bench::seating(wire::person::Role::Supervise), &[UnitId::A, UnitId::B]);
        yard.run(Span::s(1));
        yard
    };
    let (arm, act) = (CommandKind::Arm(TrackId(1)), CommandKind::Confirm(TrackId(1)));
    let command = |kind| Order::Command(UnitId::A, kind);
    let ways: [(&str, Yard, Order); 5] = [
        ("enable unit-a", idle(), command(CommandKind::Enable)),
        ("resume unit-a", standing(), command(CommandKind::Resume)),
        ("arm unit-a on track 1", scenes::nominal(), command(arm)),
        ("act with unit-a on track 1", scenes::authority(), command(act)),
        ("revoke operator-2", striking(), Order::Revoke(NodeId::OPERATOR_2)),
    ];
    for (label, yard, order) in ways {
        let mut seated = seat(yard);
        let before = seated.state().yard.shown().commands.len();
        if order == command(arm) {
            choose_track(&mut seated);
        }
        if matches!(order, Order::Revoke(_)) {
            click(&mut seated, Kind::Button, "Revoke an identity ...");
        }
        click(&mut seated, Kind::RadioButton, &capital(label));
        click(&mut seated, Kind::Button, &format!("Arm: {label}"));
        type_into(&mut seated, REASON, "as ordered");
        if order == command(arm) {
            press(&mut seated, Key::F9);
        } else {
            click(&mut seated, Kind::Button, &format!("CONFIRM: {label}   F9"));
        }
        let acts = [Act::Prepare(order), Act::Confirm(order, wire::codec::Text::new("as ordered"))];
        assert_eq!(seated.state().acts, acts, "{label}");
        let shown = seated.state().yard.shown();
        match order {
            Order::Command(_, kind) => {
                assert_eq!(shown.commands[before..].iter().map(|given| given.kind).collect::<Vec<_>>(), [kind]);
            }
            Order::Revoke(who) => assert_eq!(shown.revocable, [(who, true)]),
        }
    }
}

/// The test sets them by role and label.
#[test]
fn settings_stay_in_range_and_take_effect() {
    let mut yard = Yard::new();
    yard.actor(UnitId::A).mode = Mode::Idle;
    yard.run(Span::s(1));
    let own_settings = yard.shown().unit(UnitId::A).unwrap().settings(&yard.shown().bounds);
    let mut seated = seat(yard);
    click(&mut seated, Kind::RadioButton, "Configure unit-a");
    for (label, typed) in [("Speed, at most", "1.25"), ("Margin to the fence", "99"), ("Confidence to keep", "0.4567")]
    {
        seated.get_by_role_and_label(Kind::SpinButton, label).click();
        seated.run_steps(2);
        seated.event(Event::Text(typed.to_owned()));
        seated.run_steps(2);
        press(&mut seated, Key::Enter);
    }
    let values = Settings { speed_mm_s: 1250, margin_mm: 5000, keep_permille: 457, ..own_settings };
    let order = Order::Command(UnitId::A, CommandKind::Configure(values));
    assert!(
        shows_text(&seated, "at most 1.25 m/s, 5 m from the fence; arms from 0.6, keeps from 0.457"),
        "in its own words"
    );
    click(&mut seated, Kind::Button, "Arm: configure unit-a");
    type_into(&mut seated, REASON, "wet ground");
    click(&mut seated, Kind::Button, "CONFIRM: configure unit-a   F9");
    assert_eq!(seated.state().acts[1..], [Act::Confirm(order, wire::codec::Text::new("wet ground"))]);
    seated.state_mut().yard.run(Span::s(1));
    let shown = seated.state().yard.shown();
    assert_eq!(shown.unit(UnitId::A).unwrap().settings(&shown.bounds), values, "as the unit reports");
    assert!(shown.commands.last().is_some_and(|command| command.times.effect.is_some()), "and that is its effect");
    seated.run_steps(2);
    click(&mut seated, Kind::RadioButton, "Configure unit-a");
    assert!(shows_text(&seated, "at most 1.25 m/s"), "the next order begins from there");
}

#[test]
fn escape_and_time_disarm_and_clear_the_reason() {
    let mut seated = seat(scenes::armed());
    type_into(&mut seated, REASON, "half a rea");
    press(&mut seated, Key::Escape);
    assert_eq!(seated.state().acts, [Act::Withdraw]);
    assert!(!shows_text(&seated, "ARMED"));
    press(&mut seated, Key::Escape);
    assert_eq!(seated.state().acts.len(), 1, "there is nothing to give up any more");
    seated.state_mut().yard.bench.act(Act::Prepare(RESUME)).unwrap();
    seated.run_steps(2);
    type_into(&mut seated, REASON, "another");
    seated.state_mut().yard.run(PREPARED_FOR);
    seated.run_steps(2);
    assert!(!shows_text(&seated, "ARMED"), "it lapsed");
    assert!(shows_text(&seated, "not confirmed in time"), "and that is said");
    seated.state_mut().yard.bench.act(Act::Prepare(RESUME)).unwrap();
    seated.run_steps(2);
    let typed = seated.get_by_role_and_label(Kind::TextInput, REASON).value();
    assert_eq!(typed.unwrap_or_default(), "", "no order inherits another's reason");
}

#[test]
fn interlock_is_named_beside_its_control() {
    let mut seated = seat(scenes::hold_safe());
    assert!(shows_text(&seated, "not yet: Teammates fails"), "beside the order");
    click(&mut seated, Kind::RadioButton, "Resume unit-a");
    assert!(seated.get_by_role_and_label(Kind::Button, "Arm: resume unit-a").accesskit_node().is_disabled());
    assert!(shows_text(&seated, "GUARD guards failing FAILS Teammates, limit none"), "with value and limit");
    assert!(seated.state().acts.is_empty());
}

#[test]
fn guard_list_shows_measured_value_and_limit() {
    let mut seated = seat(scenes::nominal());
    for (guard, line) in [
        (Guard::Thermal, "GUARD Thermal camera FAILS 412 of 300 ms"),
        (Guard::Lease, "GUARD Permission to drive FAILS 612 of 500 ms"),
        (Guard::Geofence, "GUARD Room to the fence FAILS 1.2 m short"),
        (Guard::Drift, "GUARD Position drift FAILS 135 % of its limit"),
        (Guard::TimeBase, "GUARD Receiver time FAILS 7.3 of 5 ms"),
        (Guard::Teammates, "GUARD Teammates FAILS unit-b: it moved faster than its body can"),
    ] {
        let yard = &mut seated.state_mut().yard;
        yard.actors[0].failing = Guards::default().with_guard(guard);
        yard.run(Span::ms(200));
        seated.run_steps(2);
        assert!(shows_text(&seated, line), "{line}");
        assert!(shows_text(&seated, "GUARD Colour camera ok 84 of 300 ms"), "what holds says by how much");
    }
}

#[test]
fn viewer_and_recording_give_no_commands() {
    let replay = |mut seated: Seated| {
        let (_, tape) = scenes::replayed(seated.state().yard.shown());
        seated.state_mut().tape = Some(tape);
        seated.run_steps(3);
        seated
    };
    for (mut seated, says_why) in
        [(seat(scenes::view_only()), "ROLE VIEW"), (replay(seat(scenes::armed())), "REPLAY: a recording")]
    {
        assert!(shows_text(&seated, says_why));
        for key in [Key::F1, Key::F9, Key::Escape] {
            press(&mut seated, key);
        }
        for label in ["HOLD unit-a   F1", "HOLD all  Shift F1", "Disarm unit-a"] {
            let button = seated.get_by_role_and_label(Kind::Button, label);
            assert!(button.accesskit_node().is_disabled(), "{label}");
            button.click();
            seated.run_steps(2);
        }
        let notes: Vec<_> = seated.query_all_by_role(Kind::Button).map(|node| node.accesskit_node()).collect();
        let notes =
            notes.iter().filter(|node| node.label().is_some_and(|label| label.to_lowercase().contains("acknowledge")));
        assert!(notes.clone().count() > 0 && notes.clone().all(|node| node.is_disabled()), "{says_why}");
        assert_eq!(seated.state().acts, [], "{says_why}");
    }
}

#[test]
fn hold_key_works_before_the_first_picture() {
    let draw =
        |ui: &mut eframe::egui::Ui, (window, wishes): &mut (ConsoleWindow, Vec<Wish>)| wishes.extend(window.wait(ui));
    let window = ConsoleWindow::new(UnitId::A, yard::site());
    let mut waiting = Harness::builder().with_size(LAPTOP).build_ui_state(draw, (window, Vec::new()));
    waiting.run_steps(2);
    assert!(waiting.query_all_by_label_contains("F1 holds unit-a").next().is_some());
    waiting.key_press(Key::F1);
    waiting.run_steps(2);
    assert_eq!(waiting.state().1, [Wish::Act(Act::Now(Order::Command(UnitId::A, CommandKind::Hold)))]);
}

/// The unit's line has the age, the banner the mode; beyond LATE both say that it was so.
#[test]
fn value_labels_change_one_tick_beyond_limits() {
    let mut seated = seat(scenes::nominal());
    let modes = ["READY, 1.4 m/s", "READY, late", "was READY, stale", "LINK LOST, was READY"];
    let limits = [(Span::ms(300), 0), (Span::ms(500), 1), (Span::s(2), 2)];
    for (limit, at) in limits {
        let age = seated.state().yard.shown().units[0].state.age();
        seated.state_mut().yard.bench.pass(Span(limit.0 - age.0));
        for (tick, mode) in [(0, modes[at]), (1, modes[at + 1])] {
            seated.state_mut().yard.bench.pass(Span(tick));
            seated.run_steps(1);
            assert_eq!(name_of(&seated, "MODE unit-a: "), format!("MODE unit-a: {mode}"), "{tick} us beyond {limit}");
            let line = name_of(&seated, "UNIT unit-a ");
            let written = limit.as_ms() / 1000.0 + f64::from(tick as u32) / 100.0;
            assert!(line.ends_with(&format!(", age ≤ {written:.2} s")), "{line}, {tick} us beyond {limit}");
            assert_eq!(line.contains(", was "), mode.contains("was"), "{line}");
        }
    }
}

/// Context bar, banner and units are visible in every layout, size and theme.
#[test]
fn banner_and_units_are_always_visible() {
    for (size, theme) in [(LEAST, Theme::Dark), (LAPTOP, Theme::Dark), (vec2(2560.0, 1440.0), Theme::Light)] {
        let mut seated = sized(scenes::authority(), size, theme);
        for preset in Preset::ALL {
            seated.state_mut().window.layouts_mut().start_from(preset);
            for pane in Pane::ALL {
                open(&mut seated, pane);
                for label in [
                    "MARK SIMULATION",
                    "MODE unit-a: PREPARE_TO_ACT, 1.4 m/s, authority on track 1",
                    "WHY unit-a: Armed by an operator",
                    "SINCE unit-a: ",
                    "DO NEXT unit-a: Act on track 1",
                    "IS THIS TRUE unit-a: Fresh and verified, oldest value ≤ ",
                    "UNIT unit-a PREPARE_TO_ACT",
                    "UNIT unit-b READY",
                    "LINK ",
                ] {
                    let rect = seated.get_by_label_contains(label).rect();
                    let seen = rect.width() > 60.0 && rect.right() <= size.x && rect.bottom() < 340.0;
                    assert!(seen, "{label} in {preset:?} with {pane:?}: {rect}");
                }
                let links = name_of(&seated, "LINK ");
                assert!(["LINK unit-a up", "LINK unit-b up"].iter().all(|link| links.contains(link)), "{links}");
            }
        }
    }
}

#[test]
fn recording_and_ablation_marks_are_always_visible() {
    for (mut seated, mark) in [(seat(scenes::hold_safe()), "MARK REPLAY"), (seat(scenes::ablation()), "MARK ABLATION")]
    {
        if mark == "MARK REPLAY" {
            let (_, tape) = scenes::replayed(seated.state().yard.shown());
            seated.state_mut().tape = Some(tape);
        }
        for preset in Preset::ALL {
            seated.state_mut().window.layouts_mut().start_from(preset);
            for pane in Pane::ALL {
                seated.state_mut().window.layouts_mut().now().open(pane);
                seated.run_steps(2);
                let rect = seated.get_by_label_contains(mark).rect();
                assert!(rect.width() > 60.0 && rect.right() <= LAPTOP.x && rect.bottom() < 60.0, "{mark}: {rect}");
            }
        }
    }
}

#[test]
fn tracks_that_found_no_room_are_told_of() {
    let mut yard = Yard::new();
    for round in 0..8 {
        let actor = yard.actor(UnitId::A);
        let like = actor.tracks[0];
        actor.tracks = (0..8).map(|n| ReportedTrack { id: TrackId(100 + round * 8 + n), ..like }).collect();
        yard.run(Span::ms(200));
    }
    let more = yard.shown().unit(UnitId::A).expect("a unit").lost_more;
    let mut seated = seat(yard);
    open(&mut seated, Pane::Tracks);
    assert!(
        more > 0 && shows_text(&seated, &format!("unit-a: {more} more LOST, for which there was no room")),
        "{more}"
    );
}

#[test]
fn lost_track_stays_until_acknowledged() {
    let mut seated = seat(scenes::hold_safe());
    open(&mut seated, Pane::Tracks);
    assert!(shows_text(&seated, "TRACK unit-a 5 obstacle LOST"));
    click(&mut seated, Kind::Button, "acknowledge that track unit-a 5 is lost");
    let acknowledged =
        |act: &Act| matches!(act, Act::Acknowledge(Alarm::TrackLost(UnitId::A, _, track), _) if track.0 == 5);
    assert!(seated.state().acts.iter().all(acknowledged) && seated.state().acts.len() == 1);
    seated.state_mut().yard.run(Span::ms(100));
    seated.run_steps(2);
    assert!(!shows_text(&seated, "TRACK unit-a 5"));
}

#[test]
fn alarms_are_acknowledged_singly_together_and_by_key() {
    let mut seated = seat(scenes::hold_safe());
    let open = |seated: &Seated| seated.state().yard.shown().alarms.iter().filter(|group| group.open()).count();
    let all = open(&seated);
    click(&mut seated, Kind::Button, "Acknowledge: unit-b contradicts itself");
    assert_eq!((seated.state().acts.len(), open(&seated)), (1, all - 1));
    assert!(shows_text(&seated, "led to: unit-a HOLD_SAFE"));
    let mut seated = seat(scenes::hold_safe());
    press(&mut seated, Key::A);
    assert_eq!((seated.state().acts.len(), open(&seated)), (1, all - 1));
    let mut seated = seat(scenes::hold_safe());
    click(&mut seated, Kind::Button, "Acknowledge all");
    assert_eq!((seated.state().acts.len(), open(&seated)), (all, 0));
    assert!(seated.get_by_role_and_label(Kind::Button, "Acknowledge all").accesskit_node().is_disabled());
}

#[test]
fn alarm_is_shelved_with_a_reason_and_sound_is_silenced() {
    let mut seated = seat(scenes::degraded());
    let cause = "thermal camera of unit-a gives nothing";
    click(&mut seated, Kind::Button, &format!("Shelve: {cause}"));
    let minute = format!("Shelve for 1 min: {cause}");
    assert!(seated.get_by_role_and_label(Kind::Button, &minute).accesskit_node().is_disabled(), "no reason yet");
    type_into(&mut seated, "Reason", "it is wet");
    press(&mut seated, Key::S);
    assert_eq!(seated.state().acts, [], "who types silences nothing");
    click(&mut seated, Kind::Button, &minute);
    assert!(shows_text(&seated, "Shelved: 1") && !shows_text(&seated, cause));
    click(&mut seated, Kind::Button, "Shelved: 1");
    assert!(shows_text(&seated, cause));
    let mut seated = seat(scenes::hold_safe());
    let held = "Shelve: unit-b contradicts itself";
    assert!(seated.get_by_role_and_label(Kind::Button, held).accesskit_node().is_disabled());
    press(&mut seated, Key::S);
    assert!(shows_text(&seated, "Sound silenced, "));
}

#[test]
fn named_layout_is_kept_selected_and_forgotten() {
    let mut seated = seat(scenes::nominal());
    let drawn = |seated: &mut Seated| {
        let saved = seated.state_mut().window.layouts_mut().saved().unwrap();
        serde_json::from_str::<serde_json::Value>(&saved).unwrap()["now"].clone()
    };
    click(&mut seated, Kind::Button, "Examine");
    let examine = drawn(&mut seated);
    type_into(&mut seated, "keep as", "night");
    click(&mut seated, Kind::Button, "Keep");
    click(&mut seated, Kind::Button, "Operate");
    assert_ne!(drawn(&mut seated), examine);
    click(&mut seated, Kind::Button, "layout night");
    assert_eq!(drawn(&mut seated), examine);
    click(&mut seated, Kind::Button, "Forget");
    assert!(seated.query_by_role_and_label(Kind::Button, "layout night").is_none());
}

/// HOLD ALL goes to each.
#[test]
fn commands_go_to_the_chosen_unit() {
    let mut seated = seat(scenes::nominal());
    seated.get_by_label_contains("UNIT unit-b ").click();
    seated.run_steps(3);
    press(&mut seated, Key::F1);
    click(&mut seated, Kind::Button, "HOLD unit-b   F1");
    let hold = |unit| Act::Now(Order::Command(unit, CommandKind::Hold));
    assert_eq!(seated.state().acts, [hold(UnitId::B), hold(UnitId::B)]);
    seated.key_press_modifiers(Modifiers::SHIFT, Key::F1);
    seated.run_steps(2);
    assert_eq!(seated.state().acts[2..], [hold(UnitId::A), hold(UnitId::B)]);
    click(&mut seated, Kind::Button, "Disarm unit-b");
    assert_eq!(seated.state().acts[4..], [Act::Now(Order::Command(UnitId::B, CommandKind::Disarm))]);
}

#[test]
fn a_track_is_armed_by_choosing_its_row() {
    let mut seated = seat(scenes::nominal());
    assert!(shows_text(&seated, "To arm: choose a track"));
    choose_track(&mut seated);
    click(&mut seated, Kind::RadioButton, "Arm unit-a on track 1");
    click(&mut seated, Kind::Button, "Arm: arm unit-a on track 1");
    let arm = Order::Command(UnitId::A, CommandKind::Arm(wire::id::TrackId(1)));
    assert_eq!(seated.state().acts, [Act::Prepare(arm)]);
}

#[test]
fn every_control_is_reached_by_tab() {
    let mut seated = seat(standing());
    click(&mut seated, Kind::RadioButton, "Resume unit-a");
    let mut reached = Vec::new();
    for _ in 0..200 {
        press(&mut seated, Key::Tab);
        let focused = seated.root().children_recursive().find(|node| node.is_focused());
        reached.extend(focused.and_then(|node| node.accesskit_node().label()));
    }
    for wanted in [
        "HOLD unit-a   F1",
        "HOLD all  Shift F1",
        "Disarm unit-a",
        "Enable unit-a",
        "Arm: resume unit-a",
        "UNIT unit-b ",
        "MAP ",
        "follow the chosen unit",
        "fit the map",
        "Last 60 s",
        "Whole run",
        "GUARD Thermal camera ",
        "list of guards",
        "Tracks",
        "Video",
        "History",
        "Refusals",
        "Operate",
        "Examine",
        "Light",
        "keep as",
    ] {
        assert!(reached.iter().any(|label| label.starts_with(wanted)), "{wanted} is not among {reached:?}");
    }
}

/// Presses Tab until the element with this label has the focus.
pub(crate) fn tab_to(seated: &mut Seated, text: &str) {
    let focused = |seated: &Seated| {
        let label = |node: &egui_kittest::Node<'_>| node.accesskit_node().label().is_some_and(|l| l.starts_with(text));
        seated.root().children_recursive().any(|node| node.is_focused() && label(&node))
    };
    for _ in 0..200 {
        if focused(seated) {
            return;
        }
        press(seated, Key::Tab);
    }
    panic!("Tab does not lead to {text}");
}

#[test]
fn map_and_lists_work_by_keys_alone() {
    let mut seated = sized(scenes::nominal(), LEAST, Theme::Dark);
    let map = |seated: &Seated| {
        let map = seated.query_all_by_role(Kind::Canvas).find_map(|node| node.accesskit_node().label());
        map.expect("a map").split_once("; ").expect("where it looks").1.to_owned()
    };
    tab_to(&mut seated, "MAP");
    let all = map(&seated);
    press(&mut seated, Key::ArrowRight);
    let right = map(&seated);
    press(&mut seated, Key::Plus);
    let nearer = map(&seated);
    assert!(right != all && nearer != right, "{all}, {right}, {nearer}");
    press(&mut seated, Key::Home);
    assert_eq!(map(&seated), all);
    tab_to(&mut seated, "list of guards");
    let first = |seated: &Seated| {
        seated.query_all_by_label_contains("GUARD Colour camera ok").next().map(|node| node.rect().top())
    };
    let top = first(&seated);
    press(&mut seated, Key::ArrowDown);
    seated.run_steps(20);
    assert!(first(&seated) < top, "{:?}, {top:?}", first(&seated));
}

#[test]
fn recording_can_seek_and_never_looks_live() {
    let mut seated = seat(scenes::hold_safe());
    let (_, tape) = scenes::replayed(seated.state().yard.shown());
    seated.state_mut().tape = Some(tape.clone());
    seated.run_steps(3);
    assert!(shows_text(&seated, "MARK REPLAY"));
    click(&mut seated, Kind::Button, "Step on");
    click(&mut seated, Kind::Button, "Step back");
    click(&mut seated, Kind::Button, "Change before");
    click(&mut seated, Kind::Button, "Play");
    let before = tape.moments[3].at;
    assert_eq!(seated.state().seeks, [Seek::Step(1), Seek::Step(-1), Seek::To(before), Seek::Play(true)]);
    assert!(shows_text(&seated, "run time 6.10 s of 7.00 s"));
    assert!(shows_text(&seated, "what was shown: unit-a HOLD_SAFE: unit-b contradicts itself at 4.90 s"));
    assert!(shows_text(&seated, "what really happened: insider-b: sends a report of unit-b that is a lie at 4.70 s"));
}

#[test]
fn evidence_is_shown_in_recordings_only() {
    let mut seated = seat(scenes::hold_safe());
    let sight = |name, image| Sight { name, legend: "as seen".into(), image, marks: Vec::new() };
    let mark = Mark { edges: [1.0, 1.0, 90.0, 9.0], says: "vehicle 93 %".to_owned() };
    let colour = Sight { marks: vec![mark], ..sight("colour", Some(Image { width: 4, height: 2, rgb: vec![90; 24] })) };
    let sights = vec![colour, sight("thermal", None)];
    let because = Some(
        "6900 ms: PREPARE_TO_ACT to HOLD_SAFE (lost:teammates)\n  cause  6700 ms  unit-b  contradicts itself".into(),
    );
    seated.state_mut().sidecar = Some(Sidecar { sensed: Some((sights.into(), Span::ms(40))), because });
    seated.run_steps(3);
    for evidence in ["SENSOR", "EVIDENCE", "cause  6700 ms"] {
        assert!(!shows_text(&seated, evidence), "the picture is live");
    }
    let (_, tape) = scenes::replayed(seated.state().yard.shown());
    seated.state_mut().tape = Some(tape);
    seated.run_steps(3);
    assert!(
        shows_text(&seated, "EVIDENCE · no operator saw this")
            && shows_text(&seated, "WHAT THE SENSORS GAVE, 0.04 s before")
    );
    assert!(shows_text(&seated, "  cause  6700 ms  unit-b  contradicts itself"));
    assert!(shows_text(&seated, "SENSOR colour 1 found") && shows_text(&seated, "SENSOR thermal gave nothing"));
    click(&mut seated, Kind::Button, "Evidence");
    assert!(!shows_text(&seated, "SENSOR colour") && !shows_text(&seated, "cause  6700 ms"));
}

#[test]
fn excessive_clock_drift_alarms_at_the_link() {
    let mut yard = Yard::new();
    // One that runs fast is refused here before that: without a delay its reports come before they were written.
    yard.actor(UnitId::B).fast_ppm = -3_000;
    yard.run(Span::s(20));
    let seated = seat(yard);
    let shown = seated.state().yard.shown();
    let alarms: Vec<Alarm> = shown.alarms.iter().map(|group| group.cause).collect();
    assert_eq!(alarms, [Alarm::ClockRuns(UnitId::B)]);
    assert_eq!(name_of(&seated, "CLOCK "), "CLOCK clock of unit-b runs away");
    assert!(name_of(&seated, "LINK ").contains("unit-b up, report 0.10 s ago"), "its link is as it should be");
}

/// The report advises to give HOLD by other means.
#[test]
fn untaken_act_is_reported() {
    let mut seated = seat(scenes::nominal());
    assert!(!shows_text(&seated, "NOT TAKEN"));
    seated.state_mut().untaken = true;
    seated.run_steps(2);
    assert!(shows_text(
        &seated,
        "NOT TAKEN: what you did last did not reach this console's core. Hold by other means."
    ));
}

#[test]
fn waiting_unit_names_its_wait_without_failing_guard() {
    let mut yard = Yard::new();
    yard.actor(UnitId::A).mode = Mode::Idle;
    yard.run(Span::s(1));
    assert!(shows_text(&seat(yard), "Waits for an operator who enables it."));
    assert!(shows_text(&seat(standing()), "Waits for an operator who resumes it."));
    assert!(shows_text(&seat(scenes::degraded()), "Waits for every guard to hold for 1000 ms."));
    assert!(shows_text(
        &seat(scenes::hold_safe()),
        "Waits for the guards that fail, and then an operator who resumes it."
    ));
    let ready = seat(scenes::nominal());
    assert!(
        !shows_text(&ready, "Waits for") && shows_text(&ready, "GUARD Designation not judged nothing is designated"),
        "and what is not judged"
    );
}

#[test]
fn last_picture_is_marked_as_not_current() {
    let mut seated = seat(scenes::nominal());
    assert!(!shows_text(&seated, "NOT CURRENT"));
    seated.state_mut().behind = Some(Span::ms(1_400));
    seated.run_steps(2);
    assert!(shows_text(&seated, "NOT CURRENT: this console has drawn nothing new for 1.40 s"));
    press(&mut seated, Key::F1);
    assert_eq!(held(&seated), 1, "a hold is still tried");
}

#[test]
fn every_scene_layout_theme_and_pane_is_drawn() {
    for (name, make) in SCENES {
        let mut seated = sized(make(), LAPTOP, if name.len() % 2 == 0 { Theme::Dark } else { Theme::Light });
        for preset in Preset::ALL {
            seated.state_mut().window.layouts_mut().start_from(preset);
            for pane in Pane::ALL {
                seated.state_mut().window.layouts_mut().now().open(pane);
                seated.run_steps(2);
            }
        }
        let shown = seated.state().yard.shown();
        assert!(shown.units.iter().all(|unit| shows_text(&seated, &format!("UNIT {} ", unit.unit))), "{name}");
    }
}

#[test]
fn tables_fit_every_layout_at_least_width() {
    let all = [LAPTOP, LEAST].into_iter().flat_map(|size| Preset::ALL.map(|preset| (size, preset)));
    // In the least window a layout with every pane open leaves a table 230 points, and it scrolls sideways.
    for (size, preset) in all.filter(|(size, preset)| *size != LEAST || *preset != Preset::Examine) {
        let mut seated = sized(scenes::flood(), size, Theme::Dark);
        seated.state_mut().window.layouts_mut().start_from(preset);
        for (pane, last) in [(Pane::Tracks, "sensors"), (Pane::Refusals, "refused by")] {
            seated.state_mut().window.layouts_mut().now().open(pane);
            seated.run_steps(3);
            // The command column begins where the tables end.
            let edge = seated.get_by_role_and_label(Kind::Button, "HOLD unit-a   F1").rect().left();
            let right = seated.get_by_label(last).rect().right();
            assert!(right <= edge, "{}, {size:?}: {last} ends at {right}, the pane before {edge}", preset.name());
        }
    }
}

#[test]
fn two_hundred_tracks_all_reach_the_map() {
    let seated = seat(scenes::crowd());
    let shown = seated.state().yard.shown();
    let tracks: usize = shown.units.iter().map(|unit| unit.tracks.len() + unit.lost.len()).sum();
    assert!(tracks >= 200, "{tracks}");
    assert!(shows_text(&seated, &format!("MAP 4 units, {tracks} tracks")));
}

/// A normal link is said once, with each link by name for those who ask.
#[test]
fn every_link_is_named_with_its_clock() {
    let mut yard = scenes::crowd();
    yard.run(Span::s(9));
    let seated = seat(yard);
    assert!(seated.state().yard.shown().units.iter().all(|unit| unit.clock.is_some()));
    let links = name_of(&seated, "LINK ");
    let named = |unit: &console::shown::ShownUnit| links.contains(&format!("LINK {} up, report 0.10 s ago", unit.unit));
    assert!(seated.state().yard.shown().units.iter().all(named), "{links}");
    for said in ["LINK ", "CLOCK in step"] {
        let node = seated.query_all_by_label_contains(said).next().expect("the links and the clocks");
        assert!(node.rect().right() <= LAPTOP.x && node.rect().bottom() < 40.0, "{said}: {}", node.rect());
    }
    seated.get_by_label_contains("CLOCK in step").hover();
}

/// The mark shows the reason, in every layout.
#[test]
fn invalid_recording_mark_is_always_visible() {
    let mut seated = seat(scenes::hold_safe());
    let (_, tape) = scenes::replayed(seated.state().yard.shown());
    seated.state_mut().tape = Some(tape);
    seated.run_steps(2);
    assert!(!shows_text(&seated, "INVALID"));
    seated.state_mut().invalid = Some(format!("event 7: \u{202e}\n{}", "expected a seal ".repeat(40)));
    for preset in Preset::ALL {
        seated.state_mut().window.layouts_mut().start_from(preset);
        seated.run_steps(2);
        let banner = seated.get_by_label_contains("INVALID, evidence of nothing: event 7: ??expected a seal");
        let (rect, mode) = (banner.rect(), seated.get_by_label_contains("MODE unit-a").rect());
        assert!(rect.bottom() <= mode.top() && rect.right() <= LAPTOP.x && rect.height() < 60.0, "{rect} over {mode}");
    }
}

/// The window names the waived checks in words of its own; the policy's name, which comes from a file, is not drawn.
#[test]
fn foreign_name_cannot_break_its_line() {
    let name = format!("evil\u{202e}\n\t{}", "name ".repeat(400));
    let policy = wire::policy::Policy { name, record_guard: wire::policy::Requirement::Waived, ..Default::default() };
    let mut yard = Yard::with_role(&[UnitId::A, UnitId::B], policy, wire::person::Role::Supervise);
    yard.actor(UnitId::A).mode = Mode::Ready;
    yard.run(Span::ms(500));
    let seated = seat(yard);
    let chip = seated.get_by_label_contains("MARK ABLATION");
    assert!(chip.rect().right() <= LAPTOP.x && chip.rect().height() < 30.0);
    assert_eq!(name_of(&seated, "MARK ABLATION"), "MARK ABLATION · records are not filtered");
    for foreign in ["evil", "\u{202e}"] {
        assert!(!shows_text(&seated, foreign), "{foreign:?}");
    }
}

#[test]
fn arming_stands_below_the_images_of_its_track() {
    let seated = seat(scenes::arming());
    assert!(shows_text(&seated, "TRACK 1 as the cameras saw it, 1.05 s before"));
    for image in ["TRACK 1 colour", "TRACK 1 warmth 287 to 310 K", "TRACK 1 depth 9.0 to 12.5 m"] {
        let drawn = seated.query_by_label_contains(image).expect("an image of each camera");
        assert!(drawn.rect().max.x <= LAPTOP.x, "{image} is cut off");
    }
    let mut bare = scenes::nominal();
    bare.bench.act(Act::Prepare(Order::Command(UnitId::A, CommandKind::Arm(wire::id::TrackId(1))))).unwrap();
    bare.run(Span::ms(300));
    assert!(shows_text(&seat(bare), "No recent image of track 1."));
}
