/* Drive of a flexible joint with two encoders, f32, T = 0.00025 s.
 * Position control, 4 observer states per encoder, 2 gain sets, no delay.
 * Exported by version 0.1.0 of the library. Do not edit; export again. C99 and C++11, no library needed.
 *
 *     #include "this file"
 *     static drive_state state;              once; zeros before the start
 *     static drive_monitor monitor;
 *     static drive_sample sample;
 *     drive_output output;                   in the timer interrupt, every T
 *     sample.count_link = encoder_link();    the low 20 bits are read; or sample.lost_link = true;
 *     sample.count_motor = encoder_motor();  the low 20 bits are read; or sample.lost_motor = true;
 *     sample.begin = sample.end;             a tick begins where the last one ended
 *     sample.end = next;                     target at the end of this tick
 *     unsigned health = drive_watched_tick(&monitor, &state, &sample, &output);
 *     set_current(output.u);                 A
 *     drive_report_applied(&state, held);    only if the stage holds another current
 *
 * CALLS. Everything else is internal.
 *
 *     drive_watched_tick, drive_watched_lost        a tick with monitors; without a sample
 *     drive_watched_reset, drive_watched_trip       restart after a stop; stop for your own reason
 *     drive_estimates                               angle, speed and load of each shaft
 *     drive_report_applied, drive_limit             held current; largest current of a derated stage
 *     drive_missed                                  missed timer interrupts, before the next tick
 *     drive_tick_or_start, drive_lost, drive_reset  the same without monitors: no alarm
 *     drive_start, drive_tick                       their parts: start at a sample; tick of a started drive
 *     drive_plan_rest, _move, _stop, _sine          make a plan, in the main loop
 *     drive_plan_play                               the target of a tick, in the interrupt
 *     drive_plan_at, drive_plan_jet                 the target at any tick; start of the next plan
 *     drive_profile_new, _start, _limit             set-points that keep limits of speed and acceleration
 *     drive_profile_go_to, _stop, _keep_within      their goal; their range
 *     drive_profile_next, _has_arrived              the target of a tick, in the interrupt
 *     drive_modes_ok                                checks the floating-point modes, once at start-up
 *
 * COMPILER OPTIONS. The bits equal the bits of the Rust tick only if every operation is rounded on its own. A fused
 * multiply-add rounds a * b + c once, which is another number and takes longer on a Cortex-M4F. So compile with
 * -ffp-contract=off. This file also switches fusing off by itself where the compiler permits it. GCC then inlines
 * drive_tick only if the option is given, too. Reordering (-ffast-math and its parts) and the precision of x87 change
 * bits as well: if the compiler reports them, this file does not compile. clang reports only -ffast-math and
 * -ffinite-math-only; with clang the file switches reordering off. No check detects -fno-signed-zeros (also part of
 * -funsafe-math-optimizations), -fno-honor-nans and -fno-honor-infinities: never use them.
 *
 * FLOATING-POINT MODES. The tick assumes rounding to nearest, subnormal numbers, and float computed as float. They must
 * hold wherever it runs: in main, in an interrupt or in a host program. On a Cortex-M, FPSCR has RMode = 00 and FZ = 0.
 * An interrupt starts with FPDSCR instead of the FPSCR of main, and it needs FPCCR.ASPEN = 1. All three are correct
 * after reset. On x86, MXCSR has neither FTZ nor DAZ; linking with -ffast-math sets them. Call drive_modes_ok once
 * at start-up in the context of the tick. Under other modes u is still a number within its limits; its bits differ.
 *
 * Design 0x279da2b5 (FNV-1a; `design_hash` in the run.json of a run).
 * Scenario drive.toml (CRC-32 0xef05000e):
 *
 *     # The joint of drive.c, at 4 kHz.
 *     #     host-sim export drive.toml --lang c --standalone --prefix drive -o drive_standalone.h --force
 *     name = "drive"
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
 *     sudden_load_n_m = 1.3
 *     fallback = 0.0
 *
 *     [monitor]
 *     reaction = "brake"
 */
#ifdef DRIVE_STANDALONE
#if DRIVE_STANDALONE != 0xdcb1b9f9u
#error "two designs with the prefix drive, 0xdcb1b9f9u here and DRIVE_STANDALONE before: export one with another --prefix"
#define DRIVE_STANDALONE 0xdcb1b9f9u
#endif
#else
#define DRIVE_STANDALONE 0xdcb1b9f9u

#include <float.h>
#include <stdbool.h>
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
#define DRIVE_AS_WRITTEN
#elif defined(__clang__) && __clang_major__ >= 18
#define DRIVE_AS_WRITTEN _Pragma("clang fp contract(off) reassociate(off) reciprocal(off)")
#elif defined(__clang__) && __clang_major__ >= 14
#define DRIVE_AS_WRITTEN _Pragma("clang fp contract(off) reassociate(off)")
#else
#define DRIVE_AS_WRITTEN _Pragma("STDC FP_CONTRACT OFF")
#endif

#define DRIVE_VERSION "0.1.0"
#define DRIVE_DESIGN 0x279da2b5u /* identifies the design: log it */
#define DRIVE_PERIOD_S 0.00025
#define DRIVE_MAX_CURRENT_A 30.0 /* of either sign */
#define DRIVE_DELAY_TICKS 0 /* from the computation of a current to its output */
#define DRIVE_CURRENT_LAG_S 0.0002 /* time constant of the current loop */
#define DRIVE_LINK_INERTIA_KG_M2 0.23
#define DRIVE_LINK_DAMPING_N_M_S 0.07
#define DRIVE_WEIGHT_N_M 0.23 /* torque of the weight in the level position */
#define DRIVE_STIFFNESS_N_M 9.0 /* per rad */
#define DRIVE_MOTOR_INERTIA_KG_M2 0.000931 /* of the motor, all behind the gear */
#define DRIVE_MOTOR_DAMPING_N_M_S 0.07
#define DRIVE_TORQUE_N_M_PER_A 0.119
#define DRIVE_ENCODER_LINK_BITS 20 /* on the shaft itself; counts up with the angle, 0 at angle 0 */
#define DRIVE_ENCODER_LINK_STATES 1048576u /* number of counts before it wraps; 0 for 2^32 */
#define DRIVE_ENCODER_LINK_COUNTS_PER_TURN 1048576
#define DRIVE_ENCODER_LINK_UNIT_RAD 5.992112452678286e-6 /* angle of the shaft per count */
#define DRIVE_ENCODER_LINK_REVERSED 0
#define DRIVE_ENCODER_LINK_OFFSET_COUNTS 0
#define DRIVE_ENCODER_MOTOR_BITS 20 /* on the shaft itself; counts up with the angle, 0 at angle 0 */
#define DRIVE_ENCODER_MOTOR_STATES 1048576u /* number of counts before it wraps; 0 for 2^32 */
#define DRIVE_ENCODER_MOTOR_COUNTS_PER_TURN 1048576
#define DRIVE_ENCODER_MOTOR_UNIT_RAD 5.992112452678286e-6 /* angle of the shaft per count */
#define DRIVE_ENCODER_MOTOR_REVERSED 0
#define DRIVE_ENCODER_MOTOR_OFFSET_COUNTS 0

/* Status flags of a tick. */
enum {
    DRIVE_OK = 0,
    DRIVE_INPUT_REJECTED = 1, /* no valid sample yet, too many missing, an invalid target, or a stopped drive: fallback */
    DRIVE_SATURATED = 2, /* the demanded u exceeds the limits */
    DRIVE_SAMPLE_LOST = 8, /* a count was missing or physically impossible: the observer predicts */
    DRIVE_POSITION_STEPPED = 128, /* missed tick or slip: the position was set from the counts again */
    DRIVE_WAITS = 256, /* the counts are not consistent yet: the current is 0 until they are */
    /* set by the monitors */
    DRIVE_SIGMA_STAR_OVER_BOUND = 4,
    DRIVE_DISTURBANCE_OVER_BOUND = 16,
    DRIVE_STUCK_AT_LIMIT = 32,
    DRIVE_WRONG_WAY = 512, /* the shaft accelerates against its current: encoder or phases are reversed */
    DRIVE_OSCILLATES = 1024, /* the disturbance exceeds its bound in both directions: a limit cycle */
    DRIVE_BRAKES = 2048, /* after an alarm: the current opposes the speed, the target is ignored */
    /* set by the limits of motion */
    DRIVE_OVERSPEED = 4096,
    DRIVE_FOLLOWING_ERROR = 8192,
    DRIVE_END_OF_RANGE = 16384, /* beyond an end of the range, or braking must begin now */
    DRIVE_HUNTS = 32768, /* the shaft hunts at rest: a wider rest band or lower gains are in use */
    DRIVE_STOPPED = 64 /* the output is the safe current until the monitor is reset */
};

/* Target at an instant: position 2 pi turn + r, and its derivatives, which must match. */
typedef struct {
    int32_t turn; /* revolutions; may wrap */
    float r; /* rad; keep it within two revolutions */
    float r_dot; /* rad/s */
    float r_ddot; /* rad/s^2 */
    float r_dddot; /* rad/s^3 */
} drive_target;

/* Input of a tick. */
typedef struct {
    uint32_t count_link; /* register of the counter */
    uint32_t count_motor; /* register of the counter */
    bool lost_link; /* true: no count in this tick */
    bool lost_motor; /* true: no count in this tick */
    drive_target begin; /* target at the begin of the tick in which u is held */
    drive_target end; /* target at the end of that tick */
} drive_sample;

typedef struct {
    float u; /* A; hold until the next tick; within the limits */
    float sigma; /* sliding variable, unit of the last derivative of the target */
    float sigma_star; /* sliding variable without its initial offset */
} drive_output;

/* Estimates of each shaft. */
typedef struct {
    int32_t turn; /* revolutions to add to the positions */
    float position_link; /* rad */
    float speed_link; /* rad/s */
    float disturbance_link; /* rad/s^2, acceleration that the model does not explain */
    float load_link; /* N m, torque against the shaft: load and friction */
    float position_motor; /* rad */
    float speed_motor; /* rad/s */
    float disturbance_motor; /* rad/s^2, acceleration that the model does not explain */
    float load_motor; /* N m, torque against the shaft: load and friction */
} drive_estimates_of;

/* State between two ticks; zeros before the start. */
typedef struct {
    bool fresh; /* no tick has passed since the start */
    uint32_t last_link; /* last valid count */
    uint32_t last_motor; /* last valid count */
    uint32_t at_link; /* last valid count, relative to the base */
    uint32_t at_motor; /* last valid count, relative to the base */
    uint32_t turn; /* revolution of the base */
    float push_link; /* half of the spring coupling at the last tick */
    float push_motor; /* half of the spring coupling at the last tick */
    float p_link; /* estimated position minus the position of its count */
    float v_link; /* estimated speed */
    float d_link; /* estimated disturbance, an acceleration */
    float d_dot_link; /* rate of the estimated disturbance */
    float p_motor; /* estimated position minus the position of its count */
    float v_motor; /* estimated speed */
    float d_motor; /* estimated disturbance, an acceleration */
    float d_dot_motor; /* rate of the estimated disturbance */
    float smoothed_link; /* smoothed innovation */
    float level_link; /* share of the high gains, 0 to 1 */
    float smoothed_motor; /* smoothed innovation */
    float level_motor; /* share of the high gains, 0 to 1 */
    float reach; /* temporary widening of the innovation gate */
    float missed_link; /* consecutive counts that were not used */
    float missed_motor; /* consecutive counts that were not used */
    float off_link; /* innovation of the last unused count */
    float off_motor; /* innovation of the last unused count */
    float doubt; /* cost of recent position steps; while fresh: consistent counts still needed */
    float offset; /* W = sigma(0) e^(-alpha t) */
    float held; /* current that the actuator held since the last tick, A */
    float limit; /* largest current of the power stage, A */
    float reported; /* last report well below the output, A; below 0: the limit was set */
    bool started;
} drive_state;

/* Values that one part of a tick passes to the next. */
typedef struct {
    bool begins;
    float g_sin; /* g sin, g cos of the link */
    float g_cos; /* g sin, g cos of the link */
    bool missing;
    bool stepped;
} drive_between;

/* Converts a count to a signed number; the result of a cast would depend on the compiler. */
static inline int32_t drive_signed(uint32_t count)
{
    const uint32_t below = 0xffffffffu - count;
    return (count < 0x80000000u) ? (int32_t)count : (-(int32_t)below - 1);
}

/* First part of the first tick after a start, whose estimates are from its sample. Returns false while
 * the drive waits for consistent counts. */
static inline bool drive_begin(drive_state *state, const drive_sample *sample, drive_between *between)
{
    DRIVE_AS_WRITTEN
    static const float unit_link = 5.99211262e-6f; /* one count */
    static const float period = 2.50000012e-4f; /* T, s */
    static const float agreement_link = 1.52106313e-5f; /* tolerance of consistent counts per tick */
    static const float unit_motor = 2.34473962e-4f; /* one count */
    static const float agreement_motor = 1.18231634e-2f; /* tolerance of consistent counts per tick */
    static const float gravity = 1.0f; /* weight of the link divided by its inertia, 1/s^2 */
    static const float half_spring = 1.89137438e5f; /* k1 k2/2 */
    static const float start_ticks = 40.0f; /* ticks of consistent counts before a current flows */
    static const float fallback = 0.0f; /* fallback, A */
    const uint32_t count_link = sample->count_link;
    const uint32_t count_motor = sample->count_motor;
    const bool holds = state->doubt > 0.0f;
    const uint32_t last_link = sample->lost_link ? state->last_link : count_link;
    const uint32_t part = (((count_link - state->last_link) & 0xfffffu) ^ 0x80000u) - 0x80000u;
    const float part_2 = unit_link * (float)drive_signed(part);
    const float part_3 = part_2 - (period * state->v_link);
    const float part_4 = agreement_link + agreement_link;
    const bool holds_2 = (part_3 >= (-part_4)) && (part_3 <= part_4);
    const float part_5 = part_2 / period;
    const float part_6 = 0.5f * (state->v_link + part_5);
    const uint32_t part_7 = count_motor - state->last_motor;
    const uint32_t part_8 = sample->lost_link ? state->at_link : (state->at_link + part);
    const uint32_t part_9 = (part_8 < 0x80000000u) ? ((part_8 / 1048576u) * 1048576u)
            : (0u - (((0u - part_8) / 1048576u) * 1048576u));
    const uint32_t part_10 = (((part_8 - part_9) & 0x7fffffu) ^ 0x400000u) - 0x400000u;
    const uint32_t part_11 = (((state->at_motor - part_9) & 0x7fffffu) ^ 0x400000u) - 0x400000u;
    const uint32_t part_12 = state->turn
            + ((part_8 < 0x80000000u) ? ((part_8 / 1048576u) * 1u) : (0u - (((0u - part_8) / 1048576u) * 1u)));
    const bool holds_3 = state->reach > 0.0f;
    const bool holds_4 = holds && holds_3;
    const uint32_t part_13 = (((sample->lost_motor ? last_link : part_7) & 0xfffffu) ^ 0x80000u) - 0x80000u;
    const uint32_t part_14 = sample->lost_motor ? part_13 : part_8;
    const float part_15 = unit_motor * (float)drive_signed(part_13);
    const float part_16 = part_15 - (period * state->v_motor);
    const float part_17 = agreement_motor + agreement_motor;
    const bool holds_5 = (part_16 >= (-part_17)) && (part_16 <= part_17);
    const bool holds_6 = !holds_5;
    const bool holds_7 = holds_6 && holds_3;
    const float part_18 = part_15 / period;
    const float part_19 = 0.5f * (state->v_motor + part_18);
    const uint32_t part_20 = (((sample->lost_motor ? state->last_motor : part_7) & 0xfffffu) ^ 0x80000u) - 0x80000u;
    const uint32_t part_21 = (part_14 < 0x80000000u) ? ((part_14 / 1048576u) * 1048576u)
            : (0u - (((0u - part_14) / 1048576u) * 1048576u));
    const uint32_t part_22 = (((part_14 - part_21) & 0x7fffffu) ^ 0x400000u) - 0x400000u;
    const uint32_t at_link = sample->lost_motor ? part_10 : part_22;
    const uint32_t part_23 = ((((sample->lost_motor ? part_20 : (state->at_motor + part_20))
            - part_21) & 0x7fffffu) ^ 0x400000u) - 0x400000u;
    const uint32_t at_motor = sample->lost_motor ? part_11 : part_23;
    const uint32_t part_24 = (sample->lost_motor ? 0u : state->turn)
            + ((part_14 < 0x80000000u) ? ((part_14 / 1048576u) * 1u) : (0u - (((0u - part_14) / 1048576u) * 1u)));
    const uint32_t part_25 = ((last_link & 0xfffffu) ^ 0x80000u) - 0x80000u;
    const uint32_t part_26 = (part_25 < 0x80000000u) ? ((part_25 / 1048576u) * 1048576u)
            : (0u - (((0u - part_25) / 1048576u) * 1048576u));
    const uint32_t part_27 = (((part_25 - part_26) & 0x7fffffu) ^ 0x400000u) - 0x400000u;
    const uint32_t part_28 = sample->lost_motor ? part_22 : part_27;
    const uint32_t part_29 = holds_2 ? (holds_7 ? part_27 : part_22) : (holds_3 ? part_27 : part_22);
    const uint32_t part_30 = ((((((count_motor & 0xfffffu) ^ 0x80000u) - 0x80000u) - part_26) & 0x7fffffu) ^ 0x400000u)
            - 0x400000u;
    const uint32_t part_31 = sample->lost_motor ? part_23 : part_30;
    const uint32_t part_32 = holds_2 ? (holds_7 ? part_30 : part_23) : (holds_3 ? part_30 : part_23);
    const uint32_t part_33 = 0u
            + ((part_25 < 0x80000000u) ? ((part_25 / 1048576u) * 1u) : (0u - (((0u - part_25) / 1048576u) * 1u)));
    const float part_34 = unit_link * (float)drive_signed(sample->lost_link ? (holds_4 ? part_28 : at_link)
            : (sample->lost_motor ? (holds_4 ? part_22 : part_10) : (holds ? part_29 : part_22)));
    const float part_35 = holds ? part_34 : (part_34 + state->p_link);
    const bool holds_8 = (part_35 < (-1.57079637e0f)) || (part_35 > 1.57079637e0f);
    const float part_36 = (3.14159274e0f - ((part_35 < 0.0f) ? (-part_35) : (part_35 + 0.0f))) + (-8.74227766e-8f);
    const float part_37 = holds_8 ? ((part_35 < 0.0f) ? (-part_36) : part_36) : part_35;
    const float part_38 = holds_8 ? (-gravity) : gravity;
    const float part_39 = part_37 * part_37;
    const float part_40 = gravity * part_37;
    const float g_sin = part_40
            + (part_40 * (part_39 * ((((((2.59986177e-6f * part_39) + (-1.98065289e-4f)) * part_39)
            + 8.33301619e-3f) * part_39) + (-1.66666567e-1f))));
    if (!holds) {
        const uint32_t last_motor = sample->lost_motor ? state->last_motor : count_motor;
        const uint32_t turn = sample->lost_motor ? part_12 : part_24;
        between->g_sin = g_sin;
        between->g_cos = part_38
                + (part_38 * (part_39 * ((((((2.31924023e-5f * part_39) + (-1.38558447e-3f)) * part_39)
                + 4.16639782e-2f) * part_39) + (-4.99999315e-1f))));
        between->missing = false;
        between->stepped = false;
        between->begins = false;
        state->fresh = false;
        state->last_link = last_link;
        state->last_motor = last_motor;
        state->at_link = at_link;
        state->at_motor = at_motor;
        state->turn = turn;
        return true;
    }
    const bool holds_9 = state->doubt <= start_ticks;
    const float part_41 = state->doubt
            - ((((period * ((part_6 < 0.0f) ? (-part_6) : (part_6 + 0.0f))) > part_4)
            && ((period * ((part_19 < 0.0f) ? (-part_19) : (part_19 + 0.0f))) > part_17)) ? (0.5f * start_ticks)
            : 1.0f);
    const bool holds_10 = part_41 <= 0.0f;
    const float part_42 = part_34 + 0.0f;
    const bool holds_11 = (part_42 < (-1.57079637e0f)) || (part_42 > 1.57079637e0f);
    const float part_43 = holds_11 ? (-gravity) : gravity;
    const float part_44 = (3.14159274e0f - ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) + (-8.74227766e-8f);
    const float part_45 = holds_11 ? ((part_42 < 0.0f) ? (-part_44) : part_44) : part_42;
    const float part_46 = part_45 * part_45;
    const float part_47 = gravity * part_45;
    const bool answer = (!sample->lost_link) && (!sample->lost_motor) && holds_2 && holds_5 && holds_9 && holds_10;
    const bool holds_12 = !holds_2;
    const bool holds_13 = !holds_9;
    const uint32_t last_motor = sample->lost_motor ? state->last_motor : count_motor;
    const uint32_t turn = sample->lost_motor ? part_12 : part_24;
    between->g_sin = part_47
            + (part_47 * (part_46 * ((((((2.59986177e-6f * part_46) + (-1.98065289e-4f)) * part_46)
            + 8.33301619e-3f) * part_46) + (-1.66666567e-1f))));
    between->g_cos = part_43
            + (part_43 * (part_46 * ((((((2.31924023e-5f * part_46) + (-1.38558447e-3f)) * part_46)
            + 4.16639782e-2f) * part_46) + (-4.99999315e-1f))));
    between->missing = false;
    between->stepped = false;
    between->begins = true;
    if (answer) {
        state->reach = 0.0f;
    }
    state->fresh = sample->lost_link || sample->lost_motor || holds_12 || holds_6 || holds_13 || (!holds_10);
    state->last_link = last_link;
    state->last_motor = last_motor;
    state->at_link = sample->lost_link ? (holds_3 ? part_28 : at_link)
            : (sample->lost_motor ? (holds_3 ? part_22 : part_10) : part_29);
    state->at_motor = sample->lost_link ? (holds_3 ? part_31 : at_motor)
            : (sample->lost_motor ? (holds_3 ? part_23 : part_11) : part_32);
    state->turn = sample->lost_link ? (holds_3 ? (sample->lost_motor ? part_24 : part_33) : turn)
            : (sample->lost_motor ? (holds_3 ? part_24 : part_12)
            : (holds_2 ? (holds_7 ? part_33 : part_24) : (holds_3 ? part_33 : part_24)));
    state->push_link = 0.5f * ((unit_motor * (float)drive_signed(sample->lost_link ? (holds_4 ? part_31 : at_motor)
            : (sample->lost_motor ? (holds_4 ? part_23 : part_11) : (holds ? part_32 : part_23))))
            + ((gravity * part_34) - g_sin));
    state->push_motor = half_spring * part_34;
    state->p_link = 0.0f;
    state->v_link = sample->lost_link ? 0.0f : (holds_2 ? part_6 : part_5);
    state->d_dot_link = 0.0f;
    state->p_motor = 0.0f;
    state->v_motor = sample->lost_motor ? 0.0f : (holds_5 ? part_19 : part_18);
    state->d_dot_motor = 0.0f;
    state->smoothed_link = 0.0f;
    state->level_link = 0.0f;
    state->smoothed_motor = 0.0f;
    state->level_motor = 0.0f;
    state->missed_link = 0.0f;
    state->missed_motor = 0.0f;
    state->off_link = 0.0f;
    state->off_motor = 0.0f;
    state->doubt = (sample->lost_link || sample->lost_motor || holds_12 || holds_6 || holds_13
            || (part_41 > start_ticks)) ? start_ticks : ((part_41 < 0.0f) ? 0.0f : part_41);
    state->offset = 0.0f;
    state->held = fallback;
    return answer;
}

/* Part of a tick: predicts the counts, accepts or rejects them, and updates the observers. Returns
 * false if more consecutive samples are missing than the observers can bridge. */
static inline bool drive_observe(drive_state *state, const drive_sample *sample, drive_between *between)
{
    DRIVE_AS_WRITTEN
    static const float unit_link = 5.99211262e-6f; /* one count */
    static const float kappa_link = 4.01304359e1f; /* stiffness of the coupled model, 1/s^2 */
    static const float g2_link = 2.49990379e-4f; /* coupled model of a tick */
    static const float g1_link = 3.12492006e-8f; /* coupled model of a tick */
    static const float phi_link = 9.99922633e-1f; /* coupled model of a tick */
    static const float h1_link = 2.60411679e-12f; /* coupled model of a tick */
    static const float period = 2.50000012e-4f; /* T, s */
    static const float half_span_motor = 1.22931885e2f; /* half a counter */
    static const float gate_link = 1.21685051e-4f; /* innovation gate */
    static const float step_price_link = 1.90985930e0f; /* cost of a position step, plus 1 each; 4 in 0.1 s are too many */
    static const float agreement_link = 1.52106313e-5f; /* tolerance of consistent counts per tick */
    static const float lost_ticks = 50.0f; /* largest number of consecutive missing samples */
    static const float unit_motor = 2.34473962e-4f; /* one count */
    static const float kappa_motor = 9.66702441e3f; /* stiffness of the coupled model, 1/s^2 */
    static const float b = 5.00163428e3f;
    static const float g2_motor = 2.47640099e-4f; /* coupled model of a tick */
    static const float g1_motor = 3.10535526e-8f; /* coupled model of a tick */
    static const float phi_motor = 9.81080234e-1f; /* coupled model of a tick */
    static const float h1_motor = 2.59189675e-12f; /* coupled model of a tick */
    static const float gate_motor = 9.45853069e-2f; /* innovation gate */
    static const float step_price_motor = 4.88075167e-2f; /* cost of a position step, plus 1 each; 4 in 0.1 s are too many */
    static const float agreement_motor = 1.18231634e-2f; /* tolerance of consistent counts per tick */
    static const float gravity = 1.0f; /* weight of the link divided by its inertia, 1/s^2 */
    static const float half_spring = 1.89137438e5f; /* k1 k2/2 */
    static const float smoothing_link = 7.99555853e-2f; /* 1 - e^(-T/3 ms), by default */
    static const float calm_link = 8.98816870e-6f; /* smoothed innovation at which the high gains begin */
    static const float rate_link = 6.67544219e4f; /* slope of the high gains over the innovation */
    static const float keep_link = 9.87577796e-1f; /* e^(-T/20 ms), by default */
    static const float more_link_1 = 1.10361390e-1f; /* observer gain, high minus base */
    static const float gain_link_1 = 6.04966693e-2f; /* observer gain */
    static const float more_link_2 = 5.07886696e1f; /* observer gain, high minus base */
    static const float gain_link_2 = 6.78339624e0f; /* observer gain */
    static const float more_link_3 = 9.68161816e3f; /* observer gain, high minus base */
    static const float gain_link_3 = 3.97201752e2f; /* observer gain */
    static const float more_link_4 = 7.45536875e5f; /* observer gain, high minus base */
    static const float gain_link_4 = 9.92674219e3f; /* observer gain */
    static const float smoothing_motor = 7.99555853e-2f; /* 1 - e^(-T/3 ms), by default */
    static const float calm_motor = 3.51710944e-4f; /* smoothed innovation at which the high gains begin */
    static const float rate_motor = 1.70594629e3f; /* slope of the high gains over the innovation */
    static const float keep_motor = 9.87577796e-1f; /* e^(-T/20 ms), by default */
    static const float more_motor_1 = 1.22307785e-1f; /* observer gain, high minus base */
    static const float gain_motor_1 = 3.10440987e-1f; /* observer gain */
    static const float more_motor_2 = 2.31073593e2f; /* observer gain, high minus base */
    static const float gain_motor_2 = 2.03354401e2f; /* observer gain */
    static const float more_motor_3 = 172145.0f; /* observer gain, high minus base */
    static const float gain_motor_3 = 8.32306016e4f; /* observer gain */
    static const float more_motor_4 = 46685356.0f; /* observer gain, high minus base */
    static const float gain_motor_4 = 12985171.0f; /* observer gain */
    static const float closing = 9.96007979e-1f; /* closing rate of the innovation gate after a re-tune */
    static const float forgetting = 9.97503102e-1f; /* e^(-T/0.1 s), for the cost of position steps */
    const uint32_t count_link = sample->count_link;
    const uint32_t count_motor = sample->count_motor;

    /* 1. Where the counts are, and whether they are believed. */
    const bool holds = !sample->lost_motor;
    const bool holds_2 = !sample->lost_link;
    const float part = (state->push_link + state->push_link) + state->d_link;
    const float part_2 = part - (kappa_link * ((unit_link * (float)drive_signed(state->at_link)) + state->p_link));
    const float part_3 = g2_link * state->v_link;
    float p_link = state->p_link + (part_3 + (g1_link * part_2));
    const float part_4 = h1_link * state->d_dot_link;
    p_link += part_4;
    const float d_link = state->d_link + (period * state->d_dot_link);
    const float part_5 = half_span_motor + half_span_motor;
    const float part_6 = part_5 + part_5;
    const uint32_t part_7 = (((count_link - state->last_link) & 0xfffffu) ^ 0x80000u) - 0x80000u;
    const float part_8 = unit_link * (float)drive_signed(part_7);
    const float p1 = p_link - part_8;
    const bool holds_3 = (p1 >= (-(gate_link + state->reach))) && (p1 <= (gate_link + state->reach));
    const bool holds_4 = holds_2 && holds_3;
    const float part_9 = state->missed_link + 1.0f;
    const float part_10 = state->doubt + ((step_price_link * ((p1 < 0.0f) ? (-p1) : (p1 + 0.0f))) + 1.0f);
    const float part_11 = agreement_link * state->missed_link;
    const float part_12 = part_11 - gate_link;
    const float part_13 = p1 - state->off_link;
    const float part_14 = ((part_11 + gate_link) - ((part_12 < 0.0f) ? (-part_12) : (part_12 + 0.0f)))
            - (((part_13 < 0.0f) ? (-part_13) : (part_13 + 0.0f)) + ((part_13 < 0.0f) ? (-part_13) : (part_13 + 0.0f)));
    const float part_15 = (gate_link * (part_9 * part_9)) - ((p1 < 0.0f) ? (-p1) : (p1 + 0.0f));
    const float part_16 = 4.0f - part_10;
    const float part_17 = ((period * ((state->v_link < 0.0f) ? (-state->v_link)
            : (state->v_link + 0.0f))) > (agreement_link + agreement_link)) ? 1.0f : (state->missed_link - 8.0f);
    const float part_18 = part_14 - part_15;
    const float part_19 = (part_14 + part_15) - ((part_18 < 0.0f) ? (-part_18) : (part_18 + 0.0f));
    const float part_20 = part_16 - part_17;
    const float part_21 = (part_16 + part_17) - ((part_20 < 0.0f) ? (-part_20) : (part_20 + 0.0f));
    const float part_22 = part_19 - part_21;
    const bool holds_5 = ((part_19 + part_21) - ((part_22 < 0.0f) ? (-part_22) : (part_22 + 0.0f))) >= 0.0f;
    const bool holds_6 = holds_3 || holds_5;
    const bool holds_7 = (!holds_3) && holds_5;
    const bool holds_8 = holds_2 && holds_6;
    const float part_23 = holds_8 ? 0.0f : (state->p_link + part_3);
    const float part_24 = (holds_2 && holds_7) ? part_10 : state->doubt;
    const uint32_t at_link = holds_8 ? (state->at_link + part_7) : state->at_link;
    const float part_25 = ((state->missed_link < 0.0f) ? (-state->missed_link) : (state->missed_link + 0.0f)) + 1.0f;
    const bool holds_9 = part_25 <= lost_ticks;
    const float part_26 = unit_link * (float)drive_signed(at_link);
    const float part_27 = part - (kappa_link * (part_26 + state->p_link));
    const float part_28 = (state->p_link + (part_3 + (g1_link * part_27))) + part_4;
    const float part_29 = part_26 + part_23;
    const float part_30 = (state->push_motor + state->push_motor) + state->d_motor;
    const float part_31 = b * state->held;
    const float part_32 = (part_30
            - (kappa_motor * ((unit_motor * (float)drive_signed(state->at_motor)) + state->p_motor))) + part_31;
    const float part_33 = g2_motor * state->v_motor;
    float p_motor = state->p_motor + (part_33 + (g1_motor * part_32));
    const float part_34 = h1_motor * state->d_dot_motor;
    p_motor += part_34;
    const float d_motor = state->d_motor + (period * state->d_dot_motor);
    const uint32_t part_35 = (((count_motor - state->last_motor) & 0xfffffu) ^ 0x80000u) - 0x80000u;
    const float part_36 = unit_motor * (float)drive_signed(part_35);
    const float p2 = p_motor - part_36;
    const bool holds_10 = (p2 >= (-(gate_motor + state->reach))) && (p2 <= (gate_motor + state->reach));
    const bool holds_11 = !holds_10;
    const float part_37 = state->missed_motor + 1.0f;
    const float part_38 = part_24 + ((step_price_motor * ((p2 < 0.0f) ? (-p2) : (p2 + 0.0f))) + 1.0f);
    const float part_39 = agreement_motor * state->missed_motor;
    const float part_40 = part_39 - gate_motor;
    const float part_41 = p2 - state->off_motor;
    const float part_42 = ((part_39 + gate_motor) - ((part_40 < 0.0f) ? (-part_40) : (part_40 + 0.0f)))
            - (((part_41 < 0.0f) ? (-part_41) : (part_41 + 0.0f)) + ((part_41 < 0.0f) ? (-part_41) : (part_41 + 0.0f)));
    const float part_43 = (gate_motor * (part_37 * part_37)) - ((p2 < 0.0f) ? (-p2) : (p2 + 0.0f));
    const float part_44 = 4.0f - part_38;
    const float part_45 = ((period * ((state->v_motor < 0.0f) ? (-state->v_motor)
            : (state->v_motor + 0.0f))) > (agreement_motor + agreement_motor)) ? 1.0f : (state->missed_motor - 8.0f);
    const float part_46 = part_42 - part_43;
    const float part_47 = (part_42 + part_43) - ((part_46 < 0.0f) ? (-part_46) : (part_46 + 0.0f));
    const float part_48 = part_44 - part_45;
    const float part_49 = (part_44 + part_45) - ((part_48 < 0.0f) ? (-part_48) : (part_48 + 0.0f));
    const float part_50 = part_47 - part_49;
    const bool holds_12 = ((part_47 + part_49) - ((part_50 < 0.0f) ? (-part_50) : (part_50 + 0.0f))) >= 0.0f;
    const bool holds_13 = holds_10 || holds_12;
    const bool holds_14 = holds && holds_13;
    const bool holds_15 = holds_11 && holds_12;
    const bool holds_16 = holds && holds_15;
    const uint32_t at_motor = holds_14 ? (state->at_motor + part_35) : state->at_motor;
    const float part_51 = ((state->missed_motor < 0.0f) ? (-state->missed_motor) : (state->missed_motor + 0.0f)) + 1.0f;
    const bool holds_17 = part_51 <= lost_ticks;
    const float part_52 = unit_motor * (float)drive_signed(at_motor);
    const float part_53 = (part_30 - (kappa_motor * (part_52 + state->p_motor))) + part_31;
    const float part_54 = (state->p_motor + (part_33 + (g1_motor * part_53))) + part_34;

    /* 2. Couplings. */
    const bool holds_18 = (part_29 < (-1.57079637e0f)) || (part_29 > 1.57079637e0f);
    const float part_55 = (3.14159274e0f - ((part_29 < 0.0f) ? (-part_29) : (part_29 + 0.0f))) + (-8.74227766e-8f);
    const float part_56 = holds_18 ? ((part_29 < 0.0f) ? (-part_55) : part_55) : part_29;
    const float part_57 = holds_18 ? (-gravity) : gravity;
    const float part_58 = part_56 * part_56;
    const float part_59 = gravity * part_56;
    const float part_60 = part_59
            + (part_59 * (part_58 * ((((((2.59986177e-6f * part_58) + (-1.98065289e-4f)) * part_58)
            + 8.33301619e-3f) * part_58) + (-1.66666567e-1f))));
    const float part_61 = part_57
            + (part_57 * (part_58 * ((((((2.31924023e-5f * part_58) + (-1.38558447e-3f)) * part_58)
            + 4.16639782e-2f) * part_58) + (-4.99999315e-1f))));
    const float push_link = 0.5f * ((part_52 + (holds_14 ? 0.0f : (state->p_motor + part_33)))
            + ((gravity * part_29) - part_60));
    const float push_motor = half_spring * part_29;

    /* 3. Observers. */
    const float part_62 = push_link - state->push_link;
    const float p1_2 = (sample->lost_link ? p_link : (holds_3 ? p1 : (holds_5 ? 0.0f : part_28))) + (g1_link * part_62);
    const float part_63 = ((phi_link * state->v_link)
            + (g2_link * (((sample->lost_link || holds_6) ? part_2 : part_27) + part_62)))
            + (g1_link * state->d_dot_link);
    const float smoothed_link = state->smoothed_link - (smoothing_link * (p1_2 + state->smoothed_link));
    const float part_64 = (((smoothed_link < 0.0f) ? (-smoothed_link) : (smoothed_link + 0.0f))
            - calm_link) * rate_link;
    const float part_65 = state->level_link * keep_link;
    const float part_66 = (part_64 > part_65) ? part_64 : part_65;
    const float level_link = (part_66 > 1.0f) ? 1.0f : ((part_66 < 0.0f) ? 0.0f : part_66);
    const float p1_3 = holds_4 ? (p1_2 - ((gain_link_1 + (level_link * more_link_1)) * p1_2)) : p1_2;
    const float part_67 = push_motor - state->push_motor;
    const float p2_2 = (sample->lost_motor ? p_motor : (holds_10 ? p2 : (holds_12 ? 0.0f : part_54)))
            + (g1_motor * part_67);
    const float part_68 = ((phi_motor * state->v_motor)
            + (g2_motor * (((sample->lost_motor || holds_13) ? part_32 : part_53) + part_67)))
            + (g1_motor * state->d_dot_motor);
    const float smoothed_motor = state->smoothed_motor - (smoothing_motor * (p2_2 + state->smoothed_motor));
    const float part_69 = (((smoothed_motor < 0.0f) ? (-smoothed_motor) : (smoothed_motor + 0.0f))
            - calm_motor) * rate_motor;
    const float part_70 = state->level_motor * keep_motor;
    const float part_71 = (part_69 > part_70) ? part_69 : part_70;
    const float level_motor = (part_71 > 1.0f) ? 1.0f : ((part_71 < 0.0f) ? 0.0f : part_71);
    const float part_72 = p1_3 - part_23;
    const float part_73 = part_72 * part_60;
    const bool holds_19 = holds_11 && (!holds_12);
    const bool holds_20 = holds_10 || holds_12 || holds_17;
    const float d_link_2 = holds_4 ? (d_link - ((gain_link_3 + (level_link * more_link_3)) * p1_2)) : d_link;
    const float d_dot_link = holds_4 ? (state->d_dot_link - ((gain_link_4 + (level_link * more_link_4)) * p1_2))
            : state->d_dot_link;
    const bool holds_21 = holds && holds_10;
    const float p2_3 = holds_21 ? (p2_2 - ((gain_motor_1 + (level_motor * more_motor_1)) * p2_2)) : p2_2;
    const float d_motor_2 = holds_21 ? (d_motor - ((gain_motor_3 + (level_motor * more_motor_3)) * p2_2)) : d_motor;
    const float d_dot_motor = holds_21 ? (state->d_dot_motor - ((gain_motor_4 + (level_motor * more_motor_4)) * p2_2))
            : state->d_dot_motor;
    between->g_sin = part_60 + (part_72 * (part_61 - (0.5f * part_73)));
    between->g_cos = part_61 - part_73;
    between->missing = sample->lost_link || sample->lost_motor || (holds_3 ? holds_19 : ((!holds_5) || holds_19));
    between->stepped = sample->lost_link ? holds_16
            : (sample->lost_motor ? holds_7 : (holds_3 ? holds_15 : (holds_5 || holds_15)));
    between->begins = false;
    if (holds_8) {
        state->last_link = count_link;
    }
    if (holds_14) {
        state->last_motor = count_motor;
    }
    if (holds_4) {
        state->smoothed_link = smoothed_link;
        state->level_link = level_link;
    }
    if (holds_21) {
        state->smoothed_motor = smoothed_motor;
        state->level_motor = level_motor;
    }
    state->at_link = at_link;
    state->at_motor = at_motor;
    state->push_link = push_link;
    state->push_motor = push_motor;
    state->p_link = p1_3;
    state->v_link = holds_4 ? (part_63 - ((gain_link_2 + (level_link * more_link_2)) * p1_2)) : part_63;
    state->d_link = d_link_2;
    state->d_dot_link = d_dot_link;
    state->p_motor = p2_3;
    state->v_motor = holds_21 ? (part_68 - ((gain_motor_2 + (level_motor * more_motor_2)) * p2_2)) : part_68;
    state->d_motor = d_motor_2;
    state->d_dot_motor = d_dot_motor;
    state->reach = state->reach * closing;
    state->missed_link = holds_8 ? 0.0f : part_25;
    state->missed_motor = holds_14 ? 0.0f : part_51;
    state->off_link = sample->lost_link ? part_6 : (holds_6 ? state->off_link : (part_28 - part_8));
    state->off_motor = sample->lost_motor ? part_6 : (holds_13 ? state->off_motor : (part_54 - part_36));
    state->doubt = (holds_16 ? part_38 : part_24) * forgetting;
    return holds_8 ? (sample->lost_motor ? holds_17 : holds_20)
            : (sample->lost_motor ? (holds_9 && holds_17) : (holds_9 && holds_20));
}

/* Part of a tick: the control law and the update of the state. */
static inline unsigned drive_law(drive_state *state, const drive_sample *sample, const drive_between *between,
    drive_output *output)
{
    DRIVE_AS_WRITTEN
    static const float unit_link = 5.99211262e-6f; /* one count */
    static const float unit_motor = 2.34473962e-4f; /* one count */
    static const float k1 = 3.91304359e1f; /* K_s/J_l, 1/s^2; x_3 is k1 times the motor's angle */
    static const float b1 = 3.04347813e-1f; /* damping of the link, 1/s */
    static const float kappa_motor = 9.66702441e3f; /* stiffness of the coupled model, 1/s^2 */
    static const float b2 = 7.51879730e1f; /* damping of the motor, 1/s */
    static const float full_turn = 6.28318548e0f; /* 2 pi */
    static const float u_min = -30.0f; /* limit, A */
    static const float u_max = 30.0f; /* limit, A */
    static const float most = 30.0f;
    static const float far_per_u = 8.01729225e-3f; /* limit of e_1 */
    static const float far = 2.40518764e-1f; /* limit of e_1 */
    static const float input_limit = 9.99999996e11f; /* largest valid number */
    static const float c_1 = 8000.0f; /* surface */
    static const float c_2 = 1200.0f; /* surface */
    static const float c_3 = 60.0f; /* surface */
    static const float c_d_link = 5.96956520e1f; /* surface, on d */
    static const float c_growth_link = 1.0f; /* surface, on d' */
    static const float cross = -3.90378075e1f; /* b1^2 - k1 */
    static const float per_b = 1.99934642e-4f; /* 1/b */
    static const float kx_2 = -1.60229874e0f; /* law, on the errors */
    static const float kx_3 = -2.40432084e-1f; /* law, on the errors */
    static const float kx_4 = -1.18051860e-2f; /* law, on the errors */
    static const float k_d_link = -2.36839205e-1f; /* law, on d */
    static const float k_growth_link = -2.96063299e-5f; /* law, on d' */
    static const float k_last = -2.50076866e-8f; /* law, on d' in the last channel */
    static const float feed_4 = 8.07309091e-1f; /* feed-forward, on the change of the reference in the tick */
    static const float feed_1 = 9.69426334e-1f; /* feed-forward, on the change of the reference in the tick */
    static const float feed_2 = 5.97625554e-1f; /* feed-forward, on the change of the reference in the tick */
    static const float feed_3 = 9.75745440e-1f; /* feed-forward, on the change of the reference in the tick */
    static const float kw = -2.00067461e-3f; /* law, on the offset W */
    static const float hold = 0.0f; /* output of a rejected tick: hold u + fallback */
    static const float fallback = 0.0f; /* fallback, A */
    static const float decay = 2.49687769e-3f; /* 1 - e^(-alpha T) */
    static const float k_offset = 1.80310905e-2f; /* law, on W if us acts on sigma */
    static const float us = -2.00317632e-2f; /* law, on sigma* */
    static const float plausible = 15360.0f; /* a demand above it is checked, A */
    const float part = (unit_link * (float)drive_signed(state->at_link)) + state->p_link;

    /* 4. The chain. */
    const float part_2 = -(k1 + between->g_cos);
    const float part_3 = ((unit_motor * (float)drive_signed(state->at_motor)) + state->p_motor) - (k1 * part);
    const float part_4 = (part_3 - (b1 * state->v_link)) - between->g_sin;
    const float sigma = (state->v_motor + (part_2 * state->v_link)) - (b1 * part_4);

    /* 5. Law. */
    const float part_5 = part
            - ((full_turn * (float)drive_signed((uint32_t)sample->begin.turn - state->turn)) + sample->begin.r);
    const float v_link = state->v_link - sample->begin.r_dot;
    const float part_6 = part_4 - sample->begin.r_ddot;
    const float sigma_2 = sigma - sample->begin.r_dddot;
    const float part_7 = -(((-u_min) > ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)))
            ? ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)) : (-u_min));
    const float part_8 = (u_max > ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)))
            ? ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)) : u_max;
    const bool holds = (state->limit > (-most)) && (state->limit < most);
    const float part_9 = holds ? part_7 : u_min;
    const float part_10 = holds ? part_8 : u_max;
    const float part_11 = holds ? (far_per_u * ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))) : far;
    const bool holds_2 = (part_5 >= (-part_11)) && (part_5 <= part_11);
    if (!between->begins) {
        if (!holds_2) {
            const bool holds_3 = (part_5 >= (-input_limit)) && (part_5 <= input_limit);
            if (!holds_3) {
                const float part_44 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit))
                        ? state->held : 0.0f)) + fallback;
                const float part_45 = (part_44 > part_8) ? part_8 : part_44;
                const float u_2 = (part_45 < part_7) ? part_7 : part_45;
                output->u = u_2;
                output->sigma = 0.0f;
                output->sigma_star = 0.0f;
                state->held = u_2;
                return (unsigned)DRIVE_INPUT_REJECTED;
            }
            const float part_12 = ((part_5 < 0.0f) ? (-part_5) : (part_5 + 0.0f)) - part_11;
            const float part_13 = 3.0f * part_11;
            const float part_14 = part_12 - part_13;
            const float part_15 = 0.5f * ((part_12 + part_13) - ((part_14 < 0.0f) ? (-part_14) : (part_14 + 0.0f)));
            const float part_16 = part_12 - part_15;
            const float part_17 = 4.0f * part_13;
            const float part_18 = 0.5f * 3.33333343e-1f;
            const float part_19 = part_16 - part_17;
            const float part_20 = 0.5f * ((part_16 + part_17) - ((part_19 < 0.0f) ? (-part_19) : (part_19 + 0.0f)));
            const float part_21 = part_16 - part_20;
            const float part_22 = 4.0f * part_17;
            const float part_23 = 0.5f * part_18;
            const float part_24 = part_21 - part_22;
            const float part_25 = 0.5f * ((part_21 + part_22) - ((part_24 < 0.0f) ? (-part_24) : (part_24 + 0.0f)));
            const float part_26 = part_21 - part_25;
            const float part_27 = 4.0f * part_22;
            const float part_28 = part_26 - part_27;
            const float part_29 = (((part_11 + (3.33333343e-1f * part_15)) + (part_18 * part_20))
                    + (part_23 * part_25))
                    + ((0.5f * part_23) * (0.5f * ((part_26 + part_27)
                    - ((part_28 < 0.0f) ? (-part_28) : (part_28 + 0.0f)))));
            const float part_30 = (part_5 > 0.0f) ? part_29 : (-part_29);
            float sigma_7 = sigma_2 + (c_1 * part_30);
            const float part_31 = c_2 * v_link;
            sigma_7 += part_31;
            const float part_32 = c_3 * part_6;
            sigma_7 += part_32;
            const float part_33 = c_d_link * state->d_link;
            sigma_7 += part_33;
            const float part_34 = c_growth_link * state->d_dot_link;
            sigma_7 += part_34;
            const float part_35 = cross - between->g_cos;
            float bare = -(per_b * (((((((between->g_sin * state->v_link) * state->v_link) - (kappa_motor * part_3))
                    - (b2 * state->v_motor)) + (part_2 * part_4)) - (b1 * sigma))
                    + (state->d_motor + (part_35 * state->d_link))));
            bare += kx_2 * v_link;
            bare += kx_3 * part_6;
            bare += kx_4 * sigma_2;
            bare += k_d_link * state->d_link;
            bare += k_growth_link * state->d_dot_link;
            bare += k_last * (state->d_dot_motor + (part_35 * state->d_dot_link));
            const float part_36 = sample->end.r - sample->begin.r;
            const float part_37 = (float)drive_signed((uint32_t)sample->end.turn - (uint32_t)sample->begin.turn);
            bare += (((feed_4 * (sample->end.r_dddot - sample->begin.r_dddot))
                    + (feed_1 * ((part_37 != 0.0f) ? (part_36 + (full_turn * part_37)) : part_36)))
                    + (feed_2 * (sample->end.r_dot - sample->begin.r_dot)))
                    + (feed_3 * (sample->end.r_ddot - sample->begin.r_ddot));
            const float part_46 = bare + (k_offset * state->offset);
            const float demand_2 = part_46 + (us * sigma_7);
            if ((demand_2 >= (-plausible)) && (demand_2 <= plausible)) {
                const float u_6 = (part_10 < demand_2) ? part_10 : ((demand_2 < part_9) ? part_9 : demand_2);

                /* 6. Memory. */
                const float offset = state->offset - (decay * state->offset);
                const float part_42 = state->reported + 1.0f;
                const float part_43 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                        + ((((part_42 < (-1.0f)) || (part_42 > 1.0f)) ? 1.0f
                        : ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) * (0.015625f * most));
                const float limit = holds ? ((part_43 > most) ? most : part_43) : state->limit;
                output->u = u_6;
                output->sigma = sigma_7;
                output->sigma_star = 0.0f;
                state->offset = offset;
                state->held = u_6;
                state->limit = limit;
                return (u_6 != demand_2) ? (unsigned)DRIVE_SATURATED : 0u;
            }
            const float part_48 = bare + (kw * sigma_7);
            if (!((part_48 >= (-input_limit)) && (part_48 <= input_limit))) {
                const float part_44 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit))
                        ? state->held : 0.0f)) + fallback;
                const float part_45 = (part_44 > part_8) ? part_8 : part_44;
                const float part_42 = state->reported + 1.0f;
                const float part_43 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                        + ((((part_42 < (-1.0f)) || (part_42 > 1.0f)) ? 1.0f
                        : ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) * (0.015625f * most));
                const float limit = holds ? ((part_43 > most) ? most : part_43) : state->limit;
                const float u_2 = (part_45 < part_7) ? part_7 : part_45;
                output->u = u_2;
                output->sigma = 0.0f;
                output->sigma_star = 0.0f;
                state->held = u_2;
                state->limit = limit;
                return (unsigned)DRIVE_INPUT_REJECTED;
            }
            const float u_7 = (part_10 < part_48) ? part_10 : ((part_48 < part_9) ? part_9 : part_48);

            /* 6. Memory. */
            const float sigma_8 = sigma_7 - (decay * sigma_7);
            const float part_42 = state->reported + 1.0f;
            const float part_43 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                    + ((((part_42 < (-1.0f)) || (part_42 > 1.0f)) ? 1.0f
                    : ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) * (0.015625f * most));
            const float limit = holds ? ((part_43 > most) ? most : part_43) : state->limit;
            output->u = u_7;
            output->sigma = sigma_7;
            output->sigma_star = 0.0f;
            state->offset = sigma_8;
            state->held = u_7;
            state->limit = limit;
            return (u_7 != part_48) ? (unsigned)DRIVE_SATURATED : 0u;
        }
        float sigma_5 = sigma_2 + (c_1 * part_5);
        const float part_31 = c_2 * v_link;
        sigma_5 += part_31;
        const float part_32 = c_3 * part_6;
        sigma_5 += part_32;
        const float part_33 = c_d_link * state->d_link;
        sigma_5 += part_33;
        const float part_34 = c_growth_link * state->d_dot_link;
        sigma_5 += part_34;
        const float part_35 = cross - between->g_cos;
        float bare = -(per_b * (((((((between->g_sin * state->v_link) * state->v_link) - (kappa_motor * part_3))
                - (b2 * state->v_motor)) + (part_2 * part_4)) - (b1 * sigma))
                + (state->d_motor + (part_35 * state->d_link))));
        bare += kx_2 * v_link;
        bare += kx_3 * part_6;
        bare += kx_4 * sigma_2;
        bare += k_d_link * state->d_link;
        bare += k_growth_link * state->d_dot_link;
        bare += k_last * (state->d_dot_motor + (part_35 * state->d_dot_link));
        const float part_36 = sample->end.r - sample->begin.r;
        const float part_37 = (float)drive_signed((uint32_t)sample->end.turn - (uint32_t)sample->begin.turn);
        bare += (((feed_4 * (sample->end.r_dddot - sample->begin.r_dddot))
                + (feed_1 * ((part_37 != 0.0f) ? (part_36 + (full_turn * part_37)) : part_36)))
                + (feed_2 * (sample->end.r_dot - sample->begin.r_dot)))
                + (feed_3 * (sample->end.r_ddot - sample->begin.r_ddot));
        const float sigma_star = sigma_5 - state->offset;
        const float part_46 = bare + (k_offset * state->offset);
        const float demand = part_46 + (us * sigma_5);
        if ((demand >= (-plausible)) && (demand <= plausible)) {
            const float u_4 = (part_10 < demand) ? part_10 : ((demand < part_9) ? part_9 : demand);

            /* 6. Memory. */
            const float offset = state->offset - (decay * state->offset);
            const float part_42 = state->reported + 1.0f;
            const float part_43 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                    + ((((part_42 < (-1.0f)) || (part_42 > 1.0f)) ? 1.0f
                    : ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) * (0.015625f * most));
            const float limit = holds ? ((part_43 > most) ? most : part_43) : state->limit;
            output->u = u_4;
            output->sigma = sigma_5;
            output->sigma_star = sigma_star;
            state->offset = offset;
            state->held = u_4;
            state->limit = limit;
            return (u_4 != demand) ? (unsigned)DRIVE_SATURATED : 0u;
        }
        const float part_47 = bare + (kw * sigma_5);
        if (!((part_47 >= (-input_limit)) && (part_47 <= input_limit))) {
            const float part_44 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit))
                    ? state->held : 0.0f)) + fallback;
            const float part_45 = (part_44 > part_8) ? part_8 : part_44;
            const float part_42 = state->reported + 1.0f;
            const float part_43 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                    + ((((part_42 < (-1.0f)) || (part_42 > 1.0f)) ? 1.0f
                    : ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) * (0.015625f * most));
            const float limit = holds ? ((part_43 > most) ? most : part_43) : state->limit;
            const float u_2 = (part_45 < part_7) ? part_7 : part_45;
            output->u = u_2;
            output->sigma = 0.0f;
            output->sigma_star = 0.0f;
            state->held = u_2;
            state->limit = limit;
            return (unsigned)DRIVE_INPUT_REJECTED;
        }
        const float u_5 = (part_10 < part_47) ? part_10 : ((part_47 < part_9) ? part_9 : part_47);

        /* 6. Memory. */
        const float sigma_6 = sigma_5 - (decay * sigma_5);
        const float part_42 = state->reported + 1.0f;
        const float part_43 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                + ((((part_42 < (-1.0f)) || (part_42 > 1.0f)) ? 1.0f
                : ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) * (0.015625f * most));
        const float limit = holds ? ((part_43 > most) ? most : part_43) : state->limit;
        output->u = u_5;
        output->sigma = sigma_5;
        output->sigma_star = 0.0f;
        state->offset = sigma_6;
        state->held = u_5;
        state->limit = limit;
        return (u_5 != part_47) ? (unsigned)DRIVE_SATURATED : 0u;
    }
    const bool holds_3 = (part_5 >= (-input_limit)) && (part_5 <= input_limit);
    const float part_12 = ((part_5 < 0.0f) ? (-part_5) : (part_5 + 0.0f)) - part_11;
    const float part_13 = 3.0f * part_11;
    const float part_14 = part_12 - part_13;
    const float part_15 = 0.5f * ((part_12 + part_13) - ((part_14 < 0.0f) ? (-part_14) : (part_14 + 0.0f)));
    const float part_16 = part_12 - part_15;
    const float part_17 = 4.0f * part_13;
    const float part_18 = 0.5f * 3.33333343e-1f;
    const float part_19 = part_16 - part_17;
    const float part_20 = 0.5f * ((part_16 + part_17) - ((part_19 < 0.0f) ? (-part_19) : (part_19 + 0.0f)));
    const float part_21 = part_16 - part_20;
    const float part_22 = 4.0f * part_17;
    const float part_23 = 0.5f * part_18;
    const float part_24 = part_21 - part_22;
    const float part_25 = 0.5f * ((part_21 + part_22) - ((part_24 < 0.0f) ? (-part_24) : (part_24 + 0.0f)));
    const float part_26 = part_21 - part_25;
    const float part_27 = 4.0f * part_22;
    const float part_28 = part_26 - part_27;
    const float part_29 = (((part_11 + (3.33333343e-1f * part_15)) + (part_18 * part_20)) + (part_23 * part_25))
            + ((0.5f * part_23) * (0.5f * ((part_26 + part_27) - ((part_28 < 0.0f) ? (-part_28) : (part_28 + 0.0f)))));
    const float part_30 = (part_5 > 0.0f) ? part_29 : (-part_29);
    float sigma_3 = sigma_2 + (c_1 * (holds_2 ? part_5 : part_30));
    const float part_31 = c_2 * v_link;
    sigma_3 += part_31;
    const float part_32 = c_3 * part_6;
    sigma_3 += part_32;
    const float part_33 = c_d_link * state->d_link;
    sigma_3 += part_33;
    const float part_34 = c_growth_link * state->d_dot_link;
    sigma_3 += part_34;
    const float part_35 = cross - between->g_cos;
    float bare = -(per_b * (((((((between->g_sin * state->v_link) * state->v_link) - (kappa_motor * part_3))
            - (b2 * state->v_motor)) + (part_2 * part_4)) - (b1 * sigma))
            + (state->d_motor + (part_35 * state->d_link))));
    bare += kx_2 * v_link;
    bare += kx_3 * part_6;
    bare += kx_4 * sigma_2;
    bare += k_d_link * state->d_link;
    bare += k_growth_link * state->d_dot_link;
    bare += k_last * (state->d_dot_motor + (part_35 * state->d_dot_link));
    const float part_36 = sample->end.r - sample->begin.r;
    const float part_37 = (float)drive_signed((uint32_t)sample->end.turn - (uint32_t)sample->begin.turn);
    bare += (((feed_4 * (sample->end.r_dddot - sample->begin.r_dddot))
            + (feed_1 * ((part_37 != 0.0f) ? (part_36 + (full_turn * part_37)) : part_36)))
            + (feed_2 * (sample->end.r_dot - sample->begin.r_dot)))
            + (feed_3 * (sample->end.r_ddot - sample->begin.r_ddot));
    const float part_38 = bare + (kw * sigma_3);
    const float part_39 = (holds_2 || holds_3) ? part_38 : state->held;
    const bool holds_4 = (part_39 >= (-input_limit)) && (part_39 <= input_limit);
    const float part_40 = (hold * (holds_4 ? state->held : 0.0f)) + fallback;
    const float part_41 = (part_40 > part_8) ? part_8 : part_40;
    if (!holds_2) {
        if (!holds_3) {
            const float u_3 = (part_41 < part_7) ? part_7 : part_41;
            output->u = u_3;
            output->sigma = 0.0f;
            output->sigma_star = 0.0f;
            state->held = u_3;
            return (unsigned)DRIVE_INPUT_REJECTED;
        }
        if (!holds_4) {
            const float part_44 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit))
                    ? state->held : 0.0f)) + fallback;
            const float part_45 = (part_44 > part_8) ? part_8 : part_44;
            const float part_42 = state->reported + 1.0f;
            const float part_43 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                    + ((((part_42 < (-1.0f)) || (part_42 > 1.0f)) ? 1.0f
                    : ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) * (0.015625f * most));
            const float limit = holds ? ((part_43 > most) ? most : part_43) : state->limit;
            const float u_2 = (part_45 < part_7) ? part_7 : part_45;
            output->u = u_2;
            output->sigma = 0.0f;
            output->sigma_star = 0.0f;
            state->held = u_2;
            state->limit = limit;
            return (unsigned)DRIVE_INPUT_REJECTED;
        }
        const float u = (part_10 < part_38) ? part_10 : ((part_38 < part_9) ? part_9 : part_38);

        /* 6. Memory. */
        const float sigma_4 = sigma_3 - (decay * sigma_3);
        const bool saturated = u != part_38;
        const float part_42 = state->reported + 1.0f;
        const float part_43 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                + ((((part_42 < (-1.0f)) || (part_42 > 1.0f)) ? 1.0f
                : ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) * (0.015625f * most));
        const float limit = holds ? ((part_43 > most) ? most : part_43) : state->limit;
        output->u = u;
        output->sigma = sigma_3;
        output->sigma_star = 0.0f;
        state->offset = sigma_4;
        state->held = u;
        state->limit = limit;
        return saturated ? (unsigned)DRIVE_SATURATED : 0u;
    }
    if (!holds_4) {
        const float part_44 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit)) ? state->held
                : 0.0f)) + fallback;
        const float part_45 = (part_44 > part_8) ? part_8 : part_44;
        const float part_42 = state->reported + 1.0f;
        const float part_43 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                + ((((part_42 < (-1.0f)) || (part_42 > 1.0f)) ? 1.0f
                : ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) * (0.015625f * most));
        const float limit = holds ? ((part_43 > most) ? most : part_43) : state->limit;
        const float u_2 = (part_45 < part_7) ? part_7 : part_45;
        output->u = u_2;
        output->sigma = 0.0f;
        output->sigma_star = 0.0f;
        state->held = u_2;
        state->limit = limit;
        return (unsigned)DRIVE_INPUT_REJECTED;
    }
    const float u = (part_10 < part_38) ? part_10 : ((part_38 < part_9) ? part_9 : part_38);

    /* 6. Memory. */
    const float sigma_4 = sigma_3 - (decay * sigma_3);
    const bool saturated = u != part_38;
    const float part_42 = state->reported + 1.0f;
    const float part_43 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
            + ((((part_42 < (-1.0f)) || (part_42 > 1.0f)) ? 1.0f
            : ((part_42 < 0.0f) ? (-part_42) : (part_42 + 0.0f))) * (0.015625f * most));
    const float limit = holds ? ((part_43 > most) ? most : part_43) : state->limit;
    output->u = u;
    output->sigma = sigma_3;
    output->sigma_star = 0.0f;
    state->offset = sigma_4;
    state->held = u;
    state->limit = limit;
    return saturated ? (unsigned)DRIVE_SATURATED : 0u;
}

/* Part of a tick without valid estimates: the output is the fallback, and the observers restart at the
 * counts. */
static inline unsigned drive_give_up(drive_state *state, const drive_sample *sample, drive_output *output)
{
    DRIVE_AS_WRITTEN
    static const float input_limit = 9.99999996e11f; /* largest valid number */
    static const float u_min = -30.0f; /* limit, A */
    static const float u_max = 30.0f; /* limit, A */
    static const float hold = 0.0f; /* output of a rejected tick: hold u + fallback */
    static const float fallback = 0.0f; /* fallback, A */
    static const float start_ticks = 40.0f; /* ticks of consistent counts before a current flows */
    const float part = -(((-u_min) > ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)))
            ? ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)) : (-u_min));
    const float part_2 = (u_max > ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)))
            ? ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)) : u_max;
    const float part_3 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit)) ? state->held
            : 0.0f)) + fallback;
    const float part_4 = (part_3 > part_2) ? part_2 : part_3;
    const float u = (part_4 < part) ? part : part_4;
    const bool waits = (!sample->lost_link) && (!sample->lost_motor);
    output->u = u;
    output->sigma = 0.0f;
    output->sigma_star = 0.0f;
    if (waits) {
        state->fresh = true;
    }
    if (!(sample->lost_link || sample->lost_motor)) {
        state->d_link = 0.0f;
        state->d_motor = 0.0f;
        state->doubt = start_ticks;
    }
    state->reach = 0.0f;
    state->held = u;
    return ((unsigned)DRIVE_INPUT_REJECTED) | ((unsigned)DRIVE_SAMPLE_LOST) | (waits ? (unsigned)DRIVE_WAITS : 0u);
}

/* Part of a tick without a target: the output is the fallback. */
static inline unsigned drive_refuse(drive_state *state, drive_output *output)
{
    DRIVE_AS_WRITTEN
    static const float input_limit = 9.99999996e11f; /* largest valid number */
    static const float u_min = -30.0f; /* limit, A */
    static const float u_max = 30.0f; /* limit, A */
    static const float hold = 0.0f; /* output of a rejected tick: hold u + fallback */
    static const float fallback = 0.0f; /* fallback, A */
    const float part = -(((-u_min) > ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)))
            ? ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)) : (-u_min));
    const float part_2 = (u_max > ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)))
            ? ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)) : u_max;
    const float part_3 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit)) ? state->held
            : 0.0f)) + fallback;
    const float part_4 = (part_3 > part_2) ? part_2 : part_3;
    const float u = (part_4 < part) ? part : part_4;
    output->u = u;
    output->sigma = 0.0f;
    output->sigma_star = 0.0f;
    state->held = u;
    return ((unsigned)DRIVE_INPUT_REJECTED) | ((unsigned)DRIVE_SAMPLE_LOST);
}

/* Predicts over a period without a tick. Returns false if more periods are missing than the model can
 * predict. */
static inline bool drive_pass(drive_state *state)
{
    DRIVE_AS_WRITTEN
    static const float unit_link = 5.99211262e-6f; /* one count */
    static const float kappa_link = 4.01304359e1f; /* stiffness of the coupled model, 1/s^2 */
    static const float g2_link = 2.49990379e-4f; /* coupled model of a tick */
    static const float g1_link = 3.12492006e-8f; /* coupled model of a tick */
    static const float phi_link = 9.99922633e-1f; /* coupled model of a tick */
    static const float h1_link = 2.60411679e-12f; /* coupled model of a tick */
    static const float period = 2.50000012e-4f; /* T, s */
    static const float half_span_motor = 1.22931885e2f; /* half a counter */
    static const float lost_ticks = 50.0f; /* largest number of consecutive missing samples */
    static const float unit_motor = 2.34473962e-4f; /* one count */
    static const float kappa_motor = 9.66702441e3f; /* stiffness of the coupled model, 1/s^2 */
    static const float b = 5.00163428e3f;
    static const float g2_motor = 2.47640099e-4f; /* coupled model of a tick */
    static const float g1_motor = 3.10535526e-8f; /* coupled model of a tick */
    static const float phi_motor = 9.81080234e-1f; /* coupled model of a tick */
    static const float h1_motor = 2.59189675e-12f; /* coupled model of a tick */
    static const float gravity = 1.0f; /* weight of the link divided by its inertia, 1/s^2 */
    static const float half_spring = 1.89137438e5f; /* k1 k2/2 */
    static const float closing = 9.96007979e-1f; /* closing rate of the innovation gate after a re-tune */
    static const float forgetting = 9.97503102e-1f; /* e^(-T/0.1 s), for the cost of position steps */
    static const float decay = 2.49687769e-3f; /* 1 - e^(-alpha T) */

    /* 1. Where the counts are, and whether they are believed. */
    const float part = unit_link * (float)drive_signed(state->at_link);
    const float part_2 = ((state->push_link + state->push_link) + state->d_link)
            - (kappa_link * (part + state->p_link));
    const float part_3 = g2_link * state->v_link;
    float p_link = state->p_link + (part_3 + (g1_link * part_2));
    p_link += h1_link * state->d_dot_link;
    const float d_link = state->d_link + (period * state->d_dot_link);
    const float part_4 = half_span_motor + half_span_motor;
    const float off_link = part_4 + part_4;
    const float missed_link = ((state->missed_link < 0.0f) ? (-state->missed_link) : (state->missed_link + 0.0f))
            + 1.0f;
    const float part_5 = part + (state->p_link + part_3);
    const float part_6 = unit_motor * (float)drive_signed(state->at_motor);
    const float part_7 = (((state->push_motor + state->push_motor) + state->d_motor)
            - (kappa_motor * (part_6 + state->p_motor))) + (b * state->held);
    const float part_8 = g2_motor * state->v_motor;
    float p_motor = state->p_motor + (part_8 + (g1_motor * part_7));
    p_motor += h1_motor * state->d_dot_motor;
    const float d_motor = state->d_motor + (period * state->d_dot_motor);
    const float missed_motor = ((state->missed_motor < 0.0f) ? (-state->missed_motor) : (state->missed_motor + 0.0f))
            + 1.0f;

    /* 2. Couplings. */
    const float part_9 = (3.14159274e0f - ((part_5 < 0.0f) ? (-part_5) : (part_5 + 0.0f))) + (-8.74227766e-8f);
    const float part_10 = ((part_5 < (-1.57079637e0f)) || (part_5 > 1.57079637e0f))
            ? ((part_5 < 0.0f) ? (-part_9) : part_9) : part_5;
    const float part_11 = part_10 * part_10;
    const float part_12 = gravity * part_10;
    const float push_link = 0.5f * ((part_6 + (state->p_motor + part_8))
            + ((gravity * part_5)
            - (part_12
            + (part_12 * (part_11 * ((((((2.59986177e-6f * part_11) + (-1.98065289e-4f)) * part_11)
            + 8.33301619e-3f) * part_11) + (-1.66666567e-1f)))))));
    const float push_motor = half_spring * part_5;

    /* 3. Observers. */
    const float part_13 = push_link - state->push_link;
    const float p1 = p_link + (g1_link * part_13);
    const float part_14 = push_motor - state->push_motor;
    const float p2 = p_motor + (g1_motor * part_14);
    const float offset = state->offset - (decay * state->offset);
    state->push_link = push_link;
    state->push_motor = push_motor;
    state->p_link = p1;
    state->v_link = ((phi_link * state->v_link) + (g2_link * (part_2 + part_13))) + (g1_link * state->d_dot_link);
    state->d_link = d_link;
    state->p_motor = p2;
    state->v_motor = ((phi_motor * state->v_motor) + (g2_motor * (part_7 + part_14))) + (g1_motor * state->d_dot_motor);
    state->d_motor = d_motor;
    state->reach = state->reach * closing;
    state->missed_link = missed_link;
    state->missed_motor = missed_motor;
    state->off_link = off_link;
    state->off_motor = off_link;
    state->doubt = state->doubt * forgetting;
    state->offset = offset;
    return (missed_link <= lost_ticks) && (missed_motor <= lost_ticks);
}

/* Part of a tick: moves the base by whole revolutions of the shaft. */
static inline void drive_follow(drive_state *state)
{
    DRIVE_AS_WRITTEN
    static const float unit_link = 5.99211262e-6f; /* one count */
    static const float edge_link = 3.53429174e0f; /* 9/16 of the base count range */
    static const float kappa_link = 4.01304359e1f; /* stiffness of the coupled model, 1/s^2 */
    static const float kappa_motor = 9.66702441e3f; /* stiffness of the coupled model, 1/s^2 */
    static const float unit_motor = 2.34473962e-4f; /* one count */
    const float part = unit_link * (float)drive_signed(state->at_link);
    if ((part >= (-edge_link)) && (part <= edge_link)) {
        return;
    }
    const bool holds = part > 0.0f;
    const uint32_t at_link = (((holds ? (state->at_link - 1048576u)
            : (state->at_link + 1048576u)) & 0x7fffffu) ^ 0x400000u) - 0x400000u;
    const uint32_t at_motor = (((holds ? (state->at_motor - 1048576u)
            : (state->at_motor + 1048576u)) & 0x7fffffu) ^ 0x400000u) - 0x400000u;
    const float next_1 = state->push_link
            + ((0.5f * kappa_link) * (unit_link * (float)drive_signed(at_link - state->at_link)));
    const float next_2 = state->push_motor
            + ((0.5f * kappa_motor) * (unit_motor * (float)drive_signed(at_motor - state->at_motor)));
    state->at_link = at_link;
    state->at_motor = at_motor;
    state->turn = holds ? (state->turn + 1u) : (state->turn - 1u);
    state->push_link = next_1;
    state->push_motor = next_2;
}

/* Part of a tick with a missing count: moves the last counts with the prediction, by quarters of the
 * counter. */
static inline void drive_carry(drive_state *state)
{
    DRIVE_AS_WRITTEN
    static const float quarter_link = 1.57079637e0f; /* quarter of the counter or of the base, the smaller */
    static const float quarter_motor = 6.14659424e1f; /* quarter of the counter or of the base, the smaller */
    const bool holds = state->p_link > 0.0f;
    if (((state->p_motor >= (-quarter_motor)) && (state->p_motor <= quarter_motor))
            || ((state->p_motor < (-(quarter_motor + quarter_motor)))
            || (state->p_motor > (quarter_motor + quarter_motor)))) {
        const bool holds_2 = ((state->p_link >= (-quarter_link)) && (state->p_link <= quarter_link))
                || ((state->p_link < (-(quarter_link + quarter_link)))
                || (state->p_link > (quarter_link + quarter_link)));
        const uint32_t last_link = holds_2 ? state->last_link
                : (holds ? (state->last_link + 262144u) : (state->last_link - 262144u));
        const uint32_t at_link = holds_2 ? state->at_link
                : (holds ? (state->at_link + 262144u) : (state->at_link - 262144u));
        const float p_link = holds_2 ? state->p_link
                : (holds ? (state->p_link - quarter_link) : (state->p_link + quarter_link));
        state->last_link = last_link;
        state->at_link = at_link;
        state->p_link = p_link;
        return;
    }
    if (!(state->p_motor > 0.0f)) {
        const bool holds_2 = ((state->p_link >= (-quarter_link)) && (state->p_link <= quarter_link))
                || ((state->p_link < (-(quarter_link + quarter_link)))
                || (state->p_link > (quarter_link + quarter_link)));
        const uint32_t last_link = holds_2 ? state->last_link
                : (holds ? (state->last_link + 262144u) : (state->last_link - 262144u));
        const uint32_t at_link = holds_2 ? state->at_link
                : (holds ? (state->at_link + 262144u) : (state->at_link - 262144u));
        const float p_link = holds_2 ? state->p_link
                : (holds ? (state->p_link - quarter_link) : (state->p_link + quarter_link));
        state->last_link = last_link;
        state->last_motor = state->last_motor - 262144u;
        state->at_link = at_link;
        state->at_motor = state->at_motor - 262144u;
        state->p_link = p_link;
        state->p_motor = state->p_motor + quarter_motor;
        return;
    }
    const bool holds_2 = ((state->p_link >= (-quarter_link)) && (state->p_link <= quarter_link))
            || ((state->p_link < (-(quarter_link + quarter_link))) || (state->p_link > (quarter_link + quarter_link)));
    const uint32_t last_link = holds_2 ? state->last_link
            : (holds ? (state->last_link + 262144u) : (state->last_link - 262144u));
    const uint32_t at_link = holds_2 ? state->at_link
            : (holds ? (state->at_link + 262144u) : (state->at_link - 262144u));
    const float p_link = holds_2 ? state->p_link
            : (holds ? (state->p_link - quarter_link) : (state->p_link + quarter_link));
    state->last_link = last_link;
    state->last_motor = state->last_motor + 262144u;
    state->at_link = at_link;
    state->at_motor = state->at_motor + 262144u;
    state->p_link = p_link;
    state->p_motor = state->p_motor - quarter_motor;
}

/* Starts the state with a sample that has all counts; pass the same sample to the first tick. Its angle
 * is then within half a counter of 0. Returns false and leaves the state unchanged if the sample is invalid: try the
 * next one. */
static inline bool drive_start(drive_state *state, const drive_sample *sample)
{
    DRIVE_AS_WRITTEN
    static const float k1 = 3.91304359e1f; /* K_s/J_l, 1/s^2; x_3 is k1 times the motor's angle */
    static const float unit_link = 5.99211262e-6f; /* one count */
    static const float unit_motor = 2.34473962e-4f; /* one count */
    static const float gravity = 1.0f; /* weight of the link divided by its inertia, 1/s^2 */
    static const float half_spring = 1.89137438e5f; /* k1 k2/2 */
    static const float u_min = -30.0f; /* limit, A */
    static const float kappa_motor = 9.66702441e3f; /* stiffness of the coupled model, 1/s^2 */
    static const float b = 5.00163428e3f;
    static const float b1 = 3.04347813e-1f; /* damping of the link, 1/s */
    static const float full_turn = 6.28318548e0f; /* 2 pi */
    static const float input_limit = 9.99999996e11f; /* largest valid number */
    static const float far = 2.40518764e-1f; /* limit of e_1 */
    static const float c_1 = 8000.0f; /* surface */
    static const float c_2 = 1200.0f; /* surface */
    static const float c_3 = 60.0f; /* surface */
    static const float c_d_link = 5.96956520e1f; /* surface, on d */
    static const float c_growth_link = 1.0f; /* surface, on d' */
    static const float half_span_motor = 1.22931885e2f; /* half a counter */
    static const float most = 30.0f;
    const uint32_t count_link = sample->count_link;
    const uint32_t count_motor = sample->count_motor;
    const uint32_t part = ((count_link & 0xfffffu) ^ 0x80000u) - 0x80000u;
    const float d_link = 0.0f * 1.0f;
    if (sample->lost_link || sample->lost_motor) {
        return false;
    }
    const float d_motor = 0.0f * k1;
    const uint32_t part_2 = (part < 0x80000000u) ? ((part / 1048576u) * 1048576u)
            : (0u - (((0u - part) / 1048576u) * 1048576u));
    const uint32_t at_link = (((part - part_2) & 0x7fffffu) ^ 0x400000u) - 0x400000u;
    const uint32_t at_motor = ((((((count_motor & 0xfffffu) ^ 0x80000u) - 0x80000u) - part_2) & 0x7fffffu) ^ 0x400000u)
            - 0x400000u;
    const uint32_t turn = 0u
            + ((part < 0x80000000u) ? ((part / 1048576u) * 1u) : (0u - (((0u - part) / 1048576u) * 1u)));
    const float part_3 = unit_link * (float)drive_signed(at_link);
    const float part_4 = unit_motor * (float)drive_signed(at_motor);
    const float part_5 = (3.14159274e0f - ((part_3 < 0.0f) ? (-part_3) : (part_3 + 0.0f))) + (-8.74227766e-8f);
    const float part_6 = ((part_3 < (-1.57079637e0f)) || (part_3 > 1.57079637e0f))
            ? ((part_3 < 0.0f) ? (-part_5) : part_5) : part_3;
    const float part_7 = part_6 * part_6;
    const float part_8 = gravity * part_6;
    const float part_9 = part_3 + 0.0f;
    const float part_10 = (part_4 + 0.0f) - (k1 * part_9);
    const float part_11 = kappa_motor * part_10;
    if (!((part_11 >= (-((2.0f * b) * (-u_min)))) && (part_11 <= ((2.0f * b) * (-u_min))))) {
        return false;
    }
    const bool holds = (part_9 < (-1.57079637e0f)) || (part_9 > 1.57079637e0f);
    const float part_12 = holds ? (-gravity) : gravity;
    const float part_13 = (3.14159274e0f - ((part_9 < 0.0f) ? (-part_9) : (part_9 + 0.0f))) + (-8.74227766e-8f);
    const float part_14 = holds ? ((part_9 < 0.0f) ? (-part_13) : part_13) : part_9;
    const float part_15 = part_14 * part_14;
    const float part_16 = gravity * part_14;

    /* 4. The chain. */
    const float part_17 = (part_10 - (b1 * 0.0f))
            - (part_16
            + (part_16 * (part_15 * ((((((2.59986177e-6f * part_15) + (-1.98065289e-4f)) * part_15)
            + 8.33301619e-3f) * part_15) + (-1.66666567e-1f)))));
    float sigma = (0.0f
            + ((-(k1
            + (part_12
            + (part_12 * (part_15 * ((((((2.31924023e-5f * part_15) + (-1.38558447e-3f)) * part_15)
            + 4.16639782e-2f) * part_15) + (-4.99999315e-1f))))))) * 0.0f)) - (b1 * part_17);

    /* 5. Law. */
    const float part_18 = part_9
            - ((full_turn * (float)drive_signed((uint32_t)sample->begin.turn - turn)) + sample->begin.r);
    const float part_19 = 0.0f - sample->begin.r_dot;
    const float part_20 = part_17 - sample->begin.r_ddot;
    sigma -= sample->begin.r_dddot;
    if (!(((part_18 >= (-input_limit)) && (part_18 <= input_limit))
            && ((part_19 >= (-input_limit)) && (part_19 <= input_limit))
            && ((part_20 >= (-input_limit)) && (part_20 <= input_limit))
            && ((sigma >= (-input_limit)) && (sigma <= input_limit)))) {
        return false;
    }
    const float part_21 = ((part_18 < 0.0f) ? (-part_18) : (part_18 + 0.0f)) - far;
    const float part_22 = 3.0f * far;
    const float part_23 = part_21 - part_22;
    const float part_24 = 0.5f * ((part_21 + part_22) - ((part_23 < 0.0f) ? (-part_23) : (part_23 + 0.0f)));
    const float part_25 = part_21 - part_24;
    const float part_26 = 4.0f * part_22;
    const float part_27 = 0.5f * 3.33333343e-1f;
    const float part_28 = part_25 - part_26;
    const float part_29 = 0.5f * ((part_25 + part_26) - ((part_28 < 0.0f) ? (-part_28) : (part_28 + 0.0f)));
    const float part_30 = part_25 - part_29;
    const float part_31 = 4.0f * part_26;
    const float part_32 = 0.5f * part_27;
    const float part_33 = part_30 - part_31;
    const float part_34 = 0.5f * ((part_30 + part_31) - ((part_33 < 0.0f) ? (-part_33) : (part_33 + 0.0f)));
    const float part_35 = part_30 - part_34;
    const float part_36 = 4.0f * part_31;
    const float part_37 = part_35 - part_36;
    const float part_38 = (((far + (3.33333343e-1f * part_24)) + (part_27 * part_29)) + (part_32 * part_34))
            + ((0.5f * part_32) * (0.5f * ((part_35 + part_36) - ((part_37 < 0.0f) ? (-part_37) : (part_37 + 0.0f)))));
    float sigma_2 = sigma
            + (c_1 * (((part_18 >= (-far)) && (part_18 <= far)) ? part_18 : ((part_18 > 0.0f) ? part_38 : (-part_38))));
    sigma_2 += c_2 * part_19;
    sigma_2 += c_3 * part_20;
    sigma_2 += c_d_link * d_link;
    sigma_2 += c_growth_link * 0.0f;
    const bool answer = ((sigma_2 >= (-input_limit)) && (sigma_2 <= input_limit))
            && ((d_link >= (-input_limit)) && (d_link <= input_limit))
            && ((d_motor >= (-input_limit)) && (d_motor <= input_limit));
    if (answer) {
        state->fresh = true;
        state->last_link = count_link;
        state->last_motor = count_motor;
        state->at_link = at_link;
        state->at_motor = at_motor;
        state->turn = turn;
        state->push_link = 0.5f * (part_4
                + ((gravity * part_3)
                - (part_8
                + (part_8 * (part_7 * ((((((2.59986177e-6f * part_7) + (-1.98065289e-4f)) * part_7)
                + 8.33301619e-3f) * part_7) + (-1.66666567e-1f)))))));
        state->push_motor = half_spring * part_3;
        state->p_link = 0.0f;
        state->v_link = 0.0f;
        state->d_link = d_link;
        state->d_dot_link = 0.0f;
        state->p_motor = 0.0f;
        state->v_motor = 0.0f;
        state->d_motor = d_motor;
        state->d_dot_motor = 0.0f;
        state->smoothed_link = 0.0f;
        state->level_link = 0.0f;
        state->smoothed_motor = 0.0f;
        state->level_motor = 0.0f;
        state->reach = half_span_motor;
        state->missed_link = 0.0f;
        state->missed_motor = 0.0f;
        state->off_link = 0.0f;
        state->off_motor = 0.0f;
        state->doubt = 0.0f;
        state->offset = sigma_2;
        state->held = 0.0f;
        state->limit = most;
        state->reported = 1.00000002e30f;
        state->started = true;
    }
    return answer;
}

/* Writes the output before the first valid sample: the fallback. */
static inline unsigned drive_not_started(drive_output *output)
{
    DRIVE_AS_WRITTEN
    static const float fallback = 0.0f; /* fallback, A */
    output->u = fallback;
    output->sigma = 0.0f;
    output->sigma_star = 0.0f;
    return ((unsigned)DRIVE_INPUT_REJECTED) | ((unsigned)DRIVE_WAITS);
}

/* Computes one tick: counts and targets in, current out. Call it once per period, with the counts read at its begin.
 * Returns the status flags. output->u is valid for every sample. */
static inline unsigned drive_tick(drive_state *state, const drive_sample *sample, drive_output *output)
{
    drive_between between;
    unsigned health;
    if (state->fresh) {
        if (!drive_begin(state, sample, &between)) {
            return drive_not_started(output);
        }
    } else {
        if (!drive_observe(state, sample, &between)) {
            health = drive_give_up(state, sample, output);
            drive_follow(state);
            drive_carry(state);
            return health;
        }
    }
    health = drive_law(state, sample, &between, output);
    drive_follow(state);
    health |= between.stepped ? (unsigned)DRIVE_POSITION_STEPPED : 0u;
    if (between.missing) {
        drive_carry(state);
        health |= (unsigned)DRIVE_SAMPLE_LOST;
    }
    return health;
}

/* Computes one tick and starts the drive after 40 ticks with valid and consistent samples. Until then the
 * output is the fallback. Pass a state of zeros at first. */
static inline unsigned drive_tick_or_start(drive_state *state, const drive_sample *sample, drive_output *output)
{
    if (!state->started) {
        if (!drive_start(state, sample)) {
            return drive_not_started(output);
        }
        state->doubt = 40.0f;
    }
    return drive_tick(state, sample, output);
}

/* Computes one tick without counts and targets: the observers predict, and the output is the fallback. */
static inline unsigned drive_lost(drive_state *state, drive_output *output)
{
    if (!state->started) {
        return drive_not_started(output);
    }
    static const drive_sample nothing = {0u, 0u, true, true, {0, 0.0f, 0.0f, 0.0f, 0.0f}, {0, 0.0f, 0.0f, 0.0f, 0.0f}};
    drive_between between;
    unsigned health;
    if (state->fresh && (state->doubt > 0.0f)) {
        (void)drive_begin(state, &nothing, &between);
        return drive_not_started(output);
    }
    if (!state->fresh && !drive_observe(state, &nothing, &between)) {
        health = drive_give_up(state, &nothing, output);
    } else {
        health = drive_refuse(state, output);
    }
    drive_follow(state);
    drive_carry(state);
    return health;
}

/* Reports the number of periods that passed without a tick while the current was held. A time stamp of a free-running
 * timer counts them; an update flag is one bit. Call it before the next tick. Missed periods use at most half of the
 * permitted missing samples. */
static inline void drive_missed(drive_state *state, uint32_t periods)
{
    uint32_t left = periods;
    while ((left > 0u) && state->started && !state->fresh && drive_pass(state)) {
        drive_follow(state);
        drive_carry(state);
        left--;
    }
    state->missed_link = (state->missed_link > 25.0f) ? 25.0f : state->missed_link;
    state->missed_motor = (state->missed_motor > 25.0f) ? 25.0f : state->missed_motor;
}

/* Sets the largest current of either sign that the power stage can hold from now on, A: for a hot stage, a low supply,
 * a full brake resistor. u stays within it. A start clears it: call it before each tick. Returns false before the
 * start, for NaN and for a number below 0. */
static inline bool drive_limit(drive_state *state, float current)
{
    const bool is_taken = state->started && (current >= 0.0f);
    if (is_taken) {
        state->limit = current;
        state->reported = -1.0f;
    }
    return is_taken;
}

/* Reports the current that the power stage has held since the last tick, A, if it is not output->u. This
 * is the only anti-windup. Call it before the next tick. Two equal reports well below the output are taken as the
 * limit of the stage for some ticks. Returns false and changes nothing before the start, and for a value that is not
 * finite or above 1e12. */
static inline bool drive_report_applied(drive_state *state, float u)
{
    DRIVE_AS_WRITTEN
    static const float input_limit = 9.99999996e11f; /* largest valid number */
    const bool holds = (u >= (-input_limit)) && (u <= input_limit);
    const bool holds_2 = state->reported >= 0.0f;
    const float part = ((state->held < 0.0f) ? (-state->held) : (state->held + 0.0f))
            - ((u < 0.0f) ? (-u) : (u + 0.0f));
    const bool holds_3 = part > (0.03125f * state->limit);
    const bool holds_4 = part > (0.25f * ((u < 0.0f) ? (-u) : (u + 0.0f)));
    const bool answer = state->started && holds;
    if (answer) {
        state->held = u;
    }
    if (state->started && holds && holds_2 && holds_3 && holds_4
            && (((u < 0.0f) ? (-u) : (u + 0.0f)) == state->reported)) {
        state->limit = (u < 0.0f) ? (-u) : (u + 0.0f);
    }
    if (state->started && holds && holds_2) {
        state->reported = (holds_3 && holds_4) ? ((u < 0.0f) ? (-u) : (u + 0.0f)) : 1.00000002e30f;
    }
    return answer;
}

/* Writes the estimates at the instant of the last tick. Returns false and writes zeros before the
 * start. A stopped drive keeps those of its stop: measure its speed from the counts. */
static inline bool drive_estimates(const drive_state *state, drive_estimates_of *estimates)
{
    DRIVE_AS_WRITTEN
    static const float k1 = 3.91304359e1f; /* K_s/J_l, 1/s^2; x_3 is k1 times the motor's angle */
    static const float unit_link = 5.99211262e-6f; /* one count */
    static const float unit_motor = 2.34473962e-4f; /* one count */
    static const float inertia_link = 2.30000004e-1f; /* inertia, kg m^2 */
    static const float inertia_motor = 9.30999988e-4f; /* inertia, kg m^2 */
    if (!state->started) {
        estimates->turn = 0;
        estimates->position_link = 0.0f;
        estimates->speed_link = 0.0f;
        estimates->disturbance_link = 0.0f;
        estimates->load_link = 0.0f;
        estimates->position_motor = 0.0f;
        estimates->speed_motor = 0.0f;
        estimates->disturbance_motor = 0.0f;
        estimates->load_motor = 0.0f;
        return false;
    }
    const float disturbance_link = state->d_link / 1.0f;
    const float disturbance_motor = state->d_motor / k1;
    estimates->turn = drive_signed(state->turn);
    estimates->position_link = ((unit_link * (float)drive_signed(state->at_link)) + state->p_link) / 1.0f;
    estimates->speed_link = state->v_link / 1.0f;
    estimates->disturbance_link = disturbance_link;
    estimates->load_link = (-inertia_link) * disturbance_link;
    estimates->position_motor = ((unit_motor * (float)drive_signed(state->at_motor)) + state->p_motor) / k1;
    estimates->speed_motor = state->v_motor / k1;
    estimates->disturbance_motor = disturbance_motor;
    estimates->load_motor = (-inertia_motor) * disturbance_motor;
    return true;
}

/* Clears everything except the design: consistent counts start the drive again. Use it after a fault. */
static inline void drive_reset(drive_state *state)
{
    DRIVE_AS_WRITTEN
    if (state->started) {
        state->fresh = false;
        state->last_link = 0u;
        state->last_motor = 0u;
        state->at_link = 0u;
        state->at_motor = 0u;
        state->turn = 0u;
        state->push_link = 0.0f;
        state->push_motor = 0.0f;
        state->p_link = 0.0f;
        state->v_link = 0.0f;
        state->d_link = 0.0f;
        state->d_dot_link = 0.0f;
        state->p_motor = 0.0f;
        state->v_motor = 0.0f;
        state->d_motor = 0.0f;
        state->d_dot_motor = 0.0f;
        state->smoothed_link = 0.0f;
        state->level_link = 0.0f;
        state->smoothed_motor = 0.0f;
        state->level_motor = 0.0f;
        state->reach = 0.0f;
        state->missed_link = 0.0f;
        state->missed_motor = 0.0f;
        state->off_link = 0.0f;
        state->off_motor = 0.0f;
        state->doubt = 0.0f;
        state->offset = 0.0f;
        state->held = 0.0f;
        state->limit = 0.0f;
        state->reported = 0.0f;
    }
    state->started = false;
}

/* MONITORS. An encoder that freezes at standstill looks like a load: u rises against it, and the shaft runs away. No
 * observer detects this. If a runaway is dangerous, call drive_watched_tick and drive_watched_lost instead of
 * drive_tick_or_start and drive_lost.
 * An alarm (any of SIGMA_STAR_OVER_BOUND, DISTURBANCE_OVER_BOUND, STUCK_AT_LIMIT, INPUT_REJECTED)
 * lets the drive brake on its estimated speed while its counts are valid (DRIVE_BRAKES).
 * After that, or at rest, the safe current is the output (DRIVE_STOPPED), as in the scenario.
 * WRONG_WAY and OSCILLATES stop the drive in any case. A stopped drive stays stopped until drive_watched_reset. */
typedef struct {
    bool stopped;
    float stuck; /* ticks at a limit without a decrease of |sigma|; minus a tenth of the ticks within the limits */
    float last_sigma; /* |sigma| in the last tick at a limit */
    float swings; /* remaining ticks of the sign changes of a disturbance */
    float against; /* consecutive ticks of acceleration against the current */
    float last_speed; /* |v| in the last tick at a limit */
    float over; /* ticks over a bound or without a sample, minus ticks without either */
    float braking; /* while braking: 1 plus the ticks within the limits without deceleration */
    float most; /* largest demand of the brake; 0 before its first tick, below 0 if it holds no load */
    float side_link; /* last disturbance of the shaft over its bound */
    float side_motor; /* last disturbance of the shaft over its bound */
} drive_monitor; /* zeros before the start */

static inline float drive_magnitude(float number)
{
    return (number < 0.0f) ? -number : number;
}

/* Stops the drive: the output is the safe current from now on. */
static inline unsigned drive_watch_stop(drive_monitor *monitor, drive_output *output)
{
    drive_output safe;
    (void)drive_not_started(&safe);
    output->u = safe.u;
    monitor->stopped = true;
    return DRIVE_STOPPED;
}

/* Returns number - by, at least 0. */
static inline float drive_lessened(float number, float by)
{
    const float less = number - by;
    return (less > 0.0f) ? less : 0.0f;
}

/* Returns whether d exceeds its bound; sets has_changed if the sign differs from the last time. */
static inline bool drive_watch_side(float d, float bound, float *side, bool *has_changed)
{
    if (drive_magnitude(d) <= bound) {
        return false;
    }
    *has_changed = *has_changed || ((d * *side) < 0.0f);
    *side = d;
    return true;
}

/* Counts a tick at a limit of the current; `falling` must decrease there. */
static inline void drive_watch_limit(drive_monitor *monitor, const drive_state *state, float falling, float current, bool is_lost, bool over_link, bool over_motor)
{
    const float wanted = 5001.6343f * current; /* acceleration by the current */
    const float speed = drive_magnitude(state->v_motor);
    const float found = drive_magnitude(state->d_motor);
    /* The shaft accelerates against its current, as the reversed current would accelerate it. */
    bool wrong_way = ((state->v_motor * wanted) < 0.0f) && ((state->d_motor * wanted) < 0.0f) &&
                     (speed > monitor->last_speed) && (found > (1.25f * drive_magnitude(wanted))) &&
                     (found < (3.5f * drive_magnitude(wanted)));
    /* Or the disturbances of the two shafts contradict the spring. */
    wrong_way = wrong_way ||
                (over_link && ((state->d_link * state->d_motor) < 0.0f) && (found > drive_magnitude(wanted)));
    if (wrong_way && over_motor) {
        monitor->against += 1.0f;
    } else if (is_lost) {
        monitor->against += 0.5f; /* no count at full current: the motion is unknown */
    } else {
        monitor->against = 0.0f;
    }
    monitor->last_speed = speed;
    if (!(monitor->stuck > 0.0f) || (falling >= monitor->last_sigma)) {
        monitor->stuck += 1.0f;
    }
    monitor->last_sigma = falling;
}

/* Counts a tick within the limits. */
static inline void drive_watch_within(drive_monitor *monitor)
{
    monitor->against = 0.0f;
    monitor->stuck = drive_lessened(monitor->stuck, 0.1f);
}

/* Counts a tick over a bound or without a sample. */
static inline void drive_watch_over(drive_monitor *monitor, bool is_over)
{
    monitor->over = is_over ? (monitor->over + 1.0f) : drive_lessened(monitor->over, 1.0f);
}

/* Returns the alarms that stop every drive. The stop begins at the next tick. */
static inline unsigned drive_watch_runaway(drive_monitor *monitor)
{
    const bool wrong_way = monitor->against > 7.0f;
    const bool oscillates = monitor->swings > 1600.0f;
    unsigned alarms = wrong_way ? (unsigned)DRIVE_WRONG_WAY : 0u;
    alarms |= oscillates ? (unsigned)DRIVE_OSCILLATES : 0u;
    monitor->swings = drive_lessened(monitor->swings, 1.0f);
    monitor->stopped = monitor->stopped || wrong_way || oscillates;
    return alarms;
}

/* Starts the brake at the next tick. */
static inline void drive_watch_brakes(drive_monitor *monitor)
{
    monitor->braking = 1.0f;
    monitor->most = 0.0f; /* unknown before the first tick of the brake */
    monitor->stuck = 0.0f;
    monitor->over = 0.0f;
}

/* Checks a tick of the brake. */
static inline void drive_watch_brake(drive_monitor *monitor, const drive_state *state, float speed, float asks, float slowing,
    bool is_short, bool is_blind)
{
    DRIVE_AS_WRITTEN
    bool has_changed = false;
    const bool over_link =
        drive_watch_side(state->d_link, 10.483162f, &monitor->side_link, &has_changed);
    const bool over_motor =
        drive_watch_side(state->d_motor, 103158.71f, &monitor->side_motor, &has_changed);
    monitor->swings += has_changed ? 800.0f : 0.0f;
    if (is_short) {
        drive_watch_limit(monitor, state, speed, slowing, false, over_link, over_motor);
        /* Faster than at the begin: the brake does not work. */
        if (asks > drive_magnitude(monitor->most)) {
            monitor->stuck = 800.0f + 1.0f;
        }
    } else {
        drive_watch_within(monitor);
        if (!((speed < monitor->last_sigma) && (asks > (0.0078125f * drive_magnitude(monitor->most))))) {
            monitor->braking += 1.0f;
        }
        monitor->last_sigma = speed;
    }
    drive_watch_over(monitor, is_blind);
}

/* Computes one tick of the brake: the current opposes the speed. At a limit the speed must decrease. */
static inline unsigned drive_brake(drive_monitor *monitor, drive_state *state, unsigned told, drive_output *output)
{
    DRIVE_AS_WRITTEN
    const unsigned blind = DRIVE_SAMPLE_LOST | DRIVE_INPUT_REJECTED;
    const float limit = drive_magnitude(state->limit);
    const float u_max = (30.0f > limit) ? limit : 30.0f;
    const float u_min = (-30.0f < -limit) ? -limit : -30.0f;
    const float speed = drive_magnitude(state->v_motor);
    const float asks = drive_magnitude(0.30897516f * speed);
    float opposed = -(0.30897516f * state->v_motor);
    const float asked = (drive_magnitude(opposed) <= 1e30f) ? opposed : 0.0f;
    float slowing = (asked > u_max) ? u_max : asked;
    slowing = (slowing < u_min) ? u_min : slowing;
    const bool is_short = slowing != asked;
    if (drive_magnitude(monitor->most) <= 0.0f) {
        const float most = (1.25f * asks) + (0.5f * (30.0f - (-30.0f)));
        monitor->most = -most;
    } else {
        drive_watch_brake(monitor, state, speed, asks, slowing, is_short, (told & blind) == blind);
    }
    const bool is_stuck = monitor->stuck > 800.0f;
    unsigned health = told | (is_stuck ? (unsigned)DRIVE_STUCK_AT_LIMIT : 0u);
    if (is_stuck || (monitor->over > 32.0f) || (monitor->braking > 2568.0f)) {
        health |= drive_watch_stop(monitor, output);
    } else {
        state->held = slowing;
        state->offset = 0.0f;
        output->u = slowing;
        health &= ~(unsigned)DRIVE_SATURATED;
        health |= (unsigned)DRIVE_BRAKES;
        if (is_short) {
            health |= (unsigned)DRIVE_SATURATED;
        }
    }
    return health | drive_watch_runaway(monitor);
}

/* Checks a completed tick, returns its flags, and starts the reaction to an alarm. */
static inline unsigned drive_watch(drive_monitor *monitor, drive_state *state, unsigned told, drive_output *output)
{
    const bool is_lost = (told & DRIVE_SAMPLE_LOST) != 0u;
    const bool is_rejected = (told & DRIVE_INPUT_REJECTED) != 0u;
    bool has_changed = false;
    bool is_star_over = false;
    if (!state->started) {
        return told;
    }
    if ((told & DRIVE_WAITS) != 0u) {
        if (is_lost) { /* the estimates are no longer valid */
            return told | drive_watch_stop(monitor, output);
        }
        return told;
    }
    if (monitor->braking > 0.0f) {
        return drive_brake(monitor, state, told, output);
    }
    const bool over_link =
        drive_watch_side(state->d_link, 10.483162f, &monitor->side_link, &has_changed);
    const bool over_motor =
        drive_watch_side(state->d_motor, 103158.71f, &monitor->side_motor, &has_changed);
    monitor->swings += has_changed ? 800.0f : 0.0f;
    if ((told & DRIVE_SATURATED) != 0u) {
        drive_watch_limit(monitor, state, drive_magnitude(output->sigma), output->u, is_lost, over_link, over_motor);
    } else {
        drive_watch_within(monitor);
        is_star_over = !(drive_magnitude(output->sigma_star) <= 2167.9072f);
    }
    const bool is_any_over = over_link || over_motor;
    drive_watch_over(monitor, is_any_over || is_star_over || is_rejected);
    const bool is_late = monitor->over > 32.0f;
    unsigned health = told;
    health |= (monitor->stuck > 800.0f) ? (unsigned)DRIVE_STUCK_AT_LIMIT : 0u;
    if (is_late) {
        health |= is_any_over ? (unsigned)DRIVE_DISTURBANCE_OVER_BOUND : 0u;
        health |= is_star_over ? (unsigned)DRIVE_SIGMA_STAR_OVER_BOUND : 0u;
    }
    /* A missing sample is an alarm only after some ticks. */
    const unsigned alarms = is_late ? health : (health & ~(unsigned)DRIVE_INPUT_REJECTED);
    if ((alarms & 1589u) != 0u) {
        if (is_rejected && is_lost) {
            health |= drive_watch_stop(monitor, output);
        } else {
            /* If encoder or phases are reversed, braking accelerates the shaft: wait some ticks for that alarm. */
            if (!(monitor->against > 0.0f)) {
                drive_watch_brakes(monitor);
            }
        }
    }
    return health | drive_watch_runaway(monitor);
}

/* Starts the reaction to an alarm at the next tick, for an external cause such as a door switch. */
static inline void drive_watched_trip(drive_monitor *monitor)
{
    if (!(monitor->braking > 0.0f)) {
        drive_watch_brakes(monitor);
    }
}

/* Computes drive_tick_or_start with the monitors. */
static inline unsigned drive_watched_tick(drive_monitor *monitor, drive_state *state, const drive_sample *sample, drive_output *output)
{
    if (monitor->stopped) {
        (void)drive_not_started(output);
        return DRIVE_INPUT_REJECTED | DRIVE_STOPPED;
    }
    unsigned health = drive_watch(monitor, state, drive_tick_or_start(state, sample, output), output);
    return health;
}

/* Computes drive_lost with the monitors. */
static inline unsigned drive_watched_lost(drive_monitor *monitor, drive_state *state, drive_output *output)
{
    if (monitor->stopped) {
        (void)drive_not_started(output);
        return DRIVE_INPUT_REJECTED | DRIVE_STOPPED;
    }
    return drive_watch(monitor, state, drive_lost(state, output), output);
}

/* Clears monitor and state after a stop, at rest: counts that are consistent for 10 ms start the drive. */
static inline void drive_watched_reset(drive_monitor *monitor, drive_state *state)
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
    drive_reset(state);
}

/* Start of a plan: position and derivatives. */
typedef drive_target drive_jet;

/* Goal of a plan: rest at 2 pi turn + angle, or a sine about angle 0 whose phase is 0 at tick 0. */
typedef struct {
    int32_t turn;
    float angle; /* rad */
    float amplitude; /* rad */
    float omega; /* rad/s */
    uint32_t phase_per_tick; /* 2^-32 revolutions; 0: rest */
} drive_goal;

/* Plan: the target of every tick. Ticks count from any number and may wrap. Zeros are rest at angle 0. */
typedef struct {
    drive_goal goal;
    uint32_t end; /* tick at which the goal is reached */
    uint32_t ticks; /* duration of the transition */
    float per_tick;
    float per_s;
    uint64_t share; /* 2^64/ticks */
    float power[2][8]; /* coefficients for the first and for the second half */
    uint64_t way[2][8]; /* the coefficients in 2^-32 revolutions, modulo 2^64 */
} drive_plan;

/* Part of a plan: position and derivatives of A sin at a phase in 2^-32 revolutions. */
static inline void drive_jet_of_sine(uint32_t phase, float amplitude, float omega, drive_jet *jet)
{
    DRIVE_AS_WRITTEN
    const float part = (float)drive_signed(phase) * 1.46291812e-9f;
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

/* Part of a plan: adds the transition to position and derivatives of the goal. */
static inline void drive_join(const float power[8], uint32_t ticks, uint32_t rest, uint32_t early, float per_tick,
    float rate, float instant_s, drive_jet *jet)
{
    DRIVE_AS_WRITTEN
    const float part = (float)drive_signed(ticks) * per_tick;
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
            + (((float)drive_signed(rest) * 1.46291812e-9f) + (((float)drive_signed(early) * instant_s) * part_18));
    jet->r_dot = jet->r_dot + part_18;
    jet->r_ddot = jet->r_ddot + (part_19 * ((part_15 * part) + part_16));
    jet->r_dddot = jet->r_dddot
            + (((part_19 * rate) * 3.0f) * (((((((part_2 + part_6) * part) + part_9) * part) + part_12) * part)
            + part_15));
}

/* Part of a plan: coefficients of a transition that closes a gap in tau_s seconds. */
static inline void drive_powers_of_join(const double gap[4], double tau_s, double s[8],
    double left[8])
{
    DRIVE_AS_WRITTEN
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

/* Part of a plan: returns whether a number is valid for the drive. */
static inline bool drive_is_number(double number)
{
    return (number >= -1e12) && (number <= 1e12);
}

/* Part of a plan: position and derivatives of the goal at a tick. */
static inline void drive_jet_of_goal(const drive_goal *goal, uint32_t tick, drive_jet *jet)
{
    if (goal->phase_per_tick != 0u) {
        jet->turn = 0;
        drive_jet_of_sine(goal->phase_per_tick * tick, goal->amplitude, goal->omega, jet);
    } else {
        jet->turn = goal->turn;
        jet->r = goal->angle;
        jet->r_dot = 0.0f;
        jet->r_ddot = 0.0f;
        jet->r_dddot = 0.0f;
    }
}

/* Part of a plan: ticks until the goal is reached, 0 afterwards. The end must be less than 2^31 ticks ahead. */
static inline uint32_t drive_plan_left(const drive_plan *plan, uint32_t tick)
{
    const uint32_t left = plan->end - tick;
    return ((plan->ticks == 0u) || (left > 0x7fffffffu)) ? 0u : left;
}

/* Part of a plan: multiplies a sum in 2^-32 revolutions by s in 2^-32, s at most a half. */
static inline uint64_t drive_share(uint64_t sum, uint32_t s)
{
    const int64_t turns = (int64_t)drive_signed((uint32_t)(sum >> 32)) * (int64_t)drive_signed(s);
    return (uint64_t)turns + (((sum & 0xffffffffu) * (uint64_t)s) >> 32);
}

/* Part of a plan: adds one half of the transition, at a part of its ticks, to position and derivatives of the goal. The
 * position is whole revolutions and a remainder in 2^-32 revolutions, so its resolution is the same at any distance.
 * The argument s has 32 bits, rounded down; `early` corrects the rounding, in 2^-32 ticks. */
static inline void drive_go_along(const drive_plan *plan, uint32_t half, uint32_t part, drive_jet *jet)
{
    const uint32_t s = (uint32_t)(((uint64_t)part * plan->share) >> 32);
    const uint32_t early = 0u - (s * plan->ticks);
    const float rate = (half == 0u) ? plan->per_s : -plan->per_s;
    const float instant_s = (half == 0u) ? 5.8207664e-14f : -5.8207664e-14f;
    uint64_t sum = plan->way[half][7];
    sum = drive_share(sum, s) + plan->way[half][6];
    sum = drive_share(sum, s) + plan->way[half][5];
    sum = drive_share(sum, s) + plan->way[half][4];
    sum = drive_share(sum, s) + plan->way[half][3];
    sum = drive_share(sum, s) + plan->way[half][2];
    sum = drive_share(sum, s) + plan->way[half][1];
    sum = drive_share(sum, s) + plan->way[half][0];
    jet->turn = drive_signed((uint32_t)jet->turn + (uint32_t)(sum >> 32) + ((uint32_t)sum >> 31));
    drive_join(plan->power[half], part, (uint32_t)sum, early, plan->per_tick, rate, instant_s, jet);
}

/* Writes position and derivatives of a plan at a tick, from which another plan can start. Before the start of the plan
 * it writes the first ones. */
static inline void drive_plan_jet(const drive_plan *plan, uint32_t tick, drive_jet *jet)
{
    const uint32_t ahead = drive_plan_left(plan, tick);
    const uint32_t left = (ahead > plan->ticks) ? plan->ticks : ahead;
    drive_jet_of_goal(&plan->goal, (left == 0u) ? tick : (plan->end - left), jet);
    if (left != 0u) {
        const uint32_t done = plan->ticks - left;
        drive_go_along(plan, (done < left) ? 0u : 1u, (done < left) ? done : left, jet);
    }
}

/* Writes the target at any tick, to look ahead. */
static inline void drive_plan_at(const drive_plan *plan, uint32_t tick, drive_target *target)
{
    drive_jet jet;
    drive_plan_jet(plan, tick, &jet);
    target->turn = jet.turn;
    target->r = jet.r;
    target->r_dot = jet.r_dot;
    target->r_ddot = jet.r_ddot;
    target->r_dddot = jet.r_dddot;
}

/* Writes the target at a tick. Call it in the interrupt once per tick, for the end of the tick. A completed plan stays
 * completed when the ticks wrap (2^32 ticks are five days at 10 kHz). */
static inline void drive_plan_play(drive_plan *plan, uint32_t tick, drive_target *target)
{
    if (drive_plan_left(plan, tick) == 0u) {
        plan->ticks = 0u;
    }
    drive_plan_at(plan, tick, target);
}

/* Part of a plan: returns whether a coefficient fits into 64 bits of 2^-32 revolutions. */
static inline bool drive_is_near(double rad)
{
    return (rad >= -6000000000.0) && (rad <= 6000000000.0);
}

/* Part of a plan: rounds to 2^-32 revolutions, modulo 2^64. */
static inline uint64_t drive_units(double rad)
{
    const double units = rad * 683565275.5764316;
    const double rounded = units + ((units < 0.0) ? -0.5 : 0.5);
    return (uint64_t)(int64_t)rounded;
}

/* Part of a plan: makes the transition to a goal. It uses double: do not call it in the interrupt. */
static inline bool drive_plan_onto(drive_plan *plan, const drive_goal *goal, const drive_jet *present, uint32_t start,
    uint32_t ticks)
{
    DRIVE_AS_WRITTEN
    const double tau_s = (double)ticks * 0.00025;
    uint32_t turns;
    double gap[4];
    double power[2][8];
    bool good = (ticks >= 1u) && (ticks <= 16777216u);
    drive_jet at;
    drive_jet_of_goal(goal, start, &at);
    turns = (uint32_t)present->turn - (uint32_t)at.turn;
    gap[0] = (double)present->r - (double)at.r;
    gap[1] = (double)present->r_dot - (double)at.r_dot;
    gap[2] = (double)present->r_ddot - (double)at.r_ddot;
    gap[3] = (double)present->r_dddot - (double)at.r_dddot;
    gap[0] += 6.283185307179586 * (double)drive_signed(turns);
    for (unsigned k = 0; k < 4u; k++) {
        good = good && drive_is_number(gap[k]);
    }
    drive_powers_of_join(gap, tau_s, power[0], power[1]);
    for (unsigned k = 0; k < 8u; k++) {
        good = good && drive_is_near(power[0][k]) && drive_is_near(power[1][k]);
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
            plan->way[half][k] = drive_units(power[half][k]);
        }
    }
    return true;
}

/* Makes a permanent rest at 2 pi turn + angle: for a start. This function and the next three return false for invalid
 * arguments and leave the plan unchanged. Invalid are a number that is NaN or above 1e12, a distance of some 10 million
 * revolutions, and ticks outside of 1 to 2^24. The functions use double, in software on most cores. Make a plan outside
 * of the interrupt and never in the plan that is played, except for a rest at a start. Switch to it between two ticks. */
static inline bool drive_plan_rest(drive_plan *plan, int32_t turn, float angle)
{
    drive_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    if (!drive_is_number((double)angle)) {
        return false;
    }
    goal.turn = turn;
    goal.angle = angle;
    plan->goal = goal;
    plan->ticks = 0u;
    return true;
}

/* Makes a move to rest at 2 pi turn + angle. It begins at tick `start` with `present` and takes `ticks` ticks. During a
 * motion take `present` from the old plan at this tick (drive_plan_jet), never from a measurement. The function does
 * not check the current and the supply. */
static inline bool drive_plan_move(drive_plan *plan, const drive_jet *present, uint32_t start, uint32_t ticks, int32_t turn,
    float angle)
{
    drive_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    goal.turn = turn;
    goal.angle = angle;
    return drive_is_number((double)angle) && drive_plan_onto(plan, &goal, present, start, ticks);
}

/* Part of a stop: writes its distance for a number of ticks and returns whether it moves back. Its speed is
 * (1 - s)^m (part[0] + part[1] s + ..). */
static inline bool drive_stop_goes_back(const drive_jet *present, uint32_t ticks, double *way)
{
    DRIVE_AS_WRITTEN
    const double tau_s = (double)ticks * 0.00025;
    double part[3] = { (double)present->r_dot, (double)present->r_ddot, (double)present->r_dddot };
    double scale = 1.0;
    double share = 1.0 / 4.0;
    bool forward = false;
    bool back = false;
    for (unsigned k = 0; k < 3u; k++) {
        const unsigned next = k + 1u;
        part[k] = scale * part[k];
        scale = scale * (tau_s / (double)next);
    }
    for (unsigned times = 0; times < 3u; times++) {
        for (unsigned k = 1; k < 3u; k++) {
            part[k] = part[k] + part[k - 1u];
        }
    }
    *way = 0.0;
    for (unsigned k = 0; k < 3u; k++) {
        const unsigned next = k + 1u;
        const unsigned after = next + 4u;
        forward = forward || (part[k] > 0.0);
        back = back || (part[k] < 0.0);
        *way = *way + (share * part[k]);
        share = share * ((double)next / (double)after);
    }
    *way = tau_s * *way;
    return forward && back;
}

/* Makes a stop in `ticks` ticks that never moves back. From a constant speed the shaft stops after half of the
 * distance that it would have moved. If the shaft decelerates already and a longer stop would move back, it
 * takes fewer ticks. */
static inline bool drive_plan_stop(drive_plan *plan, const drive_jet *present, uint32_t start, uint32_t ticks)
{
    DRIVE_AS_WRITTEN
    uint32_t taken = ticks;
    uint32_t too_many = ticks;
    double way;
    double angle;
    if ((ticks < 1u) || (ticks > 16777216u)) {
        return false;
    }
    if (drive_stop_goes_back(present, ticks, &way)) {
        taken = 1u;
        while ((taken + 1u) < too_many) {
            const uint32_t middle = taken + ((too_many - taken) / 2u);
            if (drive_stop_goes_back(present, middle, &way)) {
                too_many = middle;
            } else {
                taken = middle;
            }
        }
        (void)drive_stop_goes_back(present, taken, &way);
    }
    angle = (double)present->r + way;
    return drive_is_number(angle) && drive_plan_move(plan, present, start, taken, present->turn, (float)angle);
}

/* Makes a transition to A sin(omega t) about angle 0, whose phase is 0 at tick 0. omega is rounded to a multiple of
 * 2^-32 revolutions per tick. It must be at least one of them and less than half a revolution per tick. */
static inline bool drive_plan_sine(drive_plan *plan, const drive_jet *present, uint32_t start, uint32_t ticks,
    double amplitude_rad, double omega_rad_s)
{
    DRIVE_AS_WRITTEN
    const double phase = (omega_rad_s * 0.00025 / 6.283185307179586 * 4294967296.0) + 0.5;
    drive_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    if (!((phase >= 1.0) && (phase < 2147483648.0)) || !drive_is_number(amplitude_rad)) {
        return false;
    }
    goal.amplitude = (float)amplitude_rad;
    goal.phase_per_tick = (uint32_t)phase;
    goal.omega = (float)((double)goal.phase_per_tick / 4294967296.0 * 6.283185307179586 / 0.00025);
    return drive_plan_onto(plan, &goal, present, start, ticks);
}

/* Part of a profile: target from the movement of the averages in the last ticks and their lag behind the base. */
static inline void drive_jet_of_profile(const uint32_t moved[6], const uint32_t behind[2], uint32_t rest, float part_rad,
    float per_s, drive_jet *jet)
{
    DRIVE_AS_WRITTEN
    const float part = ((float)drive_signed(moved[0]) * 4.29496730e9f) + (float)drive_signed(moved[1]);
    const float part_2 = ((float)drive_signed(moved[2]) * 4.29496730e9f) + (float)drive_signed(moved[3]);
    const float part_3 = ((float)drive_signed(moved[4]) * 4.29496730e9f) + (float)drive_signed(moved[5]);
    const float part_4 = per_s * per_s;
    jet->r = ((float)drive_signed(rest) * 1.46291812e-9f)
            - (((((float)drive_signed(behind[0]) * 4.29496730e9f) + (float)drive_signed(behind[1]))
            + ((9.58333313e-1f * part) + ((0.5f * part_2) + (4.16666679e-2f * part_3)))) * part_rad);
    jet->r_dot = (((1.66666672e-1f * (part + part_3)) + (6.66666687e-1f * part_2)) * part_rad) * per_s;
    jet->r_ddot = ((0.5f * (part - part_3)) * part_rad) * part_4;
    jet->r_dddot = (((part - part_2) - (part_2 - part_3)) * part_rad) * (part_4 * per_s);
}

/* PROFILE. A profile turns set-points that arrive at any time into targets within limits of speed, acceleration and
 * jerk, without overshoot. The interrupt takes the target of each tick from drive_profile_next. Set a goal at any
 * time.
 * The path is averaged over 3 windows of ticks: its jerk is at most 2 acceleration / (window period). For a
 * stream of points use a window of as many ticks as lie between two points. A late, repeated or missing point changes
 * only the path between the points. Change a profile between two ticks, never while the interrupt computes one. */
#ifndef DRIVE_PROFILE_WINDOW
#define DRIVE_PROFILE_WINDOW 128u /* largest window, 1 to 128 ticks of 12 bytes each */
#endif
#if DRIVE_PROFILE_WINDOW > 128
#error "DRIVE_PROFILE_WINDOW is more than 128"
#endif

typedef struct {
    uint64_t goal; /* 2^-32 revolutions, modulo 2^64, as all further members */
    int64_t low; /* range of goals */
    int64_t high;
    uint64_t base; /* base: the path without averages */
    int32_t step; /* movement of the base in a tick, and the number of whole accelerations in it */
    int32_t whole;
    int32_t fastest;
    int32_t fastest_whole;
    int32_t acceleration;
    int32_t steps[3u * DRIVE_PROFILE_WINDOW]; /* steps of the last windows; the oldest is at `oldest` */
    uint32_t oldest;
    uint32_t window;
    uint32_t all; /* window^3: scale of the following members */
    uint64_t sums[3]; /* the last is the movement of the path */
    uint64_t earlier[2];
    uint64_t behind; /* lag of the path behind the base */
    float part_rad;
} drive_profile;

/* Part of a profile: converts to a signed number. */
static inline int64_t drive_signed_long(uint64_t units)
{
    const uint64_t below = UINT64_MAX - units; /* -1 - units, if not negative */
    return (units <= 0x7fffffffffffffffu) ? (int64_t)units : (-1 - (int64_t)below);
}

/* Part of a profile: returns 2 pi turn + rad in 2^-32 revolutions, saturated. */
static inline uint64_t drive_place(int32_t turn, double rad)
{
    const int64_t turns = (int64_t)turn * 4294967296;
    const int64_t rest = drive_signed_long(drive_units(rad));
    int64_t sum;
    if (rest >= 0) {
        sum = (turns > (9223372036854775807 - rest)) ? 9223372036854775807 : (turns + rest);
    } else {
        sum = (turns < (-9223372036854775807 - rest)) ? (-9223372036854775807 - 1) : (turns + rest);
    }
    return (uint64_t)sum;
}

/* Part of a profile: returns whether the limits are in range. */
static inline bool drive_profile_is_limit(double speed_rad_s, double acceleration_rad_s2)
{
    DRIVE_AS_WRITTEN
    return (speed_rad_s >= 5.851672317068638e-6) && (speed_rad_s <= (1073741823.0 * 5.851672317068638e-6)) &&
           (acceleration_rad_s2 >= 0.023406689268274557) &&
           (acceleration_rad_s2 <= (1073741823.0 * 0.023406689268274557));
}

/* Sets the limits, also in motion: above a lower speed the path brakes with the acceleration. Returns false and changes
 * nothing if a limit is NaN, below 2^-32 or above 1/4 revolution per tick (or tick squared). */
static inline bool drive_profile_limit(drive_profile *profile, double speed_rad_s, double acceleration_rad_s2)
{
    DRIVE_AS_WRITTEN
    const bool good = drive_profile_is_limit(speed_rad_s, acceleration_rad_s2);
    if (good) {
        profile->fastest = (int32_t)(speed_rad_s / 5.851672317068638e-6);
        profile->acceleration = (int32_t)(acceleration_rad_s2 / 0.023406689268274557);
        profile->fastest_whole = profile->fastest / profile->acceleration;
        profile->whole = ((profile->step < 0) ? -profile->step : profile->step) / profile->acceleration;
    }
    return good;
}

/* Part of a profile: sets a goal within the range. */
static inline void drive_profile_set_goal(drive_profile *profile, uint64_t place)
{
    const int64_t goal = drive_signed_long(place);
    const int64_t below = (goal < profile->high) ? goal : profile->high;
    profile->goal = (uint64_t)((below > profile->low) ? below : profile->low);
}

/* Limits the present and all later goals to the range between the two angles, 2 pi turn + rad. Returns false and
 * changes nothing if an angle is NaN or too large, or if the first one is above the second. */
static inline bool drive_profile_keep_within(drive_profile *profile, int32_t low_turn, double low_rad, int32_t high_turn,
    double high_rad)
{
    int64_t low;
    int64_t high;
    if (!drive_is_near(low_rad) || !drive_is_near(high_rad)) {
        return false;
    }
    low = drive_signed_long(drive_place(low_turn, low_rad));
    high = drive_signed_long(drive_place(high_turn, high_rad));
    if (low > high) {
        return false;
    }
    profile->low = low;
    profile->high = high;
    drive_profile_set_goal(profile, profile->goal);
    return true;
}

/* Sets the goal 2 pi turn + rad. Returns false if the goal is beyond the range, and sets it to the end of the range.
 * Returns false and keeps the goal if the angle is NaN or too large. It uses double: some hundred cycles on
 * most cores. */
static inline bool drive_profile_go_to(drive_profile *profile, int32_t turn, double rad)
{
    uint64_t goal;
    if (!drive_is_near(rad)) {
        return false;
    }
    goal = drive_place(turn, rad);
    drive_profile_set_goal(profile, goal);
    return profile->goal == goal;
}

/* Stops as soon as the acceleration permits. The path does not move back unless it has reversed in the last
 * 3 windows. A stop that ends beyond the range returns to the end of the range. */
static inline void drive_profile_stop(drive_profile *profile)
{
    const int64_t speed = (profile->step < 0) ? -(int64_t)profile->step : (int64_t)profile->step;
    const int64_t whole = (int64_t)profile->whole;
    const int64_t way = (whole * ((2 * speed) - ((int64_t)profile->acceleration * (whole + 1)))) / 2;
    const int64_t base = drive_signed_long(profile->base);
    profile->goal = profile->base + (uint64_t)((profile->step < 0) ? -way : way);
    /* A stop that begins beyond the range rests there. */
    if ((base >= profile->low) && (base <= profile->high)) {
        drive_profile_set_goal(profile, profile->goal);
    }
}

/* Restarts at 2 pi turn + rad with a speed and brakes to rest: for a shaft that is in motion. Returns false and changes
 * nothing if a number is NaN or too large, or if the speed exceeds a quarter of a revolution per tick. */
static inline bool drive_profile_start(drive_profile *profile, int32_t turn, double rad, double speed_rad_s)
{
    DRIVE_AS_WRITTEN
    const double units = speed_rad_s / 5.851672317068638e-6;
    const double rounded = units + ((units < 0.0) ? -0.5 : 0.5);
    int64_t step;
    int64_t sum;
    int64_t behind;
    int64_t mean;
    if (!drive_is_near(rad) || !drive_is_near(speed_rad_s) || (units > 1073741823.0) || (units < -1073741823.0) ||
        (profile->acceleration < 1)) {
        return false;
    }
    step = (int64_t)rounded;
    profile->step = (int32_t)step;
    profile->whole = ((profile->step < 0) ? -profile->step : profile->step) / profile->acceleration;
    for (uint32_t k = 0; k < (3u * DRIVE_PROFILE_WINDOW); k++) {
        profile->steps[k] = profile->step;
    }
    for (uint32_t k = 0; k < 2u; k++) {
        profile->sums[k] = 0u;
    }
    sum = step * (int64_t)profile->all;
    behind = (sum * (3 * ((int64_t)profile->window - 1))) / 2;
    mean = ((step * 3) * (int64_t)profile->window) / 2;
    profile->sums[2] = (uint64_t)sum;
    profile->earlier[0] = profile->sums[2];
    profile->earlier[1] = profile->sums[2];
    profile->behind = (uint64_t)behind;
    profile->base = drive_place(turn, rad) + (uint64_t)mean;
    drive_profile_stop(profile);
    return true;
}

/* Makes a profile at rest at angle 0. Returns false and changes nothing if a limit is out of range, as for
 * drive_profile_limit, or if the window is not 1 to DRIVE_PROFILE_WINDOW. */
static inline bool drive_profile_new(drive_profile *profile, double speed_rad_s, double acceleration_rad_s2, uint32_t window)
{
    DRIVE_AS_WRITTEN
    if ((window < 1u) || (window > DRIVE_PROFILE_WINDOW) ||
        !drive_profile_is_limit(speed_rad_s, acceleration_rad_s2)) {
        return false;
    }
    profile->step = 0;
    (void)drive_profile_limit(profile, speed_rad_s, acceleration_rad_s2);
    profile->low = -4611686018427387904;
    profile->high = 4611686018427387903;
    profile->oldest = 0u;
    profile->window = window;
    profile->all = window * window * window;
    profile->part_rad = (float)(1.4629180792671596e-9 / (double)profile->all);
    return drive_profile_start(profile, 0, 0.0, 0.0);
}

/* Returns whether the path rests at its goal. */
static inline bool drive_profile_has_arrived(const drive_profile *profile)
{
    bool still = (profile->goal == profile->base) && (profile->step == 0) && (profile->behind == 0u) &&
                 (profile->earlier[0] == 0u) && (profile->earlier[1] == 0u);
    for (uint32_t k = 0; k < 3u; k++) {
        still = still && (profile->sums[k] == 0u);
    }
    return still;
}

/* Part of a profile: returns whether a stop within a distance is possible after a tick with this step. */
static inline bool drive_profile_stops(const drive_profile *profile, int64_t distance, int32_t step, int32_t whole)
{
    const int32_t twice = (2 * step) - (profile->acceleration * whole);
    return (((int64_t)whole + 1) * (int64_t)twice) <= (2 * distance);
}

/* Part of a profile: computes the next step of the base. Forward is towards the goal. */
static inline void drive_profile_advance(drive_profile *profile)
{
    const int64_t far = 2305843009213693952;
    const int64_t left = drive_signed_long(profile->goal - profile->base);
    const bool back = left < 0;
    const int64_t apart = back ? drive_signed_long(profile->base - profile->goal) : left;
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
        if (drive_profile_stops(profile, distance, up, up_whole)) {
            next = up;
            whole = up_whole;
        } else if (whole == 0) {
            next = (acceleration < fastest) ? acceleration : fastest;
            next = ((int64_t)next < distance) ? next : (int32_t)distance;
            whole = 0;
            if (next == acceleration) {
                whole = 1;
            }
        } else if (within && drive_profile_stops(profile, distance, step, whole)) {
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

/* Part of a profile: returns the step before a number of windows. */
static inline uint64_t drive_profile_before(const drive_profile *profile, uint32_t windows)
{
    const uint32_t length = 3u * profile->window;
    const uint32_t at = profile->oldest + ((3u - windows) * profile->window);
    return (uint64_t)(int64_t)profile->steps[(at < length) ? at : (at - length)];
}

/* Part of a profile: splits into the nearest whole number and the remainder in 2^-32. */
static inline void drive_profile_split(uint64_t units, uint32_t *number)
{
    number[0] = (uint32_t)(units >> 32) + ((uint32_t)units >> 31);
    number[1] = (uint32_t)units;
}

/* Writes the target at the end of the next tick. Call it in the interrupt, once per tick. */
static inline void drive_profile_next(drive_profile *profile, drive_target *target)
{
    uint32_t moved[2 * 3];
    uint32_t behind[2];
    uint32_t base[2];
    uint64_t sum;
    drive_jet jet;
    drive_profile_advance(profile);
    sum = (((uint64_t)(int64_t)profile->step - (3u * drive_profile_before(profile, 1u))) + (3u * drive_profile_before(profile, 2u))) - drive_profile_before(profile, 3u);
    profile->steps[profile->oldest] = profile->step;
    profile->oldest = ((profile->oldest + 1u) < (3u * profile->window)) ? (profile->oldest + 1u) : 0u;
    sum += profile->sums[0];
    profile->sums[0] = sum;
    sum += profile->sums[1];
    profile->sums[1] = sum;
    sum += profile->sums[2];
    profile->sums[2] = sum;
    profile->behind += ((uint64_t)(int64_t)profile->step * profile->all) - sum;
    drive_profile_split(sum, &moved[0]);
    drive_profile_split(profile->earlier[0], &moved[2]);
    drive_profile_split(profile->earlier[1], &moved[4]);
    drive_profile_split(profile->behind, behind);
    drive_profile_split(profile->base, base);
    drive_jet_of_profile(moved, behind, base[1], profile->part_rad, 4000.0f, &jet);
    profile->earlier[1] = profile->earlier[0];
    profile->earlier[0] = sum;
    target->turn = drive_signed(base[0]);
    target->r = jet.r;
    target->r_dot = jet.r_dot;
    target->r_ddot = jet.r_ddot;
    target->r_dddot = jet.r_dddot;
}

/* Returns whether the floating-point modes of this context are the assumed ones. Call it once at start-up in the
 * context of the tick: an interrupt of a Cortex-M starts with the modes of FPDSCR. Returns false if rounding is not to
 * nearest, subnormal numbers are flushed, or the compiler fuses, reorders or widens operations. No tick calls it. */
static inline bool drive_modes_ok(void)
{
    DRIVE_AS_WRITTEN
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

#undef DRIVE_AS_WRITTEN
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
#endif
