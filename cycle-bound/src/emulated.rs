//! What an image executes, from the emulator: the trace that typical cycles are counted from.
//!
//! The image runs by the clock of its instructions, one a nanosecond, and the emulator writes down the address
//! of every instruction within the functions that are asked about. It ends when the image says so in its log (a last
//! word `ends`, `done` or `stopped`), and otherwise when there is enough.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::thread::sleep;
use std::time::{Duration, Instant};

use whole_file::Kind;

use crate::log::{Log, Messages};
use crate::qemu::{Clock, Process, Trace, is_last};
use crate::trace;

/// An image that does not end by itself has said enough when its trace is as large as this: two million instructions.
const ENOUGH_BYTES: u64 = 200 << 20;
/// Nor does a function that is never called keep anyone waiting for longer.
const ENOUGH_TIME: Duration = Duration::from_secs(30);
/// How often it is looked at.
const GLANCE: Duration = Duration::from_millis(20);

/// Addresses within `ranges` in the order in which the image executes them.
///
/// # Errors
/// When the emulator or the image is missing or no good; when told to `stop`.
pub fn executed(image: &Path, ranges: &[(u32, u32)], stop: &AtomicBool) -> Result<Vec<u32>, String> {
    let scratch = whole_file::scratch().map_err(|error| format!("no place for a trace: {error}"))?;
    // An image that logs nothing of ours runs as well: it only cannot say when it ends.
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
        whole_file::read(scratch.path(), Kind::TRACE).map_err(|why| format!("the trace of the emulator: {why}"))?;
    Ok(trace::addresses(&String::from_utf8_lossy(&text)))
}
