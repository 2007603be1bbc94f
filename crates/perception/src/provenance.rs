//! Provenance of products: the last product of each stage.
//!
//! Liveness downstream rests on these products; a stage without a product keeps its old stamp and so grows old.

use wire::codec::List;
use wire::id::FrameId;
use wire::sensor::{Candidates, Modalities, Modality};
use wire::time::Instant;
use wire::track::StageProduct;

/// The newest product of each modality's stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Provenance {
    products: [Option<StageProduct>; 4],
    present: Option<Modalities>,
}

impl Provenance {
    /// Takes a frame's products into account. Gives the set of modalities present, if it differs from the last one's.
    pub fn note(&mut self, frame: FrameId, stamp: Instant, present: Modalities) -> Option<Modalities> {
        for modality in Modality::ALL.into_iter().filter(|m| present.contains(*m)) {
            self.products[modality as usize] = Some(StageProduct { frame, stamp });
        }
        let changed = self.present != Some(present);
        self.present = Some(present);
        changed.then_some(present)
    }

    /// Withdraws the products of `modality` since `product`: they were repetitions.
    pub fn withdraw(&mut self, modality: Modality, product: StageProduct) {
        self.products[modality as usize] = Some(product);
    }

    /// Indexed as [`Modality`].
    pub fn products(&self) -> [Option<StageProduct>; 4] {
        self.products
    }
}

/// The modalities with a product of their stage.
pub fn present(candidates: &Candidates) -> Modalities {
    let products = [
        (Modality::Rgb, candidates.rgb.is_some()),
        (Modality::Depth, candidates.depth.is_some()),
        (Modality::Thermal, candidates.thermal.is_some()),
        (Modality::Lidar, candidates.lidar.is_some()),
    ];
    products.into_iter().filter(|(_, is)| *is).fold(Modalities::default(), |set, (m, _)| set.with_modality(m))
}

/// The candidates as if the stage of `modality` had given no product. Depth samples refer to detections: without those
/// there are none.
pub fn without_modality(candidates: Candidates, modality: Modality) -> Candidates {
    match modality {
        Modality::Rgb => Candidates { rgb: None, depth: candidates.depth.map(|_| List::default()), ..candidates },
        Modality::Depth => Candidates { depth: None, ..candidates },
        Modality::Thermal => Candidates { thermal: None, ..candidates },
        Modality::Lidar => Candidates { lidar: None, ..candidates },
    }
}
