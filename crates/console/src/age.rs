//! Values that age: no value is drawn without its present age.
//!
//! An [`Aged`] value can be read only as a [`Labelled`] one: with the upper bound of its age at a given time of the
//! console's own monotonic clock, and the freshness that follows from it. The age starts from the bound that the
//! boundary established and grows with that clock; no foreign stamp enters, so none can lower it.

use wire::bounds::Bounds;
use wire::event::Freshness;
use wire::id::TrackId;
use wire::policy::{DisplayRule, Policy, Requirement};
use wire::report::ReportedTrack;
use wire::time::{Age, Instant, Span};

/// Periods without a report after which a source counts as gone: two seconds at ten reports a second.
const LOST_AFTER_PERIODS: u64 = 20;

/// The age from which a unit counts as gone, from the rate at which it reports: never before it is shown as stale.
pub fn lost_after(bounds: &Bounds) -> Span {
    Span::ms(LOST_AFTER_PERIODS * bounds.telemetry_period_ms).max(late_after(bounds))
}

/// *Tf* and two periods of telemetry.
fn late_after(bounds: &Bounds) -> Span {
    bounds.freshness() + Span::ms(2 * bounds.telemetry_period_ms)
}

/// Age limits behind the labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AgeLimits {
    /// Oldest that is shown as fresh: *Tf*.
    pub fresh: Span,
    /// Oldest that is shown as late: *Tf* and two periods of telemetry.
    pub late: Span,
    /// Oldest that is shown as stale; beyond it, as lost.
    pub stale: Span,
    /// True if values age at all. Where the policy waives it, all is drawn as on arrival, for ever: the paper's fault.
    pub age_out: bool,
}

impl AgeLimits {
    /// The limits of a platform under a policy.
    pub fn new(bounds: &Bounds, policy: &Policy) -> Self {
        Self {
            fresh: bounds.freshness(),
            late: late_after(bounds),
            stale: lost_after(bounds),
            age_out: policy.display(DisplayRule::AgeOut) == Requirement::Required,
        }
    }

    /// The label of something this old.
    pub fn label(&self, age: Span) -> Freshness {
        if age <= self.fresh {
            Freshness::Fresh
        } else if age <= self.late {
            Freshness::Late
        } else if age <= self.stale {
            Freshness::Stale
        } else {
            Freshness::Lost
        }
    }
}

/// A value that was at most so old when it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Aged<T> {
    value: T,
    arrived: Instant,
    /// Upper bound of its age on arrival; `None` when unbounded.
    before: Option<Span>,
}

impl<T: Clone> Aged<T> {
    /// A value that arrived at `arrived` (the console's clock) and was at most `age` old then.
    pub fn new(value: T, arrived: Instant, age: Option<Age>) -> Self {
        Self { value, arrived, before: age.map(Age::upper) }
    }

    /// The value as it may be drawn at `now`.
    pub fn label_at(&self, now: Instant, limits: &AgeLimits) -> Labelled<T> {
        let (age, freshness) = match self.before {
            before if !limits.age_out => (before.unwrap_or_default(), Freshness::Fresh),
            Some(before) => {
                let age = now.since(self.arrived) + before;
                (age, limits.label(age))
            }
            None => (Span(u64::MAX), Freshness::Lost),
        };
        Labelled { value: self.value.clone(), age, freshness }
    }

    /// The value as it may be drawn at `now`, its source having dropped it: lost, however young, and its age grows
    /// under every policy.
    pub fn lost_at(&self, now: Instant) -> Labelled<T> {
        let age = self.before.map_or(Span(u64::MAX), |before| now.since(self.arrived) + before);
        Labelled { value: self.value.clone(), age, freshness: Freshness::Lost }
    }

    /// Time at which the label changes next after `now`; `None` when it stays.
    pub fn changes(&self, now: Instant, limits: &AgeLimits) -> Option<Instant> {
        let before = self.before.filter(|_| limits.age_out)?;
        let age = now.since(self.arrived) + before;
        let next = [limits.fresh, limits.late, limits.stale].into_iter().find(|limit| age <= *limit)?;
        // The first microsecond beyond the limit; `age` counts from the later of `now` and arrival.
        let from = Instant(now.0.max(self.arrived.0));
        Some(from + Span(next.0 - age.0) + Span(1))
    }
}

impl Aged<()> {
    /// Another value of the same age.
    pub fn with_value<T>(&self, value: T) -> Aged<T> {
        Aged { value, arrived: self.arrived, before: self.before }
    }
}

impl Aged<ReportedTrack> {
    /// Number of the track, which does not age.
    pub fn id(&self) -> TrackId {
        self.value.id
    }
}

/// A value with its age and freshness, as drawn. Made by an [`Aged`] alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Labelled<T> {
    value: T,
    age: Span,
    freshness: Freshness,
}

impl<T> Labelled<T> {
    /// The value `delay` later, with no message in between: older, and no fresher.
    #[must_use]
    pub(crate) fn older(self, delay: Span, limits: &AgeLimits) -> Self {
        // Where values do not age, only what is lost does.
        if !limits.age_out && self.freshness != Freshness::Lost {
            return self;
        }
        let age = self.age + delay;
        Self { age, freshness: self.freshness.max(limits.label(age)), ..self }
    }

    /// The value together with its freshness.
    pub fn get(&self) -> (&T, Freshness) {
        (&self.value, self.freshness)
    }

    /// The value, if it may be relied on.
    pub fn fresh(&self) -> Option<&T> {
        (self.freshness == Freshness::Fresh).then_some(&self.value)
    }

    /// Upper bound of its age.
    pub fn age(&self) -> Span {
        self.age
    }

    /// Freshness by these limits.
    pub fn freshness(&self) -> Freshness {
        self.freshness
    }
}
