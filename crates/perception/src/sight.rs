//! Detection of objects in an image, in this process or in another one, and the faults of a detector of others.
//!
//! A core asks a [`Sight`] and knows no process. A network of others runs in a separate process (the crate `live`),
//! since a model can end the process that it runs in; its faults are noted here, so that a verdict can name them.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use wire::codec::List;
use wire::sensor::Detection;

use crate::detector::{Detector, DetectorError};

/// Finds objects in an image.
pub trait Sight: fmt::Debug + Send + Sync {
    /// Detections of at least `least` permille in a row-major image with a byte a plane of each pixel, best first.
    ///
    /// # Errors
    /// The image is of another size, or the detector failed on it.
    fn detect(&self, image: &[u8], least: u16) -> Result<List<Detection, 32>, DetectorError>;
}

impl Sight for Detector {
    fn detect(&self, image: &[u8], least: u16) -> Result<List<Detection, 32>, DetectorError> {
        Detector::detect(self, image, least)
    }
}

/// Faults of one detector in one run.
#[derive(Clone, Debug, Default)]
pub struct Faults(Arc<Mutex<Noted>>);

#[derive(Clone, Debug, Default)]
struct Noted {
    images: u64,
    failed: u64,
    /// Number of the first image that it failed on, from 1, and why.
    first: Option<(u64, String)>,
    /// True once the detector's process has ended: it is not asked again in this run.
    ended: bool,
}

impl Faults {
    /// The faults in words, if there are any.
    pub fn describe(&self) -> Option<String> {
        let Noted { images, failed, first, .. } = self.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let (number, reason) = first?;
        Some(format!("the detector failed on {failed} of {images} images, first on image {number}: {reason}"))
    }

    fn ended(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).ended
    }

    fn note(&self, error: Option<&DetectorError>) {
        let mut noted = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        noted.images += 1;
        if let Some(error) = error {
            noted.failed += 1;
            let number = noted.images;
            noted.ended |= matches!(error, DetectorError::Process(_));
            noted.first.get_or_insert_with(|| (number, error.to_string()));
        }
    }
}

/// A detector with its faults noted.
#[derive(Debug)]
pub(crate) struct Watched {
    pub(crate) sight: Arc<dyn Sight>,
    pub(crate) faults: Faults,
}

impl Sight for Watched {
    fn detect(&self, image: &[u8], least: u16) -> Result<List<Detection, 32>, DetectorError> {
        let found = match self.faults.ended() {
            true => Err(DetectorError::Process("its process ended before".to_owned())),
            false => self.sight.detect(image, least),
        };
        self.faults.note(found.as_ref().err());
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails on an image that begins with this byte.
    #[derive(Debug)]
    struct FailsOn(u8);

    impl Sight for FailsOn {
        fn detect(&self, image: &[u8], _: u16) -> Result<List<Detection, 32>, DetectorError> {
            if image.first() == Some(&self.0) {
                return Err(DetectorError::Session("index out of range".into()));
            }
            Ok(List::default())
        }
    }

    #[test]
    fn faults_are_counted_and_the_first_is_told() {
        let faults = Faults::default();
        let watched = Watched { sight: Arc::new(FailsOn(7)), faults: faults.clone() };
        assert_eq!(watched.detect(&[1], 500).map(|found| found.len()).ok(), Some(0));
        assert_eq!(faults.describe(), None);
        for byte in [7, 1, 7] {
            let _found = watched.detect(&[byte], 500);
        }
        let text = "the detector failed on 2 of 4 images, first on image 2: detector: index out of range";
        assert_eq!(faults.describe().as_deref(), Some(text));
    }
}
