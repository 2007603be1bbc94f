//! Companion data of a recorded run beside its console's view, moment by moment: the unit's sensor frames, and the
//! reasons for its changes of mode.

use std::sync::Arc;

use console::sidecar::{EvidenceSource, Sidecar, Sight};
use evidence::Micros;
use explain::explain;
use link::input_journal::JournalError;
use perception::stages::Stages;
use recording::messages::{Message, read_messages};
use recording::{Checked, RecordedLog};
use results::report::explained_in_seconds;
use runner::failure::{Exit, Failure};
use wire::core::Topic;
use wire::id::NodeId;
use wire::time::{Instant, Span};

use super::frame::sights;

/// Companion data of a recorded run.
pub(super) struct Beheld {
    frames: Vec<Message>,
    /// Stages that process frames once more; absent where there are none.
    stages: Option<Stages>,
    /// Every change of mode, with its reasons: its time, and the words.
    changes: Vec<(Micros, Arc<str>)>,
    /// The run's time less the console's clock, microseconds.
    ahead: i128,
    /// The frame that was processed last.
    last: Option<(usize, Arc<[Sight]>)>,
}

impl Beheld {
    /// Opens the ground truth of this recording; `None` where it has no input journal of the console.
    ///
    /// # Errors
    /// When a log of it is damaged before its end, or the stages cannot be made.
    pub(super) fn open(
        run: &Checked,
        stages: impl FnOnce() -> Result<Stages, Failure>,
    ) -> Result<Option<Self>, Failure> {
        let RecordedLog { entries, bounds, .. } = RecordedLog::read(run)?;
        let Some(first) = entries.iter().find(|w| w.entry.node == NodeId::CONSOLE) else { return Ok(None) };
        let ahead = i128::from(first.at) - i128::from(first.entry.at.0);
        let unread = |error: JournalError| {
            Failure::new(Exit::NoEvidence, format!("{}: input journals: {error}", run.path().display()))
        };
        let mut frames = read_messages(run, &entries).map_err(unread)?.messages;
        frames.retain(|message| message.topic == Topic::Frames);
        let stages = if frames.is_empty() { None } else { Some(stages()?) };
        let changes = explain(&entries, &bounds)
            .into_iter()
            .map(|explanation| (explanation.at_us, explained_in_seconds(&explanation).into()))
            .collect();
        Ok(Some(Self { frames, stages, changes, ahead, last: None }))
    }

    /// The newest frame at this time of the run, and its age since intake.
    fn sensed(&mut self, on_run: Micros) -> Option<(Arc<[Sight]>, Span)> {
        let place = self.frames.partition_point(|message| message.at <= on_run).checked_sub(1)?;
        let before = Span(on_run - self.frames.get(place)?.at);
        if self.last.as_ref().is_none_or(|(last, _)| *last != place) {
            let sights = sights(&self.frames.get(place)?.bytes, self.stages.as_ref()?)?;
            self.last = Some((place, sights.into()));
        }
        self.last.as_ref().map(|(_, sights)| (Arc::clone(sights), before))
    }
}

impl EvidenceSource for Beheld {
    fn began(&self) -> Option<Instant> {
        u64::try_from(-self.ahead).ok().map(Instant)
    }

    fn evidence_at(&mut self, time: Instant) -> Sidecar {
        let Ok(on_run) = Micros::try_from(i128::from(time.0) + self.ahead) else { return Sidecar::default() };
        let change = self.changes.partition_point(|(at, _)| *at <= on_run).checked_sub(1);
        let because = change.and_then(|place| Some(Arc::clone(&self.changes.get(place)?.1)));
        Sidecar { sensed: self.sensed(on_run), because }
    }
}
