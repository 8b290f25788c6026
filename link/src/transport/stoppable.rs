//! Link that can be interrupted while it receives nothing.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Transport, TransportError};

/// Longest delay of a stop request.
const HEARD_WITHIN: Duration = Duration::from_millis(100);

/// Link that waits in short intervals. After a stop request the first interval without bytes ends the link. Bytes that
/// arrive in time still count, so that a tick in progress is recorded.
pub struct Stoppable<'a, T> {
    inner: T,
    stop: &'a AtomicBool,
}

impl<'a, T> Stoppable<'a, T> {
    /// Wraps `inner`. Ctrl-C sets `stop`.
    pub const fn new(inner: T, stop: &'a AtomicBool) -> Self {
        Self { inner, stop }
    }
}

impl<T: Transport> Transport for Stoppable<'_, T> {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.inner.send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        let until = Instant::now() + within;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let count = self.inner.receive(into, left.min(HEARD_WITHIN))?;
            if count > 0 {
                return Ok(count);
            }
            if self.stop.load(Ordering::Relaxed) {
                return Err(TransportError("stopped on request".into()));
            }
            if Instant::now() >= until {
                return Ok(0);
            }
        }
    }
}
