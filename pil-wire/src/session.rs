//! Byte processing of every target: whole frames, repeats from memory, and a design word by word.

use crate::frame::{Identity, Open, Reason, Refusal, Reply, Request};
use crate::receiver::Receiver;
use crate::{CORE_VERSION, LAYOUT_ID, LOAD, REPLY_LEN, REQUEST_LEN, VERSION};

/// Result of a completed frame.
pub(crate) enum Heard {
    /// Query without side effects, or a repeat: the answer.
    Answer([u8; REPLY_LEN]),
    /// Request that is not allowed now: the reason and the answer.
    Refused(Refusal, [u8; REPLY_LEN]),
    /// New request, to be executed and [answered](Session::answer).
    New(Result<Request, Refusal>),
}

/// Request-reply session. A request is executed once, even if it is repeated.
pub(crate) struct Session {
    receiver: Receiver<REQUEST_LEN>,
    /// Sequence number and checksum of the last new request. Another program may use the same number.
    last: u32,
    checksum: [u8; 4],
    /// Reply to this request.
    reply: Option<[u8; REPLY_LEN]>,
}

impl Session {
    pub(crate) const fn new() -> Self {
        Self { receiver: Receiver::of_requests(), last: 0, checksum: [0; 4], reply: None }
    }

    pub(crate) const fn identity(&self) -> Identity {
        Identity { version: VERSION, layout: LAYOUT_ID, core_version: CORE_VERSION, last_sequence: self.last }
    }

    /// Processes one byte from the host.
    pub(crate) fn hear(&mut self, byte: u8) -> Option<Heard> {
        let frame = self.receiver.push(byte)?;
        let (sequence, request) = Request::from_frame(&frame);
        if let Ok(Request::Identify) = request {
            return Some(Heard::Answer(Reply::Identity(self.identity()).to_frame(sequence)));
        }
        let [.., a, b, c, d] = frame;
        let is_the_last = self.checksum == [a, b, c, d];
        // Distance from the last number, on the circle of sequence numbers.
        match sequence.wrapping_sub(self.last) as i32 {
            ..0 => None,
            0 if is_the_last || self.reply.is_none() => self.reply.map(Heard::Answer),
            1 => {
                (self.last, self.checksum) = (sequence, [a, b, c, d]);
                Some(Heard::New(request))
            }
            _ => {
                let refusal = Refusal { reason: Reason::OutOfStep, target: self.last, request: sequence };
                Some(Heard::Refused(refusal, Reply::Refused(refusal).to_frame(sequence)))
            }
        }
    }

    /// Builds and stores the reply to the new request.
    pub(crate) fn answer(&mut self, reply: &Reply) -> [u8; REPLY_LEN] {
        let frame = reply.to_frame(self.last);
        self.reply = Some(frame);
        frame
    }
}

/// Design that is being loaded, of at most `MOST` words.
pub(crate) struct Loading<const MOST: usize> {
    open: Option<Open>,
    words: [u32; MOST],
}

impl<const MOST: usize> Loading<MOST> {
    pub(crate) const fn new() -> Self {
        Self { open: None, words: [0; MOST] }
    }

    pub(crate) fn open(&mut self, open: Open) -> Result<(), Refusal> {
        self.open = None;
        agree(Reason::Layout, LAYOUT_ID, open.layout)?;
        agree(Reason::CoreVersion, CORE_VERSION, open.core_version)?;
        agree(Reason::Count, open.count.min(MOST as u32), open.count)?;
        self.open = Some(open);
        Ok(())
    }

    pub(crate) fn load(&mut self, offset: u32, words: [u32; LOAD]) -> Result<(), Refusal> {
        let open = self.open.ok_or(NOT_OPEN)?;
        agree(Reason::Count, offset.min(open.count), offset)?;
        for (slot, word) in self.words.iter_mut().skip(offset as usize).zip(words) {
            *slot = word;
        }
        Ok(())
    }

    /// Returns the loaded design and its words.
    pub(crate) fn loaded(&self) -> Result<(Open, &[u32]), Refusal> {
        let open = self.open.ok_or(NOT_OPEN)?;
        // `open` checked that they fit.
        let words = &self.words[..(open.count as usize).min(MOST)];
        agree(Reason::Design, crate::design_hash(open.instance, words), open.design)?;
        Ok((open, words))
    }

    /// Ends the loading after the design was taken.
    pub(crate) const fn close(&mut self) {
        self.open = None;
    }
}

pub(crate) const NOT_OPEN: Refusal = Refusal::of(Reason::NotOpen);

pub(crate) fn agree(reason: Reason, target: u32, request: u32) -> Result<(), Refusal> {
    if target == request { Ok(()) } else { Err(Refusal { reason, target, request }) }
}
