//! Past readings of a sensor, for a fault that passes them on under fresh stamps.

use std::collections::VecDeque;

/// The newest readings of one sensor, as many as the deepest skew of the run asks for; none where there is no skew.
#[derive(Clone, Debug)]
pub(crate) struct Past<T> {
    depth: usize,
    /// Readings, newest first.
    readings: VecDeque<T>,
}

impl<T: Clone> Past<T> {
    /// Room for the readings of `depth` frames before the newest.
    pub(crate) fn new(depth: u8) -> Self {
        Past { depth: usize::from(depth), readings: VecDeque::new() }
    }

    /// Takes the reading of this frame and gives that of `frames` before it; before there was one, the oldest.
    pub(crate) fn pass(&mut self, now: T, frames: u8) -> T {
        if self.depth == 0 {
            return now;
        }
        self.readings.push_front(now.clone());
        self.readings.truncate(self.depth + 1);
        self.readings.get(usize::from(frames)).or(self.readings.back()).cloned().unwrap_or(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without a skew the newest is given.
    #[test]
    fn past_readings_are_bounded_by_room() {
        let mut past = Past::new(3);
        let shown: Vec<u32> = (0..8).map(|n| past.pass(n, if n < 4 { 0 } else { 3 })).collect();
        assert_eq!(shown, [0, 1, 2, 3, 1, 2, 3, 4]);
        assert_eq!(past.readings.len(), 4);
        assert_eq!(Past::new(2).pass(9, 2), 9, "nothing older");
        let mut none = Past::new(0);
        assert_eq!((none.pass(1, 0), none.readings.len()), (1, 0));
    }
}
