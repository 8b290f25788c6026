//! Fuzz test (libFuzzer) of a [`Target`]. No byte string makes it panic or hang. After any input the host can open a
//! design and tick.
//!
//! The input is a script: an opcode and its data. Raw bytes reach the receiver. Whole frames get a valid checksum,
//! which a fuzzer cannot guess, and so reach the code behind the receiver.

#![no_main]

use controller_core::drive::{self, Bounds, Encoder, Motor, MotorDesign};
use controller_core::{
    Config, Limits, Linear, Nominal, ObserverGains, Options, ReachingLaw, Surface, channels, controller,
};
use libfuzzer_sys::fuzz_target;
use pil_wire::{Counts, Instance, LOAD, Model, Open, REQUEST_LEN, Reply, Request, Target, halves};

type Controller2 = controller!(f32, Linear<f32, 2>, order 2, observers of order 2 in [1]);
const INSTANCE: Instance = Instance { n: 2, r: 2, mask: channels(2, 2, [1]), model: Model::Linear };
const CONTROLLER: Controller2 = Controller2::linear(&Config {
    period_s: 1e-3,
    surface: Surface::from_bandwidth(5.0, 1.0),
    observers: [Some(ObserverGains::from_bandwidth::<2>(50.0)), None],
    reaching: ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 },
    nominal: Nominal { gradient: [-2.0, -1.0], input_gain: 2.0 },
    options: Options::NEUTRAL.with_limits(Limits::symmetric(300.0)).with_sigma_star_bound(1.0),
});

/// Drive with the limits of its monitors.
const DRIVE: Instance = Instance { n: 2, r: 3, mask: Instance::TWO_SETS, model: Model::Motor };
const MOTOR: MotorDesign = {
    let motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
    MotorDesign::by_rule(1e-3, motor, Encoder::absolute(14), Limits::symmetric(10.0))
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

struct Host {
    target: Target,
    sequence: u32,
}

impl Host {
    /// Sends a request with a valid checksum. An answer must be valid.
    fn send(&mut self, request: &Request, step: i32) -> Option<Reply> {
        self.sequence = self.sequence.wrapping_add_signed(step);
        let frame = request.to_frame(self.sequence);
        let answer = frame.into_iter().filter_map(|byte| self.target.receive(byte)).next()?;
        let (_, reply) = Reply::from_frame(&answer);
        assert!(reply.is_some(), "an answer that its own side cannot read");
        if let Some(Reply::Driven(driven)) = reply {
            assert!(driven.u.is_finite(), "{driven:?}");
        }
        reply
    }

    fn load(&mut self, instance: Instance, words: &[u32]) {
        self.send(&Request::Open(Open::new(instance, words)), 1);
        for (k, chunk) in words.chunks(LOAD).enumerate() {
            let loaded = core::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0));
            self.send(&Request::Load { offset: (k * LOAD) as u32, words: loaded }, 1);
        }
    }

    fn start(&mut self, instance: Instance, words: &[u32]) -> Option<Reply> {
        self.load(instance, words);
        self.send(&Request::Start, 1)
    }
}

fuzz_target!(|script: &[u8]| {
    let mut host = Host { target: Target::new(), sequence: 0 };
    let mut design = [[0.0; 2], *CONTROLLER.model().row()].concat();
    design.extend(CONTROLLER.coefficients().numbers());
    let mut words: Vec<u32> = design.iter().map(|number| number.to_bits()).collect();
    let good = words.clone();
    let mut drive: Vec<u32> =
        MOTOR.to_numbers().into_iter().chain(BOUNDS.to_numbers()).chain([32.0]).flat_map(halves).collect();

    let mut script = script.iter().copied();
    while let Some(opcode) = script.next() {
        let mut word = || u32::from_le_bytes(core::array::from_fn(|_| script.next().unwrap_or(0)));
        // Mostly the next sequence number, sometimes the same, an older or a later one.
        let step = [1, 1, 1, 1, 1, 0, -1, 2][usize::from(opcode >> 5)];
        match opcode & 7 {
            0 => {
                let slot = word() as usize;
                let words = if opcode & 8 == 0 { &mut words } else { &mut drive };
                let slot = slot % words.len();
                words[slot] = word();
            }
            1 => {
                if opcode & 8 == 0 {
                    host.start(INSTANCE, &words);
                } else if opcode & 16 == 0 {
                    host.start(DRIVE, &drive);
                } else {
                    host.load(DRIVE, &drive);
                }
            }
            2 => {
                let open = Open { count: word(), ..Open::new(INSTANCE, &words) };
                host.send(&Request::Open(open), step);
            }
            3 => {
                let offset = word();
                let words = [(); LOAD].map(|()| word());
                host.send(&Request::Load { offset, words }, step);
            }
            5 => {
                let counts = Counts {
                    counts: [(opcode & 8 == 0).then(|| word() as i32), None],
                    end: drive::Target { turn: word() as i32, jet: [(); 4].map(|()| f32::from_bits(word())) },
                    applied: f32::from_bits(word()),
                };
                let request = match (opcode >> 3) & 3 {
                    2 => Request::Begin(counts.end),
                    3 => Request::Retune(counts),
                    _ => Request::Drive(counts),
                };
                host.send(&request, step);
            }
            4 => {
                let x = [(); 4].map(|()| f32::from_bits(word()));
                host.send(&Request::Tick { x, applied: f32::from_bits(word()) }, step);
            }
            6 => {
                let request = [Request::Start, Request::Fault, Request::Identify][usize::from(opcode >> 3 & 3).min(2)];
                host.send(&request, step);
            }
            _ => {
                for byte in script.by_ref().take(usize::from(opcode >> 3)) {
                    host.target.receive(byte);
                }
            }
        }
    }

    // A partially received frame is flushed. Then the session begins again, as a host begins it.
    for byte in [0; REQUEST_LEN] {
        host.target.receive(byte);
    }
    let Some(Reply::Identity(identity)) = host.send(&Request::Identify, 0) else {
        panic!("a target that no longer answers");
    };
    host.sequence = identity.last_sequence;
    assert!(matches!(host.start(INSTANCE, &good), Some(Reply::Done)), "a design that was good is refused");
    let tick = host.send(&Request::Tick { x: [0.1, 0.0, 0.0, 0.0], applied: f32::NAN }, 1);
    assert!(matches!(tick, Some(Reply::Ticked(ticked)) if ticked.u.is_finite()), "{tick:?}");
});
