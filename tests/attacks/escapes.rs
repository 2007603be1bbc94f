//! A hostile service tries to get at everything that is not its own, in a live run, with and without its confinement.

#![expect(clippy::unwrap_used, reason = "the machine of a test")]

use std::collections::BTreeMap;
use std::fs;
use std::net::{TcpListener, UdpSocket};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::os::unix::net::UnixListener;
use std::path::Path;

use holdsafe_tests::shipped;
use live::Options;
use live::child::Services;
use parallel::progress::Stop;
use scenario::{Confinement, Hosts};
use serde_json::json;
use topology::{RunSecret, lay_out};
use wire::person::Role;

/// The services, each of which is hostile in its own run.
const SERVICES: [&str; 8] = ["sim", "perception", "autonomy", "gateway", "broker", "console", "recorder", "adversary"];

/// Attempts that a machine without namespaces lets through.
const NEED_NAMESPACES: [&str; 3] = [
    "network: datagrams to another program",
    "network: a local socket in the file system",
    "memory: shared memory of another host",
];

/// Folder of service programs in which `hostile` is the attacker's, with objects of other programs beside it.
struct Machine {
    folder: tempfile::TempDir,
    shared: std::path::PathBuf,
    _tcp: TcpListener,
    _local: UnixListener,
    echo: Option<std::thread::JoinHandle<()>>,
    udp: UdpSocket,
}

impl Machine {
    fn new(hostile: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path_of = |name: &str| folder.path().join(name);
        for service in SERVICES.into_iter().chain(["host", "janitor"]) {
            let program = path_of(&format!("holdsafe-{service}"));
            if service == hostile {
                symlink(env!("CARGO_BIN_EXE_hostile"), program).unwrap();
                continue;
            }
            fs::write(&program, format!("#!/bin/sh\nexec {} {service}\n", env!("CARGO_BIN_EXE_service"))).unwrap();
            fs::set_permissions(&program, fs::Permissions::from_mode(0o700)).unwrap();
        }
        let (tcp, udp) = (TcpListener::bind("127.0.0.1:0").unwrap(), UdpSocket::bind("127.0.0.1:0").unwrap());
        let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let shared = Path::new("/dev/shm").join(format!("hs_{:x}other_{hostile}", std::process::id()));
        fs::write(&shared, "another host's").unwrap();
        fs::write(path_of("secret"), "a person's").unwrap();
        let targets = json!({
            "secret": path_of("secret"), "tcp": tcp.local_addr().unwrap(), "udp": udp.local_addr().unwrap(), "local": path_of("socket"),
            "shared": shared, "journal": if hostile == "recorder" { "stranger" } else { "recorder" }, "free_port": free,
        });
        fs::write(path_of("targets.json"), targets.to_string()).unwrap();
        let local = UnixListener::bind(path_of("socket")).unwrap();
        let echoes = udp.try_clone().unwrap();
        let echo = std::thread::spawn(move || {
            let mut bytes = [0; 16];
            while let Ok((n, from)) = echoes.recv_from(&mut bytes) {
                if n == 0 {
                    return;
                }
                echoes.send_to(&bytes[..n], from).unwrap();
            }
        });
        Self { folder, shared, _tcp: tcp, _local: local, echo: Some(echo), udp }
    }

    /// Results of all attempts, by name.
    fn attempts(&self, confinement: Confinement) -> BTreeMap<String, String> {
        let nominal = shipped("nominal");
        let secret = RunSecret::seeded(1);
        let topology = lay_out(&nominal.scenario, &nominal.setup, 1, &secret).seating(Role::Supervise);
        let keep = self.folder.path().join(format!("run-{confinement:?}"));
        // Another service's journal that exists whichever process starts first.
        fs::create_dir_all(keep.join("inputs")).unwrap();
        fs::write(keep.join("inputs/stranger.cbor"), "another's").unwrap();
        let options = Options {
            keep: Some(keep),
            services: Services::Folder(self.folder.path().to_owned()),
            stop: &Stop::default(),
            show: &mut |_| {},
            window: false,
            role: Role::Supervise,
            acts: Vec::new(),
            confinement,
            hosts: Hosts::Loopback,
            shared_kib: sandbox::host::SHARED_KIB,
        };
        let Err(error) = live::run(&topology, &secret, nominal.setup.policy.record_guard, options) else {
            panic!("the hostile service did not answer");
        };
        let reason = error.to_string();
        let text = reason.find('{').map(|index| &reason[index..]).unwrap_or_else(|| panic!("{reason}"));
        serde_json::from_str(text).unwrap_or_else(|_| panic!("{reason}"))
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        let _gone = fs::remove_file(&self.shared);
        let own_address = self.udp.local_addr().unwrap();
        self.udp.send_to(&[], own_address).unwrap();
        self.echo.take().map(std::thread::JoinHandle::join);
    }
}

/// Every attempt of every service is refused, or ends it, where the machine confines services; most succeed where they are not.
#[test]
fn hostile_service_gets_at_nothing_of_others() {
    let mut table = BTreeMap::<String, [usize; 4]>::new();
    for service in SERVICES {
        let machine = Machine::new(service);
        let (mut confined, free) = (machine.attempts(Confinement::Best), machine.attempts(Confinement::None));
        let level = confined.remove("level").unwrap();
        for (name, result) in &confined {
            let refused = result.starts_with("refused: ") || result.starts_with("ended: ");
            // A kernel without Landlock holds no file back either, and the level reports it.
            let partly = !level.contains("Landlock") && !NEED_NAMESPACES.contains(&name.as_str());
            let held = level == "refused: full" || partly;
            assert!(refused || !held, "{service}: {name}: {result}, confinement {level}");
            if !refused {
                println!("{service}: {name}: {result}, confinement {level}");
                continue;
            }
            let row = table.entry(name.clone()).or_default();
            row[0] += 1;
            row[1] += usize::from(result.starts_with("ended: "));
            row[2] += 1;
            row[3] += usize::from(free[name] == "succeeded");
        }
    }
    println!("attempt: refused (of these ended) | succeeded without confinement");
    for (name, [refused, ended, tried, succeeded]) in &table {
        println!("{name}: {refused} ({ended}) of {tried} | {succeeded}");
    }
    let (tried, succeeded) = table.values().fold((0, 0), |(n, m), row| (n + row[2], m + row[3]));
    assert!(
        succeeded * 2 > tried,
        "{succeeded} of {tried} attempts succeed without confinement: the others show nothing"
    );
}
