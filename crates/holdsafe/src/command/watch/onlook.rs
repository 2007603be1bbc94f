//! Spectators of a run outside a terminal: a browser, by a page that polls for each picture, and Foxglove's app or a
//! ground system, to which each is sent.

use std::sync::{Arc, Mutex, PoisonError};

use console::page;
use console::site::Site;
use link::clock::trace_us;
use link::web::{self, Content, Served};
use runner::failure::{Exit, Failure};
use serde_json::json;

fn port_in_use(port: u16, reason: &dyn std::fmt::Display) -> Failure {
    Failure::new(Exit::Environment, format!("port {port} of loopback: {reason}; name another one, or none"))
}

/// A picture ready to be requested.
#[derive(Default)]
struct Laid {
    picture: Option<String>,
    /// Time at which it was not there yet; `None` where it was there from the beginning, since its age is then unknown.
    since: Option<u64>,
}

impl Laid {
    /// The answer in the form that the page expects: see [`console::page::FILES`].
    fn answer(&self, now: u64) -> String {
        let picture = self.picture.as_deref().unwrap_or("null");
        let held = self.since.map(|since| now.saturating_sub(since).div_ceil(1000));
        format!(r#"{{"held_ms":{},"picture":{picture}}}"#, json!(held))
    }
}

/// Server of the page, until it is dropped.
pub(super) struct Page {
    laid: Arc<Mutex<Laid>>,
    served: Served,
}

impl Page {
    /// Serves it on this port of loopback, with the site that the run was planned on.
    pub(super) fn open(port: u16, site: Site) -> Result<Self, Failure> {
        // The page draws no contours.
        let site = serde_json::to_string(&Site { relief: None, ..site.sound() }).map_err(Failure::internal)?;
        let laid = Arc::new(Mutex::new(Laid::default()));
        let ready = Arc::clone(&laid);
        let picture = move || ready.lock().unwrap_or_else(PoisonError::into_inner).answer(trace_us());
        let fixed = |(path, media, text)| web::Page { path, media, content: Content::Fixed(text) };
        let made = |path, content| web::Page { path, media: "application/json", content: Content::Made(content) };
        let mut pages: Vec<web::Page> = page::FILES.map(fixed).into();
        pages.push(made("site", Box::new(move || site.clone())));
        pages.push(made("picture", Box::new(picture)));
        Ok(Self { laid, served: Served::open(port, pages).map_err(|error| port_in_use(port, &error))? })
    }

    /// Address for a browser.
    pub(super) fn address(&self) -> String {
        self.served.address()
    }

    /// Puts a picture there that was not there yet at `since`.
    pub(super) fn lay(&self, picture: String, since: Option<u64>) {
        let mut laid = self.laid.lock().unwrap_or_else(PoisonError::into_inner);
        *laid = Laid { picture: Some(picture), since };
    }
}

/// A ground system that reads space packets, if there is one.
pub(super) struct Ground {
    offered: link::packets::Offered,
    packets: export::packets::Packets,
}

impl Ground {
    /// Offers them on this port of loopback.
    pub(super) fn open(port: u16) -> Result<Self, Failure> {
        let offered = link::packets::Offered::open(port).map_err(|error| port_in_use(port, &error))?;
        Ok(Self { offered, packets: export::packets::Packets::default() })
    }

    /// Address for the ground system.
    pub(super) fn address(&self) -> String {
        format!("tcp://{}", self.offered.address())
    }

    /// Sends a picture.
    pub(super) fn show(&mut self, picture: &str) -> Result<(), Failure> {
        let untold = |reason: &dyn std::fmt::Display| {
            Failure::new(Exit::NoEvidence, format!("a picture cannot be told: {reason}"))
        };
        let packets = self.packets.look(link::clock::wall_us(), picture).map_err(|error| untold(&error))?;
        self.offered.send(&packets).map(|_| ()).map_err(|error| untold(&error))
    }
}

/// Foxglove's app, if there is one that looks.
#[cfg(feature = "foxglove")]
pub(super) struct Viewer {
    offered: link::foxglove::Offered,
    onlooker: export::display::Onlooker,
}

#[cfg(feature = "foxglove")]
impl Viewer {
    /// Offers it on this port of loopback.
    pub(super) fn open(port: u16) -> Result<Self, Failure> {
        let offered = link::foxglove::Offered::open(port).map_err(|error| port_in_use(port, &error))?;
        Ok(Self { offered, onlooker: export::display::Onlooker::default() })
    }

    /// Address for the app.
    pub(super) fn address(&self) -> String {
        self.offered.address()
    }

    /// Sends a picture.
    pub(super) fn show(&mut self, picture: &str) -> Result<(), Failure> {
        let messages = self.onlooker.look(link::clock::wall_us(), picture).map_err(|error| untold(&error))?;
        messages.iter().try_for_each(|message| self.say(message))
    }

    /// Reports that there has been none for a given number of seconds.
    pub(super) fn silent(&mut self, seconds: u64) -> Result<(), Failure> {
        let message = export::display::silent(link::clock::wall_us(), seconds).map_err(|error| untold(&error))?;
        self.say(&message)
    }

    fn say(&mut self, message: &export::Message) -> Result<(), Failure> {
        let export::Message { topic, encoding, schema: [name, language], definition, bytes } = message;
        let kind = link::foxglove::Kind { topic, encoding, schema: [name, language], definition };
        self.offered.send(kind, bytes).map_err(|error| untold(&error))
    }
}

#[cfg(feature = "foxglove")]
fn untold(reason: &dyn std::fmt::Display) -> Failure {
    Failure::new(Exit::NoEvidence, format!("a picture cannot be told: {reason}"))
}

/// No viewer: this build has no server for it.
#[cfg(not(feature = "foxglove"))]
pub(super) enum Viewer {}

#[cfg(not(feature = "foxglove"))]
impl Viewer {
    /// Fails with the requirement: a build with the feature.
    pub(super) fn open(_port: u16) -> Result<Self, Failure> {
        let why =
            "this build has no server for Foxglove: `cargo run --release --features foxglove -- watch RUN --foxglove`";
        Err(Failure::new(Exit::Environment, why))
    }

    /// Never called: no viewer can be opened.
    pub(super) fn address(&self) -> String {
        match *self {}
    }

    /// Never called: no viewer can be opened.
    pub(super) fn show(&mut self, _picture: &str) -> Result<(), Failure> {
        match *self {}
    }

    /// Never called: no viewer can be opened.
    pub(super) fn silent(&mut self, _seconds: u64) -> Result<(), Failure> {
        match *self {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The age of a picture that was there from the beginning is unknown.
    #[test]
    fn age_of_a_picture_is_reported_if_known() {
        assert_eq!(Laid::default().answer(7), r#"{"held_ms":null,"picture":null}"#);
        let laid = |since| Laid { picture: Some("{}".to_owned()), since };
        assert_eq!(laid(None).answer(9_000_000), r#"{"held_ms":null,"picture":{}}"#);
        assert_eq!(laid(Some(1_000_000)).answer(1_250_001), r#"{"held_ms":251,"picture":{}}"#);
    }
}
