//! The helper program alone, for tests: [`confine::inside`] has all of it.

use std::process::ExitCode;

fn main() -> ExitCode {
    confine::inside::main()
}
