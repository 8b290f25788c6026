//! The wire between a host and a controller on a chip: fixed frames, one request, one reply, in lock step.
//!
//! # Frames
//! Two sizes, little endian throughout. A word is 32 bits; a number is an `f32` carried by its bits, so that a NaN
//! crosses as it is.
//!
//! | bytes of a request | bytes of a reply | what |
//! |---|---|---|
//! | 0..2 | 0..2 | `5A E5` in a request, `5A E6` in a reply |
//! | 2 | 2 | [`VERSION`] of this page |
//! | 3 | 3 | kind |
//! | 4..8 | 4..8 | sequence number |
//! | 8..44 | 8..72 | nine words, sixteen words; those not named below are 0 |
//! | 44..48 | 72..76 | CRC-32 (ISO-HDLC, as in Ethernet and zip) of all bytes before |
//!
//! | request | kind | words | reply |
//! |---|---|---|---|
//! | Identify | 1 | | Identity |
//! | Open | 2 | n, r, mask, model as bytes; count of words; [`LAYOUT_ID`]; [`CORE_VERSION`]; design hash | Done |
//! | Load | 3 | offset, eight words | Done |
//! | Start | 4 | | Done |
//! | Tick | 5 | x_1..x_4, u that was really held (NaN: not told) | Ticked |
//! | Fault | 6 | `FA17FA17` | none: the firmware runs into an undefined instruction |
//! | Begin | 7 | turn, r, r', r'', r''' at the beginning of the coming tick | Done |
//! | Drive | 8 | counts that are lost (bits 0, 1), counts, turn, r .. r''' at its end, u that was held (NaN) | Driven |
//! | Retune | 9 | the same, of a tick before which the loaded design takes over | Driven |
//! | Observe | 10 | | Observed |
//! | Move | 11 | to a goal (1) or to rest on its way (0), turn, angle, ticks | Planned |
//! | Swap | 12 | in motion, without a jump of u (0), or at rest, without an offset W (1) | Swapped |
//! | Order | 13 | freeze (0), release (1), reset (2), record (3), end the record (4) | Done |
//! | Recall | 14 | what (below), half, from where on | Recalled |
//! | Disturb | 15 | encoders that stick (bits 0, 1), that give no count (bits 2, 3); load (N m) | Done |
//! | Prepare | 16 | rows of the next record, ticks of a row | Done |
//! | Shake | 17 | the first of eight rows; a current on top of u in each of them, A | Done |
//! | Plant | 18 | nine numbers of another stand-in | Done |
//!
//! | reply | kind | words |
//! |---|---|---|
//! | Identity | 129 | [`LAYOUT_ID`], [`CORE_VERSION`], last sequence number |
//! | Done | 130 | |
//! | Ticked | 131 | u, σ, σ*, health; d_hat, d_hat', d_hat'' of channels 1..4 |
//! | Driven | 133 | u, σ, σ*, health; whole turns; position, speed, disturbance, load of each shaft |
//! | Observed | 134 | tick, u, σ*, health and flags; turns; each shaft as in Driven; r; worst time, late ticks |
//! | Planned | 135 | first tick, count of ticks |
//! | Swapped | 136 | first tick; ticks and time that the design took; u before, u after; fingerprint |
//! | Recalled | 137 | sixteen words (below) |
//! | Refused | 132 | [`Reason`], what the target has, what the request has |
//!
//! # Lock step
//! A request is *new* if its sequence number is one more than that of the last one, a *repeat* if it is the last one to
//! the byte: then the reply was lost, and is sent again from memory without a second tick. An older one is a straggler
//! and is dropped. A later one is refused, for the target must have restarted; and so is another one with the number
//! of the last, for two programs talk to it. Identify and Identity have the same form in every version, change nothing
//! and may come at any time; a target sends one Identity unasked when it starts up.
//!
//! A design is loaded as plain numbers, a word each: d_hat_1..n at the start, the n entries of a linear a(x)/b_0 (zeros
//! for another model), and the coefficients in the order of [`controller_core::LAYOUT`]. A drive is designed by the
//! target itself, to the same bits: it is loaded as what it is designed from and what its monitors are told, numbers of
//! 64 bits in the order of [`controller_core::drive::LAYOUT`], each as its lower word and its upper one. The hash is
//! the CRC-32 of the first word of Open and of all that are loaded: the target computes it from what it holds, and
//! refuses to start another design. What runs goes on until another design has started or taken over.
//!
//! # A drive that runs by itself
//! Requests 1 to 9 are for a target that ticks when it is told to ([`Target`]), 1 to 3 and 10 to 18 for a drive whose
//! interrupt ticks ([`Live`]): it is observed, moved, recorded, and given another design while it goes on. Flags of
//! Observed: bit 8 the black box stands still, 9 the law has started, 10 the plan is on its way. What Recall gives:
//!
//! | what | half | from | words |
//! |---|---|---|---|
//! | 0 | | | first word of Open, count of words and hash of the design that runs; fingerprint of the law |
//! | 1 | | word | sixteen words of the design |
//! | 2 | 0 older, 1 newer | | first tick; number of frames, of words of the state; turn, r .. r''' at its beginning |
//! | 3 | the same | word | sixteen words of the state before the first tick |
//! | 4 | the same | frame | nine words as in Drive, u, health |
//! | 5 | | | of the record: flags (bit 0 it goes on, 1 a count was lost), first tick, rows that are whole, rows asked |
//! | | | | for, ticks of a row, health, late ticks, rows of the memory |
//! | 6 | | row | five rows of it: counts, mean of the current that was held |
//!
//! 2 to 4 are answered while the black box stands still: after an alarm, or after Order 0; 6 when the record has ended.
//!
//! A record is prepared (16), given what shakes the drive (17; nothing where nothing is given), begun and read: it is
//! in the memory of the chip, and so no line is too slow for it and none that loses frames leaves a gap in it. It lasts
//! a minute at most, and no current shakes more than the drive itself can take back: whoever sent it may be gone.
//!
//! # Garbage
//! [`Receiver`] takes any bytes. Whatever stands before a frame with the right mark and checksum is skipped; a frame
//! that follows a damaged one is not lost. Nothing here allocates, and no byte string makes it panic.
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

/// Of the tables in this page. Every change of them is a new version.
pub const VERSION: u8 = 4;
/// Bytes of a request.
pub const REQUEST_LEN: usize = 12 + 4 * REQUEST_WORDS;
/// Bytes of a reply.
pub const REPLY_LEN: usize = 12 + 4 * REPLY_WORDS;
/// Highest plant order on the wire.
pub const MAX_N: usize = 4;
/// Version of the controller, as one byte each of major, minor and patch.
pub const CORE_VERSION: u32 = controller_core::VERSION_NUMBER;
/// Most encoders of a drive on the wire.
pub const MAX_E: usize = 2;
/// CRC-32 of [`LAYOUT`] and of that of the drives: two programs that agree on it read the same design from the same
/// numbers.
pub const LAYOUT_ID: u32 = CRC.checksum(LAYOUT.as_bytes()) ^ CRC.checksum(drive::LAYOUT.as_bytes());

const REQUEST_WORDS: usize = 9;
const REPLY_WORDS: usize = 16;
/// Rows of a record that one reply carries.
pub const ROWS: usize = REPLY_WORDS / (MAX_E + 1);
/// Words that one Load carries.
pub const LOAD: usize = REQUEST_WORDS - 1;
const MARK: u8 = 0x5A;
const FAULT: u32 = 0xFA17_FA17;
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// CRC-32 (ISO-HDLC) of any bytes: the checksum of frames, for what else must be told apart.
pub const fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// Hash of a design: the CRC-32 of the first word of Open and of all that are loaded.
pub fn design_hash(instance: Instance, words: &[u32]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&instance.word().to_le_bytes());
    for word in words {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

/// A number of 64 bits as the wire carries it: its lower word, its upper one.
pub const fn halves(number: f64) -> [u32; 2] {
    let bits = number.to_bits();
    [bits as u32, (bits >> 32) as u32]
}
