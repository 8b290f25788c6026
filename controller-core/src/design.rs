//! Design computation: from a [`Config`] to the coefficient rows of the tick.
//!
//! Everything here is `f64`, runs once, and is `const fn` without any library function. So the compiler can design a
//! controller, and the design can lie in flash. Symbols (i, j, q count from 1, $c_n = 1$):
//!
//! * $\lambda = -\partial a/\partial x_n$ is the nominal slope. $t_j = T^j \varphi_j(-\lambda T)$ with
//!   $\varphi_j(z) = \sum_m z^m/(m+j)!$ is the motion of $x_n, x_{n-1}, ..$ after one tick of a unit input of channel
//!   n.
//! * $\theta, \mu_2$: first and second moment of that response over the tick. 1/2 and 1/3 for a channel without slope.
//! * $\gamma_1..\gamma_r$: coefficients of $\det(wI - (e^{DT} - I))$, the discrete observer gains.
//! * $K_v = \sum_i c_i t_{n-i+1}$: the change of $\sigma$ in one tick per unit of $u b$. Every row is divided by it.
//!
//! # Folding
//! The observer's Taylor state $S_m = T^{m+1} \hat d^{(m)}/m!$ is kept as $A = S_0 + \theta S_1 + \mu_2 S_2$,
//! $B = S_1 + (1 + 2\theta) S_2$, $C = 2 S_2$; a row $(k_0, k_1, k_2)$ on $S$ becomes
//! $k_A = k_0$, $k_B = k_1 - \theta k_0$, $k_C = (k_2 - \mu_2 k_0 - (1 + 2\theta) k_B)/2$ on $(A, B, C)$.
//! Channels $i < n$ are in physical units (divided by T). Then $k_A$ equals the row's entry of $x_{i+1}$, and one sum
//! $y_{i+1} = x_{i+1} + A_i$ serves both $\sigma^*$ and the law. Channel n is in units of u (divided by $T b_0$). There
//! its entry is exactly -1. The unfolded form is the oracle in `tests/` (test
//! `formula::folded_tick_equals_the_plain_transcription`).
//!
//! # Range
//! The sums of the law have a unit of their own. In this unit the largest number of the precision stands for $\Lambda$,
//! in the unit of u. A term beyond $\Lambda$ overflows, and neither infinity nor NaN disappears from a sum. So one
//! check of the demand covers every word of the state separately, including words whose terms would cancel. The unit is
//! a power of two, and changes no bit of u:
//! $$ \Lambda = 2^m \ge \max(\min(2^{20} U, 10^{12}), 2 K), \quad m \ge 2 $$
//! U is the larger of the limits, and K is the largest entry of the rows. After a valid tick the state lies in the set
//! M of the design:
//! * $k_{x,i+1} (x_{i+1} + A_i)$, $k_B B$, $k_C C$, $k_w W$ and $u_\sigma \sigma^*$ lie within $\pm \Lambda$.
//! * $a_u + A_n$, which stands in the demand itself, lies within the remaining range.
//! * The last sample and P come from this sample, and u lies within its limits.
//!
//! An observer of lower order than R does not estimate all entries. It never corrects an entry that it does not
//! estimate. A wrong value in such an entry stays if it lies in M.
//!
//! # Design outside the process
//! A design is a row of plain numbers in one declared order, [`LAYOUT`]. [`Coefficients::numbers`] returns the numbers,
//! and [`Coefficients::from_numbers`] reads and checks them. A host program transfers a design to a target in this way.

use core::slice;

use crate::MAX_R;
use crate::config::{Config, Fallback, INPUT_LIMIT};
use crate::error::{Cause, ConfigError, Field};
use crate::exponential::{FACTORIAL, PHIS, phi_functions, raised};
use crate::law::Limits;
use crate::real::{Real, row_f32};
use crate::running::hash;

/// Order of the numbers of a [`Coefficients`] outside the process. \[O\] counts the observed channels, \[R\] their
/// orders.
///
/// Two programs that exchange designs compare this string first. `check` is a checksum of all numbers before it, so a
/// number that was changed in transfer makes the design invalid ([`check`]).
pub const LAYOUT: &str = "rate rate_n theta_n gamma[O][R] c[N] g[O][R] kx[N] kw us k[O][R] satk lim unit decay u_min \
                          u_max plausible ko sigma_star_bound hold fallback period input_gain mu2_n check";

/// Coefficients of the tick. `g` and `k` hold rows for (A, B, C), whose entry 0 is not used (see the folding).
///
/// For callers in C, the memory holds the numbers in the order of [`LAYOUT`] up to `check`, without padding.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Coefficients<T, const N: usize, const R: usize, const O: usize> {
    /// Rates 1/T and 1/(T b_0): they scale the difference of a sample to the units of its channel.
    pub(crate) rate: T,
    pub(crate) rate_n: T,
    pub(crate) theta_n: T,
    /// Discrete gains γ of each observed channel.
    pub(crate) gamma: [[T; R]; O],
    /// Rows of sigma: on y, and on B, C.
    pub(crate) c: [T; N],
    pub(crate) g: [[T; R]; O],
    /// Rows of the law: on y (entry 0 is zero and not used), on the offset W, on sigma*, on B, C.
    pub(crate) kx: [T; N],
    pub(crate) kw: T,
    pub(crate) us: T,
    pub(crate) k: [[T; R]; O],
    /// Switching term clamp(satk sigma*, +-lim). Both are 0 without switching.
    pub(crate) satk: T,
    pub(crate) lim: T,
    /// Factor from the unit of the rows to the unit of u.
    pub(crate) unit: T,
    /// Offset decay per tick, 1 - e^(-alpha T).
    pub(crate) decay: T,
    pub(crate) u_min: T,
    pub(crate) u_max: T,
    /// Largest |u| demand beyond the limits that is accepted without a further check.
    pub(crate) plausible: T,
    /// Gain of the offset in u.
    pub(crate) ko: T,
    pub(crate) sigma_star_bound: T,
    /// Output for a rejected sample: hold u + fallback. (1, 0) holds the last u, (0, u) outputs this value.
    pub(crate) hold: T,
    pub(crate) fallback: T,
    /// Factors that convert the estimates to physical units. The tick does not use them.
    pub(crate) period: T,
    pub(crate) input_gain: T,
    pub(crate) mu2_n: T,
}

/// Returns the largest demand beyond the limits that a valid sample may cause: 256 times the larger of their span and
/// the larger limit, at most [`INPUT_LIMIT`]. The tick checks larger demands further.
pub(crate) const fn plausible(limits: Limits) -> f64 {
    let size = larger(limits.max - limits.min, larger(limits.min.abs(), limits.max.abs()));
    if size > 0.0 { smaller(INPUT_LIMIT, 256.0 * size) } else { INPUT_LIMIT }
}

/// Ratio of Λ to the largest |u|.
const RANGE: f64 = (1 << 20) as f64;

const fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

const fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

impl<const N: usize, const R: usize, const O: usize> Coefficients<f64, N, R, O> {
    /// Returns the law in units of Λ 2^-`bits`, for numbers that end at 2^`bits` (module documentation, "Range").
    pub(crate) const fn ranged(mut self, bits: u64) -> Self {
        let mut largest = larger(larger(self.kw.abs(), self.us.abs()), larger(self.satk.abs(), self.lim.abs()));
        let mut j = 0;
        while j < N {
            largest = larger(largest, self.kx[j].abs());
            j += 1;
        }
        let mut s = 0;
        while s < O {
            let mut m = 0;
            while m < R {
                largest = larger(largest, self.k[s][m].abs());
                m += 1;
            }
            s += 1;
        }
        let asked = smaller(RANGE * larger(self.u_min.abs(), self.u_max.abs()), INPUT_LIMIT);
        // The unit must be a normal number, 2^-126 in f32.
        let (mut m, mut range) = (2, 4.0);
        while range < larger(asked, 2.0 * largest) {
            range *= 2.0;
            m += 1;
        }
        self.scale(f64::from_bits((1023 + bits - m) << 52));
        self
    }

    const fn scale(&mut self, unit: f64) {
        let mut j = 0;
        while j < N {
            self.kx[j] *= unit;
            j += 1;
        }
        let mut s = 0;
        while s < O {
            let mut m = 0;
            while m < R {
                self.k[s][m] *= unit;
                m += 1;
            }
            s += 1;
        }
        self.kw *= unit;
        self.us *= unit;
        self.satk *= unit;
        self.lim *= unit;
        self.unit /= unit;
    }

    /// Rounds every coefficient to the nearest f32.
    pub(crate) const fn in_f32(&self) -> Coefficients<f32, N, R, O> {
        Coefficients {
            rate: self.rate as f32,
            rate_n: self.rate_n as f32,
            theta_n: self.theta_n as f32,
            gamma: table_f32(&self.gamma),
            c: row_f32(&self.c),
            g: table_f32(&self.g),
            kx: row_f32(&self.kx),
            kw: self.kw as f32,
            us: self.us as f32,
            k: table_f32(&self.k),
            satk: self.satk as f32,
            lim: self.lim as f32,
            unit: self.unit as f32,
            decay: self.decay as f32,
            u_min: self.u_min as f32,
            u_max: self.u_max as f32,
            plausible: self.plausible as f32,
            ko: self.ko as f32,
            sigma_star_bound: self.sigma_star_bound as f32,
            hold: self.hold as f32,
            fallback: self.fallback as f32,
            period: self.period as f32,
            input_gain: self.input_gain as f32,
            mu2_n: self.mu2_n as f32,
        }
    }
}

/// Expands to every number of the coefficients as slices, in the order of [`LAYOUT`], borrowed shared or mutable. Only
/// this macro and the fields themselves fix the order. The slice type does not depend on the configuration, so the
/// compiler compiles the iterators over them once per scalar.
macro_rules! in_order {
    ($coefficients:expr, $one:path, $flat:ident) => {{
        let Self {
            rate,
            rate_n,
            theta_n,
            gamma,
            c,
            g,
            kx,
            kw,
            us,
            k,
            satk,
            lim,
            unit,
            decay,
            u_min,
            u_max,
            plausible,
            ko,
            sigma_star_bound,
            hold,
            fallback,
            period,
            input_gain,
            mu2_n,
        } = $coefficients;
        [
            $one(rate),
            $one(rate_n),
            $one(theta_n),
            gamma.$flat(),
            c,
            g.$flat(),
            kx,
            $one(kw),
            $one(us),
            k.$flat(),
            $one(satk),
            $one(lim),
            $one(unit),
            $one(decay),
            $one(u_min),
            $one(u_max),
            $one(plausible),
            $one(ko),
            $one(sigma_star_bound),
            $one(hold),
            $one(fallback),
            $one(period),
            $one(input_gain),
            $one(mu2_n),
        ]
    }};
}

impl<T: Real, const N: usize, const R: usize, const O: usize> Coefficients<T, N, R, O> {
    /// Number of numbers, including the checksum.
    pub const NUMBERS: usize = 20 + 2 * N + 3 * O * R;

    /// Returns every number in the order of [`LAYOUT`].
    pub fn numbers(&self) -> impl Iterator<Item = T> {
        self.unchecked().chain([self.check()])
    }

    /// Returns every number except the checksum.
    #[doc(hidden)]
    pub fn unchecked(&self) -> impl Iterator<Item = T> {
        let parts: [&[T]; 24] = in_order!(self, slice::from_ref, as_flattened);
        parts.into_iter().flatten().copied()
    }

    /// Returns the last number: [`check`] of all others.
    pub fn check(&self) -> T {
        check(self.unchecked())
    }

    /// Returns the design from its first [`NUMBERS`](Self::NUMBERS) numbers, in the order of [`LAYOUT`].
    ///
    /// Returns `None` if there are fewer numbers, if the checksum differs from the output of
    /// [`numbers`](Self::numbers), or if the numbers cannot come from a design:
    /// * a number that is not finite,
    /// * limits that are reversed or wider than [`INPUT_LIMIT`], or a fallback outside of them,
    /// * a period or an input gain of zero, or a rate that is not 1/T,
    /// * a c_n that is not 1, or moments outside of (0, 1].
    pub fn from_numbers(numbers: impl IntoIterator<Item = T>) -> Option<Self> {
        let mut given = numbers.into_iter();
        let read = Self::from_trusted_numbers(&mut given)?;
        (given.next()? == read.check() && read.can_be_designed()).then_some(read)
    }

    /// Returns the design from numbers without a check, for numbers that were just designed, in any scalar.
    #[doc(hidden)]
    pub fn from_trusted_numbers(numbers: impl IntoIterator<Item = T>) -> Option<Self> {
        let mut read = Self::ZERO;
        let parts: [&mut [T]; 24] = in_order!(&mut read, slice::from_mut, as_flattened_mut);
        fill(parts, &mut numbers.into_iter())?;
        Some(read)
    }

    /// Returns true if [`from_numbers`](Self::from_numbers) accepts the numbers, without their checksum.
    #[doc(hidden)]
    pub fn can_be_designed(&self) -> bool {
        // Zero times a number that is not finite is NaN.
        let finite = self.unchecked().all(|number| number * T::ZERO == T::ZERO);
        let limit = T::from_f64(INPUT_LIMIT);
        let limits = -limit <= self.u_min && self.u_min <= self.u_max && self.u_max <= limit;
        let holds = self.hold == T::from_f64(1.0) && self.fallback == T::ZERO;
        let sends = self.hold == T::ZERO && self.u_min <= self.fallback && self.fallback <= self.u_max;
        let one = T::from_f64(1.0);
        let nonzero = self.period > T::ZERO && self.input_gain != T::ZERO;
        let rates = (self.rate * self.period - one).abs() <= T::from_f64(1e-3) && self.c[N - 1] == one;
        let moments = self.theta_n > T::ZERO && self.theta_n <= one && self.mu2_n > T::ZERO && self.mu2_n <= one;
        finite && limits && (holds || sends) && nonzero && rates && moments
    }

    const ZERO: Self = Self {
        rate: T::ZERO,
        rate_n: T::ZERO,
        theta_n: T::ZERO,
        gamma: [[T::ZERO; R]; O],
        c: [T::ZERO; N],
        g: [[T::ZERO; R]; O],
        kx: [T::ZERO; N],
        kw: T::ZERO,
        us: T::ZERO,
        k: [[T::ZERO; R]; O],
        satk: T::ZERO,
        lim: T::ZERO,
        unit: T::ZERO,
        decay: T::ZERO,
        u_min: T::ZERO,
        u_max: T::ZERO,
        plausible: T::ZERO,
        ko: T::ZERO,
        sigma_star_bound: T::ZERO,
        hold: T::ZERO,
        fallback: T::ZERO,
        period: T::ZERO,
        input_gain: T::ZERO,
        mu2_n: T::ZERO,
    };
}

/// Fills the slices with the next numbers. Returns `None` if there are too few.
fn fill<T>(parts: [&mut [T]; 24], numbers: &mut impl Iterator<Item = T>) -> Option<()> {
    for number in parts.into_iter().flatten() {
        *number = numbers.next()?;
    }
    Some(())
}

/// Returns 24 bits of a hash (FNV-1a) over the bits of these numbers, as a whole number that f32 represents exactly.
///
/// It misses one in 16.8 million random errors. It does not protect against deliberate changes.
pub fn check<T: Real>(numbers: impl IntoIterator<Item = T>) -> T {
    T::from_f64(f64::from(hash(numbers.into_iter().flat_map(Real::to_words)) & 0x00FF_FFFF))
}

const fn table_f32<const R: usize, const O: usize>(table: &[[f64; R]; O]) -> [[f32; R]; O] {
    let mut out = [[0.0; R]; O];
    let mut s = 0;
    while s < O {
        out[s] = row_f32(&table[s]);
        s += 1;
    }
    out
}

/// Returns the observed channels of `mask` from the lowest, counted from 0.
pub(crate) const fn observed<const O: usize>(mask: u8) -> [usize; O] {
    let mut table = [0; O];
    let mut slot = 0;
    let mut channel = 0;
    while channel < 8 {
        if mask >> channel & 1 == 1 {
            table[slot] = channel;
            slot += 1;
        }
        channel += 1;
    }
    table
}

/// Response of the chain within one tick, with the symbols of the module documentation.
struct Response {
    /// Response t_j.
    t: [f64; PHIS],
    /// Power T^j/j!
    power: [f64; PHIS],
    theta_n: f64,
    mu2_n: f64,
    kv: f64,
}

impl Response {
    const fn new<const N: usize>(period: f64, lambda: f64, c: &[f64; N]) -> Self {
        let phi = phi_functions(-lambda * period);
        let mut t = [0.0; PHIS];
        let mut power = [0.0; PHIS];
        let mut j = 0;
        while j < PHIS {
            t[j] = raised(period, j) * phi[j];
            power[j] = raised(period, j) / FACTORIAL[j];
            j += 1;
        }
        let mut kv = 0.0;
        let mut i = 0;
        while i < N {
            kv += c[i] * t[N - i];
            i += 1;
        }
        Self { t, power, theta_n: t[2] / (period * t[1]), mu2_n: 2.0 * t[3] / (period * period * t[1]), kv }
    }
}

/// Returns the rows of a validated configuration. `observers` lists the observed channels, from 0.
pub(crate) const fn coefficients<const N: usize, const R: usize, const O: usize>(
    config: &Config<N, R>,
    observers: &[usize; O],
) -> Result<Coefficients<f64, N, R, O>, ConfigError> {
    let Config { period_s: period, surface, reaching, nominal, options, .. } = config;
    let limits = options.limits;
    let (period, b, alpha) = (*period, nominal.input_gain, surface.alpha_per_s);
    let response = Response::new(period, -nominal.gradient[N - 1], &surface.c);
    let kv = response.kv;

    let mut gamma = [[0.0; R]; O];
    let mut g = [[0.0; R]; O];
    let mut k = [[0.0; R]; O];
    let mut s = 0;
    while s < O {
        // The channel is below N. The comparison lets an index do without a check that could panic.
        let q = if observers[s] < N { observers[s] } else { N - 1 };
        if let Some(gains) = &config.observers[q] {
            gamma[s] = gains.gammas(period);
        }
        (g[s], k[s]) = channel_rows(config, &response, q);
        s += 1;
    }

    // k_l itself, not (1 - e^(-k_l T))/T, which would raise the ultimate bound by k_l T/2. At most deadbeat.
    let reach = if reaching.k_l * period < 1.0 { reaching.k_l * period } else { 1.0 };
    let decay = alpha * period * phi_functions(-alpha * period)[1];
    // Implicit (backward Euler) saturation: within the layer its slope is the slope of the law after the tick.
    let (satk, lim) = if reaching.k_s > 0.0 {
        let step = reaching.k_s * period / kv;
        (-step * (1.0 - reach) / (reaching.epsilon + reaching.k_s * period) / b, step / b.abs())
    } else {
        (0.0, 0.0)
    };

    let (hold, fallback) = match options.fallback {
        Fallback::HoldLast => (1.0, 0.0),
        Fallback::Safe(u) => (0.0, u),
    };
    let designed = Coefficients {
        rate: 1.0 / period,
        rate_n: 1.0 / (period * b),
        theta_n: response.theta_n,
        gamma,
        c: surface.c,
        g,
        kx: state_row(config, &response),
        kw: -decay / kv / b,
        us: -reach / kv / b,
        k,
        satk,
        lim,
        unit: 1.0,
        decay,
        u_min: limits.min,
        u_max: limits.max,
        plausible: plausible(limits),
        ko: (reach - decay) / kv / b,
        sigma_star_bound: options.sigma_star_bound,
        hold,
        fallback,
        period,
        input_gain: b,
        mu2_n: response.mu2_n,
    };
    // The rows of a linear model use the same numbers.
    let mut sound = designed.is_sound();
    let mut j = 0;
    while j < N {
        sound = sound && fits(nominal.gradient[j] / b);
        j += 1;
    }
    if sound { Ok(designed) } else { Err(ConfigError::new(Field::Whole, Cause::CoefficientRange)) }
}

/// Returns the row of the law on x: the share of x_j in sigma over the coming tick with u = 0, and the mean gradient of
/// a.
const fn state_row<const N: usize, const R: usize>(config: &Config<N, R>, response: &Response) -> [f64; N] {
    let gradient = &config.nominal.gradient;
    let mut kx = [0.0; N];
    let mut j = 1;
    while j < N {
        let mut i = 0;
        while i < j {
            kx[j] += config.surface.c[i] * response.power[j - i];
            i += 1;
        }
        kx[j] = kx[j] / response.kv + response.theta_n * config.period_s * gradient[j - 1];
        kx[j] /= -config.nominal.input_gain;
        j += 1;
    }
    kx
}

/// Returns the rows of sigma and of the law on (A, B, C) of channel q, counted from 0.
const fn channel_rows<const N: usize, const R: usize>(
    config: &Config<N, R>,
    response: &Response,
    q: usize,
) -> ([f64; R], [f64; R]) {
    let Config { period_s: period, surface, nominal, .. } = config;
    let (period, b, last) = (*period, nominal.input_gain, q == N - 1);
    // On S first: d_hat^(m) = m! S_m / T^(m+1).
    let mut on_sigma = [0.0; MAX_R];
    let mut on_law = [0.0; MAX_R];
    let mut m = 0;
    while m < R {
        let unit = FACTORIAL[m] / raised(period, m + 1);
        if !last && q + m + 1 < N {
            on_sigma[m] = surface.c[q + m + 1] * unit;
        }
        let mut sum = 0.0;
        let mut i = 0;
        while i <= q {
            sum += surface.c[i] * if last { response.t[N - i + m] } else { response.power[q - i + 1 + m] };
            i += 1;
        }
        on_law[m] = sum / response.kv * unit;
        m += 1;
    }
    if !last {
        on_law[0] += response.theta_n * nominal.gradient[q];
    }
    let (theta, mu2, unit) =
        if last { (response.theta_n, response.mu2_n, period * b) } else { (0.5, 1.0 / 3.0, period) };
    (folded(on_sigma, theta, mu2, unit), folded(on_law, theta, mu2, unit / -b))
}

/// Converts a row on (S_0, S_1, S_2) to a row on (A, B, C) of the given unit.
const fn folded<const R: usize>(on_s: [f64; MAX_R], theta: f64, mu2: f64, unit: f64) -> [f64; R] {
    let on_b = on_s[1] - theta * on_s[0];
    let on_c = (on_s[2] - mu2 * on_s[0] - (1.0 + 2.0 * theta) * on_b) / 2.0;
    let all = [on_s[0] * unit, on_b * unit, on_c * unit];
    let mut row = [0.0; R];
    let mut m = 0;
    while m < R {
        row[m] = all[m];
        m += 1;
    }
    row
}

/// Largest coefficient, finite in f32 too, so that both precisions accept the same designs.
const LARGEST: f64 = 1e30;

const fn fits(value: f64) -> bool {
    // Rounding to f32 keeps a value at or below LARGEST rounded to f32.
    value.abs() < LARGEST
}

impl<const N: usize, const R: usize, const O: usize> Coefficients<f64, N, R, O> {
    const fn is_sound(&self) -> bool {
        let mut sound = fits(self.rate)
            && fits(self.rate_n)
            && self.rate_n.abs() > 1e-30
            && fits(self.theta_n)
            && fits(self.mu2_n)
            && fits(self.kw)
            && fits(self.us)
            && fits(self.satk)
            && fits(self.lim)
            && fits(self.sigma_star_bound)
            && fits(self.decay)
            && fits(self.period)
            && fits(self.input_gain);
        let mut i = 0;
        while i < N {
            sound = sound && fits(self.c[i]) && fits(self.kx[i]);
            i += 1;
        }
        let mut s = 0;
        while s < O {
            let mut m = 0;
            while m < R {
                sound = sound && fits(self.gamma[s][m]) && fits(self.g[s][m]) && fits(self.k[s][m]);
                m += 1;
            }
            s += 1;
        }
        sound
    }
}
