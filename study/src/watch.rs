//! Progress of a long computation, and the request to stop it.

use std::sync::atomic::{AtomicBool, Ordering};

/// Progress callback and stop request of a computation.
///
/// A computation that is stopped returns `None`.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    stop: &'a AtomicBool,
    done: &'a (dyn Fn() + Sync),
}

static NEVER: AtomicBool = AtomicBool::new(false);

impl<'a> Watch<'a> {
    /// Returns a watch without progress and without a stop request.
    pub const fn none() -> Self {
        Self { stop: &NEVER, done: &|| () }
    }

    /// Calls `done` after each point, evaluation or trial, from any thread, until `stop` is set.
    pub const fn new(stop: &'a AtomicBool, done: &'a (dyn Fn() + Sync)) -> Self {
        Self { stop, done }
    }

    /// Returns whether the computation must stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Reports that one more piece of work is done.
    pub fn done(&self) {
        (self.done)();
    }
}
