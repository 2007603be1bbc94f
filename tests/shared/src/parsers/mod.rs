//! Promises of every parser of bytes from outside, for any bytes: one function a parser. Parsers of the measurements are in `measurements/`.
//!
//! Each takes any bytes, panics where a promise is broken, and returns whether the parser accepted them. `cargo test` calls them with the
//! seeds of `fuzz/corpus/` and with damaged ones (`tests/properties/parsers.rs`), libFuzzer with its own inputs (`fuzz/`); see
//! `docs/developer/fuzzing.md`.

pub mod boundary;
pub mod files;
pub mod links;
pub mod messages;
pub mod processes;

/// A parser with its promise.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Name of its binary and of the folder of its seeds.
    pub name: &'static str,
    /// Panics when the parser breaks its promise on these bytes; says whether it took them.
    pub holds: fn(&[u8]) -> bool,
}

/// Every target, in the order of `docs/developer/fuzzing.md`.
pub const TARGETS: [Target; 22] = [
    Target { name: "message", holds: messages::message },
    Target { name: "signature", holds: messages::signature },
    Target { name: "session", holds: boundary::session },
    Target { name: "bus", holds: boundary::bus },
    Target { name: "datagram", holds: links::datagram },
    Target { name: "cookie", holds: links::cookie },
    Target { name: "certificate", holds: links::certificate },
    Target { name: "topic", holds: links::topic },
    Target { name: "relay", holds: links::relay },
    Target { name: "spec", holds: processes::spec },
    Target { name: "lines", holds: processes::lines },
    Target { name: "frame", holds: processes::frame },
    Target { name: "journal", holds: processes::journal },
    Target { name: "deliveries", holds: processes::deliveries },
    Target { name: "recording", holds: processes::recording },
    Target { name: "scenario", holds: files::scenario },
    Target { name: "scene", holds: files::scene },
    Target { name: "settings", holds: files::settings },
    Target { name: "shelf", holds: files::shelf },
    Target { name: "board", holds: files::board },
    Target { name: "model", holds: files::model },
    Target { name: "foreign", holds: files::foreign },
];
