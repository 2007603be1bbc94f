//! The sim's process. All of it is in [`sim::process`].

fn main() -> std::process::ExitCode {
    sim::process::main()
}
