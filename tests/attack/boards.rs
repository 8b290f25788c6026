//! Faulty targets on a simulated serial link. A target works for a while and then misbehaves in one of 28 ways. A run
//! must end in bounded time: with an error message or, if the protocol can recover, with a bit-identical result. Trial
//! K uses fault K modulo 28.

use integration_tests::strategy::{Rng, Trial};
use integration_tests::talk::by_hand;
use link::remote::{LONGEST_WAIT, Remote, for_target};
use link::transport::{Loopback, Transport, TransportError};
use pil_wire::{Identity, REPLY_LEN, Reply, Ticked};
use scenario::{DEFAULT, Experiment, Source, parse};
use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Time limit of a run: the limit of the remote port's page for one answer, times four for a busy machine.
const ENDS: Duration = LONGEST_WAIT.saturating_mul(4);
/// Reply timeout; on a link without delay every wait ends at once.
const REPLY_WITHIN: Duration = Duration::from_millis(50);

type Frame = [u8; REPLY_LEN];

/// Fault of a target.
struct BoardFault {
    name: &'static str,
    ends: Ends,
    /// Range of the number of good replies before the fault begins.
    after: [usize; 2],
    /// Output in place of a reply.
    say: fn(&mut Board, &Frame),
}

/// Required end of a run.
#[derive(Clone, Copy, PartialEq)]
enum Ends {
    /// The run ends with an error.
    Told,
    /// The run ends as with a good target.
    Well,
}

/// Start of the fault: anywhere in the identification, the load or the ticks.
const ANY: [usize; 2] = [0, 80];
/// Start of the fault: the identification.
const FIRST: [usize; 2] = [0, 0];
/// Start of the fault: after the identification.
const LOADING: [usize; 2] = [3, 80];
/// Start of the fault: after a design is announced; an earlier restart loses nothing.
const OPEN: [usize; 2] = [4, 80];

const fn told(name: &'static str, after: [usize; 2], say: fn(&mut Board, &Frame)) -> BoardFault {
    BoardFault { name, ends: Ends::Told, after, say }
}

const fn well(name: &'static str, say: fn(&mut Board, &Frame)) -> BoardFault {
    BoardFault { name, ends: Ends::Well, after: ANY, say }
}

const WAYS: [BoardFault; 28] = [
    told("silent", ANY, |_, _| {}),
    told("garbage for a reply", ANY, |board, _| {
        let bytes = garbage(&mut board.rng);
        board.out.extend(bytes);
    }),
    told("garbage without end", ANY, |board, _| board.babble = Some(|board| garbage(&mut board.rng))),
    told("marks without end", ANY, |board, _| board.babble = Some(|_| vec![0x5A, 0xE6, 0x5A])),
    told("who it is without end", ANY, |board, frame| {
        board.last = *frame;
        board.babble = Some(|board| {
            let (sequence, _) = Reply::from_frame(&board.last);
            reply(&Reply::Identity(identity()), *board.rng.one_of(&[0, sequence, 1]))
        });
    }),
    told("one old reply without end", LOADING, |board, _| board.babble = Some(|board| board.last.to_vec())),
    told("cut replies", ANY, |board, frame| {
        let length = board.rng.integer(0, REPLY_LEN - 1);
        // The next frame follows at once, so a cut frame is never completed.
        board.out.extend(frame[..length].iter().chain(&[0; REPLY_LEN]));
    }),
    told("a bit flipped on the way", ANY, |board, frame| {
        let mut frame = *frame;
        frame[board.rng.integer(0, REPLY_LEN - 1)] ^= 1 << board.rng.integer(0, 7);
        board.out.extend(frame);
    }),
    told("no checksum", ANY, |board, frame| board.out.extend(frame[..REPLY_LEN - 4].iter().chain(&[0; 4]))),
    told("another version of the wire", ANY, |board, frame| {
        let sealed = sealed(frame, |bytes| bytes[2] = 9);
        board.out.extend(sealed);
    }),
    told("another controller", FIRST, |board, frame| {
        board.says(frame, |_| Some(Reply::Identity(Identity { core_version: 0x0001_0203, ..identity() })));
    }),
    told("another layout", FIRST, |board, frame| {
        board.says(frame, |_| Some(Reply::Identity(Identity { layout: 1, ..identity() })));
    }),
    told("everything refused", LOADING, |board, frame| {
        let words = [board.rng.integer(1, 10) as u32, board.rng.bits() as u32, board.rng.bits() as u32];
        let (sequence, _) = Reply::from_frame(frame);
        board.out.extend(by_hand(0xE6, 132, sequence, &filled(&words)));
    }),
    told("a kind that is none", LOADING, |board, frame| {
        let kind = board.rng.integer(133, 255) as u8;
        board.out.extend(sealed(frame, |bytes| bytes[3] = kind));
    }),
    told("everything done", LOADING, |board, frame| board.says(frame, |_| Some(Reply::Done))),
    told("everything ticked", LOADING, |board, frame| {
        let (sequence, _) = Reply::from_frame(frame);
        board.out.extend(by_hand(0xE6, 131, sequence, &[0; 16]));
    }),
    told("u is NaN", LOADING, |board, frame| board.says(frame, |ticked| ticked.map(|it| with_u(it, f32::NAN)))),
    told("u is infinite", LOADING, |board, frame| {
        board.says(frame, |ticked| ticked.map(|it| with_u(it, f32::NEG_INFINITY)));
    }),
    told("health that means nothing", LOADING, |board, frame| {
        let health = board.rng.integer(8, 255) as u8;
        board.out.extend(if frame[3] == 131 { sealed(frame, |bytes| bytes[20] = health) } else { *frame });
    }),
    told("a bit of the result is another", LOADING, |board, frame| {
        let (at, bit) = (board.rng.integer(8, 19), board.rng.integer(0, 7));
        board.out.extend(if frame[3] == 131 { sealed(frame, |bytes| bytes[at] ^= 1 << bit) } else { *frame });
    }),
    well("the reply before", |board, frame| {
        let before = std::mem::replace(&mut board.last, *frame);
        board.out.extend(before);
    }),
    well("late", |board, frame| {
        board.held.push_back(*frame);
        // The host gives up after some twenty repetitions, so the delay stays shorter.
        if board.held.len() > 3 || board.rng.chance(0.4) {
            let late: Vec<Frame> = board.held.drain(..).collect();
            board.out.extend(late.as_flattened());
        }
    }),
    well("everything said twice", |board, frame| board.out.extend([*frame, *frame].as_flattened())),
    well("out of order", |board, frame| match board.held.pop_front() {
        Some(before) => board.out.extend([*frame, before].as_flattened()),
        None => board.held.push_back(*frame),
    }),
    told("restarts", OPEN, |board, frame| {
        if board.is_first {
            board.inner.restart();
        } else {
            board.out.extend(frame);
        }
    }),
    told("numbers of the future", ANY, |board, frame| {
        let ahead = board.rng.integer(1 << 20, 1 << 30) as u32;
        board.out.extend(sealed(frame, |bytes| {
            let (sequence, _) = Reply::from_frame(bytes);
            bytes[4..8].copy_from_slice(&sequence.wrapping_add(ahead).to_le_bytes());
        }));
    }),
    well("a byte at a time", |board, frame| {
        board.is_dribbling = true;
        board.out.extend(frame);
    }),
    told("the wire breaks", ANY, |board, _| board.is_broken = true),
];

/// Faulty target in this process.
struct Board {
    inner: Loopback,
    way: &'static BoardFault,
    rng: Rng,
    /// Good replies left before the fault.
    good: usize,
    /// True before the first faulty reply.
    is_first: bool,
    out: VecDeque<u8>,
    /// Last correct reply.
    last: Frame,
    held: VecDeque<Frame>,
    babble: Option<fn(&mut Self) -> Vec<u8>>,
    is_dribbling: bool,
    is_broken: bool,
}

impl Board {
    /// Replaces a reply by another reply to the same request; `None` keeps the reply.
    fn says(&mut self, frame: &Frame, other: fn(Option<Ticked>) -> Option<Reply>) {
        let (sequence, read) = Reply::from_frame(frame);
        let ticked = if let Some(Reply::Ticked(ticked)) = read { Some(ticked) } else { None };
        let said = other(ticked).map_or(*frame, |reply| reply.to_frame(sequence));
        self.out.extend(said);
    }
}

fn with_u(ticked: Ticked, u: f32) -> Reply {
    Reply::Ticked(Ticked { u, ..ticked })
}

fn garbage(rng: &mut Rng) -> Vec<u8> {
    (0..rng.integer(1, 2 * REPLY_LEN)).map(|_| rng.bits() as u8).collect()
}

fn reply(reply: &Reply, sequence: u32) -> Vec<u8> {
    reply.to_frame(sequence).to_vec()
}

/// Returns the identity of a good target.
fn identity() -> Identity {
    let hello = Reply::from_frame(&pil_wire::Target::new().hello());
    let (_, Some(Reply::Identity(identity))) = hello else { unreachable!("a target says hello") };
    identity
}

fn filled(words: &[u32]) -> [u32; 16] {
    std::array::from_fn(|k| words.get(k).copied().unwrap_or(0))
}

/// Returns a changed frame with a matching checksum.
fn sealed(frame: &Frame, change: impl FnOnce(&mut Frame)) -> Frame {
    let mut frame = *frame;
    change(&mut frame);
    let (body, check) = frame.split_at_mut(REPLY_LEN - 4);
    check.copy_from_slice(&pil_wire::checksum(body).to_le_bytes());
    frame
}

impl Transport for Board {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        if self.is_broken { Err(TransportError("unplugged".into())) } else { self.inner.send(bytes) }
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        let mut bytes = [0; 16 * REPLY_LEN];
        let count = self.inner.receive(&mut bytes, within)?;
        // A target replies in whole frames.
        for frame in bytes[..count].as_chunks::<REPLY_LEN>().0 {
            if self.good > 0 {
                self.good -= 1;
                self.out.extend(frame);
                self.last = *frame;
            } else {
                (self.way.say)(self, frame);
                self.is_first = false;
            }
        }
        if self.is_broken {
            return Err(TransportError("unplugged".into()));
        }
        if self.out.is_empty()
            && let Some(babble) = self.babble
        {
            // Speed of a fast port; the wait leaves the processor to other threads.
            std::thread::sleep(Duration::from_millis(1).min(within));
            let more = babble(self);
            self.out.extend(more);
        }
        let most = if self.is_dribbling { 1 } else { into.len() };
        let count = most.min(self.out.len());
        for (to, from) in into.iter_mut().zip(self.out.drain(..count)) {
            *to = from;
        }
        Ok(count)
    }
}

fn experiment() -> Experiment {
    let sets = ["span_s=0.1", "window_s=[0, 0.1]"].map(String::from);
    parse(&Source { file: "default.toml", text: DEFAULT, sets: &sets }, "default").expect("the default scenario")
}

pub(super) fn run(number: u64, trial: &mut Trial) -> Result<(), String> {
    let way = &WAYS[(number % WAYS.len() as u64) as usize];
    let good = trial.rng.integer(way.after[0], way.after[1]);
    trial.tell(|| format!("{}, after {good} good replies", way.name));
    trial.done += 1;
    let board = Board {
        inner: Loopback::new(),
        way,
        rng: Rng::new(trial.rng.bits()),
        good,
        is_first: true,
        out: VecDeque::new(),
        last: [0; REPLY_LEN],
        held: VecDeque::new(),
        babble: None,
        is_dribbling: false,
        is_broken: false,
    };
    let mut experiment = experiment();
    let download = for_target(&experiment).expect("one for a target");
    let began = Instant::now();
    let (error, ticks) = match Remote::connect(board, REPLY_WITHIN, download.clone()) {
        Err(error) => (Some(error.to_string()), None),
        Ok(mut remote) => {
            let (trace, error) = experiment.run_beside(Some(&mut remote), &mut |_| ControlFlow::Continue(()));
            let ticked = remote.transport().inner.ticks() as usize;
            (error.map(|error| error.to_string()), Some((trace.rows.len(), ticked)))
        }
    };
    let told = || format!("{}, after {good} good replies: {error:?}, {ticks:?} ticks", way.name);
    trial.tell(told);
    if began.elapsed() > ENDS {
        return Err(format!("{} in {:?}", told(), began.elapsed()));
    }
    let all = experiment.periods + 1;
    match (&error, way.ends) {
        (Some(message), Ends::Told) if !message.is_empty() && message.lines().count() == 1 => Ok(()),
        (None, Ends::Well) if ticks == Some((all, all)) => Ok(()),
        _ => Err(told()),
    }
}
