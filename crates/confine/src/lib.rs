//! Programs of others as confined processes. The crate `guest` says what is asked of them.
