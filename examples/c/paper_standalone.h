/* Sliding mode control with an extended disturbance observer: n = 4, observers of order up to 2 in channels 2, 4, f32, T = 0.0001 s.
 * Exported by version 0.1.0 of the library. Do not edit; export again. C99 and C++11, no library needed.
 *
 *     #include "this file"
 *     static paper_state state;                              once; zeros before the start
 *     paper_output output;                                   in the timer interrupt, every T:
 *     unsigned health = paper_tick_or_start(&state, x, &output);
 *     write_pwm(output.u);
 *     paper_report_applied(&state, held);                    only if the actuator holds another u
 *
 * COMPILER OPTIONS. The bits equal the bits of the Rust tick only if every operation is rounded on its own. A fused
 * multiply-add rounds a * b + c once, which is another number and takes longer on a Cortex-M4F. So compile with
 * -ffp-contract=off. This file also switches fusing off by itself where the compiler permits it. GCC then inlines
 * paper_tick only if the option is given, too. Reordering (-ffast-math and its parts) and the precision of x87 change
 * bits as well: if the compiler reports them, this file does not compile. clang reports only -ffast-math and
 * -ffinite-math-only; with clang the file switches reordering off. No check detects -fno-signed-zeros (also part of
 * -funsafe-math-optimizations), -fno-honor-nans and -fno-honor-infinities: never use them.
 *
 * FLOATING-POINT MODES. The tick assumes rounding to nearest, subnormal numbers, and float computed as float. They must
 * hold wherever it runs: in main, in an interrupt or in a host program. On a Cortex-M, FPSCR has RMode = 00 and FZ = 0.
 * An interrupt starts with FPDSCR instead of the FPSCR of main, and it needs FPCCR.ASPEN = 1. All three are correct
 * after reset. On x86, MXCSR has neither FTZ nor DAZ; linking with -ffast-math sets them. Call paper_modes_ok once
 * at start-up in the context of the tick. Under other modes u is still a number within its limits; its bits differ.
 *
 * Design 0x8afd7ad8 (FNV-1a; `design_hash` in the run.json of a run).
 * Scenario paper.toml (CRC-32 0x2bacc204):
 *
 *     # The paper's law on the state of a joint, the numbers of Table I as a joint has them: 10 kHz, all three roots of the
 *     # surface at -10, both poles of each observer at -100.
 *     #     host-sim export paper.toml --lang c --prefix paper -o paper_design.h --force
 *     #     host-sim export paper.toml --standalone --prefix paper -o paper_standalone.h --force
 *     #     host-sim export paper.toml --asm --prefix paper -o paper_assembly.S --force
 *     name = "paper"
 *
 *     [plant]
 *     kind = "flexible_joint"
 *     reading = "physical"
 *
 *     [controller]
 *     period_s = 1e-4
 *     surface_bandwidth_rad_s = 10.0
 *     alpha_per_s = 10.0
 *     k_l = 50.0
 *     limits = { min = -30.0, max = 30.0 }
 *     fallback = 0.0
 *     sigma_star_bound = 10.0
 *
 *     [[controller.observer]]
 *     channel = 2
 *     bandwidth_rad_s = 100.0
 *     order = 2
 *
 *     [[controller.observer]]
 *     channel = 4
 *     bandwidth_rad_s = 100.0
 *     order = 2
 */
#ifdef PAPER_STANDALONE
#if PAPER_STANDALONE != 0xaf96f8eeu
#error "two designs with the prefix paper, 0xaf96f8eeu here and PAPER_STANDALONE before: export one with another --prefix"
#define PAPER_STANDALONE 0xaf96f8eeu
#endif
#else
#define PAPER_STANDALONE 0xaf96f8eeu

#include <float.h>
#include <stdbool.h>

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) \
    || defined(__NO_SIGNED_ZEROS__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "compile without -ffast-math and its parts: they change numbers and remove the guard against NaN"
#endif
#if FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16
#error "float must be computed as float: on a 32-bit x86 give -msse2 -mfpmath=sse"
#endif
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#define PAPER_AS_WRITTEN
#elif defined(__clang__) && __clang_major__ >= 18
#define PAPER_AS_WRITTEN _Pragma("clang fp contract(off) reassociate(off) reciprocal(off)")
#elif defined(__clang__) && __clang_major__ >= 14
#define PAPER_AS_WRITTEN _Pragma("clang fp contract(off) reassociate(off)")
#else
#define PAPER_AS_WRITTEN _Pragma("STDC FP_CONTRACT OFF")
#endif

#define PAPER_VERSION "0.1.0"
#define PAPER_DESIGN 0x8afd7ad8u /* identifies the design: log it */
#define PAPER_N 4 /* plant order, length of x */
#define PAPER_R 2 /* highest order of an observer */
#define PAPER_PERIOD_S 0.0001

/* Status flags of a tick. */
enum {
    PAPER_OK = 0,
    PAPER_INPUT_REJECTED = 1, /* x or a result of it is not finite or too large: output is the fallback */
    PAPER_SATURATED = 2, /* the demanded u exceeds the limits */
    PAPER_SIGMA_STAR_OVER_BOUND = 4 /* the plant differs from the design */
};

/* State between two ticks; zeros before the start. Channel 2 has a2, b2, c2, p2. */
typedef struct {
    float a2; /* folded estimate */
    float b2; /* folded estimate */
    float a4; /* folded estimate */
    float b4; /* folded estimate */
    float p2; /* prediction for the next innovation */
    float p4; /* prediction for the next innovation */
    float x2_prev; /* x of the previous tick */
    float x4_prev; /* x of the previous tick */
    float offset; /* W = sigma(0) e^(-alpha t), Eq. (17) */
    float held; /* u that the actuator holds */
    bool resuming; /* 1: there is no previous tick for the next sample */
    bool started;
} paper_state;

typedef struct {
    float u; /* hold until the next tick; within the limits */
    float sigma; /* sliding variable, Eq. (44), unit of x_n */
    float sigma_star; /* sliding variable without its initial offset, Eq. (17), unit of x_n */
} paper_output;

/* Starts the state with a sample; pass the same sample to the first tick. Returns false and leaves the state
 * unchanged if the sample is invalid: try the next one. */
static inline bool paper_start(paper_state *state, const float x[PAPER_N])
{
    PAPER_AS_WRITTEN
    static const float d_hat_4 = 0.0f; /* initial estimate, in the unit of x_i per second */
    static const float input_gain = 5.00163428e3f; /* b_0 */
    static const float d_hat_2 = 0.0f; /* initial estimate, in the unit of x_i per second */
    static const float c_1 = 1000.0f; /* surface, Eq. (44) */
    static const float c_2 = 300.0f; /* surface, Eq. (44) */
    static const float c_3 = 30.0f; /* surface, Eq. (44) */
    static const float g2_b = 9985.0f; /* sigma, on the estimates */
    static const float input_limit = 9.99999996e11f; /* largest number for a start or a held u */
    const float x1 = x[0];
    const float x2 = x[1];
    const float x3 = x[2];
    const float x4 = x[3];
    const float a4 = d_hat_4 / input_gain;
    const float y3 = x3 + d_hat_2;
    float sigma = c_1 * x1;
    sigma += c_2 * x2;
    sigma += c_3 * y3;
    sigma += g2_b * 0.0f;
    sigma += x4;
    const bool answer = ((x1 >= (-input_limit)) && (x1 <= input_limit))
            && ((x2 >= (-input_limit)) && (x2 <= input_limit)) && ((x3 >= (-input_limit)) && (x3 <= input_limit))
            && ((x4 >= (-input_limit)) && (x4 <= input_limit)) && ((a4 >= (-input_limit)) && (a4 <= input_limit))
            && ((sigma >= (-input_limit)) && (sigma <= input_limit));
    if (answer) {
        state->resuming = true;
        state->a2 = d_hat_2;
        state->b2 = 0.0f;
        state->a4 = a4;
        state->b4 = 0.0f;
        state->p2 = 0.0f;
        state->p4 = 0.0f;
        state->x2_prev = 0.0f;
        state->x4_prev = 0.0f;
        state->offset = sigma;
        state->held = 0.0f;
        state->started = true;
    }
    return answer;
}

/* Writes the output before the first valid sample: the fallback. */
static inline unsigned paper_not_started(paper_output *output)
{
    PAPER_AS_WRITTEN
    static const float fallback = 0.0f;
    output->u = fallback;
    output->sigma = 0.0f;
    output->sigma_star = 0.0f;
    return (unsigned)PAPER_INPUT_REJECTED;
}

/* Computes one tick: observers, sigma*, law, limits. Call it once per period with the newest sample x, in
 * chain coordinates. Returns the status flags. output->u is valid for every x: an invalid x or sum appears in
 * the demand of the law, which one comparison checks. */
static inline unsigned paper_tick(paper_state *state, const float x[PAPER_N], paper_output *output)
{
    PAPER_AS_WRITTEN
    static const float drift_1 = 7.56302490e1f; /* a(x)/b_0 = drift . x */
    static const float drift_2 = 0.0f; /* a(x)/b_0 = drift . x */
    static const float drift_3 = -1.93277311e0f; /* a(x)/b_0 = drift . x */
    static const float drift_4 = -1.50326798e-2f; /* a(x)/b_0 = drift . x */
    static const float rate = 10000.0f; /* 1/T, 1/s */
    static const float rate_n = 1.99934638e0f; /* 1/(T b_0) */
    static const float theta_n = 5.00626564e-1f; /* mean of channel n's response over a tick */
    static const float gamma4_1 = 1.99003331e-2f; /* observer gain */
    static const float gamma4_2 = 9.90058106e-5f; /* observer gain */
    static const float gamma2_1 = 1.99003331e-2f; /* observer gain */
    static const float gamma2_2 = 9.90058106e-5f; /* observer gain */
    static const float c_1 = 1000.0f; /* surface, Eq. (44) */
    static const float c_2 = 300.0f; /* surface, Eq. (44) */
    static const float c_3 = 30.0f; /* surface, Eq. (44) */
    static const float g2_b = 9985.0f; /* sigma, on the estimates */
    static const float us = -1.01607854e29f; /* law, on sigma* */
    static const float satk = 0.0f; /* slope of the switching term */
    static const float lim = 0.0f; /* limit of the switching term */
    static const float kw = -2.03114130e28f; /* law, on the offset W */
    static const float kx_2 = -2.07055430e30f; /* law, Eq. (51), on the state; the law is in u / unit, so that implausible sums overflow */
    static const float kx_3 = -6.09748749e29f; /* law, Eq. (51), on the state; the law is in u / unit, so that implausible sums overflow */
    static const float kx_4 = -6.00139394e28f; /* law, Eq. (51), on the state; the law is in u / unit, so that implausible sums overflow */
    static const float k4_b = 2.54229544e27f; /* law, on the estimates */
    static const float k2_b = 1.69346426e25f; /* law, on the estimates */
    static const float unit = 9.86076132e-32f; /* factor from the sums of the law to u */
    static const float ko = 8.01644754e-3f; /* demand of the offset */
    static const float plausible = 15360.0f; /* a demand above it is checked */
    static const float u_max = 30.0f;
    static const float u_min = -30.0f;
    static const float decay = 9.99500160e-4f; /* 1 - e^(-alpha T), Eq. (17) */
    static const float sigma_star_bound = 10.0f; /* above it a status flag is set */
    static const float input_limit = 9.99999996e11f; /* largest number for a start or a held u */
    static const float hold = 0.0f; /* output for a rejected sample: hold u + fallback */
    static const float fallback = 0.0f;
    const float x1 = x[0];
    const float x2 = x[1];
    const float x3 = x[2];
    const float x4 = x[3];

    /* 0. Nominal model, in units of u: a(x)/b_0, b(x)/b_0. */
    float drift = drift_1 * x1;
    drift += drift_2 * x2;
    drift += drift_3 * x3;
    drift += drift_4 * x4;

    /* 1. Observers, Eq. (45)-(50): innovation e, then A += B + gamma_1 e, B += C + gamma_2 e, .. */
    const float moved2 = (x2 - state->x2_prev) * rate;
    const float moved4 = (x4 - state->x4_prev) * rate_n;
    const float h2 = 0.5f * x3;
    const float h4 = theta_n * drift;
    const float e4 = (moved4 - h4) - (state->p4 + state->held);
    const float a4 = state->a4 + (state->b4 + (gamma4_1 * e4));
    const float b4 = state->resuming ? state->b4 : (state->b4 + (gamma4_2 * e4));
    const float e2 = (moved2 - h2) - state->p2;
    const float a2 = state->a2 + (state->b2 + (gamma2_1 * e2));
    const float b2 = state->resuming ? state->b2 : (state->b2 + (gamma2_2 * e2));
    const float a2_2 = state->resuming ? (state->a2 + state->b2) : a2;
    const float a4_2 = state->resuming ? (state->a4 + state->b4) : a4;

    /* 2. Of the law what needs no sigma*; surface, Eq. (44); offset, Eq. (17). */
    const float y3 = x3 + a2_2;
    const float input_drift = drift + a4_2;
    const float sigma = c_1 * x1;
    const float part = c_2 * x2;
    float sigma_2 = sigma + part;
    sigma_2 += c_3 * y3;
    sigma_2 += g2_b * b2;
    sigma_2 += x4;
    const float sigma_star = sigma_2 - state->offset;

    /* 3. Law, Eq. (51). */
    float v = us * sigma_star;
    const float switching = satk * sigma_star;
    v += (switching > lim) ? lim : ((switching < (-lim)) ? (-lim) : switching);
    v += kw * state->offset;
    v += kx_2 * x2;
    v += kx_3 * y3;
    v += kx_4 * x4;
    v += k4_b * b4;
    v += k2_b * b2;
    const float asked = (v * unit) - input_drift;
    const float of_offset = ko * state->offset;
    const float part_2 = asked - of_offset;
    if (((asked >= (-plausible)) && (asked <= plausible))
            || (((asked > (-((of_offset < 0.0f) ? (-of_offset) : (of_offset + 0.0f))))
            && (asked < ((of_offset < 0.0f) ? (-of_offset) : (of_offset + 0.0f))))
            && ((part_2 < (-plausible)) || (part_2 > plausible)))) {
        const float u = (asked > u_max) ? u_max : ((asked < u_min) ? u_min : asked);

        /* 4. Memory. */
        const float offset = state->offset - (decay * state->offset);
        output->u = u;
        output->sigma = sigma_2;
        output->sigma_star = sigma_star;
        state->resuming = false;
        state->a2 = a2_2;
        state->b2 = b2;
        state->a4 = a4_2;
        state->b4 = b4;
        state->p2 = y3 - h2;
        state->p4 = input_drift - h4;
        state->x2_prev = x2;
        state->x4_prev = x4;
        state->offset = offset;
        state->held = u;
        return ((u != asked) ? (unsigned)PAPER_SATURATED : 0u)
                | (((sigma_star < (-sigma_star_bound)) || (sigma_star > sigma_star_bound))
                ? (unsigned)PAPER_SIGMA_STAR_OVER_BOUND : 0u);
    }

    /* A rejected sample. */
    float alone = x4 + (c_3 * x3);
    alone += part;
    const float part_3 = alone + sigma;
    const bool holds = (part_3 >= (-input_limit)) && (part_3 <= input_limit);
    const float alone_2 = holds ? part_3 : 9.99999968e37f;
    const float apart = ((us + kw) * unit) * (alone_2 - state->p2);
    const bool holds_2 = state->resuming && holds && ((apart >= (-plausible)) && (apart <= plausible));
    const float part_4 = holds_2 ? part_3 : state->offset;
    const float part_5 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit)) ? state->held
            : 0.0f)) + fallback;
    const float alone_3 = part_4 - (decay * part_4);
    const float u_2 = (part_5 > u_max) ? u_max : ((part_5 < u_min) ? u_min : part_5);
    output->u = u_2;
    output->sigma = alone_3;
    output->sigma_star = 0.0f;
    if (holds_2) {
        state->a2 = 0.0f;
        state->b2 = 0.0f;
        state->a4 = 0.0f;
        state->b4 = 0.0f;
    }
    state->resuming = true;
    state->p2 = alone_2;
    state->offset = alone_3;
    state->held = u_2;
    return (unsigned)PAPER_INPUT_REJECTED;
}

/* Computes one tick and starts the controller with its first valid sample. Until then the output is the fallback. Pass
 * a state of zeros at first. */
static inline unsigned paper_tick_or_start(paper_state *state, const float x[PAPER_N], paper_output *output)
{
    unsigned health;
    if (state->started || paper_start(state, x)) {
        health = paper_tick(state, x, output);
    } else {
        health = paper_not_started(output);
    }
    return health;
}

/* Reports the u that the actuator has held since the last tick, if it is not output->u. This is the only
 * anti-windup. Call it before the next tick. Returns false and changes nothing before the start, and for a value
 * that is not finite or above 1e12. */
static inline bool paper_report_applied(paper_state *state, float u)
{
    PAPER_AS_WRITTEN
    static const float input_limit = 9.99999996e11f; /* largest number for a start or a held u */
    const bool answer = state->started && ((u >= (-input_limit)) && (u <= input_limit));
    if (answer) {
        state->held = u;
    }
    return answer;
}

/* Writes the estimates at the instant of the last tick. d_hat[i][m] is the m-th derivative of the estimate in
 * channel i + 1, in the unit of x_(i+1) per second and per second^m. It is 0 without an observer, or above the order of
 * the observer. Returns false and writes zeros before the start. */
static inline bool paper_estimates(const paper_state *state, float d_hat[PAPER_N][PAPER_R])
{
    PAPER_AS_WRITTEN
    static const float period = 9.99999975e-5f; /* T, s */
    static const float theta_n = 5.00626564e-1f; /* mean of channel n's response over a tick */
    static const float mu2_n = 3.33960056e-1f; /* second moment of channel n's response */
    static const float input_gain = 5.00163428e3f; /* b_0 */
    if (!state->started) {
        d_hat[0][0] = 0.0f;
        d_hat[0][1] = 0.0f;
        d_hat[1][0] = 0.0f;
        d_hat[1][1] = 0.0f;
        d_hat[2][0] = 0.0f;
        d_hat[2][1] = 0.0f;
        d_hat[3][0] = 0.0f;
        d_hat[3][1] = 0.0f;
        return false;
    }
    const float part = 0.5f * 0.0f;
    const float part_2 = state->b2 - ((0.5f + 0.5f) * 0.0f);
    const float part_3 = state->b4 - ((theta_n + 0.5f) * 0.0f);
    d_hat[0][0] = 0.0f;
    d_hat[0][1] = 0.0f;
    d_hat[1][0] = ((state->a2 - (0.5f * part_2)) - (3.33333343e-1f * part)) * 1.0f;
    d_hat[1][1] = (part_2 * 1.0f) / period;
    d_hat[2][0] = 0.0f;
    d_hat[2][1] = 0.0f;
    d_hat[3][0] = ((state->a4 - (theta_n * part_3)) - (mu2_n * part)) * input_gain;
    d_hat[3][1] = (part_3 * input_gain) / period;
    return true;
}

/* Clears everything except the design: the next valid sample starts again. Use it after a fault. */
static inline void paper_reset(paper_state *state)
{
    PAPER_AS_WRITTEN
    if (state->started) {
        state->resuming = false;
        state->a2 = 0.0f;
        state->b2 = 0.0f;
        state->a4 = 0.0f;
        state->b4 = 0.0f;
        state->p2 = 0.0f;
        state->p4 = 0.0f;
        state->x2_prev = 0.0f;
        state->x4_prev = 0.0f;
        state->offset = 0.0f;
        state->held = 0.0f;
    }
    state->started = false;
}

/* Returns whether the floating-point modes of this context are the assumed ones. Call it once at start-up in the
 * context of the tick: an interrupt of a Cortex-M starts with the modes of FPDSCR. Returns false if rounding is not to
 * nearest, subnormal numbers are flushed, or the compiler fuses, reorders or widens operations. No tick calls it. */
static inline bool paper_modes_ok(void)
{
    PAPER_AS_WRITTEN
    const volatile float given[8] = {1.0f, 5.9604645e-8f, 1.1754944e-38f, 7.1746481e-43f, 0.5f, 1.2676506e30f, 1.00024414f,
                               1.00048828f};
    const float one = given[0];
    const float half_step = given[1]; /* 2^-24, half of the spacing of numbers above 1 */
    const float step = half_step + half_step;
    const float smallest = given[2]; /* 2^-126, the smallest normal number */
    const float subnormal = given[3]; /* 2^-140 */
    const float much = given[5]; /* 2^100 */
    const float root = given[6]; /* 1 + 2^-12; its square is 1 + 2^-11 in float, and 2^-24 more if fused */
    const float infinite = much * much;
    const float none = infinite - infinite;
    const bool is_below = none <= 0.0f;
    const bool is_above = none >= 0.0f;
    const volatile float half_of_it = smallest * given[4];
    bool good = ((one + half_step) <= one) && (((one + step) + half_step) >= (one + (step + step)));
    good = good && ((one + (0.75f * half_step)) <= one) && ((one - (0.25f * half_step)) >= one);
    good = good && ((-one - (0.75f * half_step)) >= -one);
    good = good && ((half_of_it + half_of_it) >= smallest) && ((subnormal * much) >= 9.094947e-13f);
    good = good && (((root * root) - given[7]) <= 0.0f) && (((one + (0.25f * step)) - one) <= 0.0f);
    good = good && !is_below && !is_above;
    return good;
}

#undef PAPER_AS_WRITTEN
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
#endif
