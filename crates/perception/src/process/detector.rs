//! The process of a detector of others: loads one model, tries it, then answers each image with detections.
//!
//! The runtime's backend ends its process where it fails on a graph or on an image that it did not expect, and no
//! caller can catch that. So a model of others runs here alone, within the limits of CPU time and memory that the
//! starter has set, and with no right but to read its file: a failure ends this process and no other. Standard input is
//! a socket to the starter; the process ends with it.

use std::error::Error;
use std::io;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::process::ExitCode;

use link::framed;
use serde::{Deserialize, Serialize};
use wire::codec::{self, List};
use wire::sensor::Detection;

use crate::brought::Brought;
use crate::detector::Detector;
use crate::letterbox::{HEIGHT, WIDTH};
use crate::model::ModelRef;

/// Name of this process among the services.
pub const DETECTOR: &str = "detector";
/// Longest [`LoadRequest`], bytes.
const MAX_ASKED: usize = 64 * 1024;
/// Longest answer, bytes.
pub const MAX_ANSWER: usize = 16 * 1024;
/// Bytes of an image.
const IMAGE: usize = 3 * WIDTH * HEIGHT;

/// The first message: the detector to load.
#[derive(Debug, Serialize, Deserialize)]
pub struct LoadRequest {
    /// File and decoding of the detector.
    pub brought: Brought,
    /// An ONNX Runtime library in place of the pure-Rust backend.
    pub runtime: Option<ModelRef>,
}

/// An image to look at, as a message: the least permille, 2 bytes, little endian, and the image.
pub fn request(image: &[u8], least: u16) -> Vec<u8> {
    [&least.to_le_bytes(), image].concat()
}

/// An answer as a message: a byte, and detections behind 0, a reason behind 1. That to [`LoadRequest`] has no
/// detections.
pub fn answer(found: Result<&List<Detection, 32>, &str>) -> Vec<u8> {
    match found {
        Ok(found) => [&[0], codec::encode(found).as_slice()].concat(),
        Err(why) => [&[1], why.as_bytes()].concat(),
    }
}

/// The content of an answer.
///
/// # Errors
/// The reason in it, or that it is none.
pub fn answered(message: &[u8]) -> Result<List<Detection, 32>, String> {
    match message.split_first() {
        Some((0, found)) => codec::decode(found, MAX_ANSWER).map_err(|error| format!("its process answered {error}")),
        Some((1, why)) => Err(String::from_utf8_lossy(why).into_owned()),
        Some(_) | None => Err("its process gave no answer".to_owned()),
    }
}

/// Loads the detector that the first message names, answers it, and then each image, until the socket is closed.
pub fn main() -> ExitCode {
    match serve() {
        Ok(()) => ExitCode::SUCCESS,
        Err(_gone) => ExitCode::from(2),
    }
}

fn serve() -> Result<(), Box<dyn Error>> {
    let mut socket = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
    let Some(requested) = framed::read(&mut socket, MAX_ASKED)? else { return Ok(()) };
    let detector = match serde_json::from_slice(&requested).map_err(Into::into).and_then(load) {
        Ok(detector) => detector,
        Err(why) => return Ok(framed::write(&mut socket, &answer(Err(&why.to_string())))?),
    };
    framed::write(&mut socket, &answer(Ok(&List::default())))?;
    while let Some(message) = framed::read(&mut socket, 2 + IMAGE)? {
        let (least, image) = message.split_first_chunk().ok_or("no image in a message")?;
        let found = detector.detect(image, u16::from_le_bytes(*least)).map_err(|error| error.to_string());
        framed::write(&mut socket, &answer(found.as_ref().map_err(String::as_str)))?;
    }
    Ok(())
}

fn load(LoadRequest { brought, runtime }: LoadRequest) -> Result<Detector, Box<dyn Error>> {
    let files = std::iter::once(&brought.model).chain(&runtime).map(|file| std::path::absolute(&file.path));
    link::confined::reader(DETECTOR, files.collect::<io::Result<_>>()?)?;
    if let Some(library) = &runtime {
        super::adopt(library)?;
    }
    Ok(super::load(&brought)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_come_back_as_they_were() {
        let none = List::default();
        assert_eq!(answered(&answer(Ok(&none))), Ok(none));
        assert_eq!(answered(&answer(Err("index out of range"))), Err("index out of range".to_owned()));
        assert!(answered(&[0, 0xff]).unwrap_err().starts_with("its process answered "));
        assert!(answered(&[]).is_err() && answered(&[7]).is_err());
    }
}
