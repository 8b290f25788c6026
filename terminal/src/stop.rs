//! Termination requests: Ctrl-C and the signals SIGINT, SIGTERM and SIGHUP.
//!
//! A request ends the program at once, unless the program [keeps](keeping) a record that would be lost. Then the
//! request sets a flag. A loop that [looks](looking) for the flag must react within [`SEEN_WITHIN`]. A loop that does
//! not is blocked, for example by a reader that does not read, and the program ends. The program also ends if it still
//! runs after that time with its record kept.
//!
//! A second request ends the program in any case. A program that ends without a record prints a message. Files are
//! written whole or not at all, so no partial file remains. Emulators end with the program.

use std::io::{IsTerminal, Write, stderr};
use std::process::exit;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Mutex, PoisonError};
use std::thread::{sleep, spawn};
use std::time::Duration;

/// Exit status of a program that ends on request.
pub const STATUS: u8 = 130;
/// Longest time in which a loop must react to a request.
pub const SEEN_WITHIN: Duration = Duration::from_secs(5);

static KEEPERS: AtomicUsize = AtomicUsize::new(0);
static LOOPS: AtomicUsize = AtomicUsize::new(0);
static LAST_CALLS: Mutex<Vec<fn()>> = Mutex::new(Vec::new());

/// Guard that counts while it lives.
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

/// Marks a record to be kept. While the guard lives, the first request only sets the flag.
pub fn keeping() -> Guard {
    Guard::of(&KEEPERS)
}

/// Marks a loop that polls the flag while the guard lives.
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

/// Sets `flag` on a request to end. Ends the program if no loop reacts.
pub fn on_request(flag: &'static AtomicBool) {
    // Without a handler a request still ends the program and its emulator. Only the record is lost.
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

/// Message if no record is kept.
const LOST: &str = "stopped on request; unwritten results are lost";
/// Longest wait for a terminal or pipe that accepts no more output.
const TOLD_WITHIN: Duration = Duration::from_millis(100);

fn end() {
    // The lock is released before the first call, because a call may register another.
    let calls = LAST_CALLS.lock().unwrap_or_else(PoisonError::into_inner).clone();
    for call in calls {
        call();
    }
    let (tell, told) = channel();
    spawn(move || {
        // The line may hold a progress bar.
        let line = if stderr().is_terminal() { "\n" } else { "" };
        _ = writeln!(stderr(), "{line}{LOST}");
        _ = tell.send(());
    });
    _ = told.recv_timeout(TOLD_WITHIN);
    exit(i32::from(STATUS));
}
