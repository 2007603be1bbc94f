//! Reports of a unit over time: its way, its speed, the measurements of its guards, the confidence of its tracks.
//!
//! A trace holds accepted reports only, so a plot of it shows no value where none was heard. It is part of the picture,
//! so that a recording that is moved to another time has the trace of that time. Drawing is left to the views.

use std::collections::VecDeque;
use std::sync::Arc;

use wire::id::TrackId;
use wire::measured::Measured;
use wire::mode::{Guards, Mode};
use wire::motion::ReportedMotion;
use wire::report::{MAX_TRACKS, Report};
use wire::sensor::Pose;
use wire::time::{Instant, Span};

/// Length of the close trace: the last minute.
pub const CLOSE: Span = Span::s(60);
/// Most samples of the close trace: ten a second, and room for two that come together.
pub const MAX_CLOSE: usize = 640;
/// Most samples of the whole run.
pub const MAX_WHOLE: usize = 720;
/// Time between two samples of the whole run, until there are [`MAX_WHOLE`]: then every other one goes.
const APART: Span = Span::s(1);

/// One report's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Time of arrival, on the console's clock.
    pub at: Instant,
    /// Greatest possible age of the state on arrival; absent where it has no bound.
    pub age: Option<Span>,
    /// Mode.
    pub mode: Mode,
    /// Place and heading.
    pub pose: Pose,
    /// Forward speed, mm/s.
    pub speed_mm_s: i32,
    /// Height, charge and attitude of a unit that leaves the ground.
    pub motion: Option<ReportedMotion>,
    /// Measurements of its guards.
    pub measured: Measured,
    /// Guards that failed.
    pub failing: Guards,
    /// Confidence of each reported track, permille.
    pub confidence: [Option<(TrackId, u16)>; MAX_TRACKS],
}

impl Sample {
    /// The sample of a report that came at `at`.
    pub(crate) fn new(at: Instant, age: Option<Span>, report: &Report) -> Self {
        let mut confidence = [None; MAX_TRACKS];
        for (slot, track) in confidence.iter_mut().zip(report.tracks.iter()) {
            *slot = Some((track.id, track.confidence));
        }
        Self {
            at,
            age,
            mode: report.mode,
            pose: report.pose,
            speed_mm_s: report.speed_mm_s,
            motion: report.motion,
            measured: report.measured,
            failing: report.failing,
            confidence,
        }
    }

    /// Confidence of a track in this report, permille.
    pub fn confidence_of(&self, track: TrackId) -> Option<u16> {
        self.confidence.iter().flatten().find(|(id, _)| *id == track).map(|(_, confidence)| *confidence)
    }
}

/// The samples of one unit: the last minute in full, and the whole run thinned out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Trace {
    close: Arc<VecDeque<Sample>>,
    whole: Arc<Vec<Sample>>,
    /// Doublings of the distance between two samples of the whole run.
    doubled: u32,
}

impl Trace {
    /// The last [`CLOSE`], oldest first.
    pub fn close(&self) -> impl DoubleEndedIterator<Item = &Sample> + ExactSizeIterator {
        self.close.iter()
    }

    /// The whole run, oldest first; its last sample can be a few periods old.
    pub fn whole(&self) -> &[Sample] {
        &self.whole
    }

    /// Distance of the samples of the whole run.
    pub fn apart(&self) -> Span {
        Span(APART.0 << self.doubled.min(30))
    }

    /// Adds the newest sample.
    pub(crate) fn push(&mut self, sample: Sample) {
        let close = Arc::make_mut(&mut self.close);
        close.push_back(sample);
        while close.len() > MAX_CLOSE || close.front().is_some_and(|first| sample.at.since(first.at) > CLOSE) {
            close.pop_front();
        }
        let apart = self.apart();
        if self.whole.last().is_some_and(|last| sample.at.since(last.at) < apart && sample.mode == last.mode) {
            return;
        }
        let whole = Arc::make_mut(&mut self.whole);
        whole.push(sample);
        if whole.len() >= MAX_WHOLE {
            let mut nth = 0_usize;
            whole.retain(|_| {
                nth += 1;
                nth % 2 == 1
            });
            self.doubled += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use wire::id::{Boot, RecordId, Sequence, UnitId};
    use wire::time::PeerStamp;

    use super::*;

    fn report(n: u64) -> Report {
        let id = RecordId { node: UnitId::A.node(), boot: Boot(1), sequence: Sequence(n) };
        Report::bare(id, PeerStamp(n))
    }

    fn traced(seconds: u64) -> Trace {
        let mut trace = Trace::default();
        for n in 0..seconds * 10 {
            trace.push(Sample::new(Instant(n * 100_000), Some(Span::ms(20)), &report(n)));
        }
        trace
    }

    #[test]
    fn a_day_of_reports_is_kept_within_bounds() {
        let trace = traced(86_400);
        assert!(trace.close().len() <= 601 && trace.whole().len() < MAX_WHOLE, "{}", trace.whole().len());
        let (first, last) = (trace.whole()[0].at, trace.whole()[trace.whole().len() - 1].at);
        assert_eq!(first, Instant(0));
        assert!(last > Instant(0) + Span::s(86_000), "{last:?}");
    }

    #[test]
    fn a_change_of_mode_is_in_the_whole_run() {
        let mut trace = traced(5);
        let kept = trace.whole().len();
        let held = Report { mode: Mode::HoldSafe, ..report(50) };
        trace.push(Sample::new(Instant(4_950_000), None, &held));
        assert_eq!(trace.whole().len(), kept + 1);
    }
}
