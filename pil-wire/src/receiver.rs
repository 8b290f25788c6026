//! Frame detection in a stream of any bytes.

use crate::frame::is_whole;

/// Receiver that collects bytes until the last `LEN` of them are a whole frame. After a damaged frame it goes on at the
/// next possible mark among its bytes, so invalid bytes cost no valid frame.
#[derive(Clone, Debug)]
pub struct Receiver<const LEN: usize> {
    mark: [u8; 2],
    held: [u8; LEN],
    len: usize,
}

impl Receiver<{ crate::REQUEST_LEN }> {
    /// Returns a receiver of requests.
    pub const fn of_requests() -> Self {
        Self { mark: crate::frame::REQUEST_MARK, held: [0; _], len: 0 }
    }
}

impl Receiver<{ crate::REPLY_LEN }> {
    /// Returns a receiver of replies.
    pub const fn of_replies() -> Self {
        Self { mark: crate::frame::REPLY_MARK, held: [0; _], len: 0 }
    }
}

impl<const LEN: usize> Receiver<LEN> {
    /// Accepts one byte. Returns the frame if the byte completes one.
    pub fn push(&mut self, byte: u8) -> Option<[u8; LEN]> {
        self.held[self.len] = byte;
        self.len += 1;
        if self.len == LEN {
            if is_whole(&self.held, self.mark) {
                self.len = 0;
                return Some(self.held);
            }
            self.skip_one();
        } else if !self.may_be_a_frame() {
            self.skip_one();
        }
        None
    }

    /// Returns true if the buffer begins like a frame.
    fn may_be_a_frame(&self) -> bool {
        let seen = self.len.min(2);
        self.held[..seen] == self.mark[..seen]
    }

    /// Drops the first byte and the bytes up to the next possible mark.
    fn skip_one(&mut self) {
        loop {
            self.held.copy_within(1..self.len, 0);
            self.len -= 1;
            if self.may_be_a_frame() {
                return;
            }
        }
    }
}
