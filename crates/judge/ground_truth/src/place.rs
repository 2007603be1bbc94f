//! A place in a byte stream, as a relay and the end behind it name the same bytes.
//!
//! A stream has no records that both could hash: pieces are cut and joined on the way. Both can name the direction, by the
//! hash of its first bytes, and a place in it, by how many bytes came before. TLS puts 32 random bytes of each side among
//! the first ones, so no two connections share a name.

use wire::event::wire_hash;

/// Number of a direction's first bytes that make its name: past the randoms of a TLS 1.3 hello.
const HEAD: usize = 128;

/// Name of a direction and place in it, kept while its bytes pass.
#[derive(Clone, Debug)]
pub struct StreamPlace {
    head: [u8; HEAD],
    offset: u64,
}

impl Default for StreamPlace {
    fn default() -> Self {
        Self { head: [0; HEAD], offset: 0 }
    }
}

impl StreamPlace {
    /// Takes bytes that pass in this direction.
    pub fn pass(&mut self, bytes: &[u8]) {
        let index = usize::try_from(self.offset).unwrap_or(HEAD).min(HEAD);
        let n = bytes.len().min(HEAD - index);
        self.head[index..index + n].copy_from_slice(&bytes[..n]);
        self.offset += bytes.len() as u64;
    }

    /// Name of the direction: a hash of its first 128 bytes. It is final once these have passed.
    pub fn name(&self) -> u64 {
        wire_hash(&self.head[..usize::try_from(self.offset).unwrap_or(HEAD).min(HEAD)])
    }

    /// Number of bytes that have passed.
    pub fn offset(&self) -> u64 {
        self.offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn direction_keeps_its_name_under_any_cutting() {
        let bytes: Vec<u8> = (0..=255).collect();
        let mut whole = StreamPlace::default();
        whole.pass(&bytes);
        let mut cut = StreamPlace::default();
        bytes.chunks(7).for_each(|piece| cut.pass(piece));
        assert_eq!((cut.name(), cut.offset()), (whole.name(), 256));
        whole.pass(&[1, 2, 3]);
        assert_eq!((cut.name(), whole.offset()), (whole.name(), 259), "what follows changes no name");
        let mut other = StreamPlace::default();
        other.pass(&bytes[1..]);
        assert_ne!(other.name(), cut.name());
    }
}
