//! Serial protocol between a host and a controller on a chip: fixed frames in lock step, with one reply for each
//! request.
//!
//! # Frames
//! There are two sizes, both little endian. A word has 32 bits. A number is an `f32` that is sent as its bits, so a NaN
//! is preserved.
//!
//! | bytes of a request | bytes of a reply | content |
//! |---|---|---|
//! | 0..2 | 0..2 | `5A E5` in a request, `5A E6` in a reply |
//! | 2 | 2 | [`VERSION`] of this page |
//! | 3 | 3 | kind |
//! | 4..8 | 4..8 | sequence number |
//! | 8..44 | 8..72 | nine words in a request, sixteen in a reply; words not named below are 0 |
//! | 44..48 | 72..76 | CRC-32 (ISO-HDLC, as in Ethernet and zip) of all bytes before |
//!
//! | request | kind | words | reply |
//! |---|---|---|---|
//! | Identify | 1 | | Identity |
//! | Open | 2 | n, r, mask, model as bytes; count of words; [`LAYOUT_ID`]; [`CORE_VERSION`]; design hash | Done |
//! | Load | 3 | offset, eight words | Done |
//! | Start | 4 | | Done |
//! | Tick | 5 | x_1..x_4, u held by the actuator (NaN: not reported) | Ticked |
//! | Fault | 6 | `FA17FA17` | none: the firmware runs into an undefined instruction |
//! | Begin | 7 | turn, r, r', r'', r''' at the beginning of the coming tick | Done |
//! | Drive | 8 | lost counts (bits 0, 1), counts, turn, r .. r''' at its end, u held (NaN: not reported) | Driven |
//! | Retune | 9 | as Drive; the loaded design takes over before this tick | Driven |
//! | Observe | 10 | | Observed |
//! | Move | 11 | to a goal (1) or to the nearest reachable rest (0), turn, angle, ticks | Planned |
//! | Swap | 12 | in motion, without a jump of u (0), or at rest, without an offset W (1) | Swapped |
//! | Order | 13 | freeze (0), release (1), reset (2), record (3), end the record (4) | Done |
//! | Recall | 14 | part (below), half, first index | Recalled |
//! | Disturb | 15 | frozen encoders (bits 0, 1), lost counts (bits 2, 3); load (N m) and its ticks (0: no end) | Done |
//! | Prepare | 16 | rows of the next record, ticks of a row | Done |
//! | Shake | 17 | the first of eight rows; the excitation in each of them, added to u, A | Done |
//! | Plant | 18 | nine numbers of another simulated plant | Done |
//!
//! | reply | kind | words |
//! |---|---|---|
//! | Identity | 129 | [`LAYOUT_ID`], [`CORE_VERSION`], last sequence number |
//! | Done | 130 | |
//! | Ticked | 131 | u, σ, σ*, health; d_hat, d_hat', d_hat'' of channels 1..4 |
//! | Driven | 133 | u, σ, σ*, health; whole revolutions; position, speed, disturbance, load of each shaft |
//! | Observed | 134 | tick, u, σ*, health and flags; revolutions; each shaft as in Driven; r; worst time, late ticks |
//! | Planned | 135 | first tick, count of ticks |
//! | Swapped | 136 | first tick; ticks and time of the computation; u before, u after; fingerprint |
//! | Recalled | 137 | sixteen words (below) |
//! | Refused | 132 | [`Reason`], value of the target, value of the request |
//!
//! # Lock step
//! A request is *new* if its sequence number is one more than the last. It is a *repeat* if it equals the last request
//! to the byte. Then the reply was lost, and the target sends it again from memory without a second tick. An older
//! request is a straggler and is dropped.
//!
//! A later number is refused, because the target must have restarted. A different request with the last number is also
//! refused, because two programs use the target. Identify and Identity have the same form in every version, change
//! nothing and may come at any time. A target sends one Identity unasked at start-up.
//!
//! A design is loaded as plain numbers, one word each. They are d_hat_1..n at the start, the n entries of a linear
//! a(x)/b_0 (zeros for another model), and the coefficients in the order of [`controller_core::LAYOUT`]. The target
//! itself designs a drive, with bit-identical results. It loads the design parameters and the limits of the monitors.
//! These are numbers of 64 bits in the order of [`controller_core::drive::LAYOUT`], each as its lower word and its
//! upper word.
//!
//! The hash is the CRC-32 of the first word of Open and of all loaded words. The target computes the hash from its
//! memory and refuses to start a design with another hash. The running design goes on until another design has started
//! or taken over.
//!
//! # Drives with their own interrupt
//! Requests 1 to 9 are for a [`Target`], which ticks on request. Requests 1 to 3 and 10 to 18 are for a [`Live`] drive,
//! whose interrupt ticks. The host observes it, moves it, records it, and changes its design while it runs. The flags
//! of Observed are: bit 8 the trace buffer is frozen, 9 the controller has started, 10 the plan has not reached its
//! goal. Recall returns:
//!
//! | part | half | first | words |
//! |---|---|---|---|
//! | 0 | | | first word of Open, number of words and hash of the running design; fingerprint of the controller |
//! | 1 | | word | sixteen words of the design |
//! | 2 | 0 older, 1 newer | | first tick; number of frames, of words of the state; turn, r .. r''' at its beginning |
//! | 3 | 0, 1 | word | sixteen words of the state before the first tick |
//! | 4 | 0, 1 | frame | nine words as in Drive, u, health |
//! | 5 | | | record: flags (bit 0 in progress, 1 a count was lost), first tick, whole rows, requested rows, |
//! | | | | ticks per row, health, late ticks, rows of the memory |
//! | 6 | | row | five rows of the record: counts, mean of the held current |
//!
//! Parts 2 to 4 are available while the trace buffer is frozen: after an alarm, or after Order 0. Part 6 is available
//! when the record has ended.
//!
//! A record is prepared (16), gets its excitation (17, none by default), begins, and is read. It is in the memory of
//! the chip, so a slow link does not limit it and a lost frame leaves no gap. A record lasts at most a minute, because
//! its host may be gone. For the same reason the excitation never exceeds the current that the drive itself can
//! compensate.
//!
//! # Invalid bytes
//! [`Receiver`] accepts any bytes. Bytes before a frame with a valid mark and checksum are skipped, and a frame after a
//! damaged frame is not lost. The crate never allocates, and no byte string makes it panic.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod drives;
mod frame;
mod live;
mod receiver;
mod running;
mod session;
mod target;
mod track;

pub use drives::Tuned;
pub use frame::{
    Counts, Disturbance, Driven, Identity, Instance, Model, Observed, Open, Order, Part, Plant, RETUNE_ERRORS, Reason,
    Refusal, Reply, Request, Swapped, Ticked,
};
pub use live::{Live, Machine, REMEMBERED, Seat};
pub use receiver::Receiver;
pub use target::{Event, Target};
pub use track::{Row, Tracked};

use controller_core::{LAYOUT, drive};
use crc::{CRC_32_ISO_HDLC, Crc};

/// Version of the tables in this page. Every change of a table is a new version.
pub const VERSION: u8 = 4;
/// Size of a request, bytes.
pub const REQUEST_LEN: usize = 12 + 4 * REQUEST_WORDS;
/// Size of a reply, bytes.
pub const REPLY_LEN: usize = 12 + 4 * REPLY_WORDS;
/// Highest plant order in the protocol.
pub const MAX_N: usize = 4;
/// Version of the controller, as one byte each of major, minor and patch.
pub const CORE_VERSION: u32 = controller_core::VERSION_NUMBER;
/// Largest number of encoders of a drive in the protocol.
pub const MAX_E: usize = 2;
/// CRC-32 of [`LAYOUT`] and of the layout of the drives. Two programs with the same value read the same design from the
/// same numbers.
pub const LAYOUT_ID: u32 = CRC.checksum(LAYOUT.as_bytes()) ^ CRC.checksum(drive::LAYOUT.as_bytes());

const REQUEST_WORDS: usize = 9;
const REPLY_WORDS: usize = 16;
/// Number of record rows in one reply.
pub const ROWS: usize = REPLY_WORDS / (MAX_E + 1);
/// Number of words in one Load.
pub const LOAD: usize = REQUEST_WORDS - 1;
const MARK: u8 = 0x5A;
const FAULT: u32 = 0xFA17_FA17;
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Returns the CRC-32 (ISO-HDLC) of any bytes, the checksum of frames.
pub const fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// Returns the hash of a design: the CRC-32 of the first word of Open and of all loaded words.
pub fn design_hash(instance: Instance, words: &[u32]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&instance.word().to_le_bytes());
    for word in words {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

/// Splits a number of 64 bits into its lower and upper word.
pub const fn halves(number: f64) -> [u32; 2] {
    let bits = number.to_bits();
    [bits as u32, (bits >> 32) as u32]
}
