//! The gateway's process. All of it is in [`gateway::process`].

fn main() -> std::process::ExitCode {
    gateway::process::main()
}
