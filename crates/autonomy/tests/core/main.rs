//! The whole core, driven through its mouth: bytes in, bytes out, on a virtual clock.

mod bench;
mod commands;
mod modes;
mod teammates;
