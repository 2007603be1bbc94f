//! Models pinned by hash: bytes become a [`Model`] only if their SHA-256 is the one that was stated.
//!
//! The networks that ship and their manifests are compiled in; an edit to either is refused at start. Reading a model
//! from a file is the process's business.

use config::platform::Sensors;
use sha2::{Digest, Sha256};
use wire::sensor::Camera;

/// The largest model, bytes: eight million weights of four bytes; the smallest size of the common detectors has three,
/// the next eleven.
pub const MAX_MODEL: usize = 32 << 20;

/// Networks that this crate ships for views from one height, with the manifest that pins them.
#[derive(Debug, PartialEq, Eq)]
pub struct Networks {
    detector: &'static [u8],
    thermal: &'static [u8],
    fused: Option<&'static [u8]>,
    manifest: &'static str,
}

/// Networks for views from the ground platform's camera.
static GROUND: Networks = Networks {
    detector: include_bytes!("../models/detector.onnx"),
    thermal: include_bytes!("../models/thermal.onnx"),
    fused: Some(include_bytes!("../models/fused.onnx")),
    manifest: include_str!("../models/manifest.toml"),
};

/// Networks for views from the air platform's camera.
static ALOFT: Networks = Networks {
    detector: include_bytes!("../models/aloft/detector.onnx"),
    thermal: include_bytes!("../models/aloft/thermal.onnx"),
    fused: None,
    manifest: include_str!("../models/aloft/manifest.toml"),
};

/// A file outside this crate, by path and hash.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelRef {
    /// Path of the file.
    pub path: std::path::PathBuf,
    /// SHA-256 of the file, 64 hexadecimal digits.
    pub sha256: String,
}

/// Reason for which bytes are not the expected model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ModelError {
    /// Longer than any model may be.
    #[error("model of {got} bytes, at most {max} allowed")]
    TooLarge {
        /// Limit in bytes.
        max: usize,
        /// Length in bytes.
        got: usize,
    },
    /// Not the pinned bytes.
    #[error("model changed: its SHA-256 is {got}, pinned is {pinned}; restore the file or pin the new hash")]
    Changed {
        /// Pinned hash.
        pinned: String,
        /// Hash of the bytes.
        got: String,
    },
    /// The manifest beside the built-in model states no hash.
    #[error("manifest of the built-in model states no sha256")]
    Unpinned,
}

/// Bytes with the pinned hash.
#[derive(Clone, Copy, Debug)]
pub struct Model<'a> {
    bytes: &'a [u8],
}

impl<'a> Model<'a> {
    /// Checks size and hash.
    ///
    /// # Errors
    /// Too large, or not the pinned bytes.
    pub fn pinned(bytes: &'a [u8], sha256: &str) -> Result<Self, ModelError> {
        // Before the hash, which takes time in proportion to the length.
        if bytes.len() > MAX_MODEL {
            return Err(ModelError::TooLarge { max: MAX_MODEL, got: bytes.len() });
        }
        let got = hex_digest(bytes);
        if !got.eq_ignore_ascii_case(sha256) {
            return Err(ModelError::Changed { pinned: sha256.to_owned(), got });
        }
        Ok(Model { bytes })
    }

    /// Bytes of the model.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }
}

impl Networks {
    /// Networks that were trained for views from about this camera's height.
    pub fn for_camera(camera: &Camera) -> &'static Networks {
        if Sensors::trained_like(camera) == &Sensors::ALOFT { &ALOFT } else { &GROUND }
    }

    /// The detector.
    ///
    /// # Errors
    /// The model was edited without its manifest, or the manifest names no hash.
    pub fn detector(&self) -> Result<Model<'static>, ModelError> {
        Model::pinned(self.detector, self.stated("sha256").ok_or(ModelError::Unpinned)?)
    }

    /// The network of the thermal stage.
    ///
    /// # Errors
    /// The same.
    pub fn thermal(&self) -> Result<Model<'static>, ModelError> {
        Model::pinned(self.thermal, self.stated("thermal_sha256").ok_or(ModelError::Unpinned)?)
    }

    /// The fused network, if there is one.
    ///
    /// # Errors
    /// The same.
    pub fn fused(&self) -> Result<Option<Model<'static>>, ModelError> {
        let pinned = |bytes| Model::pinned(bytes, self.stated("fused_sha256").ok_or(ModelError::Unpinned)?);
        self.fused.map(pinned).transpose()
    }

    fn stated(&self, name: &str) -> Option<&'static str> {
        let value = |line: &'static str| line.strip_prefix(name)?.strip_prefix(" = \"")?.strip_suffix('"');
        self.manifest.lines().find_map(value)
    }
}

/// SHA-256 in lower-case hexadecimal.
pub fn hex_digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edited_copy_of_the_shipped_model_is_refused() {
        let pinned = GROUND.stated("sha256").unwrap();
        let mut edited = GROUND.detector().unwrap().bytes().to_vec();
        let middle = edited.len() / 2;
        edited[middle] ^= 1;
        assert!(matches!(Model::pinned(&edited, pinned), Err(ModelError::Changed { .. })));
    }

    #[test]
    fn oversized_model_is_refused_before_hashing() {
        let bytes = vec![0; MAX_MODEL + 1];
        assert_eq!(Model::pinned(&bytes, "").unwrap_err(), ModelError::TooLarge { max: MAX_MODEL, got: MAX_MODEL + 1 });
    }
}
