//! Module behind the live page: it translates between JSON and the crates of edo-smc, and computes nothing of its own.
//!
//! | module | content |
//! |---|---|
//! | `request` | requests of the page, and the text of a scenario |
//! | `design` | margins, poles and the whole design |
//! | `run` | runs, and a change of the design while a run goes on |
//! | `rivals` | other controllers on equal runs, tuned with equal effort |
//! | `bits` | hash over every bit of the results |
//!
//! The page writes a request into [`buffer`], calls [`answer`], and reads the answer at [`address`]. Every answer is a
//! JSON object: with the key `error` for a request without a result.

use std::cell::RefCell;

mod bits;
mod design;
mod request;
mod rivals;
mod run;

pub use bits::hashes;

thread_local! {
    /// Request, and then its answer. The host of the module has one thread.
    static BUFFER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Answers a request in JSON.
pub fn answer_to(request: &str) -> String {
    request::answer(request)
}

/// Makes room for a request of this length in bytes and returns its address.
// The exported name cannot clash: the module has only the functions of this file.
#[unsafe(no_mangle)]
pub extern "C" fn buffer(length: usize) -> *mut u8 {
    BUFFER.with_borrow_mut(|buffer| {
        buffer.clear();
        buffer.resize(length, 0);
        buffer.as_mut_ptr()
    })
}

/// Answers the request in the buffer and returns the length of the answer in bytes.
// The exported name cannot clash: the module has only the functions of this file.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> usize {
    let request = BUFFER.take();
    let answer = answer_to(&String::from_utf8_lossy(&request));
    BUFFER.replace(answer.into_bytes());
    BUFFER.with_borrow(Vec::len)
}

/// Returns the address of the answer. It is valid until the next call.
// The exported name cannot clash: the module has only the functions of this file.
#[unsafe(no_mangle)]
pub extern "C" fn address() -> *const u8 {
    BUFFER.with_borrow(Vec::as_ptr)
}
