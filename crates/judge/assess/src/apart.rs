//! Parts of a recording put one behind another, and the sentences about them.

use wire::time::Instant;

use crate::read::Read;

/// Most steps back, and most parts, that one sentence names.
const MAX_NAMED: usize = 3;

/// Shift of the stamps of each part, by which it begins `pause` microseconds behind the end of the one before, or later.
pub(crate) fn shifts(ends: impl IntoIterator<Item = (u64, u64)>, pause: u64) -> Vec<u64> {
    let (mut shift, mut free): (u64, u64) = (0, 0);
    let mut shifts = Vec::new();
    for (first, last) in ends {
        shift = shift.max(free.saturating_sub(first));
        shifts.push(shift);
        free = last.saturating_add(shift).saturating_add(pause);
    }
    shifts
}

/// The steps back of the stamps.
pub(crate) fn backwards(read: &Read) -> Option<String> {
    let first = read.parts.first()?.ends.0;
    let one = |back: &crate::parts::Back| {
        let (amount, seconds) = (back.by as f64 / 1e6, (back.at as f64 - first as f64) / 1e6);
        format!("by {} s at {seconds:.1} s", libm::round(amount * 10.0) / 10.0)
    };
    let named = read.backs.iter().take(MAX_NAMED).map(one).collect::<Vec<_>>();
    let further = read.backs.len().saturating_sub(MAX_NAMED);
    let further = if further > 0 { format!(" and {further} further times") } else { String::new() };
    (!named.is_empty()).then(|| {
        format!(
            "The stamps go back {}{further}, as those of a recording that was played again: the parts between are judged apart.",
            named.join(", ")
        )
    })
}

/// The parts from `begin` to `end`, where there are several.
pub(crate) fn judged(begin: Instant, pauses: &[(Instant, Instant)], end: Instant) -> Option<String> {
    let seconds = |time: Instant| time.since(begin).0 as f64 / 1e6;
    let begins = std::iter::once(begin).chain(pauses.iter().map(|(_, begin)| *begin));
    let ends = pauses.iter().map(|(end, _)| *end).chain([end]);
    let named: Vec<String> =
        begins.zip(ends).map(|(begin, end)| format!("{:.1} to {:.1} s", seconds(begin), seconds(end))).collect();
    let further = named.len().saturating_sub(2 * MAX_NAMED);
    let further = if further > 0 { format!(" and {further} further") } else { String::new() };
    (named.len() > 1).then(|| {
        format!(
            "Judged are {} parts, each with guards that start anew, one behind another: {}{further}. Nothing between them is judged.",
            named.len(),
            named[..named.len().min(2 * MAX_NAMED)].join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_never_overlap() {
        assert_eq!(shifts([(100, 200), (100, 200), (350, 400), (900, 901), (0, 5)], 10), [0, 110, 110, 110, 1021]);
    }
}
