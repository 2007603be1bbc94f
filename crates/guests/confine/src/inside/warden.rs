//! Second stage, the first process of the namespaces: it starts the guest, keeps its last words, and ends with it or with the launcher.

use std::fs;
use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Stdio};

use nix::errno::Errno;
use nix::sys::signal::{Signal, kill};
use nix::sys::signalfd::{SfdFlags, SigSet, SignalFd};
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::Pid;
use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::{
    DumpableBehavior, getgid, set_child_subreaper, set_dumpable_behavior, set_parent_process_death_signal, setsid,
};

use super::error::StartError;
use super::{filter, let_go, limits, null, view};
use crate::level::Level;
use crate::spec::{self, Report, Spec};

/// Last bytes of the guest's standard error that are kept.
const WORDS: usize = 2048;
/// Most reads of standard error after the guest's end: 64 KiB, as much as a pipe holds.
const LAST_READS: usize = 16;
/// Folders of programs for a guest whose environment has no PATH.
const PATH: &str = "/usr/local/bin:/usr/bin:/bin";

/// Runs the guest. `refused` is the reason why there are no namespaces.
pub(super) fn main(refused: Option<String>) -> Result<(), StartError> {
    // A killed entry takes the warden with it; in a process namespace the kernel then ends every process of the guest.
    set_parent_process_death_signal(Some(rustix::process::Signal::KILL))?;
    let control = rustix::stdio::stderr().try_clone_to_owned()?;
    let mut control = UnixStream::from(control);
    let Some(line) = spec::line(&mut control)? else { return Ok(()) };
    let spec: Spec = serde_json::from_str(&line).map_err(StartError::Spec)?;
    let namespaces = refused.is_none();
    match confine(&spec, refused).and_then(|level| Ok((level, start(&spec)?))) {
        Ok((level, guest)) => {
            send_report(&mut control, &Report::Started(level))?;
            match guest {
                Some(guest) => watch(guest, control, namespaces),
                None => Ok(()),
            }
        }
        Err(error) => send_report(&mut control, &Report::NotStarted(error.to_string())),
    }
}

fn send_report(control: &mut UnixStream, report: &Report) -> Result<(), StartError> {
    let mut line = serde_json::to_string(report)?;
    line.push('\n');
    // A launcher that is gone hears nothing more.
    let _gone = control.write_all(line.as_bytes());
    Ok(())
}

/// Confines this process, and with it the guest that it starts.
fn confine(spec: &Spec, refused: Option<String>) -> Result<Level, StartError> {
    let mut level = Level { namespaces: refused.is_none(), ..Level::default() };
    match refused {
        None => {
            level.why.extend(view::replace(&spec.folder, spec.hidden.as_deref())?);
            sandbox::limits::give_up_rights().map_err(StartError::of_step("rights"))?;
        }
        Some(why) => {
            level.why.push(format!("no namespaces ({why})"));
            // Without a process namespace orphans of the guest would become children of the machine's init, out of
            // reach.
            set_child_subreaper(Some(rustix::process::getpid()))?;
        }
    }
    std::env::set_current_dir(&spec.folder).map_err(|error| StartError::Folder { path: spec.folder.clone(), error })?;
    setsid().map_err(StartError::of_step("session"))?;
    // The guest runs as the same user, and could otherwise open the launcher's socket through `/proc`.
    set_dumpable_behavior(DumpableBehavior::NotDumpable)?;
    level.why.extend(limits::set(&spec.limits, level.namespaces)?);
    match filter::apply(level.namespaces) {
        Ok(()) => level.seccomp = true,
        Err(why) => level.why.push(format!("no filter of system calls ({why})")),
    }
    level.network = level.namespaces || level.seccomp;
    Ok(level)
}

/// The guest's process; none for a specification without a program.
fn start(spec: &Spec) -> Result<Option<Child>, StartError> {
    let Some((name, arguments)) = spec.command.split_first() else { return Ok(None) };
    let program = found(name, spec.environment.get("PATH").map_or(PATH, String::as_str))?;
    SigSet::from_iter([Signal::SIGCHLD]).thread_block()?;
    let mut command = Command::new(&program);
    command.args(arguments).env_clear().envs(&spec.environment).stderr(Stdio::piped()).process_group(0);
    // Naming the group makes the standard library fork. Its other way maps memory first, which a small limit no longer allows.
    command.gid(getgid().as_raw());
    let child = command.spawn().map_err(|error| {
        let program = name.clone();
        if error.kind() == io::ErrorKind::NotFound {
            StartError::NoInterpreter { program }
        } else {
            StartError::Program { program, error }
        }
    })?;
    null().and_then(|null| let_go(&null))?;
    Ok(Some(child))
}

/// File of a program; a name without `/` is looked up in the folders of `path`.
fn found(name: &str, path: &str) -> Result<PathBuf, StartError> {
    let exists = |file: &Path| fs::metadata(file).is_ok_and(|found| found.is_file());
    let file = if name.contains('/') {
        Some(PathBuf::from(name)).filter(|file| exists(file))
    } else {
        path.split(':').map(|folder| Path::new(folder).join(name)).find(|file| exists(file))
    };
    let folders = if name.contains('/') { String::new() } else { format!(" in {path}") };
    file.ok_or_else(|| StartError::NoProgram { program: name.to_owned(), folders })
}

/// Keeps the guest's words until it ends or the launcher does.
fn watch(mut guest: Child, mut control: UnixStream, namespaces: bool) -> Result<(), StartError> {
    let signals =
        SignalFd::with_flags(&SigSet::from_iter([Signal::SIGCHLD]), SfdFlags::SFD_NONBLOCK | SfdFlags::SFD_CLOEXEC)
            .map_err(StartError::Signals)?;
    let mut stderr = guest.stderr.take();
    let mut words = Vec::with_capacity(2 * WORDS + 4096);
    let main = Pid::from_raw(guest.id() as i32);
    let how = loop {
        if let Some(manner) = reap(main) {
            break Some(manner);
        }
        let mut fds = vec![PollFd::new(&signals, PollFlags::IN), PollFd::new(&control, PollFlags::IN)];
        fds.extend(stderr.as_ref().map(|stderr| PollFd::new(stderr, PollFlags::IN)));
        match poll(&mut fds, None) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
        let ready: Vec<bool> = fds.iter().map(|fd| !fd.revents().is_empty()).collect();
        while let Ok(Some(_)) = signals.read_signal() {}
        if ready.get(2) == Some(&true) {
            hear(&mut stderr, &mut words);
        }
        if ready.get(1) == Some(&true) {
            break None;
        }
    };
    // Bounded: a process that the guest left behind may go on writing.
    for _ in 0..LAST_READS {
        if !stderr.as_ref().is_some_and(|stderr| readable(stderr.as_fd())) {
            break;
        }
        hear(&mut stderr, &mut words);
    }
    if !namespaces {
        end_all(main);
    }
    send_report(&mut control, &Report::Ended { how, words: String::from_utf8_lossy(&words).into_owned() })
}

fn readable(fd: std::os::fd::BorrowedFd<'_>) -> bool {
    let now = rustix::event::Timespec { tv_sec: 0, tv_nsec: 0 };
    poll(&mut [PollFd::new(&fd, PollFlags::IN)], Some(&now)) == Ok(1)
}

/// Takes one read of standard error, and keeps the end of all.
fn hear(stderr: &mut Option<ChildStderr>, words: &mut Vec<u8>) {
    let mut chunk = [0; 4096];
    match stderr.as_mut().map(|stderr| stderr.read(&mut chunk)) {
        Some(Ok(n)) if n > 0 => {
            words.extend_from_slice(&chunk[..n]);
            words.drain(..words.len().saturating_sub(WORDS));
        }
        Some(Err(why)) if why.kind() == io::ErrorKind::Interrupted => {}
        _ => *stderr = None,
    }
}

/// Reaps every ended process; the guest's own end in words if it is among them.
fn reap(main: Pid) -> Option<String> {
    loop {
        match waitpid(None, Some(WaitPidFlag::WNOHANG)) {
            Ok(WaitStatus::Exited(pid, status)) if pid == main => return Some(format!("exit status {status}")),
            Ok(WaitStatus::Signaled(pid, signal, _)) if pid == main => return Some(format!("killed by {signal}")),
            Ok(WaitStatus::StillAlive) | Err(Errno::ECHILD) => return None,
            Err(Errno::EINTR) | Ok(_) => {}
            Err(why) => return Some(why.to_string()),
        }
    }
}

/// Ends all processes of the guest where the end of this one does not. Orphans become children of this process, and each round ends a
/// generation.
fn end_all(main: Pid) {
    let _gone = kill(Pid::from_raw(-main.as_raw()), Signal::SIGKILL);
    let children_path = format!("/proc/self/task/{}/children", Pid::this());
    loop {
        for child in
            fs::read_to_string(&children_path).unwrap_or_default().split(' ').filter_map(|pid| pid.parse().ok())
        {
            let _gone = kill(Pid::from_raw(child), Signal::SIGKILL);
        }
        match waitpid(None, None) {
            Ok(_) | Err(Errno::EINTR) => {}
            Err(_) => return,
        }
    }
}
