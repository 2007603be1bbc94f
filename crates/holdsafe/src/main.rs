//! The `holdsafe` program, which can also start itself again as each service. Its verbs are in `holdsafe::command`.

use std::process::ExitCode;

/// That of glibc 2.36 grows without bound under the aligned tensors of inference.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    runner::start::program("holdsafe", holdsafe::command::service, holdsafe::command::main)
}
