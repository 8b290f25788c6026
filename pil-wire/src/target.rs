//! Target side of the protocol: bytes in, replies out. The firmware adds only a serial port, so tests and fuzzers need
//! no chip.

use controller_core::{Coefficients, History, MAX_R, Output, Record};

use crate::drives::MOST_DRIVE_WORDS;
use crate::frame::{Counts, Driven, Open, Refusal, Reply, Request, Ticked};
use crate::running::Loaded;
use crate::session::{Heard, Loading, NOT_OPEN, Session};
use crate::{MAX_N, REPLY_LEN};

/// Largest number of words of a design: n = 4, r = 3 with four observed channels, or the drive of a joint.
const MOST_WORDS: usize = {
    let law = 2 * MAX_N + Coefficients::<f32, MAX_N, MAX_R, MAX_N>::NUMBERS;
    if law > MOST_DRIVE_WORDS { law } else { MOST_DRIVE_WORDS }
};
/// Number of ticks in the trace buffer.
const REMEMBERED: usize = 16;

/// Event for the log of the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A design was started.
    Started(Open),
    /// A request was refused.
    Refused(Refusal),
    /// The host requests a fault: execute an undefined instruction.
    FaultAsked,
}

/// Target with receiver, controller and trace buffer.
pub struct Target {
    session: Session,
    loading: Loading<MOST_WORDS>,
    running: Option<Loaded>,
    ticks: u32,
    black_box: History<f32, MAX_N, REMEMBERED>,
    event: Option<Event>,
}

impl Target {
    /// Returns a target after power-up.
    pub const fn new() -> Self {
        Self {
            session: Session::new(),
            loading: Loading::new(),
            running: None,
            ticks: 0,
            black_box: History::new(),
            event: None,
        }
    }

    /// Returns the frame to send before the first request.
    pub fn hello(&self) -> [u8; REPLY_LEN] {
        Reply::Identity(self.session.identity()).to_frame(0)
    }

    /// Processes one byte from the host. Returns the reply if the byte completes a request.
    pub fn receive(&mut self, byte: u8) -> Option<[u8; REPLY_LEN]> {
        match self.session.hear(byte)? {
            Heard::Answer(frame) => Some(frame),
            Heard::Refused(refusal, frame) => {
                self.event = Some(Event::Refused(refusal));
                Some(frame)
            }
            Heard::New(request) => {
                let reply = request.and_then(|request| self.carry_out(request)).unwrap_or_else(|refusal| {
                    self.event = Some(Event::Refused(refusal));
                    Reply::Refused(refusal)
                });
                Some(self.session.answer(&reply))
            }
        }
    }

    /// Returns the event since the last call, for a log.
    pub const fn take_event(&mut self) -> Option<Event> {
        self.event.take()
    }

    /// Returns the last ticks of the running design, oldest first. A sample is padded with the data of the host. A
    /// sample of a drive is both counts (NaN if lost) and r and r' at the end of the tick.
    pub const fn black_box(&self) -> &History<f32, MAX_N, REMEMBERED> {
        &self.black_box
    }

    fn carry_out(&mut self, request: Request) -> Result<Reply, Refusal> {
        match request {
            Request::Identify => return Ok(Reply::Identity(self.session.identity())),
            Request::Open(open) => self.loading.open(open)?,
            Request::Load { offset, words } => self.loading.load(offset, words)?,
            Request::Start => self.start()?,
            Request::Tick { x, applied } => return self.tick(x, applied),
            Request::Begin(target) => {
                self.running.as_mut().and_then(Loaded::drive).ok_or(NOT_OPEN)?.get().begin(target);
            }
            Request::Drive(counts) => {
                let drive = self.running.as_mut().and_then(Loaded::drive).ok_or(NOT_OPEN)?;
                let driven = drive.get().tick(&counts);
                return Ok(self.driven(&counts, driven));
            }
            Request::Retune(counts) => return self.retune(&counts),
            Request::Fault => self.event = Some(Event::FaultAsked),
            // These requests need a drive with its own interrupt.
            Request::Observe
            | Request::Move { .. }
            | Request::Swap { .. }
            | Request::Order(_)
            | Request::Recall(_)
            | Request::Disturb(_)
            | Request::Prepare { .. }
            | Request::Shake { .. }
            | Request::Plant(_) => return Err(Refusal::of_kind(&request)),
        }
        Ok(Reply::Done)
    }

    fn start(&mut self) -> Result<(), Refusal> {
        let (open, words) = self.loading.loaded()?;
        self.running = Some(Loaded::load(open.instance, words)?);
        self.loading.close();
        self.ticks = 0;
        self.black_box = History::new();
        self.event = Some(Event::Started(open));
        Ok(())
    }

    fn tick(&mut self, x: [f32; MAX_N], applied: f32) -> Result<Reply, Refusal> {
        let law = self.running.as_mut().and_then(Loaded::law).ok_or(NOT_OPEN)?;
        let (output, estimates) = law.tick(&x, applied);
        self.remember(x, output);
        let Output { u, sigma, sigma_star, health } = output;
        Ok(Reply::Ticked(Ticked { u, sigma, sigma_star, health, estimates }))
    }

    fn retune(&mut self, counts: &Counts) -> Result<Reply, Refusal> {
        let (open, words) = self.loading.loaded()?;
        let drive = self.running.as_mut().and_then(Loaded::drive).ok_or(NOT_OPEN)?;
        let driven = drive.retune(open.instance, words, counts)?;
        self.loading.close();
        Ok(self.driven(counts, driven))
    }

    fn driven(&mut self, counts: &Counts, driven: Driven) -> Reply {
        let Driven { u, sigma, sigma_star, health, .. } = driven;
        let [a, b] = counts.counts.map(|count| count.map_or(f32::NAN, |count| count as f32));
        let [r, r_dot, ..] = counts.end.jet;
        self.remember([a, b, r, r_dot], Output { u, sigma, sigma_star, health });
        Reply::Driven(driven)
    }

    fn remember(&mut self, x: [f32; MAX_N], output: Output<f32>) {
        self.black_box.push(Record { tick: self.ticks, x, output });
        self.ticks = self.ticks.wrapping_add(1);
    }
}

impl Default for Target {
    fn default() -> Self {
        Self::new()
    }
}
