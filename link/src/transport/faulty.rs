//! Link with faults: frames are lost, damaged, cut, doubled and delayed in both directions, at given rates and with a
//! seed.
//!
//! Each fault strikes each frame independently, so one frame may be cut and doubled. A delayed frame arrives after one
//! to three later frames of its direction, behind the repetition that it caused. Bytes from the target outside of
//! frames are dropped.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use loop_sim::random::Random;
use pil_wire::{REPLY_LEN, Receiver};

use super::{Transport, TransportError, take};

/// Probability of each fault per frame, 0..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Probability of a lost frame.
    pub drop: f64,
    /// Probability of one flipped bit.
    pub corrupt: f64,
    /// Probability of a truncated frame.
    pub truncate: f64,
    /// Probability of a doubled frame.
    pub duplicate: f64,
    /// Probability of a delayed frame.
    pub delay: f64,
}

impl Rates {
    /// Returns the same rate for every fault.
    pub const fn all(rate: f64) -> Self {
        Self { drop: rate, corrupt: rate, truncate: rate, duplicate: rate, delay: rate }
    }
}

/// Counters of the faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Struck {
    /// Number of lost frames.
    pub dropped: u64,
    /// Number of frames with a flipped bit.
    pub corrupted: u64,
    /// Number of truncated frames.
    pub truncated: u64,
    /// Number of doubled frames.
    pub duplicated: u64,
    /// Number of delayed frames.
    pub delayed: u64,
}

/// Link with injected faults.
pub struct Faulty<T> {
    inner: T,
    requests: Direction,
    replies: Direction,
    /// Receiver that finds the replies in the bytes of the inner link.
    receiver: Receiver<REPLY_LEN>,
    /// Bytes after the faults.
    passed: VecDeque<u8>,
}

impl<T> Faulty<T> {
    /// Wraps `inner` with the same rates in both directions.
    pub fn new(inner: T, rates: Rates, seed: u64) -> Self {
        Self {
            inner,
            requests: Direction::new(rates, seed, 0x70),
            replies: Direction::new(rates, seed, 0x71),
            receiver: Receiver::of_replies(),
            passed: VecDeque::new(),
        }
    }

    /// Returns the inner link.
    pub const fn inner(&self) -> &T {
        &self.inner
    }

    /// Returns the counters of the requests and of the replies.
    pub const fn struck(&self) -> [Struck; 2] {
        [self.requests.struck, self.replies.struck]
    }
}

impl<T: Transport> Transport for Faulty<T> {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        let Self { inner, requests, .. } = self;
        requests.pass(bytes).iter().try_for_each(|frame| inner.send(frame))
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        let until = Instant::now() + within;
        // Bytes of the inner link may be lost here, so the wait goes on.
        while self.passed.is_empty() {
            let mut bytes = [0; 4 * REPLY_LEN];
            let left = until.saturating_duration_since(Instant::now());
            let count = if left.is_zero() { 0 } else { self.inner.receive(&mut bytes, left)? };
            if count == 0 {
                return Ok(0);
            }
            for &byte in &bytes[..count] {
                if let Some(frame) = self.receiver.push(byte) {
                    self.passed.extend(self.replies.pass(&frame).into_iter().flatten());
                }
            }
        }
        Ok(take(&mut self.passed, into))
    }
}

/// One direction of the link.
struct Direction {
    rates: Rates,
    random: Random,
    /// Delayed frames, each with the number of frames that still pass before it.
    held: Vec<(u32, Vec<u8>)>,
    struck: Struck,
}

impl Direction {
    fn new(rates: Rates, seed: u64, stream: u64) -> Self {
        Self { rates, random: Random::new(seed, stream), held: Vec::new(), struck: Struck::default() }
    }

    /// Returns the frames that leave after this frame enters.
    fn pass(&mut self, frame: &[u8]) -> Vec<Vec<u8>> {
        let Self { rates, random, held, struck } = self;
        // All faults are drawn for every frame, so that the rate of one fault does not depend on the others.
        let mut strikes = |rate: f64, count: &mut u64| {
            let strikes = random.uniform() <= rate;
            *count += u64::from(strikes);
            strikes
        };
        let drop = strikes(rates.drop, &mut struck.dropped);
        let corrupt = strikes(rates.corrupt, &mut struck.corrupted);
        let truncate = strikes(rates.truncate, &mut struck.truncated);
        let duplicate = strikes(rates.duplicate, &mut struck.duplicated);
        let delay = strikes(rates.delay, &mut struck.delayed);
        // Returns an integer below `end`.
        let mut below = |end: usize| ((random.uniform() * end as f64).ceil() as usize).saturating_sub(1);
        let (bit, len, wait) = (below(8 * frame.len()), below(frame.len()), below(3));

        let mut bytes = frame.to_vec();
        if corrupt && let Some(byte) = bytes.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
        if truncate {
            bytes.truncate(len);
        }
        let mut out = Vec::new();
        if !drop && !delay {
            out.push(bytes.clone());
        }
        for (others, late) in &mut *held {
            if *others == 0 {
                out.push(std::mem::take(late));
            }
            *others = others.saturating_sub(1);
        }
        held.retain(|(_, late)| !late.is_empty());
        if duplicate && !drop {
            out.push(bytes.clone());
        }
        if delay && !drop {
            held.push((wait as u32, bytes));
        }
        out
    }
}
