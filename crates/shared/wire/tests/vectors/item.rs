//! A reader of CBOR that shares no code with the codec under test: where each item begins and ends, and its diagnostic
//! notation (RFC 8949 §8). Definite lengths and no floats; tags are not spoken here.

/// A data item within some bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item {
    /// Offset of the head.
    pub start: usize,
    /// Bytes of the head: the initial byte and its argument.
    pub head: usize,
    /// Offset behind the item with all that it holds.
    pub end: usize,
    /// Major type.
    pub major: u8,
    /// Argument.
    pub argument: u64,
}

/// All items, outer before inner, of bytes that are exactly one item.
pub(crate) fn items(bytes: &[u8]) -> Vec<Item> {
    let mut found = Vec::new();
    let end = walk(bytes, 0, &mut found);
    assert_eq!(end, bytes.len(), "one item and nothing behind it");
    found
}

fn head(bytes: &[u8], start: usize) -> (u8, u64, usize) {
    let (major, low) = (bytes[start] >> 5, bytes[start] & 31);
    let width = match low {
        0..24 => return (major, u64::from(low), 1),
        24 => 1,
        25 => 2,
        26 => 4,
        27 => 8,
        28.. => panic!("no definite argument at byte {start}"),
    };
    let argument = bytes[start + 1..=start + width].iter().fold(0, |n, b| n << 8 | u64::from(*b));
    (major, argument, 1 + width)
}

fn walk(bytes: &[u8], start: usize, found: &mut Vec<Item>) -> usize {
    let (major, argument, length) = head(bytes, start);
    let index = found.len();
    found.push(Item { start, head: length, end: 0, major, argument });
    let inner = start + length;
    let end = match major {
        0 | 1 | 7 => inner,
        2 | 3 => inner + argument as usize,
        4 => (0..argument).fold(inner, |index, _| walk(bytes, index, found)),
        5 => (0..2 * argument).fold(inner, |index, _| walk(bytes, index, found)),
        6.. => panic!("a tag at byte {start}"),
    };
    found[index].end = end;
    end
}

/// Diagnostic notation.
pub(crate) fn notation(bytes: &[u8]) -> String {
    let mut text = String::new();
    write(bytes, 0, &mut text);
    text
}

fn write(bytes: &[u8], start: usize, text: &mut String) -> usize {
    let (major, argument, length) = head(bytes, start);
    let inner = start + length;
    match major {
        0 => text.push_str(&argument.to_string()),
        1 => text.push_str(&format!("-{}", u128::from(argument) + 1)),
        2 => text.push_str(&format!("h'{}'", super::hex(&bytes[inner..inner + argument as usize]))),
        3 => text.push_str(&format!("{:?}", String::from_utf8_lossy(&bytes[inner..inner + argument as usize]))),
        4 => return list(bytes, inner, argument, ('[', ']'), text),
        5 => {
            assert_eq!(argument, 0, "only the empty map is spoken here");
            text.push_str("{}");
        }
        7 => text.push_str(match argument {
            20 => "false",
            21 => "true",
            22 => "null",
            other => panic!("simple value {other}"),
        }),
        other => panic!("major type {other}"),
    }
    inner + if matches!(major, 2 | 3) { argument as usize } else { 0 }
}

fn list(bytes: &[u8], mut at: usize, n: u64, (open, close): (char, char), text: &mut String) -> usize {
    text.push(open);
    for i in 0..n {
        text.push_str(if i == 0 { "" } else { ", " });
        at = write(bytes, at, text);
    }
    text.push(close);
    at
}
