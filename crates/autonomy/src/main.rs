//! The autonomy's process. All of it is in [`autonomy::process`].

fn main() -> std::process::ExitCode {
    autonomy::process::main()
}
