//! What the gateway does, seen from outside: bytes in, bytes and audit events out.

mod bench;
mod boundary;
mod commands;
mod supervision;
