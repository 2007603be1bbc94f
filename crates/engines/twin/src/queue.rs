//! The one event queue: ties are broken by (time, node, counter), so the order is the same on every run.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// True time of the twin, microseconds from the start of the run. No core ever sees it.
pub type Micros = u64;

/// Position of a node in the twin's table.
pub type NodeIndex = u8;

#[derive(Clone, Debug)]
struct Entry<E> {
    key: (Micros, NodeIndex, u64),
    event: E,
}

impl<E> PartialEq for Entry<E> {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl<E> Eq for Entry<E> {}

impl<E> PartialOrd for Entry<E> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl<E> Ord for Entry<E> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key.cmp(&other.key)
    }
}

/// Events waiting for their time.
#[derive(Clone, Debug)]
pub struct Queue<E> {
    heap: BinaryHeap<Reverse<Entry<E>>>,
    counter: u64,
}

impl<E> Default for Queue<E> {
    fn default() -> Self {
        Self { heap: BinaryHeap::new(), counter: 0 }
    }
}

impl<E> Queue<E> {
    /// Adds an event for `node` at `time`.
    pub fn push(&mut self, time: Micros, node: NodeIndex, event: E) {
        self.counter += 1;
        self.heap.push(Reverse(Entry { key: (time, node, self.counter), event }));
    }

    /// Time at which the next event is due.
    pub fn next_time(&self) -> Option<Micros> {
        self.heap.peek().map(|Reverse(e)| e.key.0)
    }

    /// Takes the next event.
    pub fn pop(&mut self) -> Option<(Micros, NodeIndex, E)> {
        self.heap.pop().map(|Reverse(e)| (e.key.0, e.key.1, e.event))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_break_by_node_then_arrival() {
        let mut queue = Queue::default();
        queue.push(5, 2, 'c');
        queue.push(5, 1, 'a');
        queue.push(5, 1, 'b');
        queue.push(4, 9, 'z');
        let order: String = std::iter::from_fn(|| queue.pop()).map(|(_, _, e)| e).collect();
        assert_eq!(order, "zabc");
    }
}
