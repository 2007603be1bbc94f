//! A custom detector in a separate process, from the side of its caller: started with limits, called image by image; the reason for its end
//! is reported.
//!
//! [`start`] is for the process of a unit's perception, which starts it before it is confined. [`Remote`] is for a launcher: it starts the
//! process, and starts another after that has ended, so that one bad image costs one run. Detection is left to the crate `perception`.

use std::fmt;
use std::io::{self, Read};
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
use rustix::io::Errno;
use rustix::process::{Pid, Resource, Rlimit, prlimit};
use wire::codec::List;
use wire::sensor::Detection;

use super::child::{Services, StartError};

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

/// Reason for which the process of a detector gives no answer.
#[derive(Debug, thiserror::Error)]
pub enum ProcessError {
    /// No socket to it.
    #[error(transparent)]
    Socket(#[from] io::Error),
    /// The host does not start it.
    #[error(transparent)]
    Start(#[from] StartError),
    /// The request to load the model cannot be encoded.
    #[error(transparent)]
    Encode(#[from] serde_json::Error),
    /// The kernel refused a limit.
    #[error("cannot limit the process of the detector: {0}")]
    Limit(Errno),
    /// It refused the detector.
    #[error("{0}")]
    Refused(String),
    /// It gave no answer in time.
    #[error("no answer within {} s", PATIENCE.as_secs())]
    Late,
    /// It used up its CPU time.
    #[error("the detector was not loaded and tried within {cpu_s} s of CPU")]
    Cpu {
        /// The limit, seconds.
        cpu_s: u64,
    },
    /// It aborted.
    #[error("the runtime failed on it: it panicked, or wanted more than {mib} MiB")]
    Aborted {
        /// The limit of its memory, MiB.
        mib: u64,
    },
    /// Another signal ended it.
    #[error("the runtime failed on it: {0}")]
    Signal(Signal),
    /// It ended by itself.
    #[error("its process ended: {0}")]
    Exited(ExitStatus),
    /// The thread that starts and calls it ended.
    #[error("the detector's thread has ended")]
    ThreadEnded,
}

/// Time limit for an answer: much longer than an image may take, so that a busy host does not explain a missing one.
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
    fn start(services: &Services, load: &LoadRequest, limits: Limits) -> Result<Self, ProcessError> {
        let (near, far) = UnixStream::pair()?;
        near.set_read_timeout(Some(PATIENCE))?;
        let mut command = services.command(DETECTOR);
        command.env_clear().stdin(OwnedFd::from(far)).stdout(Stdio::null()).stderr(Stdio::null()).process_group(0);
        let child = command.spawn().map_err(|error| StartError::spawn(&command, error))?;
        // The command has the far end until it is dropped: with it open here, the end of the process would not end the socket.
        drop(command);
        let mut process = Process { child, socket: near, limits };
        let text = serde_json::to_vec(load)?;
        // The process gets its limits before the request: it has read nothing of the model until then.
        process.limit(Resource::Cpu, Some(limits.cpu_s))?;
        process.limit(Resource::As, Some(limits.memory))?;
        process.limit(Resource::Core, Some(0))?;
        let answer = process.exchange(&text)?;
        answered(&answer).map_err(ProcessError::Refused)?;
        process.limit(Resource::Cpu, None)?;
        Ok(process)
    }

    /// Sets a limit. The maximum of CPU time stays unlimited, so that the limit for loading can be removed before the images.
    fn limit(&self, resource: Resource, most: Option<u64>) -> Result<(), ProcessError> {
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        let both = Rlimit { current: most, maximum: most.filter(|_| resource != Resource::Cpu) };
        prlimit(pid, resource, both).map(drop).map_err(ProcessError::Limit)
    }

    /// The answer to a message. Without an answer the process has ended, and the error has the reason.
    fn exchange(&mut self, message: &[u8]) -> Result<Vec<u8>, ProcessError> {
        let sent = framed::write(&mut self.socket, message);
        match sent.and_then(|()| framed::read(&mut self.socket, MAX_ANSWER)) {
            Ok(Some(answer)) => Ok(answer),
            Ok(None) => Err(self.end_reason()),
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                let _killed = self.child.kill();
                Err(ProcessError::Late)
            }
            Err(_) => Err(self.end_reason()),
        }
    }

    fn end_reason(&mut self) -> ProcessError {
        let _end = self.socket.read(&mut [0]);
        match self.child.wait() {
            Ok(status) => reason(status, self.limits),
            Err(error) => error.into(),
        }
    }

    /// The detections in an image. `DetectorError::Process` is about the process, which has then ended; `DetectorError::Session` is the
    /// model's own.
    fn detect(&mut self, image: &[u8], least: u16) -> Result<List<Detection, 32>, DetectorError> {
        let answer = self.exchange(&request(image, least));
        let answer = answer.map_err(|error| DetectorError::Process(error.to_string()))?;
        answered(&answer).map_err(DetectorError::Session)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _killed = self.child.kill();
        let _status = self.child.wait();
    }
}

/// Reason for which a process ended without an answer.
fn reason(status: ExitStatus, limits: Limits) -> ProcessError {
    let signal = status.signal().and_then(|number| Signal::try_from(number).ok());
    match signal {
        Some(Signal::SIGXCPU) => ProcessError::Cpu { cpu_s: limits.cpu_s },
        Some(Signal::SIGABRT) => ProcessError::Aborted { mib: limits.memory >> 20 },
        Some(signal) => ProcessError::Signal(signal),
        None => ProcessError::Exited(status),
    }
}

/// Tries the detector within `limits`, in a process that then ends.
///
/// # Errors
/// A detector that cannot be started, or that fails its trial, with its answer.
pub fn try_detector(services: &Services, brought: &Brought, limits: Limits) -> Result<(), ProcessError> {
    Process::start(services, &load_request(brought, None), limits).map(drop)
}

fn load_request(brought: &Brought, runtime: Option<&ModelRef>) -> LoadRequest {
    LoadRequest { brought: brought.clone(), runtime: runtime.cloned() }
}

/// Starts a detector for the calling process, which may be confined after it.
///
/// # Errors
/// A detector that cannot be started, or that fails its trial, with its answer.
pub fn start(
    services: &Services,
    brought: &Brought,
    runtime: Option<&ModelRef>,
) -> Result<Arc<dyn Sight>, ProcessError> {
    let process = Process::start(services, &load_request(brought, runtime), Limits::USUAL)?;
    Ok(Arc::new(StartedOnce(Mutex::new(process))))
}

/// A process that is not started again after its end.
#[derive(Debug)]
struct StartedOnce(Mutex<Process>);

impl Sight for StartedOnce {
    fn detect(&self, image: &[u8], least: u16) -> Result<List<Detection, 32>, DetectorError> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).detect(image, least)
    }
}

/// A detector for the runs of a launcher, on a thread that lives as long as this: the kernel ends the process with the thread that started
/// it.
pub struct Remote(Mutex<SyncSender<Image>>);

/// An image for the detector, and the channel for the answer.
struct Image {
    bytes: Vec<u8>,
    least: u16,
    answer: SyncSender<Result<List<Detection, 32>, DetectorError>>,
}

impl Remote {
    /// Starts the process of a detector and tries it.
    ///
    /// # Errors
    /// A detector that cannot be started, or that fails its trial, with its answer.
    pub fn start(services: Services, brought: &Brought) -> Result<Self, ProcessError> {
        let (images, queue) = sync_channel(0);
        let (ready, started) = sync_channel(1);
        let load = load_request(brought, None);
        std::thread::spawn(move || serve(&services, &load, &ready, &queue));
        started.recv().map_err(|_| ProcessError::ThreadEnded)??;
        Ok(Remote(Mutex::new(images)))
    }
}

impl fmt::Debug for Remote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Remote")
    }
}

impl Sight for Remote {
    fn detect(&self, image: &[u8], least: u16) -> Result<List<Detection, 32>, DetectorError> {
        let ended = || DetectorError::Process("its thread has ended".to_owned());
        let (answer, answered) = sync_channel(1);
        let images = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        images.send(Image { bytes: image.to_vec(), least, answer }).map_err(|_| ended())?;
        answered.recv().map_err(|_| ended())?
    }
}

/// Starts the process, reports the result as `ready`, and answers images; after its end, another process is started for the next image.
fn serve(
    services: &Services,
    load: &LoadRequest,
    ready: &SyncSender<Result<(), ProcessError>>,
    images: &Receiver<Image>,
) {
    let mut process = match Process::start(services, load, Limits::USUAL) {
        Ok(process) => Some(process),
        Err(error) => return drop(ready.send(Err(error))),
    };
    if ready.send(Ok(())).is_err() {
        return;
    }
    while let Ok(Image { bytes, least, answer }) = images.recv() {
        let found = match &mut process {
            Some(process) => process.detect(&bytes, least),
            none => Process::start(services, load, Limits::USUAL)
                .map_err(|error| DetectorError::Process(error.to_string()))
                .and_then(|started| none.insert(started).detect(&bytes, least)),
        };
        if matches!(found, Err(DetectorError::Process(_))) {
            process = None;
        }
        if answer.send(found).is_err() {
            return;
        }
    }
}
