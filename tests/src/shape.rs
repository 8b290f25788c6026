//! The shipped controller behind one trait, whatever its order n, capacity R, observed channels and precision.
//!
//! All shapes that Eq. (44) allows are here: an observed channel i < n needs R >= n - i, so that the observed channels
//! lie within the last R + 1 ones. 116 shapes in all, each in f32 and f64.

use crate::oracle::{Model, Spec};
use controller_core::{
    Config, ConfigError, Controller, Fallback, Health, Limits, Nominal, NominalModel, ObserverGains, ReachingLaw, Real,
    State, Surface,
};

/// What a tick returns, in f64 (exact for f32).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Control.
    pub u: f64,
    /// sigma, Eq. (44).
    pub sigma: f64,
    /// sigma*, Eq. (17).
    pub sigma_star: f64,
    /// Trouble.
    pub health: Health,
}

/// A controller that remembers its own state.
pub trait Shape {
    /// Starts at `x0` with a guess of the disturbances; false if refused.
    fn start_from(&mut self, x0: &[f64], d_hat: &[f64]) -> bool;
    /// One tick; the sample is rounded to the controller's precision.
    fn tick(&mut self, x: &[f64]) -> Tick;
    /// What the actuator really holds.
    fn applied(&mut self, u: f64);
    /// d_hat^(m) of every channel.
    fn estimates(&self) -> Vec<[f64; 3]>;

    /// Starts at `x0`.
    fn start(&mut self, x0: &[f64]) -> bool {
        self.start_from(x0, &vec![0.0; x0.len()])
    }
}

/// Precision of the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// f32, as on the chip.
    Single,
    /// f64.
    Double,
}

/// [`Model`] in units of b_0.
#[derive(Clone, Copy, Debug)]
pub struct UnitModel<T, const N: usize> {
    row: [T; N],
    bend: T,
    swing: T,
}

impl<T: Real, const N: usize> UnitModel<T, N> {
    /// From the test model.
    pub fn new(model: &Model) -> Self {
        Self {
            row: std::array::from_fn(|j| T::from_f64(model.row[j] / model.input_gain)),
            bend: T::from_f64(model.bend / model.input_gain),
            swing: T::from_f64(model.swing),
        }
    }

    fn bent(x1: T) -> T {
        x1 / (T::from_f64(1.0) + x1.abs())
    }
}

impl<T: Real, const N: usize> NominalModel<T, N> for UnitModel<T, N> {
    fn drift(&self, x: &[T; N]) -> T {
        let mut sum = self.bend * Self::bent(x[0]);
        for j in 0..N {
            sum += self.row[j] * x[j];
        }
        sum
    }

    fn gain_ratio(&self, x: &[T; N]) -> Option<T> {
        (self.swing != T::ZERO).then(|| T::from_f64(1.0) + self.swing * Self::bent(x[0]))
    }
}

/// The configuration that a spec describes.
pub fn config<const N: usize, const R: usize>(spec: &Spec) -> Config<N, R> {
    let gains = |i: usize| {
        spec.observers[i].as_ref().map(|gains| ObserverGains {
            order: gains.l.len(),
            l: std::array::from_fn(|j| gains.l.get(j).copied().unwrap_or(0.0)),
        })
    };
    Config {
        period_s: spec.period_s,
        surface: Surface::from_coefficients(std::array::from_fn(|i| spec.c[i]), spec.alpha),
        observers: std::array::from_fn(gains),
        reaching: ReachingLaw { k_l: spec.k_l, k_s: spec.k_s, epsilon: spec.epsilon },
        nominal: Nominal { gradient: std::array::from_fn(|i| spec.gradient[i]), input_gain: spec.input_gain },
        limits: Limits::symmetric(spec.limit),
        fallback: Fallback::HoldLast,
        sigma_star_bound: 1e12,
        // The poles printed for Example 2 with order 3 (-999.7) and coarse periods are part of the theory's table.
        observer_pole_limit: 100.0,
    }
}

struct Running<T, const N: usize, const R: usize, const MASK: u8, const O: usize> {
    controller: Controller<T, UnitModel<T, N>, N, R, MASK, O>,
    state: Option<State<T, R, O>>,
}

impl<T: Real, const N: usize, const R: usize, const MASK: u8, const O: usize> Shape for Running<T, N, R, MASK, O> {
    fn start_from(&mut self, x0: &[f64], d_hat: &[f64]) -> bool {
        self.state = self.controller.start_from(&rounded(x0), &rounded(d_hat));
        self.state.is_some()
    }

    fn tick(&mut self, x: &[f64]) -> Tick {
        let state = self.state.as_mut().expect("started");
        let output = self.controller.tick(state, &rounded(x));
        Tick {
            u: output.u.to_f64(),
            sigma: output.sigma.to_f64(),
            sigma_star: output.sigma_star.to_f64(),
            health: output.health,
        }
    }

    fn applied(&mut self, u: f64) {
        self.state.as_mut().expect("started").applied(T::from_f64(u));
    }

    fn estimates(&self) -> Vec<[f64; 3]> {
        let estimates = self.controller.estimates(self.state.as_ref().expect("started"));
        estimates.iter().map(|of| std::array::from_fn(|m| of.get(m).map_or(0.0, |value| value.to_f64()))).collect()
    }
}

fn rounded<T: Real, const N: usize>(x: &[f64]) -> [T; N] {
    std::array::from_fn(|i| T::from_f64(x[i]))
}

/// Bit i - 1 for every observed channel i.
pub fn mask(spec: &Spec) -> u8 {
    spec.observed().map(|(i, _)| 1 << i).sum()
}

/// Hands the list of shapes to a macro: (n, R): masks.
macro_rules! with_shapes {
    ($then:ident) => {
        $then! {
            (2, 1): 0b00 0b01 0b10 0b11;
            (2, 2): 0b00 0b01 0b10 0b11;
            (2, 3): 0b00 0b01 0b10 0b11;
            (3, 1): 0b000 0b010 0b100 0b110;
            (3, 2): 0b000 0b001 0b010 0b011 0b100 0b101 0b110 0b111;
            (3, 3): 0b000 0b001 0b010 0b011 0b100 0b101 0b110 0b111;
            (4, 1): 0b0000 0b0100 0b1000 0b1100;
            (4, 2): 0b0000 0b0010 0b0100 0b0110 0b1000 0b1010 0b1100 0b1110;
            (4, 3): 0b0000 0b0001 0b0010 0b0011 0b0100 0b0101 0b0110 0b0111 0b1000 0b1001 0b1010 0b1011 0b1100 0b1101
                0b1110 0b1111;
            (5, 1): 0b00000 0b01000 0b10000 0b11000;
            (5, 2): 0b00000 0b00100 0b01000 0b01100 0b10000 0b10100 0b11000 0b11100;
            (5, 3): 0b00000 0b00010 0b00100 0b00110 0b01000 0b01010 0b01100 0b01110 0b10000 0b10010 0b10100 0b10110
                0b11000 0b11010 0b11100 0b11110;
            (6, 1): 0b000000 0b010000 0b100000 0b110000;
            (6, 2): 0b000000 0b001000 0b010000 0b011000 0b100000 0b101000 0b110000 0b111000;
            (6, 3): 0b000000 0b000100 0b001000 0b001100 0b010000 0b010100 0b011000 0b011100 0b100000 0b100100
                0b101000 0b101100 0b110000 0b110100 0b111000 0b111100;
        }
    };
}

macro_rules! table {
    ($( ($n:literal, $r:literal): $( $mask:literal )* ; )*) => {
        /// Every (n, R, mask) that Eq. (44) allows.
        pub const SHAPES: &[(usize, usize, u8)] = &[ $($( ($n, $r, $mask), )*)* ];
    };
}
with_shapes!(table);

/// Designs the shipped controller with capacity R = `capacity`.
///
/// # Errors
/// What the design refuses.
///
/// # Panics
/// On a shape that Eq. (44) does not allow.
pub fn controller(
    spec: &Spec,
    model: &Model,
    capacity: usize,
    precision: Precision,
) -> Result<Box<dyn Shape>, ConfigError> {
    macro_rules! build {
        ($t:ty, $n:literal, $r:literal, $mask:literal) => {{
            type Built = Controller<$t, UnitModel<$t, $n>, $n, $r, $mask, { ($mask as u8).count_ones() as usize }>;
            let controller = Built::design(&config(spec), UnitModel::new(model))?;
            let running: Box<dyn Shape> = Box::new(Running { controller, state: None });
            Ok(running)
        }};
    }
    macro_rules! dispatch {
        ($( ($n:literal, $r:literal): $( $mask:literal )* ; )*) => {
            match (spec.order(), capacity, mask(spec), precision) {
                $($(
                    ($n, $r, $mask, Precision::Single) => build!(f32, $n, $r, $mask),
                    ($n, $r, $mask, Precision::Double) => build!(f64, $n, $r, $mask),
                )*)*
                shape => panic!("no such shape: {shape:?}"),
            }
        };
    }
    with_shapes!(dispatch)
}
