/* Sliding mode control with an extended disturbance observer: n = 4, observers of order up to 2 in channels 2, 4, f32, T = 0.0001 s.
 * Exported by version 0.1.0 of the library; do not edit, export it again. C99 and C++17, no library.
 *
 *     #include "this file"
 *     static joint_state state;                              once; zeros are right
 *     joint_output output;                                   in the timer interrupt, every T:
 *     unsigned health = joint_tick_or_start(&state, x, &output);
 *     write_pwm(output.u);
 *     joint_applied(&state, held);                           only if the actuator holds another u
 *
 * The same bits as the Rust tick need every operation rounded on its own. A fused multiply-add rounds a * b + c once,
 * which is another number (and takes longer on a Cortex-M4F): compile with -ffp-contract=off. This file asks for it by
 * itself where it can; with GCC that keeps joint_tick from being inlined unless the option is given too. Reordering
 * (-ffast-math), more digits than f32 (x87) and flushing denormals to zero (FPSCR.FZ) change bits as well.
 *
 * Design 0x31bf4986 (CRC-32, the one a target reports).
 * Scenario joint.toml (CRC-32 0x97fb56c5):
 *
 *     # The joint of the examples: 10 kHz, all three roots of the surface at -10, both poles of each observer at -100.
 *     #     host-sim export joint.toml --lang c --prefix joint -o joint_design.h --force
 *     #     host-sim export joint.toml --standalone --prefix joint -o joint_standalone.h --force
 *     name = "joint"
 *
 *     [plant]
 *     kind = "flexible_joint"
 *     reading = "reconstructed"
 *
 *     [controller]
 *     period_s = 1e-4
 *     surface_bandwidth_rad_s = 10.0
 *     alpha_per_s = 10.0
 *     k_l = 50.0
 *     limits = { min = -300.0, max = 300.0 }
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
#ifndef JOINT_STANDALONE
#define JOINT_STANDALONE

#include <float.h>
#include <stdbool.h>

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) \
    || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "compile without -ffast-math and its parts: they change numbers and remove the guard against NaN"
#endif
#if FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16
#error "float must be computed as float: on a 32-bit x86 give -msse2 -mfpmath=sse"
#endif
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#define JOINT_NO_CONTRACTION
#else
#define JOINT_NO_CONTRACTION _Pragma("STDC FP_CONTRACT OFF")
#endif

#define JOINT_VERSION "0.1.0"
#define JOINT_DESIGN 0x31bf4986u /* log it: it tells designs apart */
#define JOINT_N 4 /* plant order, length of x */
#define JOINT_PERIOD_S 0.0001

/* The design, exact: hexadecimal is what the tick uses, decimal is for reading. */
static const float joint_drift_1 = 0x1.2e8560p+6f; /* 75.63025: a(x)/b_0 = drift . x */
static const float joint_drift_2 = 0x0p+0f; /* 0.0 */
static const float joint_drift_3 = -0x1.2e8560p+6f; /* -75.63025 */
static const float joint_drift_4 = -0x1.2d2d2ep-1f; /* -0.5882353 */
static const float joint_rate = 0x1.388000p+13f; /* 10000.0: 1/T, 1/s */
static const float joint_rate_n = 0x1.38f0f0p+6f; /* 78.23529: 1/(T b_0) */
static const float joint_theta_n = 0x1.005220p-1f; /* 0.50062656: mean of channel n's response over a tick */
static const float joint_gamma2_1 = 0x1.460c0cp-6f; /* 0.019900333: observer gain */
static const float joint_gamma2_2 = 0x1.9f42aep-14f; /* 9.900581e-5: observer gain */
static const float joint_gamma4_1 = 0x1.460c0cp-6f; /* 0.019900333: observer gain */
static const float joint_gamma4_2 = 0x1.9f42aep-14f; /* 9.900581e-5: observer gain */
static const float joint_c_1 = 0x1.f40000p+9f; /* 1000.0: surface, Eq. (44) */
static const float joint_c_2 = 0x1.2c0000p+8f; /* 300.0: surface, Eq. (44) */
static const float joint_c_3 = 0x1.e00000p+4f; /* 30.0: surface, Eq. (44) */
static const float joint_g2_b = 0x1.380800p+13f; /* 9985.0: sigma's share */
static const float joint_kx_2 = -0x1.f61438p+2f; /* -7.844984: law, Eq. (51), on the state */
static const float joint_kx_3 = -0x1.2d26f4p+1f; /* -2.3527513: law, Eq. (51), on the state */
static const float joint_kx_4 = -0x1.da3ff6p-3f; /* -0.23156731: law, Eq. (51), on the state */
static const float joint_kw = -0x1.4103d2p-4f; /* -0.078372784: on the offset W */
static const float joint_us = -0x1.917826p-2f; /* -0.3920599: on sigma* */
static const float joint_k2_b = 0x1.1211dap-14f; /* 6.5343316e-5: on the estimates */
static const float joint_k4_b = 0x1.06de00p-12f; /* 0.00025068969: on the estimates */
static const float joint_satk = 0x0p+0f; /* 0.0: slope of the switching term */
static const float joint_lim = 0x0p+0f; /* 0.0: its limit */
static const float joint_decay = 0x1.060352p-10f; /* 0.0009995002: 1 - e^(-alpha T), Eq. (17) */
static const float joint_u_min = -0x1.2c0000p+8f; /* -300.0 */
static const float joint_u_max = 0x1.2c0000p+8f; /* 300.0 */
static const float joint_sigma_star_bound = 0x1.400000p+3f; /* 10.0: above it the health says so */
static const float joint_hold = 0x0p+0f; /* 0.0: a rejected sample gives hold u + fallback */
static const float joint_fallback = 0x0p+0f; /* 0.0 */
static const float joint_input_limit = 0x1.d1a94ap+39f; /* 1000000000000.0: a demand beyond is that of a bad sample */
static const float joint_spike = 0x1.93e594p+99f; /* 1e30: a demand beyond is not even that of a finite one */
static const float joint_start2 = 0x0p+0f; /* 0.0: estimate at the start, folded */
static const float joint_start4 = 0x0p+0f; /* 0.0: estimate at the start, folded */

/* What a tick has to say about itself, as a set of bits. */
enum {
    JOINT_OK = 0,
    JOINT_INPUT_REJECTED = 1, /* x, or what became of it, not finite or too large: the fallback goes out */
    JOINT_SATURATED = 2, /* the law asked for more than the limits allow */
    JOINT_SIGMA_STAR_OVER_BOUND = 4 /* the plant does not do what the design supposes */
};

/* What the controller remembers between two ticks. Zeros before the start. */
typedef struct {
    float a2, b2; /* observer of channel 2: folded estimate */
    float p2, x2_prev; /* what its last innovation needs; x at the last tick */
    float a4, b4; /* observer of channel 4: folded estimate */
    float p4, x4_prev; /* what its last innovation needs; x at the last tick */
    float offset; /* W = sigma(0) e^(-alpha t), Eq. (17) */
    float held; /* the u that the actuator holds */
    bool resuming; /* no last tick to compare the next sample with */
    bool started;
} joint_state;

typedef struct {
    float u; /* to hold until the next tick, within the limits */
    float sigma; /* Eq. (44), unit of x_n */
    float sigma_star; /* Eq. (17), unit of x_n */
} joint_output;

/* value limited to [min, max]. */
static inline float joint_limited(float value, float min, float max)
{
    const float below = value > max ? max : value;
    return below < min ? min : below;
}

/* False for NaN, infinities and what no actuator takes. */
static inline bool joint_is_sound(float value)
{
    return value >= -joint_input_limit && value <= joint_input_limit;
}

/* The state before the first tick, from the sample that the first tick gets too. False, and the state as it was, if the
 * sample is not finite: try the next one. */
static inline bool joint_start(joint_state *state, const float x[JOINT_N])
{
    JOINT_NO_CONTRACTION
    const float x1 = x[0], x2 = x[1], x3 = x[2], x4 = x[3];
    const float a2 = joint_start2;
    const float b2 = 0.0f;
    const float a4 = joint_start4;
    const float b4 = 0.0f;
    const float y1 = x1;
    const float y2 = x2;
    const float y3 = x3 + a2;
    const float y4 = x4;
    float sigma = joint_c_1 * y1;
    sigma += joint_c_2 * y2;
    sigma += joint_c_3 * y3;
    sigma += joint_g2_b * b2;
    sigma += y4; /* c_n = 1 */
    if (!(joint_is_sound(x1)
          && joint_is_sound(x2)
          && joint_is_sound(x3)
          && joint_is_sound(x4)
          && joint_is_sound(a2)
          && joint_is_sound(a4)
          && joint_is_sound(sigma))) {
        return false;
    }
    state->a2 = a2;
    state->b2 = b2;
    state->p2 = 0.0f;
    state->x2_prev = 0.0f;
    state->a4 = a4;
    state->b4 = b4;
    state->p4 = 0.0f;
    state->x4_prev = 0.0f;
    state->offset = sigma; /* Eq. (17): sigma* starts at zero */
    state->held = 0.0f;
    state->resuming = true;
    state->started = true;
    return true;
}

/* Tells what the actuator really holds since the last tick, where that is not the u of the tick: the only anti-windup,
 * and needed. Call it before the next tick. A value that is not finite is ignored, and the answer is false. */
static inline bool joint_applied(joint_state *state, float u)
{
    const bool sound = joint_is_sound(u);
    if (sound) {
        state->held = u;
    }
    return sound;
}

/* The sample is lost: keep the estimates, let the offset decay as time goes on, send the fallback. */
static inline unsigned joint_reject(joint_state *state, float demand, joint_output *output)
{
    JOINT_NO_CONTRACTION
    if (state->resuming && demand >= -joint_spike && demand <= joint_spike) {
        /* A finite sample asks for too much a second time running: a spike has spoilt the estimates. */
        state->a2 = 0.0f;
        state->b2 = 0.0f;
        state->a4 = 0.0f;
        state->b4 = 0.0f;
    }
    state->held = joint_limited(joint_hold * state->held + joint_fallback, joint_u_min, joint_u_max);
    state->offset -= joint_decay * state->offset;
    state->resuming = true;
    output->u = state->held;
    output->sigma = state->offset;
    output->sigma_star = 0.0f;
    return JOINT_INPUT_REJECTED;
}

/* One tick: observers, sigma*, law, clamp. Call it once per period with the newest sample x, in chain coordinates.
 * Returns the health; output->u is good whatever x was. */
static inline unsigned joint_tick(joint_state *state, const float x[JOINT_N], joint_output *output)
{
    JOINT_NO_CONTRACTION
    const float x1 = x[0], x2 = x[1], x3 = x[2], x4 = x[3];
    /* 0. Nominal model, in units of u: a(x)/b_0. */
    float drift = joint_drift_1 * x1;
    drift += joint_drift_2 * x2;
    drift += joint_drift_3 * x3;
    drift += joint_drift_4 * x4;

    /* 1. Observers, Eq. (45)-(50): innovation e, then A += B + gamma_1 e, B += C + gamma_2 e, ..
     * The driven channel first: that is the order of fewest cycles. */
    const float moved2 = (x2 - state->x2_prev) * joint_rate;
    const float moved4 = (x4 - state->x4_prev) * joint_rate_n;
    const float h2 = 0.5f * x3;
    const float h4 = joint_theta_n * drift;
    const float e4 = moved4 - h4 - (state->p4 + state->held);
    float a4 = state->a4 + (state->b4 + joint_gamma4_1 * e4);
    float b4 = state->b4 + joint_gamma4_2 * e4;
    const float e2 = moved2 - h2 - state->p2;
    float a2 = state->a2 + (state->b2 + joint_gamma2_1 * e2);
    float b2 = state->b2 + joint_gamma2_2 * e2;
    if (state->resuming) { /* nothing to compare with: the estimates wait one more tick */
        a2 = state->a2;
        b2 = state->b2;
        a4 = state->a4;
        b4 = state->b4;
    }

    /* 2. Of the law what needs no sigma*; surface, Eq. (44); offset, Eq. (17). */
    const float input_drift = drift + a4;
    float v = -input_drift;
    v += joint_k4_b * b4;
    v += joint_k2_b * b2;
    const float y1 = x1;
    const float y2 = x2;
    const float y3 = x3 + a2;
    const float y4 = x4;
    float sigma = joint_c_1 * y1;
    sigma += joint_c_2 * y2;
    sigma += joint_c_3 * y3;
    sigma += joint_g2_b * b2;
    sigma += y4; /* c_n = 1 */
    const float sigma_star = sigma - state->offset;

    /* 3. Law, Eq. (51). */
    v += joint_kw * state->offset;
    v += joint_us * sigma_star;
    v += joint_kx_2 * y2;
    v += joint_kx_3 * y3;
    v += joint_kx_4 * y4;
    v += joint_limited(joint_satk * sigma_star, -joint_lim, joint_lim);
    /* Whatever was wrong with x or a sum on the way ends up here: one comparison guards them all. */
    if (!joint_is_sound(v)) {
        return joint_reject(state, v, output);
    }

    /* 4. Memory. */
    state->p2 = y3 - h2;
    state->p4 = input_drift - h4;
    state->a2 = a2;
    state->b2 = b2;
    state->a4 = a4;
    state->b4 = b4;
    state->x2_prev = x2;
    state->x4_prev = x4;
    const float u = joint_limited(v, joint_u_min, joint_u_max);
    state->held = u;
    state->offset -= joint_decay * state->offset;
    state->resuming = false;

    output->u = u;
    output->sigma = sigma;
    output->sigma_star = sigma_star;
    const bool over = sigma_star > joint_sigma_star_bound || sigma_star < -joint_sigma_star_bound;
    return (u != v ? (unsigned)JOINT_SATURATED : 0u) | (over ? (unsigned)JOINT_SIGMA_STAR_OVER_BOUND : 0u);
}

/* The tick of a controller that need not have started: the first good sample starts it; until then the fallback goes
 * out. Needs a state of zeros the first time. */
static inline unsigned joint_tick_or_start(joint_state *state, const float x[JOINT_N], joint_output *output)
{
    if (!state->started && !joint_start(state, x)) {
        output->u = joint_limited(joint_fallback, joint_u_min, joint_u_max);
        output->sigma = 0.0f;
        output->sigma_star = 0.0f;
        return JOINT_INPUT_REJECTED;
    }
    return joint_tick(state, x, output);
}

#undef JOINT_NO_CONTRACTION
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
#endif
