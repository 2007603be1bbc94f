//! Messages over a stream between two processes of one program: a length of 4 bytes, little endian, then that many bytes.
//!
//! The meaning of a message is left to its ends.

use std::io::{Error, ErrorKind, Read, Result, Write};

/// Writes a message.
///
/// # Errors
/// The stream is closed, or the message is longer than 4 GiB.
pub fn write(stream: &mut impl Write, message: &[u8]) -> Result<()> {
    let length = u32::try_from(message.len()).map_err(Error::other)?;
    stream.write_all(&[&length.to_le_bytes(), message].concat())
}

/// The next message of at most `most` bytes; none at the end of the stream.
///
/// # Errors
/// The stream ends within a message, or the message is longer.
pub fn read(stream: &mut impl Read, most: usize) -> Result<Option<Vec<u8>>> {
    let mut length = [0; 4];
    match stream.read_exact(&mut length) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(None),
        Err(error) => return Err(error),
    }
    let length = u32::from_le_bytes(length) as usize;
    if length > most {
        return Err(Error::other(format!("a message of at most {most} bytes expected, got {length}")));
    }
    let mut message = vec![0; length];
    stream.read_exact(&mut message)?;
    Ok(Some(message))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_bounded_and_whole() {
        let mut stream = Vec::new();
        write(&mut stream, b"one").unwrap();
        write(&mut stream, b"").unwrap();
        let mut from = stream.as_slice();
        assert_eq!(read(&mut from, 3).unwrap().as_deref(), Some(&b"one"[..]));
        assert_eq!(read(&mut from, 3).unwrap().as_deref(), Some(&b""[..]));
        assert_eq!(read(&mut from, 3).unwrap(), None);
        assert!(read(&mut stream.as_slice(), 2).unwrap_err().to_string().contains("at most 2 bytes expected, got 3"));
        assert!(read(&mut &stream[..5], 3).is_err(), "cut within a message");
    }
}
