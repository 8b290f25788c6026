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

#[cfg(test)]
mod tests {
    use super::*;

    /// Never says anything.
    struct Silent;

    impl Transport for Silent {
        fn send(&mut self, _: &[u8]) -> Result<(), TransportError> {
            Ok(())
        }

        fn receive(&mut self, _: &mut [u8], within: Duration) -> Result<usize, TransportError> {
            std::thread::sleep(within);
            Ok(0)
        }
    }

    #[test]
    fn a_long_silence_ends_soon_after_the_wish_to_stop_and_a_short_one_in_time() {
        let stop = AtomicBool::new(false);
        let mut wire = Stoppable::new(Silent, &stop);
        assert_eq!(wire.receive(&mut [0; 8], Duration::from_millis(1)), Ok(0));
        stop.store(true, Ordering::Relaxed);
        let began = Instant::now();
        assert!(wire.receive(&mut [0; 8], Duration::from_secs(50)).is_err());
        assert!(began.elapsed() < Duration::from_secs(10));
    }
}
