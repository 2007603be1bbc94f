//! The gateway insider: a gateway with its keys in other hands, seen from the console.
//!
//! It sits between the gateway and its shared memory: messages of the honest half come here first, and the console's
//! requests too. It holds the key of the feed, so that the console cannot tell its messages from the gateway's, and no
//! unit's and no operator's key. It can withhold, keep, repeat, choose, lie about ages, change and invent; and it can
//! keep the operator's requests from its honest half. The console alone decides how much of that it believes.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use wire::command::OrderKind;

use config::setup::Setup;
use ground_truth::{Action, Note};
use wire::bus::{HEADER_LEN, Sender, TAG_LEN};
use wire::codec;
use wire::command::{Intent, MAX_ORDER, Request};
use wire::core::{Core, Input, Output, Side, Topic};
use wire::feed::{AcceptedReport, Feed};
use wire::id::{CommandId, NodeId, UnitId};
use wire::report::{MAX_REPORT, Report};
use wire::sign::{Key, Purpose, Signed};
use wire::time::{Instant, Span};

use super::voice::under_signature;
use crate::opening::Opening;
use crate::outbox::Outbox;
use crate::plan::{FeedAction, FeedForgery, InsiderGatewayConfig, PlanError, Timed};

/// Most messages of the feed held back at once; further ones are withheld.
const MAX_HELD: usize = 256;
/// The age that a report is said to have.
const YOUNG: Span = Span::ms(5);

/// A gateway insider.
#[derive(Clone, Debug)]
pub struct InsiderGateway {
    actions: Vec<Timed<FeedAction>>,
    /// Beginning and end of each action.
    openings: Vec<Opening>,
    feed: Option<Sender>,
    key: Key,
    held: VecDeque<Held>,
    seen: Option<Vec<u8>>,
    outbox: Outbox,
}

/// A report that waits for its time.
#[derive(Clone, Debug)]
struct Held {
    since: Instant,
    due: Instant,
    young: bool,
    body: Vec<u8>,
}

impl InsiderGateway {
    /// An insider that starts at `now`. Without the feed's key in its setup it cannot send.
    ///
    /// # Errors
    /// A magnitude of the plan outside its bounds.
    pub fn new(setup: Setup, config: InsiderGatewayConfig, now: Instant) -> Result<Self, PlanError> {
        config.check()?;
        let key = setup.channels.iter().find(|c| c.topic == Topic::Feed).map(|c| c.key.clone());
        Ok(Self {
            openings: config.actions.iter().map(|timed| Opening::from_timed(timed, now, None)).collect(),
            actions: config.actions,
            feed: key.map(|key| Sender::new(Topic::Feed, NodeId::GATEWAY, setup.boot, key)),
            key: setup.key(),
            held: VecDeque::new(),
            seen: None,
            outbox: Outbox::new(&setup, now),
        })
    }

    fn open(&self, now: Instant) -> Vec<FeedAction> {
        let open = self
            .actions
            .iter()
            .zip(&self.openings)
            .filter(|(_, opening)| opening.is_open(now) && !self.outbox.is_quiet());
        open.map(|(timed, _)| timed.action).collect()
    }

    /// A message of the honest half.
    fn fed(&mut self, now: Instant, bytes: &[u8]) {
        let Some(body) = body(bytes) else { return };
        let accepted = accepted_of(body).filter(|accepted| accepted.unit == UnitId::A);
        match accepted.and_then(|accepted| Some((accepted, report_of(accepted.report)?))) {
            Some((accepted, report)) => self.report(now, &accepted, &report),
            None => self.say(now, body),
        }
    }

    fn report(&mut self, now: Instant, accepted: &AcceptedReport<'_>, report: &Report) {
        let body = codec::encode(&Feed::Accepted(*accepted));
        for action in self.open(now) {
            match action {
                FeedAction::Withhold { keep } if keep != Some(report.mode) => {
                    return self.outbox.write(now, Note::Withheld { record: report.id() });
                }
                FeedAction::Delay { ms, young } => {
                    self.outbox.write(now, Note::Withheld { record: report.id() });
                    if self.held.len() < MAX_HELD {
                        self.held.push_back(Held { since: now, due: now + Span::ms(ms), young, body });
                    }
                    return;
                }
                FeedAction::Forge { forgery, mode } => {
                    let forged = self.forge(now, accepted, report, forgery, mode);
                    return self.attack(now, Action::Forge, Span::ZERO, &forged);
                }
                FeedAction::Replay => {
                    self.say(now, &body);
                    if let Some(before) = self.seen.clone() {
                        self.repeat(now, &before);
                    }
                    return;
                }
                FeedAction::Withhold { keep: _ } | FeedAction::Swallow { only: _ } => {}
            }
        }
        self.say(now, &body);
        self.seen.get_or_insert(body);
    }

    /// The report that was kept, said to be new.
    fn repeat(&mut self, now: Instant, body: &[u8]) {
        let Some(accepted) = accepted_of(body) else { return };
        let bytes = codec::encode(&Feed::Accepted(rejuvenated(accepted, now)));
        self.attack(now, Action::Republish, now.since(accepted.received), &bytes);
    }

    /// The message with a report that says something else.
    fn forge(
        &self,
        now: Instant,
        accepted: &AcceptedReport<'_>,
        report: &Report,
        forgery: FeedForgery,
        mode: wire::mode::Mode,
    ) -> Vec<u8> {
        let payload = codec::encode(&Report { mode, ..report.clone() });
        let say = |report: &[u8], unit: UnitId| {
            let accepted = AcceptedReport { report: report.into(), unit, ..rejuvenated(*accepted, now) };
            codec::encode(&Feed::Accepted(accepted))
        };
        match forgery {
            FeedForgery::Altered => {
                let signature = accepted.report.last_chunk::<64>().copied().unwrap_or([0; 64]);
                say(&under_signature(&payload, &signature), accepted.unit)
            }
            FeedForgery::ReSigned => say(&self.key.sign(Purpose::Report, &payload), accepted.unit),
            FeedForgery::Relabelled => say(accepted.report, UnitId::B),
        }
    }

    /// Request of the operator to the gateway.
    fn handle_request(&mut self, now: Instant, bytes: &[u8]) {
        let intent = body(bytes).and_then(intent_of);
        let swallowed = |action: &FeedAction| match (action, &intent) {
            (FeedAction::Swallow { only }, Some(intent)) => {
                only.is_none_or(|kind| kind == OrderKind::from(intent.kind))
            }
            _ => false,
        };
        match intent.filter(|_| self.open(now).iter().any(swallowed)) {
            Some(intent) => self.swallowed(now, intent.id),
            None => self.outbox.put(Output::Bus { topic: Topic::Intents, bytes: bytes.to_vec() }),
        }
    }

    fn swallowed(&mut self, now: Instant, command: CommandId) {
        self.outbox.write(now, Note::Swallowed { command });
    }

    fn release(&mut self, now: Instant) {
        while self.held.front().is_some_and(|held| held.due <= now || self.outbox.is_quiet()) {
            let Some(held) = self.held.pop_front() else { break };
            let body = match accepted_of(&held.body).filter(|_| held.young) {
                Some(accepted) => codec::encode(&Feed::Accepted(rejuvenated(accepted, now))),
                None => held.body,
            };
            self.attack(now, Action::Delay, now.since(held.since), &body);
        }
    }

    /// Sends a message that the honest half did not send, or not now; logged first, by the hash of the very bytes.
    fn attack(&mut self, now: Instant, action: Action, delay: Span, body: &[u8]) {
        let Some(bytes) = self.feed.as_mut().map(|feed| feed.seal(now, body)) else { return };
        self.outbox.attack(now, action, Side::Server, &bytes, delay);
        self.outbox.put(Output::Bus { topic: Topic::Feed, bytes });
    }

    fn say(&mut self, now: Instant, body: &[u8]) {
        if let Some(feed) = &mut self.feed {
            self.outbox.put(Output::Bus { topic: Topic::Feed, bytes: feed.seal(now, body) });
        }
    }
}

/// Bytes between header and tag of a shared-memory message.
fn body(bytes: &[u8]) -> Option<&[u8]> {
    bytes.get(HEADER_LEN..bytes.len().checked_sub(TAG_LEN)?)
}

fn accepted_of(body: &[u8]) -> Option<AcceptedReport<'_>> {
    match codec::decode(body, body.len()).ok()? {
        Feed::Accepted(accepted) => Some(accepted),
        Feed::Refused(..)
        | Feed::Session(..)
        | Feed::Command(..)
        | Feed::Acknowledged(_)
        | Feed::SessionsLost(_)
        | Feed::Crop(..) => None,
    }
}

fn report_of(signed: &[u8]) -> Option<Report> {
    codec::decode(Signed::parse(signed, MAX_REPORT).ok()?.payload, MAX_REPORT).ok()
}

fn intent_of(request: &[u8]) -> Option<Intent> {
    match codec::decode(request, request.len()).ok()? {
        Request::Stage(signed) => {
            let signed: &[u8] = signed;
            codec::decode(Signed::parse(signed, MAX_ORDER).ok()?.payload, MAX_ORDER).ok()
        }
        Request::Release(_) | Request::Watch(_) | Request::Revoke(_) => None,
    }
}

/// A message that claims to have been received just now and to have been young then.
fn rejuvenated(accepted: AcceptedReport<'_>, now: Instant) -> AcceptedReport<'_> {
    AcceptedReport { received: now, age: Some(YOUNG), ..accepted }
}

impl Core for InsiderGateway {
    fn handle(&mut self, now: Instant, input: &Input) {
        if !self.outbox.is_quiet() {
            self.outbox.notice(&mut self.openings, now, input, None);
        }
        if let Input::Bus { topic: Topic::Feed, bytes } = input {
            self.fed(now, bytes);
        }
        if let Input::Bus { topic: Topic::Intents, bytes } = input {
            self.handle_request(now, bytes);
        }
        if !self.outbox.heed(now, input) {
            self.release(now);
        }
    }

    fn deadline(&self) -> Option<Instant> {
        let begins = self.openings.iter().filter(|_| !self.outbox.is_quiet()).filter_map(Opening::due);
        begins.chain(self.held.front().map(|held| held.due)).min()
    }

    fn output(&mut self) -> Option<Output> {
        self.outbox.next()
    }
}
