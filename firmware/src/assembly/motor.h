/* Drive of a motor with one encoder, along a position, 3 states per encoder, 1 gain set, no delay, f32, T = 0.001 s.
 * Exported by version 0.1.0 of the library; do not edit, export it again. C99 and C++11, no library.
 *
 *     #include "this file"
 *     static motor_state state;                              once; zeros are right
 *     motor_sample sample = {0};                             in the timer interrupt, every T:
 *     motor_output output;
 *     sample.count = encoder();                         the low 14 bits are read; or sample.lost = true;
 *     sample.begin = where;  sample.end = where_next;    where it should be at both ends of the tick
 *     unsigned health = motor_tick_or_start(&state, &sample, &output);
 *     set_current(output.u);                             A
 *     motor_report_applied(&state, held);                    only if it holds another current, not a late one
 *     motor_limit(&state, most);                             only if the stage gives less than the design supposes
 *
 * The functions are in the file for the assembler beside this one, for a Cortex-M4F with arguments in float registers
 * (-mfloat-abi=hard). Their bits are those of the Rust tick and of the C file; the state has an order of its own.
 * State, sample and output must not overlap. An ordinary tick, every count there and believed, takes 163 cycles with
 * motor_tick_u and 182 with motor_tick, return included: counted from ARM's table of a Cortex-M4 (DDI 0439D), on no chip. No
 * order of these operations takes less than 155 and 168: the floor of docs/cycles.md.
 *
 * The same bits as the Rust tick need every operation rounded on its own. A fused multiply-add rounds a * b + c once,
 * which is another number (and takes longer on a Cortex-M4F): compile with -ffp-contract=off. This file asks for it by
 * itself where it can; with GCC that keeps motor_tick from being inlined unless the option is given too. Reordering
 * (-ffast-math and its parts) and more digits than f32 (x87) change bits as well.
 * Where the compiler says that it may do so this file does not compile. clang says it of -ffast-math and
 * -ffinite-math-only alone: there the file forbids reordering by itself, and nothing can see -fno-signed-zeros (part of
 * -funsafe-math-optimizations too), -fno-honor-nans and -fno-honor-infinities. Do not give them.
 *
 * FLOATING-POINT MODES assumed wherever the tick runs, be it main, an interrupt or a host program: rounding to nearest,
 * subnormal numbers kept, float computed as float. Of a Cortex-M: FPSCR with RMode = 00 and FZ = 0. An interrupt begins
 * with FPDSCR, not with the FPSCR of main, and needs FPCCR.ASPEN = 1 (all as after reset). Of x86: MXCSR without FTZ and
 * DAZ, which linking with -ffast-math sets. Call motor_modes_ok once at start-up, where the tick runs. Under other modes u
 * still stays within its limits and is a number; its bits are others.
 *
 * Design 0x1d4a6c60 (FNV-1a; `design_hash` in the run.json of a run).
 * Changed by --set drive.period_s=1e-3
 * Changed by --set drive.gain_sets=1
 * Scenario motor.toml (CRC-32 0xd1774fd8):
 *
 *     # What the image `motor` is designed from: a motor with one encoder, at 5 kHz.
 *     #
 *     #     cargo run --release -- live firmware/motor.toml --image firmware/target/thumbv7em-none-eabihf/release/motor
 *     #
 *     # The drive as assembly is that of 1 kHz with one gain set, as it is measured everywhere (src/bin/budget.rs):
 *     #     host-sim export motor.toml --asm --prefix motor -o src/assembly/motor.S --force \
 *     #         --set drive.period_s=1e-3 --set drive.gain_sets=1
 *
 *     title = "The motor of the image `motor`"
 *
 *     [motor]
 *     inertia_kg_m2 = 2e-4
 *     torque_n_m_per_a = 0.05
 *     max_current_a = 10.0
 *     damping_n_m_s = 1e-5
 *
 *     [encoder]
 *     bits = 14
 *
 *     [drive]
 *     period_s = 2e-4
 *     fallback = 0.0
 *
 *     [monitor]
 *     reaction = "brake"
 */
#ifdef MOTOR_ASSEMBLY
#if MOTOR_ASSEMBLY != 0x1b0cbf0eu
#error "two designs with the prefix motor, 0x1b0cbf0eu here and MOTOR_ASSEMBLY before: export one with another --prefix"
#define MOTOR_ASSEMBLY 0x1b0cbf0eu
#endif
#else
#define MOTOR_ASSEMBLY 0x1b0cbf0eu

#include <float.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

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
#define MOTOR_AS_WRITTEN
#elif defined(__clang__) && __clang_major__ >= 18
#define MOTOR_AS_WRITTEN _Pragma("clang fp contract(off) reassociate(off) reciprocal(off)")
#elif defined(__clang__) && __clang_major__ >= 14
#define MOTOR_AS_WRITTEN _Pragma("clang fp contract(off) reassociate(off)")
#else
#define MOTOR_AS_WRITTEN _Pragma("STDC FP_CONTRACT OFF")
#endif

#define MOTOR_VERSION "0.1.0"
#define MOTOR_DESIGN 0x1d4a6c60u /* log it: it tells designs apart */
#define MOTOR_PERIOD_S 0.001
#define MOTOR_MAX_CURRENT_A 10.0 /* of either sign */
#define MOTOR_DELAY_TICKS 0 /* from the tick that computes a current to the one that holds it */
#define MOTOR_INERTIA_KG_M2 0.0002 /* behind the gear, as all of the shaft */
#define MOTOR_TORQUE_N_M_PER_A 0.05
#define MOTOR_DAMPING_N_M_S 1e-5
#define MOTOR_ENCODER_BITS 14 /* on the shaft itself; counts up while the angle grows, 0 at angle 0 */
#define MOTOR_ENCODER_STATES 16384u /* of the counter; 0 for 2^32 */
#define MOTOR_ENCODER_COUNTS_PER_TURN 16384
#define MOTOR_ENCODER_UNIT_RAD 0.0003834951969714103 /* of the shaft, one count */
#define MOTOR_ENCODER_REVERSED 0
#define MOTOR_ENCODER_OFFSET_COUNTS 0

/* What a tick has to say about itself, as a set of bits. */
enum {
    MOTOR_OK = 0,
    MOTOR_INPUT_REJECTED = 1, /* no good sample yet, too many lost, a target that is no number: the fallback */
    MOTOR_SATURATED = 2, /* the law asked for more than the limits allow */
    MOTOR_SAMPLE_LOST = 8, /* a count was not there, or moved as no shaft can: the observer predicts */
    MOTOR_POSITION_STEPPED = 128, /* a missed tick or a slip: the position was taken from the counts anew */
    MOTOR_WAITS = 256, /* the counts do not agree with each other yet: no current until they do */
    /* what the monitors say of it */
    MOTOR_SIGMA_STAR_OVER_BOUND = 4,
    MOTOR_DISTURBANCE_OVER_BOUND = 16,
    MOTOR_STUCK_AT_LIMIT = 32,
    MOTOR_WRONG_WAY = 512, /* it speeds up against its current: an encoder or the phase order is reversed */
    MOTOR_OSCILLATES = 1024, /* the disturbance is over its bound to and fro: a limit cycle */
    MOTOR_BRAKES = 2048, /* after an alarm: the current opposes the speed, no target is followed */
    /* what its limits say */
    MOTOR_OVERSPEED = 4096,
    MOTOR_FOLLOWING_ERROR = 8192,
    MOTOR_END_OF_RANGE = 16384, /* beyond an end, or it must brake now */
    MOTOR_HUNTS = 32768, /* at rest it slips from one side of its target to the other: it is let be in a wider band */
    MOTOR_STOPPED = 64 /* nothing but the safe current goes out until the monitor is reset */
};

/* Where the shaft should be at an instant: 2 pi turn + r. Its derivatives must fit. */
typedef struct {
    int32_t turn; /* whole turns; it may wrap */
    float r; /* rad, best within a turn or two */
    float r_dot; /* rad/s */
} motor_target;

/* What a tick is given. */
typedef struct {
    uint32_t count; /* as the counter's register has it */
    bool lost; /* there is no count this time */
    motor_target begin; /* at the beginning of the tick in which u is held */
    motor_target end; /* and at its end */
} motor_sample;

typedef struct {
    float u; /* A, to hold until the next tick, within the limits */
    float sigma; /* how far from the reference, in the unit of its last derivative */
    float sigma_star; /* the same less what fades from the start */
} motor_output;

/* What the drive knows, of each shaft. */
typedef struct {
    int32_t turn; /* whole turns, to be added to the positions */
    float position; /* rad */
    float speed; /* rad/s */
    float disturbance; /* rad/s^2, what the model does not explain */
    float load; /* N m against the shaft: the same as a torque */
} motor_estimates_of;

/* What the drive remembers between two ticks. Zeros before the start. */
typedef struct {
    float held; /* what the actuator held since the last tick, A */
    float p; /* estimated position less that of its count */
    float v; /* estimated speed */
    float d; /* estimated disturbance, an acceleration */
    float reach; /* a sample is believed that is so much further off than the gate */
    float doubt; /* steps of the position lately, by their price; while it is fresh, agreements that are wanted */
    float limit; /* what the power stage gives at most, A */
    float reported; /* the last report that was clearly less than was put out, A; below 0 where the limit was set */
    float offset; /* W = sigma(0) e^(-alpha t) */
    uint32_t last; /* count of the last good sample */
    uint32_t at; /* the same since the base */
    uint32_t turn; /* turn of the base */
    float missed; /* counts that were not used, in a row */
    float off; /* how far the last of them was from its prediction */
    bool fresh; /* no tick has passed since the start */
    bool started;
} motor_state;

/* What one part of a tick tells the next. */
typedef struct {
    uint32_t begins;
    uint32_t missing;
    uint32_t stepped;
} motor_between;

/* The state as the assembly has it: a compiler that lays it out otherwise stops here. */
typedef char motor_state_is_laid_out[
    sizeof(motor_state) == 60 && offsetof(motor_state, fresh) == 56 && offsetof(motor_state, started) == 57 && sizeof(bool) == 1
    && offsetof(motor_sample, end) + sizeof(((motor_sample *)0)->end) == sizeof(motor_sample) ? 1 : -1];

#ifdef __cplusplus
extern "C" {
#endif

/* A count as the number with a sign that it is; a conversion would be for the compiler to define. */
static inline int32_t motor_signed(uint32_t count)
{
    const uint32_t below = 0xffffffffu - count;
    return (count < 0x80000000u) ? (int32_t)count : (-(int32_t)below - 1);
}

/* Part of the first tick after a start: the estimates are those of the sample already. False as long as
 * the drive waits for counts that agree with each other. */
bool motor_begin(motor_state *state, const motor_sample *sample, motor_between *between);

/* Part of a tick: what the counts should have moved, which of them are believed, and the observers. False
 * where more samples are missing in a row than can be bridged. */
bool motor_observe(motor_state *state, const motor_sample *sample, motor_between *between);

/* Part of a tick: the law, and the memory. */
unsigned motor_law(motor_state *state, const motor_sample *sample, const motor_between *between,
    motor_output *output);

/* Part of a tick, where nothing is known any more: the fallback goes out, and the observers start again
 * where the counts are. */
unsigned motor_give_up(motor_state *state, const motor_sample *sample, motor_output *output);

/* Part of a tick, where nobody says what to do: the fallback goes out. */
unsigned motor_refuse(motor_state *state, motor_output *output);

/* A period that passed without a tick. False where more is missing than can be foreseen. */
bool motor_pass(motor_state *state);

/* Part of a tick: the base follows the shaft by whole turns. */
void motor_follow(motor_state *state);

/* Part of a tick in which a count was missing: counts go along with the prediction, by quarters of the
 * counter. */
void motor_carry(motor_state *state);

/* The state before the first tick, from the sample that the first tick gets too: every count must be
 * there. Its angle is then within half a counter of 0. False, and the state as it was, if the sample is not good
 * enough: try the next one. */
bool motor_start(motor_state *state, const motor_sample *sample);

/* What goes out as long as there has been no good sample. */
unsigned motor_not_started(motor_output *output);

/* One tick: counts and targets in, current out. Call it once per period, with the counts read at its beginning. Returns
 * the health; output->u is good whatever the sample was. */
unsigned motor_tick(motor_state *state, const motor_sample *sample, motor_output *output);

/* The same tick, for a caller that reads u alone: returns it. */
float motor_tick_u(motor_state *state, const motor_sample *sample);

/* The tick of a drive that need not have started: good samples that agree with each other for 10.0 ticks
 * start it; until then the fallback goes out. Needs a state of zeros the first time. */
static inline unsigned motor_tick_or_start(motor_state *state, const motor_sample *sample, motor_output *output)
{
    if (!state->started) {
        if (!motor_start(state, sample)) {
            return motor_not_started(output);
        }
        state->doubt = 10.0f;
    }
    return motor_tick(state, sample, output);
}

/* The tick of a period in which there are neither counts nor targets: the observers predict, the fallback goes out. */
static inline unsigned motor_lost(motor_state *state, motor_output *output)
{
    if (!state->started) {
        return motor_not_started(output);
    }
    static const motor_sample nothing = {0u, true, {0, 0.0f, 0.0f}, {0, 0.0f, 0.0f}};
    motor_between between;
    unsigned health;
    if (state->fresh && (state->doubt > 0.0f)) {
        (void)motor_begin(state, &nothing, &between);
        return motor_not_started(output);
    }
    if (!state->fresh && !motor_observe(state, &nothing, &between)) {
        health = motor_give_up(state, &nothing, output);
    } else {
        health = motor_refuse(state, output);
    }
    motor_follow(state);
    motor_carry(state);
    return health;
}

/* So many periods have passed without a tick, the current held all the while: a missed timer interrupt that its
 * overflow flag or a time stamp tells of. Call it before the coming tick. They count as half of the samples that may
 * be missing at most. */
static inline void motor_missed(motor_state *state, uint32_t periods)
{
    uint32_t left = periods;
    while ((left > 0u) && state->started && !state->fresh && motor_pass(state)) {
        motor_follow(state);
        motor_carry(state);
        left--;
    }
    state->missed = (state->missed > 25.0f) ? 25.0f : state->missed;
}

/* From now on the power stage gives at most this current of either sign: it is hot, its supply is low, its brake
 * resistor is full. The law keeps to it. A start forgets it: call it before each tick. False for a number below 0 or
 * none, and before the start. */
static inline bool motor_limit(motor_state *state, float current)
{
    const bool is_taken = state->started && (current >= 0.0f);
    if (is_taken) {
        state->limit = current;
        state->reported = -1.0f;
    }
    return is_taken;
}

/* Tells what current the actuator really holds since the last tick, where that is not the u of the tick:
 * the only anti-windup, and needed. Call it before the next tick. Twice the same and clearly less than was put out is
 * taken for the limit of the stage, until some ticks have passed. A value that is not finite or beyond 1e12 is not
 * taken, nor any before the start, and the answer is false. */
bool motor_report_applied(motor_state *state, float u);

/* Estimates at the instant of the last tick. False, and zeros, before the start. */
bool motor_estimates(const motor_state *state, motor_estimates_of *estimates);

/* Forgets all but the design: the next good sample starts again. For the end of a fault. */
void motor_reset(motor_state *state);

#ifdef __cplusplus
}
#endif

/* MONITORS. A count that sticks while the shaft stands still looks like a load that u cancels: the loop runs away, and
 * no observer sees it. Where that does harm call motor_watched_tick and motor_watched_lost instead of motor_tick_or_start and
 * motor_lost. An alarm (any of SIGMA_STAR_OVER_BOUND, DISTURBANCE_OVER_BOUND, STUCK_AT_LIMIT, INPUT_REJECTED)
 * lets the drive brake on its estimated speed (MOTOR_BRAKES), as long as its counts can be believed; then, or at rest, the current is taken away (MOTOR_STOPPED), as the scenario has it.
 * WRONG_WAY and OSCILLATES stop the drive in any case. A drive that has stopped stays so until motor_watched_reset. */
typedef struct {
    bool stopped;
    float stuck; /* ticks at a limit without |sigma| falling, ten within the limits for each that is forgotten */
    float last_sigma; /* |sigma| at the last of them */
    float swings; /* ticks for which changes of side of a disturbance still count */
    float against; /* ticks in a row of the wrong way */
    float last_speed; /* |v| in the last tick at a limit */
    float over; /* ticks over a bound or without a sample, less those without */
    float braking; /* 1 and the ticks of braking within the limits without becoming slower */
    float most; /* the most that a brake asks for; 0 before its first tick, below 0 where it holds no load */
    float side; /* disturbance of the shaft when it was last over its bound */
    float rest_share; /* how much of the band at rest is in use, 0 to 1 */
    float rest_width; /* rad to either side, if it is wider than the least */
    float rest_side; /* on which side of its target it last stood outside the band */
    float rest_ticks; /* for which it has stood */
    float rest_error; /* its error where it last stood, rad */
} motor_monitor; /* zeros are right at the start */

static inline float motor_magnitude(float number)
{
    return (number < 0.0f) ? -number : number;
}

/* The safe current goes out from now on. */
static inline unsigned motor_watch_stop(motor_monitor *monitor, motor_output *output)
{
    motor_output safe;
    (void)motor_not_started(&safe);
    output->u = safe.u;
    monitor->stopped = true;
    return MOTOR_STOPPED;
}

/* So much less, but not below 0. */
static inline float motor_lessened(float number, float by)
{
    const float less = number - by;
    return (less > 0.0f) ? less : 0.0f;
}

/* Is d over its bound, and to the other side than when it was so before? */
static inline bool motor_watch_side(float d, float bound, float *side, bool *has_changed)
{
    if (motor_magnitude(d) <= bound) {
        return false;
    }
    *has_changed = *has_changed || ((d * *side) < 0.0f);
    *side = d;
    return true;
}

/* A tick at a limit of the current, and of what must fall there. */
static inline void motor_watch_limit(motor_monitor *monitor, const motor_state *state, float falling, float current, bool is_lost, bool over)
{
    const float wanted = 250.0f * current; /* acceleration by the current */
    const float speed = motor_magnitude(state->v);
    const float found = motor_magnitude(state->d);
    /* Does it speed up against the current, by what the current would do the other way round? */
    bool wrong_way = ((state->v * wanted) < 0.0f) && ((state->d * wanted) < 0.0f) &&
                     (speed > monitor->last_speed) && (found > (1.25f * motor_magnitude(wanted))) &&
                     (found < (3.5f * motor_magnitude(wanted)));
    if (wrong_way && over) {
        monitor->against += 1.0f;
    } else if (is_lost) {
        monitor->against += 0.5f; /* at full current nobody sees what it does */
    } else {
        monitor->against = 0.0f;
    }
    monitor->last_speed = speed;
    if (!(monitor->stuck > 0.0f) || (falling >= monitor->last_sigma)) {
        monitor->stuck += 1.0f;
    }
    monitor->last_sigma = falling;
}

/* A tick within the limits. */
static inline void motor_watch_within(motor_monitor *monitor)
{
    monitor->against = 0.0f;
    monitor->stuck = motor_lessened(monitor->stuck, 0.1f);
}

/* A tick over a bound or without a sample, or without either. */
static inline void motor_watch_over(motor_monitor *monitor, bool is_over)
{
    monitor->over = is_over ? (monitor->over + 1.0f) : motor_lessened(monitor->over, 1.0f);
}

/* The alarms that stop any drive, from the next tick on: this current is the law's. */
static inline unsigned motor_watch_runaway(motor_monitor *monitor)
{
    const bool wrong_way = monitor->against > 6.0f;
    const bool oscillates = monitor->swings > 400.0f;
    unsigned alarms = wrong_way ? (unsigned)MOTOR_WRONG_WAY : 0u;
    alarms |= oscillates ? (unsigned)MOTOR_OSCILLATES : 0u;
    monitor->swings = motor_lessened(monitor->swings, 1.0f);
    monitor->stopped = monitor->stopped || wrong_way || oscillates;
    return alarms;
}

/* From the next tick on it brakes. */
static inline void motor_watch_brakes(motor_monitor *monitor)
{
    monitor->braking = 1.0f;
    monitor->most = 0.0f; /* not known before the first tick of it */
    monitor->stuck = 0.0f;
    monitor->over = 0.0f;
}

/* What a tick of it shows. */
static inline void motor_watch_brake(motor_monitor *monitor, const motor_state *state, float speed, float asks, float slowing,
    bool is_short, bool is_blind)
{
    MOTOR_AS_WRITTEN
    bool has_changed = false;
    const bool over =
        motor_watch_side(state->d, 1031.25f, &monitor->side, &has_changed);
    if (!(motor_magnitude(state->d) <= 1546.875f)) {
        monitor->most = -motor_magnitude(monitor->most);
    }
    monitor->swings += has_changed ? 200.0f : 0.0f;
    if (is_short) {
        motor_watch_limit(monitor, state, speed, slowing, false, over);
        /* Faster than at the beginning: that is no brake. */
        if (asks > motor_magnitude(monitor->most)) {
            monitor->stuck = 200.0f + 1.0f;
        }
    } else {
        motor_watch_within(monitor);
        if (!((speed < monitor->last_sigma) && (asks > (0.0078125f * motor_magnitude(monitor->most))))) {
            monitor->braking += 1.0f;
        }
        monitor->last_sigma = speed;
    }
    motor_watch_over(monitor, is_blind);
}

/* A tick of a drive that brakes: the current opposes the speed, and the load within its bound. At a limit the speed must fall. */
static inline unsigned motor_brake(motor_monitor *monitor, motor_state *state, unsigned told, motor_output *output)
{
    MOTOR_AS_WRITTEN
    const unsigned blind = MOTOR_SAMPLE_LOST | MOTOR_INPUT_REJECTED;
    const float limit = motor_magnitude(state->limit);
    const float u_max = (10.0f > limit) ? limit : 10.0f;
    const float u_min = (-10.0f < -limit) ? -limit : -10.0f;
    const float speed = motor_magnitude(state->v);
    const float asks = motor_magnitude(0.25f * speed);
    float opposed = -(0.25f * state->v);
    const float load = (monitor->most > 0.0f) ? state->d : 0.0f;
    opposed -= 0.004f * load;
    const float asked = (motor_magnitude(opposed) <= 1e30f) ? opposed : 0.0f;
    float slowing = (asked > u_max) ? u_max : asked;
    slowing = (slowing < u_min) ? u_min : slowing;
    const bool is_short = slowing != asked;
    if (motor_magnitude(monitor->most) <= 0.0f) {
        const float most = (1.25f * asks) + (0.5f * (10.0f - (-10.0f)));
        monitor->most = (motor_magnitude(state->d) <= 1546.875f) ? most : -most;
    } else {
        motor_watch_brake(monitor, state, speed, asks, slowing, is_short, (told & blind) == blind);
    }
    const bool is_stuck = monitor->stuck > 200.0f;
    unsigned health = told | (is_stuck ? (unsigned)MOTOR_STUCK_AT_LIMIT : 0u);
    if (is_stuck || (monitor->over > 8.0f) || (monitor->braking > 64.0f)) {
        health |= motor_watch_stop(monitor, output);
    } else {
        state->held = slowing;
        state->offset = 0.0f;
        output->u = slowing;
        health &= ~(unsigned)MOTOR_SATURATED;
        health |= is_short ? (unsigned)(MOTOR_SATURATED | MOTOR_BRAKES) : (unsigned)MOTOR_BRAKES;
    }
    return health | motor_watch_runaway(monitor);
}

/* What the monitors say of a tick that was made; what follows is done. */
static inline unsigned motor_watch(motor_monitor *monitor, motor_state *state, unsigned told, motor_output *output)
{
    const bool is_lost = (told & MOTOR_SAMPLE_LOST) != 0u;
    const bool is_rejected = (told & MOTOR_INPUT_REJECTED) != 0u;
    bool has_changed = false;
    bool is_star_over = false;
    if (!state->started) {
        return told;
    }
    if ((told & MOTOR_WAITS) != 0u) {
        if (is_lost) { /* what was believed is given up */
            return told | motor_watch_stop(monitor, output);
        }
        return told;
    }
    if (monitor->braking > 0.0f) {
        return motor_brake(monitor, state, told, output);
    }
    const bool over =
        motor_watch_side(state->d, 1031.25f, &monitor->side, &has_changed);
    monitor->swings += has_changed ? 200.0f : 0.0f;
    if ((told & MOTOR_SATURATED) != 0u) {
        motor_watch_limit(monitor, state, motor_magnitude(output->sigma), output->u, is_lost, over);
    } else {
        motor_watch_within(monitor);
        is_star_over = !(motor_magnitude(output->sigma_star) <= 2.0733159f);
    }
    const bool is_any_over = over;
    motor_watch_over(monitor, is_any_over || is_star_over || is_rejected);
    const bool is_late = monitor->over > 8.0f;
    unsigned health = told;
    health |= (monitor->stuck > 200.0f) ? (unsigned)MOTOR_STUCK_AT_LIMIT : 0u;
    if (is_late) {
        health |= is_any_over ? (unsigned)MOTOR_DISTURBANCE_OVER_BOUND : 0u;
        health |= is_star_over ? (unsigned)MOTOR_SIGMA_STAR_OVER_BOUND : 0u;
    }
    /* A sample that is missing is an alarm after a while. */
    const unsigned alarms = is_late ? health : (health & ~(unsigned)MOTOR_INPUT_REJECTED);
    if ((alarms & 1589u) != 0u) {
        if (is_rejected && is_lost) {
            health |= motor_watch_stop(monitor, output);
        } else {
            /* To brake makes it worse if the shaft goes the wrong way: that is known in a few ticks. */
            if (!(monitor->against > 0.0f)) {
                motor_watch_brakes(monitor);
            }
        }
    }
    return health | motor_watch_runaway(monitor);
}

/* Does what follows an alarm, from the next tick on: for reasons of your own, a switch, a door. */
static inline void motor_watched_trip(motor_monitor *monitor)
{
    if (!(monitor->braking > 0.0f)) {
        motor_watch_brakes(monitor);
    }
}

/* AT REST friction holds the shaft, its current grows until it slips, and it sticks on the other side: it hunts. Within
 * a band around a target that rests the position error does not count. The band is 0.0003834952 rad to either side; where
 * the shaft slips from one side to the other it widens, to 0.0023009712 rad at most, until the target moves or
 * a load comes. motor_watched_tick hands on the target that this places; HUNTS says that the band is wider. */
static inline float motor_rest_shift(motor_monitor *monitor, float error, float speed)
{
    const float away = motor_magnitude(error);
    const float moved = motor_magnitude(error - monitor->rest_error);
    const bool is_slow = motor_magnitude(speed) < 0.033333335f;
    const bool is_near = moved <= 0.0003834952f;
    float width = (monitor->rest_width > 0.0003834952f) ? monitor->rest_width : 0.0003834952f;
    float within;
    monitor->rest_share += 0.17097089f * (1.0f - monitor->rest_share);
    if (!(is_slow || is_near)) {
        monitor->rest_ticks = 0.0f;
    } else {
        monitor->rest_ticks = (monitor->rest_ticks < 16.0f) ? (monitor->rest_ticks + 1.0f) : 16.0f;
    }
    if (is_slow || !is_near) {
        monitor->rest_error = error;
    }
    if (away > 0.007286409f) {
        width = 0.0003834952f; /* a load, no slip */
        monitor->rest_side = 0.0f;
    }
    const float stands_at = motor_magnitude(monitor->rest_error);
    if ((monitor->rest_ticks >= 16.0f) && (stands_at > width)) {
        const float side = (monitor->rest_error > 0.0f) ? 1.0f : -1.0f;
        if ((side * monitor->rest_side) < 0.0f) {
            const float grown = 1.5f * width;
            const float here = (1.25f * stands_at) + 0.0001917476f;
            const float wanted = (here > grown) ? here : grown;
            width = (wanted < 0.0023009712f) ? wanted : 0.0023009712f;
        }
        monitor->rest_side = side;
    }
    monitor->rest_width = width;
    /* Further out less and less of it: a load is answered as without a band. */
    const float left = width - (0.25f * (away - width));
    if (away <= width) {
        within = error;
    } else if (left > 0.0f) {
        within = (error > 0.0f) ? left : -left;
    } else {
        within = 0.0f;
    }
    return monitor->rest_share * within;
}

static inline void motor_rest_leave(motor_monitor *monitor)
{
    monitor->rest_share = 0.0f;
    monitor->rest_width = 0.0f;
    monitor->rest_side = 0.0f;
    monitor->rest_ticks = 0.0f;
    monitor->rest_error = 0.0f;
}

/* Moves a target that rests; any other it leaves as it is. */
static inline unsigned motor_rest(motor_monitor *monitor, const motor_state *state, motor_sample *sample)
{
    const motor_target *begin = &sample->begin;
    const motor_target *end = &sample->end;
    const bool stays = (begin->turn == end->turn) && (begin->r >= end->r) && (begin->r <= end->r);
    const bool is_still = (motor_magnitude(begin->r_dot) <= 0.0f) && (motor_magnitude(end->r_dot) <= 0.0f);
    if (!(state->started && stays && is_still)) {
        motor_rest_leave(monitor);
        return 0u;
    }
    motor_estimates_of known;
    (void)motor_estimates(state, &known);
    const uint32_t turns = (uint32_t)begin->turn - (uint32_t)known.turn;
    const float error = known.position - (((float)motor_signed(turns) * 6.2831855f) + begin->r);
    const float shift = motor_rest_shift(monitor, error, known.speed);
    sample->begin.r += shift;
    sample->end.r = sample->begin.r;
    return (monitor->rest_width > 0.0003834952f) ? (unsigned)MOTOR_HUNTS : 0u;
}

/* motor_tick_or_start within the monitors. */
static inline unsigned motor_watched_tick(motor_monitor *monitor, motor_state *state, const motor_sample *sample, motor_output *output)
{
    motor_sample placed = *sample;
    const unsigned hunts = motor_rest(monitor, state, &placed);
    if (monitor->stopped) {
        (void)motor_not_started(output);
        return MOTOR_INPUT_REJECTED | MOTOR_STOPPED;
    }
    unsigned health = motor_watch(monitor, state, motor_tick_or_start(state, &placed, output), output);
    health |= ((health & (unsigned)MOTOR_STOPPED) == 0u) ? hunts : 0u;
    return health;
}

/* motor_lost within the monitors. */
static inline unsigned motor_watched_lost(motor_monitor *monitor, motor_state *state, motor_output *output)
{
    if (monitor->stopped) {
        (void)motor_not_started(output);
        return MOTOR_INPUT_REJECTED | MOTOR_STOPPED;
    }
    return motor_watch(monitor, state, motor_lost(state, output), output);
}

/* After a stop: all is forgotten, and the next good sample starts the drive. */
static inline void motor_watched_reset(motor_monitor *monitor, motor_state *state)
{
    monitor->stopped = false;
    monitor->stuck = 0.0f;
    monitor->last_sigma = 0.0f;
    monitor->swings = 0.0f;
    monitor->against = 0.0f;
    monitor->last_speed = 0.0f;
    monitor->over = 0.0f;
    monitor->braking = 0.0f;
    monitor->most = 0.0f;
    motor_rest_leave(monitor);
    monitor->side = 0.0f;
    motor_reset(state);
}

/* What a plan takes over where it begins: a target with one more derivative, so that u does not step. */
typedef struct {
    int32_t turn;
    float r;
    float r_dot;
    float r_ddot;
} motor_jet;

/* Where a plan leads: to rest at 2 pi turn + angle, or along a sine about angle 0 whose phase is 0 at tick 0. */
typedef struct {
    int32_t turn;
    float angle; /* rad */
    float amplitude; /* rad */
    float omega; /* rad/s */
    uint32_t phase_per_tick; /* 2^-32 turns; 0: rest */
} motor_goal;

/* A plan: where the shaft should be at every tick. Ticks count from anywhere and may wrap. Zeros: rest at angle 0. */
typedef struct {
    motor_goal goal;
    uint32_t end; /* the tick from which on it is there */
    uint32_t ticks; /* of the way */
    float per_tick;
    float per_s;
    uint64_t share; /* 2^64/ticks */
    float power[2][6]; /* of the part that is done, and of the part that is left */
    uint64_t way[2][6]; /* the same in 2^-32 turns, modulo 2^64 */
} motor_plan;

/* Part of a plan: the jet of A sin at a phase in 2^-32 turns. */
static inline void motor_jet_of_sine(uint32_t phase, float amplitude, float omega, motor_jet *jet)
{
    MOTOR_AS_WRITTEN
    const float part = (float)motor_signed(phase) * 1.46291812e-9f;
    const bool holds = (part < (-1.57079637e0f)) || (part > 1.57079637e0f);
    const float part_2 = (3.14159274e0f - ((part < 0.0f) ? (-part) : (part + 0.0f))) + (-8.74227766e-8f);
    const float part_3 = holds ? ((part < 0.0f) ? (-part_2) : part_2) : part;
    const float part_4 = holds ? (-1.0f) : 1.0f;
    const float part_5 = part_3 * part_3;
    const float part_6 = 1.0f * part_3;
    const float part_7 = part_6
            + (part_6 * (part_5 * ((((((2.59986177e-6f * part_5) + (-1.98065289e-4f)) * part_5)
            + 8.33301619e-3f) * part_5) + (-1.66666567e-1f))));
    const float part_8 = amplitude * omega;
    jet->r = amplitude * part_7;
    jet->r_dot = part_8 * (part_4
            + (part_4 * (part_5 * ((((((2.31924023e-5f * part_5) + (-1.38558447e-3f)) * part_5)
            + 4.16639782e-2f) * part_5) + (-4.99999315e-1f)))));
    jet->r_ddot = (part_8 * omega) * (-part_7);
}

/* Part of a plan: what the way onto the goal adds to its jet. */
static inline void motor_join(const float power[6], uint32_t ticks, uint32_t rest, uint32_t early, float per_tick,
    float rate, float instant_s, motor_jet *jet)
{
    MOTOR_AS_WRITTEN
    const float part = (float)motor_signed(ticks) * per_tick;
    const float part_2 = power[5] * part;
    const float part_3 = part_2 + power[4];
    const float part_4 = part_2 + part_3;
    const float part_5 = (part_3 * part) + power[3];
    const float part_6 = (part_4 * part) + part_5;
    const float part_7 = (part_5 * part) + power[2];
    const float part_8 = (part_6 * part) + part_7;
    const float part_9 = (1.0f * rate) * 1.0f;
    const float part_10 = part_9 * ((part_8 * part) + ((part_7 * part) + power[1]));
    jet->r = jet->r
            + (((float)motor_signed(rest) * 1.46291812e-9f) + (((float)motor_signed(early) * instant_s) * part_10));
    jet->r_dot = jet->r_dot + part_10;
    jet->r_ddot = jet->r_ddot + (((part_9 * rate) * 2.0f) * (((((part_2 + part_4) * part) + part_6) * part) + part_8));
}

/* Part of a plan: the coefficients of a way that closes a gap in so many seconds. */
static inline void motor_powers_of_join(const double gap[3], double tau_s, double s[6],
    double left[6])
{
    MOTOR_AS_WRITTEN
    const double part = gap[0] * 1.0;
    const double part_2 = 1.0 * (tau_s / 1.0);
    const double part_3 = gap[1] * part_2;
    const double part_4 = part * 1.0;
    const double part_5 = (part * 3.0) + (part_3 * 1.0);
    const double part_6 = ((part * 6.0) + (part_3 * 3.0)) + ((gap[2] * (part_2 * (tau_s / 2.0))) * 1.0);
    const double s_0 = part_4 * 1.0;
    const double part_7 = part_5 * 1.0;
    const double left_5 = part_6 * 1.0;
    const double part_8 = part_5 * (-1.0);
    s[0] = s_0;
    s[1] = (part_4 * (-3.0)) + part_7;
    s[2] = ((part_4 * 3.0) + (part_5 * (-3.0))) + left_5;
    s[3] = ((part_4 * (-1.0)) + (part_5 * 3.0)) + (part_6 * (-3.0));
    s[4] = part_8 + (part_6 * 3.0);
    s[5] = part_6 * (-1.0);
    left[0] = 0.0;
    left[1] = 0.0;
    left[2] = 0.0;
    left[3] = (s_0 + part_7) + left_5;
    left[4] = part_8 + (part_6 * (-2.0));
    left[5] = left_5;
}

/* Part of a plan: a number that the drive would take. */
static inline bool motor_is_number(double number)
{
    return (number >= -1e12) && (number <= 1e12);
}

/* Part of a plan. */
static inline void motor_jet_of_goal(const motor_goal *goal, uint32_t tick, motor_jet *jet)
{
    if (goal->phase_per_tick != 0u) {
        jet->turn = 0;
        motor_jet_of_sine(goal->phase_per_tick * tick, goal->amplitude, goal->omega, jet);
    } else {
        jet->turn = goal->turn;
        jet->r = goal->angle;
        jet->r_dot = 0.0f;
        jet->r_ddot = 0.0f;
    }
}

/* Part of a plan: ticks until its goal is met, 0 if it is. The end is ahead for less than half of all ticks. */
static inline uint32_t motor_plan_left(const motor_plan *plan, uint32_t tick)
{
    const uint32_t left = plan->end - tick;
    return ((plan->ticks == 0u) || (left > 0x7fffffffu)) ? 0u : left;
}

/* Part of a plan: a sum in 2^-32 turns times s in 2^-32, of at most a half. */
static inline uint64_t motor_share(uint64_t sum, uint32_t s)
{
    const int64_t turns = (int64_t)motor_signed((uint32_t)(sum >> 32)) * (int64_t)motor_signed(s);
    return (uint64_t)turns + (((sum & 0xffffffffu) * (uint64_t)s) >> 32);
}

/* Part of a plan: a half of its way at a part of its ticks, added to the jet of its goal. The position is whole turns and
 * a rest, in 2^-32 turns: of a million turns it is as fine as of one. Its argument has 32 bits, rounded down, and is so
 * many 2^-32 ticks early. */
static inline void motor_go_along(const motor_plan *plan, uint32_t half, uint32_t part, motor_jet *jet)
{
    const uint32_t s = (uint32_t)(((uint64_t)part * plan->share) >> 32);
    const uint32_t early = 0u - (s * plan->ticks);
    const float rate = (half == 0u) ? plan->per_s : -plan->per_s;
    const float instant_s = (half == 0u) ? 2.3283065e-13f : -2.3283065e-13f;
    uint64_t sum = plan->way[half][5];
    sum = motor_share(sum, s) + plan->way[half][4];
    sum = motor_share(sum, s) + plan->way[half][3];
    sum = motor_share(sum, s) + plan->way[half][2];
    sum = motor_share(sum, s) + plan->way[half][1];
    sum = motor_share(sum, s) + plan->way[half][0];
    jet->turn = motor_signed((uint32_t)jet->turn + (uint32_t)(sum >> 32) + ((uint32_t)sum >> 31));
    motor_join(plan->power[half], part, (uint32_t)sum, early, plan->per_tick, rate, instant_s, jet);
}

/* Where a plan is at a tick, with all that another plan takes over from it; before its start where it begins. */
static inline void motor_plan_jet(const motor_plan *plan, uint32_t tick, motor_jet *jet)
{
    const uint32_t ahead = motor_plan_left(plan, tick);
    const uint32_t left = (ahead > plan->ticks) ? plan->ticks : ahead;
    motor_jet_of_goal(&plan->goal, (left == 0u) ? tick : (plan->end - left), jet);
    if (left != 0u) {
        const uint32_t done = plan->ticks - left;
        motor_go_along(plan, (done < left) ? 0u : 1u, (done < left) ? done : left, jet);
    }
}

/* The target at a tick. */
static inline void motor_plan_at(const motor_plan *plan, uint32_t tick, motor_target *target)
{
    motor_jet jet;
    motor_plan_jet(plan, tick, &jet);
    target->turn = jet.turn;
    target->r = jet.r;
    target->r_dot = jet.r_dot;
}

/* The same of a plan that is gone along: in the interrupt, once per tick, for its end. What is over stays so when ticks
 * have wrapped (2^32 of them are five days at 10 kHz). */
static inline void motor_plan_play(motor_plan *plan, uint32_t tick, motor_target *target)
{
    if (motor_plan_left(plan, tick) == 0u) {
        plan->ticks = 0u;
    }
    motor_plan_at(plan, tick, target);
}

/* Part of a plan: a coefficient of a way that has a place in 2^-32 turns. */
static inline bool motor_is_near(double rad)
{
    return (rad >= -6000000000.0) && (rad <= 6000000000.0);
}

/* Part of a plan: the nearest of 2^-32 turns, modulo 2^64. */
static inline uint64_t motor_units(double rad)
{
    const double units = rad * 683565275.5764316;
    return (uint64_t)(int64_t)((units < 0.0) ? (units - 0.5) : (units + 0.5));
}

/* Part of a plan: onto a goal. In double, hence not for the interrupt. */
static inline bool motor_plan_onto(motor_plan *plan, const motor_goal *goal, const motor_jet *present, uint32_t start,
    uint32_t ticks)
{
    MOTOR_AS_WRITTEN
    const double tau_s = (double)ticks * 0.001;
    uint32_t turns;
    double gap[3];
    double power[2][6];
    bool good = (ticks >= 1u) && (ticks <= 16777216u);
    motor_jet at;
    motor_jet_of_goal(goal, start, &at);
    turns = (uint32_t)present->turn - (uint32_t)at.turn;
    gap[0] = (double)present->r - (double)at.r;
    gap[1] = (double)present->r_dot - (double)at.r_dot;
    gap[2] = (double)present->r_ddot - (double)at.r_ddot;
    gap[0] += 6.283185307179586 * (double)motor_signed(turns);
    for (unsigned k = 0; k < 3u; k++) {
        good = good && motor_is_number(gap[k]);
    }
    motor_powers_of_join(gap, tau_s, power[0], power[1]);
    for (unsigned k = 0; k < 6u; k++) {
        good = good && motor_is_near(power[0][k]) && motor_is_near(power[1][k]);
    }
    if (!good) {
        return false;
    }
    plan->goal = *goal;
    plan->end = start + ticks;
    plan->ticks = ticks;
    plan->per_tick = (float)(1.0 / (double)ticks);
    plan->per_s = (float)(1.0 / tau_s);
    plan->share = UINT64_MAX / ticks;
    for (unsigned half = 0; half < 2u; half++) {
        for (unsigned k = 0; k < 6u; k++) {
            plan->power[half][k] = (float)power[half][k];
            plan->way[half][k] = motor_units(power[half][k]);
        }
    }
    return true;
}

/* The plan to be at rest at 2 pi turn + angle, always: for a start. The answer of this and of the next three is false,
 * and the plan as it was, if a number is none or beyond 1e12, the way leads some 10 million turns far, or the ticks are
 * not 1 to 2^24. They compute in double,
 * on most cores in software: make a plan outside of the interrupt, not the one that is being played, and hand it over
 * between two ticks. */
static inline bool motor_plan_rest(motor_plan *plan, int32_t turn, float angle)
{
    motor_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    if (!motor_is_number((double)angle)) {
        return false;
    }
    goal.turn = turn;
    goal.angle = angle;
    plan->goal = goal;
    plan->ticks = 0u;
    return true;
}

/* Plans a move to rest at 2 pi turn + angle, that begins at a tick with what is present then and takes so many ticks.
 * On the way, the present is that of the old plan at this tick (motor_plan_jet), never a measurement. Whether the current
 * and the supply suffice is not asked. */
static inline bool motor_plan_move(motor_plan *plan, const motor_jet *present, uint32_t start, uint32_t ticks, int32_t turn,
    float angle)
{
    motor_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    goal.turn = turn;
    goal.angle = angle;
    return motor_is_number((double)angle) && motor_plan_onto(plan, &goal, present, start, ticks);
}

/* Part of a stop: the way that it takes in so many ticks, and whether it goes back on it. The speed on the way is
 * (1 - s)^m (part[0] + part[1] s + ..). */
static inline bool motor_stop_goes_back(const motor_jet *present, uint32_t ticks, double *way)
{
    MOTOR_AS_WRITTEN
    const double tau_s = (double)ticks * 0.001;
    double part[2] = { (double)present->r_dot, (double)present->r_ddot };
    double scale = 1.0;
    double share = 1.0 / 3.0;
    bool forward = false;
    bool back = false;
    for (unsigned k = 0; k < 2u; k++) {
        part[k] = scale * part[k];
        scale = scale * (tau_s / (double)(k + 1u));
    }
    for (unsigned times = 0; times < 2u; times++) {
        for (unsigned k = 1; k < 2u; k++) {
            part[k] = part[k] + part[k - 1u];
        }
    }
    *way = 0.0;
    for (unsigned k = 0; k < 2u; k++) {
        forward = forward || (part[k] > 0.0);
        back = back || (part[k] < 0.0);
        *way = *way + (share * part[k]);
        share = share * ((double)(k + 1u) / (double)(k + 1u + 3u));
    }
    *way = tau_s * *way;
    return forward && back;
}

/* Plans to come to rest in so many ticks, and never back: at an even speed at half of the way that would have been
 * gone. Of a shaft that slows down already it takes fewer ticks where a longer stop would go back. */
static inline bool motor_plan_stop(motor_plan *plan, const motor_jet *present, uint32_t start, uint32_t ticks)
{
    MOTOR_AS_WRITTEN
    uint32_t taken = ticks;
    uint32_t too_many = ticks;
    double way;
    double angle;
    if ((ticks < 1u) || (ticks > 16777216u)) {
        return false;
    }
    if (motor_stop_goes_back(present, ticks, &way)) {
        taken = 1u;
        while ((taken + 1u) < too_many) {
            const uint32_t middle = taken + ((too_many - taken) / 2u);
            if (motor_stop_goes_back(present, middle, &way)) {
                too_many = middle;
            } else {
                taken = middle;
            }
        }
        (void)motor_stop_goes_back(present, taken, &way);
    }
    angle = (double)present->r + way;
    return motor_is_number(angle) && motor_plan_move(plan, present, start, taken, present->turn, (float)angle);
}

/* Plans a way onto A sin(omega t) about angle 0, the phase of which is 0 at tick 0. Omega is rounded to a whole number
 * of 2^-32 turns per tick, and must be at least that and less than half a turn per tick. */
static inline bool motor_plan_sine(motor_plan *plan, const motor_jet *present, uint32_t start, uint32_t ticks,
    double amplitude_rad, double omega_rad_s)
{
    MOTOR_AS_WRITTEN
    const double phase = (omega_rad_s * 0.001 / 6.283185307179586 * 4294967296.0) + 0.5;
    motor_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    if (!((phase >= 1.0) && (phase < 2147483648.0)) || !motor_is_number(amplitude_rad)) {
        return false;
    }
    goal.amplitude = (float)amplitude_rad;
    goal.phase_per_tick = (uint32_t)phase;
    goal.omega = (float)((double)goal.phase_per_tick / 4294967296.0 * 6.283185307179586 / 0.001);
    return motor_plan_onto(plan, &goal, present, start, ticks);
}

/* Part of a profile: a target from what its averages moved by in the last ticks and how far they are behind. */
static inline void motor_jet_of_profile(const uint32_t moved[4], const uint32_t behind[2], uint32_t rest, float part_rad,
    float per_s, motor_jet *jet)
{
    MOTOR_AS_WRITTEN
    const float part = ((float)motor_signed(moved[0]) * 4.29496730e9f) + (float)motor_signed(moved[1]);
    const float part_2 = ((float)motor_signed(moved[2]) * 4.29496730e9f) + (float)motor_signed(moved[3]);
    jet->r = ((float)motor_signed(rest) * 1.46291812e-9f)
            - (((((float)motor_signed(behind[0]) * 4.29496730e9f) + (float)motor_signed(behind[1]))
            + ((8.33333313e-1f * part) + (1.66666672e-1f * part_2))) * part_rad);
    jet->r_dot = ((0.5f * (part + part_2)) * part_rad) * per_s;
    jet->r_ddot = ((part - part_2) * part_rad) * (per_s * per_s);
}

/* PROFILE. Set-points that come at any time become targets within limits of speed, acceleration and jerk, without
 * overshoot: in the interrupt take the target of each tick from motor_profile_next, and give a goal whenever there is one.
 * The path is a mean over 2 windows of ticks: its jerk is at most 2 acceleration / (window period). Points of a
 * stream take a window of as many ticks as there are from one to the next; one that is late, comes twice or not at all
 * changes the path between them alone. Change a profile between two ticks, not while the interrupt makes one. */
#ifndef MOTOR_PROFILE_WINDOW
#define MOTOR_PROFILE_WINDOW 32u /* ticks of a window at most, 1 to 512; each takes 8 bytes of a profile */
#endif

typedef struct {
    uint64_t goal; /* 2^-32 turns, modulo 2^64, as all that follows */
    int64_t low; /* goals are taken between these */
    int64_t high;
    uint64_t base; /* where it is without averages */
    int32_t step; /* of the base in a tick, and how many whole accelerations that is */
    int32_t whole;
    int32_t fastest;
    int32_t fastest_whole;
    int32_t acceleration;
    int32_t steps[2u * MOTOR_PROFILE_WINDOW]; /* of the last windows; the oldest is at `oldest` */
    uint32_t oldest;
    uint32_t window;
    uint32_t all; /* window^2: so many times as large are those that follow */
    uint64_t sums[2]; /* the last is what the path moves by */
    uint64_t earlier[2];
    uint64_t behind; /* of the path behind the base */
    float part_rad;
} motor_profile;

/* Part of a profile. */
static inline int64_t motor_signed_long(uint64_t units)
{
    return (units <= 0x7fffffffffffffffu) ? (int64_t)units : (-(int64_t)(UINT64_MAX - units) - 1);
}

/* Part of a profile: 2 pi turn + rad, or what is nearest to it. */
static inline uint64_t motor_place(int32_t turn, double rad)
{
    const int64_t turns = (int64_t)turn * 4294967296;
    const int64_t rest = motor_signed_long(motor_units(rad));
    int64_t sum;
    if (rest >= 0) {
        sum = (turns > (9223372036854775807 - rest)) ? 9223372036854775807 : (turns + rest);
    } else {
        sum = (turns < (-9223372036854775807 - rest)) ? (-9223372036854775807 - 1) : (turns + rest);
    }
    return (uint64_t)sum;
}

/* Part of a profile: are these limits? */
static inline bool motor_profile_is_limit(double speed_rad_s, double acceleration_rad_s2)
{
    MOTOR_AS_WRITTEN
    return (speed_rad_s >= 1.4629180792671595e-6) && (speed_rad_s <= (1073741823.0 * 1.4629180792671595e-6)) &&
           (acceleration_rad_s2 >= 0.0014629180792671598) &&
           (acceleration_rad_s2 <= (1073741823.0 * 0.0014629180792671598));
}

/* Limits in motion too: above a lower speed it brakes as the acceleration has it. False, and nothing is changed, where a
 * limit is no number, or less than 2^-32 turns or more than a quarter of a turn per tick (or tick squared). */
static inline bool motor_profile_limit(motor_profile *profile, double speed_rad_s, double acceleration_rad_s2)
{
    MOTOR_AS_WRITTEN
    const bool good = motor_profile_is_limit(speed_rad_s, acceleration_rad_s2);
    if (good) {
        profile->fastest = (int32_t)(speed_rad_s / 1.4629180792671595e-6);
        profile->acceleration = (int32_t)(acceleration_rad_s2 / 0.0014629180792671598);
        profile->fastest_whole = profile->fastest / profile->acceleration;
        profile->whole = ((profile->step < 0) ? -profile->step : profile->step) / profile->acceleration;
    }
    return good;
}

/* Part of a profile. */
static inline void motor_profile_set_goal(motor_profile *profile, uint64_t place)
{
    const int64_t goal = motor_signed_long(place);
    const int64_t below = (goal < profile->high) ? goal : profile->high;
    profile->goal = (uint64_t)((below > profile->low) ? below : profile->low);
}

/* Keeps goals between 2 pi turn + rad of both from now on, and the present one. False, and nothing is changed, if an angle
 * is no number or the first is not the lower one. */
static inline bool motor_profile_keep_within(motor_profile *profile, int32_t low_turn, double low_rad, int32_t high_turn,
    double high_rad)
{
    int64_t low;
    int64_t high;
    if (!motor_is_near(low_rad) || !motor_is_near(high_rad)) {
        return false;
    }
    low = motor_signed_long(motor_place(low_turn, low_rad));
    high = motor_signed_long(motor_place(high_turn, high_rad));
    if (low > high) {
        return false;
    }
    profile->low = low;
    profile->high = high;
    motor_profile_set_goal(profile, profile->goal);
    return true;
}

/* Goes to 2 pi turn + rad, from where it is now. False if that is not within the range: it goes to its end; or if it is no
 * number: the goal stays. In double: some hundred cycles on most cores. */
static inline bool motor_profile_go_to(motor_profile *profile, int32_t turn, double rad)
{
    uint64_t goal;
    if (!motor_is_near(rad)) {
        return false;
    }
    goal = motor_place(turn, rad);
    motor_profile_set_goal(profile, goal);
    return profile->goal == goal;
}

/* Comes to rest as soon as it may. The path does not go back if it has not turned round in the last 2 windows. A
 * stop that ends beyond the range goes back to its end. */
static inline void motor_profile_stop(motor_profile *profile)
{
    const int64_t speed = (profile->step < 0) ? -(int64_t)profile->step : (int64_t)profile->step;
    const int64_t whole = (int64_t)profile->whole;
    const int64_t way = (whole * ((2 * speed) - ((int64_t)profile->acceleration * (whole + 1)))) / 2;
    const int64_t base = motor_signed_long(profile->base);
    profile->goal = profile->base + (uint64_t)((profile->step < 0) ? -way : way);
    /* Begun beyond the range it rests there. */
    if ((base >= profile->low) && (base <= profile->high)) {
        motor_profile_set_goal(profile, profile->goal);
    }
}

/* Begins anew at 2 pi turn + rad with a speed, and stops from there: where a shaft is that shall be caught. False, and
 * nothing is changed, if one is no number or the speed is more than a quarter of a turn per tick. */
static inline bool motor_profile_start(motor_profile *profile, int32_t turn, double rad, double speed_rad_s)
{
    MOTOR_AS_WRITTEN
    const double units = speed_rad_s / 1.4629180792671595e-6;
    int64_t step;
    if (!motor_is_near(rad) || !motor_is_near(speed_rad_s) || (units > 1073741823.0) || (units < -1073741823.0) ||
        (profile->acceleration < 1)) {
        return false;
    }
    step = (int64_t)((units < 0.0) ? (units - 0.5) : (units + 0.5));
    profile->step = (int32_t)step;
    profile->whole = ((profile->step < 0) ? -profile->step : profile->step) / profile->acceleration;
    for (uint32_t k = 0; k < (2u * MOTOR_PROFILE_WINDOW); k++) {
        profile->steps[k] = profile->step;
    }
    for (uint32_t k = 0; k < 1u; k++) {
        profile->sums[k] = 0u;
    }
    profile->sums[1] = (uint64_t)(step * (int64_t)profile->all);
    profile->earlier[0] = profile->sums[1];
    profile->earlier[1] = profile->sums[1];
    profile->behind = (uint64_t)(((step * (int64_t)profile->all) * (2 * ((int64_t)profile->window - 1))) / 2);
    profile->base = motor_place(turn, rad) + (uint64_t)(((step * 2) * (int64_t)profile->window) / 2);
    motor_profile_stop(profile);
    return true;
}

/* A profile at rest at angle 0. False, and nothing is changed, where motor_profile_limit is false or the window is not 1 to
 * MOTOR_PROFILE_WINDOW. */
static inline bool motor_profile_new(motor_profile *profile, double speed_rad_s, double acceleration_rad_s2, uint32_t window)
{
    MOTOR_AS_WRITTEN
    if ((window < 1u) || (window > MOTOR_PROFILE_WINDOW) || (window > 512u) ||
        !motor_profile_is_limit(speed_rad_s, acceleration_rad_s2)) {
        return false;
    }
    profile->step = 0;
    (void)motor_profile_limit(profile, speed_rad_s, acceleration_rad_s2);
    profile->low = -4611686018427387904;
    profile->high = 4611686018427387903;
    profile->oldest = 0u;
    profile->window = window;
    profile->all = window * window;
    profile->part_rad = (float)(1.4629180792671596e-9 / (double)profile->all);
    return motor_profile_start(profile, 0, 0.0, 0.0);
}

/* Is it at rest at its goal? */
static inline bool motor_profile_has_arrived(const motor_profile *profile)
{
    bool still = (profile->goal == profile->base) && (profile->step == 0) && (profile->behind == 0u) &&
                 (profile->earlier[0] == 0u) && (profile->earlier[1] == 0u);
    for (uint32_t k = 0; k < 2u; k++) {
        still = still && (profile->sums[k] == 0u);
    }
    return still;
}

/* Part of a profile: is a stop within a distance possible after a tick with this step? */
static inline bool motor_profile_stops(const motor_profile *profile, int64_t distance, int32_t step, int32_t whole)
{
    const int32_t twice = (2 * step) - (profile->acceleration * whole);
    return (((int64_t)whole + 1) * (int64_t)twice) <= (2 * distance);
}

/* Part of a profile: the next step of the base. Forward is towards the goal. */
static inline void motor_profile_advance(motor_profile *profile)
{
    const int64_t far = 2305843009213693952;
    const int64_t left = motor_signed_long(profile->goal - profile->base);
    const bool back = left < 0;
    const int64_t apart = back ? motor_signed_long(profile->base - profile->goal) : left;
    const int64_t distance = ((apart > far) ? far : ((apart < 0) ? 0 : apart));
    const int32_t fastest = profile->fastest;
    const int32_t acceleration = profile->acceleration;
    const int32_t step = back ? -profile->step : profile->step;
    int32_t whole = profile->whole;
    int32_t next;
    if (step < 0) {
        next = step + acceleration;
        if (next <= 0) {
            whole--;
        } else {
            next = (next < fastest) ? next : fastest;
            next = ((int64_t)next < distance) ? next : (int32_t)distance;
            whole = 0;
        }
    } else {
        const bool within = step <= fastest;
        int32_t up = within ? (step + acceleration) : (step - acceleration);
        int32_t up_whole = within ? (whole + 1) : (whole - 1);
        if ((up >= fastest) == within) {
            up = fastest;
            up_whole = profile->fastest_whole;
        }
        if (motor_profile_stops(profile, distance, up, up_whole)) {
            next = up;
            whole = up_whole;
        } else if (whole == 0) {
            next = (acceleration < fastest) ? acceleration : fastest;
            next = ((int64_t)next < distance) ? next : (int32_t)distance;
            whole = (next == acceleration) ? 1 : 0;
        } else if (within && motor_profile_stops(profile, distance, step, whole)) {
            next = step;
        } else {
            next = step - acceleration;
            whole--;
        }
    }
    profile->step = back ? -next : next;
    profile->whole = whole;
    profile->base = profile->base + (uint64_t)(int64_t)profile->step;
}

/* Part of a profile: the step of so many windows ago. */
static inline uint64_t motor_profile_before(const motor_profile *profile, uint32_t windows)
{
    const uint32_t length = 2u * profile->window;
    const uint32_t at = profile->oldest + ((2u - windows) * profile->window);
    return (uint64_t)(int64_t)profile->steps[(at < length) ? at : (at - length)];
}

/* Part of a profile: the nearest whole number and what is left of it in 2^-32. */
static inline void motor_profile_split(uint64_t units, uint32_t *number)
{
    number[0] = (uint32_t)(units >> 32) + ((uint32_t)units >> 31);
    number[1] = (uint32_t)units;
}

/* The target at the end of the coming tick: in the interrupt, once per tick. */
static inline void motor_profile_next(motor_profile *profile, motor_target *target)
{
    uint32_t moved[2 * 2];
    uint32_t behind[2];
    uint32_t base[2];
    uint64_t sum;
    motor_jet jet;
    motor_profile_advance(profile);
    sum = ((uint64_t)(int64_t)profile->step - (2u * motor_profile_before(profile, 1u))) + motor_profile_before(profile, 2u);
    profile->steps[profile->oldest] = profile->step;
    profile->oldest = ((profile->oldest + 1u) < (2u * profile->window)) ? (profile->oldest + 1u) : 0u;
    sum += profile->sums[0];
    profile->sums[0] = sum;
    sum += profile->sums[1];
    profile->sums[1] = sum;
    profile->behind += ((uint64_t)(int64_t)profile->step * profile->all) - sum;
    motor_profile_split(sum, &moved[0]);
    motor_profile_split(profile->earlier[0], &moved[2]);
    motor_profile_split(profile->behind, behind);
    motor_profile_split(profile->base, base);
    motor_jet_of_profile(moved, behind, base[1], profile->part_rad, 1000.0f, &jet);
    profile->earlier[1] = profile->earlier[0];
    profile->earlier[0] = sum;
    target->turn = motor_signed(base[0]);
    target->r = jet.r;
    target->r_dot = jet.r_dot;
}

/* Are the floating-point modes here and now those of the head? Call it once at start-up, where the tick runs: an
 * interrupt of a Cortex-M begins with the modes of FPDSCR, not with those of main. False where rounding is not to
 * nearest, subnormal numbers are flushed, or the compiler fuses, reorders or widens operations. No tick calls it. */
static inline bool motor_modes_ok(void)
{
    MOTOR_AS_WRITTEN
    volatile float given[8] = {1.0f, 5.9604645e-8f, 1.1754944e-38f, 7.1746481e-43f, 0.5f, 1.2676506e30f, 1.00024414f,
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
    volatile float half_of_it = smallest * given[4];
    bool good = ((one + half_step) <= one) && (((one + step) + half_step) >= (one + (step + step)));
    good = good && ((one + (0.75f * half_step)) <= one) && ((one - (0.25f * half_step)) >= one);
    good = good && ((-one - (0.75f * half_step)) >= -one);
    good = good && ((half_of_it + half_of_it) >= smallest) && ((subnormal * much) >= 9.094947e-13f);
    good = good && (((root * root) - given[7]) <= 0.0f) && (((one + (0.25f * step)) - one) <= 0.0f);
    good = good && !(none <= 0.0f) && !(none >= 0.0f);
    return good;
}

#undef MOTOR_AS_WRITTEN
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
#endif
