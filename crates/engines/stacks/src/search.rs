//! Search for marks in bytes: every run of eight bytes of every mark is looked for, so that a part is found as well as
//! the whole.

use std::collections::BTreeSet;

use super::words::Mark;

/// Length of a match, bytes: chance gives one in 2⁶⁴ places.
pub(super) const WINDOW: usize = 8;

/// Index of the marks for a search.
pub(super) struct Search<'a> {
    marks: &'a [Mark],
    /// Every run of [`WINDOW`] bytes with the index of its mark, sorted.
    windows: Vec<([u8; WINDOW], usize)>,
}

impl<'a> Search<'a> {
    pub(super) fn new(marks: &'a [Mark]) -> Self {
        let finding = |(n, mark): (usize, &Mark)| {
            let whole: Vec<[u8; WINDOW]> = mark.bytes.windows(WINDOW).filter_map(|w| w.try_into().ok()).collect();
            whole.into_iter().map(move |window| (window, n))
        };
        let mut windows: Vec<_> = marks.iter().enumerate().flat_map(finding).collect();
        windows.sort_unstable();
        Self { marks, windows }
    }

    /// The marks of which something is in `bytes`.
    pub(super) fn read_in<'b>(&self, bytes: impl IntoIterator<Item = &'b [u8]>) -> BTreeSet<&'a str> {
        let mut found = BTreeSet::new();
        for window in bytes.into_iter().flat_map(|piece| piece.windows(WINDOW)) {
            let from = self.windows.partition_point(|(known, _)| known.as_slice() < window);
            let same = self.windows[from..].iter().take_while(|(known, _)| known.as_slice() == window);
            found.extend(same.map(|(_, mark)| self.marks[*mark].what.as_str()));
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_eight_bytes_are_found_seven_not() {
        let marks = [Mark::new("first", *b"0123456789ab"), Mark::new("second", *b"6789abcdefgh")];
        let search = Search::new(&marks);
        let read = |text: &[u8]| search.read_in([text]).into_iter().collect::<Vec<_>>();
        assert_eq!(read(b"..12345678.."), ["first"]);
        assert_eq!(read(b"..1234567.."), <[&str; 0]>::default());
        assert_eq!(read(b"abcdefgh"), ["second"]);
        assert_eq!(search.read_in([&b"6789"[..], b"abcd"]), BTreeSet::new(), "across two pieces nothing is read");
    }
}
