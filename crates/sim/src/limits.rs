//! Limits that the numbers of a scene, its weather and its faults keep to, and the error of one that does not.

/// Reason for which a scene cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A number is NaN, infinite or out of the field's range.
    #[error("{field} is {got}, outside {low} to {high}")]
    OutOfRange {
        /// Name of the field.
        field: &'static str,
        /// Value in the scene.
        got: f32,
        /// Least value.
        low: f32,
        /// Greatest value.
        high: f32,
    },
    /// A list has too few or too many items.
    #[error("{field} has {got} items, {low} to {high} allowed")]
    Count {
        /// Name of the field.
        field: &'static str,
        /// Items in the scene.
        got: usize,
        /// Fewest items.
        low: usize,
        /// Most items.
        high: usize,
    },
    /// A fault names an effect that its sensor cannot have, or a perturbation that its scene has not.
    #[error("fault {index}: this sensor in this scene has no such effect")]
    FaultDoesNotApply {
        /// Index in the list of faults.
        index: usize,
    },
    /// Weather, a print or a perturbation without the sensors that would see it.
    #[error("the scene has {what}, which only rendered sensors know")]
    NeedsRendering {
        /// Name of the field.
        what: &'static str,
    },
    /// Elements of the platform's orbit.
    #[error("the platform's orbital elements are those of no orbit")]
    Orbit,
}

pub(crate) fn check_range(field: &'static str, got: f32, low: f32, high: f32) -> Result<(), SceneError> {
    if (low..=high).contains(&got) { Ok(()) } else { Err(SceneError::OutOfRange { field, got, low, high }) }
}

pub(crate) fn count(field: &'static str, got: usize, low: usize, high: usize) -> Result<(), SceneError> {
    if (low..=high).contains(&got) { Ok(()) } else { Err(SceneError::Count { field, got, low, high }) }
}
