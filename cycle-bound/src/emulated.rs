//! Execution trace of a firmware from the emulator; the typical cycles are counted from it.
//!
//! The emulated clock advances by one nanosecond per instruction. The emulator logs the address of every executed
//! instruction in the requested ranges. The run ends when the last word of the firmware's log is `ends`, `done` or
//! `stopped`. Otherwise it ends after a time or size limit.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::thread::sleep;
use std::time::{Duration, Instant};

use whole_file::FileKind;

use crate::log::{Log, Messages};
use crate::qemu::{Clock, Process, Trace, is_last};
use crate::trace;

/// Trace size that ends the run of a firmware without a last word, bytes: about two million instructions.
const ENOUGH_BYTES: u64 = 200 << 20;
/// Run time that ends the run of a firmware without a last word.
const ENOUGH_TIME: Duration = Duration::from_secs(30);
/// Polling interval of the run.
const GLANCE: Duration = Duration::from_millis(20);

/// Returns the executed addresses within `ranges`, in the order of execution.
///
/// # Errors
/// The emulator or the firmware is missing or unusable, or `stop` was set.
pub fn executed(image: &Path, ranges: &[(u32, u32)], stop: &AtomicBool) -> Result<Vec<u32>, String> {
    let scratch = whole_file::scratch().map_err(|error| format!("the trace file cannot be created: {error}"))?;
    // A firmware without defmt messages runs too, but ends by the time or size limit only.
    let messages = Messages::of(image).ok();
    let trace = Trace { ranges, file: scratch.path() };
    let (process, [_, stream]) = Process::start(image, [false, messages.is_some()], Clock::Instructions, Some(trace))?;
    let log = stream.zip(messages).map(|(stream, messages)| Log::follow(stream, messages));
    let until = Instant::now() + ENOUGH_TIME;
    loop {
        if stop.load(Ordering::Relaxed) {
            return Err("stopped on request".into());
        }
        let ended = if let Some(log) = &log {
            match log.wait(GLANCE) {
                Ok(line) => is_last(&line),
                Err(RecvTimeoutError::Timeout) => false,
                Err(RecvTimeoutError::Disconnected) => return Err(process.ended("the emulator is gone")),
            }
        } else {
            sleep(GLANCE);
            false
        };
        let size = std::fs::metadata(&scratch).map_or(0, |about| about.len());
        if ended || Instant::now() > until || size > ENOUGH_BYTES {
            break;
        }
    }
    drop(process);
    let text =
        whole_file::read(scratch.path(), FileKind::TRACE).map_err(|why| format!("the trace of the emulator: {why}"))?;
    Ok(trace::addresses(&String::from_utf8_lossy(&text)))
}
