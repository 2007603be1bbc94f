//! Messages that must be refused, made from every vector: bytes that are nearly a message.

use wire::codec::Malformed;

use crate::item::{Item, items};
use crate::values::{self, Named};

/// Every vector with each of its items.
fn each(mut attempt: impl FnMut(&str, &Named, &Item)) {
    for (message, values) in values::all() {
        for value in values {
            let label = format!("{message}/{}", value.name);
            items(&value.bytes).iter().for_each(|item| attempt(&label, &value, item));
        }
    }
}

/// `bytes` with `from..to` replaced.
fn spliced(bytes: &[u8], from: usize, to: usize, new: &[u8]) -> Vec<u8> {
    [&bytes[..from], new, &bytes[to..]].concat()
}

fn verdict(value: &Named, bytes: &[u8]) -> Result<bool, Malformed> {
    (value.decode)(bytes, bytes.len())
}

#[test]
fn truncated_message_never_fits_its_schema() {
    for (message, values) in values::all() {
        for value in values {
            for end in 0..value.bytes.len() {
                let got = verdict(&value, &value.bytes[..end]);
                assert!(matches!(got, Err(Malformed::Schema { .. })), "{message}/{} at {end}: {got:?}", value.name);
            }
        }
    }
}

#[test]
fn anything_behind_it_is_not_canonical() {
    for (message, values) in values::all() {
        for value in values {
            for tail in [&[0x00][..], &[0xf6], &[0xff], &value.bytes] {
                let got = verdict(&value, &[&value.bytes, tail].concat());
                let expected = Err(Malformed::NonCanonical { at: value.bytes.len() });
                assert_eq!(got, expected, "{message}/{}", value.name);
            }
        }
    }
}

#[test]
fn message_longer_than_channel_is_refused() {
    for (message, values) in values::all() {
        for value in values {
            let (max, got) = (value.bytes.len() - 1, value.bytes.len());
            let refused = (value.decode)(&value.bytes, max);
            assert_eq!(refused, Err(Malformed::TooLong { max, got }), "{message}/{}", value.name);
        }
    }
}

#[test]
fn overlong_argument_is_not_canonical() {
    each(|label, value, item| {
        if item.major == 7 {
            return;
        }
        for (low, width) in [(24, 1), (25, 2), (26, 4), (27, 8)] {
            if width < item.head {
                continue;
            }
            let argument = item.argument.to_be_bytes();
            let longer = [&[item.major << 5 | low], &argument[8 - width..]].concat();
            let bytes = spliced(&value.bytes, item.start, item.start + item.head, &longer);
            let got = verdict(value, &bytes);
            assert!(matches!(got, Err(Malformed::NonCanonical { .. })), "{label} at {}: {got:?}", item.start);
        }
    });
}

#[test]
fn an_indefinite_length_is_refused() {
    each(|label, value, item| {
        if !matches!(item.major, 2..=5) {
            return;
        }
        let content = &value.bytes[item.start + item.head..item.end];
        let chunk = &value.bytes[item.start..item.end];
        let inner = if matches!(item.major, 2 | 3) { chunk } else { content };
        let open = [&[item.major << 5 | 31], inner, &[0xff]].concat();
        let got = verdict(value, &spliced(&value.bytes, item.start, item.end, &open));
        let refused = matches!(got, Err(Malformed::NonCanonical { .. } | Malformed::Schema { .. }));
        assert!(refused, "{label} at {}: {got:?}", item.start);
    });
}

#[test]
fn a_huge_count_is_not_this_schema() {
    each(|label, value, item| {
        if !matches!(item.major, 2..=5) {
            return;
        }
        for huge in [&[27, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff][..], &[26, 0x7f, 0xff, 0xff, 0xff]] {
            let head = [&[item.major << 5 | huge[0]], &huge[1..]].concat();
            let bytes = spliced(&value.bytes, item.start, item.start + item.head, &head);
            let got = verdict(value, &bytes);
            assert!(matches!(got, Err(Malformed::Schema { .. })), "{label} at {}: {got:?}", item.start);
        }
    });
}

#[test]
fn wrong_type_nan_and_infinity_are_refused() {
    let wrong: [&[u8]; 6] = [
        &[0xf9, 0x7e, 0x00],
        &[0xf9, 0x7c, 0x00],
        &[0xfb, 0x7f, 0xf8, 0, 0, 0, 0, 0, 0],
        &[0xf7],
        &[0xc0, 0x00],
        &[0xa1, 0x00, 0x00],
    ];
    each(|label, value, item| {
        for wrong in wrong {
            let got = verdict(value, &spliced(&value.bytes, item.start, item.end, wrong));
            // What represents a variant without fields is read past, and found by encoding again.
            let bare = item.major == 4 && item.argument == 0 && matches!(got, Err(Malformed::NonCanonical { .. }));
            let refused = bare || matches!(got, Err(Malformed::Schema { .. }));
            assert!(refused, "{label} at {} {wrong:02x?}: {got:?}", item.start);
        }
    });
}

#[test]
fn unknown_field_or_trailing_null_is_refused() {
    each(|label, value, item| {
        if item.major != 4 || item.argument >= 23 {
            return;
        }
        for extra in [0x00, 0xf6] {
            let grown = [&[0x80 | (item.argument as u8 + 1)], &value.bytes[item.start + item.head..item.end], &[extra]];
            let got = verdict(value, &spliced(&value.bytes, item.start, item.end, &grown.concat()));
            // A number may be the optional field that was left out; that is then another message, and a canonical one.
            let is_other = extra == 0x00 && got == Ok(false);
            let refused = matches!(got, Err(Malformed::NonCanonical { .. } | Malformed::Schema { .. }));
            assert!(refused || is_other, "{label} at {} {extra:02x}: {got:?}", item.start);
        }
    });
}
