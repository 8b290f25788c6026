/* Sliding mode control with an extended disturbance observer: n = 4, observers of order up to 2 in channels 2, 4, f32, T = 0.0001 s.
 * Exported by version 0.1.0 of the library. Do not edit; export again. The assembler file next to this one contains the
 * functions. C99 and C++11, for a Cortex-M4F with arguments in float registers (-mfloat-abi=hard).
 *
 *     static paper_state state;                              once; zeros before the start
 *     paper_output output;                                   in the timer interrupt, every T:
 *     unsigned health = paper_tick_or_start(&state, x, &output);
 *     write_pwm(output.u);
 *     paper_report_applied(&state, held);                    only if the actuator holds another u
 *
 * The results equal the Rust tick and the C file in every bit, for every sample, with one exception: products
 * with zero entries of a(x) are left out, which only changes the sign of a zero. The state has another word order. x,
 * state and output must not overlap.
 *
 * A valid sample takes 152 cycles with tick_u and 167 with tick, return included. The count follows ARM's table of a
 * Cortex-M4 (DDI 0439D); it is not measured on silicon. No order of these operations takes less than 139 and 157: the
 * lower bound in docs/reference/cycles.md.
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
#ifdef PAPER_ASSEMBLY
#if PAPER_ASSEMBLY != 0xc2edb80du
#error "two designs with the prefix paper, 0xc2edb80du here and PAPER_ASSEMBLY before: export one with another --prefix"
#define PAPER_ASSEMBLY 0xc2edb80du
#endif
#else
#define PAPER_ASSEMBLY 0xc2edb80du

#include <float.h>
#include <stdbool.h>
#include <stddef.h>

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
    float held; /* u that the actuator holds */
    float p4; /* prediction for the next innovation */
    float x2_prev; /* x of the previous tick */
    float p2; /* prediction for the next innovation */
    float x4_prev; /* x of the previous tick */
    float a2; /* folded estimate */
    float b2; /* folded estimate */
    float a4; /* folded estimate */
    float b4; /* folded estimate */
    float offset; /* W = sigma(0) e^(-alpha t), Eq. (17) */
    bool resuming; /* 1: there is no previous tick for the next sample */
    bool started;
} paper_state;

typedef struct {
    float u; /* hold until the next tick; within the limits */
    float sigma; /* sliding variable, Eq. (44), unit of x_n */
    float sigma_star; /* sliding variable without its initial offset, Eq. (17), unit of x_n */
} paper_output;

/* Checks that the compiler gives the state the memory layout of the assembly. */
typedef char paper_state_is_laid_out[
    sizeof(paper_state) == 4 * 10 + 4 && offsetof(paper_state, resuming) == 4 * 10
    && offsetof(paper_state, started) == 4 * 10 + 1 && sizeof(bool) == 1 && sizeof(paper_output) == 12 ? 1 : -1];

#ifdef __cplusplus
extern "C" {
#endif

/* Starts the state with a sample; pass the same sample to the first tick. Returns false and leaves the state
 * unchanged if the sample is invalid: try the next one. */
bool paper_start(paper_state *state, const float x[PAPER_N]);

/* Writes the output before the first valid sample: the fallback. */
unsigned paper_not_started(paper_output *output);

/* Computes one tick: observers, sigma*, law, limits. Call it once per period with the newest sample x, in
 * chain coordinates. Returns the status flags. output->u is valid for every x: an invalid x or sum appears in
 * the demand of the law, which one comparison checks. */
unsigned paper_tick(paper_state *state, const float x[PAPER_N], paper_output *output);

/* Computes the same tick and returns u alone. */
float paper_tick_u(paper_state *state, const float x[PAPER_N]);

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
bool paper_report_applied(paper_state *state, float u);

/* Writes the estimates at the instant of the last tick. d_hat[i][m] is the m-th derivative of the estimate in
 * channel i + 1, in the unit of x_(i+1) per second and per second^m. It is 0 without an observer, or above the order of
 * the observer. Returns false and writes zeros before the start. */
bool paper_estimates(const paper_state *state, float d_hat[PAPER_N][PAPER_R]);

/* Clears everything except the design: the next valid sample starts again. Use it after a fault. */
void paper_reset(paper_state *state);

#ifdef __cplusplus
}
#endif

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
