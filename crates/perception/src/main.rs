//! Perception's process. All of it is in [`perception::process`].

fn main() -> std::process::ExitCode {
    perception::process::main()
}
