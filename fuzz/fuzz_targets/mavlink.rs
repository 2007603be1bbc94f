//! `mavlink`, coverage-guided: see `measurements/mavlink_relay/tests/promise/mod.rs`.
#![no_main]

#[path = "../../measurements/mavlink_relay/tests/promise/mod.rs"]
mod promise;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    promise::mavlink(bytes);
});
