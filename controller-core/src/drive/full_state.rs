//! Law of the paper on any chain, along a reference, for plants whose whole state is measured.
//!
//! It is the tick of [`Controller`] on $z(x)$ and $a_z(x)$ of a [`ChainModel`]. Its surface works on
//! $e_j = z_j - r^{(j-1)}$ at the start of the tick in which u is held. Δ is the change of the reference until the end
//! of that tick:
//!
//! $$ u = \frac{v(e)}{b} - \frac{a_z}{b} - A_n + \frac{1}{b} \left( \frac{\Delta r^{(n-1)}}{t_1} -
//!    \theta_n \sum_{j<n} \frac{\partial a_z}{\partial z_j} \Delta r^{(j-1)} \right), \qquad
//!    t_1 = T \phi_1(-\lambda T) $$
//!
//! Observers see z and never the reference. For a joint, observe the channels 2, 3 and 4: the map spreads the
//! disturbances of the link over all of them. With a tick of delay the law is evaluated one tick ahead. It uses
//! $y = z + A$, the u that is held meanwhile, $p = a_z + b A_n + b u$, and the gradient g of a_z:
//!
//! $$ \delta_i = \sum_{j>i} y_j \frac{T^{j-i}}{(j-i)!} + p \frac{T^{n-i+1}}{(n-i+1)!} \quad (i < n), \qquad
//!    \delta_n = t_1 (p + \theta_n g \cdot \delta_{<n}), $$
//! $$ z \leftarrow z + \delta, \qquad a_z \leftarrow a_z + g \cdot \delta_{<n} - \lambda \delta_n, \qquad
//!    A \leftarrow A + B + C $$
//!
//! This form needs measured speeds. With differences of a 20-bit encoder u has 11 times the noise of an
//! [`EncoderForm`](super::EncoderForm) on these counts. Use it for tachometers, simulation and reproduction.

use core::marker::PhantomData;

use super::chain::ChainModel;
use super::target::Aim;
use crate::config::Config;
use crate::controller::{Controller, Course, Output, weighed};
use crate::error::ConfigError;
use crate::exponential::phi_functions;
use crate::model::{Linear, NominalModel};
use crate::real::{Count as _, Real, row_f32};
use crate::running::{ControlLaw, RetuneError, Words, each_word, hash, next};
use crate::state::State;

/// Designed law over a measured state, which a tick never changes.
///
/// * `T`: precision, `f32` or `f64`
/// * `M`: the map of E blocks, see [`ChainModel`]
/// * `A`: [`Position`](super::Position), or [`Hold`](super::Hold) for angle 0
/// * `E`, `N`: blocks, and the order 2 E of the chain
/// * `R`, `MASK`, `O`: observers as for a [`Controller`]
/// * `LATE`: ticks between computation and output of u, 0 or 1
///
/// ```
/// use controller_core::drive::{FullState, Joint, JointModel, Measured, Position, Target};
/// use controller_core::{Config, ObserverGains, Options, ReachingLaw, Running, Surface, channels};
///
/// const OBSERVED: u8 = channels(4, 2, [2, 3, 4]);
/// type Law = FullState<f32, JointModel<f32>, Position, 2, 4, 2, OBSERVED, 3, 0>;
/// const SLOW: ObserverGains<2> = ObserverGains::from_bandwidth::<2>(20.0);
/// const CONFIG: Config<4, 2> = Config {
///     period_s: 1e-3,
///     surface: Surface::from_bandwidth(20.0, 10.0),
///     observers: [None, Some(SLOW), Some(SLOW), Some(ObserverGains::from_bandwidth::<2>(200.0))],
///     reaching: ReachingLaw { k_l: 50.0, k_s: 0.0, epsilon: 0.01 },
///     nominal: Joint::TABLE_I.model().nominal(),
///     options: Options::NEUTRAL,
/// };
/// let law = Law::try_design(&CONFIG, Joint::TABLE_I.model().in_f32()).expect("a good design");
/// let mut running = Running::new(law);
/// let at = Target { turn: 0, jet: [0.0; 4] };
/// // Link and motor at 0.1 rad; what the block of the motor calls its position is k_1 times its angle.
/// let output = running.tick(&Measured { x: [0.1, 0.0, 3.9, 0.0], begin: at, end: at });
/// assert!(output.health.is_ok());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct FullState<
    T,
    M,
    A,
    const E: usize,
    const N: usize,
    const R: usize,
    const MASK: u8,
    const O: usize,
    const LATE: usize,
> {
    law: Controller<T, Linear<T, N>, N, R, MASK, O>,
    map: M,
    row: Row<T, N>,
    of: PhantomData<A>,
}

/// Coefficients of the reference and of the prediction by one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Row<T, const N: usize> {
    /// Feedforward ff/b on Δr, Δr', ..
    feed: [T; N],
    /// Gradient ∂a_z/∂z, whose last entry is -λ.
    gradient: [T; N],
    /// Powers T^k/k!. Entry 0 is not read.
    powers: [T; N],
    /// Effect T^(n-i+1)/(n-i+1)! of an acceleration in the last channel.
    push: [T; N],
    /// Constants t_1, θ_n, b, 1/b.
    t_1: T,
    theta_n: T,
    b: T,
    per_b: T,
    period: T,
    /// Full circle 2π.
    turn: T,
}

impl<const N: usize> Row<f64, N> {
    const fn of<const R: usize>(config: &Config<N, R>) -> Self {
        let (t, b, gradient) = (config.period_s, config.nominal.input_gain, config.nominal.gradient);
        let phi = phi_functions(gradient[N - 1] * t);
        let (t_1, theta_n) = (t * phi[1], phi[2] / phi[1]);
        let (mut powers, mut push, mut feed) = ([1.0; N], [t; N], [1.0 / (t_1 * b); N]);
        let mut k = 1;
        while k < N {
            powers[k] = powers[k - 1] * t / k as f64;
            push[N - 1 - k] = powers[k] * t / (k + 1) as f64;
            feed[k - 1] = -theta_n * gradient[k - 1] / b;
            k += 1;
        }
        Self { feed, gradient, powers, push, t_1, theta_n, b, per_b: 1.0 / b, period: t, turn: core::f64::consts::TAU }
    }

    const fn in_f32(&self) -> Row<f32, N> {
        Row {
            feed: row_f32(&self.feed),
            gradient: row_f32(&self.gradient),
            powers: row_f32(&self.powers),
            push: row_f32(&self.push),
            t_1: self.t_1 as f32,
            theta_n: self.theta_n as f32,
            b: self.b as f32,
            per_b: self.per_b as f32,
            period: self.period as f32,
            turn: self.turn as f32,
        }
    }
}

/// Input of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured<T, G, const N: usize> {
    /// Measured state, in the units of the blocks: position and speed of each. Positions lie within a few revolutions
    /// of 0.
    pub x: [T; N],
    /// Target at the start of the tick in which u is held: now, or in one tick with a tick of delay.
    pub begin: G,
    /// Target at the end of that tick.
    pub end: G,
}

/// State of a [`FullState`] between two ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct FullStateMemory<T: Copy, const N: usize, const R: usize, const MASK: u8, const O: usize, const LATE: usize> {
    within: State<T, Linear<T, N>, N, R, MASK, O>,
    /// With a tick of delay: the u that the actuator holds now.
    queued: [T; LATE],
}

impl<T: Real, const N: usize, const R: usize, const MASK: u8, const O: usize, const LATE: usize> Words
    for FullStateMemory<T, N, R, MASK, O, LATE>
{
    fn words(&self) -> impl Iterator<Item = u32> {
        self.within.words().chain(self.queued.iter().flat_map(each_word))
    }

    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let within = State::from_words(words)?;
        let mut queued = [T::ZERO; LATE];
        for number in &mut queued {
            *number = next(words)?;
        }
        Some(Self { within, queued })
    }
}

macro_rules! design_in {
    ($t:ty, $($in_f32:ident)?) => {
        impl<M, A, const E: usize, const N: usize, const R: usize, const MASK: u8, const O: usize, const LATE: usize>
            FullState<$t, M, A, E, N, R, MASK, O, LATE>
        {
            /// Designs the law from the numbers of a controller on this chain, and its map.
            ///
            /// The configuration's [`nominal`](Config::nominal) is the gradient of a_z at 0, and b.
            ///
            /// # Errors
            /// Returns the errors of [`Controller::try_design`].
            pub const fn try_design(config: &Config<N, R>, map: M) -> Result<Self, ConfigError>
            where
                M: Copy,
            {
                match Controller::<$t, Linear<$t, N>, N, R, MASK, O>::try_linear(config) {
                    Ok(law) => Ok(Self { law, map, row: Row::of(config)$(.$in_f32())?, of: PhantomData }),
                    Err(error) => Err(error),
                }
            }
        }
    };
}
design_in!(f32, in_f32);
design_in!(f64,);

/// Reference of one tick.
#[derive(Clone, Copy)]
struct Along<'a, T: Real, A: Aim<T, N>, const N: usize, const LATE: usize> {
    row: &'a Row<T, N>,
    /// Drift a_z/b.
    drift: T,
    begin: A::Target,
    feed: Option<T>,
    queued: [T; LATE],
}

impl<T: Real, A: Aim<T, N>, const N: usize, const LATE: usize> Course<T, N> for Along<'_, T, A, N, LATE> {
    const LATE: bool = LATE == 1;

    #[inline(always)]
    fn drift<M: NominalModel<T, N>>(&self, _: &M, _: &[T; N]) -> T {
        self.drift
    }

    #[inline(always)]
    fn ahead(&self, y: &[T; N], input_drift: T, growth: &[T; N]) -> ([T; N], T) {
        let k = self.row;
        let mut push = input_drift;
        for queued in self.queued {
            push += queued;
        }
        let push = push * k.b;
        let mut moved = [T::ZERO; N];
        let mut bend = T::ZERO;
        for i in 0..N - 1 {
            moved[i] = push * k.push[i];
            for j in i + 1..N {
                moved[i] += y[j] * k.powers[j - i];
            }
            bend += k.gradient[i] * moved[i];
        }
        moved[N - 1] = k.t_1 * (push + k.theta_n * bend);
        bend += k.gradient[N - 1] * moved[N - 1];
        let mut ahead = *y;
        for i in 0..N {
            ahead[i] += moved[i];
            if i > 0 {
                ahead[i] += growth[i - 1];
            }
        }
        (ahead, input_drift + bend * k.per_b + growth[N - 1])
    }

    #[inline(always)]
    fn error(&self, y: [T; N]) -> [T; N] {
        A::errors(&y, T::Count::of(0), self.row.turn, &self.begin)
    }

    #[inline(always)]
    fn weighed(&self, c: &[T; N], y: &[T; N]) -> T {
        weighed(c, &self.error(*y))
    }

    #[inline(always)]
    fn feed(&self) -> Option<T> {
        self.feed
    }
}

impl<T, M, A, const E: usize, const N: usize, const R: usize, const MASK: u8, const O: usize, const LATE: usize>
    FullState<T, M, A, E, N, R, MASK, O, LATE>
where
    T: Real,
    M: ChainModel<T, E, N>,
    A: Aim<T, N>,
{
    const SHAPE: () = assert!(
        N == 2 * E && LATE <= 1 && A::POSITION,
        "a law over a measured state has N = 2 E, at most one tick of delay, and a position to follow"
    );

    /// Returns the controller on the chain.
    #[doc(hidden)]
    pub const fn controller(&self) -> &Controller<T, Linear<T, N>, N, R, MASK, O> {
        &self.law
    }

    /// Returns the model of the blocks.
    #[doc(hidden)]
    pub const fn model(&self) -> &M {
        &self.map
    }

    /// Converts every number to another scalar, by name and index in a row. Controller and model are already converted.
    #[doc(hidden)]
    pub fn converted<U: Real, V>(
        &self,
        law: Controller<U, Linear<U, N>, N, R, MASK, O>,
        map: V,
        to: &mut dyn FnMut(&'static str, usize, T) -> U,
    ) -> FullState<U, V, A, E, N, R, MASK, O, LATE> {
        let Row { feed, gradient, powers, push, t_1, theta_n, b, per_b, period, turn } = self.row;
        let mut each = |name, row: [T; N]| core::array::from_fn(|j| to(name, j + 1, row[j]));
        let [feed, gradient, powers, push] =
            [("feed", feed), ("gradient", gradient), ("power", powers), ("push", push)]
                .map(|(name, row)| each(name, row));
        let row = Row {
            feed,
            gradient,
            powers,
            push,
            t_1: to("t_1", 0, t_1),
            theta_n: to("theta_n", 0, theta_n),
            b: to("b", 0, b),
            per_b: to("per_b", 0, per_b),
            period: to("period", 0, period),
            turn: to("full_turn", 0, turn),
        };
        FullState { law, map, row, of: PhantomData }
    }

    /// Returns z and a_z of a measured state.
    #[inline(always)]
    fn chain(&self, x: &[T; N]) -> ([T; N], T) {
        self.map.chain(x, &self.map.seen(&core::array::from_fn(|i| x[2 * i])))
    }

    /// Returns the reference of this tick, at this a_z. `pace` is the ratio of the period to the period of this design.
    #[inline(always)]
    fn along(
        &self,
        drift: T,
        sample: &Measured<T, A::Target, N>,
        queued: [T; LATE],
        pace: Option<T>,
    ) -> Along<'_, T, A, N, LATE> {
        let k = &self.row;
        let feed = A::moved(&sample.begin, &sample.end, k.turn).map(|moved| {
            let mut feed = k.feed[N - 1] * moved[N - 1];
            for j in 0..N - 1 {
                feed += k.feed[j] * moved[j];
            }
            pace.map_or(feed, |pace| feed * pace)
        });
        Along { row: k, drift: drift * k.per_b, begin: sample.begin, feed, queued }
    }
}

impl<T, M, A, const E: usize, const N: usize, const R: usize, const MASK: u8, const O: usize, const LATE: usize>
    ControlLaw for FullState<T, M, A, E, N, R, MASK, O, LATE>
where
    T: Real,
    M: ChainModel<T, E, N>,
    A: Aim<T, N>,
{
    type Scalar = T;
    type Sample = Measured<T, A::Target, N>;
    type Output = Output<T>;
    type State = FullStateMemory<T, N, R, MASK, O, LATE>;
    /// Estimate d_hat of each channel of the chain, as in a [`Controller`].
    type Guess = [T; N];
    /// Estimates [d_hat, d_hat', d_hat''] of every channel of the chain.
    type Estimates = [[T; R]; N];
    const NO_GUESS: [T; N] = [T::ZERO; N];

    fn start_from(&self, sample: &Self::Sample, d_hat: &[T; N]) -> Option<Self::State> {
        let () = Self::SHAPE;
        let (z, drift) = self.chain(&sample.x);
        let within = self.law.start_on(&z, self.along(drift, sample, [T::ZERO; LATE], None), d_hat)?;
        Some(FullStateMemory { within, queued: [T::ZERO; LATE] })
    }

    #[inline]
    fn not_started(&self) -> Output<T> {
        self.law.not_started()
    }

    #[inline(always)]
    fn tick(&self, state: &mut Self::State, sample: &Self::Sample) -> Output<T> {
        let (z, drift) = self.chain(&sample.x);
        let course = self.along(drift, sample, state.queued, None);
        let output = self.law.step::<true, false, _>(&mut state.within, &z, course);
        state.send(output.u);
        output
    }

    fn lost(&self, state: &mut Self::State) -> Output<T> {
        let output = self.law.lost(&mut state.within);
        state.send(output.u);
        output
    }

    fn missed(&self, state: &mut Self::State, periods: u32) {
        self.law.missed(&mut state.within, periods);
    }

    fn report_applied(state: &mut Self::State, u: T) -> bool {
        Controller::<T, Linear<T, N>, N, R, MASK, O>::report_applied(&mut state.within, u)
    }

    fn estimates(&self, state: &Self::State) -> Self::Estimates {
        self.law.estimates(&state.within)
    }

    fn take_over(&self, from: &Self, state: &Self::State, sample: &Self::Sample) -> Result<Self::State, RetuneError> {
        let pace = from.row.period / self.row.period;
        let pace = (from.row.period != self.row.period).then_some(pace);
        let ((z_then, drift_then), (z_now, drift_now)) = (from.chain(&sample.x), self.chain(&sample.x));
        let then = (&z_then, from.along(drift_then, sample, state.queued, pace));
        let now = (&z_now, self.along(drift_now, sample, state.queued, None));
        let within = self.law.take_over_on(&from.law, &state.within, then, now)?;
        Ok(FullStateMemory { within, queued: state.queued })
    }

    /// Hashes the fingerprint of the law, the rows and the model.
    fn fingerprint(&self) -> u32 {
        let Row { feed, gradient, powers, push, t_1, theta_n, b, per_b, period, turn } = self.row;
        let rows = [feed, gradient, powers, push].into_iter().flatten();
        let numbers = rows.chain([t_1, theta_n, b, per_b, period, turn]).chain(self.map.numbers());
        hash([self.law.fingerprint(), E as u32, LATE as u32].into_iter().chain(numbers.flat_map(Real::to_words)))
    }
}

impl<T: Real, const N: usize, const R: usize, const MASK: u8, const O: usize, const LATE: usize>
    FullStateMemory<T, N, R, MASK, O, LATE>
{
    /// Queues u for the actuator.
    #[inline(always)]
    fn send(&mut self, u: T) {
        for queued in &mut self.queued {
            self.within.held = *queued;
            *queued = u;
        }
    }
}
