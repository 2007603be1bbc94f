//! The ends of a measured link, behind sockets: pymavlink in its own process (`tools/mavlink/end.py`), and the public `mavlink`
//! crate's reader behind a socket of this process.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver as Lines, sync_channel};
use std::time::Duration;

use link::lockstep::Lockstep;
use link::loopback::LoopbackAddr;
use mavlink_relay::end::{Delivery, EndFault, Receiver, Sender, Start};
use mavlink_relay::library::Library;
use serde_json::{Value, json};

/// Longest wait for a datagram at a socket, s. A datagram that is later did not provably arrive.
const ARRIVAL_S: u64 = 5;
/// Longest wait for a line of a script, which itself may wait for a datagram.
const ANSWER: Duration = Duration::from_secs(60);
/// Longest line of a script, bytes.
const LINE: u64 = 1 << 20;

/// Where the script is and who runs it.
#[derive(Clone, Debug)]
pub(super) struct Python {
    pub(super) program: PathBuf,
    pub(super) script: PathBuf,
}

impl Python {
    /// True if the interpreter finds pymavlink.
    pub(super) fn has_pymavlink(&self) -> bool {
        let mut probe = Command::new(&self.program);
        probe.args(["-c", "import pymavlink"]).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        probe.status().is_ok_and(|status| status.success())
    }
}

fn fault(error: impl std::fmt::Display) -> EndFault {
    EndFault(error.to_string())
}

/// A running script: a line in, a line out.
struct Script {
    process: Child,
    to: Option<ChildStdin>,
    lines: Lines<String>,
}

impl Script {
    fn begin(python: &Python) -> Result<Self, EndFault> {
        let mut command = Command::new(&python.program);
        command.arg(&python.script).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut process = command.spawn().map_err(|e| EndFault(format!("{}: {e}", python.program.display())))?;
        let from = process.stdout.take().ok_or_else(|| EndFault("the script has no output".to_owned()))?;
        let (tell, lines) = sync_channel(1);
        // It ends with the script's output, or when no other line is awaited.
        std::thread::spawn(move || {
            let mut from = BufReader::new(from);
            let mut line = String::new();
            while matches!(from.by_ref().take(LINE).read_line(&mut line), Ok(length) if length > 0) {
                if tell.send(std::mem::take(&mut line)).is_err() {
                    return;
                }
            }
        });
        Ok(Self { to: process.stdin.take(), process, lines })
    }

    fn ask(&mut self, question: &Value) -> Result<Value, EndFault> {
        let to = self.to.as_mut().ok_or_else(|| EndFault("the script has no input".to_owned()))?;
        writeln!(to, "{question}").map_err(fault)?;
        let line = self.lines.recv_timeout(ANSWER).map_err(|e| EndFault(format!("no answer to {question}: {e}")))?;
        serde_json::from_str(&line).map_err(fault)
    }
}

impl Drop for Script {
    fn drop(&mut self) {
        self.to = None;
        let _gone = self.process.kill();
        let _gone = self.process.wait();
    }
}

/// An end that is pymavlink. A script that does not answer is not asked again: the next start begins another.
pub(super) struct Pymavlink {
    python: Python,
    script: Option<Script>,
    relay: Lockstep,
    port: Option<LoopbackAddr>,
    sent: u32,
    pub(super) version: String,
}

impl Pymavlink {
    pub(super) fn new(python: &Python) -> Result<Self, EndFault> {
        let relay = Lockstep::open().map_err(fault)?;
        Ok(Self { python: python.clone(), script: None, relay, port: None, sent: 0, version: String::new() })
    }

    fn ask(&mut self, question: &Value) -> Result<Value, EndFault> {
        let mut script = match self.script.take() {
            Some(script) => script,
            None => Script::begin(&self.python)?,
        };
        let answer = script.ask(question)?;
        self.script = Some(script);
        Ok(answer)
    }

    /// Starts it as a sender to `to`, or as a receiver.
    fn begin(&mut self, start: &Start, to: Option<u16>) -> Result<(), EndFault> {
        let key = start.key.map(hex);
        let value = json!({
            "key": key, "behind_s": start.behind_s, "accept_unsigned": start.accept_unsigned, "to": to,
        });
        let answer = self.ask(&json!({ "start": value }))?;
        self.version = answer["version"].as_str().unwrap_or_default().to_owned();
        let port = answer["port"].as_u64().and_then(|port| u16::try_from(port).ok());
        self.port = port.map(LoopbackAddr::on_port);
        Ok(())
    }
}

impl Sender for Pymavlink {
    fn start(&mut self, start: &Start) -> Result<(), EndFault> {
        let relay = self.relay.local().port();
        self.begin(start, Some(relay))
    }

    fn send(&mut self) -> Result<Vec<u8>, EndFault> {
        self.sent += 1;
        let number = self.sent;
        self.ask(&json!({ "send": number }))?;
        let datagram = self.relay.receive(Duration::from_secs(ARRIVAL_S)).map_err(fault)?;
        datagram.ok_or_else(|| EndFault(format!("message {number} of the sender did not come")))
    }
}

impl Receiver for Pymavlink {
    fn start(&mut self, start: &Start) -> Result<(), EndFault> {
        self.begin(start, None)
    }

    fn deliver(&mut self, datagram: &[u8]) -> Result<Delivery, EndFault> {
        let port = self.port.ok_or_else(|| EndFault("the receiver named no port".to_owned()))?;
        self.relay.send(port, datagram).map_err(fault)?;
        let answer = self.ask(&json!({ "receive": ARRIVAL_S }))?;
        let accepted = answer["accepted"].as_array().into_iter().flatten().filter_map(unhex).collect();
        Ok(Delivery { datagram: unhex(&answer["datagram"]), accepted })
    }
}

/// The library's reader behind a socket of this process.
pub(super) struct Behind {
    relay: Lockstep,
    own: Lockstep,
    library: Library,
}

impl Behind {
    pub(super) fn new() -> Result<Self, EndFault> {
        let open = || Lockstep::open().map_err(fault);
        Ok(Self { relay: open()?, own: open()?, library: Library::default() })
    }
}

impl Receiver for Behind {
    fn start(&mut self, start: &Start) -> Result<(), EndFault> {
        self.own = Lockstep::open().map_err(fault)?;
        self.library.start(start)
    }

    fn deliver(&mut self, datagram: &[u8]) -> Result<Delivery, EndFault> {
        self.relay.send(self.own.local(), datagram).map_err(fault)?;
        match self.own.receive(Duration::from_secs(ARRIVAL_S)).map_err(fault)? {
            Some(datagram) => self.library.deliver(&datagram),
            None => Ok(Delivery::default()),
        }
    }
}

fn hex(bytes: [u8; 32]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn unhex(text: &Value) -> Option<Vec<u8>> {
    let digits: Option<Vec<u8>> = text.as_str()?.chars().map(|c| c.to_digit(16).map(|d| d as u8)).collect();
    Some(digits?.chunks(2).map(|pair| pair.iter().fold(0, |byte, digit| byte << 4 | digit)).collect())
}
