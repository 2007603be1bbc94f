//! The shared-memory part: channels that the process writes and channels that it reads.

use std::collections::BTreeMap;

use wire::core::Topic;

use crate::bus::{Domain, Protection, Publisher, Subscription};
use crate::drive::{DriveError, Opened, Senders};
use crate::spec::{ChannelSpec, ServiceSpec};

/// The channels of every domain that the process takes part in.
pub(super) struct Memory {
    publishers: Vec<Publisher>,
    /// Messages that were published and messages that failed, by topic.
    published: BTreeMap<Topic, [u64; 2]>,
    subscriptions: Vec<(Topic, Subscription)>,
}

impl Memory {
    pub(super) fn open(spec: &ServiceSpec, senders: &Senders) -> Result<Self, DriveError> {
        let mut this = Self { publishers: Vec::new(), published: BTreeMap::new(), subscriptions: Vec::new() };
        let granted = spec.enclaves.as_ref().map(|enclaves| enclaves.granted(spec.node)).transpose().opened("bus")?;
        let protection = |channel: &ChannelSpec| Protection {
            cipher: channel.cipher.clone(),
            time: granted.as_ref().map(|granted| granted.time),
        };
        for bus in &spec.bus {
            let domain = Domain::new(&bus.root, &bus.prefix).opened("bus")?.with_publishers(bus.publishers);
            for channel in &bus.publish {
                if let Some(granted) = &granted {
                    granted.may_publish(&channel.scope, channel.topic).opened("bus publisher")?;
                }
                let domain = domain.protected(protection(channel));
                this.publishers.push(domain.publisher(&channel.scope, channel.topic).opened("bus publisher")?);
                this.published.insert(channel.topic, [0, 0]);
            }
            for channel in &bus.subscribe {
                if let Some(granted) = &granted {
                    granted.may_subscribe(&channel.scope, channel.topic).opened("bus subscription")?;
                }
                let domain = domain.protected(protection(channel));
                let subscription = domain.subscribe(&channel.scope, channel.topic, senders.inputs.clone());
                this.subscriptions.push((channel.topic, subscription.opened("bus subscription")?));
            }
        }
        Ok(this)
    }

    /// Writes a message to every channel of its topic.
    pub(super) fn publish(&mut self, topic: Topic, bytes: &[u8]) {
        let counts = self.published.entry(topic).or_default();
        for publisher in self.publishers.iter().filter(|p| p.topic() == topic) {
            match publisher.publish(bytes) {
                Ok(()) => counts[0] += 1,
                Err(error) => {
                    tracing::debug!(%error, "bus message not sent");
                    counts[1] += 1;
                }
            }
        }
    }

    pub(super) fn published(&self) -> BTreeMap<&str, &[u64; 2]> {
        self.published.iter().map(|(topic, counts)| (topic.name(), counts)).collect()
    }

    pub(super) fn received(&self) -> Vec<(&str, u64)> {
        self.subscriptions.iter().map(|(topic, subscription)| (topic.name(), subscription.received())).collect()
    }
}
