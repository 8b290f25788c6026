//! The self-contained C99 file: `Controller::step` of `controller-core`, unrolled for one instance.
//!
//! Statement by statement the same operations in the same order, so the same bits. Whoever changes one changes the
//! other: test `export::the_exported_c_gives_the_bits_of_the_tick` of the suite compares them over a million ticks.
//!
//! All functions are `static inline`: the file is included where the interrupt is, and the tick becomes part of it.
//! Names of channels and states count from 1; `a2, b2, c2` are A, B, C of channel 2, `p2` its P.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use controller_core::INPUT_LIMIT;
use loop_sim::port::in_process::Model;

use super::{Exported, named};

/// Beyond this a demand does not come from a finite sample, see `Controller::reject`.
const SPIKE: f32 = 1e30;

pub(super) fn text(exported: &Exported<'_>, prefix: &str) -> Result<String, String> {
    if !matches!(exported.spec.model, Model::Linear(_)) {
        return Err(
            "the C file carries a linear a(x) only, and that of the benchmark is not: take --lang rust, or set \
                    plant.kind to chain or flexible_joint"
                .into(),
        );
    }
    let shape = exported.download.shape;
    let channels = exported.channels();
    let (n, r) = (usize::from(shape.n), usize::from(shape.r));
    let file = Standalone {
        exported,
        prefix,
        capitals: prefix.to_ascii_uppercase(),
        numbers: named(n, r, channels.len(), &exported.download.numbers),
        n,
        r,
        channels,
    };
    Ok([file.head(), file.constants(), file.types(), file.functions(), file.tail()].concat())
}

/// An f32 as C99 writes it exactly.
fn hexadecimal(value: f32) -> String {
    let bits = value.to_bits();
    let sign = if value.is_sign_negative() { "-" } else { "" };
    let (exponent, fraction) = ((bits >> 23 & 0xff) as i32, (bits & 0x7f_ffff) << 1);
    match (exponent, fraction) {
        (0, 0) => format!("{sign}0x0p+0f"),
        (0, _) => format!("{sign}0x0.{fraction:06x}p-126f"),
        _ => format!("{sign}0x1.{fraction:06x}p{:+}f", exponent - 127),
    }
}

struct Standalone<'a> {
    exported: &'a Exported<'a>,
    prefix: &'a str,
    /// The prefix of macros.
    capitals: String,
    numbers: BTreeMap<&'static str, Vec<f32>>,
    n: usize,
    r: usize,
    /// Observed channels, from 1.
    channels: Vec<usize>,
}

/// A, B, C.
const FOLDED: [char; 3] = ['a', 'b', 'c'];

impl Standalone<'_> {
    fn number(&self, name: &str, at: usize) -> f32 {
        self.numbers.get(name).and_then(|row| row.get(at)).copied().unwrap_or(f32::NAN)
    }

    /// `@` stands for the prefix, `@@` for that of macros, in a text of C.
    fn c(&self, text: &str) -> String {
        text.replace("@@", &self.capitals).replace('@', self.prefix)
    }

    /// Observed channels but the last of the plant's.
    fn mismatched(&self) -> impl Iterator<Item = (usize, usize)> {
        self.channels.iter().copied().enumerate().filter(|&(_, i)| i != self.n)
    }

    fn last_is_observed(&self) -> bool {
        self.channels.last() == Some(&self.n)
    }

    /// Names of the state of one channel's observer.
    fn folded(&self, channel: usize) -> impl Iterator<Item = String> {
        FOLDED[..self.r].iter().map(move |letter| format!("{letter}{channel}"))
    }

    fn head(&self) -> String {
        let Exported { spec, .. } = self.exported;
        let mut out = format!(
            "/* Sliding mode control with an extended disturbance observer: {}, f32, T = {:?} s.\n \
             * Exported by version {} of the library; do not edit, export it again. C99 and C++17, no library.\n",
            self.exported.shape(),
            spec.config.padded.period_s,
            controller_core::VERSION
        );
        out.push_str(&self.c(" *
 *     #include \"this file\"
 *     static @_state state;                              once; zeros are right
 *     @_output output;                                   in the timer interrupt, every T:
 *     unsigned health = @_tick_or_start(&state, x, &output);
 *     write_pwm(output.u);
 *     @_applied(&state, held);                           only if the actuator holds another u
 *
 * The same bits as the Rust tick need every operation rounded on its own. A fused multiply-add rounds a * b + c once,
 * which is another number (and takes longer on a Cortex-M4F): compile with -ffp-contract=off. This file asks for it by
 * itself where it can; with GCC that keeps @_tick from being inlined unless the option is given too. Reordering
 * (-ffast-math), more digits than f32 (x87) and flushing denormals to zero (FPSCR.FZ) change bits as well.
 *
"));
        for line in self.exported.origin().lines() {
            out.push_str(format!(" * {line}").trim_end());
            out.push('\n');
        }
        out.push_str(&self.c(" */\n#ifndef @@_STANDALONE\n#define @@_STANDALONE\n"));
        out.push_str(&self.c("
#include <float.h>
#include <stdbool.h>

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) \\
    || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error \"compile without -ffast-math and its parts: they change numbers and remove the guard against NaN\"
#endif
#if FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16
#error \"float must be computed as float: on a 32-bit x86 give -msse2 -mfpmath=sse\"
#endif
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize(\"fp-contract=off\")
#define @@_NO_CONTRACTION
#else
#define @@_NO_CONTRACTION _Pragma(\"STDC FP_CONTRACT OFF\")
#endif

"));
        let period = format!("{:?}", spec.config.padded.period_s);
        let version = controller_core::VERSION;
        let hash = self.exported.design_hash();
        let _ = write!(
            out,
            "#define {c}_VERSION \"{version}\"\n#define {c}_DESIGN {hash:#010x}u /* log it: it tells designs apart */\n\
             #define {c}_N {n} /* plant order, length of x */\n#define {c}_PERIOD_S {period}\n",
            c = self.capitals,
            n = self.n,
        );
        out
    }

    /// Only what the functions use: a compiler warns of a constant that nobody reads.
    fn constants(&self) -> String {
        let mut out =
            String::from("\n/* The design, exact: hexadecimal is what the tick uses, decimal is for reading. */\n");
        let mut put = |name: String, value: f32, meaning: &str| {
            let _ = writeln!(
                out,
                "static const float {}_{name} = {}; /* {value:?}{meaning} */",
                self.prefix,
                hexadecimal(value)
            );
        };
        let (n, r) = (self.n, self.r);
        for j in 1..=n {
            let meaning = if j == 1 { ": a(x)/b_0 = drift . x" } else { "" };
            put(format!("drift_{j}"), self.number("drift", j - 1), meaning);
        }
        if self.mismatched().next().is_some() {
            put("rate".into(), self.number("rate", 0), ": 1/T, 1/s");
        }
        if self.last_is_observed() {
            put("rate_n".into(), self.number("rate_n", 0), ": 1/(T b_0)");
        }
        if self.channels.iter().any(|&i| i + 1 >= n) {
            put("theta_n".into(), self.number("theta_n", 0), ": mean of channel n's response over a tick");
        }
        for (s, i) in self.channels.iter().enumerate() {
            for m in 1..=r {
                put(format!("gamma{i}_{m}"), self.number("gamma", s * r + m - 1), ": observer gain");
            }
        }
        for j in 1..n {
            put(format!("c_{j}"), self.number("c", j - 1), ": surface, Eq. (44)");
        }
        for (s, i) in self.mismatched() {
            for m in 2..=r {
                let letter = FOLDED[m - 1];
                put(format!("g{i}_{letter}"), self.number("g", s * r + m - 1), ": sigma's share");
            }
        }
        for j in 2..=n {
            put(format!("kx_{j}"), self.number("kx", j - 1), ": law, Eq. (51), on the state");
        }
        put("kw".into(), self.number("kw", 0), ": on the offset W");
        put("us".into(), self.number("us", 0), ": on sigma*");
        for (s, i) in self.channels.iter().enumerate() {
            for m in 2..=r {
                let letter = FOLDED[m - 1];
                put(format!("k{i}_{letter}"), self.number("k", s * r + m - 1), ": on the estimates");
            }
        }
        for (name, meaning) in [
            ("satk", ": slope of the switching term"),
            ("lim", ": its limit"),
            ("decay", ": 1 - e^(-alpha T), Eq. (17)"),
            ("u_min", ""),
            ("u_max", ""),
            ("sigma_star_bound", ": above it the health says so"),
            ("hold", ": a rejected sample gives hold u + fallback"),
            ("fallback", ""),
        ] {
            put(name.into(), self.number(name, 0), meaning);
        }
        put("input_limit".into(), INPUT_LIMIT as f32, ": a demand beyond is that of a bad sample");
        if !self.channels.is_empty() {
            put("spike".into(), SPIKE, ": a demand beyond is not even that of a finite one");
        }
        for &i in &self.channels {
            let d_hat = self.number("d_hat", i - 1);
            let start = if i == n { d_hat / self.number("input_gain", 0) } else { d_hat };
            put(format!("start{i}"), start, ": estimate at the start, folded");
        }
        out
    }

    fn types(&self) -> String {
        let mut out = String::from(
            "
/* What a tick has to say about itself, as a set of bits. */
enum {
    @@_OK = 0,
    @@_INPUT_REJECTED = 1, /* x, or what became of it, not finite or too large: the fallback goes out */
    @@_SATURATED = 2, /* the law asked for more than the limits allow */
    @@_SIGMA_STAR_OVER_BOUND = 4 /* the plant does not do what the design supposes */
};

/* What the controller remembers between two ticks. Zeros before the start. */
typedef struct {
",
        );
        for i in &self.channels {
            let names = self.folded(*i).collect::<Vec<_>>().join(", ");
            let _ = writeln!(out, "    float {names}; /* observer of channel {i}: folded estimate */");
            let _ =
                writeln!(out, "    float p{i}, x{i}_prev; /* what its last innovation needs; x at the last tick */");
        }
        out.push_str(
            "    float offset; /* W = sigma(0) e^(-alpha t), Eq. (17) */
    float held; /* the u that the actuator holds */
    bool resuming; /* no last tick to compare the next sample with */
    bool started;
} @_state;

typedef struct {
    float u; /* to hold until the next tick, within the limits */
    float sigma; /* Eq. (44), unit of x_n */
    float sigma_star; /* Eq. (17), unit of x_n */
} @_output;
",
        );
        self.c(&out)
    }

    /// x_1 .. x_n, read once.
    fn samples(&self) -> String {
        let list: Vec<String> = (1..=self.n).map(|j| format!("x{j} = x[{}]", j - 1)).collect();
        format!("    const float {};\n", list.join(", "))
    }

    /// y and sigma of Eq. (44), from x and A, B, C.
    fn sigma(&self) -> String {
        let mut out = String::new();
        for j in 1..=self.n {
            let estimate =
                if self.mismatched().any(|(_, i)| i + 1 == j) { format!(" + a{}", j - 1) } else { String::new() };
            let _ = writeln!(out, "    const float y{j} = x{j}{estimate};");
        }
        out.push_str("    float sigma = @_c_1 * y1;\n");
        for j in 2..self.n {
            let _ = writeln!(out, "    sigma += @_c_{j} * y{j};");
        }
        for (_, i) in self.mismatched() {
            for letter in &FOLDED[1..self.r] {
                let _ = writeln!(out, "    sigma += @_g{i}_{letter} * {letter}{i};");
            }
        }
        let _ = writeln!(out, "    sigma += y{}; /* c_n = 1 */", self.n);
        out
    }

    fn functions(&self) -> String {
        let helpers = "
/* value limited to [min, max]. */
static inline float @_limited(float value, float min, float max)
{
    const float below = value > max ? max : value;
    return below < min ? min : below;
}

/* False for NaN, infinities and what no actuator takes. */
static inline bool @_is_sound(float value)
{
    return value >= -@_input_limit && value <= @_input_limit;
}
";
        let applied = "
/* Tells what the actuator really holds since the last tick, where that is not the u of the tick: the only anti-windup,
 * and needed. Call it before the next tick. A value that is not finite is ignored, and the answer is false. */
static inline bool @_applied(@_state *state, float u)
{
    const bool sound = @_is_sound(u);
    if (sound) {
        state->held = u;
    }
    return sound;
}
";
        let tick_or_start = "
/* The tick of a controller that need not have started: the first good sample starts it; until then the fallback goes
 * out. Needs a state of zeros the first time. */
static inline unsigned @_tick_or_start(@_state *state, const float x[@@_N], @_output *output)
{
    if (!state->started && !@_start(state, x)) {
        output->u = @_limited(@_fallback, @_u_min, @_u_max);
        output->sigma = 0.0f;
        output->sigma_star = 0.0f;
        return @@_INPUT_REJECTED;
    }
    return @_tick(state, x, output);
}
";
        self.c(&[helpers, &self.start(), applied, &self.reject(), &self.tick(), tick_or_start].concat())
    }

    fn start(&self) -> String {
        let mut out = String::from(
            "
/* The state before the first tick, from the sample that the first tick gets too. False, and the state as it was, if the
 * sample is not finite: try the next one. */
static inline bool @_start(@_state *state, const float x[@@_N])
{
    @@_NO_CONTRACTION
",
        );
        out.push_str(&self.samples());
        // Of the estimates sigma takes A of the mismatched channels, and their B and C, which are zero.
        let mut sound: Vec<String> = (1..=self.n).map(|j| format!("@_is_sound(x{j})")).collect();
        for &i in &self.channels {
            let _ = writeln!(out, "    const float a{i} = @_start{i};");
            for letter in &FOLDED[1..self.r] {
                let _ = writeln!(out, "    const float {letter}{i} = 0.0f;");
            }
            sound.push(format!("@_is_sound(a{i})"));
        }
        out.push_str(&self.sigma());
        sound.push("@_is_sound(sigma)".into());
        let _ = write!(out, "    if (!({})) {{\n        return false;\n    }}\n", sound.join("\n          && "));
        for &i in &self.channels {
            for name in self.folded(i) {
                let _ = writeln!(out, "    state->{name} = {name};");
            }
            let _ = write!(out, "    state->p{i} = 0.0f;\n    state->x{i}_prev = 0.0f;\n");
        }
        out.push_str(
            "    state->offset = sigma; /* Eq. (17): sigma* starts at zero */
    state->held = 0.0f;
    state->resuming = true;
    state->started = true;
    return true;
}
",
        );
        out
    }

    fn reject(&self) -> String {
        let mut out = String::from(
            "
/* The sample is lost: keep the estimates, let the offset decay as time goes on, send the fallback. */
static inline unsigned @_reject(@_state *state, float demand, @_output *output)
{
    @@_NO_CONTRACTION
",
        );
        if self.channels.is_empty() {
            out.push_str("    (void)demand; /* there is no estimate that it could have spoilt */\n");
        } else {
            out.push_str(
                "    if (state->resuming && demand >= -@_spike && demand <= @_spike) {
        /* A finite sample asks for too much a second time running: a spike has spoilt the estimates. */
",
            );
            for name in self.channels.iter().flat_map(|&i| self.folded(i)) {
                let _ = writeln!(out, "        state->{name} = 0.0f;");
            }
            out.push_str("    }\n");
        }
        out.push_str(
            "    state->held = @_limited(@_hold * state->held + @_fallback, @_u_min, @_u_max);
    state->offset -= @_decay * state->offset;
    state->resuming = true;
    output->u = state->held;
    output->sigma = state->offset;
    output->sigma_star = 0.0f;
    return @@_INPUT_REJECTED;
}
",
        );
        out
    }

    /// A of every observed channel, then B and C, after the innovation: A += B + gamma_1 e, B += C + gamma_2 e, ..
    fn observers(&self) -> String {
        let mut out = String::from(
            "\n    /* 1. Observers, Eq. (45)-(50): innovation e, then A += B + gamma_1 e, B += C + gamma_2 e, ..",
        );
        out.push_str("\n     * The driven channel first: that is the order of fewest cycles. */\n");
        for &i in &self.channels {
            let rate = if i == self.n { "rate_n" } else { "rate" };
            let _ = writeln!(out, "    const float moved{i} = (x{i} - state->x{i}_prev) * @_{rate};");
        }
        for &i in &self.channels {
            let foreseen = match self.n - i {
                0 => "@_theta_n * drift".into(),
                1 => format!("@_theta_n * x{}", i + 1),
                _ => format!("0.5f * x{}", i + 1),
            };
            let _ = writeln!(out, "    const float h{i} = {foreseen};");
        }
        for &i in self.channels.iter().rev() {
            let expected = if i == self.n { format!("(state->p{i} + state->held)") } else { format!("state->p{i}") };
            let _ = writeln!(out, "    const float e{i} = moved{i} - h{i} - {expected};");
            for m in 0..self.r {
                let letter = FOLDED[m];
                let growth = format!("@_gamma{i}_{} * e{i}", m + 1);
                let growth = match FOLDED[..self.r].get(m + 1) {
                    Some(next) => format!("(state->{next}{i} + {growth})"),
                    None => growth,
                };
                let _ = writeln!(out, "    float {letter}{i} = state->{letter}{i} + {growth};");
            }
        }
        out.push_str("    if (state->resuming) { /* nothing to compare with: the estimates wait one more tick */\n");
        for name in self.channels.iter().flat_map(|&i| self.folded(i)) {
            let _ = writeln!(out, "        {name} = state->{name};");
        }
        out.push_str("    }\n");
        out
    }

    fn tick(&self) -> String {
        let n = self.n;
        let mut out = String::from(
            "
/* One tick: observers, sigma*, law, clamp. Call it once per period with the newest sample x, in chain coordinates.
 * Returns the health; output->u is good whatever x was. */
static inline unsigned @_tick(@_state *state, const float x[@@_N], @_output *output)
{
    @@_NO_CONTRACTION
",
        );
        out.push_str(&self.samples());
        out.push_str("    /* 0. Nominal model, in units of u: a(x)/b_0. */\n    float drift = @_drift_1 * x1;\n");
        for j in 2..=n {
            let _ = writeln!(out, "    drift += @_drift_{j} * x{j};");
        }
        if !self.channels.is_empty() {
            out.push_str(&self.observers());
        }

        out.push_str("\n    /* 2. Of the law what needs no sigma*; surface, Eq. (44); offset, Eq. (17). */\n");
        let estimate = if self.last_is_observed() { format!(" + a{n}") } else { String::new() };
        let _ = writeln!(out, "    const float input_drift = drift{estimate};\n    float v = -input_drift;");
        for &i in self.channels.iter().rev() {
            for letter in &FOLDED[1..self.r] {
                let _ = writeln!(out, "    v += @_k{i}_{letter} * {letter}{i};");
            }
        }
        out.push_str(&self.sigma());
        out.push_str(
            "    const float sigma_star = sigma - state->offset;

    /* 3. Law, Eq. (51). */
    v += @_kw * state->offset;
    v += @_us * sigma_star;
",
        );
        for j in 2..=n {
            let _ = writeln!(out, "    v += @_kx_{j} * y{j};");
        }
        out.push_str(
            "    v += @_limited(@_satk * sigma_star, -@_lim, @_lim);
    /* Whatever was wrong with x or a sum on the way ends up here: one comparison guards them all. */
    if (!@_is_sound(v)) {
        return @_reject(state, v, output);
    }

    /* 4. Memory. */
",
        );
        for &i in &self.channels {
            let reached = if i == n { "input_drift".into() } else { format!("y{}", i + 1) };
            let _ = writeln!(out, "    state->p{i} = {reached} - h{i};");
        }
        for name in self.channels.iter().flat_map(|&i| self.folded(i)) {
            let _ = writeln!(out, "    state->{name} = {name};");
        }
        for i in &self.channels {
            let _ = writeln!(out, "    state->x{i}_prev = x{i};");
        }
        out.push_str(
            "    const float u = @_limited(v, @_u_min, @_u_max);
    state->held = u;
    state->offset -= @_decay * state->offset;
    state->resuming = false;

    output->u = u;
    output->sigma = sigma;
    output->sigma_star = sigma_star;
    const bool over = sigma_star > @_sigma_star_bound || sigma_star < -@_sigma_star_bound;
    return (u != v ? (unsigned)@@_SATURATED : 0u) | (over ? (unsigned)@@_SIGMA_STAR_OVER_BOUND : 0u);
}
",
        );
        out
    }

    fn tail(&self) -> String {
        self.c("
#undef @@_NO_CONTRACTION
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
#endif
")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_floats_are_those_of_c99() {
        for (value, text) in [
            (1.0, "0x1.000000p+0f"),
            (-0.1, "-0x1.99999ap-4f"),
            (0.0, "0x0p+0f"),
            (-0.0, "-0x0p+0f"),
            (1e12, "0x1.d1a94ap+39f"),
            (f32::MIN_POSITIVE, "0x1.000000p-126f"),
            (f32::from_bits(1), "0x0.000002p-126f"),
        ] {
            assert_eq!(hexadecimal(value), text);
        }
    }

    #[test]
    fn numbers_get_the_names_of_the_layout() {
        let numbers: Vec<f32> = (0..56).map(|k| k as f32).collect();
        let named = named(4, 2, 2, &numbers);
        assert_eq!(named["drift"], [4.0, 5.0, 6.0, 7.0]);
        assert_eq!(named["rate"], [8.0]);
        assert_eq!(named["gamma"], [11.0, 12.0, 13.0, 14.0]);
        assert_eq!(named["c"], [15.0, 16.0, 17.0, 18.0]);
        assert_eq!(named["input_gain"], [42.0]);
        assert_eq!(named["mu2_n"], [43.0]);
    }
}
