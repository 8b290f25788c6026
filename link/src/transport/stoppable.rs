//! A wire that a person can let go of while it says nothing.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Transport, TransportError};

/// How soon the wish to stop is heard.
const HEARD_WITHIN: Duration = Duration::from_millis(100);

/// Waits in short pieces. Once asked to stop, the first piece in which nothing comes is the end of the wire; what comes
/// in time still counts, so that a tick on its way is recorded.
pub struct Stoppable<'a, T> {
    inner: T,
    stop: &'a AtomicBool,
}

impl<'a, T> Stoppable<'a, T> {
    /// `stop` is set by Ctrl-C.
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
