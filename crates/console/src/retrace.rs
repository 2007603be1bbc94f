//! Replay of a recording in the same core, from its recorded inputs, without script, issuer or new challenges.
//!
//! Its recorded outputs are fed back ([`Console::apply_output`]): the challenges it made, so that ages are reproduced,
//! the commands it gave and the act that each answered. So a run can be viewed again without a secret, and no signing
//! is possible meanwhile.

use config::setup::Setup;
use sha2::{Digest, Sha256};
use wire::audit::Entry;
use wire::bus::{HEADER_LEN, TAG_LEN};
use wire::codec;
use wire::command::{Confirmation, Intent, MAX_ORDER, Request};
use wire::core::{Output, Topic};
use wire::event::Event;
use wire::sign::Signed;
use wire::time::Instant;
use wire::trust::Revocation;

use crate::intent::Issued;
use crate::life::Giver;
use crate::{Console, ConsoleConfig, ConsoleError};

impl Console {
    /// A console that follows a recording of one that was made so.
    pub fn retrace(setup: Setup, config: ConsoleConfig, now: Instant) -> Result<Self, ConsoleError> {
        let mut console = Self::new(setup, ConsoleConfig { script: Vec::new(), text: false, ..config }, now)?;
        (console.issuer, console.watch) = (None, None);
        Ok(console)
    }

    /// The console's recorded output at `now`, after its input of that time.
    pub fn apply_output(&mut self, now: Instant, output: &Output) {
        if let Output::Bus { topic: Topic::Intents, bytes } = output {
            self.apply_action(now, bytes);
        } else if let Output::Audit { bytes } = output {
            self.apply_display(bytes);
        }
    }

    /// Takes the console's recorded report on its display. The entry of an act names the command, which only the
    /// console could sign.
    fn apply_display(&mut self, bytes: &[u8]) {
        if let Ok(Event::Act { command: Some(id), .. }) = Entry::decode(bytes).map(|entry| entry.event) {
            self.model.hand().gave(id);
            self.model.commands_mut().by_person(id);
        }
    }

    fn apply_action(&mut self, now: Instant, bytes: &[u8]) {
        let tags = TAG_LEN * Topic::Intents.readers();
        let body = bytes.len().checked_sub(tags).and_then(|end| bytes.get(HEADER_LEN..end));
        let Some(Ok(request)) = body.map(|body| codec::decode(body, Topic::Intents.max_len())) else { return };
        match request {
            Request::Watch(challenge) => self.intake.challenge(challenge, now),
            Request::Stage(signed) => {
                if let Ok(intent) = codec::decode::<Intent>(payload(signed), MAX_ORDER) {
                    let (Intent { id, unit, kind, tag, .. }, hash) = (intent, Sha256::digest(&**signed).into());
                    let issued = Issued { id, unit, kind, tag, intent: hash, bytes: signed.to_vec() };
                    self.model.commands_mut().requested(now, &issued, Giver::Script);
                    if !kind.towards_safe() {
                        self.model.hand().link_intent(hash);
                    }
                }
            }
            Request::Release(signed) => {
                if let Ok(confirmation) = codec::decode::<Confirmation>(payload(signed), MAX_ORDER) {
                    self.model.commands_mut().released(now, &confirmation.intent);
                }
            }
            Request::Revoke(signed) => {
                if let Ok(revocation) = codec::decode::<Revocation>(payload(signed), MAX_ORDER) {
                    self.model.revoked(now, revocation.of, Giver::Script);
                }
            }
        }
    }
}

/// The signed payload of the recorded console. Only the drawing of the recording depends on it.
fn payload(signed: &[u8]) -> &[u8] {
    Signed::parse(signed, MAX_ORDER).map_or(&[], |signed| signed.payload)
}
