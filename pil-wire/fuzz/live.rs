//! Fuzz test (libFuzzer) of a [`Live`] drive. For any requests and encoder counts, u stays within its limits, with or
//! without excitation, and every answer is valid. At the end the drive can be started, moved, tuned and recorded.
//!
//! The input is a script as in `target.rs`. An opcode may also run ticks, whose counts move, jump or are lost.

#![no_main]

use std::cell::Cell;

use controller_core::drive::{ALARMS, Bounds, Encoder, Motor, MotorDesign, MotorDrive, Position, Rest};
use controller_core::{Health, Limits};
use libfuzzer_sys::fuzz_target;
use pil_wire::{
    Disturbance, Instance, LOAD, Live, Machine, Model, Open, Order, Part, REQUEST_LEN, Reply, Request, Row, Seat,
    halves,
};

type Law = MotorDrive<f32, Position, 1>;
const INSTANCE: Instance = Instance { n: 2, r: 3, mask: Instance::TWO_SETS, model: Model::Motor };
const LIMIT_A: f32 = 10.0;
const DESIGN: MotorDesign = {
    let motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
    MotorDesign::by_rule(1e-3, motor, Encoder::absolute(14), Limits::symmetric(LIMIT_A as f64))
};
const BOUNDS: Bounds<1> = Bounds {
    disturbance: [1e4],
    sigma_star: 1e6,
    stuck_ticks: 200,
    wrong_way_ticks: 6,
    patience_ticks: 8,
    brake_per_s: 60.0,
    brake_ticks: 130,
};

/// Rows of the record memory.
const ROWS: usize = 40;

thread_local! {
    /// Memory that the scripts use one after the other.
    static MEMORY: Cell<Option<&'static mut [Row]>> = const { Cell::new(None) };
}

/// Interrupt, with an encoder that follows the script.
struct Chip {
    seat: Seat<Law, 1, 2>,
    count: i32,
    step: i32,
    is_lost: bool,
}

impl Chip {
    fn tick(&mut self) {
        self.count = self.count.wrapping_add(self.step);
        let counts = [(!self.is_lost).then_some(self.count)];
        let is_to_change = self.seat.is_to_change();
        let output = if is_to_change { self.seat.change(counts, None) } else { self.seat.tick(counts, None) };
        // Designs with other limits are not loaded.
        assert!(output.u.abs() <= LIMIT_A, "{output:?}");
    }
}

impl Machine<Law, 1, 2> for Chip {
    fn between<T>(&mut self, work: impl FnOnce(&mut Seat<Law, 1, 2>) -> T) -> T {
        // A tick runs at every opportunity.
        self.tick();
        work(&mut self.seat)
    }

    fn wait(&mut self) {
        self.tick();
    }

    fn disturb(&mut self, _: &Disturbance) -> bool {
        true
    }
}

struct Host {
    live: Live<Law, 1, 2>,
    chip: Chip,
    sequence: u32,
}

impl Host {
    fn new(words: &[u32]) -> Self {
        let (live, law) = Live::new(words.iter().copied()).expect("a good design");
        let chip = Chip { seat: Seat::new(law), count: 0, step: 0, is_lost: false };
        let rows = MEMORY.take().unwrap_or_else(|| vec![Row::default(); ROWS].leak());
        let live = live.recording_in(rows);
        Self { live, chip, sequence: 0 }
    }

    fn send(&mut self, request: &Request, step: i32) -> Option<Reply> {
        self.sequence = self.sequence.wrapping_add_signed(step);
        let frame = request.to_frame(self.sequence);
        let answer = frame.into_iter().filter_map(|byte| self.live.receive(byte, &mut self.chip)).next()?;
        let (_, reply) = Reply::from_frame(&answer);
        assert!(reply.is_some(), "an answer that its own side cannot read");
        reply
    }

    fn load(&mut self, words: &[u32]) {
        self.send(&Request::Open(Open::new(INSTANCE, words)), 1);
        for (k, chunk) in words.chunks(LOAD).enumerate() {
            let loaded = core::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0));
            self.send(&Request::Load { offset: (k * LOAD) as u32, words: loaded }, 1);
        }
    }
}

fn words(design: &MotorDesign) -> Vec<u32> {
    design
        .to_numbers()
        .into_iter()
        .chain(BOUNDS.to_numbers())
        .chain([f64::from(ALARMS.bits())])
        .flat_map(halves)
        .collect()
}

/// Returns the words of a design that hold the limits of u. The script does not change them, so that the limits are
/// fixed.
fn limits() -> std::ops::Range<usize> {
    let other = MotorDesign { limits: Limits::symmetric(1.0), ..DESIGN };
    let differ = |(at, (one, other)): (usize, (u32, u32))| (one != other).then_some(at);
    let at: Vec<usize> = words(&DESIGN).into_iter().zip(words(&other)).enumerate().filter_map(differ).collect();
    (at[0] & !1)..at[at.len() - 1] + 1
}

fuzz_target!(|script: &[u8]| {
    let good = words(&DESIGN);
    let (mut changed, limits) = (good.clone(), limits());
    let mut host = Host::new(&good);
    let mut script = script.iter().copied();
    while let Some(opcode) = script.next() {
        let mut word = || u32::from_le_bytes(core::array::from_fn(|_| script.next().unwrap_or(0)));
        let step = [1, 1, 1, 1, 1, 0, -1, 2][usize::from(opcode >> 5)];
        let more = opcode >> 3 & 3;
        match opcode & 7 {
            0 => {
                let slot = word() as usize % changed.len();
                if !limits.contains(&slot) {
                    changed[slot] = word();
                }
            }
            1 => {
                host.load(if more == 0 { &good } else { &changed });
                host.send(&Request::Swap { at_rest: more == 1 }, 1);
            }
            2 => {
                let goal = (more != 0).then(|| Rest { turn: word() as i32, angle: f32::from_bits(word()) });
                host.send(&Request::Move { goal, ticks: word() >> (8 * more) }, step);
            }
            3 => {
                let orders = [Order::Freeze, Order::Release, Order::Reset, Order::Record, Order::EndRecord];
                host.send(&Request::Order(orders[word() as usize % 5]), step);
            }
            4 => {
                let (half, at) = (word(), word());
                let part = [Part::Half(half), Part::State(half, at), Part::Frame(half, at), Part::Rows(at)];
                let part = if half & 0x100 > 0 { Part::DesignWords(at) } else { part[usize::from(more)] };
                host.send(&Request::Recall(if half & 0x200 > 0 { Part::Track } else { part }), step);
            }
            5 => {
                let word = word();
                host.chip.is_lost = more == 1;
                host.chip.step = if more == 2 { word as i32 } else { (word as i32) >> 20 };
                (0..word & 0x3ff).for_each(|_| host.chip.tick());
            }
            6 => {
                let request = match more {
                    0 => Request::Observe,
                    1 => match word() & 3 {
                        0 => Request::Swap { at_rest: false },
                        1 => Request::Prepare { rows: word() & 0x3f, every: word() & 7 },
                        2 => Request::Prepare { rows: word(), every: word() },
                        _ => {
                            let offset = word() & 0x3f;
                            Request::Shake { offset, currents: [(); LOAD].map(|()| f32::from_bits(word())) }
                        }
                    },
                    2 => Request::Load { offset: word(), words: [(); LOAD].map(|()| word()) },
                    _ => Request::Open(Open { count: word(), ..Open::new(INSTANCE, &changed) }),
                };
                host.send(&request, step);
            }
            _ => {
                for byte in script.by_ref().take(usize::from(more)) {
                    host.live.receive(byte, &mut host.chip);
                }
            }
        }
    }

    // A partially received frame is flushed. The shaft stands still, and the session begins again.
    (host.chip.step, host.chip.is_lost) = (0, false);
    for byte in [0; REQUEST_LEN] {
        host.live.receive(byte, &mut host.chip);
    }
    let Some(Reply::Identity(identity)) = host.send(&Request::Identify, 0) else {
        panic!("a drive that no longer answers");
    };
    host.sequence = identity.last_sequence;
    (0..2000).for_each(|_| host.chip.tick());
    // The script may have loaded a design that stops at no alarm. The valid design detects that the shaft does not
    // follow, and stops.
    host.send(&Request::Order(Order::Release), 1);
    host.load(&good);
    host.send(&Request::Order(Order::EndRecord), 1);
    let swapped = host.send(&Request::Swap { at_rest: false }, 1);
    (0..1000).for_each(|_| host.chip.tick());
    if host.chip.seat.newest().health.contains(Health::STOPPED) {
        assert!(matches!(host.send(&Request::Order(Order::Reset), 1), Some(Reply::Done)), "no way back");
    } else {
        assert!(matches!(swapped, Some(Reply::Swapped(_))), "not tuned: {swapped:?}");
    }
    (0..1000).for_each(|_| host.chip.tick());
    let Some(Reply::Observed(seen)) = host.send(&Request::Observe, 1) else { panic!("not observed") };
    assert!(seen.started && !seen.frozen && !seen.health.contains(Health::STOPPED), "{seen:?}");
    let here = Rest { turn: seen.turn, angle: seen.estimates[0][0] };
    let moved = host.send(&Request::Move { goal: Some(here), ticks: 1000 }, 1);
    assert!(matches!(moved, Some(Reply::Planned { .. })) || seen.turn.unsigned_abs() > 9999, "{moved:?} at {seen:?}");
    assert!(matches!(host.send(&Request::Prepare { rows: 7, every: 3 }, 1), Some(Reply::Done)));
    assert!(matches!(host.send(&Request::Order(Order::Record), 1), Some(Reply::Done)));
    (0..30).for_each(|_| host.chip.tick());
    let Some(Reply::Recalled(is)) = host.send(&Request::Recall(Part::Track), 1) else { panic!("no record") };
    assert!(is[0] == 0 && is[2] == 7, "{is:?}");
    MEMORY.set(host.live.into_rows());
});
