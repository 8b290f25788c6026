//! The black box: the last ticks, for the moment after something went wrong.
//!
//! A `heapless` queue of fixed capacity: pushing costs one copy of a [`Record`] and never fails; the oldest makes room.
//! It stands beside the controller, not inside it: who does not want it pays nothing.
//!
//! ```
//! use controller_core::{Health, History, Output, Record};
//! let mut history = History::<f32, 2, 3>::new();
//! for tick in 0..5 {
//!     let output = Output { u: 0.0, sigma: 0.0, sigma_star: 0.0, health: Health::OK };
//!     history.push(Record { tick, x: [0.0; 2], output });
//! }
//! assert!(history.oldest_first().map(|r| r.tick).eq([2, 3, 4]));
//! ```

use crate::controller::Output;
use heapless::Deque;

/// One tick: what came in and what went out.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Record<T, const N: usize> {
    /// Number of the tick.
    pub tick: u32,
    /// The sample, in chain coordinates.
    pub x: [T; N],
    /// What the tick returned.
    pub output: Output<T>,
}

/// The last `LEN` records.
pub struct History<T, const N: usize, const LEN: usize> {
    // Not `HistoryBuf`: its index is checked, which leaves a panic in an interrupt that pushes.
    ring: Deque<Record<T, N>, LEN>,
}

impl<T: Copy, const N: usize, const LEN: usize> History<T, N, LEN> {
    /// An empty black box; `const`, so it can be a static.
    pub const fn new() -> Self {
        Self { ring: Deque::new() }
    }

    /// Remembers one tick, forgets the oldest.
    pub fn push(&mut self, record: Record<T, N>) {
        if self.ring.is_full() {
            self.ring.pop_front();
        }
        // There is room now.
        let _ = self.ring.push_back(record);
    }

    /// The records from the oldest to the newest; `next_back` is the last one.
    pub fn oldest_first(&self) -> impl DoubleEndedIterator<Item = &Record<T, N>> {
        self.ring.iter()
    }
}

impl<T: Copy, const N: usize, const LEN: usize> Default for History<T, N, LEN> {
    fn default() -> Self {
        Self::new()
    }
}
