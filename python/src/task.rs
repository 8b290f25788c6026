//! A computation in a thread, without the lock of the interpreter.
//!
//! The calling thread looks for a signal and reports progress every few hundredths of a second. After a signal it asks
//! the computation to stop and returns at once. A computation without a stop request ends by itself, unheard.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use study::Watch;

/// Time between two looks for a signal. A request to stop is answered within 0.2 s.
const LOOK: Duration = Duration::from_millis(40);

/// Progress and stop request of a computation.
#[derive(Default)]
pub(crate) struct Shared {
    stop: AtomicBool,
    done: AtomicU64,
}

impl Shared {
    /// Calls a study with a watch.
    pub(crate) fn watched<T>(&self, study: impl FnOnce(Watch<'_>) -> T) -> T {
        study(Watch::new(&self.stop, &|| self.done()))
    }

    pub(crate) fn done(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Runs `work` in a thread and returns its result. `progress` gets the number of finished pieces.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Shared) -> T + Send + 'static,
) -> PyResult<T> {
    let shared = Arc::new(Shared::default());
    let (sender, mut receiver) = channel();
    let theirs = shared.clone();
    let thread = thread::Builder::new().name("edo_smc".into());
    thread.spawn(move || {
        // After a signal there is no receiver.
        _ = sender.send(work(&theirs));
    })?;
    let mut told = 0;
    loop {
        let (found, back) = py.detach(move || (receiver.recv_timeout(LOOK), receiver));
        receiver = back;
        let asked = py.check_signals().and_then(|()| {
            let done = shared.done.load(Ordering::Relaxed);
            let Some(progress) = progress.filter(|_| done != told) else { return Ok(()) };
            told = done;
            progress.call1((done,)).map(drop)
        });
        if let Err(signal) = asked {
            shared.stop.store(true, Ordering::Relaxed);
            return Err(signal);
        }
        match found {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the computation panicked; its message is on stderr"));
            }
        }
    }
}
