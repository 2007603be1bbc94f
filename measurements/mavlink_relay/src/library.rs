//! The receiving end of the public `mavlink` crate, 0.21.0: its reader and its signature check, fed as its UDP connection feeds them.
//!
//! It reads the host's clock for its own timestamp; there is no way to give it another, nor to give it a stored one.

use std::io::Read;

use mavlink::dialects::common::MavMessage;
use mavlink::{MAVLinkMessageRaw, MavlinkReader, SigningConfig, SigningData};

use crate::end::{Delivery, EndFault, Receiver, Start};

/// Most messages that one datagram can hold: a MAVLink 1 frame without payload has 8 bytes, a datagram 65,507.
const MOST: usize = 8_192;

/// Name and version of the receiver.
pub const NAME: &str = "mavlink (Rust) 0.21.0";

/// The datagram that was not read yet.
#[derive(Default)]
struct Pending(Vec<u8>);

impl Read for Pending {
    fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
        let n = to.len().min(self.0.len());
        to[..n].copy_from_slice(&self.0[..n]);
        self.0.drain(..n);
        Ok(n)
    }
}

/// The receiver.
pub struct Library {
    reader: MavlinkReader<Pending>,
    signing: Option<SigningData>,
}

impl Default for Library {
    fn default() -> Self {
        Self { reader: MavlinkReader::new(Pending::default()), signing: None }
    }
}

impl Receiver for Library {
    fn start(&mut self, start: &Start) -> Result<(), EndFault> {
        let signing = |key| SigningData::from_config(SigningConfig::new(key, 0, false, start.accept_unsigned));
        *self = Self { signing: start.key.map(signing), ..Self::default() };
        Ok(())
    }

    fn deliver(&mut self, datagram: &[u8]) -> Result<Delivery, EndFault> {
        self.reader.get_mut().0.extend_from_slice(datagram);
        let mut accepted = Vec::new();
        while let Ok(message) = self.reader.read_any_raw_message_signed::<MavMessage>(self.signing.as_ref()) {
            accepted.push(match message {
                MAVLinkMessageRaw::V1(raw) => raw.raw_bytes().to_vec(),
                MAVLinkMessageRaw::V2(raw) => raw.raw_bytes().to_vec(),
            });
            if accepted.len() > MOST {
                return Err(EndFault(format!("more than {MOST} messages out of {} bytes", datagram.len())));
            }
        }
        Ok(Delivery { datagram: Some(datagram.to_vec()), accepted })
    }
}
