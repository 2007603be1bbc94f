//! A service's process with an attacker's main: it takes the specification and the confinement of the service in the place of which it is started,
//! and then tries to get at everything that is not its own.
//!
//! Each attempt is its own process, since some of them are fatal. The results go to the launcher in the words of a service that refuses
//! to start, and so to the test that counts them (`tests/attacks/escapes.rs`).

mod attempts;

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

use attempts::Targets;
use link::spec::ServiceSpec;

/// Exit status of an attempt that succeeded; of a refused one it is 0.
const SUCCEEDED: u8 = 10;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let program = Path::new(&arguments[0]);
    let name = program.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let service = name.strip_prefix("holdsafe-").unwrap_or_default().to_owned();
    let mut bytes = Vec::new();
    let Some(attempt) = arguments.get(1) else {
        let spec = match ServiceSpec::read(std::io::stdin().lock()) {
            Ok(spec) => spec,
            Err(why) => return link::drive::refuse(&service, &why.to_string()),
        };
        // This process is the one to signal and to trace: one of the user's that is not confined.
        let map: BTreeMap<&str, String> =
            attempts::NAMES.iter().map(|name| (*name, in_a_process(program, name, &spec))).collect();
        return link::drive::refuse(&service, &serde_json::to_string(&map).unwrap_or_default());
    };
    let _read = std::io::stdin().read_to_end(&mut bytes);
    let done = ServiceSpec::read(bytes.as_slice()).map_err(|error| error.to_string()).and_then(|spec| {
        let targets = Targets::read(program)?;
        let spec = link::confined::confine(spec, &service).map_err(|error| error.to_string())?;
        Ok(attempts::attempt(attempt, &service, &spec, &targets))
    });
    match done {
        Ok(Ok(())) => ExitCode::from(SUCCEEDED),
        Ok(Err(why)) => {
            println!("{why}");
            ExitCode::SUCCESS
        }
        Err(why) => {
            println!("not tried: {why}");
            ExitCode::FAILURE
        }
    }
}

/// `succeeded`, `refused: …`, `ended: …` or `not tried: …`.
fn in_a_process(program: &Path, attempt: &str, spec: &ServiceSpec) -> String {
    let command = Command::new(program)
        .args([attempt, &std::process::id().to_string()])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let mut child = match command {
        Ok(child) => child,
        Err(why) => return format!("not tried: {why}"),
    };
    if let Some(pipe) = child.stdin.take() {
        let mut pipe = pipe;
        let _unread = spec.write(&mut pipe).and_then(|()| Ok(pipe.flush()?));
    }
    match child.wait_with_output() {
        Err(why) => format!("not tried: {why}"),
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
            match (output.status.code(), output.status.signal()) {
                (Some(code), _) if code == i32::from(SUCCEEDED) => "succeeded".to_owned(),
                (Some(0), _) => format!("refused: {text}"),
                (Some(_), _) => text,
                (None, signal) => format!("ended: signal {}", signal.unwrap_or_default()),
            }
        }
    }
}
