//! Byte streams against the serial protocol: garbage, frame marks, damaged frames, and whole frames with a valid
//! checksum and arbitrary content. After any input the target must accept a design and tick. The host must read back
//! every frame unchanged and find a whole frame after any garbage.

use controller_core::drive::Target;
use integration_tests::strategy::{Rng, Trial};
use integration_tests::talk::{Host, by_hand, joint};
use link::remote::{Loadable, for_target};
use pil_wire::{Counts, MAX_N, Open, REPLY_LEN, REQUEST_LEN, Receiver, Reply, Request};
use scenario::Source;

/// Pieces of a trial, some 20 bytes each.
const PIECES: usize = 500;

pub(super) fn run(_: u64, trial: &mut Trial) -> Result<(), String> {
    if trial.rng.chance(0.5) { to_target(trial) } else { to_host(trial) }
}

/// Returns a word: one with a meaning in some frame, or random bits.
fn word(rng: &mut Rng) -> u32 {
    match rng.integer(0, 3) {
        0 => rng.integer(0, 12) as u32,
        1 => (rng.within(-1.0, 1.0) as f32).to_bits(),
        2 => *rng.one_of(&[0xFA17_FA17, u32::MAX, 0x7FC0_0000, 0x7F80_0000, 1 << 31, 0x000A_0204]),
        _ => rng.bits() as u32,
    }
}

/// Damages a whole frame or replaces it.
fn spoilt(mut frame: Vec<u8>, mark: u8, rng: &mut Rng) -> Vec<u8> {
    let at = rng.integer(0, frame.len() - 1);
    match rng.integer(0, 7) {
        0 => frame.truncate(at),
        1 => frame[at] ^= 1 << rng.integer(0, 7),
        2 => frame = vec![0x5A; at],
        3 => frame = (0..at).map(|_| [0x5A, mark, rng.bits() as u8][rng.integer(0, 2)]).collect(),
        4 => frame = (0..at).map(|_| rng.bits() as u8).collect(),
        _ => {}
    }
    frame
}

/// Returns a motor drive with two gain sets.
fn motor() -> Loadable {
    let source = Source { file: "motor.toml", text: scenario::MOTOR, sets: &[] };
    let mut motor = scenario::parse(&source, "motor").expect("the file that `new` writes");
    motor.leave_rest_band();
    for_target(&motor).expect("one for a target")
}

fn to_target(trial: &mut Trial) -> Result<(), String> {
    let mut host = Host::new();
    let (joint, motor) = (Loadable::from(&joint()), motor());
    let open = Open::new(joint.instance, &joint.words);
    for _ in 0..PIECES {
        let rng = &mut trial.rng;
        // Sequence number: usually the next one, sometimes repeated, older, later or random.
        let far = rng.bits() as i32;
        let step = *rng.one_of(&[1, 1, 1, 1, 1, 0, -1, 2, far]);
        host.sequence = host.sequence.wrapping_add_signed(step);
        let sequence = host.sequence;
        let frame = match rng.integer(0, 7) {
            0 => by_hand(0xE5, rng.integer(0, 11) as u8, sequence, &[(); 9].map(|()| word(rng))),
            1 => Request::Open(Open { count: word(rng), ..open }).to_frame(sequence).to_vec(),
            2 => Request::Open(open).to_frame(sequence).to_vec(),
            3 => Request::Start.to_frame(sequence).to_vec(),
            4 if rng.chance(0.1) => {
                // Loads a design that ticks, so that later input reaches the ticks.
                let design = *rng.one_of(&[&motor, &joint]);
                trial.tell(|| "loaded".into());
                answered(&mut host)?;
                host.start(design);
                continue;
            }
            5 => {
                let counts = Counts {
                    counts: [rng.chance(0.9).then(|| word(rng) as i32), None],
                    end: Target { turn: word(rng) as i32, jet: [(); MAX_N].map(|()| f32::from_bits(word(rng))) },
                    applied: f32::from_bits(word(rng)),
                };
                match rng.integer(0, 9) {
                    0 => Request::Begin(counts.end).to_frame(sequence).to_vec(),
                    1 => Request::Retune(counts).to_frame(sequence).to_vec(),
                    _ => Request::Drive(counts).to_frame(sequence).to_vec(),
                }
            }
            _ => {
                let x = [(); MAX_N].map(|()| f32::from_bits(word(rng)));
                Request::Tick { x, applied: f32::from_bits(word(rng)) }.to_frame(sequence).to_vec()
            }
        };
        let bytes = spoilt(frame, 0xE5, rng);
        trial.tell(|| format!("{bytes:02x?}"));
        for reply in host.send(&bytes) {
            if Reply::from_frame(&reply).1.is_none() {
                return Err(format!("an answer that its own side cannot read: {reply:02x?}"));
            }
        }
    }
    answered(&mut host)?;
    host.start(&joint);
    let ticked = host.tick([0.1, 0.0, 0.0, 0.0], f32::NAN);
    trial.done += host.sent;
    if ticked.u.is_finite() { Ok(()) } else { Err(format!("{ticked:?}")) }
}

/// Flushes a partly received frame, then starts the protocol again as a host does.
fn answered(host: &mut Host) -> Result<(), String> {
    host.send(&[0; REQUEST_LEN]);
    let replies = host.send(&Request::Identify.to_frame(7));
    match replies.first().map(Reply::from_frame) {
        Some((7, Some(Reply::Identity(identity)))) if replies.len() == 1 => {
            host.sequence = identity.last_sequence;
            Ok(())
        }
        other => Err(format!("asked who it is, it says {other:?}")),
    }
}

fn to_host(trial: &mut Trial) -> Result<(), String> {
    let mut receiver = Receiver::of_replies();
    let read = |frame: &[u8; REPLY_LEN]| {
        let (sequence, reply) = Reply::from_frame(frame);
        // A reply must survive writing and reading; NaN keeps its bits.
        let written = reply.map(|reply| reply.to_frame(sequence));
        match written.map(|written| (written, Reply::from_frame(&written))) {
            Some((once, (again, Some(reply)))) if again == sequence && reply.to_frame(sequence) == once => Ok(()),
            Some(other) => Err(format!("{frame:02x?} is read as {other:?}")),
            None => Ok(()),
        }
    };
    for number in 0..PIECES as u32 {
        let rng = &mut trial.rng;
        let kind = if rng.chance(0.1) { rng.bits() as u8 } else { rng.integer(128, 134) as u8 };
        let sequence = if rng.chance(0.5) { number } else { word(rng) };
        let bytes = spoilt(by_hand(0xE6, kind, sequence, &[(); 16].map(|()| word(rng))), 0xE6, rng);
        trial.tell(|| format!("{bytes:02x?}"));
        trial.done += bytes.len() as u64;
        bytes.iter().filter_map(|&byte| receiver.push(byte)).try_for_each(|frame| read(&frame))?;
    }
    // Zeros flush the receiver; it must then find the whole frame.
    let good = Reply::Done.to_frame(trial.rng.bits() as u32);
    let found: Vec<_> = [0; REPLY_LEN].iter().chain(&good).filter_map(|&byte| receiver.push(byte)).collect();
    trial.done += 2 * REPLY_LEN as u64;
    if found.last() == Some(&good) { Ok(()) } else { Err(format!("a whole reply was not found, but {found:02x?}")) }
}
