//! Tick of the flexible joint and C versions of the law, for measurement and comparison.
//!
//! | type | content |
//! |---|---|
//! | [`Joint`] | the shipped tick, observers of order R in channels 2 and 4 |
//! | [`Naive`] | `c/naive.c`: the equations in loops, with an exponential and a division; `FAST`: at -O3 -ffast-math |
//! | [`Tuned`] | `c/tuned.c`: the folded equations written out; `GUARDED`: with the sample guard of the tick |
//! | [`loops`] | `c/loop.c`, `c/plants.c`: that tick in a loop with the joint, one and 32 in parallel, on the host |
//!
//! All versions compute one law from one design. The coefficients of the C versions are the shipped ones
//! ([`Coefficients::numbers`]), unfolded again for the naive version. The results therefore differ in rounding only
//! (test `yardsticks` of the suite). The crate is `no_std`: the image `chip` measures the code on the target.
#![no_std]

pub mod loops;

use core::ffi::c_void;

use controller_core::{
    Coefficients, Config, Controller, FlexibleJoint, JointParameters, LAYOUT, Limits, Nominal, NominalModel,
    ObserverGains, Options, ReachingLaw, Reading, Real, Surface, channels,
};

/// Shipped controller of the joint.
pub type Joint<T, const R: usize> = Controller<T, FlexibleJoint<T>, 4, R, { channels(4, 2, [2, 4]) }, 2>;

/// Nominal model of the joint.
pub const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Reconstructed).nominal();

/// Returns the measured design: 10 kHz, all observer poles at -100 rad/s, switching term and limits active.
pub const fn config<const R: usize>() -> Config<4, R> {
    let observer = ObserverGains::from_bandwidth::<R>(100.0);
    Config {
        period_s: 1e-4,
        surface: Surface::from_bandwidth(10.0, 10.0),
        observers: [None, Some(observer), None, Some(observer)],
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 },
        nominal: NOMINAL,
        options: Options::NEUTRAL.with_limits(Limits::symmetric(300.0)).with_sigma_star_bound(10.0),
    }
}

/// Returns the shipped controller in f32.
pub const fn joint<const R: usize>() -> Joint<f32, R> {
    Joint::<f32, R>::design(&config(), FlexibleJoint::<f32>::new(&NOMINAL))
}

/// Returns the shipped controller in f64.
pub const fn joint_f64<const R: usize>() -> Joint<f64, R> {
    Joint::<f64, R>::design(&config(), FlexibleJoint::<f64>::new(&NOMINAL))
}

/// Samples without a plant: noise from a linear congruential generator, as large as the joint's states.
#[derive(Clone, Copy, Debug)]
pub struct Noise(u32);

impl Noise {
    /// Creates a generator; equal seeds give equal samples.
    pub const fn new(seed: u32) -> Self {
        Self(seed)
    }

    /// Returns the next sample: up to 0.005 rad, 0.05 rad/s, 0.5 rad/s², 5 rad/s³ in either direction.
    pub fn sample(&mut self) -> [f32; 4] {
        [0.01, 0.1, 1.0, 10.0].map(|size| {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            size * ((self.0 >> 8) as f32 / 16_777_216.0 - 0.5)
        })
    }
}

const _: () = assert!(
    same(
        LAYOUT,
        "rate rate_n theta_n gamma[O][R] c[N] g[O][R] kx[N] kw us k[O][R] satk lim unit decay u_min u_max plausible ko \
         sigma_star_bound hold fallback period input_gain mu2_n check"
    ),
    "the shipped coefficients have a new order: change TunedDesign, and tuned_design in c/law.h, with it"
);

const fn same(one: &str, other: &str) -> bool {
    let (one, other) = (one.as_bytes(), other.as_bytes());
    let mut k = 0;
    while k < one.len() && k < other.len() && one[k] == other[k] {
        k += 1;
    }
    k == one.len() && k == other.len()
}

/// C type `struct tuned_design`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
struct TunedDesign<T, const R: usize> {
    rate: T,
    rate_n: T,
    theta_n: T,
    gamma: [[T; R]; 2],
    c: [T; 4],
    g: [[T; R]; 2],
    kx: [T; 4],
    kw: T,
    us: T,
    k: [[T; R]; 2],
    satk: T,
    lim: T,
    unit: T,
    decay: T,
    u_min: T,
    u_max: T,
    plausible: T,
    ko: T,
    sigma_star_bound: T,
    hold: T,
    fallback: T,
    period: T,
    input_gain: T,
    mu2_n: T,
    row: [T; 3],
}

impl<T: Real, const R: usize> TunedDesign<T, R> {
    fn of(coefficients: &Coefficients<T, 4, R, 2>, model: &FlexibleJoint<T>) -> Self
    where
        FlexibleJoint<T>: NominalModel<T, 4>,
    {
        let mut numbers = coefficients.numbers();
        let mut next = || numbers.next().unwrap_or(T::ZERO);
        let unit = |j: usize| model.drift(&core::array::from_fn(|i| if i == j { T::from_f64(1.0) } else { T::ZERO }));
        // The fields of a literal are computed in their order.
        Self {
            rate: next(),
            rate_n: next(),
            theta_n: next(),
            gamma: rows(&mut next),
            c: row(&mut next),
            g: rows(&mut next),
            kx: row(&mut next),
            kw: next(),
            us: next(),
            k: rows(&mut next),
            satk: next(),
            lim: next(),
            unit: next(),
            decay: next(),
            u_min: next(),
            u_max: next(),
            plausible: next(),
            ko: next(),
            sigma_star_bound: next(),
            hold: next(),
            fallback: next(),
            period: next(),
            input_gain: next(),
            mu2_n: next(),
            row: [0, 2, 3].map(unit),
        }
    }

    /// Returns the rows of the law in the unit of u; the version without a guard needs no other unit.
    fn in_u(self) -> Self {
        let in_u = |entry: T| entry * self.unit;
        Self {
            kx: self.kx.map(in_u),
            kw: in_u(self.kw),
            us: in_u(self.us),
            k: self.k.map(|row| row.map(in_u)),
            satk: in_u(self.satk),
            lim: in_u(self.lim),
            unit: T::from_f64(1.0),
            ..self
        }
    }
}

fn row<T, const L: usize>(next: &mut impl FnMut() -> T) -> [T; L] {
    core::array::from_fn(|_| next())
}

fn rows<T, const R: usize>(next: &mut impl FnMut() -> T) -> [[T; R]; 2] {
    core::array::from_fn(|_| row(next))
}

/// C type `struct tuned_state`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
struct TunedState<const R: usize> {
    d2: [f32; R],
    d4: [f32; R],
    p2: f32,
    p4: f32,
    x2: f32,
    x4: f32,
    w: f32,
    held: f32,
    resuming: i32,
}

/// C version `c/tuned.c`, written by hand from the folded equations. R is 2 or 3.
#[derive(Clone, Copy, Debug)]
pub struct Tuned<const R: usize, const GUARDED: bool> {
    design: TunedDesign<f32, R>,
    state: TunedState<R>,
}

impl<const R: usize, const GUARDED: bool> Tuned<R, GUARDED> {
    /// Creates the state before the first tick, which must get the given sample.
    pub fn start(x0: &[f32; 4]) -> Self {
        Self::of(&joint::<R>(), x0)
    }

    /// Creates the state for another design, before the first tick.
    pub fn of(joint: &Joint<f32, R>, x0: &[f32; 4]) -> Self {
        let k = TunedDesign::of(joint.coefficients(), joint.model());
        let k = if GUARDED { k } else { k.in_u() };
        let drift = k.row[0] * x0[0] + k.row[1] * x0[2] + k.row[2] * x0[3];
        let state = TunedState {
            d2: [0.0; R],
            d4: [0.0; R],
            // Past values that make the first innovation zero.
            p2: -0.5 * x0[2],
            p4: -k.theta_n * drift,
            x2: x0[1],
            x4: x0[3],
            w: x0[3] + k.c[0] * x0[0] + k.c[1] * x0[1] + k.c[2] * x0[2],
            held: 0.0,
            resuming: 1,
        };
        Self { design: k, state }
    }

    /// Runs one tick; returns u.
    #[inline]
    pub fn tick(&mut self, x: &[f32; 4]) -> f32 {
        let tick = match (R, GUARDED) {
            (2, false) => tuned_tick_2,
            (2, true) => tuned_guarded_tick_2,
            (3, false) => tuned_tick_3,
            _ => tuned_guarded_tick_3,
        };
        const { assert!(R == 2 || R == 3, "the C versions are compiled for order 2 and 3") };
        // SAFETY: the structs match c/law.h for this R and live through the call.
        unsafe { tick((&raw const self.design).cast(), (&raw mut self.state).cast(), x) }
    }

    /// Reports the value that the actuator really held.
    pub fn applied(&mut self, u: f32) {
        self.state.held = u;
    }
}

impl<const R: usize> Tuned<R, true> {
    /// Runs one tick, compiled for the chip with GCC's `-frename-registers`; returns u.
    #[inline]
    pub fn tick_renamed(&mut self, x: &[f32; 4]) -> f32 {
        let tick = if R == 2 { tuned_renamed_tick_2 } else { tuned_renamed_tick_3 };
        // SAFETY: as in `tick`.
        unsafe { tick((&raw const self.design).cast(), (&raw mut self.state).cast(), x) }
    }
}

/// C type `struct naive_design`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
struct NaiveDesign<const R: usize> {
    period_s: f32,
    alpha_per_s: f32,
    a: [f32; 4],
    b: f32,
    c: [f32; 4],
    g: [[f32; R]; 4],
    kx: [f32; 4],
    kz: [[f32; R]; 4],
    rho: f32,
    al: f32,
    ks_k: f32,
    isat: f32,
    theta_n: f32,
    w: [f32; 4],
    mean: [[f32; R]; 4],
    l: [[f32; R]; 4],
    u_min: f32,
    u_max: f32,
    observed: [i32; 4],
}

impl<const R: usize> NaiveDesign<R> {
    /// Returns the design with the folding of the shipped design reversed (head of `controller-core/src/design.rs`), in
    /// f64.
    fn unfolded() -> Self {
        let joint = joint_f64::<R>();
        let k = TunedDesign::<f64, R>::of(joint.coefficients(), joint.model()).in_u();
        let (period, b) = (k.period, k.input_gain);
        let switching = k.lim * b.abs();
        let mut naive = Self {
            period_s: period as f32,
            alpha_per_s: config::<R>().surface.alpha_per_s as f32,
            a: NOMINAL.gradient.map(|entry| entry as f32),
            b: b as f32,
            c: k.c.map(|entry| entry as f32),
            g: [[0.0; R]; 4],
            kx: k.kx.map(|entry| (-b * entry) as f32),
            kz: [[0.0; R]; 4],
            rho: (-b * k.us) as f32,
            al: (-b * k.kw) as f32,
            ks_k: switching as f32,
            isat: (-b * k.satk / switching) as f32,
            theta_n: k.theta_n as f32,
            w: [0.5, 0.5, k.theta_n as f32, 0.0],
            mean: [[0.0; R]; 4],
            l: [[0.0; R]; 4],
            u_min: k.u_min as f32,
            u_max: k.u_max as f32,
            observed: [0, 1, 0, 1],
        };
        // Slot of a channel, its number from 0, moments, unit of (A, B, C), entries of A in sigma and in u.
        let channels =
            [(0, 1, 0.5, 1.0 / 3.0, period, k.c[2], k.kx[2]), (1, 3, k.theta_n, k.mu2_n, period * b, 0.0, -1.0)];
        for (slot, i, theta, mu2, unit, of_sigma, of_law) in channels {
            naive.mean[i] = first([1.0, theta, mu2]);
            naive.l[i] = first(taylor_gains(all(k.gamma[slot]), theta, mu2));
            // Channel n never enters sigma.
            let on_sigma = if i == 3 { [0.0; 3] } else { taylor_row(of_sigma, all(k.g[slot]), theta, mu2) };
            let on_law = taylor_row(of_law, all(k.k[slot]), theta, mu2);
            naive.g[i] = first(on_sigma.map(|entry| entry / unit));
            naive.kz[i] = first(on_law.map(|entry| -b * entry / unit));
        }
        naive
    }
}

/// Converts a row on (A, B, C) to a row on the Taylor state S; entry 0 of the shipped rows is unused, `of_a` replaces
/// it.
fn taylor_row(of_a: f64, [_, of_b, of_c]: [f64; 3], theta: f64, mu2: f64) -> [f64; 3] {
    [of_a, of_b + theta * of_a, 2.0 * of_c + mu2 * of_a + (1.0 + 2.0 * theta) * of_b]
}

/// Returns the gains of the observer on S from γ.
fn taylor_gains([g1, g2, g3]: [f64; 3], theta: f64, mu2: f64) -> [f64; 3] {
    let l3 = g3 / 2.0;
    let l2 = g2 - (1.0 + 2.0 * theta) * l3;
    [g1 - theta * l2 - mu2 * l3, l2, l3]
}

/// Returns the row, padded with zeros beyond the order.
fn all<const R: usize>(row: [f64; R]) -> [f64; 3] {
    core::array::from_fn(|m| if m < R { row[m] } else { 0.0 })
}

fn first<const R: usize>(row: [f64; 3]) -> [f32; R] {
    core::array::from_fn(|m| row[m] as f32)
}

/// C type `struct naive_state`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
struct NaiveState<const R: usize> {
    s: [[f32; R]; 4],
    x_prev: [f32; 4],
    a_prev: f32,
    u: f32,
    sigma_0: f32,
    ticks: u32,
}

/// C version `c/naive.c`, a direct transcription of the equations. R is 2 or 3.
#[derive(Clone, Copy, Debug)]
pub struct Naive<const R: usize, const FAST: bool> {
    design: NaiveDesign<R>,
    state: NaiveState<R>,
}

impl<const R: usize, const FAST: bool> Naive<R, FAST> {
    /// Creates the state before the first tick, which starts at its sample.
    pub fn new() -> Self {
        let state = NaiveState { s: [[0.0; R]; 4], x_prev: [0.0; 4], a_prev: 0.0, u: 0.0, sigma_0: 0.0, ticks: 0 };
        Self { design: NaiveDesign::unfolded(), state }
    }

    /// Runs one tick; returns u.
    #[inline]
    pub fn tick(&mut self, x: &[f32; 4]) -> f32 {
        let tick = match (R, FAST) {
            (2, false) => naive_tick_2,
            (2, true) => naive_fast_tick_2,
            (3, false) => naive_tick_3,
            _ => naive_fast_tick_3,
        };
        const { assert!(R == 2 || R == 3, "the C versions are compiled for order 2 and 3") };
        // SAFETY: the structs match c/law.h for this R and live through the call.
        unsafe { tick((&raw const self.design).cast(), (&raw mut self.state).cast(), x) }
    }

    /// Reports the value that the actuator really held.
    pub fn applied(&mut self, u: f32) {
        self.state.u = u;
    }
}

impl<const R: usize, const FAST: bool> Default for Naive<R, FAST> {
    fn default() -> Self {
        Self::new()
    }
}

// build.rs compiles these functions; designs and states have the order in the name.
unsafe extern "C" {
    fn naive_tick_2(design: *const c_void, state: *mut c_void, x: &[f32; 4]) -> f32;
    fn naive_tick_3(design: *const c_void, state: *mut c_void, x: &[f32; 4]) -> f32;
    fn naive_fast_tick_2(design: *const c_void, state: *mut c_void, x: &[f32; 4]) -> f32;
    fn naive_fast_tick_3(design: *const c_void, state: *mut c_void, x: &[f32; 4]) -> f32;
    fn tuned_tick_2(design: *const c_void, state: *mut c_void, x: &[f32; 4]) -> f32;
    fn tuned_tick_3(design: *const c_void, state: *mut c_void, x: &[f32; 4]) -> f32;
    fn tuned_guarded_tick_2(design: *const c_void, state: *mut c_void, x: &[f32; 4]) -> f32;
    fn tuned_guarded_tick_3(design: *const c_void, state: *mut c_void, x: &[f32; 4]) -> f32;
    fn tuned_renamed_tick_2(design: *const c_void, state: *mut c_void, x: &[f32; 4]) -> f32;
    fn tuned_renamed_tick_3(design: *const c_void, state: *mut c_void, x: &[f32; 4]) -> f32;
}
