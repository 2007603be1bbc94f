//! Beginning and end of an action: at its time, or once the event that it waits for has come.
//!
//! Each core holds one [`Opening`] an action and shows it the traffic, the words heard and the calls. A step
//! that has a name is reported to the log as it begins and ends, so that others can wait for it. An action that does
//! something by itself a counted number of times has its times here too.

use ground_truth::StepName;
use wire::core::Side;
use wire::mode::Mode;
use wire::time::{Instant, Span};

use crate::plan::{Direction, On, PlanStep, Timed};
use crate::schedule::Steps;

/// Beginning and end of one action.
#[derive(Clone, Debug)]
pub(crate) struct Opening {
    step: Option<PlanStep>,
    direction: Direction,
    earliest: Instant,
    lasts: Span,
    opens: Option<Instant>,
    /// Datagrams or pieces since the earliest time.
    passed: u32,
    /// Time at which the last of them passed; the earliest time before that.
    last: Instant,
    /// True for the beginning, and for the end, once it is logged.
    told: [bool; 2],
    /// Number of repetitions that the action makes by itself, and their spacing, milliseconds.
    counted: Option<(u32, u64)>,
    /// Duration of the action, which cuts the repetitions short.
    window: Option<Span>,
    /// Times of the repetitions, once the beginning is settled.
    times: Option<Steps>,
}

impl Opening {
    /// Opening of an action that may begin `start_ms` after `origin` and lasts `lasts`.
    pub(crate) fn new(
        step: Option<PlanStep>,
        direction: Direction,
        origin: Instant,
        start_ms: u64,
        lasts: Span,
    ) -> Self {
        let earliest = origin + Span::ms(start_ms);
        let waits = step.is_some_and(|step| step.wait.is_some());
        let opens = (!waits).then_some(earliest);
        let told = [false; 2];
        Self {
            step,
            direction,
            earliest,
            lasts,
            opens,
            passed: 0,
            last: earliest,
            told,
            counted: None,
            window: None,
            times: None,
        }
    }

    /// Opening of an action that does something `n` times, `every_ms` apart.
    pub(crate) fn counted(step: Option<PlanStep>, origin: Instant, start_ms: u64, (n, every_ms): (u32, u64)) -> Self {
        let lasts = Span::ms(u64::from(n.saturating_sub(1)) * every_ms);
        let opening = Self::new(step, Direction::Up, origin, start_ms, lasts);
        Self { counted: Some((n, every_ms)), ..opening }
    }

    /// Opening of a timed action; `counted` is its repetitions by itself: their number, and their spacing in ms.
    pub(crate) fn from_timed<A>(timed: &Timed<A>, origin: Instant, counted: Option<(u32, u64)>) -> Self {
        let by_itself = counted.map(|(n, every_ms)| u64::from(n.saturating_sub(1)) * every_ms);
        let window = Some(timed.duration_ms).filter(|ms| *ms > 0);
        let lasts = by_itself.into_iter().chain(window).min().unwrap_or(0);
        let opening = Self::new(timed.step, timed.direction, origin, timed.start_ms, Span::ms(lasts));
        Self { counted, window: window.map(Span::ms), ..opening }
    }

    /// Takes one repetition, if one is due at `now`.
    pub(crate) fn take(&mut self, now: Instant) -> bool {
        self.times = self.times.or_else(|| self.due_times());
        self.times.as_mut().is_some_and(|times| times.take(now))
    }

    fn due_times(&self) -> Option<Steps> {
        let ((n, every_ms), opens) = (self.counted?, self.opens?);
        Some(Steps::new(opens, every_ms, n, self.window.map(|window| opens + window)))
    }

    /// Time at which the action begins, once settled.
    pub(crate) fn opens(&self) -> Option<Instant> {
        self.opens
    }

    /// Time at which the action ends: everything of it happens before.
    pub(crate) fn closes(&self) -> Option<Instant> {
        self.opens.map(|opens| opens + self.lasts)
    }

    /// True if the action is under way at `now`.
    pub(crate) fn is_open(&self, now: Instant) -> bool {
        self.opens.is_some_and(|opens| now >= opens && now < opens + self.lasts)
    }

    /// True if the action applies at `now` to traffic towards `side`.
    pub(crate) fn open(&self, now: Instant, side: Side) -> bool {
        self.direction.covers(side) && self.is_open(now)
    }

    /// The step `name` is called.
    pub(crate) fn cue(&mut self, now: Instant, name: &str) {
        if self.step.is_some_and(|step| step.name.as_str() == name) && self.waits_for() == Some(On::Cue) {
            self.begin(now.max(self.earliest));
        }
    }

    /// Something passes towards `side`.
    pub(crate) fn passes(&mut self, now: Instant, side: Side) {
        if self.waits_for().is_none() || now < self.earliest || !self.direction.covers(side) {
            return;
        }
        self.silence(now);
        self.last = now;
        self.passed = self.passed.saturating_add(1);
        if self.waits_for() == Some(On::Passes(self.passed)) {
            self.begin(now);
        }
    }

    /// The unit under test reports `mode`.
    pub(crate) fn hears(&mut self, now: Instant, mode: Mode) {
        if now >= self.earliest && self.waits_for() == Some(On::Hears(mode)) {
            self.begin(now);
        }
    }

    /// Time has passed: a silence may have become long enough.
    pub(crate) fn silence(&mut self, now: Instant) {
        if let Some(On::Silence(ms)) = self.waits_for()
            && self.last + Span::ms(ms) <= now
        {
            self.begin(self.last + Span::ms(ms));
        }
    }

    /// Next time of interest: the end of a silence, a boundary to log, or a repetition.
    pub(crate) fn due(&self) -> Option<Instant> {
        if let Some(On::Silence(ms)) = self.waits_for() {
            return Some(self.last + Span::ms(ms));
        }
        let time = self.step.and_then(|_| match self.told {
            [false, _] => self.opens(),
            [true, false] => self.closes(),
            [true, true] => None,
        });
        let does = self.times.or_else(|| self.due_times()).and_then(|times| times.due());
        time.into_iter().chain(does).min()
    }

    /// A beginning (true) or end by `now` that was not logged yet, one at a time.
    pub(crate) fn next_boundary(&mut self, now: Instant) -> Option<(StepName, bool)> {
        let name = self.step?.name;
        let ends = [self.opens(), self.closes()];
        let i = (0..2).find(|i| !self.told[*i] && ends[*i].is_some_and(|time| time <= now))?;
        self.told[i] = true;
        Some((name, i == 0))
    }

    /// Event that it still waits for.
    fn waits_for(&self) -> Option<On> {
        let wait = self.step.and_then(|step| step.wait)?;
        self.opens.is_none().then_some(wait.on)
    }

    fn begin(&mut self, time: Instant) {
        let after = self.step.and_then(|step| step.wait).map_or(0, |wait| wait.after_ms);
        self.opens = Some(time + Span::ms(after));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Wait;
    use crate::testing::at_ms;

    fn waiting(on: On, after_ms: u64) -> Opening {
        let name = StepName::new("cut").unwrap();
        let step = Some(PlanStep { name, wait: Some(Wait { on, after_ms }) });
        Opening::new(step, Direction::Up, at_ms(0), 1000, Span::ms(500))
    }

    #[test]
    fn events_before_the_earliest_time_do_not_count() {
        let mut passes = waiting(On::Passes(2), 0);
        (990..1001).for_each(|ms| passes.passes(at_ms(ms), Side::Server));
        assert_eq!(passes.opens(), None, "one passed since");
        passes.passes(at_ms(1001), Side::Client);
        assert_eq!(passes.opens(), None, "the other way");
        passes.passes(at_ms(1002), Side::Server);
        assert!(passes.open(at_ms(1002), Side::Server) && !passes.open(at_ms(1502), Side::Server));
        let mut heard = waiting(On::Hears(Mode::Ready), 0);
        heard.hears(at_ms(999), Mode::Ready);
        heard.hears(at_ms(1100), Mode::Degraded);
        assert_eq!(heard.opens(), None);
        heard.hears(at_ms(1200), Mode::Ready);
        assert_eq!(heard.opens(), Some(at_ms(1200)));
    }

    /// A call to another step is not this opening's.
    #[test]
    fn early_call_is_kept_others_are_ignored() {
        let mut opening = waiting(On::Cue, 30);
        opening.cue(at_ms(10), "other");
        assert_eq!(opening.opens(), None);
        opening.cue(at_ms(10), "cut");
        assert_eq!(opening.opens(), Some(at_ms(1030)));
        opening.cue(at_ms(2000), "cut");
        assert_eq!(opening.opens(), Some(at_ms(1030)), "a step begins once");
    }

    /// A silence counts in full even if the core is asked late.
    #[test]
    fn silence_counts_from_the_last_passage() {
        let mut opening = waiting(On::Silence(100), 0);
        assert_eq!(opening.due(), Some(at_ms(1100)));
        opening.passes(at_ms(1050), Side::Server);
        opening.silence(at_ms(1149));
        assert_eq!(opening.opens(), None);
        opening.passes(at_ms(1200), Side::Server);
        assert_eq!(opening.opens(), Some(at_ms(1150)));
    }

    #[test]
    fn named_step_logs_its_beginning_and_end() {
        let mut opening = waiting(On::Cue, 0);
        opening.cue(at_ms(1200), "cut");
        for (ms, told) in [(1199, None), (1200, Some(true)), (1699, None), (1700, Some(false)), (1800, None)] {
            assert_eq!(opening.next_boundary(at_ms(ms)).map(|(_, begun)| begun), told, "{ms}");
        }
        assert_eq!(opening.due(), None);
    }
}
