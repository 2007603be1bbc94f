//! The attempts, each of which says by its result whether the machine let it through.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::os::fd::AsFd;
use std::os::unix::fs::FileExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use link::spec::ServiceSpec;
use nix::sched::{CloneFlags, setns, unshare};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde::{Deserialize, Serialize};

/// Names of all attempts: the target, then the way.
pub(crate) const NAMES: [&str; 31] = [
    "files: read a secret in the user's home",
    "files: read a list of users",
    "files: read another service's journal",
    "files: write to another service's journal",
    "files: list the run's folder",
    "files: make a file in the run's folder",
    "files: make a file in the folder for temporary files",
    "files: list the processes of the machine",
    "network: a TCP port that is not its own",
    "network: datagrams to another program",
    "network: listen on a chosen TCP port",
    "network: a packet socket",
    "network: a raw socket",
    "network: a local socket in the file system",
    "processes: another program in its place",
    "processes: start a program",
    "processes: signal another process",
    "processes: trace another process",
    "processes: read another process's memory",
    "processes: write to another process's memory",
    "processes: take another process's descriptor",
    "memory: shared memory of another host",
    "memory: more than its address space",
    "memory: fill the disk by its journal",
    "descriptors: more than its limit",
    "kernel: a user namespace",
    "kernel: another process's network",
    "kernel: mount a file system",
    "kernel: another root folder",
    "kernel: name of the machine",
    LEVEL,
];

/// Not an attempt: the level of confinement in which the others are made.
const LEVEL: &str = "level";

/// Existing targets of other processes: an attempt that fails on one was refused.
#[derive(Serialize, Deserialize)]
pub(crate) struct Targets {
    secret: PathBuf,
    tcp: SocketAddr,
    udp: SocketAddr,
    local: PathBuf,
    shared: PathBuf,
    journal: String,
    free_port: u16,
}

impl Targets {
    /// Targets that the test wrote beside this program.
    pub(crate) fn read(program: &Path) -> Result<Self, String> {
        let file = program.with_file_name("targets.json");
        let text = fs::read(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        serde_json::from_slice(&text).map_err(|error| error.to_string())
    }
}

/// Tries one: `Ok` if it succeeded, else the machine's reason.
pub(crate) fn attempt(name: &str, service: &str, spec: &ServiceSpec, targets: &Targets) -> Result<(), String> {
    tried(name, service, spec, targets).map_err(|error| error.to_string())
}

fn tried(name: &str, service: &str, spec: &ServiceSpec, targets: &Targets) -> io::Result<()> {
    let run = &spec.run_dir;
    let other = run.join("inputs").join(format!("{}.cbor", targets.journal));
    let victim = std::env::args().nth(2).and_then(|pid| pid.parse().ok()).unwrap_or(1);
    let pid = Pid::from_raw(victim);
    let of_victim = |file: &str| PathBuf::from(format!("/proc/{victim}/{file}"));
    match name.split_once(": ").map_or(name, |(_, manner)| manner) {
        "read a secret in the user's home" => read(&targets.secret),
        "read a list of users" => read(Path::new("/etc/passwd")),
        "read another service's journal" => File::open(&other).map(drop),
        "write to another service's journal" => File::options().append(true).open(&other).map(drop),
        "list the run's folder" => fs::read_dir(run).map(drop),
        "make a file in the run's folder" => {
            File::create_new(run.join(format!("made-{victim}-{}", std::process::id()))).map(drop)
        }
        "make a file in the folder for temporary files" => {
            let file = std::env::temp_dir().join(format!("holdsafe-escape-{}", std::process::id()));
            File::create_new(&file).and_then(|_| fs::remove_file(&file))
        }
        "list the processes of the machine" => read(&of_victim("cmdline")),
        "a TCP port that is not its own" => TcpStream::connect(targets.tcp).map(drop),
        "datagrams to another program" => datagram(targets.udp),
        "listen on a chosen TCP port" => {
            TcpListener::bind((std::net::Ipv4Addr::LOCALHOST, targets.free_port)).map(drop)
        }
        "a packet socket" => socket(rustix::net::AddressFamily::PACKET),
        "a raw socket" => socket(rustix::net::AddressFamily::INET),
        "a local socket in the file system" => UnixStream::connect(&targets.local).map(drop),
        "another program in its place" => Err(Command::new("/bin/sh").args(["-c", "exit 10"]).exec()),
        "start a program" => Command::new("/bin/true").spawn().and_then(|mut child| child.wait()).map(drop),
        "signal another process" => Ok(kill(pid, Signal::SIGCONT)?),
        "trace another process" => {
            nix::sys::ptrace::seize(pid, nix::sys::ptrace::Options::empty())?;
            Ok(())
        }
        "read another process's memory" => File::open(of_victim("mem")).map(drop),
        "write to another process's memory" => File::options().write(true).open(of_victim("mem")).map(drop),
        "take another process's descriptor" => {
            let held = rustix::process::pidfd_open(
                rustix::process::Pid::from_raw(victim).ok_or(io::ErrorKind::NotFound)?,
                rustix::process::PidfdFlags::empty(),
            )?;
            rustix::process::pidfd_getfd(&held, 1, rustix::process::PidfdGetfdFlags::empty())?;
            Ok(())
        }
        "shared memory of another host" => File::options().write(true).open(&targets.shared).map(drop),
        // Reserved, and never touched.
        "more than its address space" => {
            let row = sandbox::table::row(service).ok_or(io::ErrorKind::NotFound)?;
            let mut wanted: Vec<u8> = Vec::new();
            wanted.try_reserve_exact((row.memory_mib as usize) << 20).map_err(io::Error::other)
        }
        "fill the disk by its journal" => {
            let own_path = run.join("inputs").join(format!("{}.cbor", spec.node));
            let own_file = File::options().write(true).create(true).truncate(false).open(own_path)?;
            own_file.write_at(&[0], 5 << 30).and_then(|_| own_file.set_len(0))
        }
        "more than its limit" => {
            let null = io::stdout();
            let held: io::Result<Vec<_>> = (0..2048).map(|_| null.as_fd().try_clone_to_owned()).collect();
            held.map(drop)
        }
        "a user namespace" => Ok(unshare(CloneFlags::CLONE_NEWUSER)?),
        "another process's network" => Ok(setns(File::open(of_victim("ns/net"))?, CloneFlags::CLONE_NEWNET)?),
        "mount a file system" => {
            use rustix::mount::{MountFlags, mount};
            // Its own mounts, where it can take them, so that a success leaves nothing.
            let _own = unshare(CloneFlags::CLONE_NEWNS);
            Ok(mount("tmpfs", "/tmp", "tmpfs", MountFlags::empty(), None::<&std::ffi::CStr>)?)
        }
        "another root folder" => Ok(nix::unistd::chroot("/tmp")?),
        "name of the machine" => {
            let own_text = nix::unistd::gethostname()?;
            Ok(nix::unistd::sethostname(own_text)?)
        }
        LEVEL => Err(io::Error::other(spec.level().to_string())),
        other => Err(io::Error::other(format!("no attempt called {other}"))),
    }
}

fn read(file: &Path) -> io::Result<()> {
    let mut text = [0];
    File::open(file)?.read_exact(&mut text)
}

/// Sends a datagram, and takes the silence of a port without a listener for a refusal.
fn datagram(to: SocketAddr) -> io::Result<()> {
    let socket = UdpSocket::bind((std::net::Ipv4Addr::LOCALHOST, 0))?;
    socket.connect(to)?;
    socket.send(b"escaped")?;
    let mut answer = [0; 16];
    socket.set_read_timeout(Some(std::time::Duration::from_secs(2)))?;
    socket.recv(&mut answer).map(drop)
}

fn socket(family: rustix::net::AddressFamily) -> io::Result<()> {
    use rustix::net::{SocketFlags, SocketType, ipproto, socket_with};
    let protocol = (family == rustix::net::AddressFamily::INET).then_some(ipproto::ICMP);
    socket_with(family, SocketType::RAW, SocketFlags::CLOEXEC, protocol)?;
    io::stdout().flush()
}
