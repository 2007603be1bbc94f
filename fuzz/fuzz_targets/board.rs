//! `board`, coverage-guided: see `holdsafe_tests::parsers`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    holdsafe_tests::parsers::files::board(bytes);
});
