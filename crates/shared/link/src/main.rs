//! The recorder: see [`link::process`].

fn main() -> std::process::ExitCode {
    link::process::main()
}
