//! A target in this process: the firmware's side of the talk without the chip.

use std::collections::VecDeque;
use std::time::Duration;

use pil_wire::Target;

use super::{Transport, TransportError, take};

/// The wire and the target at its end. It answers at once or never, so nobody waits.
pub struct Loopback {
    target: Target,
    sent: VecDeque<u8>,
}

impl Loopback {
    /// A target that has just been powered up, and has said so.
    pub fn new() -> Self {
        let target = Target::new();
        Self { sent: target.hello().into(), target }
    }

    /// Ticks of the running design, if it ran at all: what the target counted, not what the host did.
    pub fn ticks(&self) -> u32 {
        self.target.black_box().oldest_first().last().map_or(0, |record| record.tick + 1)
    }

    /// Power off and on again: the design is gone.
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
