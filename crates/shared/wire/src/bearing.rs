//! Readings of attitude sensors, sim to perception, in place of frames and candidates on a platform that looks at stars
//! and not at objects.

use minicbor::{Decode, Encode};

use crate::id::FrameId;
use crate::motion::Attitude;
use crate::sensor::{Modalities, Modality, ProductMode};
use crate::time::Instant;

/// A direction in the body frame: a unit vector in 10⁻⁹. All zero: the sensor looked, and its object is hidden.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Encode, Decode)]
#[cbor(transparent)]
pub struct Direction(#[n(0)] pub [i32; 3]);

impl Direction {
    /// Direction of a vector of about unit length.
    pub fn new(unit: [f64; 3]) -> Self {
        Direction(unit.map(|part| (part * 1e9).round() as i32))
    }

    /// The vector; none where it is hidden.
    pub fn unit(self) -> Option<[f64; 3]> {
        (self != Direction::default()).then(|| self.0.map(|part| f64::from(part) / 1e9))
    }
}

/// A synchronous set of readings; a sensor without a product is absent. Each sensor takes the place of one modality in
/// tracks, guards and faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Bearings {
    /// Counts from 1 within a boot.
    #[n(0)]
    pub frame: FrameId,
    /// Time at which the readings were taken, on the vehicle host's clock.
    #[n(1)]
    pub stamp: Instant,
    /// Source of the product.
    #[n(2)]
    pub mode: ProductMode,
    /// Attitude by the star tracker, body to the inertial frame (TEME); in the place of [`Modality::Rgb`].
    #[n(3)]
    pub stars: Option<Attitude>,
    /// Direction of the sun; in the place of [`Modality::Depth`].
    #[n(4)]
    pub sun: Option<Direction>,
    /// Direction of the earth's centre by the warm horizon; in the place of [`Modality::Thermal`].
    #[n(5)]
    pub horizon: Option<Direction>,
    /// Direction of the magnetic field; in the place of [`Modality::Lidar`].
    #[n(6)]
    pub field: Option<Direction>,
}

impl Bearings {
    /// The sensors that gave a product, each by the modality whose place it takes.
    pub fn present(&self) -> Modalities {
        let readings = [self.stars.is_some(), self.sun.is_some(), self.horizon.is_some(), self.field.is_some()];
        let readings = Modality::ALL.into_iter().zip(readings).filter(|(_, is)| *is);
        readings.fold(Modalities::default(), |set, (modality, _)| set.with_modality(modality))
    }

    /// Bearings as if the sensor in the place of `modality` had given no product.
    #[must_use]
    pub fn without_modality(self, modality: Modality) -> Self {
        match modality {
            Modality::Rgb => Bearings { stars: None, ..self },
            Modality::Depth => Bearings { sun: None, ..self },
            Modality::Thermal => Bearings { horizon: None, ..self },
            Modality::Lidar => Bearings { field: None, ..self },
        }
    }
}
