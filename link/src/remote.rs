//! Controller on a target behind a serial link.
//!
//! The protocol is lock step: one request, one reply (see [`pil_wire`]). A request without an answer in time is sent
//! again with the same sequence number, so the target never ticks twice for one sample. Replies to other requests are
//! dropped. After [`LONGEST_WAIT`] without an answer the port gives up. Any fault at the other end results in a
//! [`PortError`] and never in a hang.
//!
//! Early repetitions slow down a slow target, because it answers them too. So the wait doubles with each repetition, up
//! to four times the shortest wait. It keeps this length until a request that was sent once is answered and gives the
//! real delay.

use std::time::{Duration, Instant};

use controller_core::drive::{Sample, Target};
use controller_core::{Output, RetuneError};
use loop_sim::MAX_ORDER;
use loop_sim::port::drive::{DriveDesign, Follows, Form, Law, Reaction};
use loop_sim::port::in_process::{Download, ModelKind};
use loop_sim::port::{ControllerPort, PortError, Tick};
use pil_wire::{
    CORE_VERSION, Counts, Driven, Identity, Instance, LAYOUT_ID, LOAD, MAX_N, Model, Open, REPLY_LEN, RETUNE_ERRORS,
    Reason, Receiver, Refusal, Reply, Request, Ticked, VERSION,
};
use scenario::Experiment;

use crate::transport::{Transport, TransportError};

/// Longest wait for any answer.
pub const LONGEST_WAIT: Duration = Duration::from_secs(5);
/// Wait before the first request is repeated.
const ASK_EVERY: Duration = Duration::from_millis(250);

impl From<TransportError> for PortError {
    fn from(TransportError(why): TransportError) -> Self {
        Self::Broken(why)
    }
}

/// Design as protocol words.
#[derive(Clone, Debug, PartialEq)]
pub struct Loadable {
    /// Instance of the tick that the design is for.
    pub instance: Instance,
    /// Words of the design.
    pub words: Vec<u32>,
}

impl From<&Download> for Loadable {
    fn from(download: &Download) -> Self {
        let controller_core::Shape { n, r, mask } = download.shape;
        let model = match download.model {
            ModelKind::Linear => Model::Linear,
            ModelKind::BenchmarkLibm => Model::BenchmarkLibm,
            ModelKind::BenchmarkMicromath => Model::BenchmarkMicromath,
        };
        let words = download.numbers.iter().map(|number| number.to_bits()).collect();
        Self { instance: Instance { n, r, mask, model }, words }
    }
}

/// Converts a drive for a target. The error gives the reason and the remedy.
impl TryFrom<&DriveDesign> for Loadable {
    type Error = String;

    fn try_from(drive: &DriveDesign) -> Result<Self, String> {
        let Form { follows, gain_sets, delay_ticks, observer_states } = drive.form();
        if delay_ticks > 1 {
            return Err(format!(
                "the image on the chip takes a delay of 0 or 1 tick, this drive has drive.delay_ticks = {delay_ticks}: \
                 export it as C or Rust (host-sim export --lang c --standalone, --lang rust)"
            ));
        }
        let (model, n, r) = match drive {
            DriveDesign::Motor(_) => (Model::Motor, 2, if observer_states > 3 { 4 } else { 3 }),
            DriveDesign::Joint(_) => (Model::Joint, 4, if drive.is_whole() { 3 } else { 4 }),
        };
        let flags = [
            (gain_sets > 1, Instance::TWO_SETS),
            (delay_ticks == 1, Instance::LATE),
            (follows == Follows::Speed, Instance::SPEED),
        ];
        let mask = flags.into_iter().filter(|(is, _)| *is).map(|(_, flag)| flag).sum();
        let numbers = drive.numbers().map_err(|error| error.to_string())?;
        let words = numbers.into_iter().flat_map(pil_wire::halves).collect();
        Ok(Self { instance: Instance { n, r, mask, model }, words })
    }
}

/// Returns the design of an experiment for a target.
///
/// # Errors
/// Returns the reason and the remedy if a target cannot run the experiment.
pub fn for_target(experiment: &Experiment) -> Result<Loadable, String> {
    let name = &experiment.name;
    if let Some(drive) = &experiment.drive {
        if drive.designed.fence().is_some() {
            return Err(format!(
                "{name}: the firmware on the chip has no limits of position and speed: remove the table [limits], \
                 --set 'limits={{}}'"
            ));
        }
        let design = Loadable::try_from(&drive.designed).map_err(|error| format!("{name}: {error}"))?;
        if drive.designed.rest_band().is_some() {
            return Err(format!("{name}: the firmware on the chip has no rest band: --set drive.rest_band='off'"));
        }
        return Ok(design);
    }
    match &experiment.download {
        Some(download) if usize::from(download.shape.n) <= MAX_N => Ok(download.into()),
        Some(download) => Err(format!(
            "{name}: a target supports plants up to order {MAX_N}, this plant has order {}; use host-sim run",
            download.shape.n
        )),
        None if experiment.spec.is_none() => {
            Err(format!("{name}: a target supports the proposed controller only; set controller.kind=proposed"))
        }
        None => Err(match experiment.formulas_stay_here() {
            Some(why) => format!("{name}: {why}"),
            None => format!("{name}: a target computes in f32; set controller.precision=f32"),
        }),
    }
}

/// Returns the design of a drive for a target that ticks by its own interrupt.
///
/// # Errors
/// Returns the reason and the remedy if that firmware cannot run the drive.
pub fn for_interrupt(drive: &DriveDesign) -> Result<Loadable, String> {
    if drive.fence().is_some() {
        return Err("limits: the firmware has no limits of position and speed. Remove the table [limits], or set \
                    limits={}"
            .into());
    }
    if matches!(drive.reaction(), Reaction::JoinedStop { .. }) {
        return Err("monitor.reaction = \"joined_stop\": the firmware plans no stop after an alarm. \
                    Set monitor.reaction='brake' or monitor.reaction='fallback'"
            .into());
    }
    Loadable::try_from(drive)
}

/// Traffic counters of a connection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Number of answered requests.
    pub answered: u64,
    /// Number of repeated requests.
    pub repeated: u64,
}

/// Controller that runs on a target.
pub struct Remote<T> {
    wire: Wire<T>,
    /// Design, kept for loading it again.
    design: Loadable,
    observed: Vec<usize>,
    /// Reference at the beginning of the coming tick of a drive, as known to the target.
    begin: Option<Target<f32, i32, MAX_N>>,
    /// Value held since the last tick. NaN if it was not reported.
    applied: f32,
    ticks: u64,
}

impl<T: Transport> Remote<T> {
    /// Connects to the target, checks that its controller has the same version, loads the design and starts it. A
    /// request without an answer within `reply_within` is repeated. Choose `reply_within` longer than a round trip.
    ///
    /// # Errors
    /// Fails if nothing answers, the link breaks, or host and target do not match. The error then names both versions.
    pub fn connect(transport: T, reply_within: Duration, design: Loadable) -> Result<Self, PortError> {
        let instance = design.instance;
        let mut wire = Wire::connect(transport, reply_within)?;
        wire.load(&design)?;
        let observed = (0..usize::from(instance.n)).filter(|i| instance.mask >> i & 1 == 1).collect();
        Ok(Self { wire, design, observed, begin: None, applied: f32::NAN, ticks: 0 })
    }

    /// Returns the traffic so far.
    pub const fn traffic(&self) -> Traffic {
        self.wire.traffic
    }

    /// Returns the link to the target.
    pub const fn transport(&self) -> &T {
        &self.wire.transport
    }

    /// Returns a mutable reference to the link.
    pub const fn transport_mut(&mut self) -> &mut T {
        &mut self.wire.transport
    }

    /// Sends the request for one tick.
    fn asked(&mut self, request: &Request) -> Result<Reply, PortError> {
        let reply = self.wire.ask(request, &format!("tick {}", self.ticks))?;
        self.applied = f32::NAN;
        self.ticks += 1;
        Ok(reply)
    }

    /// Returns the error for an answer that is not a tick.
    fn not_ticked(&self, reply: &Reply) -> PortError {
        let tick = self.ticks.saturating_sub(1);
        PortError::Refused(match reply {
            // The design ran before this request.
            Reply::Refused(Refusal { reason: Reason::NotOpen | Reason::OutOfStep, .. }) => {
                format!("the target restarted at tick {tick} and lost its design")
            }
            Reply::Refused(refusal) => in_words(refusal, self.design.instance),
            _ => format!("invalid reply from the target to tick {tick}"),
        })
    }

    /// Makes the target execute an undefined instruction, to test its fault report. The target does not answer.
    ///
    /// # Errors
    /// Fails if the link is broken.
    pub fn provoke_fault(&mut self) -> Result<(), PortError> {
        let frame = Request::Fault.to_frame(self.wire.sequence.wrapping_add(1));
        Ok(self.wire.transport.send(&frame)?)
    }
}

impl<T: Transport> ControllerPort for Remote<T> {
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let mut x = [0.0; MAX_N];
        for (to, from) in x.iter_mut().zip(sample) {
            *to = *from as f32;
        }
        match self.asked(&Request::Tick { x, applied: self.applied })? {
            Reply::Ticked(ticked) => Ok(widened(&ticked)),
            other => Err(self.not_ticked(&other)),
        }
    }

    fn report_applied(&mut self, u: f64) {
        self.applied = u as f32;
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.wire.load(&self.design)?;
        (self.begin, self.applied, self.ticks) = (None, f32::NAN, 0);
        Ok(())
    }

    fn observed(&self) -> &[usize] {
        &self.observed
    }
}

impl<T: Transport, const E: usize, const N: usize> Law<E, N> for &mut Remote<T> {
    fn tick(
        &mut self,
        sample: &Sample<i32, Target<f32, i32, N>, E>,
    ) -> Result<loop_sim::port::drive::Ticked<E>, PortError> {
        let wide = |target: &Target<f32, i32, N>| Target {
            turn: target.turn,
            jet: std::array::from_fn(|j| target.jet.get(j).copied().unwrap_or(0.0)),
        };
        let (begin, end) = (wide(&sample.begin), wide(&sample.end));
        if self.begin != Some(begin) {
            match self.wire.ask(&Request::Begin(begin), "the beginning of the tick")? {
                Reply::Done => {}
                other => return Err(self.not_ticked(&other)),
            }
        }
        let counts = std::array::from_fn(|i| sample.counts.get(i).copied().flatten());
        match self.asked(&Request::Drive(Counts { counts, end, applied: self.applied }))? {
            Reply::Driven(Driven { u, sigma, sigma_star, health, estimates, .. }) => {
                self.begin = Some(end);
                Ok((Output { u, sigma, sigma_star, health }, std::array::from_fn(|i| estimates[i][2])))
            }
            other => Err(self.not_ticked(&other)),
        }
    }

    fn report_applied(&mut self, u: f32) {
        self.applied = u;
    }

    fn reset(&mut self) -> Result<(), PortError> {
        ControllerPort::reset(*self)
    }

    fn fingerprint(&self) -> Option<u32> {
        None
    }
}

/// Converts the output of a tick to f64, which is exact for every f32.
fn widened(ticked: &Ticked) -> Tick {
    let Ticked { u, sigma, sigma_star, health, estimates } = *ticked;
    let mut wide = [[0.0; _]; MAX_ORDER];
    for (to, from) in wide.iter_mut().zip(estimates) {
        *to = from.map(f64::from);
    }
    Tick { u: f64::from(u), sigma: f64::from(sigma), sigma_star: f64::from(sigma_star), estimates: wide, health }
}

/// Checks that the target and this program have the same controller version.
fn agree(identity: &Identity) -> Result<(), PortError> {
    let Identity { version, layout, core_version, last_sequence: _ } = *identity;
    let reason = if version != VERSION {
        Some((Reason::Version, u32::from(version), u32::from(VERSION)))
    } else if core_version != CORE_VERSION {
        Some((Reason::CoreVersion, core_version, CORE_VERSION))
    } else if layout != LAYOUT_ID {
        Some((Reason::Layout, layout, LAYOUT_ID))
    } else {
        None
    };
    reason.map_or(Ok(()), |(reason, target, host)| Err(PortError::Refused(mismatch(reason, target, host))))
}

/// Part of the message for a request that the firmware does not know.
pub const OTHER_FIRMWARE: &str = "its firmware is another or older";

const REMEDY: &str = "build and flash the firmware of this version (`cargo xtask firmware`)";

fn mismatch(reason: Reason, target: u32, host: u32) -> String {
    let version = |packed: u32| {
        let [_, major, minor, patch] = packed.to_be_bytes();
        format!("{major}.{minor}.{patch}")
    };
    match reason {
        Reason::Version => format!("the target has protocol version {target}, this program {host}; {REMEDY}"),
        Reason::CoreVersion => {
            let (target, host) = (version(target), version(host));
            format!("the target has controller version {target}, this program {host}; {REMEDY}")
        }
        _ => format!("the target has design layout {target:08x}, this program {host:08x}; {REMEDY}"),
    }
}

/// Describes the form of a drive by its scenario keys.
fn form_in_words(instance: Instance) -> String {
    let has = |bit: u8| instance.mask & bit != 0;
    let designed = match instance.model {
        Model::Joint if instance.is_whole() => "joint's drive designed as a whole (drive.tuning = \"coupled\")".into(),
        Model::Joint => "joint's drive with one observer per encoder (drive.tuning = \"normal\", ..)".into(),
        _ => format!("motor's drive with {} states in its observer (drive.observer_states)", instance.r),
    };
    let sets = if has(Instance::TWO_SETS) { "two gain sets" } else { "one gain set" };
    let late = if has(Instance::LATE) { "one tick" } else { "no tick" };
    let follows = if has(Instance::SPEED) { ", speed control" } else { "" };
    format!("{designed}, {sets} (drive.gain_sets), {late} of delay (drive.delay_ticks){follows}")
}

/// Returns the keys of a scenario that select the form of a drive, with their values.
pub fn form_keys(instance: Instance) -> [(&'static str, &'static str); 4] {
    let has = |bit: u8| instance.mask & bit != 0;
    let is_joint = instance.model == Model::Joint;
    let (key, value) = match (is_joint, instance.r) {
        (true, _) if instance.is_whole() => ("drive.tuning", "\"coupled\""),
        (true, _) => ("drive.tuning", "\"normal\", ..: one observer per encoder"),
        (false, 4) => ("drive.observer_states", "4"),
        (false, _) => ("drive.observer_states", "3"),
    };
    [
        (key, value),
        ("drive.gain_sets", if has(Instance::TWO_SETS) { "2" } else { "1" }),
        ("drive.delay_ticks", if has(Instance::LATE) { "1" } else { "0" }),
        ("drive.mode", if has(Instance::SPEED) { "\"speed\"" } else { "\"position\"" }),
    ]
}

/// Returns the message for a refused request.
pub(crate) fn in_words(refusal: &Refusal, instance: Instance) -> String {
    let Refusal { reason, target, request } = *refusal;
    match reason {
        Reason::Version | Reason::Layout | Reason::CoreVersion => mismatch(reason, target, request),
        Reason::Instance if matches!(instance.model, Model::Motor | Model::Joint) => {
            format!("the target's firmware has no {}: {REMEDY}", form_in_words(instance))
        }
        Reason::Instance => {
            let Instance { n, r, mask, model } = instance;
            let channels: Vec<String> =
                (0..8).filter(|i| mask >> i & 1 == 1).map(|i: u32| (i + 1).to_string()).collect();
            let channels = if channels.is_empty() { "none".into() } else { channels.join(", ") };
            let model = match model {
                Model::Linear => "a linear model",
                Model::BenchmarkLibm => "the model of Eq. (59) with libm",
                _ => "the model of Eq. (59) with micromath",
            };
            let instance = format!("n = {n}, r = {r}, observed channels {channels} and {model}");
            format!("the target's firmware has no controller with {instance}")
        }
        Reason::Count => format!("a design of this kind has {target} words on the target, {request} here; {REMEDY}"),
        Reason::Design => {
            format!("the design was changed in transit: its hash is {target:08x} on the target, {request:08x} here")
        }
        Reason::Coefficients => {
            "the target rejects the numbers of the design: not finite, limits reversed, or a period of 0".into()
        }
        Reason::NotOpen | Reason::OutOfStep => {
            "the target restarted, or another program used it, while the design was loaded; try again".into()
        }
        Reason::Retune => match RETUNE_ERRORS.get(target as usize) {
            Some(RetuneError::OtherEncoder) => "encoder and gear are fixed in the firmware. Build firmware from a \
                                                scenario with this encoder"
                .into(),
            Some(error) => format!("the design cannot take over from the one that runs: {error}"),
            None => "the design cannot take over from the one that runs".into(),
        },
        Reason::Kind => format!("the target does not support request {request}: {OTHER_FIRMWARE}"),
        Reason::Goal => "the goal is not a number, or farther than 10000 revolutions from 0".into(),
        Reason::TooFast if target == 0 => "no move there of up to 100 s stays within 90 % of the current limit".into(),
        Reason::TooFast => {
            format!("{request} ticks are too few for 90 % of the current limit, or for a plan: give {target} or more")
        }
        Reason::Stopped => "an alarm has stopped the drive: reset it first".into(),
        Reason::NotStopped => "the drive has not stopped: there is nothing to reset".into(),
        Reason::NotFrozen => "the trace buffer is recording: freeze it first".into(),
        Reason::Frozen => {
            "the trace buffer is frozen, and another design would erase it: save it with `trace FILE`, then \
                           `reset` a stopped drive or `release` the buffer"
                .into()
        }
        Reason::Absent => "the part does not exist, or there is no valid count to start from".into(),
        Reason::Late => "the chip has no time left to plan: its interrupt takes too much".into(),
        Reason::Recording => "a record is in progress: end it first".into(),
        Reason::NotPrepared => "no record was prepared, or none was made".into(),
        Reason::Current => {
            let [most, asked] = [target, request].map(f32::from_bits);
            format!("an excitation of {asked} A is not a number, or beyond {most} A, which the drive can compensate")
        }
        Reason::Rows => {
            format!("{request} rows of a record: expected 1 to {target} rows of 1 to 1000 ticks, at most 60 s in all")
        }
        Reason::Moving if target > 0 => {
            let [speed, most] = [target, request].map(|bits| {
                let rad_s = f32::from_bits(bits);
                format!("{rad_s:.1} rad/s ({:.1} r/min)", rad_s * 30.0 / std::f32::consts::PI)
            });
            format!("a shaft turns at {speed} behind the gear, at most {most}. Wait until it is at rest, then `reset`")
        }
        Reason::Moving => "the drive moves: it must be at rest".into(),
        Reason::Period => {
            let [target, request] = [target, request].map(|nanoseconds| f64::from(nanoseconds) / 1e9);
            format!(
                "drive.period_s = {request}: the firmware ticks every {target} s. Build firmware from a scenario with \
                 this period"
            )
        }
    }
}

/// Returns the error for an unexpected reply.
pub(crate) fn not_that(reply: &Reply, what: &str, instance: Instance) -> PortError {
    PortError::Refused(match reply {
        Reply::Refused(refusal) => in_words(refusal, instance),
        _ => format!("invalid reply from the target to {what}"),
    })
}

/// Request-reply protocol over a transport.
pub(crate) struct Wire<T> {
    pub(crate) transport: T,
    /// Shortest wait before a request is repeated.
    least: Duration,
    /// Present wait before a repetition.
    wait: Duration,
    receiver: Receiver<REPLY_LEN>,
    /// Sequence number of the last request.
    sequence: u32,
    /// Number of bytes received since the last answer.
    heard: u64,
    pub(crate) traffic: Traffic,
}

impl<T: Transport> Wire<T> {
    /// Connects to the target and checks its version.
    pub(crate) fn connect(transport: T, reply_within: Duration) -> Result<Self, PortError> {
        let mut wire = Self {
            transport,
            least: reply_within,
            wait: reply_within,
            receiver: Receiver::of_replies(),
            sequence: 0,
            heard: 0,
            traffic: Traffic::default(),
        };
        let identity = wire.identify()?;
        agree(&identity)?;
        wire.sequence = identity.last_sequence;
        Ok(wire)
    }

    /// Asks for the identity until a target answers. A target that sends its identity at start-up is asked at once,
    /// because only an answer is sure to be current. A target that repeats its identity gets no more time than a silent
    /// one.
    fn identify(&mut self) -> Result<Identity, PortError> {
        let (mut waited, mut greeted) = (Duration::ZERO, false);
        for attempt in 1.. {
            if waited >= LONGEST_WAIT {
                break;
            }
            self.transport.send(&Request::Identify.to_frame(attempt))?;
            let heard = self.hear(ASK_EVERY, |sequence, reply| match reply {
                Reply::Identity(identity) if sequence <= attempt && (sequence > 0 || !greeted) => {
                    Some((sequence, identity))
                }
                _ => None,
            })?;
            match heard {
                Some((1.., identity)) => {
                    self.heard = 0;
                    return Ok(identity);
                }
                Some(_) => greeted = true,
                None => waited += ASK_EVERY,
            }
        }
        Err(self.silent("the first request"))
    }

    /// Loads a design and starts it.
    fn load(&mut self, design: &Loadable) -> Result<(), PortError> {
        self.open(design)?;
        self.done(&Request::Start, "the start", design.instance)
    }

    /// Loads a design without starting it.
    pub(crate) fn open(&mut self, design: &Loadable) -> Result<(), PortError> {
        let Loadable { instance, words } = design;
        self.done(&Request::Open(Open::new(*instance, words)), "the design", *instance)?;
        for (k, chunk) in words.chunks(LOAD).enumerate() {
            let mut words = [0; LOAD];
            words[..chunk.len()].copy_from_slice(chunk);
            let load = Request::Load { offset: (k * LOAD) as u32, words };
            self.done(&load, "the design", *instance)?;
        }
        Ok(())
    }

    /// Sends a request whose reply has no data.
    pub(crate) fn done(&mut self, request: &Request, what: &str, instance: Instance) -> Result<(), PortError> {
        match self.ask(request, what)? {
            Reply::Done => Ok(()),
            other => Err(not_that(&other, what, instance)),
        }
    }

    /// Sends one request and returns its reply.
    pub(crate) fn ask(&mut self, request: &Request, what: &str) -> Result<Reply, PortError> {
        self.sequence = self.sequence.wrapping_add(1);
        let ours = self.sequence;
        let frame = request.to_frame(ours);
        let mut waited = Duration::ZERO;
        while waited < LONGEST_WAIT {
            let sent = Instant::now();
            self.transport.send(&frame)?;
            let wait = self.wait.min(LONGEST_WAIT.saturating_sub(waited));
            let reply = self.hear(wait, |sequence, reply| {
                (sequence == ours && !matches!(reply, Reply::Identity(_))).then_some(reply)
            })?;
            if let Some(reply) = reply {
                if waited.is_zero() {
                    self.wait = self.least.max(2 * sent.elapsed());
                } else {
                    self.traffic.repeated += 1;
                }
                self.traffic.answered += 1;
                self.heard = 0;
                return Ok(reply);
            }
            waited += wait;
            self.wait = (2 * self.wait).min(4 * self.least);
        }
        Err(self.silent(what))
    }

    /// Receives until `wanted` accepts a reply, for at most `within`.
    fn hear<R>(&mut self, within: Duration, wanted: impl Fn(u32, Reply) -> Option<R>) -> Result<Option<R>, PortError> {
        let until = Instant::now() + within;
        let mut left = within;
        while !left.is_zero() {
            let mut bytes = [0; 4 * REPLY_LEN];
            let count = self.transport.receive(&mut bytes, left)?;
            if count == 0 {
                return Ok(None);
            }
            self.heard += count as u64;
            let mut found = None;
            // All bytes are read: any bytes after the wanted reply can only be a copy of it.
            for &byte in &bytes[..count] {
                if let Some(frame) = self.receiver.push(byte)
                    && let (sequence, Some(reply)) = Reply::from_frame(&frame)
                    && found.is_none()
                {
                    found = wanted(sequence, reply);
                }
            }
            if found.is_some() {
                return Ok(found);
            }
            left = until.saturating_duration_since(Instant::now());
        }
        Ok(None)
    }

    fn silent(&self, asked: &str) -> PortError {
        PortError::Silent { asked: asked.into(), heard: self.heard, within: LONGEST_WAIT }
    }
}
