//! A guest in the place of mission and navigation: its set-points reach the plant as they are, or as the guards let
//! them.

use config::platform::Limits;
use wire::codec::Text;
use wire::drive::SetPoint;
use wire::event::Event;
use wire::guest::{Answer, BodyVelocity, Fault, Reply, Request};
use wire::mode::Mode;

use super::bench::Bench;

/// Speed of the newest set-point, mm/s.
fn driven(bench: &Bench) -> Option<i32> {
    bench.drive.map(|_| bench.driven())
}

fn failure(bench: &Bench) -> Option<Fault> {
    bench.events.iter().find_map(|event| match event {
        Event::GuestFailed { fault, .. } => Some(*fault),
        _ => None,
    })
}

#[test]
fn a_guest_hears_the_mission_first() {
    let bench = Bench::piloted(false, None);
    let Some(Request::Start(start)) = bench.asked.first() else { panic!("the mission") };
    assert_eq!((start.max_speed_mm_s, start.route.len(), start.fence.len()), (3000, 1, 4));
    assert!(bench.events.iter().any(|event| matches!(event, Event::GuestEngaged { bare: false, .. })));
}

#[test]
fn only_an_enabled_unit_follows_its_guest() {
    let mut bench = Bench::piloted(false, Some((1000, 0)));
    bench.run(2000);
    assert_eq!(driven(&bench), Some(0), "in IDLE");
    bench.reach(Mode::Ready);
    bench.run(200);
    assert_eq!(driven(&bench), Some(1000));
}

#[test]
fn guards_limit_the_set_points_of_a_guest() {
    for (bare, asked, given) in [(false, 9000, 3000), (true, 9000, 9000), (false, -500, 0), (true, -500, -500)] {
        let mut bench = Bench::piloted(bare, Some((asked, 0)));
        bench.reach(Mode::Ready);
        bench.run(200);
        assert_eq!(driven(&bench), Some(given), "bare {bare}, {asked} mm/s");
    }
}

/// Only a guest that asks by velocity backs up inside the guards, and only where LiDAR looks behind.
#[test]
fn guarded_guest_backs_up_by_velocity_where_lidar_looks() {
    let still = BodyVelocity { left_mm_s: 0, up_mm_s: 0, turn_mrad_s: 0 };
    for (velocity, lidar, given) in [(Some(still), true, -500), (Some(still), false, 0), (None, true, 0)] {
        let mut bench = Bench::piloted(false, Some((-500, 0)));
        (bench.velocity, bench.lidar) = (velocity, lidar);
        bench.reach(Mode::Ready);
        bench.run(200);
        assert_eq!(driven(&bench), Some(given), "{velocity:?}, LiDAR {lidar}");
    }
}

/// Bare a velocity reaches the plant as it is; guarded its course is no faster than the mode, and its turn no faster than the body's.
#[test]
fn velocity_of_a_free_body_is_limited_in_its_own_direction() {
    let freely = Limits { free: true, ..Limits::GROUND };
    let parts = BodyVelocity { left_mm_s: 4000, up_mm_s: 0, turn_mrad_s: 5000 };
    let given = |bare: bool| {
        let mut bench = Bench::piloted_with(freely, bare, Some((0, 0)));
        bench.velocity = Some(parts);
        bench.reach(Mode::Ready);
        bench.run(200);
        bench.drive.map(|drive| drive.set_point)
    };
    assert_eq!(given(true), Some(SetPoint::Velocity { mm_s: [0, 4000, 0], turn_mrad_s: 5000 }));
    let Some(SetPoint::Velocity { mm_s: [forward, left, up], turn_mrad_s }) = given(false) else {
        panic!("a velocity")
    };
    assert!((forward, up) == (0, 0) && (2900..=3000).contains(&left), "{forward} {left} {up}");
    assert_eq!(turn_mrad_s, 1200, "as on the sharpest arc at that speed");
}

#[test]
fn a_guarded_guest_stops_before_the_fence() {
    let mut bench = Bench::piloted(false, Some((2000, 0)));
    bench.reach(Mode::Ready);
    bench.at = (-1000.0, 0.0);
    bench.run(200);
    bench.at.0 = 18_500.0;
    bench.run(100);
    assert!(driven(&bench).is_some_and(|speed| speed < 2000), "{:?}", bench.drive);
}

#[test]
fn lost_localisation_stops_only_the_guarded_guest() {
    let freely = Limits { free: true, ..Limits::GROUND };
    for (limits, bare, given) in
        [(Limits::GROUND, false, 0), (Limits::GROUND, true, 1000), (freely, false, 0), (freely, true, 1000)]
    {
        let mut bench = Bench::piloted_with(limits, bare, Some((1000, 0)));
        bench.reach(Mode::Ready);
        bench.no_fix = true;
        bench.run(350);
        // The bench's bare unit has its guards; what is shown is that none of them touches the set-point.
        assert_eq!(driven(&bench), Some(given), "bare {bare}, moves freely {}", limits.free);
    }
}

#[test]
fn a_silent_guest_fails_by_name() {
    let mut bench = Bench::piloted(false, Some((1000, 0)));
    bench.reach(Mode::Ready);
    bench.run(200);
    bench.pilot = None;
    bench.run(400);
    assert_eq!(failure(&bench), None, "within its limit");
    bench.run(300);
    assert_eq!((failure(&bench), driven(&bench)), (Some(Fault::Silent), Some(0)));
}

#[test]
fn an_answer_to_nothing_is_a_failure() {
    let answers = [
        (Answer::Ready, Fault::OutOfStep),
        (
            Answer::Reply(Reply {
                number: 99,
                speed_mm_s: 0,
                curvature_um: 0,
                state: None,
                place: None,
                wake: None,
                velocity: None,
            }),
            Fault::OutOfStep,
        ),
        (Answer::Failed { fault: Fault::Ended, why: Text::new("exit status 1") }, Fault::Ended),
    ];
    for (answer, fault) in answers {
        let mut bench = Bench::piloted(true, Some((1000, 0)));
        bench.reach(Mode::Ready);
        bench.answer(&answer);
        let last = bench.drive;
        bench.run(500);
        assert_eq!((failure(&bench), bench.drive), (Some(fault), last), "bare, nobody speaks for it any more");
    }
}

#[test]
fn broken_bytes_from_a_guest_are_a_failure() {
    let mut bench = Bench::piloted(false, Some((1000, 0)));
    bench.feed(&wire::core::Input::Guest { bytes: vec![0xff; 300] });
    assert_eq!(failure(&bench), Some(Fault::Malformed));
}
