//! Encoder form of the law: observers on the counts, and the folded law on the errors from a reference.
//!
//! One tick runs in this order (blocks as in module `block`, all sums in the units of the blocks):
//!
//! 1. *Predict.* $m = w^- - \kappa X + d$ ($+ b u$ for the driven block), with the couplings and the applied u of the
//!    past tick. The predicted motion of the count is $p + g_2 v + g_1 m + h_1 d_1$.
//! 2. *Accept.* A count whose motion agrees with the prediction within the innovation gate is accepted. Otherwise the
//!    sample is lost: the prediction replaces it, and the next valid count contains the whole difference. If the next
//!    count is off by an equal amount, the position has stepped, after a missed tick or a slip. Then p starts from the
//!    count, and v and d stay.
//! 3. *Observe.* The couplings $w$ at the raw positions; $m \mathrel{+}= (w - w^-)/2$; prediction; $e = -p$;
//!    $x \mathrel{+}= L e$. With two gain sets the smoothed $e$ moves $L$ between them.
//! 4. *Map* to the chain: $z$, $a_z$, and $d$ and $d'$ of every channel (modules `motor`, `joint`). With a delay the
//!    blocks are predicted first, tick by tick, each with the u that is held then. The couplings continue at their last
//!    rate.
//! 5. *Law* on $e_j = z_j - r^{(j-1)}$ at the start of the coming tick, with $\Delta$ the change of the reference until
//!    its end:
//!
//! $$ \mathrm{ff} = \frac{\Delta r^{(n-1)}}{t_1} -
//!    \theta_n \sum_{j<n} \frac{\partial a_z}{\partial z_j} \Delta r^{(j-1)}, \qquad
//!    y = e, \quad y_{i+1} \mathrel{+}= d_i, \qquad
//!    \sigma = c \cdot y + \sum g d', \quad \sigma^* = \sigma - W $$
//! $$ u = k_x \cdot y + k_w W + u_\sigma \sigma^* + \sum k d' + \mathrm{ff}/b - (a_z + d_n)/b $$
//!
//! The rows come from the module `design` for observers of order 2 in the channels 2..n, with $A = d + \theta T d'$ and
//! $B = T d'$ inserted. In every channel except the last the shares of the blocks' $d$ and $d'$ are constant. So the
//! design folds them into one number per block.
//!
//! The feedforward uses *differences*: for any $r^{(n)}$ within the tick, u must produce $\Delta r^{(n-1)}$. The
//! observers never see the reference. An $e_1$ beyond `far` counts less and less. Along σ = 0 this gives a speed that u
//! can brake.
//!
//! # Two code paths of a tick
//! In an ordinary tick every count is present and within its innovation gate. It takes one straight code path
//! (`observe`), because a branch for rare cases would reload everything behind it. All other ticks take another code
//! path (`rest`), which repeats the whole tick from the stored state. So a rare tick costs the start of an ordinary
//! tick in addition. The rare path gives an ordinary tick bit-identical results: a drive exported to C has only this
//! path.
//!
//! # Guarantees
//! * u is finite and within the limits, for any counts, any targets (also NaN and infinities) and any state.
//! * Targets that are not numbers affect only their own ticks: the fallback is the output, and the observers continue.
//! * The loop recovers from any numbers in the state. Estimates that are not numbers or far off cannot predict the
//!   count. After more such ticks than samples may be missing, the fallback is the output until the counts are
//!   consistent. The observers restart there. If the offset demands more than 256 times the span of the limits, σ
//!   replaces it, as at the start. A smaller offset decays with α.
//! * Quantities without a sensor cannot be recovered: the whole revolution, the limit of the power stage, and the angle
//!   of an incremental encoder. A state with other words there is a loop at another place. The checksum in
//!   [`words`](crate::Running::words) protects these words.
//!
//! # Limits that change
//! A power stage may provide less than the design assumes ([`Running::limit`](crate::Running::limit)). Then u stays
//! within that limit, and `far` decreases in proportion. So the present current can brake the speed along σ = 0. Such a
//! tick takes the rare code path.

use core::marker::PhantomData;

use super::block::Block;
use super::chain::ChainModel;
use super::encoder::Sensor;
use super::fields::fields;
use super::motor::decay;
use super::state::EncoderState;
use super::target::{Aim, Target};
use super::two_mass::Whole;
use crate::config::{Fallback, INPUT_LIMIT};
use crate::controller::Output;
use crate::design::{self, Coefficients};
use crate::exponential::phi_functions;
use crate::health::Health;
use crate::law::Limits;
use crate::real::{Count as _, Real, row_f32};
use crate::running::{ControlLaw, RetuneError, hash};

/// Designed drive law over E encoders, which a tick never changes.
///
/// * `T`: precision, `f32` or `f64`
/// * `M`: model of the drive: [`Motor`](super::Motor), [`Joint`](super::Joint) or one of your own
/// * `A`: control mode: follow a [`Position`](super::Position) or a [`Speed`](super::Speed), or [`Hold`](super::Hold)
///   angle 0
/// * `E`, `N`: encoders, and the order 2 E of the chain
/// * `S`: states of each observer, 3 or 4
/// * `FAST`: gain sets in addition to the base gains, 0 or 1
/// * `LATE`: ticks between computation and output of u, 0 to [`MOST_DELAY_TICKS`]
///
/// The aliases [`MotorDrive`](super::MotorDrive) and [`JointDrive`](super::JointDrive) name the useful choices. An
/// option that is not chosen has no state and no instruction.
#[derive(Clone, Copy, Debug)]
pub struct EncoderForm<T, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize> {
    pub(crate) model: M,
    pub(crate) blocks: [Block<T, S>; E],
    pub(crate) sensors: [Sensor<T>; E],
    pub(crate) fast: [[FastGains<T, S>; E]; FAST],
    pub(crate) row: Row<T, E, N>,
    pub(crate) belief: AcceptanceRules<T, E>,
    /// Inertia of each block, to convert estimates to torques. The tick does not use it.
    pub(crate) inertia: [T; E],
    /// True if a retune to this design leaves no offset.
    pub(crate) at_rest: bool,
    pub(crate) of: PhantomData<A>,
}

fields! {
    /// High gain set of one block.
    pub(crate) struct FastGains<T, const S> {
        /// High gains minus base gains.
        more: [T; S],
        /// Threshold at which the high gains begin, and 1/(threshold of full use - this threshold).
        calm: T,
        rate: T,
        /// Smoothing 1 - e^(-T/3 ms), and fade-out e^(-T/20 ms), with the default time constants.
        smoothing: T,
        keep: T,
    }
}

fields! {
    /// Rules for accepting counts.
    pub(crate) struct AcceptanceRules<T, const E> {
        /// Innovation gate of each encoder, in the unit of its block, and its closing rate after a start.
        gate: [T; E],
        closing: T,
        /// Largest difference of two counts of one motion from tick to tick.
        agreement: [T; E],
        /// Consecutive samples of an encoder that may be missing.
        lost_ticks: T,
        /// Price of a position step per unit, on top of 1 per step. The sum decays with a time constant of 0.1 s.
        step_price: [T; E],
        forgetting: T,
        /// Ticks of consistent counts until a current flows.
        start_ticks: T,
    }
}

impl<const E: usize> AcceptanceRules<f64, E> {
    /// Returns the rules. Three consecutive steps are too much, or one of a quarter of a revolution (or of the counter,
    /// if that is less).
    ///
    /// `closing_rate` is the rate of the gate after a retune, 1/s. `quarters` is a quarter of a revolution, in the unit
    /// of each block.
    pub(crate) const fn of(
        gate: [f64; E],
        sensors: &[Sensor<f64>; E],
        quarters: [f64; E],
        closing_rate: f64,
        lost_ticks: u32,
        period_s: f64,
    ) -> Self {
        let mut this = Self {
            gate,
            agreement: [0.0; E],
            closing: 1.0 - decay(closing_rate * period_s),
            lost_ticks: lost_ticks as f64,
            step_price: [0.0; E],
            forgetting: 1.0 - decay(period_s / 0.1),
            start_ticks: 3.0,
        };
        while this.start_ticks * period_s < 0.01 - 1e-9 {
            this.start_ticks += 1.0;
        }
        let mut i = 0;
        while i < E {
            let half = 0.5 * sensors[i].half_span;
            if gate[i] > sensors[i].half_span {
                this.gate[i] = sensors[i].half_span;
            }
            this.agreement[i] = if gate[i] > 16.0 * sensors[i].unit { gate[i] / 8.0 } else { 2.0 * sensors[i].unit };
            this.step_price[i] = STEPS / if quarters[i] < half { quarters[i] } else { half };
            i += 1;
        }
        this
    }
}

/// Largest number of ticks between computation and output of u.
pub const MOST_DELAY_TICKS: usize = 3;

/// Chords of the curve on which a far target is approached.
const CHORDS: usize = 4;

/// Share of u that brakes before a far target, near it. A third more along the chords. The rest is for load and
/// friction.
pub(crate) const BRAKING: f64 = 0.6;

/// Quarter of a revolution, rad.
pub(crate) const QUARTER_TURN: f64 = core::f64::consts::FRAC_PI_2;

/// State of the power stage in a tick: full current, less current, or unknown at compile time.
const UNLIMITED: u8 = 0;
const LIMITED: u8 = 1;
#[doc(hidden)]
pub const ANY_STAGE: u8 = 2;

/// Rise per tick of a power-stage limit that was detected from reports, as a share of the design limit.
const RISE: f64 = 1.0 / 64.0;
/// Shortfalls that reveal a limit: relative to the limit, and relative to the reported value.
const SHORT: f64 = 1.0 / 32.0;
const CLEARLY: f64 = 0.25;
/// Value that no power stage reports.
const NEVER: f64 = 1e30;

/// Consecutive rejected samples before a count at rest is accepted as a position step.
const AT_REST: f64 = 8.0;

/// Largest sum of recent position steps.
const STEPS: f64 = 3.0;

fields! {
    /// Rows of the law (see the module). Entry j belongs to e_j or Δr^(j-1), from 0, and entry i to block i.
    pub(crate) struct Row<T, const E, const N> {
        /// Surface coefficients. The last one is 1 and not read.
        c: [T; N],
        /// Error beyond which e_1 counts less and less: a far target is approached at a speed that u can brake.
        far: T,
        /// Ratio of `far` to the larger limit of u.
        far_per_u: T,
        /// Gains of the law on y. Entry 0 is 0 and not read.
        kx: [T; N],
        /// Feedforward ff/b on Δr, Δr', ..
        feed: [T; N],
        /// Rows of σ and of the law on d and d' through the channels before the last. The entry of the driven block is
        /// 0 and not read, because its d is only in the last channel.
        c_d: [T; E],
        c_growth: [T; E],
        k_d: [T; E],
        k_growth: [T; E],
        /// Gain of the law on d' in the last channel.
        k_last: T,
        kw: T,
        us: T,
        /// Difference kw - us: the gain on W if us is the gain on σ.
        k_offset: T,
        decay: T,
        /// Reciprocal 1/b.
        per_b: T,
        period: T,
        /// Full circle 2π.
        turn as "full_turn": T,
        u_min: T,
        u_max: T,
        /// Larger |u| of both limits.
        most: T,
        /// Largest |u| that is accepted without a further check.
        plausible: T,
        /// Output of a rejected tick: hold u + fallback.
        hold: T,
        fallback: T,
    }
}

impl<const E: usize, const N: usize> Row<f64, E, N> {
    /// Builds the rows from the rows for observers of order 2 in every channel except the first.
    pub(crate) const fn of<const O: usize>(
        rows: &Coefficients<f64, N, 2, O>,
        gradient: &[f64; N],
        shares: &[[f64; E]; N],
        limits: Limits,
        fallback: Fallback,
        far: f64,
    ) -> Self {
        let t_1 = rows.period * phi_functions(gradient[N - 1] * rows.period)[1];
        let (t, b) = (rows.period, rows.input_gain);
        let ([mut c_d, mut c_growth, mut k_d, mut k_growth], mut feed) = ([[0.0; E]; 4], [0.0; N]);
        let mut i = 1;
        while i < N {
            feed[i - 1] = -rows.theta_n * gradient[i - 1] / b;
            let mut j = 0;
            while i + 1 < N && j < E {
                // d adds to the error that it drives: A = d + T d'/2, B = T d'.
                let share = shares[i][j];
                c_d[j] += rows.c[i + 1] * share;
                k_d[j] += rows.kx[i + 1] * share;
                c_growth[j] += (rows.g[i - 1][1] + 0.5 * rows.c[i + 1]) * t * share;
                k_growth[j] += (rows.k[i - 1][1] + 0.5 * rows.kx[i + 1]) * t * share;
                j += 1;
            }
            i += 1;
        }
        // In units of u. There A = d + θ T d' has the coefficient -1.
        let k_last = (rows.k[N - 2][1] - rows.theta_n) * t / b;
        feed[N - 1] = 1.0 / (t_1 * rows.input_gain);
        let (hold, fallback) = match fallback {
            Fallback::HoldLast => (1.0, 0.0),
            Fallback::Safe(u) => (0.0, u),
        };
        let most = limits.stronger();
        Self {
            c: rows.c,
            far,
            far_per_u: far / most,
            kx: rows.kx,
            c_d,
            c_growth,
            k_d,
            k_growth,
            k_last,
            feed,
            kw: rows.kw,
            us: rows.us,
            k_offset: rows.kw - rows.us,
            decay: rows.decay,
            per_b: 1.0 / b,
            period: rows.period,
            turn: core::f64::consts::TAU,
            u_min: limits.min,
            u_max: limits.max,
            most,
            plausible: design::plausible(limits),
            hold,
            fallback,
        }
    }
}

impl<A, M, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
    EncoderForm<f64, M, A, E, N, S, FAST, LATE>
{
    /// Rounds every number to the nearest f32, with a model that is already in f32.
    pub(crate) const fn in_f32<M32>(&self, model: M32) -> EncoderForm<f32, M32, A, E, N, S, FAST, LATE> {
        let mut blocks = [self.blocks[0].in_f32(); E];
        let mut sensors = [self.sensors[0].in_f32(); E];
        let mut i = 1;
        while i < E {
            blocks[i] = self.blocks[i].in_f32();
            sensors[i] = self.sensors[i].in_f32();
            i += 1;
        }
        let none = FastGains { more: [0.0_f32; S], calm: 0.0, rate: 0.0, smoothing: 0.0, keep: 0.0 };
        let mut fast = [[none; E]; FAST];
        let mut f = 0;
        while f < FAST {
            let mut i = 0;
            while i < E {
                fast[f][i] = self.fast[f][i].in_f32();
                i += 1;
            }
            f += 1;
        }
        EncoderForm {
            model,
            blocks,
            sensors,
            fast,
            row: self.row.in_f32(),
            belief: self.belief.in_f32(),
            inertia: row_f32(&self.inertia),
            at_rest: self.at_rest,
            of: PhantomData,
        }
    }
}

impl<T, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
    EncoderForm<T, M, A, E, N, S, FAST, LATE>
{
    /// Returns the design with retunes that leave no offset W. Then u may jump.
    ///
    /// Use it for a loop at rest under a model that was far off. With an offset, a remaining oscillation would freeze
    /// its momentary difference of u into W.
    #[must_use]
    pub const fn at_rest(mut self) -> Self {
        self.at_rest = true;
        self
    }

    /// Byte offset in a law of the one byte that must be 0 or 1, for laws from memory that other code can write.
    #[doc(hidden)]
    pub const FLAG_AT: usize = core::mem::offset_of!(Self, at_rest);
}

/// Input of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<C, G, const E: usize> {
    /// Count of each encoder (`i32`, only the bits of its counter are read). `None` for a lost count.
    pub counts: [Option<C>; E],
    /// Target at the start of the tick in which u is held: now, or later by the ticks of delay.
    pub begin: G,
    /// Target at the end of that tick.
    pub end: G,
}

/// Estimates of a drive, in rad of each shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriveEstimates<T, C, const E: usize> {
    /// Whole revolutions to add to the positions.
    pub turn: C,
    /// Position of each shaft, rad. With a geared base it may be some revolutions.
    pub position: [T; E],
    /// Speed, rad/s.
    pub speed: [T; E],
    /// Disturbance d, rad/s²: the acceleration that the model does not explain.
    pub disturbance: [T; E],
    /// Disturbance as a torque against the shaft, -J d, N m: load and friction.
    pub load: [T; E],
}

pub(crate) type StateOf<C> = <C as ControlLaw>::State;

/// Estimates that the law uses.
#[derive(Clone, Copy)]
struct LawEstimates<T, V, const E: usize, const N: usize> {
    x: [T; N],
    d: [T; E],
    /// Disturbance rate d'. 0 with three states.
    growth: [T; E],
    /// Current minus the reference current, for a model that couples its blocks within a tick.
    current: T,
    seen: V,
}

/// Result of the observers in a tick that is not ordinary.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct Observed<V> {
    pub seen: V,
    /// True if a count was missing or rejected.
    pub missing: bool,
    /// True if a position was reset from its count.
    pub stepped: bool,
    /// False if too many samples are missing.
    pub known: bool,
}

/// Errors e_1 .. e_n, and a_z.
struct Errors<T, const N: usize> {
    e: [T; N],
    drift: T,
}

/// Demand of the law.
#[derive(Clone, Copy)]
struct LawDemand<T> {
    sigma: T,
    /// Demand without the offset: kw W + us (σ - W) is to be added.
    bare: T,
    /// Share of the reference in the demand, if the model stores it.
    ahead: T,
}

impl<T, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
    EncoderForm<T, M, A, E, N, S, FAST, LATE>
where
    T: Real,
    M: ChainModel<T, E, N>,
    A: Aim<T, N>,
{
    const DRIVEN: usize = E - 1;
    const SHAPE: () = assert!(
        E >= 1 && N == 2 * E && (S == 3 || S == 4) && FAST <= 1 && LATE <= MOST_DELAY_TICKS,
        "a drive has N = 2 E, 3 or 4 states per block, at most one fast gain set and three ticks of delay"
    );

    /// Returns the nominal model.
    pub const fn model(&self) -> &M {
        &self.model
    }

    /// Returns the gain Γ of each observer into σ: the effect on σ at rest at 0 of a unit of innovation, in the unit of
    /// its block. It applies to the base gains or, with `fast`, to the high gains.
    fn gains_into_sigma(&self, fast: bool) -> [T; E] {
        let sigma = |x: [[T; S]; E]| {
            let mut known = LawEstimates {
                x: [T::ZERO; N],
                d: [T::ZERO; E],
                growth: [T::ZERO; E],
                current: T::ZERO,
                seen: self.model.seen(&core::array::from_fn(|i| x[i][0])),
            };
            for i in 0..E {
                (known.x[2 * i], known.x[2 * i + 1], known.d[i]) = (x[i][0], x[i][1], x[i][2]);
                known.growth[i] = if S == 4 { x[i][3] } else { T::ZERO };
            }
            if self.model.whole().is_some() {
                known.x[2] -= known.x[0];
            }
            let (z, _) = self.model.chain(&known.x, &known.seen);
            self.sigma(&self.model.weightless(&z, &known.seen), &known)
        };
        core::array::from_fn(|i| {
            let level = if fast { T::from_f64(1.0) } else { T::ZERO };
            let step = self.sensors[i].unit;
            let mut x = [[T::ZERO; S]; E];
            for (j, x_j) in x.iter_mut().enumerate() {
                *x_j = self.gains_of(j, i, [level; FAST]).map(|gain| gain * step);
            }
            sigma(x) / step
        })
    }

    /// Returns λ_2 of the module `monitor`, in the unit of x_n, for the larger gain set. Not for the tick.
    ///
    /// The bound of |σ*| holds as long as u is within its limits and the innovations are at most `innovation_steps`
    /// counts.
    pub fn sigma_star_bound(&self, innovation_steps: [f64; E]) -> f64 {
        let sets = [false, true].map(|fast| {
            let gains = self.gains_into_sigma(fast);
            (0..E).map(|i| (gains[i] * self.sensors[i].unit).abs().to_f64() * innovation_steps[i]).sum::<f64>()
        });
        // u_σ moves σ by -min(k_l T, 1) within a tick: so does K_v b u_σ, and k_w by α.
        let reach = (self.row.us / self.row.kw * self.row.decay).to_f64();
        (if sets[1] > sets[0] { sets[1] } else { sets[0] }) / reach
    }

    /// Returns the gains of a block for the innovation of an encoder, at this level of the high gains.
    #[inline(always)]
    fn gains_of(&self, block: usize, encoder: usize, level: [T; FAST]) -> [T; S] {
        let (mut gains, is_own) = (self.blocks[block].gains, block == encoder);
        if !is_own {
            gains = [T::ZERO; S];
            if let Some(whole) = self.model.whole() {
                let across = if block == 0 { &whole.link_across } else { &whole.motor_across };
                for (gain, across) in gains.iter_mut().zip(across) {
                    *gain = *across;
                }
            }
        }
        for f in 0..FAST {
            let mut more = self.fast[f][block].more;
            if let (Some(whole), false) = (self.model.whole(), is_own) {
                let across = if block == 0 { &whole.link_more } else { &whole.motor_more };
                for (more, across) in more.iter_mut().zip(across) {
                    *more = *across;
                }
            }
            if is_own || self.model.whole().is_some() {
                for s in 0..S {
                    gains[s] += level[f] * more[s];
                }
            }
        }
        gains
    }

    /// Returns σ of errors or of a state, with d and d' of the blocks.
    #[inline(always)]
    fn sigma(&self, e: &[T; N], known: &LawEstimates<T, M::Seen, E, N>) -> T {
        let (k, LawEstimates { d, growth, .. }) = (&self.row, known);
        let mut sigma = e[N - 1];
        if A::POSITION {
            for j in 0..N - 1 {
                sigma += k.c[j] * e[j];
            }
        }
        for i in 0..Self::DRIVEN {
            sigma += k.c_d[i] * d[i];
            if S == 4 {
                sigma += k.c_growth[i] * growth[i];
            }
        }
        if let Some(whole) = self.model.whole() {
            sigma += whole.c_motor * d[Self::DRIVEN];
            sigma += whole.c_current * known.current;
        }
        sigma.called("sigma", 0)
    }

    /// Returns the position of a block since the base, in its unit.
    #[inline(always)]
    fn position(&self, state: &StateOf<Self>, i: usize) -> T {
        self.raw(state, i) + state.x[i][0]
    }

    /// Returns the position of the last accepted count.
    #[inline(always)]
    fn raw(&self, state: &StateOf<Self>, i: usize) -> T {
        self.sensors[i].unit * T::from_count(state.at[i])
    }

    /// Returns p, v, d, d' after one more tick under m, with the position relative to the last count. For a model that
    /// couples its blocks, it also uses v and m of the other block, and the current that still lags.
    #[inline(always)]
    fn foreseen(&self, i: usize, all: &[[T; S]; E], m: &[T; E], on_its_way: T) -> [T; S] {
        let (k, x, m_i) = (&self.blocks[i], &all[i], m[i]);
        let mut next = *x;
        next[0] += k.g2 * x[1] + k.g1 * m_i;
        next[1] = k.phi * x[1] + k.g2 * m_i;
        if let Some(whole) = self.model.whole() {
            let other = Self::DRIVEN - i;
            next[0] += whole.g2_across[i] * all[other][1] + whole.g1_across[i] * m[other];
            next[0] += whole.current_q[i] * on_its_way;
            next[1] += whole.phi_across[i] * all[other][1] + whole.g2_across[i] * m[other];
            next[1] += whole.current_v[i] * on_its_way;
        }
        if S == 4 {
            next[0] += k.h1 * x[3];
            next[1] += k.g1 * x[3];
            next[2] += self.row.period * x[3];
        }
        next
    }

    /// Returns m of the past tick, with the couplings of its start.
    #[inline(always)]
    fn driven(&self, state: &StateOf<Self>, i: usize) -> T {
        let mut m = self.pull(state, i).unwrap_or(state.x[i][2]);
        if i == Self::DRIVEN {
            m += self.model.input_gain() * state.held;
        }
        m
    }

    /// Returns m of all blocks if they are coupled within the tick, before the first prediction.
    #[inline(always)]
    fn driven_all(&self, state: &StateOf<Self>) -> [T; E] {
        let mut m = [T::ZERO; E];
        if self.model.whole().is_some() {
            for (i, m_i) in m.iter_mut().enumerate() {
                *m_i = self.driven(state, i);
            }
        }
        m
    }

    /// Returns the part of the current that still lags behind its command. 0 for a value that is not a number.
    #[inline(always)]
    fn on_its_way(&self, state: &StateOf<Self>) -> T {
        if self.model.whole().is_none() {
            return T::ZERO;
        }
        sane(M::currents(&state.push)[0] - state.held)
    }

    /// Computes steps 1 to 3 of an ordinary tick. Returns `None` and changes nothing if a count is missing or rejected,
    /// or if the base must move.
    #[inline(always)]
    fn observe(&self, state: &mut StateOf<Self>, counts: &[Option<T::Count>; E]) -> Option<M::Seen> {
        T::section("1. Where the counts are, and whether they are believed.");
        let (mut last, mut at, mut raw) = (state.last, state.at, [T::ZERO; E]);
        let (mut m, mut p) = (self.driven_all(state), [T::ZERO; E]);
        let on_its_way = self.on_its_way(state);
        for i in 0..E {
            let k = &self.sensors[i];
            let count = counts[i]?;
            // If a counter without a power of two of states wraps, this is far off, and the other code path handles it.
            let difference = count.since(last[i]).signed(k.unread);
            (last[i], at[i]) = (count, at[i].plus(difference));
            raw[i] = k.unit * T::from_count(at[i]);
            if self.model.whole().is_none() {
                m[i] = self.driven(state, i);
            }
            p[i] = self.foreseen(i, &state.x, &m, on_its_way)[0] - k.unit * T::from_count(difference);
            if !self.is_believed(state, i, p[i]) {
                return None;
            }
        }
        if raw[0].abs() > self.sensors[0].edge {
            return None;
        }
        (state.last, state.at, state.missed) = (last, at, [T::ZERO; E]);
        let seen = self.correct(state, &raw, m, p, [true; E]);
        // The map needs the values at the estimate, not at the count.
        Some(self.model.seen_ahead(seen, state.x[0][0]))
    }

    /// Returns true if a count at distance p from its prediction is within the gate. The gate closes after a start or
    /// retune.
    #[inline(always)]
    fn is_believed(&self, state: &StateOf<Self>, i: usize, p: T) -> bool {
        p.abs() <= self.belief.gate[i] + state.reach
    }

    /// Computes steps 1 to 3 of any tick, bit-identical for an ordinary one.
    #[doc(hidden)]
    pub fn observe_rest(&self, state: &mut StateOf<Self>, counts: &[Option<T::Count>; E]) -> Observed<M::Seen> {
        T::section("1. Where the counts are, and whether they are believed.");
        let (mut used, [mut missing, mut stepped, mut known]) = ([false; E], [false, false, true]);
        let (mut m, mut p, mut ahead) = (self.driven_all(state), [T::ZERO; E], [T::ZERO; E]);
        let (mut position, on_its_way) = ([T::ZERO; E], self.on_its_way(state));
        let mut has_stepped = [None; E];
        for i in 0..E {
            T::channel(i + 1);
            let k = &self.sensors[i];
            if self.model.whole().is_none() {
                m[i] = self.driven(state, i);
            }
            p[i] = self.foreseen(i, &state.x, &m, on_its_way)[0];
            // Without a measurement the couplings use the prediction.
            ahead[i] = state.x[i][0] + self.blocks[i].g2 * state.x[i][1];
            let (mut off, mut steps) = (self.nowhere(), false);
            if let Some(count) = counts[i] {
                let difference = k.moved(count.since(state.last[i]));
                off = p[i] - k.unit * T::from_count(difference);
                used[i] = self.is_believed(state, i, off);
                steps = !used[i] && self.steps(state, i, off);
                if used[i] || steps {
                    state.last[i] = count;
                    state.at[i] = state.at[i].plus(difference);
                    (p[i], ahead[i]) = (if steps { T::ZERO } else { off }, T::ZERO);
                }
            }
            stepped = stepped || steps;
            let one = T::from_f64(1.0);
            if used[i] || steps {
                state.missed[i] = T::ZERO;
            } else {
                missing = true;
                state.off[i] = off;
                state.missed[i] = state.missed[i].abs() + one;
                known = known && state.missed[i] <= self.belief.lost_ticks;
            }
            position[i] = self.raw(state, i) + ahead[i];
            has_stepped[i] = steps.then_some(off);
        }
        if let (Some(whole), true) = (self.model.whole(), stepped) {
            // A disturbance of one shaft affects the other: a mixture of two moments would give a twist of the spring.
            missing = false;
            let mut jumped = [T::ZERO; E];
            for i in 0..E {
                let along = has_stepped[i].is_some() || (!used[i] && self.steps_along(state, i, counts[i]));
                missing = missing || !(used[i] || along);
                if along {
                    jumped[i] = -has_stepped[i].unwrap_or(state.off[i]);
                    (p[i], ahead[i]) = (T::ZERO, T::ZERO);
                    position[i] = self.raw(state, i);
                }
            }
            // The torque of such a twist acted before and no longer acts. Otherwise each step would cause another.
            let twisted = jumped[Self::DRIVEN] - jumped[0];
            for i in 0..E {
                state.x[i][2] -= whole.spring[i] * twisted;
            }
        }
        let seen = self.correct(state, &position, m, p, used);
        Observed { seen: self.model.seen_ahead(seen, state.x[0][0] - ahead[0]), missing, stepped, known }
    }

    /// Returns true if a count at distance `off` from its prediction shows a position step, after a missed tick or a
    /// slip.
    ///
    /// The conditions: the previous count agreed with it, its distance is within the range of the missed samples, and
    /// recent steps were few. For a moving shaft two counts suffice, because no false count moves with the shaft. At
    /// rest a constant value may look like a step, so [`AT_REST`] counts are needed.
    #[inline(always)]
    fn steps(&self, state: &mut StateOf<Self>, i: usize, off: T) -> bool {
        let (k, one) = (&self.belief, T::from_f64(1.0));
        let passed = state.missed[i] + one;
        let steps = state.doubt + (k.step_price[i] * off.abs() + one);
        // Each missed tick of an accelerating shaft leaves a speed error, by which the counts drift.
        let (twice_agreed, apart) = (lesser(k.agreement[i] * state.missed[i], k.gate[i]), (off - state.off[i]).abs());
        let is_confirmed = twice_agreed - (apart + apart);
        let is_near = k.gate[i] * (passed * passed) - off.abs();
        let is_rare = T::from_f64(STEPS + 1.0) - steps;
        let (way, twice) = self.way_in_a_tick(state, i);
        // A NaN speed must not outweigh the others: only its sign counts.
        let is_sure = if way > twice { one } else { state.missed[i] - T::from_f64(AT_REST) };
        // One comparison for all conditions: each further one would double the code paths of the tick.
        let is_step = lesser(lesser(is_confirmed, is_near), lesser(is_rare, is_sure)) >= T::ZERO;
        if is_step {
            state.doubt = steps;
        }
        is_step
    }

    /// Accepts the rejected count of a shaft together with a step of the other shaft, if its distance is within the
    /// range of the missed samples.
    #[inline(always)]
    fn steps_along(&self, state: &mut StateOf<Self>, i: usize, count: Option<T::Count>) -> bool {
        let Some(count) = count else { return false };
        let is_near = state.off[i].abs() <= self.belief.gate[i] * (state.missed[i] * state.missed[i]);
        if is_near {
            let moved = self.sensors[i].moved(count.since(state.last[i]));
            (state.last[i], state.at[i], state.missed[i]) = (count, state.at[i].plus(moved), T::ZERO);
        }
        is_near
    }

    /// Returns the travel per tick, and twice the agreement of counts. A larger travel means motion.
    #[inline(always)]
    fn way_in_a_tick(&self, state: &StateOf<Self>, i: usize) -> (T, T) {
        let agreement = self.belief.agreement[i];
        (self.row.period * state.x[i][1].abs(), agreement + agreement)
    }

    /// Returns a distance that no count has, not even approximately.
    fn nowhere(&self) -> T {
        let span = self.span();
        let far = span + span;
        far + far
    }

    /// Computes steps 2 and 3: couplings at these positions, and estimates, corrected for every accepted count. m and p
    /// use the couplings at the start of the tick.
    #[inline(always)]
    fn correct(
        &self,
        state: &mut StateOf<Self>,
        position: &[T; E],
        mut m: [T; E],
        mut p: [T; E],
        used: [bool; E],
    ) -> M::Seen {
        T::section("2. Couplings.");
        let seen = self.model.seen(position);
        let push = self.model.push(position, &seen);

        T::section("3. Observers.");
        if self.model.whole().is_some() {
            self.correct_whole(state, push, m, p, used);
        } else {
            for i in 0..E {
                T::channel(i + 1);
                if let (Some(before), Some(now)) = (M::of_block(&state.push, i), M::of_block(&push, i)) {
                    // Mean of w at both ends.
                    let more = now - before;
                    m[i] += more;
                    p[i] += self.blocks[i].g1 * more;
                }
                let mut x = self.foreseen(i, &state.x, &m, T::ZERO);
                x[0] = p[i].called("p", i + 1);
                if used[i] {
                    // e = -p.
                    let gains = self.gains(state, i, p[i]);
                    for s in 0..S {
                        x[s] -= gains[s] * p[i];
                    }
                }
                state.x[i] = x;
            }
            state.push = push;
        }
        state.reach = state.reach * self.belief.closing;
        state.doubt = state.doubt * self.belief.forgetting;
        seen
    }

    /// Computes steps 2 and 3 of coupled blocks: all predictions come before the first correction, and every innovation
    /// corrects all blocks.
    #[inline(always)]
    fn correct_whole(&self, state: &mut StateOf<Self>, push: M::Push, mut m: [T; E], mut p: [T; E], used: [bool; E]) {
        let Some(whole) = self.model.whole() else { return };
        let on_its_way = self.on_its_way(state);
        if let (Some(before), Some(now)) = (M::of_block(&state.push, 0), M::of_block(&push, 0)) {
            // The mean of w at both ends moves both shafts.
            let more = now - before;
            m[0] += more;
            p[0] += self.blocks[0].g1 * more;
            p[Self::DRIVEN] += whole.g1_across[Self::DRIVEN] * more;
        }
        let level = self.level(state, &p, used);
        let mut x = state.x;
        for i in 0..E {
            T::channel(i + 1);
            x[i] = self.foreseen(i, &state.x, &m, on_its_way);
            x[i][0] = p[i].called("p", i + 1);
        }
        for encoder in 0..E {
            if used[encoder] {
                for i in 0..E {
                    T::channel(i + 1);
                    let gains = self.gains_of(i, encoder, level);
                    for s in 0..S {
                        x[i][s] -= gains[s] * p[encoder];
                    }
                }
            }
        }
        state.x = x;
        let current = state.held + whole.keeps * on_its_way;
        state.push = M::with_currents(push, [current, M::currents(&state.push)[1]]);
        // An accepted deviation overshoots in the estimates and in the next predictions, so the gate opens by it.
        for i in 0..E {
            if used[i] {
                let twice = p[i].abs() + p[i].abs();
                state.reach = state.reach.if_below(twice, twice, state.reach);
            }
        }
    }

    /// Returns the level of the high gains of coupled blocks. One level applies to all, because gains of two filters do
    /// not mix.
    ///
    /// It lasts for one burst at most, or until u is at a limit. All innovations must then be calm for a while before
    /// the next burst. So it ends for every motion of the shaft, and the base gains apply in the end.
    #[inline(always)]
    fn level(&self, state: &mut StateOf<Self>, p: &[T; E], used: [bool; E]) -> [T; FAST] {
        let (one, mut levels) = (T::from_f64(1.0), [T::ZERO; FAST]);
        let Some(whole) = self.model.whole() else { return levels };
        let newest = Self::commanded(state);
        for f in 0..FAST {
            let mut alarm = T::from_f64(-1.0);
            for i in 0..E {
                let k = &self.fast[f][i];
                let mut smoothed = state.alert[f][i][0];
                if used[i] {
                    smoothed -= k.smoothing * (p[i] + smoothed);
                }
                state.alert[f][i][0] = smoothed;
                let above = (smoothed.abs() - k.calm) * k.rate;
                alarm = alarm.if_below(above, above, alarm);
            }
            let (fading, count) = (state.alert[f][0][1] * self.fast[f][0].keep, state.alert[f][Self::DRIVEN][1]);
            let wanted = fading.if_below(alarm, alarm, fading).limited(T::ZERO, one);
            // From 0 on it counts the ticks of a burst, below 0 the ticks until the next burst is allowed.
            let locked = -whole.rest;
            let of_burst = T::ZERO.if_below(wanted, count + one, T::ZERO);
            let of_burst = of_burst.if_below(whole.burst, of_burst, locked);
            let of_burst = newest.if_below(self.row.u_max, of_burst, locked);
            let of_burst = self.row.u_min.if_below(newest, of_burst, locked);
            let of_rest = alarm.if_below(T::ZERO, count + one, locked);
            let count = count.if_below(T::ZERO, of_rest, of_burst);
            levels[f] = count.if_below(one, T::ZERO, wanted);
            state.alert[f][0][1] = levels[f];
            state.alert[f][Self::DRIVEN][1] = count;
        }
        levels
    }

    /// Returns the twist of coupled blocks, from integers except for the estimates.
    #[inline(always)]
    fn twist(&self, state: &StateOf<Self>, whole: &Whole<T, 2, 3>) -> T {
        let last = Self::DRIVEN;
        let of_counts = if whole.times_link == 0 {
            self.raw(state, last) - self.raw(state, 0)
        } else {
            whole.twist(&[state.at[0], state.at[last]])
        };
        of_counts + (state.x[last][0] - state.x[0][0])
    }

    /// Returns w + d - κX of a block at the last tick, without u. `None` without a coupling and without a restoring
    /// term.
    #[inline(always)]
    fn pull(&self, state: &StateOf<Self>, i: usize) -> Option<T> {
        if let Some(whole) = self.model.whole() {
            let mut m = whole.spring[i] * self.twist(state, whole) + state.x[i][2];
            if let Some(half) = M::of_block(&state.push, i) {
                m += half + half;
            }
            return Some(m);
        }
        let half = M::of_block(&state.push, i)?;
        Some((half + half) + state.x[i][2] - self.model.kappa(i) * self.position(state, i))
    }

    /// Stores the couplings at the positions of the counts.
    fn remember_counts(&self, state: &mut StateOf<Self>) {
        state.push = self.push_at_counts(state);
    }

    fn push_at_counts(&self, state: &StateOf<Self>) -> M::Push {
        let raw = core::array::from_fn(|i| self.raw(state, i));
        self.model.push(&raw, &self.model.seen(&raw))
    }

    /// Returns the gains of this tick.
    #[inline(always)]
    fn gains(&self, state: &mut StateOf<Self>, i: usize, p: T) -> [T; S] {
        let mut gains = self.blocks[i].gains;
        for f in 0..FAST {
            let k = &self.fast[f][i];
            let [mut smoothed, level] = state.alert[f][i];
            smoothed -= k.smoothing * (p + smoothed);
            let (now, fading) = ((smoothed.abs() - k.calm) * k.rate, level * k.keep);
            let level = if now > fading { now } else { fading }.limited(T::ZERO, T::from_f64(1.0));
            state.alert[f][i] = [smoothed, level];
            for s in 0..S {
                gains[s] += level * k.more[s];
            }
        }
        gains
    }

    /// Returns the estimates at the start of the tick in which u is held.
    #[inline(always)]
    fn known(&self, state: &StateOf<Self>, mut seen: M::Seen, before: &M::Push) -> LawEstimates<T, M::Seen, E, N> {
        if let Some(whole) = self.model.whole() {
            return self.known_whole(state, seen, before, whole);
        }
        let (mut x, mut d, mut growth) = ([T::ZERO; N], [T::ZERO; E], [T::ZERO; E]);
        for i in 0..E {
            let (mut position, mut x_i) = (self.position(state, i), state.x[i]);
            let (mut last, mut now) = (M::of_block(before, i), M::of_block(&state.push, i));
            for queued in state.queued {
                let mut m = x_i[2];
                if let (Some(was), Some(half)) = (last, now) {
                    // w at the end of the tick is unknown: it continues at its last rate.
                    let more = half - was;
                    m = (half + half) + x_i[2] - self.model.kappa(i) * position + more;
                    (last, now) = (now, Some(half + more));
                }
                if i == Self::DRIVEN {
                    m += self.model.input_gain() * queued;
                }
                let next = self.foreseen(i, &[x_i; E], &[m; E], T::ZERO);
                let moved = next[0] - x_i[0];
                position += moved;
                x_i = next;
                if i == 0 {
                    seen = self.model.seen_ahead(seen, moved);
                }
            }
            (x[2 * i], x[2 * i + 1], d[i]) = (position, x_i[1], x_i[2]);
            if S == 4 {
                growth[i] = state.x[i][3];
            }
        }
        LawEstimates { x, d, growth, current: T::ZERO, seen }
    }

    /// Returns the estimates of coupled blocks at the start of the tick in which u is held.
    #[inline(always)]
    fn known_whole(
        &self,
        state: &StateOf<Self>,
        mut seen: M::Seen,
        before: &M::Push,
        whole: &Whole<T, 2, 3>,
    ) -> LawEstimates<T, M::Seen, E, N> {
        let (last, mut all, mut twist) = (Self::DRIVEN, state.x, self.twist(state, whole));
        let mut position = self.position(state, 0);
        let [mut current, asked] = M::currents(&state.push);
        let half = |push: &M::Push| M::of_block(push, 0).unwrap_or(T::ZERO);
        let (mut now, more) = (half(&state.push), half(&state.push) - half(before));
        for queued in state.queued {
            let on_its_way = sane(current - queued);
            let mut m = [T::ZERO; E];
            for (i, m_i) in m.iter_mut().enumerate() {
                *m_i = whole.spring[i] * twist + all[i][2];
            }
            // w at the end of the tick is unknown: it continues at its last rate.
            m[0] += (now + now) + more;
            m[last] += self.model.input_gain() * queued;
            let mut next = all;
            for (i, next_i) in next.iter_mut().enumerate() {
                *next_i = self.foreseen(i, &all, &m, on_its_way);
            }
            let moved = next[0][0] - all[0][0];
            twist += (next[last][0] - all[last][0]) - moved;
            position += moved;
            seen = self.model.seen_ahead(seen, moved);
            now += more;
            current = queued + whole.keeps * on_its_way;
            all = next;
        }
        let (mut x, mut d) = ([T::ZERO; N], [T::ZERO; E]);
        for i in 0..E {
            (x[2 * i], x[2 * i + 1], d[i]) = (if i == 0 { position } else { twist }, all[i][1], all[i][2]);
        }
        LawEstimates { x, d, growth: [T::ZERO; E], current: sane(current - asked), seen }
    }

    /// Computes step 4, and the distance from the target.
    #[inline(always)]
    fn errors(&self, known: &LawEstimates<T, M::Seen, E, N>, turn: T::Count, begin: &A::Target) -> Errors<T, N> {
        T::section("4. The chain.");
        let (z, drift) = self.model.chain(&known.x, &known.seen);

        T::section("5. Law.");
        Errors { e: A::errors(&z, turn, self.row.turn, begin), drift }
    }

    /// Computes step 5, for a reference that moves `pace` times as much.
    #[inline(always)]
    fn asked(
        &self,
        known: &LawEstimates<T, M::Seen, E, N>,
        errors: &Errors<T, N>,
        begin: &A::Target,
        end: &A::Target,
        pace: Option<T>,
    ) -> LawDemand<T> {
        let k = &self.row;
        let (LawEstimates { d, growth, seen, .. }, Errors { e, drift }) = (known, errors);
        let e = &self.model.weightless(e, seen);
        let sigma = self.sigma(e, known);
        let mut bare = -(k.per_b * (*drift + self.model.last(seen, d)));
        if A::POSITION {
            for j in 1..N {
                bare += k.kx[j] * e[j];
            }
        }
        for i in 0..Self::DRIVEN {
            bare += k.k_d[i] * d[i];
            if S == 4 {
                bare += k.k_growth[i] * growth[i];
            }
        }
        let mut ahead = T::ZERO;
        if S == 4 && A::POSITION {
            bare += k.k_last * self.model.last(seen, growth);
        }
        if let Some(moved) = A::moved(begin, end, k.turn) {
            let mut feed = k.feed[N - 1] * moved[N - 1];
            if M::HAS_GRADIENT {
                for j in 0..N - 1 {
                    feed += k.feed[j] * moved[j];
                }
            }
            let feed = pace.map_or(feed, |pace| feed * pace);
            bare += feed;
            ahead += feed;
        }
        if let Some(whole) = self.model.whole() {
            ahead -= k.per_b * *drift;
            let mut of_errors = T::ZERO;
            for (s, factor) in whole.ahead.iter().enumerate() {
                of_errors += *factor * e[s + 1];
            }
            bare += of_errors + whole.k_current * known.current;
            ahead += of_errors;
        }
        LawDemand { sigma, bare: bare.called("bare", 0), ahead }
    }

    /// Returns true if the target is too far for the near law, or is not a number.
    #[inline(always)]
    fn is_far(errors: &Errors<T, N>, far: T) -> bool {
        let is_near = errors.e[0].abs() <= far;
        A::POSITION && !is_near
    }

    /// Returns true if the power stage provides less than the design assumes.
    #[inline(always)]
    fn is_limited(&self, state: &StateOf<Self>) -> bool {
        state.limit.abs() < self.row.most
    }

    /// Returns the limits of u, lower and upper, including the limit of the power stage.
    #[inline(always)]
    pub(crate) fn present_limits(&self, state: &StateOf<Self>) -> [T; 2] {
        let (k, limit) = (&self.row, state.limit.abs());
        [-(-k.u_min).at_most(limit), k.u_max.at_most(limit)]
    }

    /// Returns `far` for the present limits.
    #[inline(always)]
    fn present_far<const STAGE: u8>(&self, state: &StateOf<Self>) -> T {
        self.limited_or::<STAGE>(state, self.row.far_per_u * state.limit.abs(), self.row.far)
    }

    /// Returns the errors with e_1 reduced for a far target.
    ///
    /// Near the target e_1 is the remaining distance, and σ = 0 makes it a speed. From `far` on e_1 counts less and
    /// less, so that four times the distance gives twice the speed. The speed follows chords of $v = \sqrt{2 a |e_1|}$,
    /// from which a constant braking comes to rest. Beyond 256 times `far` the speed stays constant.
    fn approached(mut errors: Errors<T, N>, far: T) -> Errors<T, N> {
        if !Self::is_far(&errors, far) {
            return errors;
        }
        let (away, mut counts) = (errors.e[0], far);
        let (mut left, mut chord, mut gain) = (away.abs() - counts, T::from_f64(3.0) * counts, T::from_f64(1.0 / 3.0));
        for _ in 0..CHORDS {
            let part = T::HALF * lesser(left, chord);
            counts += gain * part;
            left -= part;
            (chord, gain) = (T::from_f64(4.0) * chord, T::HALF * gain);
        }
        errors.e[0] = if away > T::ZERO { counts } else { -counts };
        errors
    }

    /// Returns a state that starts at the position of the counts.
    fn started(&self, counts: [T::Count; E], at: [T::Count; E], turn: T::Count, d: &[T; E]) -> StateOf<Self> {
        let mut x = [[T::ZERO; S]; E];
        for i in 0..E {
            x[i][2] = d[i];
        }
        let none = M::per_block([T::ZERO; E]);
        let mut state = EncoderState {
            last: counts,
            at,
            turn,
            x,
            push: none,
            alert: [[[T::ZERO; 2]; E]; FAST],
            reach: self.span(),
            missed: [T::ZERO; E],
            off: [T::ZERO; E],
            doubt: T::ZERO,
            offset: T::ZERO,
            held: T::ZERO,
            limit: self.row.most,
            reported: T::from_f64(NEVER),
            queued: [T::ZERO; LATE],
            fresh: true,
        };
        self.remember_counts(&mut state);
        state
    }

    /// Returns the largest distance of a count from its prediction.
    fn span(&self) -> T {
        self.sensors.iter().fold(T::ZERO, |most, k| if k.half_span > most { k.half_span } else { most })
    }

    /// Moves whole bases into the revolutions. In a tick this happens one by one ([`follow`](Self::follow)). A counter
    /// may have any value when a drive starts, or when its counts return.
    fn folded(&self, at: [T::Count; E], turn: T::Count) -> ([T::Count; E], T::Count) {
        let k = &self.sensors[0];
        let whole = |each: i32| at[0].whole(k.base_counts, each);
        let at = core::array::from_fn(|i| {
            let Sensor { base_counts, beyond, .. } = self.sensors[i];
            at[i].since(whole(base_counts)).signed(beyond)
        });
        (at, turn.plus(whole(k.base_turns)))
    }

    /// Moves a state without a past tick to the present counts. Returns false if a count is missing.
    #[inline(always)]
    fn go_on_to(&self, state: &mut StateOf<Self>, counts: &[Option<T::Count>; E]) -> bool {
        let mut all = true;
        for i in 0..E {
            T::channel(i + 1);
            let k = &self.sensors[i];
            match counts[i] {
                Some(count) => {
                    state.at[i] = state.at[i].plus(k.moved(count.since(state.last[i])));
                    state.last[i] = count;
                }
                None => all = false,
            }
        }
        (state.at, state.turn) = self.folded(state.at, state.turn);
        all
    }

    /// Moves the count of an encoder without a measurement along with the prediction, in quarters of the counter.
    ///
    /// So a returning count is compared with the predicted position, not with the last one. A prediction that moves
    /// faster per tick than any shaft counts no revolutions.
    #[doc(hidden)]
    pub fn carry(&self, state: &mut StateOf<Self>) {
        for i in 0..E {
            T::channel(i + 1);
            let (k, p) = (&self.sensors[i], state.x[i][0]);
            let quarter = T::Count::of(k.quarter_counts);
            if p.abs() <= k.quarter || p.abs() > k.quarter + k.quarter {
                continue;
            }
            if p > T::ZERO {
                (state.last[i], state.at[i]) = (state.last[i].plus(quarter), state.at[i].plus(quarter));
                state.x[i][0] = p - k.quarter;
            } else {
                (state.last[i], state.at[i]) = (state.last[i].since(quarter), state.at[i].since(quarter));
                state.x[i][0] = p + k.quarter;
            }
        }
    }

    /// Moves the base by whole revolutions. This changes no acceleration: w moves as κX does.
    #[doc(hidden)]
    pub fn follow(&self, state: &mut StateOf<Self>) {
        let raw = self.raw(state, 0);
        if raw.abs() <= self.sensors[0].edge {
            return;
        }
        let forward = raw > T::ZERO;
        let mut half = [T::ZERO; E];
        for i in 0..E {
            let k = &self.sensors[i];
            let base = T::Count::of(k.base_counts);
            let at = if forward { state.at[i].since(base) } else { state.at[i].plus(base) }.signed(k.beyond);
            half[i] = T::HALF * self.model.kappa(i) * (k.unit * T::from_count(at.since(state.at[i])));
            state.at[i] = at;
        }
        let turns = T::Count::of(self.sensors[0].base_turns);
        state.turn = if forward { state.turn.plus(turns) } else { state.turn.since(turns) };
        if self.model.whole().is_some() {
            // A whole revolution changes no sine, and both shafts have made it.
            return;
        }
        state.push = M::per_block(core::array::from_fn(|i| M::of_block(&state.push, i).unwrap_or(T::ZERO) + half[i]));
    }

    /// Computes a tick that is not ordinary.
    #[cold]
    #[inline(never)]
    fn rest<const STAGE: u8>(&self, state: &mut StateOf<Self>, sample: &Sample<T::Count, A::Target, E>) -> Output<T> {
        let (before, counts) = (state.push, &sample.counts);
        let mut missing = false;
        let (seen, begins, health) = if state.fresh {
            let (seen, begins, known) = self.begun(state, counts);
            if !known {
                return self.not_started();
            }
            (seen, begins, Health::OK)
        } else {
            let observed = self.observe_rest(state, counts);
            missing = observed.missing;
            let Observed { seen, stepped, known, .. } = observed;
            if !known {
                let output = self.give_up(state, counts);
                self.follow(state);
                self.carry(state);
                return output;
            }
            (seen, false, Health::SAMPLE_LOST.when(missing).union(Health::POSITION_STEPPED.when(stepped)))
        };
        let output = self.ask_rest::<STAGE>(state, sample, seen, &before, begins);
        self.follow(state);
        if missing {
            self.carry(state);
        }
        Output { health: output.health.union(health), ..output }
    }

    /// Computes the first tick of a state, or a tick of waiting for consistent counts. Returns true if the waiting is
    /// over, and true if the law may run.
    #[doc(hidden)]
    pub fn begun(&self, state: &mut StateOf<Self>, counts: &[Option<T::Count>; E]) -> (M::Seen, bool, bool) {
        let was_waiting = state.doubt > T::ZERO;
        let is_over = if was_waiting {
            self.agree(state, counts)
        } else {
            self.go_on_to(state, counts);
            true
        };
        state.fresh = !is_over;
        let seen = self.model.seen(&core::array::from_fn(|i| self.position(state, i)));
        (seen, was_waiting, is_over)
    }

    /// Computes a tick of waiting. Returns true if the waiting is over.
    ///
    /// The counts agree if all are present and repeat their last change, within twice the agreement of counts.
    /// Otherwise the waiting restarts. The speed is the change per tick.
    fn agree(&self, state: &mut StateOf<Self>, counts: &[Option<T::Count>; E]) -> bool {
        let mut agree = true;
        let mut speed = [T::ZERO; E];
        for i in 0..E {
            T::channel(i + 1);
            let k = &self.sensors[i];
            if let Some(count) = counts[i] {
                let moved = k.unit * T::from_count(k.moved(count.since(state.last[i])));
                let before = state.x[i][1];
                let agreement = self.belief.agreement[i];
                let agrees = (moved - self.row.period * before).abs() <= agreement + agreement;
                speed[i] = moved / self.row.period;
                if agrees {
                    // Half of the effect of one count on a difference.
                    speed[i] = T::HALF * (before + speed[i]);
                }
                agree = agree && agrees;
            } else {
                agree = false;
            }
        }
        let (most, waiting) = (self.belief.start_ticks, state.doubt);
        self.go_on_to(state, counts);
        if !agree && state.reach > T::ZERO {
            // Before a first position is known, a false count must not move it by a revolution.
            let at = core::array::from_fn(|i| self.sensors[i].moved(state.last[i]));
            (state.at, state.turn) = self.folded(at, T::Count::of(0));
        }
        self.start_anew(state, &speed, most);
        if !(agree && waiting <= most) {
            return false;
        }
        // Counts that move like a shaft are accepted soon. A constant value may come from a dead encoder.
        let moves = (0..E).all(|i| {
            let (way, twice) = self.way_in_a_tick(state, i);
            way > twice
        });
        let left = waiting - if moves { T::HALF * most } else { T::from_f64(1.0) };
        state.doubt = left.limited(T::ZERO, most);
        let is_over = left <= T::ZERO;
        if is_over {
            state.reach = T::ZERO;
        }
        is_over
    }

    /// Restarts at the present counts with this speed, and waits for `waiting` agreements. d stays, and the fallback is
    /// the output.
    ///
    /// It writes word by word: a copy of a whole state would be a loop, which has no WCET bound.
    fn start_anew(&self, state: &mut StateOf<Self>, speed: &[T; E], waiting: T) {
        let u = self.not_started().u;
        for i in 0..E {
            let d = state.x[i][2];
            state.x[i] = [T::ZERO; S];
            (state.x[i][1], state.x[i][2]) = (speed[i], d);
            (state.missed[i], state.off[i]) = (T::ZERO, T::ZERO);
            for f in 0..FAST {
                state.alert[f][i] = [T::ZERO; 2];
            }
        }
        state.offset = T::ZERO;
        (state.doubt, state.held, state.queued) = (waiting, u, [u; LATE]);
        self.remember_counts(state);
    }

    /// Advances the state by a period without a tick: the queue moves, its newest u stays. Returns `false` if too much
    /// is missing.
    #[doc(hidden)]
    pub fn pass(&self, state: &mut StateOf<Self>) -> bool {
        let Observed { known, .. } = self.observe_rest(state, &[None; E]);
        let newest = Self::commanded(state);
        Self::hold(state, newest);
        state.offset -= self.row.decay * state.offset;
        known
    }

    /// Returns `limited` if the power stage is limited, else `unlimited`. `STAGE` may fix the choice at compile time.
    #[inline(always)]
    fn limited_or<const STAGE: u8>(&self, state: &StateOf<Self>, limited: T, unlimited: T) -> T {
        match STAGE {
            UNLIMITED => unlimited,
            LIMITED => limited,
            _ => state.limit.abs().if_below(self.row.most, limited, unlimited),
        }
    }

    /// Computes steps 4 to 6 of any tick. `STAGE` may fix at compile time if the power stage is limited, with one code
    /// path for each case.
    #[doc(hidden)]
    #[inline(always)]
    pub fn ask_rest<const STAGE: u8>(
        &self,
        state: &mut StateOf<Self>,
        sample: &Sample<T::Count, A::Target, E>,
        seen: M::Seen,
        before: &M::Push,
        begins: bool,
    ) -> Output<T> {
        let known = self.known(state, seen, before);
        let errors = self.errors(&known, state.turn, &sample.begin);
        let (k, [u_min, u_max]) = (&self.row, self.present_limits(state));
        let limits = [self.limited_or::<STAGE>(state, u_min, k.u_min), self.limited_or::<STAGE>(state, u_max, k.u_max)];
        let far = self.present_far::<STAGE>(state);
        let is_far = Self::is_far(&errors, far);
        if is_far && !is_sound(errors.e[0]) {
            return self.refuse(state, Health::OK);
        }
        let asked = self.asked(&known, &Self::approached(errors, far), &sample.begin, &sample.end, None);
        self.go_ahead(state, asked.ahead);
        let output = if begins {
            self.start_offset(state, asked.sigma, asked.bare, limits)
        } else {
            self.answer(state, asked, limits)
        };
        if STAGE != UNLIMITED {
            // A limit detected from reports rises again tick by tick. A limit set by the caller does not.
            let one = T::from_f64(1.0);
            let is_found = (state.reported + one).abs().at_most(one);
            let higher = (state.limit.abs() + is_found * (T::from_f64(RISE) * k.most)).at_most(k.most);
            state.limit = self.limited_or::<STAGE>(state, higher, state.limit);
        }
        if is_far { Self::without_sigma_star(output) } else { output }
    }

    /// Removes σ* from the output: monitors of σ* assume the linear surface.
    fn without_sigma_star(output: Output<T>) -> Output<T> {
        Output { sigma_star: T::ZERO, ..output }
    }

    /// Computes steps 4 and 5 of an ordinary tick, and its output.
    #[inline(always)]
    fn ask(
        &self,
        state: &mut StateOf<Self>,
        sample: &Sample<T::Count, A::Target, E>,
        seen: M::Seen,
        before: M::Push,
    ) -> Output<T> {
        let known = self.known(state, seen, &before);
        let errors = self.errors(&known, state.turn, &sample.begin);
        if Self::is_far(&errors, self.row.far) {
            // Repeats everything: arguments to pass would have to be kept in every tick.
            return self.ask_far(state, sample, [before; LATE]);
        }
        let limits = [self.row.u_min, self.row.u_max];
        let asked = self.asked(&known, &errors, &sample.begin, &sample.end, None);
        self.go_ahead(state, asked.ahead);
        self.answer(state, asked, limits)
    }

    /// Advances the reference current like the current of the shaft.
    #[inline(always)]
    fn go_ahead(&self, state: &mut StateOf<Self>, ahead: T) {
        if let Some(whole) = self.model.whole() {
            let [current, asked] = M::currents(&state.push);
            let asked = sane(ahead + whole.keeps * (asked - ahead));
            state.push = M::with_currents(state.push, [current, asked]);
        }
    }

    /// Computes a tick far from the target.
    #[cold]
    #[inline(never)]
    fn ask_far(
        &self,
        state: &mut StateOf<Self>,
        sample: &Sample<T::Count, A::Target, E>,
        before: [M::Push; LATE],
    ) -> Output<T> {
        let raw = core::array::from_fn(|i| self.raw(state, i));
        let seen = self.model.seen_ahead(self.model.seen(&raw), state.x[0][0]);
        // Not read without a delay.
        let before = before.first().copied().unwrap_or(state.push);
        self.ask_rest::<UNLIMITED>(state, sample, seen, &before, false)
    }

    #[inline(always)]
    fn answer(&self, state: &mut StateOf<Self>, asked: LawDemand<T>, limits: [T; 2]) -> Output<T> {
        let k = &self.row;
        let LawDemand { sigma, bare, .. } = asked;
        let sigma_star = (sigma - state.offset).called("sigma_star", 0);
        let demand = (bare + k.k_offset * state.offset + k.us * sigma).called("demand", 0);
        let is_plausible = demand.abs() <= k.plausible;
        if !is_plausible {
            return self.start_offset(state, sigma, bare, limits);
        }
        self.put_out(state, [sigma, sigma_star, demand], limits)
    }

    /// Replaces an offset far from the reference, or an invalid one, as at the start.
    #[cold]
    #[inline(never)]
    fn start_offset(&self, state: &mut StateOf<Self>, sigma: T, bare: T, limits: [T; 2]) -> Output<T> {
        let demand = bare + self.row.kw * sigma;
        if !is_sound(demand) {
            return self.refuse(state, Health::OK);
        }
        state.offset = sigma;
        self.put_out(state, [sigma, T::ZERO, demand], limits)
    }

    #[inline(always)]
    fn put_out(&self, state: &mut StateOf<Self>, asked: [T; 3], [u_min, u_max]: [T; 2]) -> Output<T> {
        let ([sigma, sigma_star, demand], k) = (asked, &self.row);
        // As `limited`, in one code path: in an operation trace the limits may be variables.
        let u = u_max.if_below(demand, u_max, demand.if_below(u_min, u_min, demand)).called("u", 0);
        T::section("6. Memory.");
        Self::hold(state, u);
        state.offset -= k.decay * state.offset;
        Output { u, sigma, sigma_star, health: Health::SATURATED.when(u != demand) }
    }

    /// Outputs the fallback because too much is missing. Without all counts the observers continue to predict. If all
    /// counts are present but were rejected for too long, the drive waits for consistent counts.
    #[cold]
    #[inline(never)]
    #[doc(hidden)]
    pub fn give_up(&self, state: &mut StateOf<Self>, counts: &[Option<T::Count>; E]) -> Output<T> {
        let u = self.fallback(state);
        let waits = counts.iter().all(Option::is_some);
        if waits {
            (state.fresh, state.doubt) = (true, self.belief.start_ticks);
            for x in &mut state.x {
                x[2] = T::ZERO;
            }
        }
        // In both cases: a fresh state has no reach, and one store needs no selected address.
        state.reach = T::ZERO;
        Self::hold(state, u);
        let health = Health::INPUT_REJECTED.union(Health::SAMPLE_LOST).union(Health::WAITS.when(waits));
        Output { u, sigma: T::ZERO, sigma_star: T::ZERO, health }
    }

    /// Rejects the demand: the fallback is the output.
    #[inline(always)]
    #[doc(hidden)]
    pub fn refuse(&self, state: &mut StateOf<Self>, health: Health) -> Output<T> {
        let u = self.fallback(state);
        Self::hold(state, u);
        let health = health.union(Health::INPUT_REJECTED);
        Output { u, sigma: T::ZERO, sigma_star: T::ZERO, health }
    }

    /// Returns the fallback output within the present limits.
    #[inline(always)]
    fn fallback(&self, state: &StateOf<Self>) -> T {
        let last = Self::commanded(state);
        let last = if is_sound(last) { last } else { T::ZERO };
        let [u_min, u_max] = self.present_limits(state);
        (self.row.hold * last + self.row.fallback).limited(u_min, u_max)
    }

    /// Converts estimates of another design to the units of this design, with the acceleration of every block
    /// unchanged. Returns the change of d.
    fn convert(&self, from: &Self, state: &mut StateOf<Self>) -> [T; E] {
        let mut shift = [T::ZERO; E];
        for i in 0..E {
            shift[i] = from.acceleration(state, i);
        }
        for i in 0..E {
            let unit = self.model.per_rad(i) / from.model.per_rad(i);
            for s in 0..S {
                state.x[i][s] = state.x[i][s] * unit;
            }
            for f in 0..FAST {
                state.alert[f][i][0] = state.alert[f][i][0] * unit;
            }
            shift[i] = shift[i] * unit;
        }
        state.reach = self.span();
        for i in 0..E {
            shift[i] -= self.acceleration(state, i);
            state.x[i][2] += shift[i];
        }
        let currents = M::currents(&state.push);
        self.remember_counts(state);
        state.push = M::with_currents(state.push, currents);
        shift
    }

    /// Returns the nominal acceleration of a block, from the model without d.
    fn acceleration(&self, state: &StateOf<Self>, i: usize) -> T {
        let k = &self.blocks[i];
        let mut sum = -k.lambda * state.x[i][1];
        if self.model.whole().is_some() {
            let driving =
                if i == Self::DRIVEN { self.model.input_gain() * M::currents(&state.push)[0] } else { T::ZERO };
            return sum + driving + (self.pull(state, i).unwrap_or(T::ZERO) - state.x[i][2]);
        }
        if let Some(half) = M::of_block(&self.push_at_counts(state), i) {
            sum += half + half - self.model.kappa(i) * self.position(state, i);
        }
        if i == Self::DRIVEN {
            sum += self.model.input_gain() * state.held;
        }
        sum
    }

    /// Returns every number of the design.
    fn numbers(&self) -> impl Iterator<Item = T> {
        let blocks = self.blocks.iter().flat_map(Block::numbers);
        let sensors = self.sensors.iter().flat_map(Sensor::numbers);
        let fast = self.fast.as_flattened().iter().flat_map(FastGains::numbers);
        let (belief, inertia) = (self.belief.numbers(), self.inertia);
        blocks
            .chain(sensors)
            .chain(fast)
            .chain(self.row.numbers())
            .chain(belief)
            .chain(inertia)
            .chain(self.model.numbers())
    }

    /// Returns the u that was commanded last.
    #[inline(always)]
    fn commanded(state: &StateOf<Self>) -> T {
        state.queued.last().copied().unwrap_or(state.held)
    }

    /// Queues u for the actuator, behind the queued values.
    #[inline(always)]
    fn hold(state: &mut StateOf<Self>, u: T) {
        state.held = u;
        for queued in state.queued.iter_mut().rev() {
            core::mem::swap(&mut state.held, queued);
        }
    }
}

/// Law of a drive in f32, with or without monitors, whose reference is a position and its derivatives.
pub trait DriveLaw<const E: usize, const N: usize>:
    ControlLaw<Scalar = f32, Output = Output<f32>, Estimates = DriveEstimates<f32, i32, E>>
{
    /// Ticks between computation and output of u.
    const LATE: usize;
    /// True if the reference is a position, false if it is a speed.
    const POSITION: bool;

    /// Returns the input of a tick.
    fn sample(counts: [Option<i32>; E], begin: &Target<f32, i32, N>, end: &Target<f32, i32, N>) -> Self::Sample;
}

impl<M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize> DriveLaw<E, N>
    for EncoderForm<f32, M, A, E, N, S, FAST, LATE>
where
    M: ChainModel<f32, E, N>,
    A: Aim<f32, N>,
{
    const LATE: usize = LATE;
    const POSITION: bool = A::POSITION;

    #[inline(always)]
    fn sample(
        counts: [Option<i32>; E],
        begin: &Target<f32, i32, N>,
        end: &Target<f32, i32, N>,
    ) -> Sample<i32, A::Target, E> {
        Sample { counts, begin: A::told(begin), end: A::told(end) }
    }
}

impl<L: DriveLaw<E, N>, const E: usize, const N: usize> DriveLaw<E, N> for &L {
    const LATE: usize = L::LATE;
    const POSITION: bool = L::POSITION;

    #[inline(always)]
    fn sample(counts: [Option<i32>; E], begin: &Target<f32, i32, N>, end: &Target<f32, i32, N>) -> L::Sample {
        L::sample(counts, begin, end)
    }
}

/// Returns twice the smaller number, or NaN if one of them is NaN.
#[inline(always)]
fn lesser<T: Real>(a: T, b: T) -> T {
    a + b - (a - b).abs()
}

/// Returns the number if it is [sound](is_sound), else 0, so that a recursive state cannot stay NaN.
#[inline(always)]
fn sane<T: Real>(value: T) -> T {
    value.abs().if_below(T::from_f64(INPUT_LIMIT), value, T::ZERO)
}

/// Returns true within ±[`INPUT_LIMIT`]. False for NaN and infinities.
#[inline(always)]
fn is_sound<T: Real>(value: T) -> bool {
    value.abs() <= T::from_f64(INPUT_LIMIT).called("input_limit", 0)
}

impl<T, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize> ControlLaw
    for EncoderForm<T, M, A, E, N, S, FAST, LATE>
where
    T: Real,
    M: ChainModel<T, E, N>,
    A: Aim<T, N>,
{
    type Scalar = T;
    type Sample = Sample<T::Count, A::Target, E>;
    type Output = Output<T>;
    type State = EncoderState<T, M, E, N, S, FAST, LATE>;
    /// Disturbance d of each block at the start, in rad/s² of its shaft.
    type Guess = [T; E];
    type Estimates = DriveEstimates<T, T::Count, E>;
    const NO_GUESS: [T; E] = [T::ZERO; E];

    /// Starts if all counts are present. The angles are then within half a counter of 0.
    ///
    /// Returns `None` if the model could not stand still there ([`ChainModel::may_stand`]). An example is a motor
    /// counter that has advanced over revolutions that the link encoder cannot show.
    fn start_from(&self, sample: &Self::Sample, d: &[T; E]) -> Option<Self::State> {
        let () = Self::SHAPE;
        let (mut counts, mut at) = ([T::Count::of(0); E], [T::Count::of(0); E]);
        let mut d = *d;
        for i in 0..E {
            counts[i] = sample.counts[i]?;
            at[i] = self.sensors[i].moved(counts[i]);
            d[i] = d[i] * self.model.per_rad(i);
        }
        let (at, turn) = self.folded(at, T::Count::of(0));
        let mut state = self.started(counts, at, turn, &d);
        let position = core::array::from_fn(|i| self.position(&state, i));
        let u_max = if self.row.u_max > -self.row.u_min { self.row.u_max } else { -self.row.u_min };
        if !self.model.may_stand(&position, u_max) {
            return None;
        }
        let known = self.known(&state, self.model.seen(&position), &state.push);
        let errors = self.errors(&known, state.turn, &sample.begin);
        if !errors.e.iter().all(|&e| is_sound(e)) {
            return None;
        }
        state.offset =
            self.asked(&known, &Self::approached(errors, self.row.far), &sample.begin, &sample.end, None).sigma;
        (is_sound(state.offset) && d.iter().all(|&d| is_sound(d))).then_some(state)
    }

    #[inline]
    fn not_started(&self) -> Output<T> {
        Output {
            u: self.row.fallback.limited(self.row.u_min, self.row.u_max),
            sigma: T::ZERO,
            sigma_star: T::ZERO,
            health: Health::INPUT_REJECTED.union(Health::WAITS),
        }
    }

    /// Makes a state that has just started wait until its counts have been consistent for 10 ms, at least three ticks.
    fn wait(&self, state: &mut Self::State) {
        state.doubt = self.belief.start_ticks;
    }

    #[inline(always)]
    fn tick(&self, state: &mut Self::State, sample: &Self::Sample) -> Output<T> {
        let before = state.push;
        if self.is_limited(state) {
            return self.rest::<LIMITED>(state, sample);
        }
        let ordinary = if state.fresh { None } else { self.observe(state, &sample.counts) };
        // Both paths contain the rest of the tick: behind a common end everything would be reloaded.
        match ordinary {
            Some(seen) => self.ask(state, sample, seen, before),
            None => self.rest::<UNLIMITED>(state, sample),
        }
    }

    /// Computes a tick without counts and targets: the observers predict, and the fallback is the output.
    fn lost(&self, state: &mut Self::State) -> Output<T> {
        let counts = [None; E];
        if state.fresh && state.doubt > T::ZERO {
            self.begun(state, &counts);
            return self.not_started();
        }
        let output = if !state.fresh && !self.observe_rest(state, &counts).known {
            self.give_up(state, &counts)
        } else {
            self.refuse(state, Health::SAMPLE_LOST)
        };
        self.follow(state);
        self.carry(state);
        output
    }

    /// Advances the model by `periods` with u held, but no further than samples may be missing. The periods count as at
    /// most half of the allowed missing samples. So the following counts have the other half to agree on the position.
    fn missed(&self, state: &mut Self::State, periods: u32) {
        let mut left = periods;
        while left > 0 && !state.fresh && self.pass(state) {
            self.follow(state);
            self.carry(state);
            left -= 1;
        }
        let half = T::from_f64(0.5) * self.belief.lost_ticks;
        state.missed = state.missed.map(|missed| missed.at_most(half));
    }

    /// Stores the applied u, and detects a limit of the power stage. A stage that reports one value twice in a row,
    /// clearly below the output, is at its limit. The limit holds until some ticks have passed. A sensor error of 20 %
    /// does not trigger it.
    #[inline]
    fn report_applied(state: &mut Self::State, u: T) -> bool {
        let taken = is_sound(u);
        if taken {
            if state.reported >= T::ZERO {
                let (given, short) = (u.abs(), state.held.abs() - u.abs());
                let is_short = short > T::from_f64(SHORT) * state.limit && short > T::from_f64(CLEARLY) * given;
                if is_short && given == state.reported {
                    state.limit = given;
                }
                state.reported = if is_short { given } else { T::from_f64(NEVER) };
            }
            state.held = u;
        }
        taken
    }

    #[inline]
    fn limit(state: &mut Self::State, u: T) -> bool {
        let taken = u >= T::ZERO;
        if taken {
            (state.limit, state.reported) = (u, T::from_f64(-1.0));
        }
        taken
    }

    fn estimates(&self, state: &Self::State) -> Self::Estimates {
        let of = |i: usize, value: T| value / self.model.per_rad(i);
        let disturbance = core::array::from_fn(|i| of(i, state.x[i][2]));
        DriveEstimates {
            turn: state.turn,
            position: core::array::from_fn(|i| of(i, self.position(state, i))),
            speed: core::array::from_fn(|i| of(i, state.x[i][1])),
            disturbance,
            load: core::array::from_fn(|i| -self.inertia[i] * disturbance[i]),
        }
    }

    fn take_over(&self, from: &Self, state: &Self::State, sample: &Self::Sample) -> Result<Self::State, RetuneError> {
        let k = &self.row;
        if !self.sensors.iter().zip(&from.sensors).all(|(new, old)| new.counts_alike(old)) {
            return Err(RetuneError::OtherEncoder);
        }
        if (k.us - k.kw).abs() < T::from_f64(0.1) * k.us.abs() {
            return Err(RetuneError::GainNearDecay);
        }
        // The past tick had the period of its own design.
        let same_period = k.period == from.row.period;
        let (mut old, mut shift) = (state.clone(), [T::ZERO; E]);
        if same_period {
            shift = self.convert(from, &mut old);
        }
        let (seen, known) = if old.fresh {
            self.go_on_to(&mut old, &sample.counts);
            let position = core::array::from_fn(|i| self.position(&old, i));
            (self.model.seen(&position), true)
        } else {
            let under = if same_period { self } else { from };
            let Observed { seen, known, .. } = under.observe_rest(&mut old, &sample.counts);
            (seen, known)
        };
        if !same_period {
            shift = self.convert(from, &mut old);
        }
        let mut new = old;
        let push = new.push;
        let now = self.known(&new, seen, &push);
        let pace = from.row.period / k.period;
        let (mut x, mut d, mut growth) = (now.x, now.d, now.growth);
        for i in 0..E {
            let unit = from.model.per_rad(i) / self.model.per_rad(i);
            x[2 * i] = x[2 * i] * unit;
            x[2 * i + 1] = x[2 * i + 1] * unit;
            d[i] = (d[i] - shift[i]) * unit;
            growth[i] = growth[i] * unit;
        }
        let seen = from.model.seen(&core::array::from_fn(|i| x[2 * i]));
        let before = LawEstimates { x, d, growth, current: now.current, seen };
        let Sample { begin, end, .. } = sample;
        let errors = Self::approached(self.errors(&now, new.turn, begin), self.present_far::<ANY_STAGE>(&new));
        let asked = self.asked(&now, &errors, begin, end, None);
        let errors = Self::approached(from.errors(&before, new.turn, begin), from.present_far::<ANY_STAGE>(&new));
        let wanted = from.asked(&before, &errors, begin, end, (!same_period).then_some(pace));
        let wanted = wanted.bare + from.row.kw * new.offset + from.row.us * (wanted.sigma - new.offset);
        let offset = (wanted - (asked.bare + k.us * asked.sigma)) / (k.kw - k.us);
        if !known || !is_sound(asked.sigma) || !is_sound(wanted) {
            return Err(RetuneError::Sample);
        }
        if !is_sound(offset) {
            return Err(RetuneError::OffsetOutOfRange);
        }
        new.offset = if self.at_rest { T::ZERO } else { offset };
        if new.limit >= from.row.most && new.reported >= T::ZERO {
            new.limit = k.most;
        }
        if state.fresh {
            new.reach = state.reach;
        } else {
            // In a fresh state this number would mean a wait.
            new.doubt = T::ZERO;
        }
        new.fresh = true;
        Ok(new)
    }

    /// Hashes version, precision, form and every number of the design and of its model.
    fn fingerprint(&self) -> u32 {
        let shape = [E, S, FAST, LATE, usize::from(A::POSITION)].map(|number| number as u32);
        let head = [crate::VERSION_NUMBER, T::WORDS as u32].into_iter().chain(shape);
        let sensors =
            self.sensors.iter().flat_map(|k| [k.unread, k.states as u32, k.base_counts as u32, k.base_turns as u32]);
        hash(head.chain(sensors).chain(self.numbers().flat_map(Real::to_words)))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use core::f64::consts::TAU;

    use crate::drive::{Encoder, Joint, JointDesign, JointDrive, Motor, MotorDesign, MotorDrive, Position, Target};
    use crate::running::Words as _;

    /// Compares both code paths of a tick from one state, on counts that pass whole revolutions, jump and are lost.
    /// Every bit of output and state must agree.
    #[test]
    fn the_rare_way_gives_an_ordinary_tick_the_same_bits() {
        let encoders = [Encoder::absolute(20); 2];
        let design = JointDesign::new(1e-3, Joint::TABLE_I, encoders, Limits::symmetric(30.0), 1.3);
        let law = JointDrive::<f32, Position, 1, 1>::design(&design);
        let mut seed = 1_u64;
        let mut noise = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as i32
        };
        let (mut ordinary, mut state) = (0, None);
        for tick in 0..20_000 {
            // Back and forth over four revolutions.
            let angle = 4.0 * TAU * libm::sin(1e-3 * f64::from(tick));
            let count = (angle / TAU * 1_048_576.0) as i32;
            let mut counts = [0, 1].map(|_| Some(count + noise() % 3));
            match noise() % 100 {
                0 => counts[0] = None,
                1 => counts[1] = None,
                2 => counts[1] = Some(noise()),
                _ => {}
            }
            let target = Target { turn: 0, jet: [angle as f32, 0.0, 0.0, 0.0] };
            let sample = Sample { counts, begin: target, end: target };
            if state.is_none() {
                state = law.start(&sample);
            }
            let Some(state) = &mut state else { continue };
            let mut other = state.clone();
            ordinary += usize::from(!state.fresh && law.observe(&mut other.clone(), &counts).is_some());
            let (output, by_rest) = (law.tick(state, &sample), law.rest::<UNLIMITED>(&mut other, &sample));
            let bits = |out: &Output<f32>| [out.u, out.sigma, out.sigma_star].map(f32::to_bits);
            assert_eq!((bits(&output), output.health), (bits(&by_rest), by_rest.health), "tick {tick}");
            assert!(state.words().eq(other.words()), "tick {tick}: {state:?}, {other:?}");
        }
        let turn = state.map(|state| state.turn);
        assert!(ordinary > 15_000 && ordinary < 19_990, "{ordinary} ordinary ticks, turn {turn:?}");
    }

    /// Checks a nominal motor under a constant load. The prediction for the tick in which u will be held is the later
    /// position, with any u in the queue.
    #[test]
    fn what_a_late_motor_foresees_comes_true() {
        fn worst<const LATE: usize>() -> f64 {
            let motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 0.0 };
            let encoder = Encoder::incremental(32, 1 << 24);
            let design = MotorDesign::by_rule(1e-3, motor, encoder, Limits::symmetric(10.0)).with_lag(0.0, LATE as u32);
            let law = MotorDrive::<f64, Position, 0, LATE>::design(&design);
            let (b, t, load) = (motor.input_gain(), design.period_s, 40.0);
            let still = Target { turn: 0, jet: [0.0; 2] };
            let (mut state, mut x, mut seed) = (None, [0.0_f64; 2], 1_u64);
            let (mut foreseen, mut worst) = (std::collections::VecDeque::new(), 0.0_f64);
            let mut queue = std::collections::VecDeque::from(std::vec![0.0; LATE]);
            for tick in 0..4000 {
                let count = libm::round(x[0] / encoder.unit_rad()) as i32;
                let sample = Sample { counts: [Some(count)], begin: still, end: still };
                let state = state.get_or_insert_with(|| law.start(&sample).expect("good counts"));
                law.tick(state, &sample);
                // The test's own demand instead of the demand of the law.
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let u = (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0 - 10.0 * x[0] - x[1] / 10.0 - load / b;
                match state.queued.last_mut() {
                    Some(newest) => *newest = u,
                    None => state.held = u,
                }
                queue.push_back(u);
                let held = queue.pop_front().expect("one at least");
                assert_eq!(state.held, held);
                let acceleration = b * held + load;
                x = [x[0] + x[1] * t + acceleration * t * t / 2.0, x[1] + acceleration * t];
                // Before the next tick the state belongs to this tick: the test reads its prediction for the tick after
                // the queue.
                let mut next = state.clone();
                next.held = held;
                let count = libm::round(x[0] / encoder.unit_rad()) as i32;
                if let Some(seen) = law.observe(&mut next, &[Some(count)]) {
                    let known = law.known(&next, seen, &());
                    let whole = TAU * f64::from(next.turn);
                    foreseen.push_back((tick + 1 + LATE, [known.x[0] + whole, known.x[1]]));
                }
                while foreseen.front().is_some_and(|(when, _)| *when <= tick + 1) {
                    let (when, known) = foreseen.pop_front().expect("one at least");
                    if when == tick + 1 && tick > 2000 {
                        worst = worst.max((known[0] - x[0]).abs()).max(1e-3 * (known[1] - x[1]).abs());
                    }
                }
            }
            worst
        }
        let found = [worst::<0>(), worst::<1>(), worst::<2>(), worst::<3>()];
        std::println!("off by {found:?} rad, or thousandths of rad/s");
        // One count is 3.7e-7 rad.
        assert!(found.iter().all(|off| *off < 4e-7), "{found:?}");
    }
}
