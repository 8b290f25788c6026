//! The target's side of the talk: bytes in, replies out. The firmware adds a serial port and nothing else, so that all
//! of it can be tested, and fuzzed, without a chip.

use controller_core::drive::{Bounds, JointDesign};
use controller_core::{Coefficients, History, MAX_R, Output, Record};

use crate::frame::{Counts, Driven, Identity, Open, Reason, Refusal, Reply, Request, Ticked};
use crate::receiver::Receiver;
use crate::running::Loaded;
use crate::{CORE_VERSION, LAYOUT_ID, LOAD, MAX_N, REPLY_LEN, REQUEST_LEN, VERSION};

/// Most words that a design has: n = 4, r = 3, four channels observed, or what the drive of a joint is designed from.
const MOST_WORDS: usize = {
    let law = 2 * MAX_N + Coefficients::<f32, MAX_N, MAX_R, MAX_N>::NUMBERS;
    let drive = 2 * (JointDesign::NUMBERS + Bounds::<2>::NUMBERS + 1);
    if law > drive { law } else { drive }
};
/// Ticks that the black box remembers.
const REMEMBERED: usize = 16;

/// What happened, for the log of the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A design was started.
    Started(Open),
    /// A request was refused.
    Refused(Refusal),
    /// The host asks for a fault: run into an undefined instruction.
    FaultAsked,
}

/// A target: receiver, controller, black box.
pub struct Target {
    receiver: Receiver<REQUEST_LEN>,
    /// Sequence number of the last new request.
    last: u32,
    /// The reply to it.
    reply: Option<[u8; REPLY_LEN]>,
    /// The design that is loading.
    open: Option<Open>,
    words: [u32; MOST_WORDS],
    running: Option<Loaded>,
    ticks: u32,
    black_box: History<f32, MAX_N, REMEMBERED>,
    event: Option<Event>,
}

impl Target {
    /// Just powered up.
    pub const fn new() -> Self {
        Self {
            receiver: Receiver::of_requests(),
            last: 0,
            reply: None,
            open: None,
            words: [0; MOST_WORDS],
            running: None,
            ticks: 0,
            black_box: History::new(),
            event: None,
        }
    }

    /// What to send before the first request.
    pub fn hello(&self) -> [u8; REPLY_LEN] {
        Reply::Identity(self.identity()).to_frame(0)
    }

    /// One byte from the host; what to send back, if it completes a request that is answered.
    pub fn receive(&mut self, byte: u8) -> Option<[u8; REPLY_LEN]> {
        let frame = self.receiver.push(byte)?;
        let (sequence, request) = Request::from_frame(&frame);
        if let Ok(Request::Identify) = request {
            return Some(Reply::Identity(self.identity()).to_frame(sequence));
        }
        // How far it is ahead of the last one, on the circle of sequence numbers.
        match sequence.wrapping_sub(self.last) as i32 {
            ..0 => None,
            0 => self.reply,
            1 => {
                self.last = sequence;
                let reply = request.and_then(|request| self.carry_out(request));
                self.reply = Some(self.told(reply).to_frame(sequence));
                self.reply
            }
            _ => {
                let refusal = Refusal { reason: Reason::OutOfStep, target: self.last, request: sequence };
                Some(self.told(Err(refusal)).to_frame(sequence))
            }
        }
    }

    /// What happened since the last call that is worth a line in a log.
    pub const fn take_event(&mut self) -> Option<Event> {
        self.event.take()
    }

    /// The last ticks of the running design, oldest first; samples are filled up with what the host sent. That of a
    /// drive is both counts (NaN for one that is lost), r and r' at the end of the tick.
    pub const fn black_box(&self) -> &History<f32, MAX_N, REMEMBERED> {
        &self.black_box
    }

    fn told(&mut self, reply: Result<Reply, Refusal>) -> Reply {
        reply.unwrap_or_else(|refusal| {
            self.event = Some(Event::Refused(refusal));
            Reply::Refused(refusal)
        })
    }

    fn identity(&self) -> Identity {
        Identity { version: VERSION, layout: LAYOUT_ID, core_version: CORE_VERSION, last_sequence: self.last }
    }

    fn carry_out(&mut self, request: Request) -> Result<Reply, Refusal> {
        match request {
            Request::Identify => return Ok(Reply::Identity(self.identity())),
            Request::Open(open) => self.open(open)?,
            Request::Load { offset, words } => self.load(offset, words)?,
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
        }
        Ok(Reply::Done)
    }

    fn open(&mut self, open: Open) -> Result<(), Refusal> {
        self.open = None;
        let most = MOST_WORDS as u32;
        agree(Reason::Layout, LAYOUT_ID, open.layout)?;
        agree(Reason::CoreVersion, CORE_VERSION, open.core_version)?;
        agree(Reason::Count, open.count.min(most), open.count)?;
        self.open = Some(open);
        Ok(())
    }

    fn load(&mut self, offset: u32, words: [u32; LOAD]) -> Result<(), Refusal> {
        let open = self.open.ok_or(NOT_OPEN)?;
        agree(Reason::Count, offset.min(open.count), offset)?;
        for (slot, word) in self.words.iter_mut().skip(offset as usize).zip(words) {
            *slot = word;
        }
        Ok(())
    }

    /// The design that has been loaded, and its words.
    fn loaded(&self) -> Result<(Open, &[u32]), Refusal> {
        let open = self.open.ok_or(NOT_OPEN)?;
        // `open` saw to it that they fit.
        let words = &self.words[..(open.count as usize).min(MOST_WORDS)];
        agree(Reason::Design, crate::design_hash(open.instance, words), open.design)?;
        Ok((open, words))
    }

    fn start(&mut self) -> Result<(), Refusal> {
        let (open, words) = self.loaded()?;
        self.running = Some(Loaded::load(open.instance, words)?);
        self.open = None;
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
        let (open, words) = self.loaded()?;
        // A copy: they and what runs are parts of the same.
        let (words, count) = (self.words, words.len());
        let drive = self.running.as_mut().and_then(Loaded::drive).ok_or(NOT_OPEN)?;
        let driven = drive.retune(open.instance, &words[..count], counts)?;
        self.open = None;
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

const NOT_OPEN: Refusal = Refusal::of(Reason::NotOpen);

fn agree(reason: Reason, target: u32, request: u32) -> Result<(), Refusal> {
    if target == request { Ok(()) } else { Err(Refusal { reason, target, request }) }
}
