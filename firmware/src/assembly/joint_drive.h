/* Drive of a flexible joint with two encoders, along a position, 4 states per encoder, 1 gain set, no delay, f32, T = 0.001 s.
 * Exported by version 0.1.0 of the library; do not edit, export it again. C99 and C++11, no library.
 *
 *     #include "this file"
 *     static joint_drive_state state;                              once; zeros are right
 *     joint_drive_sample sample = {0};                             in the timer interrupt, every T:
 *     joint_drive_output output;
 *     sample.count_link = encoder_link();               the low 20 bits are read; or sample.lost_link = true;
 *     sample.count_motor = encoder_motor();             the low 20 bits are read; or sample.lost_motor = true;
 *     sample.begin = where;  sample.end = where_next;    where it should be at both ends of the tick
 *     unsigned health = joint_drive_tick_or_start(&state, &sample, &output);
 *     set_current(output.u);                             A
 *     joint_drive_report_applied(&state, held);                    only if it holds another current, not a late one
 *     joint_drive_limit(&state, most);                             only if the stage gives less than the design supposes
 *
 * The functions are in the file for the assembler beside this one, for a Cortex-M4F with arguments in float registers
 * (-mfloat-abi=hard). Their bits are those of the Rust tick and of the C file; the state has an order of its own.
 * State, sample and output must not overlap. An ordinary tick, every count there and believed, takes 461 cycles with
 * joint_drive_tick_u and 463 with joint_drive_tick, return included: counted from ARM's table of a Cortex-M4 (DDI 0439D), on no chip. No
 * order of these operations takes less than 380 and 393: the floor of docs/cycles.md.
 *
 * The same bits as the Rust tick need every operation rounded on its own. A fused multiply-add rounds a * b + c once,
 * which is another number (and takes longer on a Cortex-M4F): compile with -ffp-contract=off. This file asks for it by
 * itself where it can; with GCC that keeps joint_drive_tick from being inlined unless the option is given too. Reordering
 * (-ffast-math and its parts) and more digits than f32 (x87) change bits as well.
 * Where the compiler says that it may do so this file does not compile. clang says it of -ffast-math and
 * -ffinite-math-only alone: there the file forbids reordering by itself, and nothing can see -fno-signed-zeros (part of
 * -funsafe-math-optimizations too), -fno-honor-nans and -fno-honor-infinities. Do not give them.
 *
 * FLOATING-POINT MODES assumed wherever the tick runs, be it main, an interrupt or a host program: rounding to nearest,
 * subnormal numbers kept, float computed as float. Of a Cortex-M: FPSCR with RMode = 00 and FZ = 0. An interrupt begins
 * with FPDSCR, not with the FPSCR of main, and needs FPCCR.ASPEN = 1 (all as after reset). Of x86: MXCSR without FTZ and
 * DAZ, which linking with -ffast-math sets. Call joint_drive_modes_ok once at start-up, where the tick runs. Under other modes u
 * still stays within its limits and is a number; its bits are others.
 *
 * Design 0x8b62323f (FNV-1a; `design_hash` in the run.json of a run).
 * Changed by --set drive.period_s=1e-3
 * Changed by --set drive.gain_sets=1
 * Scenario drive.toml (CRC-32 0x0fd442c8):
 *
 *     # What the image `drive` is designed from: a joint with an encoder on each side, at 4 kHz.
 *     #
 *     #     cargo run --release -- live firmware/drive.toml
 *     #
 *     # The drive as assembly is that of 1 kHz with one gain set, as it is measured everywhere (src/bin/budget.rs):
 *     #     host-sim export drive.toml --asm --prefix joint_drive -o src/assembly/joint_drive.S --force \
 *     #         --set drive.period_s=1e-3 --set drive.gain_sets=1
 *
 *     title = "The joint of the image `drive`"
 *
 *     [joint]
 *     link_inertia_kg_m2 = 0.23
 *     motor_inertia_kg_m2 = 931e-6
 *     stiffness_n_m = 9.0
 *     torque_n_m_per_a = 0.119
 *     max_current_a = 30.0
 *     link_damping_n_m_s = 0.07
 *     motor_damping_n_m_s = 0.07
 *     weight_n_m = 0.23
 *
 *     [encoder.link]
 *     bits = 20
 *
 *     [encoder.motor]
 *     bits = 20
 *
 *     [drive]
 *     period_s = 2.5e-4
 *     gain_sets = 2  # the type of its law, however little is known
 *     sudden_load_n_m = 1.3
 *     fallback = 0.0
 *
 *     [monitor]
 *     reaction = "brake"
 */
#ifdef JOINT_DRIVE_ASSEMBLY
#if JOINT_DRIVE_ASSEMBLY != 0xb7b3597cu
#error "two designs with the prefix joint_drive, 0xb7b3597cu here and JOINT_DRIVE_ASSEMBLY before: export one with another --prefix"
#define JOINT_DRIVE_ASSEMBLY 0xb7b3597cu
#endif
#else
#define JOINT_DRIVE_ASSEMBLY 0xb7b3597cu

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
#define JOINT_DRIVE_AS_WRITTEN
#elif defined(__clang__) && __clang_major__ >= 18
#define JOINT_DRIVE_AS_WRITTEN _Pragma("clang fp contract(off) reassociate(off) reciprocal(off)")
#elif defined(__clang__) && __clang_major__ >= 14
#define JOINT_DRIVE_AS_WRITTEN _Pragma("clang fp contract(off) reassociate(off)")
#else
#define JOINT_DRIVE_AS_WRITTEN _Pragma("STDC FP_CONTRACT OFF")
#endif

#define JOINT_DRIVE_VERSION "0.1.0"
#define JOINT_DRIVE_DESIGN 0x8b62323fu /* log it: it tells designs apart */
#define JOINT_DRIVE_PERIOD_S 0.001
#define JOINT_DRIVE_MAX_CURRENT_A 30.0 /* of either sign */
#define JOINT_DRIVE_DELAY_TICKS 0 /* from the tick that computes a current to the one that holds it */
#define JOINT_DRIVE_ENCODER_LINK_BITS 20 /* on the shaft itself; counts up while the angle grows, 0 at angle 0 */
#define JOINT_DRIVE_ENCODER_LINK_STATES 1048576u /* of the counter; 0 for 2^32 */
#define JOINT_DRIVE_ENCODER_LINK_COUNTS_PER_TURN 1048576
#define JOINT_DRIVE_ENCODER_LINK_UNIT_RAD 5.992112452678286e-6 /* of the shaft, one count */
#define JOINT_DRIVE_ENCODER_LINK_REVERSED 0
#define JOINT_DRIVE_ENCODER_LINK_OFFSET_COUNTS 0
#define JOINT_DRIVE_ENCODER_MOTOR_BITS 20 /* on the shaft itself; counts up while the angle grows, 0 at angle 0 */
#define JOINT_DRIVE_ENCODER_MOTOR_STATES 1048576u /* of the counter; 0 for 2^32 */
#define JOINT_DRIVE_ENCODER_MOTOR_COUNTS_PER_TURN 1048576
#define JOINT_DRIVE_ENCODER_MOTOR_UNIT_RAD 5.992112452678286e-6 /* of the shaft, one count */
#define JOINT_DRIVE_ENCODER_MOTOR_REVERSED 0
#define JOINT_DRIVE_ENCODER_MOTOR_OFFSET_COUNTS 0

/* What a tick has to say about itself, as a set of bits. */
enum {
    JOINT_DRIVE_OK = 0,
    JOINT_DRIVE_INPUT_REJECTED = 1, /* no good sample yet, too many lost, a target that is no number: the fallback */
    JOINT_DRIVE_SATURATED = 2, /* the law asked for more than the limits allow */
    JOINT_DRIVE_SAMPLE_LOST = 8, /* a count was not there, or moved as no shaft can: the observer predicts */
    JOINT_DRIVE_POSITION_STEPPED = 128, /* a missed tick or a slip: the position was taken from the counts anew */
    JOINT_DRIVE_WAITS = 256, /* the counts do not agree with each other yet: no current until they do */
    /* what the monitors say of it */
    JOINT_DRIVE_SIGMA_STAR_OVER_BOUND = 4,
    JOINT_DRIVE_DISTURBANCE_OVER_BOUND = 16,
    JOINT_DRIVE_STUCK_AT_LIMIT = 32,
    JOINT_DRIVE_WRONG_WAY = 512, /* it speeds up against its current: an encoder or the phase order is reversed */
    JOINT_DRIVE_OSCILLATES = 1024, /* the disturbance is over its bound to and fro: a limit cycle */
    JOINT_DRIVE_BRAKES = 2048, /* after an alarm: the current opposes the speed, no target is followed */
    /* what its limits say */
    JOINT_DRIVE_OVERSPEED = 4096,
    JOINT_DRIVE_FOLLOWING_ERROR = 8192,
    JOINT_DRIVE_END_OF_RANGE = 16384, /* beyond an end, or it must brake now */
    JOINT_DRIVE_HUNTS = 32768, /* at rest it slips from one side of its target to the other: it is let be in a wider band */
    JOINT_DRIVE_STOPPED = 64 /* nothing but the safe current goes out until the monitor is reset */
};

/* Where the shaft should be at an instant: 2 pi turn + r. Its derivatives must fit. */
typedef struct {
    int32_t turn; /* whole turns; it may wrap */
    float r; /* rad, best within a turn or two */
    float r_dot; /* rad/s */
    float r_ddot; /* rad/s^2 */
    float r_dddot; /* rad/s^3 */
} joint_drive_target;

/* What a tick is given. */
typedef struct {
    uint32_t count_link; /* as the counter's register has it */
    uint32_t count_motor; /* as the counter's register has it */
    bool lost_link; /* there is no count this time */
    bool lost_motor; /* there is no count this time */
    joint_drive_target begin; /* at the beginning of the tick in which u is held */
    joint_drive_target end; /* and at its end */
} joint_drive_sample;

typedef struct {
    float u; /* A, to hold until the next tick, within the limits */
    float sigma; /* how far from the reference, in the unit of its last derivative */
    float sigma_star; /* the same less what fades from the start */
} joint_drive_output;

/* What the drive knows, of each shaft. */
typedef struct {
    int32_t turn; /* whole turns, to be added to the positions */
    float position_link; /* rad */
    float speed_link; /* rad/s */
    float disturbance_link; /* rad/s^2, what the model does not explain */
    float load_link; /* N m against the shaft: the same as a torque */
    float position_motor; /* rad */
    float speed_motor; /* rad/s */
    float disturbance_motor; /* rad/s^2, what the model does not explain */
    float load_motor; /* N m against the shaft: the same as a torque */
} joint_drive_estimates_of;

/* What the drive remembers between two ticks. Zeros before the start. */
typedef struct {
    float held; /* what the actuator held since the last tick, A */
    float offset; /* W = sigma(0) e^(-alpha t) */
    float push_link; /* half the coupling at the last tick */
    float p_link; /* estimated position less that of its count */
    float v_link; /* estimated speed */
    float d_link; /* estimated disturbance, an acceleration */
    float d_dot_link; /* its rate */
    float push_motor; /* half the coupling at the last tick */
    float p_motor; /* estimated position less that of its count */
    float v_motor; /* estimated speed */
    float d_motor; /* estimated disturbance, an acceleration */
    float d_dot_motor; /* its rate */
    float reach; /* a sample is believed that is so much further off than the gate */
    float doubt; /* steps of the position lately, by their price; while it is fresh, agreements that are wanted */
    float limit; /* what the power stage gives at most, A */
    float reported; /* the last report that was clearly less than was put out, A; below 0 where the limit was set */
    uint32_t last_link; /* count of the last good sample */
    uint32_t last_motor; /* count of the last good sample */
    uint32_t at_link; /* the same since the base */
    uint32_t at_motor; /* the same since the base */
    uint32_t turn; /* turn of the base */
    float missed_link; /* counts that were not used, in a row */
    float missed_motor; /* counts that were not used, in a row */
    float off_link; /* how far the last of them was from its prediction */
    float off_motor; /* how far the last of them was from its prediction */
    bool fresh; /* no tick has passed since the start */
    bool started;
} joint_drive_state;

/* What one part of a tick tells the next. */
typedef struct {
    uint32_t begins;
    float g_sin; /* g sin, g cos of the link */
    float g_cos; /* g sin, g cos of the link */
    uint32_t missing;
    uint32_t stepped;
} joint_drive_between;

/* The state as the assembly has it: a compiler that lays it out otherwise stops here. */
typedef char joint_drive_state_is_laid_out[
    sizeof(joint_drive_state) == 104 && offsetof(joint_drive_state, fresh) == 100 && offsetof(joint_drive_state, started) == 101 && sizeof(bool) == 1
    && offsetof(joint_drive_sample, end) + sizeof(((joint_drive_sample *)0)->end) == sizeof(joint_drive_sample) ? 1 : -1];

#ifdef __cplusplus
extern "C" {
#endif

/* A count as the number with a sign that it is; a conversion would be for the compiler to define. */
static inline int32_t joint_drive_signed(uint32_t count)
{
    const uint32_t below = 0xffffffffu - count;
    return (count < 0x80000000u) ? (int32_t)count : (-(int32_t)below - 1);
}

/* Part of the first tick after a start: the estimates are those of the sample already. False as long as
 * the drive waits for counts that agree with each other. */
bool joint_drive_begin(joint_drive_state *state, const joint_drive_sample *sample, joint_drive_between *between);

/* Part of a tick: what the counts should have moved, which of them are believed, and the observers. False
 * where more samples are missing in a row than can be bridged. */
bool joint_drive_observe(joint_drive_state *state, const joint_drive_sample *sample, joint_drive_between *between);

/* Part of a tick: the law, and the memory. */
unsigned joint_drive_law(joint_drive_state *state, const joint_drive_sample *sample, const joint_drive_between *between,
    joint_drive_output *output);

/* Part of a tick, where nothing is known any more: the fallback goes out, and the observers start again
 * where the counts are. */
unsigned joint_drive_give_up(joint_drive_state *state, const joint_drive_sample *sample, joint_drive_output *output);

/* Part of a tick, where nobody says what to do: the fallback goes out. */
unsigned joint_drive_refuse(joint_drive_state *state, joint_drive_output *output);

/* A period that passed without a tick. False where more is missing than can be foreseen. */
bool joint_drive_pass(joint_drive_state *state);

/* Part of a tick: the base follows the shaft by whole turns. */
void joint_drive_follow(joint_drive_state *state);

/* Part of a tick in which a count was missing: counts go along with the prediction, by quarters of the
 * counter. */
void joint_drive_carry(joint_drive_state *state);

/* The state before the first tick, from the sample that the first tick gets too: every count must be
 * there. Its angle is then within half a counter of 0. False, and the state as it was, if the sample is not good
 * enough: try the next one. */
bool joint_drive_start(joint_drive_state *state, const joint_drive_sample *sample);

/* What goes out as long as there has been no good sample. */
unsigned joint_drive_not_started(joint_drive_output *output);

/* One tick: counts and targets in, current out. Call it once per period, with the counts read at its beginning. Returns
 * the health; output->u is good whatever the sample was. */
unsigned joint_drive_tick(joint_drive_state *state, const joint_drive_sample *sample, joint_drive_output *output);

/* The same tick, for a caller that reads u alone: returns it. */
float joint_drive_tick_u(joint_drive_state *state, const joint_drive_sample *sample);

/* The tick of a drive that need not have started: good samples that agree with each other for 10.0 ticks
 * start it; until then the fallback goes out. Needs a state of zeros the first time. */
static inline unsigned joint_drive_tick_or_start(joint_drive_state *state, const joint_drive_sample *sample, joint_drive_output *output)
{
    if (!state->started) {
        if (!joint_drive_start(state, sample)) {
            return joint_drive_not_started(output);
        }
        state->doubt = 10.0f;
    }
    return joint_drive_tick(state, sample, output);
}

/* The tick of a period in which there are neither counts nor targets: the observers predict, the fallback goes out. */
static inline unsigned joint_drive_lost(joint_drive_state *state, joint_drive_output *output)
{
    if (!state->started) {
        return joint_drive_not_started(output);
    }
    static const joint_drive_sample nothing = {0u, 0u, true, true, {0, 0.0f, 0.0f, 0.0f, 0.0f}, {0, 0.0f, 0.0f, 0.0f, 0.0f}};
    joint_drive_between between;
    unsigned health;
    if (state->fresh && (state->doubt > 0.0f)) {
        (void)joint_drive_begin(state, &nothing, &between);
        return joint_drive_not_started(output);
    }
    if (!state->fresh && !joint_drive_observe(state, &nothing, &between)) {
        health = joint_drive_give_up(state, &nothing, output);
    } else {
        health = joint_drive_refuse(state, output);
    }
    joint_drive_follow(state);
    joint_drive_carry(state);
    return health;
}

/* So many periods have passed without a tick, the current held all the while: a missed timer interrupt that its
 * overflow flag or a time stamp tells of. Call it before the coming tick. They count as half of the samples that may
 * be missing at most. */
static inline void joint_drive_missed(joint_drive_state *state, uint32_t periods)
{
    uint32_t left = periods;
    while ((left > 0u) && state->started && !state->fresh && joint_drive_pass(state)) {
        joint_drive_follow(state);
        joint_drive_carry(state);
        left--;
    }
    state->missed_link = (state->missed_link > 25.0f) ? 25.0f : state->missed_link;
    state->missed_motor = (state->missed_motor > 25.0f) ? 25.0f : state->missed_motor;
}

/* From now on the power stage gives at most this current of either sign: it is hot, its supply is low, its brake
 * resistor is full. The law keeps to it. A start forgets it: call it before each tick. False for a number below 0 or
 * none, and before the start. */
static inline bool joint_drive_limit(joint_drive_state *state, float current)
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
bool joint_drive_report_applied(joint_drive_state *state, float u);

/* Estimates at the instant of the last tick. False, and zeros, before the start. */
bool joint_drive_estimates(const joint_drive_state *state, joint_drive_estimates_of *estimates);

/* Forgets all but the design: the next good sample starts again. For the end of a fault. */
void joint_drive_reset(joint_drive_state *state);

#ifdef __cplusplus
}
#endif

/* MONITORS. A count that sticks while the shaft stands still looks like a load that u cancels: the loop runs away, and
 * no observer sees it. Where that does harm call joint_drive_watched_tick and joint_drive_watched_lost instead of joint_drive_tick_or_start and
 * joint_drive_lost. An alarm (any of SIGMA_STAR_OVER_BOUND, DISTURBANCE_OVER_BOUND, STUCK_AT_LIMIT, INPUT_REJECTED)
 * lets the drive brake on its estimated speed (JOINT_DRIVE_BRAKES), as long as its counts can be believed; then, or at rest, the current is taken away (JOINT_DRIVE_STOPPED), as the scenario has it.
 * WRONG_WAY and OSCILLATES stop the drive in any case. A drive that has stopped stays so until joint_drive_watched_reset. */
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
    float side_link; /* disturbance of the shaft when it was last over its bound */
    float side_motor; /* disturbance of the shaft when it was last over its bound */
} joint_drive_monitor; /* zeros are right at the start */

static inline float joint_drive_magnitude(float number)
{
    return (number < 0.0f) ? -number : number;
}

/* The safe current goes out from now on. */
static inline unsigned joint_drive_watch_stop(joint_drive_monitor *monitor, joint_drive_output *output)
{
    joint_drive_output safe;
    (void)joint_drive_not_started(&safe);
    output->u = safe.u;
    monitor->stopped = true;
    return JOINT_DRIVE_STOPPED;
}

/* So much less, but not below 0. */
static inline float joint_drive_lessened(float number, float by)
{
    const float less = number - by;
    return (less > 0.0f) ? less : 0.0f;
}

/* Is d over its bound, and to the other side than when it was so before? */
static inline bool joint_drive_watch_side(float d, float bound, float *side, bool *has_changed)
{
    if (joint_drive_magnitude(d) <= bound) {
        return false;
    }
    *has_changed = *has_changed || ((d * *side) < 0.0f);
    *side = d;
    return true;
}

/* A tick at a limit of the current, and of what must fall there. */
static inline void joint_drive_watch_limit(joint_drive_monitor *monitor, const joint_drive_state *state, float falling, float current, bool is_lost, bool over_link, bool over_motor)
{
    const float wanted = 5001.6343f * current; /* acceleration by the current */
    const float speed = joint_drive_magnitude(state->v_motor);
    const float found = joint_drive_magnitude(state->d_motor);
    /* Does it speed up against the current, by what the current would do the other way round? */
    bool wrong_way = ((state->v_motor * wanted) < 0.0f) && ((state->d_motor * wanted) < 0.0f) &&
                     (speed > monitor->last_speed) && (found > (1.25f * joint_drive_magnitude(wanted))) &&
                     (found < (3.5f * joint_drive_magnitude(wanted)));
    /* Or do the shafts disagree about the spring between them? */
    wrong_way = wrong_way ||
                (over_link && ((state->d_link * state->d_motor) < 0.0f) && (found > joint_drive_magnitude(wanted)));
    if (wrong_way && over_motor) {
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
static inline void joint_drive_watch_within(joint_drive_monitor *monitor)
{
    monitor->against = 0.0f;
    monitor->stuck = joint_drive_lessened(monitor->stuck, 0.1f);
}

/* A tick over a bound or without a sample, or without either. */
static inline void joint_drive_watch_over(joint_drive_monitor *monitor, bool is_over)
{
    monitor->over = is_over ? (monitor->over + 1.0f) : joint_drive_lessened(monitor->over, 1.0f);
}

/* The alarms that stop any drive, from the next tick on: this current is the law's. */
static inline unsigned joint_drive_watch_runaway(joint_drive_monitor *monitor)
{
    const bool wrong_way = monitor->against > 6.0f;
    const bool oscillates = monitor->swings > 400.0f;
    unsigned alarms = wrong_way ? (unsigned)JOINT_DRIVE_WRONG_WAY : 0u;
    alarms |= oscillates ? (unsigned)JOINT_DRIVE_OSCILLATES : 0u;
    monitor->swings = joint_drive_lessened(monitor->swings, 1.0f);
    monitor->stopped = monitor->stopped || wrong_way || oscillates;
    return alarms;
}

/* From the next tick on it brakes. */
static inline void joint_drive_watch_brakes(joint_drive_monitor *monitor)
{
    monitor->braking = 1.0f;
    monitor->most = 0.0f; /* not known before the first tick of it */
    monitor->stuck = 0.0f;
    monitor->over = 0.0f;
}

/* What a tick of it shows. */
static inline void joint_drive_watch_brake(joint_drive_monitor *monitor, const joint_drive_state *state, float speed, float asks, float slowing,
    bool is_short, bool is_blind)
{
    JOINT_DRIVE_AS_WRITTEN
    bool has_changed = false;
    const bool over_link =
        joint_drive_watch_side(state->d_link, 10.483162f, &monitor->side_link, &has_changed);
    const bool over_motor =
        joint_drive_watch_side(state->d_motor, 103158.71f, &monitor->side_motor, &has_changed);
    monitor->swings += has_changed ? 200.0f : 0.0f;
    if (is_short) {
        joint_drive_watch_limit(monitor, state, speed, slowing, false, over_link, over_motor);
        /* Faster than at the beginning: that is no brake. */
        if (asks > joint_drive_magnitude(monitor->most)) {
            monitor->stuck = 200.0f + 1.0f;
        }
    } else {
        joint_drive_watch_within(monitor);
        if (!((speed < monitor->last_sigma) && (asks > (0.0078125f * joint_drive_magnitude(monitor->most))))) {
            monitor->braking += 1.0f;
        }
        monitor->last_sigma = speed;
    }
    joint_drive_watch_over(monitor, is_blind);
}

/* A tick of a drive that brakes: the current opposes the speed. At a limit the speed must fall. */
static inline unsigned joint_drive_brake(joint_drive_monitor *monitor, joint_drive_state *state, unsigned told, joint_drive_output *output)
{
    JOINT_DRIVE_AS_WRITTEN
    const unsigned blind = JOINT_DRIVE_SAMPLE_LOST | JOINT_DRIVE_INPUT_REJECTED;
    const float limit = joint_drive_magnitude(state->limit);
    const float u_max = (30.0f > limit) ? limit : 30.0f;
    const float u_min = (-30.0f < -limit) ? -limit : -30.0f;
    const float speed = joint_drive_magnitude(state->v_motor);
    const float asks = joint_drive_magnitude(0.09996732f * speed);
    float opposed = -(0.09996732f * state->v_motor);
    const float asked = (joint_drive_magnitude(opposed) <= 1e30f) ? opposed : 0.0f;
    float slowing = (asked > u_max) ? u_max : asked;
    slowing = (slowing < u_min) ? u_min : slowing;
    const bool is_short = slowing != asked;
    if (joint_drive_magnitude(monitor->most) <= 0.0f) {
        const float most = (1.25f * asks) + (0.5f * (30.0f - (-30.0f)));
        monitor->most = -most;
    } else {
        joint_drive_watch_brake(monitor, state, speed, asks, slowing, is_short, (told & blind) == blind);
    }
    const bool is_stuck = monitor->stuck > 200.0f;
    unsigned health = told | (is_stuck ? (unsigned)JOINT_DRIVE_STUCK_AT_LIMIT : 0u);
    if (is_stuck || (monitor->over > 8.0f) || (monitor->braking > 1984.0f)) {
        health |= joint_drive_watch_stop(monitor, output);
    } else {
        state->held = slowing;
        state->offset = 0.0f;
        output->u = slowing;
        health &= ~(unsigned)JOINT_DRIVE_SATURATED;
        health |= is_short ? (unsigned)(JOINT_DRIVE_SATURATED | JOINT_DRIVE_BRAKES) : (unsigned)JOINT_DRIVE_BRAKES;
    }
    return health | joint_drive_watch_runaway(monitor);
}

/* What the monitors say of a tick that was made; what follows is done. */
static inline unsigned joint_drive_watch(joint_drive_monitor *monitor, joint_drive_state *state, unsigned told, joint_drive_output *output)
{
    const bool is_lost = (told & JOINT_DRIVE_SAMPLE_LOST) != 0u;
    const bool is_rejected = (told & JOINT_DRIVE_INPUT_REJECTED) != 0u;
    bool has_changed = false;
    bool is_star_over = false;
    if (!state->started) {
        return told;
    }
    if ((told & JOINT_DRIVE_WAITS) != 0u) {
        if (is_lost) { /* what was believed is given up */
            return told | joint_drive_watch_stop(monitor, output);
        }
        return told;
    }
    if (monitor->braking > 0.0f) {
        return joint_drive_brake(monitor, state, told, output);
    }
    const bool over_link =
        joint_drive_watch_side(state->d_link, 10.483162f, &monitor->side_link, &has_changed);
    const bool over_motor =
        joint_drive_watch_side(state->d_motor, 103158.71f, &monitor->side_motor, &has_changed);
    monitor->swings += has_changed ? 200.0f : 0.0f;
    if ((told & JOINT_DRIVE_SATURATED) != 0u) {
        joint_drive_watch_limit(monitor, state, joint_drive_magnitude(output->sigma), output->u, is_lost, over_link, over_motor);
    } else {
        joint_drive_watch_within(monitor);
        is_star_over = !(joint_drive_magnitude(output->sigma_star) <= 172.6021f);
    }
    const bool is_any_over = over_link || over_motor;
    joint_drive_watch_over(monitor, is_any_over || is_star_over || is_rejected);
    const bool is_late = monitor->over > 8.0f;
    unsigned health = told;
    health |= (monitor->stuck > 200.0f) ? (unsigned)JOINT_DRIVE_STUCK_AT_LIMIT : 0u;
    if (is_late) {
        health |= is_any_over ? (unsigned)JOINT_DRIVE_DISTURBANCE_OVER_BOUND : 0u;
        health |= is_star_over ? (unsigned)JOINT_DRIVE_SIGMA_STAR_OVER_BOUND : 0u;
    }
    /* A sample that is missing is an alarm after a while. */
    const unsigned alarms = is_late ? health : (health & ~(unsigned)JOINT_DRIVE_INPUT_REJECTED);
    if ((alarms & 1589u) != 0u) {
        if (is_rejected && is_lost) {
            health |= joint_drive_watch_stop(monitor, output);
        } else {
            /* To brake makes it worse if the shaft goes the wrong way: that is known in a few ticks. */
            if (!(monitor->against > 0.0f)) {
                joint_drive_watch_brakes(monitor);
            }
        }
    }
    return health | joint_drive_watch_runaway(monitor);
}

/* Does what follows an alarm, from the next tick on: for reasons of your own, a switch, a door. */
static inline void joint_drive_watched_trip(joint_drive_monitor *monitor)
{
    if (!(monitor->braking > 0.0f)) {
        joint_drive_watch_brakes(monitor);
    }
}

/* joint_drive_tick_or_start within the monitors. */
static inline unsigned joint_drive_watched_tick(joint_drive_monitor *monitor, joint_drive_state *state, const joint_drive_sample *sample, joint_drive_output *output)
{
    if (monitor->stopped) {
        (void)joint_drive_not_started(output);
        return JOINT_DRIVE_INPUT_REJECTED | JOINT_DRIVE_STOPPED;
    }
    unsigned health = joint_drive_watch(monitor, state, joint_drive_tick_or_start(state, sample, output), output);
    return health;
}

/* joint_drive_lost within the monitors. */
static inline unsigned joint_drive_watched_lost(joint_drive_monitor *monitor, joint_drive_state *state, joint_drive_output *output)
{
    if (monitor->stopped) {
        (void)joint_drive_not_started(output);
        return JOINT_DRIVE_INPUT_REJECTED | JOINT_DRIVE_STOPPED;
    }
    return joint_drive_watch(monitor, state, joint_drive_lost(state, output), output);
}

/* After a stop: all is forgotten, and the next good sample starts the drive. */
static inline void joint_drive_watched_reset(joint_drive_monitor *monitor, joint_drive_state *state)
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
    monitor->side_link = 0.0f;
    monitor->side_motor = 0.0f;
    joint_drive_reset(state);
}

/* What a plan takes over where it begins. */
typedef joint_drive_target joint_drive_jet;

/* Where a plan leads: to rest at 2 pi turn + angle, or along a sine about angle 0 whose phase is 0 at tick 0. */
typedef struct {
    int32_t turn;
    float angle; /* rad */
    float amplitude; /* rad */
    float omega; /* rad/s */
    uint32_t phase_per_tick; /* 2^-32 turns; 0: rest */
} joint_drive_goal;

/* A plan: where the shaft should be at every tick. Ticks count from anywhere and may wrap. Zeros: rest at angle 0. */
typedef struct {
    joint_drive_goal goal;
    uint32_t end; /* the tick from which on it is there */
    uint32_t ticks; /* of the way */
    float per_tick;
    float per_s;
    uint64_t share; /* 2^64/ticks */
    float power[2][8]; /* of the part that is done, and of the part that is left */
    uint64_t way[2][8]; /* the same in 2^-32 turns, modulo 2^64 */
} joint_drive_plan;

/* Part of a plan: the jet of A sin at a phase in 2^-32 turns. */
static inline void joint_drive_jet_of_sine(uint32_t phase, float amplitude, float omega, joint_drive_jet *jet)
{
    JOINT_DRIVE_AS_WRITTEN
    const float part = (float)joint_drive_signed(phase) * 1.46291812e-9f;
    const bool holds = (part < (-1.57079637e0f)) || (part > 1.57079637e0f);
    const float part_2 = (3.14159274e0f - ((part < 0.0f) ? (-part) : (part + 0.0f))) + (-8.74227766e-8f);
    const float part_3 = holds ? ((part < 0.0f) ? (-part_2) : part_2) : part;
    const float part_4 = holds ? (-1.0f) : 1.0f;
    const float part_5 = part_3 * part_3;
    const float part_6 = 1.0f * part_3;
    const float part_7 = part_6
            + (part_6 * (part_5 * ((((((2.59986177e-6f * part_5) + (-1.98065289e-4f)) * part_5)
            + 8.33301619e-3f) * part_5) + (-1.66666567e-1f))));
    const float part_8 = part_4
            + (part_4 * (part_5 * ((((((2.31924023e-5f * part_5) + (-1.38558447e-3f)) * part_5)
            + 4.16639782e-2f) * part_5) + (-4.99999315e-1f))));
    const float part_9 = amplitude * omega;
    const float part_10 = part_9 * omega;
    jet->r = amplitude * part_7;
    jet->r_dot = part_9 * part_8;
    jet->r_ddot = part_10 * (-part_7);
    jet->r_dddot = (part_10 * omega) * (-part_8);
}

/* Part of a plan: what the way onto the goal adds to its jet. */
static inline void joint_drive_join(const float power[8], uint32_t ticks, uint32_t rest, uint32_t early, float per_tick,
    float rate, float instant_s, joint_drive_jet *jet)
{
    JOINT_DRIVE_AS_WRITTEN
    const float part = (float)joint_drive_signed(ticks) * per_tick;
    const float part_2 = power[7] * part;
    const float part_3 = part_2 + power[6];
    const float part_4 = part_2 + part_3;
    const float part_5 = (part_3 * part) + power[5];
    const float part_6 = part_2 + part_4;
    const float part_7 = (part_4 * part) + part_5;
    const float part_8 = (part_5 * part) + power[4];
    const float part_9 = (part_6 * part) + part_7;
    const float part_10 = (part_7 * part) + part_8;
    const float part_11 = (part_8 * part) + power[3];
    const float part_12 = (part_9 * part) + part_10;
    const float part_13 = (part_10 * part) + part_11;
    const float part_14 = (part_11 * part) + power[2];
    const float part_15 = (part_12 * part) + part_13;
    const float part_16 = (part_13 * part) + part_14;
    const float part_17 = (1.0f * rate) * 1.0f;
    const float part_18 = part_17 * ((part_16 * part) + ((part_14 * part) + power[1]));
    const float part_19 = (part_17 * rate) * 2.0f;
    jet->r = jet->r
            + (((float)joint_drive_signed(rest) * 1.46291812e-9f)
            + (((float)joint_drive_signed(early) * instant_s) * part_18));
    jet->r_dot = jet->r_dot + part_18;
    jet->r_ddot = jet->r_ddot + (part_19 * ((part_15 * part) + part_16));
    jet->r_dddot = jet->r_dddot
            + (((part_19 * rate) * 3.0f) * (((((((part_2 + part_6) * part) + part_9) * part) + part_12) * part)
            + part_15));
}

/* Part of a plan: the coefficients of a way that closes a gap in so many seconds. */
static inline void joint_drive_powers_of_join(const double gap[4], double tau_s, double s[8],
    double left[8])
{
    JOINT_DRIVE_AS_WRITTEN
    const double part = gap[0] * 1.0;
    const double part_2 = 1.0 * (tau_s / 1.0);
    const double part_3 = gap[1] * part_2;
    const double part_4 = part_2 * (tau_s / 2.0);
    const double part_5 = gap[2] * part_4;
    const double part_6 = part * 1.0;
    const double part_7 = (part * 4.0) + (part_3 * 1.0);
    const double part_8 = ((part * 10.0) + (part_3 * 4.0)) + (part_5 * 1.0);
    const double part_9 = (((part * 20.0) + (part_3 * 10.0)) + (part_5 * 4.0))
            + ((gap[3] * (part_4 * (tau_s / 3.0))) * 1.0);
    const double s_0 = part_6 * 1.0;
    const double part_10 = part_6 * (-4.0);
    const double part_11 = part_7 * 1.0;
    const double part_12 = part_7 * (-4.0);
    const double part_13 = part_8 * 1.0;
    const double part_14 = part_8 * (-4.0);
    const double s_7 = part_9 * 1.0;
    const double part_15 = part_9 * (-4.0);
    s[0] = s_0;
    s[1] = part_10 + part_11;
    s[2] = ((part_6 * 6.0) + part_12) + part_13;
    s[3] = ((part_10 + (part_7 * 6.0)) + part_14) + s_7;
    s[4] = ((s_0 + part_12) + (part_8 * 6.0)) + part_15;
    s[5] = (part_11 + part_14) + (part_9 * 6.0);
    s[6] = part_13 + part_15;
    s[7] = s_7;
    left[0] = 0.0;
    left[1] = 0.0;
    left[2] = 0.0;
    left[3] = 0.0;
    left[4] = ((s_0 + part_11) + part_13) + s_7;
    left[5] = ((part_7 * (-1.0)) + (part_8 * (-2.0))) + (part_9 * (-3.0));
    left[6] = part_13 + (part_9 * 3.0);
    left[7] = part_9 * (-1.0);
}

/* Part of a plan: a number that the drive would take. */
static inline bool joint_drive_is_number(double number)
{
    return (number >= -1e12) && (number <= 1e12);
}

/* Part of a plan. */
static inline void joint_drive_jet_of_goal(const joint_drive_goal *goal, uint32_t tick, joint_drive_jet *jet)
{
    if (goal->phase_per_tick != 0u) {
        jet->turn = 0;
        joint_drive_jet_of_sine(goal->phase_per_tick * tick, goal->amplitude, goal->omega, jet);
    } else {
        jet->turn = goal->turn;
        jet->r = goal->angle;
        jet->r_dot = 0.0f;
        jet->r_ddot = 0.0f;
        jet->r_dddot = 0.0f;
    }
}

/* Part of a plan: ticks until its goal is met, 0 if it is. The end is ahead for less than half of all ticks. */
static inline uint32_t joint_drive_plan_left(const joint_drive_plan *plan, uint32_t tick)
{
    const uint32_t left = plan->end - tick;
    return ((plan->ticks == 0u) || (left > 0x7fffffffu)) ? 0u : left;
}

/* Part of a plan: a sum in 2^-32 turns times s in 2^-32, of at most a half. */
static inline uint64_t joint_drive_share(uint64_t sum, uint32_t s)
{
    const int64_t turns = (int64_t)joint_drive_signed((uint32_t)(sum >> 32)) * (int64_t)joint_drive_signed(s);
    return (uint64_t)turns + (((sum & 0xffffffffu) * (uint64_t)s) >> 32);
}

/* Part of a plan: a half of its way at a part of its ticks, added to the jet of its goal. The position is whole turns and
 * a rest, in 2^-32 turns: of a million turns it is as fine as of one. Its argument has 32 bits, rounded down, and is so
 * many 2^-32 ticks early. */
static inline void joint_drive_go_along(const joint_drive_plan *plan, uint32_t half, uint32_t part, joint_drive_jet *jet)
{
    const uint32_t s = (uint32_t)(((uint64_t)part * plan->share) >> 32);
    const uint32_t early = 0u - (s * plan->ticks);
    const float rate = (half == 0u) ? plan->per_s : -plan->per_s;
    const float instant_s = (half == 0u) ? 2.3283065e-13f : -2.3283065e-13f;
    uint64_t sum = plan->way[half][7];
    sum = joint_drive_share(sum, s) + plan->way[half][6];
    sum = joint_drive_share(sum, s) + plan->way[half][5];
    sum = joint_drive_share(sum, s) + plan->way[half][4];
    sum = joint_drive_share(sum, s) + plan->way[half][3];
    sum = joint_drive_share(sum, s) + plan->way[half][2];
    sum = joint_drive_share(sum, s) + plan->way[half][1];
    sum = joint_drive_share(sum, s) + plan->way[half][0];
    jet->turn = joint_drive_signed((uint32_t)jet->turn + (uint32_t)(sum >> 32) + ((uint32_t)sum >> 31));
    joint_drive_join(plan->power[half], part, (uint32_t)sum, early, plan->per_tick, rate, instant_s, jet);
}

/* Where a plan is at a tick, with all that another plan takes over from it; before its start where it begins. */
static inline void joint_drive_plan_jet(const joint_drive_plan *plan, uint32_t tick, joint_drive_jet *jet)
{
    const uint32_t ahead = joint_drive_plan_left(plan, tick);
    const uint32_t left = (ahead > plan->ticks) ? plan->ticks : ahead;
    joint_drive_jet_of_goal(&plan->goal, (left == 0u) ? tick : (plan->end - left), jet);
    if (left != 0u) {
        const uint32_t done = plan->ticks - left;
        joint_drive_go_along(plan, (done < left) ? 0u : 1u, (done < left) ? done : left, jet);
    }
}

/* The target at a tick. */
static inline void joint_drive_plan_at(const joint_drive_plan *plan, uint32_t tick, joint_drive_target *target)
{
    joint_drive_jet jet;
    joint_drive_plan_jet(plan, tick, &jet);
    target->turn = jet.turn;
    target->r = jet.r;
    target->r_dot = jet.r_dot;
    target->r_ddot = jet.r_ddot;
    target->r_dddot = jet.r_dddot;
}

/* The same of a plan that is gone along: in the interrupt, once per tick, for its end. What is over stays so when ticks
 * have wrapped (2^32 of them are five days at 10 kHz). */
static inline void joint_drive_plan_play(joint_drive_plan *plan, uint32_t tick, joint_drive_target *target)
{
    if (joint_drive_plan_left(plan, tick) == 0u) {
        plan->ticks = 0u;
    }
    joint_drive_plan_at(plan, tick, target);
}

/* Part of a plan: a coefficient of a way that has a place in 2^-32 turns. */
static inline bool joint_drive_is_near(double rad)
{
    return (rad >= -6000000000.0) && (rad <= 6000000000.0);
}

/* Part of a plan: the nearest of 2^-32 turns, modulo 2^64. */
static inline uint64_t joint_drive_units(double rad)
{
    const double units = rad * 683565275.5764316;
    return (uint64_t)(int64_t)((units < 0.0) ? (units - 0.5) : (units + 0.5));
}

/* Part of a plan: onto a goal. In double, hence not for the interrupt. */
static inline bool joint_drive_plan_onto(joint_drive_plan *plan, const joint_drive_goal *goal, const joint_drive_jet *present, uint32_t start,
    uint32_t ticks)
{
    JOINT_DRIVE_AS_WRITTEN
    const double tau_s = (double)ticks * 0.001;
    uint32_t turns;
    double gap[4];
    double power[2][8];
    bool good = (ticks >= 1u) && (ticks <= 16777216u);
    joint_drive_jet at;
    joint_drive_jet_of_goal(goal, start, &at);
    turns = (uint32_t)present->turn - (uint32_t)at.turn;
    gap[0] = (double)present->r - (double)at.r;
    gap[1] = (double)present->r_dot - (double)at.r_dot;
    gap[2] = (double)present->r_ddot - (double)at.r_ddot;
    gap[3] = (double)present->r_dddot - (double)at.r_dddot;
    gap[0] += 6.283185307179586 * (double)joint_drive_signed(turns);
    for (unsigned k = 0; k < 4u; k++) {
        good = good && joint_drive_is_number(gap[k]);
    }
    joint_drive_powers_of_join(gap, tau_s, power[0], power[1]);
    for (unsigned k = 0; k < 8u; k++) {
        good = good && joint_drive_is_near(power[0][k]) && joint_drive_is_near(power[1][k]);
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
        for (unsigned k = 0; k < 8u; k++) {
            plan->power[half][k] = (float)power[half][k];
            plan->way[half][k] = joint_drive_units(power[half][k]);
        }
    }
    return true;
}

/* The plan to be at rest at 2 pi turn + angle, always: for a start. The answer of this and of the next three is false,
 * and the plan as it was, if a number is none or beyond 1e12, the way leads some 10 million turns far, or the ticks are
 * not 1 to 2^24. They compute in double,
 * on most cores in software: make a plan outside of the interrupt, not the one that is being played, and hand it over
 * between two ticks. */
static inline bool joint_drive_plan_rest(joint_drive_plan *plan, int32_t turn, float angle)
{
    joint_drive_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    if (!joint_drive_is_number((double)angle)) {
        return false;
    }
    goal.turn = turn;
    goal.angle = angle;
    plan->goal = goal;
    plan->ticks = 0u;
    return true;
}

/* Plans a move to rest at 2 pi turn + angle, that begins at a tick with what is present then and takes so many ticks.
 * On the way, the present is that of the old plan at this tick (joint_drive_plan_jet), never a measurement. Whether the current
 * and the supply suffice is not asked. */
static inline bool joint_drive_plan_move(joint_drive_plan *plan, const joint_drive_jet *present, uint32_t start, uint32_t ticks, int32_t turn,
    float angle)
{
    joint_drive_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    goal.turn = turn;
    goal.angle = angle;
    return joint_drive_is_number((double)angle) && joint_drive_plan_onto(plan, &goal, present, start, ticks);
}

/* Part of a stop: the way that it takes in so many ticks, and whether it goes back on it. The speed on the way is
 * (1 - s)^m (part[0] + part[1] s + ..). */
static inline bool joint_drive_stop_goes_back(const joint_drive_jet *present, uint32_t ticks, double *way)
{
    JOINT_DRIVE_AS_WRITTEN
    const double tau_s = (double)ticks * 0.001;
    double part[3] = { (double)present->r_dot, (double)present->r_ddot, (double)present->r_dddot };
    double scale = 1.0;
    double share = 1.0 / 4.0;
    bool forward = false;
    bool back = false;
    for (unsigned k = 0; k < 3u; k++) {
        part[k] = scale * part[k];
        scale = scale * (tau_s / (double)(k + 1u));
    }
    for (unsigned times = 0; times < 3u; times++) {
        for (unsigned k = 1; k < 3u; k++) {
            part[k] = part[k] + part[k - 1u];
        }
    }
    *way = 0.0;
    for (unsigned k = 0; k < 3u; k++) {
        forward = forward || (part[k] > 0.0);
        back = back || (part[k] < 0.0);
        *way = *way + (share * part[k]);
        share = share * ((double)(k + 1u) / (double)(k + 1u + 4u));
    }
    *way = tau_s * *way;
    return forward && back;
}

/* Plans to come to rest in so many ticks, and never back: at an even speed at half of the way that would have been
 * gone. Of a shaft that slows down already it takes fewer ticks where a longer stop would go back. */
static inline bool joint_drive_plan_stop(joint_drive_plan *plan, const joint_drive_jet *present, uint32_t start, uint32_t ticks)
{
    JOINT_DRIVE_AS_WRITTEN
    uint32_t taken = ticks;
    uint32_t too_many = ticks;
    double way;
    double angle;
    if ((ticks < 1u) || (ticks > 16777216u)) {
        return false;
    }
    if (joint_drive_stop_goes_back(present, ticks, &way)) {
        taken = 1u;
        while ((taken + 1u) < too_many) {
            const uint32_t middle = taken + ((too_many - taken) / 2u);
            if (joint_drive_stop_goes_back(present, middle, &way)) {
                too_many = middle;
            } else {
                taken = middle;
            }
        }
        (void)joint_drive_stop_goes_back(present, taken, &way);
    }
    angle = (double)present->r + way;
    return joint_drive_is_number(angle) && joint_drive_plan_move(plan, present, start, taken, present->turn, (float)angle);
}

/* Plans a way onto A sin(omega t) about angle 0, the phase of which is 0 at tick 0. Omega is rounded to a whole number
 * of 2^-32 turns per tick, and must be at least that and less than half a turn per tick. */
static inline bool joint_drive_plan_sine(joint_drive_plan *plan, const joint_drive_jet *present, uint32_t start, uint32_t ticks,
    double amplitude_rad, double omega_rad_s)
{
    JOINT_DRIVE_AS_WRITTEN
    const double phase = (omega_rad_s * 0.001 / 6.283185307179586 * 4294967296.0) + 0.5;
    joint_drive_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    if (!((phase >= 1.0) && (phase < 2147483648.0)) || !joint_drive_is_number(amplitude_rad)) {
        return false;
    }
    goal.amplitude = (float)amplitude_rad;
    goal.phase_per_tick = (uint32_t)phase;
    goal.omega = (float)((double)goal.phase_per_tick / 4294967296.0 * 6.283185307179586 / 0.001);
    return joint_drive_plan_onto(plan, &goal, present, start, ticks);
}

/* Part of a profile: a target from what its averages moved by in the last ticks and how far they are behind. */
static inline void joint_drive_jet_of_profile(const uint32_t moved[6], const uint32_t behind[2], uint32_t rest, float part_rad,
    float per_s, joint_drive_jet *jet)
{
    JOINT_DRIVE_AS_WRITTEN
    const float part = ((float)joint_drive_signed(moved[0]) * 4.29496730e9f) + (float)joint_drive_signed(moved[1]);
    const float part_2 = ((float)joint_drive_signed(moved[2]) * 4.29496730e9f) + (float)joint_drive_signed(moved[3]);
    const float part_3 = ((float)joint_drive_signed(moved[4]) * 4.29496730e9f) + (float)joint_drive_signed(moved[5]);
    const float part_4 = per_s * per_s;
    jet->r = ((float)joint_drive_signed(rest) * 1.46291812e-9f)
            - (((((float)joint_drive_signed(behind[0]) * 4.29496730e9f) + (float)joint_drive_signed(behind[1]))
            + ((9.58333313e-1f * part) + ((0.5f * part_2) + (4.16666679e-2f * part_3)))) * part_rad);
    jet->r_dot = (((1.66666672e-1f * (part + part_3)) + (6.66666687e-1f * part_2)) * part_rad) * per_s;
    jet->r_ddot = ((0.5f * (part - part_3)) * part_rad) * part_4;
    jet->r_dddot = (((part - part_2) - (part_2 - part_3)) * part_rad) * (part_4 * per_s);
}

/* PROFILE. Set-points that come at any time become targets within limits of speed, acceleration and jerk, without
 * overshoot: in the interrupt take the target of each tick from joint_drive_profile_next, and give a goal whenever there is one.
 * The path is a mean over 3 windows of ticks: its jerk is at most 2 acceleration / (window period). Points of a
 * stream take a window of as many ticks as there are from one to the next; one that is late, comes twice or not at all
 * changes the path between them alone. Change a profile between two ticks, not while the interrupt makes one. */
#ifndef JOINT_DRIVE_PROFILE_WINDOW
#define JOINT_DRIVE_PROFILE_WINDOW 128u /* ticks of a window at most, 1 to 128; each takes 12 bytes of a profile */
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
    int32_t steps[3u * JOINT_DRIVE_PROFILE_WINDOW]; /* of the last windows; the oldest is at `oldest` */
    uint32_t oldest;
    uint32_t window;
    uint32_t all; /* window^3: so many times as large are those that follow */
    uint64_t sums[3]; /* the last is what the path moves by */
    uint64_t earlier[2];
    uint64_t behind; /* of the path behind the base */
    float part_rad;
} joint_drive_profile;

/* Part of a profile. */
static inline int64_t joint_drive_signed_long(uint64_t units)
{
    return (units <= 0x7fffffffffffffffu) ? (int64_t)units : (-(int64_t)(UINT64_MAX - units) - 1);
}

/* Part of a profile: 2 pi turn + rad, or what is nearest to it. */
static inline uint64_t joint_drive_place(int32_t turn, double rad)
{
    const int64_t turns = (int64_t)turn * 4294967296;
    const int64_t rest = joint_drive_signed_long(joint_drive_units(rad));
    int64_t sum;
    if (rest >= 0) {
        sum = (turns > (9223372036854775807 - rest)) ? 9223372036854775807 : (turns + rest);
    } else {
        sum = (turns < (-9223372036854775807 - rest)) ? (-9223372036854775807 - 1) : (turns + rest);
    }
    return (uint64_t)sum;
}

/* Part of a profile: are these limits? */
static inline bool joint_drive_profile_is_limit(double speed_rad_s, double acceleration_rad_s2)
{
    JOINT_DRIVE_AS_WRITTEN
    return (speed_rad_s >= 1.4629180792671595e-6) && (speed_rad_s <= (1073741823.0 * 1.4629180792671595e-6)) &&
           (acceleration_rad_s2 >= 0.0014629180792671598) &&
           (acceleration_rad_s2 <= (1073741823.0 * 0.0014629180792671598));
}

/* Limits in motion too: above a lower speed it brakes as the acceleration has it. False, and nothing is changed, where a
 * limit is no number, or less than 2^-32 turns or more than a quarter of a turn per tick (or tick squared). */
static inline bool joint_drive_profile_limit(joint_drive_profile *profile, double speed_rad_s, double acceleration_rad_s2)
{
    JOINT_DRIVE_AS_WRITTEN
    const bool good = joint_drive_profile_is_limit(speed_rad_s, acceleration_rad_s2);
    if (good) {
        profile->fastest = (int32_t)(speed_rad_s / 1.4629180792671595e-6);
        profile->acceleration = (int32_t)(acceleration_rad_s2 / 0.0014629180792671598);
        profile->fastest_whole = profile->fastest / profile->acceleration;
        profile->whole = ((profile->step < 0) ? -profile->step : profile->step) / profile->acceleration;
    }
    return good;
}

/* Part of a profile. */
static inline void joint_drive_profile_set_goal(joint_drive_profile *profile, uint64_t place)
{
    const int64_t goal = joint_drive_signed_long(place);
    const int64_t below = (goal < profile->high) ? goal : profile->high;
    profile->goal = (uint64_t)((below > profile->low) ? below : profile->low);
}

/* Keeps goals between 2 pi turn + rad of both from now on, and the present one. False, and nothing is changed, if an angle
 * is no number or the first is not the lower one. */
static inline bool joint_drive_profile_keep_within(joint_drive_profile *profile, int32_t low_turn, double low_rad, int32_t high_turn,
    double high_rad)
{
    int64_t low;
    int64_t high;
    if (!joint_drive_is_near(low_rad) || !joint_drive_is_near(high_rad)) {
        return false;
    }
    low = joint_drive_signed_long(joint_drive_place(low_turn, low_rad));
    high = joint_drive_signed_long(joint_drive_place(high_turn, high_rad));
    if (low > high) {
        return false;
    }
    profile->low = low;
    profile->high = high;
    joint_drive_profile_set_goal(profile, profile->goal);
    return true;
}

/* Goes to 2 pi turn + rad, from where it is now. False if that is not within the range: it goes to its end; or if it is no
 * number: the goal stays. In double: some hundred cycles on most cores. */
static inline bool joint_drive_profile_go_to(joint_drive_profile *profile, int32_t turn, double rad)
{
    uint64_t goal;
    if (!joint_drive_is_near(rad)) {
        return false;
    }
    goal = joint_drive_place(turn, rad);
    joint_drive_profile_set_goal(profile, goal);
    return profile->goal == goal;
}

/* Comes to rest as soon as it may. The path does not go back if it has not turned round in the last 3 windows. A
 * stop that ends beyond the range goes back to its end. */
static inline void joint_drive_profile_stop(joint_drive_profile *profile)
{
    const int64_t speed = (profile->step < 0) ? -(int64_t)profile->step : (int64_t)profile->step;
    const int64_t whole = (int64_t)profile->whole;
    const int64_t way = (whole * ((2 * speed) - ((int64_t)profile->acceleration * (whole + 1)))) / 2;
    const int64_t base = joint_drive_signed_long(profile->base);
    profile->goal = profile->base + (uint64_t)((profile->step < 0) ? -way : way);
    /* Begun beyond the range it rests there. */
    if ((base >= profile->low) && (base <= profile->high)) {
        joint_drive_profile_set_goal(profile, profile->goal);
    }
}

/* Begins anew at 2 pi turn + rad with a speed, and stops from there: where a shaft is that shall be caught. False, and
 * nothing is changed, if one is no number or the speed is more than a quarter of a turn per tick. */
static inline bool joint_drive_profile_start(joint_drive_profile *profile, int32_t turn, double rad, double speed_rad_s)
{
    JOINT_DRIVE_AS_WRITTEN
    const double units = speed_rad_s / 1.4629180792671595e-6;
    int64_t step;
    if (!joint_drive_is_near(rad) || !joint_drive_is_near(speed_rad_s) || (units > 1073741823.0) || (units < -1073741823.0) ||
        (profile->acceleration < 1)) {
        return false;
    }
    step = (int64_t)((units < 0.0) ? (units - 0.5) : (units + 0.5));
    profile->step = (int32_t)step;
    profile->whole = ((profile->step < 0) ? -profile->step : profile->step) / profile->acceleration;
    for (uint32_t k = 0; k < (3u * JOINT_DRIVE_PROFILE_WINDOW); k++) {
        profile->steps[k] = profile->step;
    }
    for (uint32_t k = 0; k < 2u; k++) {
        profile->sums[k] = 0u;
    }
    profile->sums[2] = (uint64_t)(step * (int64_t)profile->all);
    profile->earlier[0] = profile->sums[2];
    profile->earlier[1] = profile->sums[2];
    profile->behind = (uint64_t)(((step * (int64_t)profile->all) * (3 * ((int64_t)profile->window - 1))) / 2);
    profile->base = joint_drive_place(turn, rad) + (uint64_t)(((step * 3) * (int64_t)profile->window) / 2);
    joint_drive_profile_stop(profile);
    return true;
}

/* A profile at rest at angle 0. False, and nothing is changed, where joint_drive_profile_limit is false or the window is not 1 to
 * JOINT_DRIVE_PROFILE_WINDOW. */
static inline bool joint_drive_profile_new(joint_drive_profile *profile, double speed_rad_s, double acceleration_rad_s2, uint32_t window)
{
    JOINT_DRIVE_AS_WRITTEN
    if ((window < 1u) || (window > JOINT_DRIVE_PROFILE_WINDOW) || (window > 128u) ||
        !joint_drive_profile_is_limit(speed_rad_s, acceleration_rad_s2)) {
        return false;
    }
    profile->step = 0;
    (void)joint_drive_profile_limit(profile, speed_rad_s, acceleration_rad_s2);
    profile->low = -4611686018427387904;
    profile->high = 4611686018427387903;
    profile->oldest = 0u;
    profile->window = window;
    profile->all = window * window * window;
    profile->part_rad = (float)(1.4629180792671596e-9 / (double)profile->all);
    return joint_drive_profile_start(profile, 0, 0.0, 0.0);
}

/* Is it at rest at its goal? */
static inline bool joint_drive_profile_has_arrived(const joint_drive_profile *profile)
{
    bool still = (profile->goal == profile->base) && (profile->step == 0) && (profile->behind == 0u) &&
                 (profile->earlier[0] == 0u) && (profile->earlier[1] == 0u);
    for (uint32_t k = 0; k < 3u; k++) {
        still = still && (profile->sums[k] == 0u);
    }
    return still;
}

/* Part of a profile: is a stop within a distance possible after a tick with this step? */
static inline bool joint_drive_profile_stops(const joint_drive_profile *profile, int64_t distance, int32_t step, int32_t whole)
{
    const int32_t twice = (2 * step) - (profile->acceleration * whole);
    return (((int64_t)whole + 1) * (int64_t)twice) <= (2 * distance);
}

/* Part of a profile: the next step of the base. Forward is towards the goal. */
static inline void joint_drive_profile_advance(joint_drive_profile *profile)
{
    const int64_t far = 2305843009213693952;
    const int64_t left = joint_drive_signed_long(profile->goal - profile->base);
    const bool back = left < 0;
    const int64_t apart = back ? joint_drive_signed_long(profile->base - profile->goal) : left;
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
        if (joint_drive_profile_stops(profile, distance, up, up_whole)) {
            next = up;
            whole = up_whole;
        } else if (whole == 0) {
            next = (acceleration < fastest) ? acceleration : fastest;
            next = ((int64_t)next < distance) ? next : (int32_t)distance;
            whole = (next == acceleration) ? 1 : 0;
        } else if (within && joint_drive_profile_stops(profile, distance, step, whole)) {
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
static inline uint64_t joint_drive_profile_before(const joint_drive_profile *profile, uint32_t windows)
{
    const uint32_t length = 3u * profile->window;
    const uint32_t at = profile->oldest + ((3u - windows) * profile->window);
    return (uint64_t)(int64_t)profile->steps[(at < length) ? at : (at - length)];
}

/* Part of a profile: the nearest whole number and what is left of it in 2^-32. */
static inline void joint_drive_profile_split(uint64_t units, uint32_t *number)
{
    number[0] = (uint32_t)(units >> 32) + ((uint32_t)units >> 31);
    number[1] = (uint32_t)units;
}

/* The target at the end of the coming tick: in the interrupt, once per tick. */
static inline void joint_drive_profile_next(joint_drive_profile *profile, joint_drive_target *target)
{
    uint32_t moved[2 * 3];
    uint32_t behind[2];
    uint32_t base[2];
    uint64_t sum;
    joint_drive_jet jet;
    joint_drive_profile_advance(profile);
    sum = (((uint64_t)(int64_t)profile->step - (3u * joint_drive_profile_before(profile, 1u))) + (3u * joint_drive_profile_before(profile, 2u))) - joint_drive_profile_before(profile, 3u);
    profile->steps[profile->oldest] = profile->step;
    profile->oldest = ((profile->oldest + 1u) < (3u * profile->window)) ? (profile->oldest + 1u) : 0u;
    sum += profile->sums[0];
    profile->sums[0] = sum;
    sum += profile->sums[1];
    profile->sums[1] = sum;
    sum += profile->sums[2];
    profile->sums[2] = sum;
    profile->behind += ((uint64_t)(int64_t)profile->step * profile->all) - sum;
    joint_drive_profile_split(sum, &moved[0]);
    joint_drive_profile_split(profile->earlier[0], &moved[2]);
    joint_drive_profile_split(profile->earlier[1], &moved[4]);
    joint_drive_profile_split(profile->behind, behind);
    joint_drive_profile_split(profile->base, base);
    joint_drive_jet_of_profile(moved, behind, base[1], profile->part_rad, 1000.0f, &jet);
    profile->earlier[1] = profile->earlier[0];
    profile->earlier[0] = sum;
    target->turn = joint_drive_signed(base[0]);
    target->r = jet.r;
    target->r_dot = jet.r_dot;
    target->r_ddot = jet.r_ddot;
    target->r_dddot = jet.r_dddot;
}

/* Are the floating-point modes here and now those of the head? Call it once at start-up, where the tick runs: an
 * interrupt of a Cortex-M begins with the modes of FPDSCR, not with those of main. False where rounding is not to
 * nearest, subnormal numbers are flushed, or the compiler fuses, reorders or widens operations. No tick calls it. */
static inline bool joint_drive_modes_ok(void)
{
    JOINT_DRIVE_AS_WRITTEN
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

#undef JOINT_DRIVE_AS_WRITTEN
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
#endif
