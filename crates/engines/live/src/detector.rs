//! A detector of others in a process of its own, seen from the one that asks it: started with limits, asked image by image, ended by name.
//!
//! [`start`] gives one for the process of a unit's perception, which starts it before it is confined. [`Remote`] is for a launcher: it starts
//! the process, and anew after it has ended, so that one bad image costs one run. Detection is left to the crate `perception`.

use std::fmt;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use link::framed;
use nix::sys::signal::Signal;
use perception::brought::Brought;
use perception::detector::DetectorError;
use perception::model::ModelRef;
use perception::process::detector::{DETECTOR, LoadRequest, MAX_ANSWER, answered, request};
use perception::sight::Sight;
use rustix::process::{Pid, Resource, Rlimit, prlimit};
use wire::codec::List;
use wire::sensor::Detection;

use super::child::Services;

/// Resource limits of the process of a detector.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// CPU time until it is loaded and tried, seconds.
    pub cpu_s: u64,
    /// Address space, bytes.
    pub memory: u64,
}

impl Limits {
    /// A hundred times the shipped detector's time, and a hundred times the size of a small one's file.
    pub const USUAL: Limits = Limits { cpu_s: 10, memory: 2 << 30 };
}

/// Time for an answer: much longer than an image may take, so that a busy host explains none.
const PATIENCE: Duration = Duration::from_secs(20);

/// A running process with its model loaded.
#[derive(Debug)]
struct Process {
    child: Child,
    socket: UnixStream,
    limits: Limits,
}

impl Process {
    /// Starts it and waits until the model is loaded and tried.
    fn start(services: &Services, asked: &LoadRequest, limits: Limits) -> Result<Self, String> {
        let (near, far) = UnixStream::pair().map_err(|why| why.to_string())?;
        near.set_read_timeout(Some(PATIENCE)).map_err(|why| why.to_string())?;
        let mut command = services.command(DETECTOR);
        command.env_clear().stdin(OwnedFd::from(far)).stdout(Stdio::null()).stderr(Stdio::null()).process_group(0);
        let child = command.spawn().map_err(|why| format!("cannot start {:?}: {why}", command.get_program()))?;
        // The command has the far end until it is dropped.
        drop(command);
        let mut process = Process { child, socket: near, limits };
        let text = serde_json::to_vec(asked).map_err(|why| why.to_string())?;
        process.limit(Resource::Cpu, Some(limits.cpu_s))?;
        process.limit(Resource::As, Some(limits.memory))?;
        process.limit(Resource::Core, Some(0))?;
        let loaded = process.exchange(&text).and_then(|answer| answered(&answer).map(drop));
        loaded.and_then(|()| process.limit(Resource::Cpu, None)).map(|()| process)
    }

    /// Sets the present limit; of CPU time the greatest stays, for loading counts apart from images.
    fn limit(&self, resource: Resource, most: Option<u64>) -> Result<(), String> {
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        let both = Rlimit { current: most, maximum: most.filter(|_| resource != Resource::Cpu) };
        prlimit(pid, resource, both).map(drop).map_err(|why| format!("cannot limit the process of the detector: {why}"))
    }

    /// The answer to a message; without one the reason for which the process has ended, which it then has.
    fn exchange(&mut self, message: &[u8]) -> Result<Vec<u8>, String> {
        let asked = framed::write(&mut self.socket, message);
        match asked.and_then(|()| framed::read(&mut self.socket, MAX_ANSWER)) {
            Ok(Some(answer)) => Ok(answer),
            Ok(None) => Err(self.ended()),
            Err(why) if matches!(why.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {
                let _gone = self.child.kill();
                Err(format!("no answer within {} s", PATIENCE.as_secs()))
            }
            Err(_) => Err(self.ended()),
        }
    }

    fn ended(&mut self) -> String {
        let _more = self.socket.read(&mut [0]);
        match self.child.wait() {
            Ok(status) => end(status, self.limits),
            Err(why) => why.to_string(),
        }
    }

    fn detect(&mut self, image: &[u8], least: u16) -> Result<Result<List<Detection, 32>, String>, String> {
        self.exchange(&request(image, least)).map(|answer| answered(&answer))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _gone = self.child.kill();
        let _status = self.child.wait();
    }
}

/// Reason for which a process ended without an answer.
fn end(status: ExitStatus, limits: Limits) -> String {
    let signal = status.signal().and_then(|number| Signal::try_from(number).ok());
    match signal {
        Some(Signal::SIGXCPU) => format!("the detector was not loaded and tried within {} s of CPU", limits.cpu_s),
        Some(Signal::SIGABRT) => {
            format!("the runtime failed on it: it panicked, or wanted more than {} MiB", limits.memory >> 20)
        }
        Some(signal) => format!("the runtime failed on it: {signal}"),
        None => format!("its process ended: {status}"),
    }
}

/// Tries the detector within `limits`, in a process that then ends.
///
/// # Errors
/// A detector that cannot be started, or that fails its trial, by what it answered.
pub fn try_detector(services: &Services, brought: &Brought, limits: Limits) -> Result<(), String> {
    Process::start(services, &asked(brought, None), limits).map(drop)
}

fn asked(brought: &Brought, runtime: Option<&ModelRef>) -> LoadRequest {
    LoadRequest { brought: brought.clone(), runtime: runtime.cloned() }
}

/// Starts a detector for the calling process, which may be confined after it.
///
/// # Errors
/// A detector that cannot be started, or that fails its trial, by what it answered.
pub fn start(services: &Services, brought: &Brought, runtime: Option<&ModelRef>) -> Result<Arc<dyn Sight>, String> {
    Ok(Arc::new(Held(Mutex::new(Process::start(services, &asked(brought, runtime), Limits::USUAL)?))))
}

/// A process that is started once.
#[derive(Debug)]
struct Held(Mutex<Process>);

impl Sight for Held {
    fn detect(&self, image: &[u8], least: u16) -> Result<List<Detection, 32>, DetectorError> {
        let mut process = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        detections_of(process.detect(image, least))
    }
}

/// The inner result is the model's own, the outer one of its process.
fn detections_of(
    found: Result<Result<List<Detection, 32>, String>, String>,
) -> Result<List<Detection, 32>, DetectorError> {
    found.map_err(DetectorError::Process)?.map_err(DetectorError::Session)
}

/// A detector for the runs of a launcher, on a thread that lives as long as this: the kernel ends the process with the thread that started
/// it.
pub struct Remote(Mutex<SyncSender<Image>>);

/// An image to look at, and the place of the answer.
struct Image {
    bytes: Vec<u8>,
    least: u16,
    answer: SyncSender<Result<List<Detection, 32>, DetectorError>>,
}

impl Remote {
    /// Starts the process of a detector and tries it.
    ///
    /// # Errors
    /// A detector that cannot be started, or that fails its trial, by what it answered.
    pub fn start(services: Services, brought: &Brought) -> Result<Self, String> {
        let (images, asked_for) = sync_channel(0);
        let (ready, started) = sync_channel(1);
        let asked = asked(brought, None);
        std::thread::spawn(move || attend(&services, &asked, &ready, &asked_for));
        let started = started.recv().map_err(|_| "the detector's thread has ended".to_owned())?;
        started.map(|()| Remote(Mutex::new(images)))
    }
}

impl fmt::Debug for Remote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Remote")
    }
}

impl Sight for Remote {
    fn detect(&self, image: &[u8], least: u16) -> Result<List<Detection, 32>, DetectorError> {
        let gone = || DetectorError::Process("its thread has ended".to_owned());
        let (answer, answered) = sync_channel(1);
        let images = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        images.send(Image { bytes: image.to_vec(), least, answer }).map_err(|_| gone())?;
        answered.recv().map_err(|_| gone())?
    }
}

/// Starts the process, says how that went, and answers images; a process that has ended is started anew for the next.
fn attend(services: &Services, asked: &LoadRequest, ready: &SyncSender<Result<(), String>>, images: &Receiver<Image>) {
    let mut process = match Process::start(services, asked, Limits::USUAL) {
        Ok(process) => Some(process),
        Err(why) => return drop(ready.send(Err(why))),
    };
    if ready.send(Ok(())).is_err() {
        return;
    }
    while let Ok(Image { bytes, least, answer }) = images.recv() {
        let found = match &mut process {
            Some(process) => process.detect(&bytes, least),
            none => Process::start(services, asked, Limits::USUAL)
                .and_then(|started| none.insert(started).detect(&bytes, least)),
        };
        if found.is_err() {
            process = None;
        }
        if answer.send(detections_of(found)).is_err() {
            return;
        }
    }
}
