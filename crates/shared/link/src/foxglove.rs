//! Live messages for Foxglove's app on this host over its WebSocket protocol, on loopback.
//!
//! The SDK provides protocol and server. The server takes no input from clients (no capability is offered), bounds the queue of each, and has
//! no secret: every user of the host, and every page in a browser on it, can connect. That is why it is an opt-in feature. The content of
//! messages is the caller's.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

use foxglove::{ChannelBuilder, Context, RawChannel, Schema, WebSocketServer, WebSocketServerHandle};

use crate::loopback::LoopbackAddr;

/// Messages that wait for a client; beyond, it loses the oldest.
const BACKLOG: usize = 256;

/// Type of the messages of one topic.
#[derive(Clone, Copy, Debug)]
pub struct Kind<'a> {
    /// Its topic.
    pub topic: &'a str,
    /// Encoding: `protobuf` or `json`.
    pub encoding: &'a str,
    /// Its schema: name and encoding.
    pub schema: [&'a str; 2],
    /// The schema itself.
    pub definition: &'a [u8],
}

/// A server, until this is dropped.
pub struct Offered {
    address: LoopbackAddr,
    context: Arc<Context>,
    channels: BTreeMap<String, Arc<RawChannel>>,
    server: Option<WebSocketServerHandle>,
}

impl Offered {
    /// Offers future messages on a port of loopback; 0 lets the kernel choose.
    ///
    /// # Errors
    ///
    /// When the port is taken.
    pub fn open(port: u16) -> io::Result<Self> {
        let requested = LoopbackAddr::on_port(port);
        let context = Context::new();
        let server = WebSocketServer::new()
            .name("holdsafe")
            .context(&context)
            .message_backlog_size(BACKLOG)
            .bind(requested.socket().ip().to_string(), requested.port())
            .start_blocking()
            .map_err(io::Error::other)?;
        let address = LoopbackAddr::on_port(server.port());
        Ok(Self { address, context, channels: BTreeMap::new(), server: Some(server) })
    }

    /// Address for the app.
    pub fn address(&self) -> String {
        format!("ws://{}", self.address)
    }

    /// Sends a message to the connected clients.
    ///
    /// # Errors
    ///
    /// When there can be no channel of this kind.
    pub fn send(&mut self, kind: Kind<'_>, message: &[u8]) -> io::Result<()> {
        if !self.channels.contains_key(kind.topic) {
            let [name, encoding] = kind.schema;
            let channel = ChannelBuilder::new(kind.topic)
                .message_encoding(kind.encoding)
                .schema(Schema::new(name, encoding, kind.definition.to_vec()))
                .context(&self.context)
                .build_raw()
                .map_err(io::Error::other)?;
            self.channels.insert(kind.topic.to_owned(), channel);
        }
        if let Some(channel) = self.channels.get(kind.topic) {
            channel.log(message);
        }
        Ok(())
    }
}

impl Drop for Offered {
    fn drop(&mut self) {
        if let Some(server) = self.server.take() {
            server.stop().wait_blocking();
        }
    }
}
