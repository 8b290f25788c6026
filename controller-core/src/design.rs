//! Design time: from a [`Config`] to the rows of the tick.
//!
//! Everything here is `f64`, runs once, and is `const fn` without any library function, so that a controller can be
//! designed by the compiler and lie in flash. Symbols (i, j, q count from 1, $c_n = 1$):
//!
//! * $\lambda = -\partial a/\partial x_n$, the nominal slope; $t_j = T^j \varphi_j(-\lambda T)$ with
//!   $\varphi_j(z) = \sum_m z^m/(m+j)!$: what a unit input of channel n has moved $x_n, x_{n-1}, ..$ after one tick.
//! * $\theta, \mu_2$: first and second moment of that response over the tick; 1/2 and 1/3 for a channel without slope.
//! * $\gamma_1..\gamma_r$: coefficients of $\det(wI - (e^{DT} - I))$, the discrete observer gains.
//! * $K_v = \sum_i c_i t_{n-i+1}$: how far one unit of $u b$ moves $\sigma$ in one tick; every row is divided by it.
//!
//! # Folding
//! The observer's Taylor state $S_m = T^{m+1} \hat d^{(m)}/m!$ is kept as $A = S_0 + \theta S_1 + \mu_2 S_2$,
//! $B = S_1 + (1 + 2\theta) S_2$, $C = 2 S_2$; a row $(k_0, k_1, k_2)$ on $S$ becomes
//! $k_A = k_0$, $k_B = k_1 - \theta k_0$, $k_C = (k_2 - \mu_2 k_0 - (1 + 2\theta) k_B)/2$ on $(A, B, C)$.
//! Channels $i < n$ are in physical units (divided by T): then $k_A$ equals the row's entry of $x_{i+1}$, so that one
//! sum $y_{i+1} = x_{i+1} + A_i$ serves $\sigma^*$ and the law. Channel n is in units of u (divided by $T b_0$): there
//! its entry is exactly -1. The unfolded form is the oracle in `tests/` (test
//! `formula::folded_tick_equals_the_plain_transcription`).
//!
//! # Range
//! The sums of the law are computed in a unit of their own, in which the largest number of the precision stands for
//! $\Lambda$, in the unit of u: a term beyond $\Lambda$ overflows, and neither infinity nor NaN comes back from a sum.
//! So one look at the demand judges every word of the state by itself, and words whose terms cancel are seen as well.
//! It is a power of two, and changes no bit of u:
//! $$ \Lambda = 2^m \ge \max(\min(2^{20} U, 10^{12}), 2 K), \quad m \ge 2 $$
//! with U the larger of the limits and K the largest entry of the rows. After a good tick the state lies in the set M
//! of the design: $k_{x,i+1} (x_{i+1} + A_i)$, $k_B B$, $k_C C$, $k_w W$ and $u_\sigma \sigma^*$ within $\pm \Lambda$,
//! and $a_u + A_n$, which stands in the demand itself, within what these leave of it; the last sample and P as this
//! sample made them, u within its limits. An estimate that an observer of lower order than R does not have is not
//! corrected, and stays what something wrote there, if that lies in M.
//!
//! # Leaving the process
//! A design is a row of plain numbers in one declared order, [`LAYOUT`]: [`Coefficients::numbers`] gives them out,
//! [`Coefficients::from_numbers`] takes them in again, checked. That is how a design made here gets onto a chip.

use core::slice;

use crate::MAX_R;
use crate::config::{Config, Fallback, INPUT_LIMIT};
use crate::error::{Cause, ConfigError, Field};
use crate::exponential::{FACTORIAL, PHIS, phi_functions, raised};
use crate::law::Limits;
use crate::real::{Real, row_f32};
use crate::running::hash;

/// The order of the numbers of a [`Coefficients`] outside the process; \[O\] counts the observed channels, \[R\]
/// their orders. Two programs that exchange designs compare it first. `check` is the sum of all numbers before it, so
/// that a number which something has changed on the way is no design ([`check`]).
pub const LAYOUT: &str = "rate rate_n theta_n gamma[O][R] c[N] g[O][R] kx[N] kw us k[O][R] satk lim unit decay u_min \
                          u_max plausible ko sigma_star_bound hold fallback period input_gain mu2_n check";

/// What the tick multiplies with. `g` and `k` hold rows for (A, B, C); their entry 0 is not used (see the folding). In
/// memory it is its numbers in the order of [`LAYOUT`] up to `check` and nothing between them, for callers in C.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Coefficients<T, const N: usize, const R: usize, const O: usize> {
    /// 1/T and 1/(T b_0): difference of a sample in the units of its channel.
    pub(crate) rate: T,
    pub(crate) rate_n: T,
    pub(crate) theta_n: T,
    /// γ of each observed channel.
    pub(crate) gamma: [[T; R]; O],
    /// Rows of sigma: on y, and on B, C.
    pub(crate) c: [T; N],
    pub(crate) g: [[T; R]; O],
    /// Rows of the law: on y (entry 0 is zero and not used), on the offset W, on sigma*, on B, C.
    pub(crate) kx: [T; N],
    pub(crate) kw: T,
    pub(crate) us: T,
    pub(crate) k: [[T; R]; O],
    /// Switching term clamp(satk sigma*, +-lim); both 0 without switching.
    pub(crate) satk: T,
    pub(crate) lim: T,
    /// From what these rows add up to to u.
    pub(crate) unit: T,
    /// 1 - e^(-alpha T).
    pub(crate) decay: T,
    pub(crate) u_min: T,
    pub(crate) u_max: T,
    /// Largest |u| beyond the limits that is asked for without a doubt.
    pub(crate) plausible: T,
    /// What the offset adds to u.
    pub(crate) ko: T,
    pub(crate) sigma_star_bound: T,
    /// A rejected sample gives hold u + fallback: (1, 0) holds the last u, (0, u) sends this one.
    pub(crate) hold: T,
    pub(crate) fallback: T,
    /// For reading the estimates in physical units; the tick does not use them.
    pub(crate) period: T,
    pub(crate) input_gain: T,
    pub(crate) mu2_n: T,
}

/// How far beyond its limits u may be asked for by good samples, in units of their span or of the larger limit; more
/// than that is looked at.
pub(crate) const fn plausible(limits: Limits) -> f64 {
    let size = larger(limits.max - limits.min, larger(limits.min.abs(), limits.max.abs()));
    if size > 0.0 { smaller(INPUT_LIMIT, 256.0 * size) } else { INPUT_LIMIT }
}

/// Λ over the largest |u|.
const RANGE: f64 = (1 << 20) as f64;

const fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

const fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

impl<const N: usize, const R: usize, const O: usize> Coefficients<f64, N, R, O> {
    /// The law in units of Λ 2^-`bits`, where numbers end at 2^`bits` (module head, "Range").
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

/// Every number of coefficients as slices, borrowed one way or the other, in the order of [`LAYOUT`]: the one place
/// that has it beside the fields themselves. Slices have one type whatever the shape, so the compiler makes the
/// iterators over them once for each scalar.
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
    /// How many numbers there are, the check included.
    pub const NUMBERS: usize = 20 + 2 * N + 3 * O * R;

    /// Every number in the order of [`LAYOUT`].
    pub fn numbers(&self) -> impl Iterator<Item = T> {
        self.unchecked().chain([self.check()])
    }

    /// Every number but the check.
    #[doc(hidden)]
    pub fn unchecked(&self) -> impl Iterator<Item = T> {
        let parts: [&[T]; 24] = in_order!(self, slice::from_ref, as_flattened);
        parts.into_iter().flatten().copied()
    }

    /// The last number, [`check`] of all others.
    pub fn check(&self) -> T {
        check(self.unchecked())
    }

    /// The design that these numbers, in the order of [`LAYOUT`], are: the first [`NUMBERS`](Self::NUMBERS) of them.
    /// `None` if there are fewer, if they are not those that [`numbers`](Self::numbers) gave, which the check tells, or
    /// if they cannot come from a design: a number that is not finite, limits that are reversed or wider than
    /// [`INPUT_LIMIT`], a fallback outside of them, a period or an input gain of zero, a rate that is not 1/T, a
    /// c_n that is not 1, moments outside of (0, 1].
    pub fn from_numbers(numbers: impl IntoIterator<Item = T>) -> Option<Self> {
        let mut given = numbers.into_iter();
        let read = Self::from_trusted_numbers(&mut given)?;
        (given.next()? == read.check() && read.can_be_designed()).then_some(read)
    }

    /// The same without a check, for numbers that have just been designed, whatever the scalar.
    #[doc(hidden)]
    pub fn from_trusted_numbers(numbers: impl IntoIterator<Item = T>) -> Option<Self> {
        let mut read = Self::ZERO;
        let parts: [&mut [T]; 24] = in_order!(&mut read, slice::from_mut, as_flattened_mut);
        fill(parts, &mut numbers.into_iter())?;
        Some(read)
    }

    /// Is it what [`from_numbers`](Self::from_numbers) takes, the check apart?
    #[doc(hidden)]
    pub fn can_be_designed(&self) -> bool {
        // Zero times what is not finite is NaN.
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

/// Fills the slices with the next numbers; `None` if there are too few.
fn fill<T>(parts: [&mut [T]; 24], numbers: &mut impl Iterator<Item = T>) -> Option<()> {
    for number in parts.into_iter().flatten() {
        *number = numbers.next()?;
    }
    Some(())
}

/// 24 bits of a hash (FNV-1a) over the bits of these numbers, as a whole number, which f32 holds: of 16.8 million ways
/// to damage them it takes one for none. It is no defence against anyone who means it.
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

/// The observed channels of `mask` from the lowest, counted from 0.
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

/// How the chain responds within one tick; the symbols of the module's head.
struct Response {
    /// t_j.
    t: [f64; PHIS],
    /// T^j/j!
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

/// Rows of a validated configuration. `observers` names the observed channels, from 0.
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
        // It is below N; said so that an index by it needs no check that could panic.
        let q = if observers[s] < N { observers[s] } else { N - 1 };
        if let Some(gains) = &config.observers[q] {
            gamma[s] = gains.gammas(period);
        }
        (g[s], k[s]) = channel_rows(config, &response, q);
        s += 1;
    }

    // k_l itself, not (1 - e^(-k_l T))/T, which would inflate the ultimate bound by k_l T/2; deadbeat at most.
    let reach = if reaching.k_l * period < 1.0 { reaching.k_l * period } else { 1.0 };
    let decay = alpha * period * phi_functions(-alpha * period)[1];
    // Implicit (backward Euler) saturation: within the layer its slope is that of the law after the tick.
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
    // The rows of a linear model are of the same numbers.
    let mut sound = designed.is_sound();
    let mut j = 0;
    while j < N {
        sound = sound && fits(nominal.gradient[j] / b);
        j += 1;
    }
    if sound { Ok(designed) } else { Err(ConfigError::new(Field::Whole, Cause::CoefficientRange)) }
}

/// Row of the law on x: what x_j adds to sigma over the coming tick if u = 0, and the mean of a's gradient.
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

/// Rows of sigma and of the law on (A, B, C) of channel q, counted from 0.
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

/// A row on (S_0, S_1, S_2) as a row on (A, B, C) of the given unit.
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

/// Finite in f32 too, so that both precisions accept the same designs.
const LARGEST: f64 = 1e30;

const fn fits(value: f64) -> bool {
    // Rounded to f32 it is not above LARGEST rounded to f32.
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
