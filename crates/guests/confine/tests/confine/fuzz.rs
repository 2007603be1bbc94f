//! Guests that answer at random: every session ends with a named answer.

use std::collections::BTreeMap;
use std::sync::Arc;

use guest::Session;
use wire::codec::List;
use wire::guest::{ControlStep, Request};
use wire::mode::Mode;
use wire::time::Instant;

use crate::{Case, start};

/// Steps of a session without a failure.
const STEPS: u32 = 12;

/// Answers correctly three times of four, else with one of ten mutations drawn from the seed.
const GUEST: &str = "import random\ndraw = random.Random(SEED)\n\
    while True:\n  \
    asked = json.loads(take() or '{}')\n  \
    good = {'ready': {}} if 'start' in asked else {'reply': {'number': asked.get('step', {}).get('number', 0), 'speed_m_s': 1.0, 'curvature_per_m': 0.0}}\n  \
    line = json.dumps(good)\n  \
    kind = draw.randrange(40)\n  \
    if kind == 0: sys.stdout.buffer.write(draw.randbytes(draw.randrange(1, 200))); sys.stdout.flush()\n  \
    elif kind == 1: give(line[:draw.randrange(len(line))])\n  \
    elif kind == 2: give(line.replace('1.0', draw.choice(['\"1\"', 'null', 'NaN', '1e999', '-1e300', '[]', '{}'])))\n  \
    elif kind == 3: time.sleep(draw.choice([0.001, 10])); give(line)\n  \
    elif kind == 4: os._exit(draw.randrange(256))\n  \
    elif kind == 5: os.kill(os.getpid(), draw.choice([6, 9, 11, 13, 15]))\n  \
    elif kind == 6: give(line); give(line)\n  \
    elif kind == 7: give(json.dumps({draw.choice(['ready', 'reply', 'answer']): draw.choice([{}, [], 1, None])}))\n  \
    elif kind == 8: cut = bytearray(line.encode()); cut[draw.randrange(len(cut))] ^= 1 << draw.randrange(8); sys.stdout.buffer.write(cut + b'\\n'); sys.stdout.flush()\n  \
    elif kind == 9: sys.stderr.write('x' * draw.randrange(5000)); sys.stderr.flush(); give('[' * draw.randrange(70000))\n  \
    else: give(line)\n";

fn step(number: u32) -> Request {
    let (tracks, teammates) = (List::default(), List::default());
    Request::Step(Box::new(ControlStep {
        number,
        now: Instant(0),
        mode: Mode::Idle,
        limit_mm_s: 0,
        navigation: None,
        tracks,
        teammates,
        height_mm: None,
        nearby: None,
    }))
}

/// Runs sessions with seeds from `first`, and counts their ends by name.
fn sessions(first: u32, count: u32) -> Option<BTreeMap<&'static str, u32>> {
    let mut ends = BTreeMap::new();
    for seed in first..first + count {
        let case = Case::python(&GUEST.replace("SEED", &seed.to_string()), "step_ms = 300")?.with_start_ms(3000);
        let mut session = Session::new(Arc::new(case.program.clone()), Arc::clone(&case.launcher));
        let requests = std::iter::once(start()).chain((1..=STEPS).map(step));
        let end = requests.map(|request| session.ask(&request)).find_map(Result::err);
        drop(session);
        assert!(case.left().is_empty(), "seed {seed}");
        *ends.entry(end.map_or("fine", |failure| failure.fault.name())).or_insert(0) += 1;
    }
    Some(ends)
}

#[test]
fn random_guests_end_with_a_name() {
    let Some(ends) = sessions(1, 25) else { return };
    assert!(ends.len() >= 3, "some variety: {ends:?}");
}

#[test]
#[ignore = "takes minutes: cargo test -p confine -- --ignored --nocapture a_thousand"]
fn a_thousand_random_guests_end_with_a_name() {
    let Some(ends) = sessions(1000, 1000) else { return };
    println!("1000 sessions: {ends:?}");
    assert_eq!(ends.values().sum::<u32>(), 1000);
}
