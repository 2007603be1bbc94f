//! One guest in one run: its answers held against the protocol and against its own file, up to the first failure.
//!
//! A failure is final: the process is ended, and every later request is answered with the failure. Only the start of a unit starts
//! another process. The consequence for the vehicle is left to the core, the one for the verdict to the oracle.

use std::sync::Arc;

use wire::codec::{self, Text};
use wire::guest::{Answer, BodyVelocity, Fault, MAX_REQUEST, Medium, Place, Reply, Request};
use wire::time::Span;

use crate::bus::{self, BusOrder, BusReceipt};
use crate::file::{Output, Program, Protocol};
use crate::jsonl::{self, Response, Velocity};
use crate::{Failure, GuestChannel, Launcher, Patience};

/// Largest speed that is a set-point, m/s.
const MAX_SPEED: f64 = 100.0;
/// Largest curvature that is a set-point, 1/m.
const MAX_CURVATURE: f64 = 10.0;
/// Fastest turn that is a set-point, rad/s.
const MAX_TURN: f64 = 10.0;
/// Speed below which a vehicle on the ground stands and does not turn, m/s.
const STANDS: f64 = 0.01;
/// Furthest coordinate that is a place, m.
const MAX_COORDINATE: f64 = 10_000.0;
/// Longest time until the next step that a guest may ask for, s: the plant follows a set-point no longer than a second.
const MAX_WAKE: f64 = 1.0;
/// Characters of a guest's line that a reason repeats.
const QUOTED: usize = 60;

/// A guest in a run.
pub struct Session {
    program: Arc<Program>,
    launcher: Arc<dyn Launcher>,
    /// The running program, or the failure that ended it; neither before the first start.
    state: Result<Option<Box<dyn GuestChannel>>, Failure>,
    /// Medium of the vehicle's motion, by the newest start.
    medium: Medium,
}

impl Session {
    /// A session in which nothing has been started yet.
    pub fn new(program: Arc<Program>, launcher: Arc<dyn Launcher>) -> Self {
        Self { program, launcher, state: Ok(None), medium: Medium::Ground }
    }

    /// The answer to an encoded request, encoded.
    pub fn answer(&mut self, request: &[u8]) -> Vec<u8> {
        self.answer_attacked(request, &[]).0
    }

    /// The answer to an encoded request, encoded, while these attacks on the guest's bus are open, and their receipts; none after a
    /// failure and for a start.
    pub fn answer_attacked(&mut self, request: &[u8], orders: &[BusOrder]) -> (Vec<u8>, Vec<BusReceipt>) {
        let requested = codec::decode::<Request>(request, MAX_REQUEST);
        let requested =
            requested.map_err(|error| Failure::new(Fault::Malformed, format!("the core's request: {error}")));
        match requested.and_then(|request| self.ask_attacked(&request, orders)) {
            Ok((answer, receipts)) => (codec::encode(&answer), receipts),
            Err(failure) => (codec::encode(&failure.answer()), Vec::new()),
        }
    }

    /// The answer to a request. Each start gets its own process, as a restarted unit has one.
    ///
    /// # Errors
    /// The guest's failure: the first one, until the next start.
    pub fn ask(&mut self, request: &Request) -> Result<Answer, Failure> {
        self.ask_attacked(request, &[]).map(|(answer, _)| answer)
    }

    fn ask_attacked(&mut self, request: &Request, orders: &[BusOrder]) -> Result<(Answer, Vec<BusReceipt>), Failure> {
        let answer = match request {
            Request::Start(start) => self.begin(start.body.map_or(Medium::Ground, |body| body.medium), request),
            Request::Step(_) => self.exchange(request, orders),
        };
        if let Err(failure) = &answer {
            self.fail(failure);
        }
        answer
    }

    /// Starts a process and hands it the mission. One that has served a trial before may have ended since: then another is started.
    fn begin(&mut self, medium: Medium, request: &Request) -> Result<(Answer, Vec<BusReceipt>), Failure> {
        self.medium = medium;
        loop {
            // Drops the process of an earlier start and waits for its end: two guests must not run at once.
            self.state = Ok(None);
            let channel = self.launcher.launch(&self.program)?;
            let is_reused = channel.is_reused();
            self.state = Ok(Some(channel));
            let answer = self.exchange(request, &[]);
            match &answer {
                Err(failure) if is_reused => self.fail(failure),
                _ => return answer,
            }
        }
    }

    /// Ends the process: none that has failed serves another trial.
    fn fail(&mut self, failure: &Failure) {
        if let Ok(Some(channel)) = &mut self.state {
            channel.end();
        }
        self.state = Err(failure.clone());
    }

    fn exchange(&mut self, request: &Request, orders: &[BusOrder]) -> Result<(Answer, Vec<BusReceipt>), Failure> {
        let channel = match &mut self.state {
            Ok(Some(channel)) => channel,
            Ok(None) => return Err(Failure::new(Fault::Unavailable, "no guest has been started")),
            Err(failure) => return Err(failure.clone()),
        };
        let line = serde_json::to_string(&jsonl::request(request, &self.program, orders))
            .map_err(|error| Failure::new(Fault::Malformed, error.to_string()))?;
        let patience = if matches!(request, Request::Start(_)) { Patience::Start } else { Patience::Step };
        let got = channel.exchange(&line, patience)?;
        let response = parse(&got)?;
        match (request, response) {
            (Request::Start(_), Response::Ready(_)) => Ok((Answer::Ready, Vec::new())),
            (Request::Step(step), Response::Reply(mut reply)) => {
                let receipts = bus::check(orders, std::mem::take(&mut reply.bus))?;
                let answer = reply_of(&reply, step.number, &self.program, self.medium).map(Answer::Reply)?;
                Ok((answer, receipts))
            }
            (Request::Start(_), Response::Reply(_)) => Err(unexpected("ready", "reply")),
            (Request::Step(_), Response::Ready(_)) => Err(unexpected("reply", "ready")),
        }
    }
}

fn parse(line: &str) -> Result<Response, Failure> {
    serde_json::from_str(line).map_err(|error| {
        let quoted: String = line.chars().take(QUOTED).collect();
        Failure::new(Fault::Malformed, format!("{error}: {quoted}"))
    })
}

fn unexpected(expected: &str, got: &str) -> Failure {
    Failure::new(Fault::OutOfStep, format!("`{expected}` expected, got `{got}`"))
}

/// A reply in the core's units, held against the file.
fn reply_of(reply: &jsonl::Reply, number: u32, program: &Program, medium: Medium) -> Result<Reply, Failure> {
    if reply.number != number {
        return Err(Failure::new(Fault::OutOfStep, format!("step {number} expected, got {}", reply.number)));
    }
    let wake = reply.wake_s.map(|s| check_range("wake_s", s, 0.0, MAX_WAKE)).transpose()?;
    let point = set_point(reply, program.protocol, medium)?;
    Ok(Reply {
        number,
        speed_mm_s: (point.speed * 1e3) as i32,
        curvature_um: (point.curvature * 1e6) as i32,
        state: state_of(reply.state.as_deref(), program)?,
        place: place_of(reply.place, point.stands(), program)?,
        wake: wake.map(|s| Span((s * 1e6) as u64)),
        velocity: point.velocity,
    })
}

/// A set-point in SI units.
struct SetPoint {
    speed: f64,
    curvature: f64,
    velocity: Option<BodyVelocity>,
}

impl SetPoint {
    fn stands(&self) -> bool {
        self.speed == 0.0 && self.velocity.is_none_or(|parts| (parts.left_mm_s, parts.up_mm_s) == (0, 0))
    }
}

/// The set-point of a reply, which is given in one of two forms.
fn set_point(reply: &jsonl::Reply, protocol: Protocol, medium: Medium) -> Result<SetPoint, Failure> {
    let malformed = |why: &str| Failure::new(Fault::Malformed, why);
    let Some(velocity) = reply.velocity else {
        let speed = reply.speed_m_s.ok_or_else(|| malformed("missing field `speed_m_s`"))?;
        let curvature = reply.curvature_per_m.ok_or_else(|| malformed("missing field `curvature_per_m`"))?;
        let speed = check_range("speed_m_s", speed, -MAX_SPEED, MAX_SPEED)?;
        let curvature = check_range("curvature_per_m", curvature, -MAX_CURVATURE, MAX_CURVATURE)?;
        return Ok(SetPoint { speed, curvature, velocity: None });
    };
    if protocol < Protocol::V2 {
        return Err(malformed("`velocity` needs protocol jsonl/2 in the guest's file"));
    }
    if reply.speed_m_s.is_some() || reply.curvature_per_m.is_some() {
        return Err(malformed("`velocity` stands in place of `speed_m_s` and `curvature_per_m`"));
    }
    let Velocity { forward_m_s, left_m_s, up_m_s, turn_rad_s } = velocity;
    let sideways = if medium == Medium::Ground { 0.0 } else { MAX_SPEED };
    let speed = check_range("forward_m_s", forward_m_s, -MAX_SPEED, MAX_SPEED)?;
    let left = check_range("left_m_s", left_m_s, 0.0 - sideways, sideways)?;
    let up = check_range("up_m_s", up_m_s, 0.0 - sideways, sideways)?;
    let turn = check_range("turn_rad_s", turn_rad_s, -MAX_TURN, MAX_TURN)?;
    let on_arc = medium == Medium::Ground && speed.abs() >= STANDS;
    let curvature = if on_arc { (turn / speed).clamp(-MAX_CURVATURE, MAX_CURVATURE) } else { 0.0 };
    let thousandths = |unit: f64| (unit * 1e3) as i32;
    let parts = BodyVelocity { left_mm_s: thousandths(left), up_mm_s: thousandths(up), turn_mrad_s: thousandths(turn) };
    Ok(SetPoint { speed, curvature, velocity: Some(parts) })
}

fn check_range(field: &str, got: f64, least: f64, most: f64) -> Result<f64, Failure> {
    if (least..=most).contains(&got) {
        return Ok(got);
    }
    Err(Failure::new(Fault::Value, format!("{field}: {least} to {most} expected, got {got}")))
}

fn promised<T>(got: Option<T>, output: Output, field: &str, program: &Program) -> Result<Option<T>, Failure> {
    match (got, program.gives(output)) {
        (None, true) => Err(Failure::new(Fault::Undeclared, format!("`{field}` is promised in the file and missing"))),
        (Some(_), false) => Err(Failure::new(Fault::Undeclared, format!("`{field}` is not among the file's outputs"))),
        (got, _) => Ok(got),
    }
}

type State = (wire::guest::Declared, Text<{ wire::guest::MAX_NAME }>);

fn state_of(state: Option<&str>, program: &Program) -> Result<Option<State>, Failure> {
    let Some(state) = promised(state, Output::State, "state", program)? else { return Ok(None) };
    let declared = program.states.get(state).copied().ok_or_else(|| {
        let got: String = state.chars().take(QUOTED).collect();
        Failure::new(Fault::Undeclared, format!("a state of the file's [states] expected, got {got:?}"))
    })?;
    Ok(Some((declared, Text::new(state))))
}

/// Place of a reply. A guest that stands may know none yet; a guest that drives must state the one it uses.
fn place_of(place: Option<[f64; 2]>, standing: bool, program: &Program) -> Result<Option<Place>, Failure> {
    if place.is_none() && standing {
        return Ok(None);
    }
    let Some([x, y]) = promised(place, Output::Place, "place", program)? else { return Ok(None) };
    let millimetres = |field, m| check_range(field, m, -MAX_COORDINATE, MAX_COORDINATE).map(|m| (m * 1e3) as i32);
    Ok(Some(Place(millimetres("place east", x)?, millimetres("place north", y)?)))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use ground_truth::BusAttack;
    use wire::codec::List;
    use wire::guest::{ControlStep, Declared, MissionStart};
    use wire::mode::Mode;
    use wire::time::Instant;

    use super::*;

    struct Says(Vec<&'static str>);

    impl GuestChannel for Says {
        fn exchange(&mut self, _: &str, _: Patience) -> Result<String, Failure> {
            let next = self.0.pop().map(str::to_owned);
            next.ok_or_else(|| Failure::new(Fault::Ended, "end of its output"))
        }
    }

    impl Launcher for Says {
        fn launch(&self, _: &Program) -> Result<Box<dyn GuestChannel>, Failure> {
            Ok(Box::new(Says(self.0.clone())))
        }
    }

    fn session(lines: Vec<&'static str>) -> Session {
        session_of("jsonl/1", lines)
    }

    /// A session with a started program that then answers with these lines.
    fn session_of(protocol: &str, mut lines: Vec<&'static str>) -> Session {
        let text = format!(
            "name = \"t\"\ncommand = [\"t\"]\nprotocol = \"{protocol}\"\n\
             gives = [\"drive\", \"state\", \"place\"]\n[states]\nGO = \"nominal\"\n"
        );
        let program = Program::parse(&text, Path::new("/"), |_| Err("none".into())).unwrap();
        lines.push(READY);
        lines.rotate_right(1);
        lines.reverse();
        let mut session = Session::new(Arc::new(program), Arc::new(Says(lines)));
        assert_eq!(session.ask(&start()), Ok(Answer::Ready));
        session
    }

    fn start() -> Request {
        Request::Start(Box::new(MissionStart {
            now: Instant(0),
            period: Span::ms(50),
            max_speed_mm_s: 3000,
            braking_mm_s2: 3000,
            route: List::default(),
            looped: false,
            fence: List::default(),
            obstacles: List::default(),
            blocks: None,
            pose: None,
            body: None,
        }))
    }

    fn step(number: u32) -> Request {
        Request::Step(Box::new(ControlStep {
            number,
            now: Instant(0),
            mode: Mode::Ready,
            limit_mm_s: 3000,
            navigation: None,
            tracks: List::default(),
            teammates: List::default(),
            height_mm: None,
            nearby: None,
        }))
    }

    const READY: &str = r#"{"ready":{}}"#;
    const REPLY: &str =
        r#"{"reply":{"number":1,"speed_m_s":1.5,"curvature_per_m":-0.1,"state":"GO","place":[1,2],"wake_s":0.2}}"#;

    #[test]
    fn a_reply_reaches_the_core_in_its_units() {
        let mut session = session(vec![REPLY]);
        let Ok(Answer::Reply(reply)) = session.ask(&step(1)) else { panic!("a reply") };
        assert_eq!((reply.speed_mm_s, reply.curvature_um, reply.place), (1500, -100_000, Some(Place(1000, 2000))));
        assert_eq!((reply.wake, reply.state), (Some(Span::ms(200)), Some((Declared::Nominal, Text::new("GO")))));
    }

    #[test]
    fn each_wrong_answer_fails_by_name() {
        let wrong = [
            ("", Fault::Malformed, "EOF"),
            ("[1", Fault::Malformed, "expected"),
            (r#"{"ready":{}}"#, Fault::OutOfStep, "`reply` expected"),
            (r#"{"reply":{"number":1,"speed_m_s":NaN,"curvature_per_m":0}}"#, Fault::Malformed, "expected"),
            (&REPLY.replace("1.5", "1e300"), Fault::Value, "speed_m_s: -100 to 100 expected"),
            (&REPLY.replace("-0.1", "11"), Fault::Value, "curvature_per_m"),
            (&REPLY.replace("\"number\":1", "\"number\":2"), Fault::OutOfStep, "step 1 expected, got 2"),
            (&REPLY.replace("GO", "STOP"), Fault::Undeclared, "[states] expected, got \"STOP\""),
            (&REPLY.replace(r#""state":"GO","#, ""), Fault::Undeclared, "`state` is promised"),
            (&REPLY.replace("0.2", "1.5"), Fault::Value, "wake_s: 0 to 1 expected"),
            (&REPLY.replace("wake_s", "time_s"), Fault::Malformed, "unknown field `time_s`"),
            (&REPLY.replace("[1,2]", "[1e9,2]"), Fault::Value, "place east"),
            (&REPLY.replace("[1,2]", "null"), Fault::Undeclared, "`place` is promised"),
        ];
        for (line, fault, why) in wrong {
            let line: &'static str = line.to_owned().leak();
            let failure = session(vec![line]).ask(&step(1)).expect_err(line);
            assert_eq!(failure.fault, fault, "{line}: {failure}");
            assert!(failure.why.contains(why), "{line}: {failure}");
        }
    }

    #[test]
    fn a_standing_guest_need_not_know_its_place() {
        let line = REPLY.replace("[1,2]", "null").replace("1.5", "0").leak();
        assert!(matches!(session(vec![line]).ask(&step(1)), Ok(Answer::Reply(Reply { place: None, .. }))));
    }

    #[test]
    fn velocity_is_a_set_point_of_the_second_version_alone() {
        let velocity =
            r#"{"reply":{"number":1,"velocity":{"forward_m_s":-0.5,"turn_rad_s":0.1},"state":"GO","place":[1,2]}}"#;
        let failure = session(vec![velocity]).ask(&step(1)).unwrap_err();
        assert!(failure.why.contains("jsonl/2"), "{failure}");
        let Ok(Answer::Reply(reply)) = session_of("jsonl/2", vec![velocity]).ask(&step(1)) else { panic!("a reply") };
        let parts = BodyVelocity { left_mm_s: 0, up_mm_s: 0, turn_mrad_s: 100 };
        assert_eq!((reply.speed_mm_s, reply.curvature_um, reply.velocity), (-500, -200_000, Some(parts)));
        let wrong = [
            (velocity.replace("\"turn", "\"left_m_s\":1,\"turn"), "left_m_s: 0 to 0 expected, got 1"),
            (velocity.replace("\"state", "\"speed_m_s\":1,\"state"), "in place of"),
        ];
        for (line, why) in wrong {
            let failure = session_of("jsonl/2", vec![line.leak()]).ask(&step(1)).unwrap_err();
            assert!(failure.why.contains(why), "{failure}");
        }
    }

    #[test]
    fn each_order_to_the_bus_has_its_receipt() {
        let order = BusOrder { id: 1, attack: BusAttack::Clock, rate_hz: 20.0, amount: 5.0 };
        let replied =
            |bus: &str| -> &'static str { REPLY.replace("\"wake", &format!("\"bus\":[{bus}],\"wake")).leak() };
        let good = r#"{"id":1,"sent":3,"received":2,"honest":1,"used":true}"#;
        let request = codec::encode(&step(1));
        let (answer, receipts) = session_of("jsonl/2", vec![replied(good)]).answer_attacked(&request, &[order]);
        assert!(matches!(codec::decode::<Answer>(&answer, wire::guest::MAX_ANSWER), Ok(Answer::Reply(_))));
        assert_eq!(receipts, [BusReceipt { id: 1, sent: 3, received: 2, honest: 1, used: true, why: None }]);
        let wrong = [
            (REPLY, "receipts of the orders [1] expected, got []"),
            (replied(&good.replace("\"id\":1", "\"id\":2")), "receipts of the orders [1] expected, got [2]"),
            (replied(&good.replace(":3", ":70000")), "at most 65535 messages expected, got 70000"),
        ];
        for (line, why) in wrong {
            let failure = session_of("jsonl/2", vec![line]).ask_attacked(&step(1), &[order]).unwrap_err();
            assert!(failure.why.contains(why), "{failure}");
        }
        let failure = session(vec![replied(good)]).ask(&step(1)).unwrap_err();
        assert!(failure.why.contains("receipts of the orders [] expected, got [1]"), "{failure}");
    }

    #[test]
    fn the_first_failure_is_final_until_a_start() {
        let mut session = session(vec!["{}", REPLY]);
        let first = session.ask(&step(1));
        assert!(first.is_err());
        assert_eq!(session.ask(&step(1)), first, "a later good answer is not heard");
        assert_eq!(session.ask(&start()), Ok(Answer::Ready), "a unit that starts anew has a process of its own");
    }

    #[test]
    fn nothing_is_asked_of_a_guest_before_its_start() {
        let text = "name = \"t\"\ncommand = [\"t\"]\nprotocol = \"jsonl/1\"\ngives = [\"drive\"]\n";
        let program = Program::parse(text, Path::new("/"), |_| Err("none".into())).unwrap();
        let failure = Session::new(Arc::new(program), Arc::new(Says(Vec::new()))).ask(&step(1)).unwrap_err();
        assert_eq!(failure.fault, Fault::Unavailable);
    }
}
