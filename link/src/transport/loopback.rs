//! Target in this process: the firmware side of the protocol without the chip.

use std::collections::VecDeque;
use std::time::Duration;

use pil_wire::Target;

use super::{Transport, TransportError, take};

/// Link with the target at its end. It answers at once or never, without waiting.
pub struct Loopback {
    target: Target,
    sent: VecDeque<u8>,
}

impl Loopback {
    /// Returns a target after power-up, with its start-up message.
    pub fn new() -> Self {
        let target = Target::new();
        Self { sent: target.hello().into(), target }
    }

    /// Returns the number of ticks of the running design, as the target counts them.
    pub fn ticks(&self) -> u32 {
        self.target.black_box().oldest_first().last().map_or(0, |record| record.tick + 1)
    }

    /// Restarts the target. Its design is lost.
    pub fn restart(&mut self) {
        *self = Self::new();
    }
}

impl Default for Loopback {
    fn default() -> Self {
        Self::new()
    }
}

impl Transport for Loopback {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        for &byte in bytes {
            self.sent.extend(self.target.receive(byte).into_iter().flatten());
        }
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _within: Duration) -> Result<usize, TransportError> {
        Ok(take(&mut self.sent, into))
    }
}
