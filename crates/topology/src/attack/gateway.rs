//! The plan of the gateway insider.

use adversary::plan::{FeedAction, FeedForgery, InsiderGatewayConfig};
use scenario::{Direction, Scenario, Windowed};

use super::{broker, mode, timed};

/// The plan, when the scenario has one.
pub(crate) fn plan(s: &Scenario, phase: u64) -> Option<InsiderGatewayConfig> {
    let mut actions = Vec::new();
    let mut add = |of: &dyn Windowed, action| actions.push(timed(of, Direction::Both, phase, action));
    s.feed_withhold.iter().for_each(|a| add(a, FeedAction::Withhold { keep: a.keep.map(mode) }));
    s.feed_delay.iter().for_each(|a| add(a, FeedAction::Delay { ms: a.by_ms.unsigned(), young: a.young }));
    for a in s.feed_forge.iter() {
        let forgery = match a.forgery {
            scenario::FeedForgery::Altered => FeedForgery::Altered,
            scenario::FeedForgery::ReSigned => FeedForgery::ReSigned,
            scenario::FeedForgery::Relabelled => FeedForgery::Relabelled,
        };
        add(a, FeedAction::Forge { forgery, mode: mode(a.state) });
    }
    s.feed_replay.iter().for_each(|a| add(a, FeedAction::Replay));
    s.intent_drop.iter().for_each(|a| add(a, FeedAction::Swallow { only: a.only.map(broker::kind) }));
    (!actions.is_empty()).then_some(InsiderGatewayConfig { actions })
}
