//! A bad wire: frames are lost, damaged, cut, doubled and late, in both directions, at rates and by a seed.
//!
//! Each fault strikes each frame on its own, so that one frame may be cut and doubled. A late frame comes after one to
//! three later ones of its direction: it is then a straggler behind the repetition that it caused. Bytes of the target
//! that belong to no frame do not come through.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use loop_sim::random::Random;
use pil_wire::{REPLY_LEN, Receiver};

use super::{Transport, TransportError, take};

/// Probability of each fault, per frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// The frame vanishes.
    pub drop: f64,
    /// One bit of it is another.
    pub corrupt: f64,
    /// It ends early.
    pub truncate: f64,
    /// It comes twice.
    pub duplicate: f64,
    /// It comes after later ones.
    pub delay: f64,
}

impl Rates {
    /// Every fault at the same rate.
    pub const fn all(rate: f64) -> Self {
        Self { drop: rate, corrupt: rate, truncate: rate, duplicate: rate, delay: rate }
    }
}

/// How often each fault struck.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Struck {
    /// Frames that vanished.
    pub dropped: u64,
    /// Frames with a bit changed.
    pub corrupted: u64,
    /// How many frames were cut.
    pub truncated: u64,
    /// Frames sent twice.
    pub duplicated: u64,
    /// Frames held back.
    pub delayed: u64,
}

/// A wire with faults.
pub struct Faulty<T> {
    inner: T,
    requests: Direction,
    replies: Direction,
    /// Finds the replies in what the inner wire brings.
    receiver: Receiver<REPLY_LEN>,
    /// Bytes that have passed the faults.
    passed: VecDeque<u8>,
}

impl<T> Faulty<T> {
    /// The same rates in both directions.
    pub fn new(inner: T, rates: Rates, seed: u64) -> Self {
        Self {
            inner,
            requests: Direction::new(rates, seed, 0x70),
            replies: Direction::new(rates, seed, 0x71),
            receiver: Receiver::of_replies(),
            passed: VecDeque::new(),
        }
    }

    /// The wire below.
    pub const fn inner(&self) -> &T {
        &self.inner
    }

    /// What struck requests, and replies.
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
        // What the inner wire brings may not come out: then go on waiting.
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

/// One direction of the wire.
struct Direction {
    rates: Rates,
    random: Random,
    /// Frames held back, each until so many others have passed.
    held: Vec<(u32, Vec<u8>)>,
    struck: Struck,
}

impl Direction {
    fn new(rates: Rates, seed: u64, stream: u64) -> Self {
        Self { rates, random: Random::new(seed, stream), held: Vec::new(), struck: Struck::default() }
    }

    /// What comes out when this frame goes in.
    fn pass(&mut self, frame: &[u8]) -> Vec<Vec<u8>> {
        let Self { rates, random, held, struck } = self;
        // All are drawn for every frame: the rate of one fault does not change when another strikes.
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
        // A whole number below `end`.
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
