//! Requests and replies as values, and as frames with the tables of the crate page.

use controller_core::drive::{Rest, Target};
use controller_core::{Health, MAX_R, RetuneError};

use crate::{CORE_VERSION, CRC, FAULT, LAYOUT_ID, LOAD, MARK, MAX_E, MAX_N, REPLY_LEN, REPLY_WORDS, REQUEST_LEN};
use crate::{REQUEST_WORDS, VERSION};

/// Second byte of the frame mark.
pub(crate) const REQUEST_MARK: [u8; 2] = [MARK, 0xE5];
pub(crate) const REPLY_MARK: [u8; 2] = [MARK, 0xE6];

/// Nominal model of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Model {
    /// Linear a(x), with its row among the loaded numbers.
    Linear = 0,
    /// Model of Eq. (59), with e^x from libm.
    BenchmarkLibm = 1,
    /// Model of Eq. (59), with e^x from micromath.
    BenchmarkMicromath = 2,
    /// Drive of a motor, which reads counts instead of a state.
    Motor = 3,
    /// Drive of a joint, which reads counts instead of a state.
    Joint = 4,
}

/// Type of a tick, selected at run time. For a drive `r` is the number of states of its observers. `mask` is its form:
/// [`TWO_SETS`](Self::TWO_SETS), [`LATE`](Self::LATE), [`SPEED`](Self::SPEED).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Instance {
    /// Plant order N.
    pub n: u8,
    /// Capacity R for the order of observers.
    pub r: u8,
    /// Observed channels, bit i - 1 for channel i. For a drive its form.
    pub mask: u8,
    /// Nominal model of the tick.
    pub model: Model,
}

impl Instance {
    /// Form bit of a drive with high gains.
    pub const TWO_SETS: u8 = 1;
    /// Form bit of a drive whose u is held one tick after its computation.
    pub const LATE: u8 = 2;
    /// Form bit of a drive in speed control.
    pub const SPEED: u8 = 4;

    /// Returns true for a joint that is designed as a whole. It has three states per shaft, and an observer per encoder
    /// has four.
    pub const fn is_whole(self) -> bool {
        matches!(self.model, Model::Joint) && self.r == 3
    }

    pub(crate) const fn word(self) -> u32 {
        u32::from_le_bytes([self.n, self.r, self.mask, self.model as u8])
    }

    /// Reads the first word of Open. `None` if the model does not exist.
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

/// Request of the host.
#[derive(Clone, Copy, Debug)]
pub enum Request {
    /// Asks for the identity of the target.
    Identify,
    /// Announces a design.
    Open(Open),
    /// Loads eight words of the design.
    Load {
        /// Position of the first word.
        offset: u32,
        /// Words of the design. Words beyond its end are ignored.
        words: [u32; LOAD],
    },
    /// Starts the complete design with the next sample.
    Start,
    /// Runs one tick.
    Tick {
        /// Sample. Entries beyond the plant order are ignored.
        x: [f32; MAX_N],
        /// Value held by the actuator since the last tick. NaN if not reported. A value beyond 1e12 is ignored.
        applied: f32,
    },
    /// Executes an undefined instruction, to test the output of the trace buffer.
    Fault,
    /// Sets the reference of a drive at the beginning of its next tick, if it differs from the end of the last tick.
    Begin(Target<f32, i32, MAX_N>),
    /// Runs one tick of a drive.
    Drive(Counts),
    /// Switches to the loaded design without a jump of u, and then runs this tick.
    Retune(Counts),
    /// Reads the status of a drive that ticks by its own interrupt.
    Observe,
    /// Starts another plan, from the present plan on.
    Move {
        /// Rest position, or `None` for the nearest reachable position.
        goal: Option<Rest<f32>>,
        /// Number of ticks. 0 takes the fewest ticks within the limits. A stop takes more if necessary.
        ticks: u32,
    },
    /// Switches to the loaded design between two ticks.
    Swap {
        /// Leaves no offset W, for a loop at rest under a wrong model. u may jump.
        at_rest: bool,
    },
    /// Sends an order to the axis.
    Order(Order),
    /// Reads a part of the trace buffer, or of its design.
    Recall(Part),
    /// Disturbs the simulated plant. The firmware of a board refuses this request.
    Disturb(Disturbance),
    /// Prepares the next record, without excitation.
    Prepare {
        /// Number of rows.
        rows: u32,
        /// Number of ticks per row.
        every: u32,
    },
    /// Sets the excitation that is added to u in the ticks of these rows, A.
    Shake {
        /// First row.
        offset: u32,
        /// Currents, A. Currents beyond the last row are ignored.
        currents: [f32; LOAD],
    },
    /// Replaces the simulated plant. The firmware of a board refuses this request.
    Plant(Plant),
}

/// Simulated plant as nine numbers: link inertia (kg m²), link damping (N m s), weight (N m), stiffness (N m), motor
/// inertia, motor damping, torque constant (N m/A), friction (N m), cogging (N m).
///
/// The cogging has 24 periods per revolution. A motor has no link and ignores the first four numbers.
pub type Plant = [f32; REQUEST_WORDS];

/// Order to the axis of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Freezes the trace buffer, as after an alarm.
    Freeze,
    /// Clears the trace buffer and lets it record again.
    Release,
    /// Restarts the controller after a stop, at rest at the present counts. The trace buffer records again.
    Reset,
    /// Begins the prepared record.
    Record,
    /// Ends the record.
    EndRecord,
}

const ORDERS: [Order; 5] = [Order::Freeze, Order::Release, Order::Reset, Order::Record, Order::EndRecord];

/// Part of a trace buffer or of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Instance, number of words and hash of the running design, and its fingerprint.
    Design,
    /// Sixteen words of the design, from this word on.
    DesignWords(u32),
    /// Older half (0) or newer half (1): first tick, number of frames, number of words of the state (0: not started),
    /// and the reference at the beginning of its first tick (turn, r .. r''').
    Half(u32),
    /// Sixteen words of the state of a half, from this word on.
    State(u32, u32),
    /// Frame of a half: [`Counts`] as in Drive, u, health.
    Frame(u32, u32),
    /// Status of the record ([`Tracked`](crate::Tracked)).
    Track,
    /// Five rows of the record, from this row on.
    Rows(u32),
}

/// Disturbance of a simulated plant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disturbance {
    /// Encoders that are frozen.
    pub stuck: [bool; MAX_E],
    /// Encoders that give no count.
    pub lost: [bool; MAX_E],
    /// Torque against the load side, N m.
    pub load_n_m: f32,
    /// Duration of the torque, ticks. 0 for a torque that lasts until the next disturbance.
    pub load_ticks: u32,
}

impl Disturbance {
    /// Returns the frozen encoders (bits 0, 1) and the encoders without a count (bits 2, 3).
    pub fn bits(&self) -> u32 {
        self.stuck.into_iter().chain(self.lost).zip(0..).fold(0, |bits, (is, bit)| bits | u32::from(is) << bit)
    }

    /// Reads these bits.
    fn from_bits(bits: u32, load_n_m: f32, load_ticks: u32) -> Self {
        let [a, b, c, d] = [0, 1, 2, 3].map(|bit| bits >> bit & 1 == 1);
        Self { stuck: [a, b], lost: [c, d], load_n_m, load_ticks }
    }
}

/// Input of a drive for one tick. Entries beyond its order are ignored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    /// Count of each encoder. `None` for a lost count.
    pub counts: [Option<i32>; MAX_E],
    /// Reference at the end of the tick in which u is held.
    pub end: Target<f32, i32, MAX_N>,
    /// Value held by the actuator since the last tick. NaN if not reported.
    pub applied: f32,
}

impl Counts {
    /// Returns nine words: lost counts, counts, turn, r .. r''', and the held u.
    pub fn words(&self) -> [u32; REQUEST_WORDS] {
        let Self { counts: [a, b], end: Target { turn, jet: [r, v, w, z] }, applied } = *self;
        let lost = u32::from(a.is_none()) | u32::from(b.is_none()) << 1;
        let count = |count: Option<i32>| count.unwrap_or(0) as u32;
        let [r, v, w, z, applied] = [r, v, w, z, applied].map(f32::to_bits);
        [lost, count(a), count(b), turn as u32, r, v, w, z, applied]
    }

    /// Reads nine words.
    pub fn from_words([lost, a, b, turn, jet @ .., applied]: [u32; REQUEST_WORDS]) -> Self {
        Self {
            counts: [(lost & 1 == 0).then_some(a as i32), (lost & 2 == 0).then_some(b as i32)],
            end: Target { turn: turn as i32, jet: jet.map(f32::from_bits) },
            applied: f32::from_bits(applied),
        }
    }
}

/// Announcement of a design.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Open {
    /// Configuration and model of the tick.
    pub instance: Instance,
    /// Number of words of the design.
    pub count: u32,
    /// Layout of the words, [`LAYOUT_ID`].
    pub layout: u32,
    /// Version of the controller that made the design, [`CORE_VERSION`].
    pub core_version: u32,
    /// Hash of the design.
    pub design: u32,
}

impl Open {
    /// Announces a design of this program.
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

/// Reply of the target.
#[derive(Clone, Copy, Debug)]
pub enum Reply {
    /// Identity of the target.
    Identity(Identity),
    /// Open, Load or Start is done.
    Done,
    /// Output of a tick.
    Ticked(Ticked),
    /// Output of the tick of a drive.
    Driven(Driven),
    /// Status of a drive that ticks by its own interrupt.
    Observed(Observed),
    /// The drive has another plan.
    Planned {
        /// First tick of the plan.
        start: u32,
        /// Number of ticks from there to rest.
        ticks: u32,
    },
    /// The drive has another design.
    Swapped(Swapped),
    /// Part of the trace buffer or the record.
    Recalled([u32; REPLY_WORDS]),
    /// The request was refused.
    Refused(Refusal),
}

/// Identity of a target. This reply has the same form in every version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Version of the protocol.
    pub version: u8,
    /// Layout of its designs.
    pub layout: u32,
    /// Version of its controller.
    pub core_version: u32,
    /// Sequence number of the last new request.
    pub last_sequence: u32,
}

/// All outputs of a tick.
#[derive(Clone, Copy, Debug)]
pub struct Ticked {
    /// Demanded control u.
    pub u: f32,
    /// Sliding variable σ.
    pub sigma: f32,
    /// Sliding variable σ* without its offset.
    pub sigma_star: f32,
    /// Status flags of the tick.
    pub health: Health,
    /// Estimates d_hat, d_hat', d_hat'' of channels 1..4. Zeros without an observer.
    pub estimates: [[f32; MAX_R]; MAX_N],
}

/// All outputs of a tick of a drive.
#[derive(Clone, Copy, Debug)]
pub struct Driven {
    /// Demanded current u, A.
    pub u: f32,
    /// Sliding variable σ.
    pub sigma: f32,
    /// Sliding variable σ* without its offset.
    pub sigma_star: f32,
    /// Status flags of the tick.
    pub health: Health,
    /// Whole revolutions to add to the positions.
    pub turn: i32,
    /// Position (rad), speed (rad/s), disturbance (rad/s²) and load (N m) of each shaft. Zeros before the start and for
    /// a missing shaft.
    pub estimates: [[f32; 4]; MAX_E],
}

/// Status between two ticks of a drive that ticks by its own interrupt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed {
    /// Number of the coming tick.
    pub tick: u32,
    /// Current u of the last tick, A.
    pub u: f32,
    /// Sliding variable σ* of the last tick.
    pub sigma_star: f32,
    /// Status flags of the last tick.
    pub health: Health,
    /// True if the trace buffer is frozen.
    pub frozen: bool,
    /// True if the controller has started.
    pub started: bool,
    /// True if the plan has not reached its goal.
    pub moving: bool,
    /// Whole revolutions to add to the positions.
    pub turn: i32,
    /// Position (rad), speed (rad/s), disturbance (rad/s²) and load (N m) of each shaft, as in [`Driven`].
    pub estimates: [[f32; 4]; MAX_E],
    /// Reference relative to these revolutions, rad.
    pub reference: f32,
    /// Longest run of the interrupt, in units of its stopwatch.
    pub worst: u32,
    /// Number of late ticks.
    pub missed: u32,
}

/// Result of a switch to another design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swapped {
    /// First tick of the new design.
    pub tick: u32,
    /// Ticks during the computation of the design.
    pub ticks: u32,
    /// Time of the computation by the stopwatch of the target, interrupts included.
    pub time: u32,
    /// u of the last tick before and of the first tick after the switch.
    pub u: [f32; 2],
    /// Fingerprint of the controller.
    pub fingerprint: u32,
}

/// Reason of a refused request, with the two numbers that differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Refusal {
    /// Reason of the refusal.
    pub reason: Reason,
    /// Value of the target.
    pub target: u32,
    /// Value of the request.
    pub request: u32,
}

impl Refusal {
    pub(crate) const fn of(reason: Reason) -> Self {
        Self { reason, target: 0, request: 0 }
    }

    /// Refuses a request that this target does not support.
    pub(crate) fn of_kind(request: &Request) -> Self {
        Self { reason: Reason::Kind, target: 0, request: u32::from(request.to_frame(0)[3]) }
    }
}

/// Reason of a refused request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Reason {
    /// The host uses another [`VERSION`] of the protocol.
    Version = 1,
    /// The host has another [`LAYOUT_ID`].
    Layout,
    /// The host has another [`CORE_VERSION`].
    CoreVersion,
    /// The firmware has no such [`Instance`].
    Instance,
    /// The number of words differs from the instance.
    Count,
    /// The hash differs from the hash of the loaded words.
    Design,
    /// The numbers are not a valid design: not finite, limits reversed, or a period of 0.
    Coefficients,
    /// Load, Start or Tick out of order.
    NotOpen,
    /// A sequence number ahead of the target: the target has restarted.
    OutOfStep,
    /// Unknown kind of request.
    Kind,
    /// The loaded design cannot take over from the running one. The target value is an index of [`RETUNE_ERRORS`].
    Retune,
    /// The goal is not a number or is too far away.
    Goal,
    /// The move exceeds the limits. The target value is the number of ticks that would suffice (0: none).
    TooFast,
    /// An alarm has stopped the drive. Reset it first.
    Stopped,
    /// The drive has not stopped, so there is nothing to reset.
    NotStopped,
    /// The trace buffer is recording. Freeze it first.
    NotFrozen,
    /// The part does not exist, or there are no counts to start from.
    Absent,
    /// The plan was not ready in time.
    Late,
    /// The design has another period than the timer of the drive. Both values are in ns.
    Period,
    /// The trace buffer is frozen, and another design would clear it. Release it or reset the drive first.
    Frozen,
    /// A record is in progress. End it first.
    Recording,
    /// No record was prepared or made.
    NotPrepared,
    /// A current is not a number or exceeds the limits.
    Current,
    /// The drive moves and must be at rest. For a reset the values are the speed of the fastest shaft and its limit,
    /// rad/s as the bits of an `f32`; otherwise 0.
    Moving,
    /// The number of rows is 0 or exceeds the memory or the record, or a row has too many ticks.
    Rows,
}

/// Errors of a switch to another design, in the order of the protocol.
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
    /// Returns the bytes of the frame.
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
                words[..3].copy_from_slice(&[
                    disturbance.bits(),
                    disturbance.load_n_m.to_bits(),
                    disturbance.load_ticks,
                ]);
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

    /// Parses a frame from a [`Receiver`](crate::Receiver). Returns the sequence number and the request.
    ///
    /// # Errors
    /// Returns the refusal that answers an invalid request.
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
            (15, [bits, load, ticks, ..]) => {
                Ok(Self::Disturb(Disturbance::from_bits(bits, f32::from_bits(load), ticks)))
            }
            (16, [rows, every, ..]) => Ok(Self::Prepare { rows, every }),
            (17, [offset, currents @ ..]) => Ok(Self::Shake { offset, currents: currents.map(f32::from_bits) }),
            (18, plant) => Ok(Self::Plant(plant.map(f32::from_bits))),
            _ => refused(Reason::Kind, 0, u32::from(kind)),
        };
        (sequence, request)
    }
}

impl Reply {
    /// Returns the bytes of the frame.
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

    /// Parses a frame from a [`Receiver`](crate::Receiver). Returns the sequence number and the reply, or `None` for an
    /// invalid reply.
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

/// Returns true if mark and checksum are valid.
pub(crate) fn is_whole<const LEN: usize>(frame: &[u8; LEN], mark: [u8; 2]) -> bool {
    let (body, check) = frame.split_at(LEN - 4);
    body.starts_with(&mark) && CRC.checksum(body).to_le_bytes() == *check
}

/// Returns version, kind and sequence number.
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
