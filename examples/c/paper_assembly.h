/* Sliding mode control with an extended disturbance observer: n = 4, observers of order up to 2 in channels 2, 4, f32, T = 0.0001 s.
 * Exported by version 0.1.0 of the library; do not edit, export it again. The functions are in the file for the assembler
 * beside this one; C99 and C++11, for a Cortex-M4F with arguments in float registers (-mfloat-abi=hard).
 *
 *     static paper_state state;                              once; zeros are right
 *     paper_output output;                                   in the timer interrupt, every T:
 *     unsigned health = paper_tick_or_start(&state, x, &output);
 *     write_pwm(output.u);
 *     paper_report_applied(&state, held);                    only if it holds another u, not a late one
 *
 * The bits are those of the Rust tick and of the C file, for every sample. One thing differs: a product of the
 * sample with an entry of a(x) that is 0 is left out, which can be told by the sign of a zero alone. The state has an
 * order of its own. x, state and output must not overlap.
 *
 * A good sample takes 152 cycles with tick_u and 167 with tick, return included: counted from ARM's table of a Cortex-M4
 * (DDI 0439D), measured on no chip. No order of these operations takes less than 139 and 157, the lower
 * bound in docs/reference/cycles.md.
 *
 * FLOATING-POINT MODES assumed wherever the tick runs, be it main, an interrupt or a host program: rounding to nearest,
 * subnormal numbers kept, float computed as float. Of a Cortex-M: FPSCR with RMode = 00 and FZ = 0. An interrupt begins
 * with FPDSCR, not with the FPSCR of main, and needs FPCCR.ASPEN = 1 (all as after reset). Of x86: MXCSR without FTZ and
 * DAZ, which linking with -ffast-math sets. Call paper_modes_ok once at start-up, where the tick runs. Under other modes u
 * still stays within its limits and is a number; its bits are others.
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
#if PAPER_ASSEMBLY != 0xed787259u
#error "two designs with the prefix paper, 0xed787259u here and PAPER_ASSEMBLY before: export one with another --prefix"
#define PAPER_ASSEMBLY 0xed787259u
#endif
#else
#define PAPER_ASSEMBLY 0xed787259u

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
#define PAPER_DESIGN 0x8afd7ad8u /* log it: it tells designs apart */
#define PAPER_N 4 /* plant order, length of x */
#define PAPER_R 2 /* highest order of an observer */
#define PAPER_PERIOD_S 0.0001

/* What a tick has to say about itself, as a set of bits. */
enum {
    PAPER_OK = 0,
    PAPER_INPUT_REJECTED = 1, /* x, or what became of it, not finite or too large: the fallback goes out */
    PAPER_SATURATED = 2, /* the law asked for more than the limits allow */
    PAPER_SIGMA_STAR_OVER_BOUND = 4 /* the plant does not do what the design supposes */
};

/* What the controller remembers between two ticks. Zeros before the start. Of channel 2: a2, b2, c2, p2. */
typedef struct {
    float held; /* the u that the actuator holds */
    float p4; /* what the next innovation needs of the last tick */
    float x2_prev; /* x at the last tick */
    float p2; /* what the next innovation needs of the last tick */
    float x4_prev; /* x at the last tick */
    float a2; /* folded estimate */
    float b2; /* folded estimate */
    float a4; /* folded estimate */
    float b4; /* folded estimate */
    float offset; /* W = sigma(0) e^(-alpha t), Eq. (17) */
    bool resuming; /* no last tick to compare the next sample with */
    bool started;
} paper_state;

typedef struct {
    float u; /* to hold until the next tick, within the limits */
    float sigma; /* Eq. (44), unit of x_n */
    float sigma_star; /* Eq. (17), unit of x_n */
} paper_output;

/* The state as the assembly has it: a compiler that lays it out otherwise stops here. */
typedef char paper_state_is_laid_out[
    sizeof(paper_state) == 4 * 10 + 4 && offsetof(paper_state, resuming) == 4 * 10
    && offsetof(paper_state, started) == 4 * 10 + 1 && sizeof(bool) == 1 && sizeof(paper_output) == 12 ? 1 : -1];

#ifdef __cplusplus
extern "C" {
#endif

/* The state before the first tick, from the sample that the first tick gets too. False, and the state as
 * it was, if the sample is not good enough: try the next one. */
bool paper_start(paper_state *state, const float x[PAPER_N]);

/* What goes out as long as there has been no good sample. */
unsigned paper_not_started(paper_output *output);

/* One tick: observers, sigma*, law, clamp. Call it once per period with the newest sample x, in chain
 * coordinates. Returns the health; output->u is good whatever x was. Whatever was wrong with x or a sum on the
 * way ends up in what the law demands: one comparison guards them all. */
unsigned paper_tick(paper_state *state, const float x[PAPER_N], paper_output *output);

/* The same tick, for a caller that reads u alone: returns it. */
float paper_tick_u(paper_state *state, const float x[PAPER_N]);

/* The tick of a controller that need not have started: the first good sample starts it; until then the fallback goes
 * out. Needs a state of zeros the first time. */
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

/* Tells what the actuator really holds since the last tick, where that is not the u of the tick: the only
 * anti-windup, and needed. Call it before the next tick. A value that is not finite or beyond 1e12 is not taken,
 * nor any before the start, and the answer is false. */
bool paper_report_applied(paper_state *state, float u);

/* Estimates at the instant of the last tick: d_hat[i][m] is the m-th derivative of the estimate in
 * channel i + 1, in the unit of x_(i+1) per second and per second^m; zeros where there is no observer, or beyond its
 * order. False, and zeros, before the start. */
bool paper_estimates(const paper_state *state, float d_hat[PAPER_N][PAPER_R]);

/* Forgets all but the design: the next good sample starts again. For the end of a fault. */
void paper_reset(paper_state *state);

#ifdef __cplusplus
}
#endif

/* Are the floating-point modes here and now those of the head? Call it once at start-up, where the tick runs: an
 * interrupt of a Cortex-M begins with the modes of FPDSCR, not with those of main. False where rounding is not to
 * nearest, subnormal numbers are flushed, or the compiler fuses, reorders or widens operations. No tick calls it. */
static inline bool paper_modes_ok(void)
{
    PAPER_AS_WRITTEN
    const volatile float given[8] = {1.0f, 5.9604645e-8f, 1.1754944e-38f, 7.1746481e-43f, 0.5f, 1.2676506e30f, 1.00024414f,
                               1.00048828f};
    const float one = given[0];
    const float half_step = given[1]; /* 2^-24, half of the step of the numbers from 1 on */
    const float step = half_step + half_step;
    const float smallest = given[2]; /* 2^-126, the smallest normal number */
    const float subnormal = given[3]; /* 2^-140 */
    const float much = given[5]; /* 2^100 */
    const float root = given[6]; /* 1 + 2^-12; its square is 1 + 2^-11 in float, 2^-24 more if it is fused */
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
