//! The adversary's process. All of it is in [`adversary::process`].

fn main() -> std::process::ExitCode {
    adversary::process::main()
}
