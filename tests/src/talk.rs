//! The host's side of the serial protocol, from the page of `pil-wire`: frames assembled by hand, and a host that
//! records every reply.

use controller_core::{Controller, Linear, ObserverGains, Shape, channels};
use link::remote::Loadable;
use loop_sim::port::in_process::{Download, ModelKind};
use pil_wire::{Event, LOAD, MAX_N, Open, REPLY_LEN, Refusal, Reply, Request, Target, Ticked};

use crate::paper::{NOMINAL, joint_config};

/// Returns the CRC-32, bit by bit: reflected polynomial EDB88320, initial value and final XOR all ones.
pub fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 })
    })
}

/// Assembles a frame by hand, from the tables of the crate's page.
pub fn by_hand(mark: u8, kind: u8, sequence: u32, words: &[u32]) -> Vec<u8> {
    let mut bytes = vec![0x5A, mark, 4, kind];
    bytes.extend(sequence.to_le_bytes());
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    bytes.extend(crc32(&bytes).to_le_bytes());
    bytes
}

/// Returns the joint with observers of order 2 in channels 2 and 4, as numbers.
pub fn joint() -> Download {
    let gains = ObserverGains::as_printed([100.0, 20.0]);
    let model = Linear::<f32, 4>::new(&NOMINAL);
    let controller =
        Controller::<f32, _, 4, 2, { channels(4, 2, [2, 4]) }, 2>::design(&joint_config::<2>(gains), model);
    let numbers = [0.0; 4].into_iter().chain(*model.row()).chain(controller.coefficients().numbers()).collect();
    Download { shape: Shape { n: 4, r: 2, mask: channels(4, 2, [2, 4]) }, model: ModelKind::Linear, numbers }
}

/// Host that follows the protocol and exposes every reply.
#[derive(Default)]
pub struct Host {
    /// Target in this process.
    pub target: Target,
    /// Sequence number of the last new request.
    pub sequence: u32,
    /// Bytes sent so far.
    pub sent: u64,
}

impl Host {
    /// Creates a host with a target just powered up.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sends bytes and returns all replies.
    pub fn send(&mut self, bytes: &[u8]) -> Vec<[u8; REPLY_LEN]> {
        self.sent += bytes.len() as u64;
        bytes.iter().filter_map(|&byte| self.target.receive(byte)).collect()
    }

    /// Sends a new request and returns its reply.
    ///
    /// # Panics
    /// If no readable reply arrives.
    pub fn ask(&mut self, request: &Request) -> Reply {
        self.sequence = self.sequence.wrapping_add(1);
        let replies = self.send(&request.to_frame(self.sequence));
        assert_eq!(replies.len(), 1);
        let (sequence, reply) = Reply::from_frame(&replies[0]);
        assert_eq!(sequence, self.sequence);
        reply.expect("a reply of this version")
    }

    /// Sends a new request and returns the reason of its rejection.
    ///
    /// # Panics
    /// If the target accepts the request.
    pub fn refused(&mut self, request: &Request) -> Refusal {
        match self.ask(request) {
            Reply::Refused(refusal) => {
                assert_eq!(self.target.take_event(), Some(Event::Refused(refusal)));
                refusal
            }
            other => panic!("not refused: {other:?}"),
        }
    }

    /// Sends a new request and checks that the target executes it.
    ///
    /// # Panics
    /// If the target does not execute the request.
    pub fn done(&mut self, request: &Request) {
        let reply = self.ask(request);
        assert!(matches!(reply, Reply::Done), "{reply:?}");
    }

    /// Sends the words of a design, in order.
    ///
    /// # Panics
    /// If the target rejects them.
    pub fn load(&mut self, words: &[u32]) {
        for (k, chunk) in words.chunks(LOAD).enumerate() {
            let mut words = [0; LOAD];
            words[..chunk.len()].copy_from_slice(chunk);
            self.done(&Request::Load { offset: (k * LOAD) as u32, words });
        }
    }

    /// Loads and starts a design.
    ///
    /// # Panics
    /// If the target rejects the design.
    pub fn start(&mut self, design: &Loadable) {
        let open = Open::new(design.instance, &design.words);
        self.done(&Request::Open(open));
        self.load(&design.words);
        self.done(&Request::Start);
        assert_eq!(self.target.take_event(), Some(Event::Started(open)));
    }

    /// Runs one tick on the target.
    ///
    /// # Panics
    /// If the target rejects the request.
    pub fn tick(&mut self, x: [f32; MAX_N], applied: f32) -> Ticked {
        match self.ask(&Request::Tick { x, applied }) {
            Reply::Ticked(ticked) => ticked,
            other => panic!("not ticked: {other:?}"),
        }
    }
}
