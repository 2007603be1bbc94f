//! Stands in for the crate `bindgen`, which `iceoryx2-pal-posix` names as a build dependency and calls on QNX only.
//!
//! The real one, with `clang-sys` and a second copy of `regex`, takes half a minute of a first build. A build for QNX
//! fails here, in the build script of `iceoryx2-pal-posix`, for want of `Builder`.
