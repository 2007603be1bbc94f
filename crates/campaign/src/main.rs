//! The `holdsafe` command.

fn main() {}
