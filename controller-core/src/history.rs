//! Trace buffer with the last ticks, to be read after a fault.
//!
//! It is a `heapless` queue of fixed capacity. A push costs one copy of a [`Record`] and never fails: the oldest record
//! makes room. The buffer is separate from the controller, so it costs nothing if it is not used.
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

/// One tick: sample and output.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Record<T, const N: usize> {
    /// Number of the tick.
    pub tick: u32,
    /// Sample, in chain coordinates.
    pub x: [T; N],
    /// Output of the tick.
    pub output: Output<T>,
}

/// Trace buffer with the last `LEN` records.
pub struct History<T, const N: usize, const LEN: usize> {
    // Not `HistoryBuf`: its index is checked, which leaves a panic in an interrupt that pushes.
    ring: Deque<Record<T, N>, LEN>,
}

impl<T: Copy, const N: usize, const LEN: usize> History<T, N, LEN> {
    /// Returns an empty trace buffer. The function is `const`, so the buffer can be a static.
    pub const fn new() -> Self {
        Self { ring: Deque::new() }
    }

    /// Stores one tick and drops the oldest one if the buffer is full.
    pub fn push(&mut self, record: Record<T, N>) {
        if self.ring.is_full() {
            self.ring.pop_front();
        }
        // The buffer has room at this point.
        let _ = self.ring.push_back(record);
    }

    /// Returns the records from the oldest to the newest. `next_back` is the newest.
    pub fn oldest_first(&self) -> impl DoubleEndedIterator<Item = &Record<T, N>> {
        self.ring.iter()
    }
}

impl<T: Copy, const N: usize, const LEN: usize> Default for History<T, N, LEN> {
    fn default() -> Self {
        Self::new()
    }
}
