//! Simulated target that runs a drive in this process. Its ticks pass while the host waits, and it records u of every
//! tick.

use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use controller_core::Limits;
use controller_core::drive::{ALARMS, Encoder, Motor, MotorDesign, MotorDrive, Position};
use link::remote::Loadable;
use link::transport::{Transport, TransportError};
use pil_wire::{Disturbance, Instance, Live, Machine, Model, Row, Seat, halves};

/// Controller of the simulated target.
pub type Law = MotorDrive<f32, Position, 1>;
/// Control period, s.
pub const PERIOD_S: f64 = 1e-3;
const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
/// Design at power-up.
pub const DESIGN: MotorDesign = MotorDesign::by_rule(PERIOD_S, MOTOR, Encoder::absolute(20), Limits::symmetric(10.0));
/// Rows of the trace buffer.
const ROWS: usize = 4000;
/// Ticks that pass while the host waits for a reply.
const PASSING: usize = 7;

/// Returns a design in the form that the host sends.
///
/// # Panics
/// On an invalid design.
pub fn loadable(design: &MotorDesign) -> Loadable {
    let law = Law::try_design(design).unwrap_or(Law::try_design(&DESIGN).expect("a good design"));
    let bounds = design.bounds(&law, 0.2);
    let numbers = design.to_numbers().into_iter().chain(bounds.to_numbers()).chain([f64::from(ALARMS.bits())]);
    let instance = Instance { n: 2, r: 3, mask: Instance::TWO_SETS, model: Model::Motor };
    Loadable { instance, words: numbers.flat_map(halves).collect() }
}

/// Interrupt side of the target: controller and simulated motor.
pub struct Chip {
    seat: Seat<Law, 1, 2>,
    x: [f64; 2],
    count: i32,
    disturbance: Disturbance,
    /// Current command of every tick, A.
    pub u: Vec<f32>,
    /// Encoder count of every tick, including missing counts.
    pub counts: Vec<i32>,
    /// True if the simulated plant accepts disturbances.
    pub is_stand_in: bool,
    /// Ticks that pass before each access from the background.
    pub ticks_between: usize,
}

impl Chip {
    fn tick(&mut self) {
        if !self.disturbance.stuck[0] {
            // The counter wraps; a float saturates.
            self.count = (self.x[0] / TAU * 1_048_576.0).floor() as i64 as i32;
        }
        let counts = [Some(self.count).filter(|_| !self.disturbance.lost[0])];
        let is_to_change = self.seat.is_to_change();
        let output = if is_to_change { self.seat.change(counts, None) } else { self.seat.tick(counts, None) };
        self.u.push(output.u);
        self.counts.push(self.count);
        let torque = MOTOR.torque_n_m_per_a * f64::from(output.u) - f64::from(self.disturbance.load_n_m);
        let friction = 0.005 * (self.x[1] / 0.005).tanh();
        if let Some(left) = self.disturbance.load_ticks.checked_sub(1) {
            self.disturbance.load_ticks = left;
            if left == 0 {
                self.disturbance.load_n_m = 0.0;
            }
        }
        // Ten integration steps per tick, because the friction is steep.
        for _ in 0..10 {
            self.x[1] += 0.1 * PERIOD_S * (torque - friction) / MOTOR.inertia_kg_m2;
            self.x[0] += 0.1 * PERIOD_S * self.x[1];
        }
    }

    /// Returns the true angle, rad.
    pub const fn angle_rad(&self) -> f64 {
        self.x[0]
    }

    /// Returns the true speed, rad/s.
    pub const fn speed_rad_s(&self) -> f64 {
        self.x[1]
    }

    /// Runs this many ticks.
    pub fn pass(&mut self, ticks: usize) {
        (0..ticks).for_each(|_| self.tick());
    }
}

impl Machine<Law, 1, 2> for Chip {
    fn between<T>(&mut self, work: impl FnOnce(&mut Seat<Law, 1, 2>) -> T) -> T {
        (0..self.ticks_between).for_each(|_| self.tick());
        work(&mut self.seat)
    }

    fn wait(&mut self) {
        self.tick();
    }

    fn disturb(&mut self, disturbance: &Disturbance) -> bool {
        self.disturbance = *disturbance;
        self.is_stand_in
    }
}

/// Simulated target at the end of a serial link without delay.
pub struct Bench {
    live: Live<Law, 1, 2>,
    /// Interrupt side of the target.
    pub chip: Chip,
    sent: VecDeque<u8>,
}

impl Bench {
    /// Returns a target just powered up, with [`DESIGN`].
    ///
    /// # Panics
    /// Never: the design is valid.
    pub fn new() -> Self {
        let (live, law) = Live::new(loadable(&DESIGN).words).expect("a good design");
        // Leaked, because memory on a chip lasts as long as the program.
        let live = live.recording_in(vec![Row::default(); ROWS].leak());
        let disturbance = Disturbance::default();
        let chip = Chip {
            seat: Seat::new(law),
            x: [0.0; 2],
            count: 0,
            disturbance,
            u: Vec::new(),
            counts: Vec::new(),
            is_stand_in: true,
            ticks_between: 0,
        };
        Self { sent: live.hello().into(), live, chip }
    }
}

impl Default for Bench {
    fn default() -> Self {
        Self::new()
    }
}

impl Transport for Bench {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        for &byte in bytes {
            self.sent.extend(self.live.receive(byte, &mut self.chip).into_iter().flatten());
        }
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _within: Duration) -> Result<usize, TransportError> {
        (0..PASSING).for_each(|_| self.chip.tick());
        let count = into.len().min(self.sent.len());
        for (to, from) in into.iter_mut().zip(self.sent.drain(..count)) {
            *to = from;
        }
        Ok(count)
    }
}

/// One target shared by several serial links.
#[derive(Clone, Default)]
pub struct Shared(Arc<Mutex<Bench>>);

impl Shared {
    /// Runs a closure with exclusive access to the target.
    ///
    /// # Panics
    /// If another thread panicked while it held the target.
    pub fn with<R>(&self, work: impl FnOnce(&mut Bench) -> R) -> R {
        work(&mut self.0.lock().expect("no holder panics"))
    }
}

impl Transport for Shared {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.with(|bench| bench.send(bytes))
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        self.with(|bench| bench.receive(into, within))
    }
}
