//! Ctrl-C and the other requests to end: SIGINT, SIGTERM, SIGHUP.
//!
//! A request ends the program at once, unless it [keeps](keeping) a record that would be lost. Then it sets a flag,
//! which the loop that [looks](looking) for it must see within [`SEEN_WITHIN`]: else it is blocked, by a reader that
//! does not read say, and ends the same way; so does what is still there after that time with its record kept. A second
//! request ends it in any case. A program that ends without a record says so. Files are written whole or not at
//! all, so nothing is left half done; emulators end with the program.

use std::io::{IsTerminal, Write, stderr};
use std::process::exit;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Mutex, PoisonError};
use std::thread::{sleep, spawn};
use std::time::Duration;

/// Exit status of a program that was told to end.
pub const STATUS: u8 = 130;
/// Longest that a loop may go on without seeing that it is to end.
pub const SEEN_WITHIN: Duration = Duration::from_secs(5);

static KEEPERS: AtomicUsize = AtomicUsize::new(0);
static LOOPS: AtomicUsize = AtomicUsize::new(0);
static LAST_CALLS: Mutex<Vec<fn()>> = Mutex::new(Vec::new());

/// Counts as long as it lives.
#[must_use]
pub struct Guard(&'static AtomicUsize);

impl Guard {
    fn of(count: &'static AtomicUsize) -> Self {
        count.fetch_add(1, Ordering::SeqCst);
        Self(count)
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

/// While this lives there is a record to be kept, and the first request to end only sets the flag.
pub fn keeping() -> Guard {
    Guard::of(&KEEPERS)
}

/// While this lives the flag is looked at all the time.
pub fn looking() -> Guard {
    Guard::of(&LOOPS)
}

/// Calls `last` before an exit on request, for example to end child processes. Registers each function once.
pub fn before_exit(last: fn()) {
    let mut calls = LAST_CALLS.lock().unwrap_or_else(PoisonError::into_inner);
    if !calls.iter().any(|call| std::ptr::fn_addr_eq(*call, last)) {
        calls.push(last);
    }
}

/// Sets `flag` when the program is told to end, and ends it if nobody looks.
pub fn on_request(flag: &'static AtomicBool) {
    // Without a handler a request still ends the program; an emulator dies with it, and only the record is lost.
    let _ = ctrlc::set_handler(|| {
        if flag.swap(true, Ordering::SeqCst) || KEEPERS.load(Ordering::SeqCst) == 0 {
            end();
        }
        spawn(|| {
            sleep(SEEN_WITHIN);
            while LOOPS.load(Ordering::SeqCst) == 0 && KEEPERS.load(Ordering::SeqCst) > 0 {
                sleep(Duration::from_millis(100));
            }
            end();
        });
    });
}

/// What is said where no record is kept.
const LOST: &str = "stopped on request; what was not written yet is lost";
/// Nobody waits longer for a terminal or pipe that takes no more.
const TOLD_WITHIN: Duration = Duration::from_millis(100);

fn end() {
    // The lock is free before the first call: a call may register another.
    let calls = LAST_CALLS.lock().unwrap_or_else(PoisonError::into_inner).clone();
    for call in calls {
        call();
    }
    let (tell, told) = channel();
    spawn(move || {
        // A progress bar stands on the line.
        let line = if stderr().is_terminal() { "\n" } else { "" };
        _ = writeln!(stderr(), "{line}{LOST}");
        _ = tell.send(());
    });
    _ = told.recv_timeout(TOLD_WITHIN);
    exit(i32::from(STATUS));
}
