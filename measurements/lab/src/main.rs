//! The `lab` program, which can also start itself again as each service of a live run. Its verbs are in `lab::command`.

use std::process::ExitCode;

/// That of glibc 2.36 grows without bound under the aligned tensors of inference.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    runner::start::program("lab", |_| None, lab::command::main)
}
