//! What the console shows, tells and asks for, seen from outside: feed bytes in, bytes and audit events out.

mod bench;
mod display;
mod script;
