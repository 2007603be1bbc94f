//! Perception's process. All of it is in [`perception::process`].

/// An allocator in place of glibc's: that of glibc 2.36 grows without bound under the aligned tensors of inference.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    perception::process::main()
}
