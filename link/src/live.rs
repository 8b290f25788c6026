//! A drive that runs by itself, at the end of a wire: an image `drive` or `motor`, emulated or on a board.
//!
//! Every call is one request that the target carries out once, however often it must be repeated. What it refuses has
//! changed nothing there, and is told in words. A record is made in the memory of the chip and read when it has ended.

use std::f64::consts::TAU;
use std::time::Duration;

use controller_core::drive::Rest;
use loop_sim::port::PortError;
use pil_wire::{
    Disturbance, Instance, LOAD, MAX_E, Observed, Order, Part, Plant, REMEMBERED, ROWS, Reply, Request, Swapped,
    Tracked,
};

use crate::black_box::{BlackBox, Half, Remembered, is_drive};
use crate::remote::{Loadable, Traffic, Wire, not_that};
use crate::transport::Transport;

/// Of a target that has not said yet what it is.
const UNKNOWN: Instance = Instance { n: 0, r: 0, mask: 0, model: pil_wire::Model::Motor };

/// No design has more words, and no state of a law.
const MOST_WORDS: u32 = 256;

/// The drive, and the design that runs there.
pub struct LiveDrive<T> {
    wire: Wire<T>,
    design: Loadable,
    fingerprint: u32,
}

impl<T: Transport> LiveDrive<T> {
    /// Finds the drive and asks for its design. A request that is not answered within `reply_within` is repeated.
    ///
    /// # Errors
    /// When nothing answers, the wire breaks, or it is no drive of this version.
    pub fn connect(transport: T, reply_within: Duration) -> Result<Self, PortError> {
        let mut wire = Wire::connect(transport, reply_within)?;
        let mut recall = |part| match wire.ask(&Request::Recall(part), "what is designed")? {
            Reply::Recalled(words) => Ok(words),
            other => Err(not_that(&other, "what is designed", UNKNOWN)),
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
                "the drive's design makes no sense: it is none, or its hash is another".into(),
            ));
        };
        Ok(Self { wire, design, fingerprint })
    }

    /// What runs.
    pub const fn design(&self) -> &Loadable {
        &self.design
    }

    /// Period of its ticks, s.
    pub fn period_s(&self) -> f64 {
        self.design.numbers().next().unwrap_or(f64::NAN)
    }

    /// What went over the wire so far.
    pub const fn traffic(&self) -> Traffic {
        self.wire.traffic
    }

    /// The wire to the drive.
    pub const fn transport(&self) -> &T {
        &self.wire.transport
    }

    /// How is it?
    ///
    /// # Errors
    /// When it cannot be reached.
    pub fn observe(&mut self) -> Result<Observed, PortError> {
        match self.wire.ask(&Request::Observe, "how it is")? {
            Reply::Observed(observed) => Ok(observed),
            other => Err(self.not_that(&other, "how it is")),
        }
    }

    /// To rest at an angle, in so many ticks or (0) as few as the limits allow. Returns its first tick and how many
    /// there are.
    ///
    /// # Errors
    /// When it is refused, with the reason.
    pub fn move_to(&mut self, angle_rad: f64, ticks: u32) -> Result<[u32; 2], PortError> {
        let turn = (angle_rad / TAU).round();
        let goal = Rest { turn: turn as i32, angle: (angle_rad - turn * TAU) as f32 };
        self.plan(Some(goal), ticks)
    }

    /// To rest where it can, in so many ticks or more.
    ///
    /// # Errors
    /// When it is refused, with the reason.
    pub fn stop(&mut self, ticks: u32) -> Result<[u32; 2], PortError> {
        self.plan(None, ticks)
    }

    fn plan(&mut self, goal: Option<Rest<f32>>, ticks: u32) -> Result<[u32; 2], PortError> {
        match self.wire.ask(&Request::Move { goal, ticks }, "the move")? {
            Reply::Planned { start, ticks } => Ok([start, ticks]),
            other => Err(self.not_that(&other, "the move")),
        }
    }

    /// Another design takes over between two ticks, without a jump of u.
    ///
    /// # Errors
    /// When it is refused; then the old one goes on.
    pub fn swap(&mut self, design: &Loadable) -> Result<Swapped, PortError> {
        self.take(design, false)
    }

    /// The same at rest, without an offset W: for a loop that swings a little as its model is far off. u may jump.
    ///
    /// # Errors
    /// When it is refused, such as in motion; then the old one goes on.
    pub fn swap_at_rest(&mut self, design: &Loadable) -> Result<Swapped, PortError> {
        self.take(design, true)
    }

    fn take(&mut self, design: &Loadable, at_rest: bool) -> Result<Swapped, PortError> {
        self.wire.open(design)?;
        match self.wire.ask(&Request::Swap { at_rest }, "the change")? {
            Reply::Swapped(swapped) => {
                (self.design, self.fingerprint) = (design.clone(), swapped.fingerprint);
                Ok(swapped)
            }
            other => Err(not_that(&other, "the change", design.instance)),
        }
    }

    /// Something its axis is to do.
    ///
    /// # Errors
    /// When it is refused.
    pub fn order(&mut self, order: Order) -> Result<(), PortError> {
        self.wire.done(&Request::Order(order), "the order", self.design.instance)
    }

    /// Something happens to the stand-in of its plant; refused by a board.
    ///
    /// # Errors
    /// When it is refused.
    pub fn disturb(&mut self, disturbance: Disturbance) -> Result<(), PortError> {
        self.wire.done(&Request::Disturb(disturbance), "the disturbance", self.design.instance)
    }

    /// Another plant stands in; refused by a board.
    ///
    /// # Errors
    /// When it is refused.
    pub fn replace(&mut self, plant: Plant) -> Result<(), PortError> {
        self.wire.done(&Request::Plant(plant), "the plant", self.design.instance)
    }

    /// Records from now on: so many ticks to a row, a row for each of these currents, which are on top of u.
    ///
    /// # Errors
    /// When it is refused: another record goes on, too many rows, or a current beyond the limits.
    pub fn record(&mut self, every: u32, shake: &[f32]) -> Result<(), PortError> {
        self.record_while(every, shake, || true).map(|_| ())
    }

    /// The same; it does not begin once `goes_on` says so, which is asked again and again. Did it?
    ///
    /// # Errors
    /// As above.
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
            self.wire.done(&Request::Shake { offset: (k * LOAD) as u32, currents }, "the currents", instance)?;
        }
        self.order(Order::Record)?;
        Ok(true)
    }

    /// How is the record?
    ///
    /// # Errors
    /// When there is none.
    pub fn tracked(&mut self) -> Result<Tracked, PortError> {
        let words = self.recall(Part::Track)?;
        Tracked::from_words(&words).ok_or_else(|| PortError::Refused("its record makes no sense".into()))
    }

    /// Counts of link and motor (of a motor: its own, and 0) and mean current of each row of a record that has ended;
    /// `step` is told of every few.
    ///
    /// # Errors
    /// When it has not.
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

    /// What its black box holds; it must stand still.
    ///
    /// # Errors
    /// When it is refused.
    pub fn black_box(&mut self) -> Result<BlackBox, PortError> {
        let mut halves = Vec::new();
        for half in 0..2 {
            let [first, count, state_words, turn, jet @ ..] = self.recall(Part::Half(half))?;
            if count as usize > REMEMBERED || state_words > MOST_WORDS {
                let why = format!("its black box makes no sense: {count} frames, {state_words} words of a state");
                return Err(PortError::Refused(why));
            }
            let mut state = Vec::new();
            while state.len() < state_words as usize {
                state.extend(self.recall(Part::State(half, state.len() as u32))?);
            }
            state.truncate(state_words as usize);
            let frames = (0..count).map(|index| {
                let [counts @ .., u, health, _, _, _, _, _] = self.recall(Part::Frame(half, index))?;
                Remembered::from_words(counts, u, health)
                    .ok_or_else(|| PortError::Refused(format!("frame {index} of the black box makes no sense")))
            });
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
        match self.wire.ask(&Request::Recall(part), "the black box")? {
            Reply::Recalled(words) => Ok(words),
            other => Err(self.not_that(&other, "the black box")),
        }
    }

    fn not_that(&self, reply: &Reply, what: &str) -> PortError {
        not_that(reply, what, self.design.instance)
    }
}
