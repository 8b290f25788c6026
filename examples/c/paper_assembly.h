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
 * (DDI 0439D), measured on no chip. No order of these operations takes less than 139 and 157, the floor of
 * docs/cycles.md.
 *
 * Design 0xc5c7b46a (CRC-32, the one a target reports).
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
#if PAPER_ASSEMBLY != 0xc5c7b46au
#error "two designs with the prefix paper, 0xc5c7b46au here and PAPER_ASSEMBLY before: export one with another --prefix"
#define PAPER_ASSEMBLY 0xc5c7b46au
#endif
#else
#define PAPER_ASSEMBLY 0xc5c7b46au

#include <stdbool.h>
#include <stddef.h>

#define PAPER_VERSION "0.1.0"
#define PAPER_DESIGN 0xc5c7b46au /* log it: it tells designs apart */
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
#endif
