//! The broker's process. All of it is in [`broker::process`].

fn main() -> std::process::ExitCode {
    broker::process::main()
}
