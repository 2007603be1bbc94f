//! The client against the core's own definition of the protocol, and against recorded exchanges.

#![expect(clippy::unwrap_used, reason = "a test may end here")]

use std::path::Path;

use guest::jsonl;
use guest_client::follower::Follower;
use guest_client::{Failure, Guest, MAX_LINE, Own, Reply, Start, Step, Velocity, serve};

/// A guest that hands out one reply, and keeps the requests.
struct Keeper<'a> {
    reply: Reply,
    seen: &'a mut (Option<Start>, Vec<Step>),
}

impl Guest for Keeper<'_> {
    fn start(&mut self, start: Start) -> Result<(), Own> {
        self.seen.0 = Some(start);
        Ok(())
    }

    fn step(&mut self, step: Step) -> Result<Reply, Own> {
        if step.number == 13 {
            return Err("no thirteenth step".into());
        }
        self.seen.1.push(step);
        Ok(self.reply.clone())
    }
}

fn start() -> jsonl::Request {
    jsonl::Request::Start(jsonl::Start {
        protocol: guest::file::Protocol::V2.name().into(),
        time_s: 3600.0,
        period_s: 0.05,
        max_speed_m_s: 3.0,
        braking_m_s2: 2.5,
        route: vec![[1.0, 2.0]],
        looped: true,
        fence: vec![[3.0, 4.0]],
        obstacles: vec![jsonl::Disc { at: [5.0, 6.0], radius_m: 0.5 }],
        blocks: vec![jsonl::Block { at: [5.0, 6.0], half_m: [0.5, 0.3], heading_rad: -1.5 }],
        pose: Some(jsonl::StartPose { at: [7.0, 8.0], yaw_rad: 0.5, height_m: Some(2.5) }),
        body: Some(jsonl::Body {
            medium: "air".into(),
            size_m: [0.5, 0.4],
            max_curvature_per_m: 0.4,
            max_reverse_m_s: 1.0,
            max_climb_m_s: 0.8,
            cruise_height_m: 2.5,
        }),
        origin: Some(jsonl::ORIGIN),
    })
}

fn step(number: u32) -> jsonl::Request {
    jsonl::Request::Step(jsonl::Step {
        number,
        time_s: 3600.05,
        limit_m_s: 2.0,
        mode: "READY".into(),
        fix: Some(jsonl::Fix {
            stamp_s: 1.0,
            at: [1.5, 0.1],
            yaw_rad: -0.5,
            sigma_m: 0.04,
            receiver_s: 9.0,
            height_m: Some(2.4),
        }),
        odometry: Some(jsonl::Odometry {
            stamp_s: 2.0,
            speed_m_s: 1.1,
            yaw_rate_rad_s: 0.3,
            left_m_s: Some(0.2),
            up_m_s: Some(-0.1),
        }),
        tracks: vec![jsonl::Track {
            id: 7,
            class: "person".into(),
            at: [1.0, 2.0],
            velocity: [0.5, 0.0],
            confidence: 0.9,
            updated_s: 3.0,
            sigma_m: Some(0.2),
        }],
        teammates: vec![[4.0, 5.0]],
        height_m: Some(2.45),
        nearby: Some(vec![jsonl::Nearby { id: 3, at: [9.0, 1.0], velocity: [0.0, 1.2], width_m: 0.4 }]),
        bus: Vec::new(),
    })
}

fn lines(requests: &[jsonl::Request]) -> String {
    requests.iter().map(|request| serde_json::to_string(request).unwrap() + "\n").collect()
}

type Seen = (Option<Start>, Vec<Step>);

fn served(lines: &str, reply: Reply) -> (Result<(), Failure>, String, Seen) {
    let mut seen = (None, Vec::new());
    let mut answers = Vec::new();
    let mut made = Some(Keeper { reply, seen: &mut seen });
    let result = serve(|| made.take().expect("one start"), lines.as_bytes(), &mut answers);
    drop(made);
    (result, String::from_utf8(answers).unwrap(), seen)
}

#[test]
fn requests_of_the_core_are_read_whole() {
    let (result, _, (begun, steps)) = served(&lines(&[start(), step(1)]), Reply::default());
    assert!(result.is_ok());
    let begun = begun.expect("a start");
    assert_eq!((begun.time_s, begun.period_s, begun.max_speed_m_s, begun.braking_m_s2), (3600.0, 0.05, 3.0, 2.5));
    assert_eq!((begun.route, begun.looped, begun.fence), (vec![[1.0, 2.0]], true, vec![[3.0, 4.0]]));
    assert_eq!((begun.obstacles[0].at, begun.obstacles[0].radius_m), ([5.0, 6.0], 0.5));
    let block = begun.blocks[0];
    assert_eq!((block.at, block.half_m, block.heading_rad), ([5.0, 6.0], [0.5, 0.3], -1.5));
    let (pose, body, origin) =
        (begun.pose.expect("a pose"), begun.body.expect("a body"), begun.origin.expect("an origin"));
    assert_eq!((pose.at, pose.yaw_rad, pose.height_m), ([7.0, 8.0], 0.5, Some(2.5)));
    assert_eq!((body.medium.as_str(), body.size_m, body.cruise_height_m), ("air", [0.5, 0.4], 2.5));
    assert_eq!((body.max_curvature_per_m, body.max_reverse_m_s, body.max_climb_m_s), (0.4, 1.0, 0.8));
    assert_eq!((origin.latitude_deg, origin.longitude_deg, origin.height_m), (47.0, 8.0, 400.0));
    let step = &steps[0];
    let nearby = step.nearby.as_ref().expect("LiDAR")[0];
    assert_eq!((nearby.id, nearby.at, nearby.velocity, nearby.width_m), (3, [9.0, 1.0], [0.0, 1.2], 0.4));
    assert_eq!((step.number, step.time_s, step.limit_m_s, step.mode.as_str()), (1, 3600.05, 2.0, "READY"));
    let (fix, odometry) = (step.fix.expect("a fix"), step.odometry.expect("odometry"));
    assert_eq!((fix.stamp_s, fix.at, fix.yaw_rad, fix.sigma_m, fix.receiver_s), (1.0, [1.5, 0.1], -0.5, 0.04, 9.0));
    assert_eq!(
        (fix.height_m, step.height_m, odometry.left_m_s, odometry.up_m_s),
        (Some(2.4), Some(2.45), Some(0.2), Some(-0.1))
    );
    assert_eq!((odometry.stamp_s, odometry.speed_m_s, odometry.yaw_rate_rad_s), (2.0, 1.1, 0.3));
    let track = &step.tracks[0];
    assert_eq!((track.id, track.class.as_str(), track.at, track.velocity), (7, "person", [1.0, 2.0], [0.5, 0.0]));
    assert_eq!(track.sigma_m, Some(0.2));
    assert_eq!((track.confidence, track.updated_s, &step.teammates), (0.9, 3.0, &vec![[4.0, 5.0]]));
}

#[test]
fn answers_are_those_of_the_core() {
    let reply = Reply {
        speed_m_s: 1.5,
        curvature_per_m: -0.1,
        velocity: None,
        state: Some("GO".into()),
        place: Some([1.0, 2.0]),
        wake_s: Some(0.2),
    };
    let velocity = Velocity { forward_m_s: 1.0, left_m_s: -0.5, up_m_s: 0.2, turn_rad_s: 0.1 };
    for reply in [reply.clone(), Reply { velocity: Some(velocity), ..reply }, Reply::default()] {
        let (_, answers, _) = served(&lines(&[start(), step(3)]), reply.clone());
        let read: Vec<jsonl::Response> = answers.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let Reply { speed_m_s, curvature_per_m, velocity, state, place, wake_s } = reply;
        let velocity = velocity.map(|Velocity { forward_m_s, left_m_s, up_m_s, turn_rad_s }| jsonl::Velocity {
            forward_m_s,
            left_m_s,
            up_m_s,
            turn_rad_s,
        });
        let on_course = velocity.is_none();
        let (speed_m_s, curvature_per_m) = (on_course.then_some(speed_m_s), on_course.then_some(curvature_per_m));
        let expected =
            jsonl::Reply { number: 3, speed_m_s, curvature_per_m, velocity, state, place, wake_s, bus: Vec::new() };
        assert_eq!(read, [jsonl::Response::Ready(jsonl::Ready {}), jsonl::Response::Reply(expected)]);
    }
}

#[test]
fn each_wrong_line_is_refused_by_name() {
    let good = lines(&[step(1)]);
    let cases = [
        ("\n".to_owned(), "EOF"),
        ("[".repeat(60_000), "expected"),
        (good.replace("\"mode\"", "\"mood\""), "missing field `mode`"),
        (good.replace("2.0", "NaN"), "expected"),
        (lines(&[start()]).replace("jsonl/2", "jsonl/3"), "protocol jsonl/1 or jsonl/2 expected, got jsonl/3"),
        (" ".repeat(MAX_LINE + 1), "at most 65536 bytes"),
    ];
    for (line, message) in cases {
        let (result, _, _) = served(&(lines(&[start()]) + &line), Reply::default());
        let failure = result.expect_err(message).to_string();
        assert!(failure.starts_with("line 2: ") && failure.contains(message), "{message} / {failure}");
    }
    let (early, _, _) = served(&good, Reply::default());
    assert_eq!(early.expect_err("no start").to_string(), "line 1: `start` expected, got `step`");
}

#[test]
fn a_guests_own_error_is_told_apart() {
    let (result, _, _) = served(&lines(&[start(), step(13)]), Reply::default());
    assert!(matches!(&result, Err(Failure::Own(why)) if why.to_string() == "no thirteenth step"), "{result:?}");
    let wrong = Reply { speed_m_s: f64::NAN, ..Reply::default() };
    let (result, answers, _) = served(&lines(&[start(), step(1)]), wrong);
    assert!(matches!(&result, Err(Failure::Own(why)) if why.to_string().starts_with("speed_m_s: -100 to 100")));
    assert_eq!(answers.lines().count(), 1, "nothing out of range is written");
}

#[test]
fn the_follower_answers_as_recorded() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../guests/transcripts");
    for name in ["follower-corner.jsonl", "follower-freeze.jsonl", "follower-dropout.jsonl"] {
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        let requests: String = lines.iter().step_by(2).map(|line| format!("{line}\n")).collect();
        let mut answers = Vec::new();
        serve(Follower::default, requests.as_bytes(), &mut answers).unwrap();
        let answers = String::from_utf8(answers).unwrap();
        assert_eq!(answers.lines().count(), lines.len() / 2, "{name}");
        for (pair, (got, recorded)) in answers.lines().zip(lines.iter().skip(1).step_by(2)).enumerate() {
            let read = |line: &str| serde_json::from_str::<jsonl::Response>(line).unwrap();
            assert!(nearly_equal(&read(got), &read(recorded)), "{name}, pair {pair}: {recorded} expected, got {got}");
        }
    }
}

/// True if the responses are equal, numbers to within a billionth: the recording may be from a machine with another
/// mathematical library.
fn nearly_equal(a: &jsonl::Response, b: &jsonl::Response) -> bool {
    let (jsonl::Response::Reply(a), jsonl::Response::Reply(b)) = (a, b) else { return a == b };
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-9;
    let close_or_absent =
        |a: Option<f64>, b: Option<f64>| a.is_some() == b.is_some() && a.zip(b).is_none_or(|(a, b)| close(a, b));
    let places = a.place.iter().flatten().zip(b.place.iter().flatten());
    (a.number, &a.state) == (b.number, &b.state)
        && a.place.is_some() == b.place.is_some()
        && places.into_iter().all(|(a, b)| close(*a, *b))
        && close_or_absent(a.speed_m_s, b.speed_m_s)
        && close_or_absent(a.curvature_per_m, b.curvature_per_m)
}
