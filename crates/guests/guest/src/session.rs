//! One guest in one run: its answers held against the protocol and against its own file, up to the first failure.
//!
//! A failure is final: the process is ended, and every later request is answered with the failure. Only the start of a unit starts
//! another process. The consequence for the vehicle is left to the core, the one for the verdict to the oracle.

use std::sync::Arc;

use wire::codec::{self, Text};
use wire::guest::{Answer, Fault, MAX_REQUEST, Place, Reply, Request};
use wire::time::Span;

use crate::file::{Output, Program};
use crate::jsonl::{self, Response};
use crate::{Failure, GuestChannel, Launcher, Patience};

/// Largest speed that is a set-point, m/s.
const MAX_SPEED: f64 = 100.0;
/// Largest curvature that is a set-point, 1/m.
const MAX_CURVATURE: f64 = 10.0;
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
}

impl Session {
    /// A session in which nothing has been started yet.
    pub fn new(program: Arc<Program>, launcher: Arc<dyn Launcher>) -> Self {
        Self { program, launcher, state: Ok(None) }
    }

    /// The answer to an encoded request, encoded.
    pub fn answer(&mut self, request: &[u8]) -> Vec<u8> {
        let requested = codec::decode::<Request>(request, MAX_REQUEST);
        let requested =
            requested.map_err(|error| Failure::new(Fault::Malformed, format!("the core's request: {error}")));
        let answer = match requested.and_then(|request| self.ask(&request)) {
            Ok(answer) => answer,
            Err(failure) => failure.answer(),
        };
        codec::encode(&answer)
    }

    /// The answer to a request. Each start gets its own process, as a restarted unit has one.
    ///
    /// # Errors
    /// The guest's failure: the first one, until the next start.
    pub fn ask(&mut self, request: &Request) -> Result<Answer, Failure> {
        if matches!(request, Request::Start(_)) {
            // Drops the process of an earlier start and waits for its end: two guests must not run at once.
            self.state = Ok(None);
            self.state = self.launcher.launch(&self.program).map(Some);
        }
        let answer = self.exchange(request);
        if let Err(failure) = &answer {
            self.state = Err(failure.clone());
        }
        answer
    }

    fn exchange(&mut self, request: &Request) -> Result<Answer, Failure> {
        let channel = match &mut self.state {
            Ok(Some(channel)) => channel,
            Ok(None) => return Err(Failure::new(Fault::Unavailable, "no guest has been started")),
            Err(failure) => return Err(failure.clone()),
        };
        let line = serde_json::to_string(&jsonl::request(request, &self.program))
            .map_err(|error| Failure::new(Fault::Malformed, error.to_string()))?;
        let patience = if matches!(request, Request::Start(_)) { Patience::Start } else { Patience::Step };
        let got = channel.exchange(&line, patience)?;
        let response = parse(&got)?;
        match (request, response) {
            (Request::Start(_), Response::Ready(_)) => Ok(Answer::Ready),
            (Request::Step(step), Response::Reply(reply)) => {
                reply_of(&reply, step.number, &self.program).map(Answer::Reply)
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
fn reply_of(reply: &jsonl::Reply, number: u32, program: &Program) -> Result<Reply, Failure> {
    if reply.number != number {
        return Err(Failure::new(Fault::OutOfStep, format!("step {number} expected, got {}", reply.number)));
    }
    let wake = reply.wake_s.map(|s| check_range("wake_s", s, 0.0, MAX_WAKE)).transpose()?;
    Ok(Reply {
        number,
        speed_mm_s: (check_range("speed_m_s", reply.speed_m_s, -MAX_SPEED, MAX_SPEED)? * 1e3) as i32,
        curvature_um: (check_range("curvature_per_m", reply.curvature_per_m, -MAX_CURVATURE, MAX_CURVATURE)? * 1e6)
            as i32,
        state: state_of(reply.state.as_deref(), program)?,
        place: place_of(reply.place, reply.speed_m_s == 0.0, program)?,
        wake: wake.map(|s| Span((s * 1e6) as u64)),
    })
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

    /// A session with a started program that then answers with these lines.
    fn session(mut lines: Vec<&'static str>) -> Session {
        let text = "name = \"t\"\ncommand = [\"t\"]\nprotocol = \"jsonl/1\"\ngives = [\"drive\", \"state\", \"place\"]\n\
                    [states]\nGO = \"nominal\"\n";
        let program = Program::parse(text, Path::new("/"), |_| Err("none".into())).unwrap();
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
