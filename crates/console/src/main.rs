//! The console's process. All of it is in [`console::process`].

fn main() -> std::process::ExitCode {
    console::process::main()
}
