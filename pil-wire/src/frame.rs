//! Requests and replies as values, and as the bytes of the tables in the crate's page.

use controller_core::drive::{Rest, Target};
use controller_core::{Health, MAX_R, RetuneError};

use crate::{CORE_VERSION, CRC, FAULT, LAYOUT_ID, LOAD, MARK, MAX_E, MAX_N, REPLY_LEN, REPLY_WORDS, REQUEST_LEN};
use crate::{REQUEST_WORDS, VERSION};

/// Second bytes of the marks.
pub(crate) const REQUEST_MARK: [u8; 2] = [MARK, 0xE5];
pub(crate) const REPLY_MARK: [u8; 2] = [MARK, 0xE6];

/// The nominal model of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Model {
    /// a(x) linear, its row among the loaded numbers.
    Linear = 0,
    /// Eq. (59), e^x by libm.
    BenchmarkLibm = 1,
    /// Eq. (59), e^x by micromath.
    BenchmarkMicromath = 2,
    /// The drive of a motor: counts instead of a state.
    Motor = 3,
    /// The drive of a joint.
    Joint = 4,
}

/// Which tick: a type of the controller, named at run time. Of a drive `r` is the number of states of its observers,
/// and `mask` says what else it is: [`TWO_SETS`](Self::TWO_SETS), [`LATE`](Self::LATE), [`SPEED`](Self::SPEED).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Instance {
    /// Plant order N.
    pub n: u8,
    /// Capacity R for observer orders.
    pub r: u8,
    /// Observed channels, bit i - 1 for channel i; of a drive its form.
    pub mask: u8,
    /// The nominal model of the tick.
    pub model: Model,
}

impl Instance {
    /// A drive with a fast gain set.
    pub const TWO_SETS: u8 = 1;
    /// A drive whose u is held one tick after it was computed.
    pub const LATE: u8 = 2;
    /// A drive that follows a speed.
    pub const SPEED: u8 = 4;

    /// The drive of a joint that is designed as a whole: three states per shaft, where one observer per encoder has
    /// four.
    pub const fn is_whole(self) -> bool {
        matches!(self.model, Model::Joint) && self.r == 3
    }

    pub(crate) const fn word(self) -> u32 {
        u32::from_le_bytes([self.n, self.r, self.mask, self.model as u8])
    }

    /// Of the first word of Open; `None` if there is no such model.
    pub fn from_word(word: u32) -> Option<Self> {
        let [n, r, mask, model] = word.to_le_bytes();
        let model = match model {
            0 => Model::Linear,
            1 => Model::BenchmarkLibm,
            2 => Model::BenchmarkMicromath,
            3 => Model::Motor,
            4 => Model::Joint,
            _ => return None,
        };
        Some(Self { n, r, mask, model })
    }
}

/// What the host asks.
#[derive(Clone, Copy, Debug)]
pub enum Request {
    /// Who are you?
    Identify,
    /// A design is coming.
    Open(Open),
    /// Eight words of it.
    Load {
        /// Position of the first one.
        offset: u32,
        /// The words; those beyond the design's end are not read.
        words: [u32; LOAD],
    },
    /// The design is complete: start with the next sample.
    Start,
    /// Asks for one tick.
    Tick {
        /// The sample; entries beyond the plant order are not read.
        x: [f32; MAX_N],
        /// What the actuator held since the last tick; NaN if that was not told. Beyond 1e12 it is not taken either.
        applied: f32,
    },
    /// Run into an undefined instruction: shows that the black box comes out.
    Fault,
    /// Where a drive should be at the beginning of its next tick, if that is not the end of the last one.
    Begin(Target<f32, i32, MAX_N>),
    /// Asks a drive for one tick.
    Drive(Counts),
    /// The loaded design takes over from the one that runs, without a jump of u; then this tick.
    Retune(Counts),
    /// How is a drive that runs by itself?
    Observe,
    /// Another plan for it, from where the present one leads.
    Move {
        /// Where it is to rest; `None` for the nearest place at which it can.
        goal: Option<Rest<f32>>,
        /// Ticks that it takes; 0 for the fewest within the limits. A stop takes more where it must.
        ticks: u32,
    },
    /// The loaded design takes over between two ticks of it.
    Swap {
        /// Without an offset W, for a loop at rest under a model that was far off; u may jump.
        at_rest: bool,
    },
    /// What its axis is to do.
    Order(Order),
    /// A part of what its black box holds, or of the design that it is of.
    Recall(Part),
    /// Something happens to the stand-in of a plant; the image of a board knows no such request.
    Disturb(Disturbance),
    /// The next record: so many rows of so many ticks, and nothing that shakes.
    Prepare {
        /// Rows.
        rows: u32,
        /// Ticks of a row.
        every: u32,
    },
    /// What is on top of u in the ticks of these rows of it, A.
    Shake {
        /// The first row.
        offset: u32,
        /// Currents; those beyond the last row are not read.
        currents: [f32; LOAD],
    },
    /// Another plant stands in; the image of a board knows no such request.
    Plant(Plant),
}

/// A plant that stands in: link inertia (kg m²), link damping (N m s), weight (N m), stiffness (N m), motor inertia,
/// motor damping, torque constant (N m/A), friction (N m), cogging (N m, 24 periods a turn). A motor has no link: its
/// first four are not read.
pub type Plant = [f32; REQUEST_WORDS];

/// What the axis of a drive is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The black box stops, as after an alarm.
    Freeze,
    /// The black box goes on, with nothing in it.
    Release,
    /// After a stop: the law starts anew, at rest where the counts are, and the black box goes on.
    Reset,
    /// The record that was prepared begins.
    Record,
    /// It ends.
    EndRecord,
}

const ORDERS: [Order; 5] = [Order::Freeze, Order::Release, Order::Reset, Order::Record, Order::EndRecord];

/// A part of a black box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Instance, count of words and hash of the design that runs; its fingerprint.
    Design,
    /// Sixteen words of it, from this one on.
    DesignWords(u32),
    /// Of the older half (0) or the newer (1): first tick, count of frames, count of words of the state (0: not
    /// started), where its first tick begins (turn, r .. r''').
    Half(u32),
    /// Sixteen words of its state, from this one on.
    State(u32, u32),
    /// One of its frames: [`Counts`] as in Drive, u, health.
    Frame(u32, u32),
    /// Of the record: how it is ([`Tracked`](crate::Tracked)).
    Track,
    /// Five rows of it, from this one on.
    Rows(u32),
}

/// What happens to the stand-in of a plant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disturbance {
    /// Which encoders stick.
    pub stuck: [bool; MAX_E],
    /// Which of them give no count.
    pub lost: [bool; MAX_E],
    /// Torque against the load's side, N m.
    pub load_n_m: f32,
}

impl Disturbance {
    /// Which encoders stick (bits 0, 1) and which give no count (bits 2, 3).
    pub fn bits(&self) -> u32 {
        self.stuck.into_iter().chain(self.lost).zip(0..).fold(0, |bits, (is, bit)| bits | u32::from(is) << bit)
    }

    /// Of these bits.
    fn from_bits(bits: u32, load_n_m: f32) -> Self {
        let [a, b, c, d] = [0, 1, 2, 3].map(|bit| bits >> bit & 1 == 1);
        Self { stuck: [a, b], lost: [c, d], load_n_m }
    }
}

/// What a drive is given for one tick. What its order does not need is not read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    /// Counts of its encoders; `None` for one that is lost.
    pub counts: [Option<i32>; MAX_E],
    /// Where it should be at the end of the tick in which u is held.
    pub end: Target<f32, i32, MAX_N>,
    /// What the actuator held since the last tick; NaN if that was not told.
    pub applied: f32,
}

impl Counts {
    /// As nine words: which are lost, counts, turn, r .. r''', u that was held.
    pub fn words(&self) -> [u32; REQUEST_WORDS] {
        let Self { counts: [a, b], end: Target { turn, jet: [r, v, w, z] }, applied } = *self;
        let lost = u32::from(a.is_none()) | u32::from(b.is_none()) << 1;
        let count = |count: Option<i32>| count.unwrap_or(0) as u32;
        let [r, v, w, z, applied] = [r, v, w, z, applied].map(f32::to_bits);
        [lost, count(a), count(b), turn as u32, r, v, w, z, applied]
    }

    /// Of these words.
    pub fn from_words([lost, a, b, turn, jet @ .., applied]: [u32; REQUEST_WORDS]) -> Self {
        Self {
            counts: [(lost & 1 == 0).then_some(a as i32), (lost & 2 == 0).then_some(b as i32)],
            end: Target { turn: turn as i32, jet: jet.map(f32::from_bits) },
            applied: f32::from_bits(applied),
        }
    }
}

/// Announces a design.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Open {
    /// Shape and model of the tick that is meant.
    pub instance: Instance,
    /// How many words will be loaded.
    pub count: u32,
    /// Their layout, [`LAYOUT_ID`].
    pub layout: u32,
    /// Version of the controller that made the design, [`CORE_VERSION`].
    pub core_version: u32,
    /// Hash of the design.
    pub design: u32,
}

impl Open {
    /// By this program.
    pub fn new(instance: Instance, words: &[u32]) -> Self {
        Self {
            instance,
            count: words.len() as u32,
            layout: LAYOUT_ID,
            core_version: CORE_VERSION,
            design: crate::design_hash(instance, words),
        }
    }
}

/// What the target answers.
#[derive(Clone, Copy, Debug)]
pub enum Reply {
    /// Who it is.
    Identity(Identity),
    /// Open, Load or Start is done.
    Done,
    /// What the tick returned.
    Ticked(Ticked),
    /// What the tick of a drive returned.
    Driven(Driven),
    /// How a drive that runs by itself is.
    Observed(Observed),
    /// It has another plan.
    Planned {
        /// The tick at which that began.
        start: u32,
        /// Ticks from there to rest.
        ticks: u32,
    },
    /// It has another design.
    Swapped(Swapped),
    /// A part of its black box.
    Recalled([u32; REPLY_WORDS]),
    /// The request was not carried out.
    Refused(Refusal),
}

/// Who the target is. This reply has the same form in every version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Version of the wire.
    pub version: u8,
    /// Layout of its designs.
    pub layout: u32,
    /// Version of its controller.
    pub core_version: u32,
    /// Sequence number of the last request that was new to it.
    pub last_sequence: u32,
}

/// Every output of a tick.
#[derive(Clone, Copy, Debug)]
pub struct Ticked {
    /// Control u.
    pub u: f32,
    /// Sliding variable σ.
    pub sigma: f32,
    /// σ without its offset, σ*.
    pub sigma_star: f32,
    /// Health of the tick.
    pub health: Health,
    /// d_hat, d_hat', d_hat'' of channels 1..4; zeros where there is nothing to estimate.
    pub estimates: [[f32; MAX_R]; MAX_N],
}

/// Every output of the tick of a drive.
#[derive(Clone, Copy, Debug)]
pub struct Driven {
    /// Control u.
    pub u: f32,
    /// Sliding variable σ.
    pub sigma: f32,
    /// σ without its offset, σ*.
    pub sigma_star: f32,
    /// Health of the tick.
    pub health: Health,
    /// Whole turns to which the positions are to be added.
    pub turn: i32,
    /// Position (rad), speed (rad/s), disturbance (rad/s²) and load (N m) of each shaft; zeros before the start and
    /// where there is none.
    pub estimates: [[f32; 4]; MAX_E],
}

/// A drive that runs by itself, between two ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed {
    /// Number of the coming tick.
    pub tick: u32,
    /// Control u of the last one.
    pub u: f32,
    /// σ* of the last one.
    pub sigma_star: f32,
    /// Health of the last one.
    pub health: Health,
    /// Does its black box stand still?
    pub frozen: bool,
    /// Has its law started?
    pub started: bool,
    /// Is its plan still on the way?
    pub moving: bool,
    /// Whole turns to which the positions are to be added.
    pub turn: i32,
    /// Position (rad), speed (rad/s), disturbance (rad/s²) and load (N m) of each shaft, as in [`Driven`].
    pub estimates: [[f32; 4]; MAX_E],
    /// Where it should be, rad from those turns.
    pub reference: f32,
    /// The longest that its interrupt took, by its stopwatch.
    pub worst: u32,
    /// Ticks that came late.
    pub missed: u32,
}

/// A design that has taken over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swapped {
    /// Its first tick.
    pub tick: u32,
    /// Ticks that went by while it was designed.
    pub ticks: u32,
    /// The same by the stopwatch of the target, interrupts included.
    pub time: u32,
    /// u of the last tick before, and of the first one after.
    pub u: [f32; 2],
    /// Fingerprint of the law.
    pub fingerprint: u32,
}

/// Why a request was refused, with the two numbers that differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Refusal {
    /// What is wrong.
    pub reason: Reason,
    /// What the target has.
    pub target: u32,
    /// What the request has.
    pub request: u32,
}

impl Refusal {
    pub(crate) const fn of(reason: Reason) -> Self {
        Self { reason, target: 0, request: 0 }
    }

    /// A request that this target does not carry out.
    pub(crate) fn of_kind(request: &Request) -> Self {
        Self { reason: Reason::Kind, target: 0, request: u32::from(request.to_frame(0)[3]) }
    }
}

/// What is wrong with a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Reason {
    /// Another [`VERSION`] of the wire.
    Version = 1,
    /// The host has another [`LAYOUT_ID`].
    Layout,
    /// The host has another [`CORE_VERSION`].
    CoreVersion,
    /// The image carries no such [`Instance`].
    Instance,
    /// Another count of numbers than the instance has.
    Count,
    /// Another hash of the design than the loaded numbers have.
    Design,
    /// Numbers that no design has: not finite, limits reversed, a period of 0.
    Coefficients,
    /// Load, Start or Tick out of their order.
    NotOpen,
    /// A sequence number from the future: the target has restarted.
    OutOfStep,
    /// No such kind of request.
    Kind,
    /// The loaded design cannot take over from the one that runs: why is one of [`RETUNE_ERRORS`], from 0.
    Retune,
    /// A goal that is no number, or too far off.
    Goal,
    /// A move that asks for more than the limits allow; the target says in how many ticks it would do (0: in none).
    TooFast,
    /// An alarm has stopped the drive: reset it first.
    Stopped,
    /// There is nothing to reset.
    NotStopped,
    /// The black box goes on: freeze it first.
    NotFrozen,
    /// There is no such part, or the counts to start from are not there.
    Absent,
    /// The plan was not ready in time.
    Late,
    /// A design for another period than that of the drive's timer; both in ns.
    Period,
    /// The black box stands still, and another design would empty it: release it or reset the drive first.
    Frozen,
    /// A record is being made: end it first.
    Recording,
    /// No record was prepared, or none was made.
    NotPrepared,
    /// A current that is no number, or beyond the limits.
    Current,
    /// At rest is what the drive is not.
    Moving,
    /// More rows than the memory has, or the record; or none, or rows of too many ticks.
    Rows,
}

/// Why a design cannot take over, in the order of the wire.
pub const RETUNE_ERRORS: [RetuneError; 4] =
    [RetuneError::Sample, RetuneError::GainNearDecay, RetuneError::OffsetOutOfRange, RetuneError::OtherEncoder];

const REASONS: [Reason; 25] = [
    Reason::Version,
    Reason::Layout,
    Reason::CoreVersion,
    Reason::Instance,
    Reason::Count,
    Reason::Design,
    Reason::Coefficients,
    Reason::NotOpen,
    Reason::OutOfStep,
    Reason::Kind,
    Reason::Retune,
    Reason::Goal,
    Reason::TooFast,
    Reason::Stopped,
    Reason::NotStopped,
    Reason::NotFrozen,
    Reason::Absent,
    Reason::Late,
    Reason::Period,
    Reason::Frozen,
    Reason::Recording,
    Reason::NotPrepared,
    Reason::Current,
    Reason::Moving,
    Reason::Rows,
];

const IDENTIFY: u8 = 1;
const IDENTITY: u8 = 129;

impl Request {
    /// The bytes of the frame.
    pub fn to_frame(&self, sequence: u32) -> [u8; REQUEST_LEN] {
        let mut words = [0; REQUEST_WORDS];
        let kind = match *self {
            Self::Identify => IDENTIFY,
            Self::Open(Open { instance, count, layout, core_version, design }) => {
                words[..5].copy_from_slice(&[instance.word(), count, layout, core_version, design]);
                2
            }
            Self::Load { offset, words: loaded } => {
                words[0] = offset;
                words[1..].copy_from_slice(&loaded);
                3
            }
            Self::Start => 4,
            Self::Tick { x: [a, b, c, d], applied } => {
                words[..5].copy_from_slice(&[a, b, c, d, applied].map(f32::to_bits));
                5
            }
            Self::Fault => {
                words[0] = FAULT;
                6
            }
            Self::Begin(Target { turn, jet }) => {
                words[0] = turn as u32;
                words[1..=MAX_N].copy_from_slice(&jet.map(f32::to_bits));
                7
            }
            Self::Drive(counts) => {
                words = counts.words();
                8
            }
            Self::Retune(counts) => {
                words = counts.words();
                9
            }
            Self::Observe => 10,
            Self::Move { goal, ticks } => {
                words[0] = u32::from(goal.is_some());
                if let Some(Rest { turn, angle }) = goal {
                    words[1..3].copy_from_slice(&[turn as u32, angle.to_bits()]);
                }
                words[3] = ticks;
                11
            }
            Self::Swap { at_rest } => {
                words[0] = u32::from(at_rest);
                12
            }
            Self::Order(order) => {
                words[0] = order as u32;
                13
            }
            Self::Recall(part) => {
                words[..3].copy_from_slice(&match part {
                    Part::Design => [0, 0, 0],
                    Part::DesignWords(from) => [1, 0, from],
                    Part::Half(half) => [2, half, 0],
                    Part::State(half, from) => [3, half, from],
                    Part::Frame(half, index) => [4, half, index],
                    Part::Track => [5, 0, 0],
                    Part::Rows(from) => [6, 0, from],
                });
                14
            }
            Self::Disturb(disturbance) => {
                words[..2].copy_from_slice(&[disturbance.bits(), disturbance.load_n_m.to_bits()]);
                15
            }
            Self::Prepare { rows, every } => {
                words[..2].copy_from_slice(&[rows, every]);
                16
            }
            Self::Shake { offset, currents } => {
                words[0] = offset;
                words[1..].copy_from_slice(&currents.map(f32::to_bits));
                17
            }
            Self::Plant(plant) => {
                words = plant.map(f32::to_bits);
                18
            }
        };
        framed(REQUEST_MARK, kind, sequence, &words)
    }

    /// Sequence number and request of a frame that a [`Receiver`](crate::Receiver) let through.
    ///
    /// # Errors
    /// What to answer to a request that cannot be read.
    pub fn from_frame(frame: &[u8; REQUEST_LEN]) -> (u32, Result<Self, Refusal>) {
        let (version, kind, sequence) = head(frame);
        let words: [u32; REQUEST_WORDS] = words(frame);
        let refused = |reason, target, request| Err(Refusal { reason, target, request });
        let request = match (kind, words) {
            (IDENTIFY, _) => Ok(Self::Identify),
            _ if version != VERSION => refused(Reason::Version, u32::from(VERSION), u32::from(version)),
            (2, [instance, count, layout, core_version, design, ..]) => match Instance::from_word(instance) {
                Some(instance) => Ok(Self::Open(Open { instance, count, layout, core_version, design })),
                None => refused(Reason::Instance, 0, instance),
            },
            (3, [offset, words @ ..]) => Ok(Self::Load { offset, words }),
            (4, _) => Ok(Self::Start),
            (5, [a, b, c, d, applied, ..]) => {
                Ok(Self::Tick { x: [a, b, c, d].map(f32::from_bits), applied: f32::from_bits(applied) })
            }
            (6, [FAULT, ..]) => Ok(Self::Fault),
            (7, [turn, r, v, w, z, ..]) => {
                Ok(Self::Begin(Target { turn: turn as i32, jet: [r, v, w, z].map(f32::from_bits) }))
            }
            (8, words) => Ok(Self::Drive(Counts::from_words(words))),
            (9, words) => Ok(Self::Retune(Counts::from_words(words))),
            (10, _) => Ok(Self::Observe),
            (11, [has_goal @ 0..=1, turn, angle, ticks, ..]) => {
                let goal = Rest { turn: turn as i32, angle: f32::from_bits(angle) };
                Ok(Self::Move { goal: (has_goal == 1).then_some(goal), ticks })
            }
            (12, [at_rest @ 0..=1, ..]) => Ok(Self::Swap { at_rest: at_rest == 1 }),
            (13, [order @ 0..=4, ..]) => Ok(Self::Order(ORDERS[order as usize])),
            (14, [0, ..]) => Ok(Self::Recall(Part::Design)),
            (14, [1, _, from, ..]) => Ok(Self::Recall(Part::DesignWords(from))),
            (14, [2, half, ..]) => Ok(Self::Recall(Part::Half(half))),
            (14, [3, half, from, ..]) => Ok(Self::Recall(Part::State(half, from))),
            (14, [4, half, index, ..]) => Ok(Self::Recall(Part::Frame(half, index))),
            (14, [5, ..]) => Ok(Self::Recall(Part::Track)),
            (14, [6, _, from, ..]) => Ok(Self::Recall(Part::Rows(from))),
            (15, [bits, load, ..]) => Ok(Self::Disturb(Disturbance::from_bits(bits, f32::from_bits(load)))),
            (16, [rows, every, ..]) => Ok(Self::Prepare { rows, every }),
            (17, [offset, currents @ ..]) => Ok(Self::Shake { offset, currents: currents.map(f32::from_bits) }),
            (18, plant) => Ok(Self::Plant(plant.map(f32::from_bits))),
            _ => refused(Reason::Kind, 0, u32::from(kind)),
        };
        (sequence, request)
    }
}

impl Reply {
    /// The bytes of the frame.
    pub fn to_frame(&self, sequence: u32) -> [u8; REPLY_LEN] {
        let mut words = [0; REPLY_WORDS];
        let kind = match *self {
            Self::Identity(Identity { version: _, layout, core_version, last_sequence }) => {
                words[..3].copy_from_slice(&[layout, core_version, last_sequence]);
                IDENTITY
            }
            Self::Done => 130,
            Self::Ticked(Ticked { u, sigma, sigma_star, health, estimates }) => {
                words[..3].copy_from_slice(&[u, sigma, sigma_star].map(f32::to_bits));
                words[3] = u32::from(health.bits());
                for (word, number) in words[4..].iter_mut().zip(estimates.as_flattened()) {
                    *word = number.to_bits();
                }
                131
            }
            Self::Driven(Driven { u, sigma, sigma_star, health, turn, estimates }) => {
                words[..3].copy_from_slice(&[u, sigma, sigma_star].map(f32::to_bits));
                words[3..5].copy_from_slice(&[u32::from(health.bits()), turn as u32]);
                for (word, number) in words[5..].iter_mut().zip(estimates.as_flattened()) {
                    *word = number.to_bits();
                }
                133
            }
            Self::Observed(it) => {
                let Observed { tick, u, sigma_star, health, turn, estimates, reference, worst, missed, .. } = it;
                let flags = [it.frozen, it.started, it.moving].into_iter().zip(16..);
                let flags = flags.fold(u32::from(health.bits()), |flags, (flag, bit)| flags | u32::from(flag) << bit);
                words[..5].copy_from_slice(&[tick, u.to_bits(), sigma_star.to_bits(), flags, turn as u32]);
                for (word, number) in words[5..].iter_mut().zip(estimates.as_flattened()) {
                    *word = number.to_bits();
                }
                words[13..].copy_from_slice(&[reference.to_bits(), worst, missed]);
                134
            }
            Self::Planned { start, ticks } => {
                words[..2].copy_from_slice(&[start, ticks]);
                135
            }
            Self::Swapped(Swapped { tick, ticks, time, u: [before, after], fingerprint }) => {
                words[..6].copy_from_slice(&[tick, ticks, time, before.to_bits(), after.to_bits(), fingerprint]);
                136
            }
            Self::Recalled(recalled) => {
                words = recalled;
                137
            }
            Self::Refused(Refusal { reason, target, request }) => {
                words[..3].copy_from_slice(&[u32::from(reason as u8), target, request]);
                132
            }
        };
        framed(REPLY_MARK, kind, sequence, &words)
    }

    /// Sequence number and reply of a frame that a [`Receiver`](crate::Receiver) let through; `None` for the reply if
    /// it cannot be read.
    pub fn from_frame(frame: &[u8; REPLY_LEN]) -> (u32, Option<Self>) {
        let (version, kind, sequence) = head(frame);
        let words: [u32; REPLY_WORDS] = words(frame);
        let [a, b, c, d, e, ..] = words;
        let health = || u16::try_from(d).ok().map(Health::from_bits);
        let reply = match kind {
            IDENTITY => Some(Self::Identity(Identity { version, layout: a, core_version: b, last_sequence: c })),
            _ if version != VERSION => None,
            130 => Some(Self::Done),
            131 => health().map(|health| {
                let mut estimates = [[0.0; MAX_R]; MAX_N];
                for (number, word) in estimates.as_flattened_mut().iter_mut().zip(&words[4..]) {
                    *number = f32::from_bits(*word);
                }
                let [u, sigma, sigma_star] = [a, b, c].map(f32::from_bits);
                Self::Ticked(Ticked { u, sigma, sigma_star, health, estimates })
            }),
            133 => health().map(|health| {
                let mut estimates = [[0.0; 4]; MAX_E];
                for (number, word) in estimates.as_flattened_mut().iter_mut().zip(&words[5..]) {
                    *number = f32::from_bits(*word);
                }
                let [u, sigma, sigma_star] = [a, b, c].map(f32::from_bits);
                Self::Driven(Driven { u, sigma, sigma_star, health, turn: e as i32, estimates })
            }),
            134 => (d < 1 << 19).then(|| Health::from_bits(d as u16)).map(|health| {
                let mut estimates = [[0.0; 4]; MAX_E];
                for (number, word) in estimates.as_flattened_mut().iter_mut().zip(&words[5..]) {
                    *number = f32::from_bits(*word);
                }
                let [frozen, started, moving] = [16, 17, 18].map(|bit| d >> bit & 1 == 1);
                let [.., reference, worst, missed] = words;
                let [u, sigma_star, reference] = [b, c, reference].map(f32::from_bits);
                let turn = e as i32;
                Self::Observed(Observed {
                    tick: a,
                    u,
                    sigma_star,
                    health,
                    frozen,
                    started,
                    moving,
                    turn,
                    estimates,
                    reference,
                    worst,
                    missed,
                })
            }),
            135 => Some(Self::Planned { start: a, ticks: b }),
            136 => {
                let u = [d, e].map(f32::from_bits);
                Some(Self::Swapped(Swapped { tick: a, ticks: b, time: c, u, fingerprint: words[5] }))
            }
            137 => Some(Self::Recalled(words)),
            132 => REASONS
                .into_iter()
                .find(|reason| *reason as u32 == a)
                .map(|reason| Self::Refused(Refusal { reason, target: b, request: c })),
            _ => None,
        };
        (sequence, reply)
    }
}

fn framed<const LEN: usize>(mark: [u8; 2], kind: u8, sequence: u32, words: &[u32]) -> [u8; LEN] {
    let mut frame = [0; LEN];
    let (body, check) = frame.split_at_mut(LEN - 4);
    let (head, rest) = body.split_at_mut(4);
    head.copy_from_slice(&[mark[0], mark[1], VERSION, kind]);
    for (bytes, word) in rest.chunks_exact_mut(4).zip(core::iter::once(&sequence).chain(words)) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    check.copy_from_slice(&CRC.checksum(body).to_le_bytes());
    frame
}

/// Do mark and checksum hold?
pub(crate) fn is_whole<const LEN: usize>(frame: &[u8; LEN], mark: [u8; 2]) -> bool {
    let (body, check) = frame.split_at(LEN - 4);
    body.starts_with(&mark) && CRC.checksum(body).to_le_bytes() == *check
}

/// Version, kind and sequence number.
fn head<const LEN: usize>(frame: &[u8; LEN]) -> (u8, u8, u32) {
    let [sequence]: [u32; 1] = words_from(&frame[4..8]);
    (frame[2], frame[3], sequence)
}

fn words<const LEN: usize, const WORDS: usize>(frame: &[u8; LEN]) -> [u32; WORDS] {
    words_from(&frame[8..LEN - 4])
}

fn words_from<const WORDS: usize>(bytes: &[u8]) -> [u32; WORDS] {
    let mut words = [0; WORDS];
    for (word, bytes) in words.iter_mut().zip(bytes.chunks_exact(4)) {
        *word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    }
    words
}
