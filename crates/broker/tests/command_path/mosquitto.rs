//! Debian's mosquitto at the broker's place: the run's certificates, and an access list written from [`broker::acl`]'s
//! table. If it is not installed these tests report it and make no check.
//!
//! It keeps `suite` and no more. The embedded broker's further refusals are missing in mosquitto 2.0: it lets a filter
//! be subscribed that its holder may not read (and delivers no message of it), uses the certificate under any client
//! id, takes wills and MQTT 3.1.1, and a revocation ends no session that stands.

use std::fs;
use std::path::Path;
use std::process::Stdio;

use broker::acl::{Verb, grant};
use link::loopback::LoopbackAddr;
use tempfile::TempDir;
use tokio::io::{AsyncBufReadExt, BufReader, Lines};
use tokio::process::{Child, ChildStderr, Command};
use wire::id::{NodeId, PeerId};

use crate::client::RunPki;
use crate::suite::{Broker, command_path};

/// Attempts to start: between the search for a free port and its use another process may take the port.
const TRIES: usize = 5;
/// Paths at which it may be; Debian has it where only root's path leads.
const PROGRAMS: [&str; 2] = ["mosquitto", "/usr/sbin/mosquitto"];

struct Mosquitto {
    process: Child,
    log: Lines<BufReader<ChildStderr>>,
    at: LoopbackAddr,
    /// Folder of the configuration and keys, removed with the value.
    folder: TempDir,
}

command_path!(Mosquitto);

impl Broker for Mosquitto {
    const REFUSES_SUBSCRIPTIONS: bool = false;

    async fn start(pki: &RunPki) -> Option<Self> {
        let folder = tempfile::tempdir().expect("a directory of our own");
        let credential = pki.broker();
        write_pem(&folder.path().join("root.pem"), "CERTIFICATE", &credential.root_der);
        write_pem(&folder.path().join("cert.pem"), "CERTIFICATE", &credential.cert_der);
        write_pem(&folder.path().join("key.pem"), "PRIVATE KEY", &credential.key_pkcs8_der);
        write_pem(&folder.path().join("list.pem"), "X509 CRL", &credential.list_der);
        fs::write(folder.path().join("acl"), access_list()).expect("written");
        for _ in 0..TRIES {
            let at = free_port();
            fs::write(folder.path().join("conf"), configuration(folder.path(), at)).expect("written");
            let Some(mut process) = spawn(&folder.path().join("conf")) else {
                eprintln!("skipped: there is no `mosquitto` here, so only our own broker was tried");
                return None;
            };
            let mut log = BufReader::new(process.stderr.take().expect("piped")).lines();
            match log_until(&mut log, &[" running", "Address already in use"]).await {
                Some(line) if line.ends_with("running") => return Some(Self { process, log, at, folder }),
                Some(_clash) => drop(process.wait().await),
                None => panic!(
                    "mosquitto ended by itself; try `mosquitto -c` with this:\n{}",
                    configuration(folder.path(), at)
                ),
            }
        }
        panic!("no port stayed free in {TRIES} tries");
    }

    fn address(&self) -> LoopbackAddr {
        self.at
    }

    async fn revoke(&mut self, list_der: Vec<u8>) {
        write_pem(&self.folder.path().join("list.pem"), "X509 CRL", &list_der);
        let pid = self.process.id().expect("it runs").to_string();
        let status = Command::new("kill").args(["-HUP", &pid]).status().await.expect("a kill command");
        assert!(status.success());
        log_until(&mut self.log, &["Reloading config"]).await.expect("it says that it reads its files again");
    }

    /// Mosquitto logs OpenSSL's words, which change from release to release.
    async fn named(&mut self, _refusal: &str) {}

    async fn beyond_rights(&mut self, _peer: PeerId) {}

    async fn ended(&mut self, peer: PeerId) {
        let taken_over = format!("Client {peer} already connected, closing old connection");
        log_until(&mut self.log, &[&taken_over]).await.expect("it says whose session it ends");
    }
}

/// Reads on to a line that has one of these in it; `None` when there is no more.
async fn log_until(log: &mut Lines<BufReader<ChildStderr>>, marks: &[&str]) -> Option<String> {
    while let Some(line) = log.next_line().await.expect("it writes text") {
        if marks.iter().any(|mark| line.contains(mark)) {
            return Some(line);
        }
    }
    None
}

fn spawn(configuration: &Path) -> Option<Child> {
    let start = |program: &&str| {
        let mut command = Command::new(program);
        command.arg("-c").arg(configuration).kill_on_drop(true);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().ok()
    };
    PROGRAMS.iter().find_map(start)
}

/// A port that the kernel picked and no process holds any more: mosquitto takes a number, not a socket.
fn free_port() -> LoopbackAddr {
    let listener = std::net::TcpListener::bind(LoopbackAddr::ANY_PORT.socket()).expect("a loopback port is to be had");
    LoopbackAddr::try_from(listener.local_addr().expect("bound")).expect("loopback")
}

fn configuration(folder: &Path, address: LoopbackAddr) -> String {
    let folder = folder.display();
    // `user` counts only where it is started by root, whose files are in the folder.
    format!(
        "listener {} 127.0.0.1\nuser root\nlog_dest stderr\nlog_type all\nconnection_messages true\n\
         persistence false\nsys_interval 0\nretain_available false\nallow_anonymous false\n\
         cafile {folder}/root.pem\ncertfile {folder}/cert.pem\nkeyfile {folder}/key.pem\ncrlfile {folder}/list.pem\n\
         tls_version tlsv1.3\nrequire_certificate true\nuse_identity_as_username true\n\
         use_username_as_clientid true\nallow_zero_length_clientid false\nacl_file {folder}/acl\n",
        address.port()
    )
}

/// The rights of every identity, in mosquitto's form. Who is not named has none.
fn access_list() -> String {
    let mut list = String::new();
    let peer = |node: NodeId| PeerId::from_name(node.name()).expect("one set of names for both");
    for peer in NodeId::all().map(peer) {
        let words = Verb::ALL.map(|verb| (grant(peer, verb), if verb == Verb::Publish { "write" } else { "read" }));
        let lines = words.into_iter().filter_map(|(pattern, word)| Some(format!("topic {word} {}\n", pattern?)));
        let lines: String = lines.collect();
        if !lines.is_empty() {
            list += &format!("user {peer}\n{lines}\n");
        }
    }
    list
}

/// Writes DER as PEM, for this user's eyes only: the folder is closed to others.
fn write_pem(file: &Path, label: &str, der: &[u8]) {
    let text = base64(der);
    let lines: Vec<&str> = text.as_bytes().chunks(64).map(|line| std::str::from_utf8(line).expect("ASCII")).collect();
    fs::write(file, format!("-----BEGIN {label}-----\n{}\n-----END {label}-----\n", lines.join("\n")))
        .expect("written");
}

fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let number = group.iter().fold(0u32, |sum, byte| sum << 8 | u32::from(*byte)) << (8 * (3 - group.len()));
        for place in 0..4 {
            let digit = ALPHABET[(number >> (18 - 6 * place)) as usize & 63] as char;
            text.push(if place <= group.len() { digit } else { '=' });
        }
    }
    text
}
