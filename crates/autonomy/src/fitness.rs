//! Fitness of one track by itself, for designation.

use wire::bounds::Bounds;
use wire::sensor::Class;
use wire::track::Track;

/// State of authority on the track, asked for or held; holding it asks for less confidence (hysteresis).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// Authority is asked for.
    Arming,
    /// Authority is held.
    Held,
}

/// True if a track is fit by itself.
pub(crate) fn fit(track: &Track, stage: Stage, bounds: &Bounds) -> bool {
    let least = match stage {
        Stage::Arming => bounds.designation_confidence,
        Stage::Held => bounds.designation_keep,
    };
    track.class == Class::Vehicle
        && track.confidence >= least
        && track.supported.designate()
        && track.vetoed.count() == 0
}
