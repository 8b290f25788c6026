//! Host side of a drive that ticks by its own interrupt: the firmware `drive` or `motor`, emulated or on a board.
//!
//! Every call is one request. The target executes it once, even if it is repeated. A refused request changes nothing,
//! and the error gives the reason. Records are made in the memory of the chip and read when they have ended.

use std::f64::consts::TAU;
use std::time::Duration;

use controller_core::drive::Rest;
use loop_sim::port::PortError;
use pil_wire::{
    Disturbance, Instance, LOAD, MAX_E, Observed, Order, Part, Plant, REMEMBERED, ROWS, Reason, Refusal, Reply,
    Request, Swapped, Tracked,
};

use crate::black_box::{BlackBox, Half, Remembered, is_drive};
use crate::remote::{Loadable, Traffic, Wire, not_that};
use crate::transport::Transport;

/// Placeholder for a target that has not identified its design yet.
const UNKNOWN: Instance = Instance { n: 0, r: 0, mask: 0, model: pil_wire::Model::Motor };

/// Largest number of words of a design or a state.
const MOST_WORDS: u32 = 256;

/// Connection to a drive, with the design that runs there.
pub struct LiveDrive<T> {
    wire: Wire<T>,
    design: Loadable,
    fingerprint: u32,
}

impl<T: Transport> LiveDrive<T> {
    /// Connects to the drive and reads its design. A request without an answer within `reply_within` is repeated.
    ///
    /// # Errors
    /// Fails if nothing answers, the link breaks, or the target is not a drive of this version.
    pub fn connect(transport: T, reply_within: Duration) -> Result<Self, PortError> {
        let mut wire = Wire::connect(transport, reply_within)?;
        let mut recall = |part| match wire.ask(&Request::Recall(part), "the request for its design")? {
            Reply::Recalled(words) => Ok(words),
            other => Err(not_that(&other, "the request for its design", UNKNOWN)),
        };
        let head = recall(Part::Design)?;
        let [word, count, hash, fingerprint, ..] = head;
        let mut words = Vec::new();
        while words.len() < count.min(MOST_WORDS) as usize {
            words.extend(recall(Part::DesignWords(words.len() as u32))?);
        }
        words.truncate(count as usize);
        let sound = |design: &Loadable| {
            let is_whole = design.names().len() * 2 == design.words.len();
            let ticks = design.numbers().next().is_some_and(|period_s| period_s > 0.0 && period_s < 1.0);
            is_whole && ticks && pil_wire::design_hash(design.instance, &design.words) == hash
        };
        let design = Instance::from_word(word).filter(|&it| is_drive(it)).map(|instance| Loadable { instance, words });
        let Some(design) = design.filter(sound) else {
            return Err(PortError::Refused(
                "invalid reply from the drive: its design is invalid, or the hash differs".into(),
            ));
        };
        Ok(Self { wire, design, fingerprint })
    }

    /// Returns the design that runs.
    pub const fn design(&self) -> &Loadable {
        &self.design
    }

    /// Returns the period of a tick, s.
    pub fn period_s(&self) -> f64 {
        self.design.numbers().next().unwrap_or(f64::NAN)
    }

    /// Returns the time of a number of ticks, s, without the digits of rounding.
    fn seconds(&self, ticks: u32) -> f64 {
        (f64::from(ticks) * self.period_s() * 1e9).round() / 1e9
    }

    /// Returns the traffic so far.
    pub const fn traffic(&self) -> Traffic {
        self.wire.traffic
    }

    /// Returns the link to the drive.
    pub const fn transport(&self) -> &T {
        &self.wire.transport
    }

    /// Reads the status of the drive.
    ///
    /// # Errors
    /// Fails if the drive cannot be reached.
    pub fn observe(&mut self) -> Result<Observed, PortError> {
        match self.wire.ask(&Request::Observe, "the status request")? {
            Reply::Observed(observed) => Ok(observed),
            other => Err(self.not_that(&other, "the status request")),
        }
    }

    /// Moves to rest at an angle, in this number of ticks. 0 takes the fewest ticks within the limits. Returns the
    /// first tick of the move and its number of ticks.
    ///
    /// # Errors
    /// Fails with the reason if the drive refuses the move.
    pub fn move_to(&mut self, angle_rad: f64, ticks: u32) -> Result<[u32; 2], PortError> {
        let turn = (angle_rad / TAU).round();
        let goal = Rest { turn: turn as i32, angle: (angle_rad - turn * TAU) as f32 };
        self.plan(Some(goal), ticks)
    }

    /// Comes to rest in this number of ticks: in more at the limits, in fewer if the drive already slows down.
    ///
    /// # Errors
    /// Fails with the reason if the drive refuses the stop.
    pub fn stop(&mut self, ticks: u32) -> Result<[u32; 2], PortError> {
        self.plan(None, ticks)
    }

    fn plan(&mut self, goal: Option<Rest<f32>>, ticks: u32) -> Result<[u32; 2], PortError> {
        match self.wire.ask(&Request::Move { goal, ticks }, "the move")? {
            Reply::Planned { start, ticks } => Ok([start, ticks]),
            // The user types seconds, and knows no ticks.
            Reply::Refused(Refusal { reason: Reason::TooFast, target: fewest @ 1.., request: asked }) => {
                let [asked_s, fewest_s] = [asked, fewest].map(|ticks| self.seconds(ticks));
                Err(PortError::Refused(format!(
                    "{asked_s} s is too short for 90 % of the current limit, or for a plan: give {fewest_s} s or more"
                )))
            }
            other => Err(self.not_that(&other, "the move")),
        }
    }

    /// Switches to another design between two ticks, without a jump of u.
    ///
    /// # Errors
    /// Fails if the drive refuses the design. The present design then goes on.
    pub fn swap(&mut self, design: &Loadable) -> Result<Swapped, PortError> {
        self.take(design, false)
    }

    /// Switches to another design at rest, without an offset W. Use it for a loop with a small oscillation from a wrong
    /// model. u may jump.
    ///
    /// # Errors
    /// Fails if the drive refuses the design, for example in motion. The present design then goes on.
    pub fn swap_at_rest(&mut self, design: &Loadable) -> Result<Swapped, PortError> {
        self.take(design, true)
    }

    fn take(&mut self, design: &Loadable, at_rest: bool) -> Result<Swapped, PortError> {
        self.wire.open(design)?;
        match self.wire.ask(&Request::Swap { at_rest }, "the switch of the design")? {
            Reply::Swapped(swapped) => {
                (self.design, self.fingerprint) = (design.clone(), swapped.fingerprint);
                Ok(swapped)
            }
            other => Err(not_that(&other, "the switch of the design", design.instance)),
        }
    }

    /// Sends an order to the axis.
    ///
    /// # Errors
    /// Fails with the reason if the drive refuses the order.
    pub fn order(&mut self, order: Order) -> Result<(), PortError> {
        self.wire.done(&Request::Order(order), "the order", self.design.instance)
    }

    /// Disturbs the simulated plant on the target. A board refuses this request.
    ///
    /// # Errors
    /// Fails with the reason if the drive refuses the request.
    pub fn disturb(&mut self, disturbance: Disturbance) -> Result<(), PortError> {
        self.wire.done(&Request::Disturb(disturbance), "the disturbance", self.design.instance)
    }

    /// Replaces the simulated plant on the target. A board refuses this request.
    ///
    /// # Errors
    /// Fails with the reason if the drive refuses the request.
    pub fn replace(&mut self, plant: Plant) -> Result<(), PortError> {
        self.wire.done(&Request::Plant(plant), "the plant", self.design.instance)
    }

    /// Begins a record with `every` ticks per row. The excitation `shake` has one current per row, A, which is added to
    /// u.
    ///
    /// # Errors
    /// Fails if another record is in progress, there are too many rows, or a current is beyond the limits.
    pub fn record(&mut self, every: u32, shake: &[f32]) -> Result<(), PortError> {
        self.record_while(every, shake, || true).map(|_| ())
    }

    /// Begins a record, unless `goes_on` returns false, which is called repeatedly. Returns true if the record has
    /// begun.
    ///
    /// # Errors
    /// Fails like [`record`](Self::record).
    pub fn record_while(
        &mut self,
        every: u32,
        shake: &[f32],
        mut goes_on: impl FnMut() -> bool,
    ) -> Result<bool, PortError> {
        let instance = self.design.instance;
        self.wire.done(&Request::Prepare { rows: shake.len() as u32, every }, "the record", instance)?;
        for (k, chunk) in shake.chunks(LOAD).enumerate().filter(|(_, chunk)| chunk.iter().any(|it| *it != 0.0)) {
            if !goes_on() {
                return Ok(false);
            }
            let mut currents = [0.0; LOAD];
            currents[..chunk.len()].copy_from_slice(chunk);
            self.wire.done(&Request::Shake { offset: (k * LOAD) as u32, currents }, "the excitation", instance)?;
        }
        self.order(Order::Record)?;
        Ok(true)
    }

    /// Reads the status of the record.
    ///
    /// # Errors
    /// Fails if there is no record.
    pub fn tracked(&mut self) -> Result<Tracked, PortError> {
        let words = self.recall(Part::Track)?;
        Tracked::from_words(&words)
            .ok_or_else(|| PortError::Refused("invalid reply from the drive: status of the record".into()))
    }

    /// Returns the rows of an ended record: the counts of link and motor, and the mean current in A. For a motor the
    /// counts are its own count and 0. `step` receives the progress every few rows.
    ///
    /// # Errors
    /// Fails if the record has not ended.
    pub fn rows(&mut self, mut step: impl FnMut(u64)) -> Result<Vec<([i32; MAX_E], f32)>, PortError> {
        let count = self.tracked()?.rows;
        let mut rows = Vec::new();
        while rows.len() < count as usize {
            let words = self.recall(Part::Rows(rows.len() as u32))?;
            let some = (count as usize - rows.len()).min(ROWS);
            rows.extend(
                words
                    .chunks_exact(MAX_E + 1)
                    .take(some)
                    .map(|row| (std::array::from_fn(|i| row[i] as i32), f32::from_bits(row[MAX_E]))),
            );
            step(some as u64);
        }
        Ok(rows)
    }

    /// Reads the newest tick of the trace buffer, which must be frozen, with its number: after an alarm its tick.
    ///
    /// # Errors
    /// Fails with the reason if the drive refuses the request.
    pub fn newest_remembered(&mut self) -> Result<Option<(u32, Remembered)>, PortError> {
        let [first, count, ..] = self.recall(Part::Half(1))?;
        let Some(last) = count.checked_sub(1) else { return Ok(None) };
        Ok(Some((first.wrapping_add(last), self.remembered(1, last)?)))
    }

    /// Reads a tick of a half of the trace buffer.
    fn remembered(&mut self, half: u32, index: u32) -> Result<Remembered, PortError> {
        let [counts @ .., u, health, _, _, _, _, _] = self.recall(Part::Frame(half, index))?;
        Remembered::from_words(counts, u, health)
            .ok_or_else(|| PortError::Refused(format!("invalid reply from the drive: frame {index}")))
    }

    /// Reads the trace buffer, which must be frozen.
    ///
    /// # Errors
    /// Fails with the reason if the drive refuses the request.
    pub fn black_box(&mut self) -> Result<BlackBox, PortError> {
        let mut halves = Vec::new();
        for half in 0..2 {
            let [first, count, state_words, turn, jet @ ..] = self.recall(Part::Half(half))?;
            if count as usize > REMEMBERED || state_words > MOST_WORDS {
                let why = format!("invalid reply from the drive: {count} frames and {state_words} state words");
                return Err(PortError::Refused(why));
            }
            let mut state = Vec::new();
            while state.len() < state_words as usize {
                state.extend(self.recall(Part::State(half, state.len() as u32))?);
            }
            state.truncate(state_words as usize);
            let frames = (0..count).map(|index| self.remembered(half, index));
            let frames = frames.collect::<Result<_, _>>()?;
            let begin = controller_core::drive::Target {
                turn: turn as i32,
                jet: std::array::from_fn(|j| f32::from_bits(jet[j])),
            };
            halves.push(Half { first, begin, state, frames });
        }
        halves.retain(|half| !half.frames.is_empty());
        let (design, fingerprint) = (self.design.clone(), self.fingerprint);
        Ok(BlackBox { design, fingerprint, scenario: Vec::new(), sets: Vec::new(), halves })
    }

    fn recall(&mut self, part: Part) -> Result<[u32; 16], PortError> {
        match self.wire.ask(&Request::Recall(part), "the trace buffer")? {
            Reply::Recalled(words) => Ok(words),
            other => Err(self.not_that(&other, "the trace buffer")),
        }
    }

    fn not_that(&self, reply: &Reply, what: &str) -> PortError {
        not_that(reply, what, self.design.instance)
    }
}
