/* Sliding mode control with an extended disturbance observer, for firmware in C: C99, and C++.
 *
 * The plant is a chain of integrators of order n with a disturbance in every channel, driven in the last one:
 *
 *     x_i' = x_(i+1) + d_i (i < n),      x_n' = a(x) + b u + d_n,      y = x_1
 *
 * An INSTANCE is a plant order n, an observer order r and the channels that carry an observer. It is a part of every
 * name: edo_smc_tick_n4_r2_c24 is the tick of order 4 with observers of order 2 in channels 2 and 4. A channel that is
 * not observed has no memory and costs no instruction. The list is at the end of this file. a(x) is linear; what it
 * does not say, the observers estimate.
 *
 *     #include "edo_smc.h"
 *     #include "my_design.h"                              my_design, an edo_smc_design_n4_r2_c24_t
 *     static edo_smc_state_n4_r2_c24_t state;             yours, wherever you like; one for each controller
 *
 *     once, at start-up: looks at the whole design
 *     status = edo_smc_init_n4_r2_c24(&my_design, sizeof my_design, &state, sizeof state);
 *
 *     in the timer interrupt, every period:
 *     edo_smc_output_t output = {0};
 *     edo_smc_tick_n4_r2_c24(&my_design, &state, x, &output);   x: the newest sample, float[4]
 *     pwm_set(output.u);
 *     edo_smc_report_applied_n4_r2_c24(&state, held);           only if the actuator holds something else
 *
 * DRIVES. A motor with one encoder, a flexible joint with two: counts in, current out, along a reference, with
 * monitors. A joint has one observer per encoder (joint), or is designed as a whole (coupled). What a drive has is a
 * part of its name too: _fast, a second gain set that comes in under a load; _late, a tick between computing the
 * current and holding it. They and an example stand before the chains, from "Drives" on.
 *
 * STATUS. Below 0 a call refused, and wrote nothing. NULL or misaligned memory, another size, version or instance,
 * numbers that are not finite, a state that init did not make: all of them are refusals, and so is memory that two
 * arguments share where something would be written (EDO_SMC_OVERLAP). A tick looks for that until the state has
 * started, for every tick would pay some 8 instructions; later an output inside the state or the design is written there.
 *
 * Of a state that something wrote over, a call refuses another design, another tag and a flag byte above 1. Its numbers
 * may be anything: a tick takes them, its u stays within the limits, and from any of them at most two good samples lead
 * back to estimates that the design can have. reset does it at once.
 *
 * What no call can see is your word: that a pointer points to memory of its type, and that the design stays as it was
 * while a state belongs to it.
 *
 * WHICH CORES. There is an archive for each of these: Cortex-M4F and M7 (-mcpu=cortex-m4 -mfpu=fpv4-sp-d16
 * -mfloat-abi=hard), M33 with floats (-mfloat-abi=hard), M3 and whatever is as large with -mfloat-abi=soft, M0 and M0+.
 * A linker that says "uses VFP register arguments, .. does not" was given code of yours with another -mfloat-abi. For
 * any other core, ABI or compiler take the self-contained file instead: `host-sim export --standalone` (C99, no archive).
 *
 * INTERRUPTS. Nothing here allocates, locks, or has a variable of its own. Calls with different states may interrupt
 * each other; calls with the same state may not.
 *
 * NUMBERS. The same bits as the Rust library on any machine, under these floating-point modes wherever a call runs, be it
 * main, an interrupt or a host program: rounding to nearest, subnormal numbers kept. Of a Cortex-M: FPSCR with RMode = 00
 * and FZ = 0. An interrupt begins with FPDSCR, not with the FPSCR of main, and needs FPCCR.ASPEN = 1 (all as after
 * reset). Of x86: MXCSR without FTZ and DAZ, which linking with -ffast-math sets. edo_smc_modes_ok checks it. Under other
 * modes u still stays within its limits and is a number; its bits are others.
 */
#ifndef EDO_SMC_H
#define EDO_SMC_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* 0.1.0: a byte each of major, minor and patch. Header, archive and designs must agree on it. */
#define EDO_SMC_VERSION 0x000100u

/* Version of the archive. */
uint32_t edo_smc_version(void);

/* Are the floating-point modes here and now those of NUMBERS above? 1, or 0. Call it once at start-up, where the tick
 * runs: an interrupt of a Cortex-M has modes of its own. */
uint32_t edo_smc_modes_ok(void);

typedef int32_t edo_smc_status_t;

enum {
    EDO_SMC_OK = 0,
    /* tick: the sample was not finite, or asked for more than 1e12. output.u is the fallback of the design (hold the
     * last u, or the safe one); the estimates wait, and the next good sample resumes. */
    EDO_SMC_REJECTED = 1,
    EDO_SMC_PROFILE_END = 2,       /* profile_go_to: the goal is beyond the range, the end of the range is taken */

    EDO_SMC_NULL = -1,
    EDO_SMC_MISALIGNED = -2,
    EDO_SMC_SIZE = -3,             /* not the size of this instance in this version */
    EDO_SMC_WRONG_VERSION = -4,    /* the design belongs to another version: export it again */
    EDO_SMC_WRONG_INSTANCE = -5,   /* the design is of another instance */
    EDO_SMC_NOT_FINITE = -6,       /* a number is NaN or infinite (report_applied: or beyond 1e12; an angle or a speed
                                    * of a profile: or beyond 6e9) */
    EDO_SMC_BAD_COEFFICIENTS = -7, /* no design has such numbers: was the file edited? */
    EDO_SMC_OVERLAP = -8,          /* two arguments share memory (tick: seen until the state has started) */
    EDO_SMC_NOT_INITIALISED = -9,  /* init of this instance did not make this state, or profile_new this profile */
    EDO_SMC_OTHER_DESIGN = -10,    /* init made this state for another design */
    EDO_SMC_DAMAGED = -11,         /* something wrote over the flag of this state: init it; or over a profile: make it
                                    * anew */
    EDO_SMC_NOT_STARTED = -12,     /* report_applied, estimates, go_on: no good sample yet, so there is nothing to correct,
                                    * to tell, to go on with */

    /* retune: the other design cannot take over now; the running one goes on. */
    EDO_SMC_RETUNE_SAMPLE = -13,   /* a tick would reject this sample: try with the next */
    EDO_SMC_RETUNE_DECAY = -14,    /* alpha lies within a tenth of k_l: u would jump; move one of them */
    EDO_SMC_RETUNE_OFFSET = -15,   /* no offset makes the other law ask for the same u: take a nearer one, or reset */
    EDO_SMC_RETUNE_ENCODER = -16,  /* it counts by another encoder or gear: reset */

    /* Plans. */
    EDO_SMC_PLAN_TICKS = -17,      /* a way takes 1 to 2^24 ticks */
    EDO_SMC_PLAN_FREQUENCY = -18,  /* a sine moves on by 2^-32 turns per tick, and less than half a turn */

    /* Profiles. */
    EDO_SMC_PROFILE_RANGE = -19,   /* keep_within: the lower end lies above the upper one */
    EDO_SMC_PROFILE_SPEED = -42,   /* start: more than a quarter of a turn per tick */

    /* Of edo_smc_design_*; the number of the channel goes out beside it where there is one. */
    EDO_SMC_FALLBACK_UNKNOWN = -20,         /* fallback is neither EDO_SMC_HOLD_LAST nor EDO_SMC_SAFE_U */
    EDO_SMC_CONFIG_NOT_FINITE = -21,        /* a number is NaN or infinite */
    EDO_SMC_PERIOD_NOT_POSITIVE = -22,      /* period_s <= 0 */
    EDO_SMC_INPUT_GAIN_ZERO = -23,          /* b = 0: the law divides by it */
    EDO_SMC_SURFACE_LEAD = -24,             /* c_n must be 1: divide all c by it */
    EDO_SMC_SURFACE_NOT_HURWITZ = -25,      /* the sliding motion would diverge */
    EDO_SMC_OFFSET_DECAY_NOT_POSITIVE = -26, /* alpha_per_s <= 0 */
    EDO_SMC_OFFSET_DECAY_TOO_SLOW = -27,    /* alpha times period below 1e-7: would not decay in float */
    EDO_SMC_NEGATIVE = -28,                 /* k_l, k_s, sigma_star_bound or observer_pole_limit below 0 */
    EDO_SMC_BOUNDARY_LAYER_EMPTY = -29,     /* k_s > 0 with epsilon < 0, or 0 and k_s times period 0 */
    EDO_SMC_LIMITS_TOO_WIDE = -30,          /* beyond 1e12; give +-1e12 for no limit */
    EDO_SMC_LIMITS_REVERSED = -31,          /* u_min > u_max */
    EDO_SMC_FALLBACK_OUTSIDE_LIMITS = -32,  /* safe_u is not within the limits */
    EDO_SMC_CHANNEL_MISMATCH = -33,         /* reserved: the instance names the channels */
    EDO_SMC_OBSERVER_ORDER = -34,           /* an order must be 1 .. r */
    EDO_SMC_ORDER_TOO_LOW = -35,            /* channel i < n needs an order of at least n - i */
    EDO_SMC_OBSERVER_NOT_FINITE = -36,      /* a gain is NaN or infinite */
    EDO_SMC_OBSERVER_NOT_HURWITZ = -37,     /* the observer would diverge */
    EDO_SMC_OBSERVER_TOO_FAST = -38,        /* fastest pole times period above observer_pole_limit */
    EDO_SMC_COEFFICIENT_RANGE = -39,        /* a coefficient overflows or vanishes in float: check the units */
    EDO_SMC_OTHER_RULE = -40,               /* a rule of the library that this header does not name */
    EDO_SMC_OUT_OF_RANGE = -41              /* a drive: the refusal names the number and its range */
};

/* Bits of output.health; from the fourth on of drives only. */
enum {
    EDO_SMC_INPUT_REJECTED = 1,
    EDO_SMC_SATURATED = 2,
    EDO_SMC_SIGMA_STAR_OVER_BOUND = 4,
    EDO_SMC_SAMPLE_LOST = 8,             /* a count did not come, or moved as no shaft can: the observers predict */
    EDO_SMC_DISTURBANCE_OVER_BOUND = 16, /* load, friction, or a count that sticks */
    EDO_SMC_STUCK_AT_LIMIT = 32,         /* u at a limit for too long while sigma did not fall */
    EDO_SMC_STOPPED = 64,                /* an alarm has stopped the drive: reset starts it anew */
    EDO_SMC_POSITION_STEPPED = 128,      /* a missed tick or a slip: the position was taken from the counts anew */
    EDO_SMC_WAITS = 256,                 /* counts do not agree with each other yet: no current until they do */
    EDO_SMC_WRONG_WAY = 512,             /* it speeds up against its current: encoder or phases are reversed */
    EDO_SMC_OSCILLATES = 1024,           /* the disturbance is over its bound to and fro: a limit cycle */
    EDO_SMC_BRAKES = 2048,               /* after an alarm: the current opposes the speed, no target is followed */
    EDO_SMC_OVERSPEED = 4096,            /* guard: it is faster than its fence allows */
    EDO_SMC_FOLLOWING_ERROR = 8192,      /* guard: it is further from its target than its fence allows */
    EDO_SMC_END_OF_RANGE = 16384         /* guard: less is left to an end of its range than it needs to brake */
};
/* For config.stops_at: what monitors raise an alarm with; those of them that no planned stop answers; all of them, and
 * the drive brakes before it stops, as long as its counts can be believed. The last ones stop any drive. */
enum {
    EDO_SMC_ALARMS = 1 + 4 + 16 + 32 + 512 + 1024,
    EDO_SMC_BEYOND_CONTROL = 1 + 32 + 512 + 1024,
    EDO_SMC_BRAKING = 1 + 4 + 16 + 32 + 512 + 1024 + 2048,
    EDO_SMC_RUNAWAY = 512 + 1024
};

/* What a tick answers. */
typedef struct edo_smc_output {
    float u;          /* hold this until the next tick; within the limits, in the plant's input unit */
    float sigma;      /* the sliding variable, in the unit of x_n */
    float sigma_star; /* the same without its offset at the start */
    uint16_t health;  /* 0, or some of the bits above */
} edo_smc_output_t;

/* config.fallback: what goes out when a sample is rejected. */
enum { EDO_SMC_HOLD_LAST = 0, EDO_SMC_SAFE_U = 1 };

/* design.instance */
#define EDO_SMC_ID(n, r, mask) ((uint32_t)(n) | (uint32_t)(r) << 8 | (uint32_t)(mask) << 16)

/* An assertion of the compiler that C99 has too. */
#define EDO_SMC_ASSERT(name, holds) typedef char edo_smc_assert_##name[(holds) ? 1 : -1];
#define EDO_SMC_ROUND_UP(bytes, to) (((bytes) + (to) - 1) / (to) * (to))

/* Drives: encoder counts in, current out.
 *
 *     static edo_smc_config_motor_t config = {
 *         .period_s = 1e-3,
 *         .motor = {.inertia_kg_m2 = 2e-4, .torque_n_m_per_a = 0.05, .damping_n_m_s = 1e-5},
 *         .encoder = {.bits = 14, .counts_per_turn = 16384, .gear_num = 1, .gear_den = 1},
 *         .limits = {.min = -10.0, .max = 10.0},
 *         .lag_s = 2e-4,
 *     };
 *     static edo_smc_design_motor_fast_t design;
 *     static edo_smc_state_motor_fast_t state;
 *     static edo_smc_sample_motor_t sample;
 *     static edo_smc_plan_motor_t plan;                         zeros: rest at angle 0
 *
 *     once, at start-up:
 *     edo_smc_refusal_t refusal;
 *     edo_smc_by_rule_motor_fast(&config, sizeof config);       all that is not on the data sheet
 *     status = edo_smc_design_motor_fast(&config, sizeof config, &design, sizeof design, &refusal);
 *     status = edo_smc_init_motor_fast(&design, sizeof design, &state, sizeof state);
 *
 *     in the timer interrupt, every period:
 *     edo_smc_output_t output = {0};
 *     sample.count = encoder_register();                        as it stands: it may wrap
 *     sample.begin = sample.end;                                a tick begins where the last one ended
 *     edo_smc_plan_play_motor(&plan, ++tick, &sample.end);
 *     edo_smc_tick_motor_fast(&design, &state, &sample, &output);
 *     pwm_set(output.u);
 *
 * The count grows with the angle and is 0 at angle 0: of an encoder that counts down, or stands elsewhere there, hand
 * in what it should have been (0u - register, register - offset); only `bits` of it are read, and all of a counter that
 * wraps at another number of states than 2^bits (a timer that is reloaded at 9999 has 10000).
 *
 * A _late drive holds its current in the tick after the one that computed it; begin and end are those of that tick.
 *
 * A joint as a whole has its numbers from the host, `host-sim export FILE --lang c --prefix my -o my_config.h`:
 *
 *     #include "my_config.h"                                    my_config, an edo_smc_config_coupled_t
 *     static edo_smc_design_coupled_fast_t design;
 *
 *     status = edo_smc_design_coupled_fast(&my_config, sizeof my_config, &design, sizeof design, &refusal);
 */
typedef struct edo_smc_encoder {
    double bits;               /* of the counter, 2 .. 32 */
    double counts_per_turn;    /* of the encoder */
    double gear_num, gear_den; /* the encoder makes num turns while the shaft that is meant makes den */
    double states;             /* before the counter wraps, where that is not 2^bits; else 0 */
} edo_smc_encoder_t;

typedef struct edo_smc_limits {
    double min, max; /* of u */
} edo_smc_limits_t;

/* When the fast gain set of a _fast drive comes in. Not read by others. */
typedef struct edo_smc_switching {
    double calm_steps, alert_steps; /* smoothed innovation at which it begins to, and at which it is all in */
    double smoothing_s, keep_s;
} edo_smc_switching_t;

/* What a motor's drive is designed from. Write the data sheet, let edo_smc_by_rule_* fill the rest, change what you
 * know better. Or let the host fill it: `host-sim export FILE --lang c`. */
typedef struct edo_smc_config_motor {
    double period_s; /* 2e-5 .. 1e-2 */
    struct {
        double inertia_kg_m2, torque_n_m_per_a, damping_n_m_s; /* at the shaft whose angle is meant, load included */
    } motor;
    edo_smc_encoder_t encoder;
    edo_smc_limits_t limits;
    /* From here on by rule, but for lag_s. */
    struct {
        double surface_rad_s;  /* the error obeys e' = -w_c e */
        double observer_rad_s; /* 1.5 w_c */
        double reaching_per_s; /* 8 w_c, at most 1/period */
        double offset_per_s;   /* w_c/2 */
    } bandwidths;
    double fast_ratio; /* bandwidth of the fast gain set over that of the quiet one */
    edo_smc_switching_t switching;
    double gate_steps; /* a count further from its prediction is not believed */
    double lost_ticks; /* so many counts in a row are bridged */
    double hold;       /* 1: when nobody may ask for u the last one is held; else safe_u goes out */
    double safe_u;
    double lag_s;     /* of the current loop, yours to write before the rule: 2e-4 if nobody knows */
    double uncertain; /* share to which inertia and torque are known: the monitors allow for it */
    double stops_at;  /* what follows an alarm: EDO_SMC_BRAKING by rule, or the alarms that stop it */
} edo_smc_config_motor_t;

/* The same of a flexible joint, everything on the link's side of a gear. */
typedef struct edo_smc_config_joint {
    double period_s;
    struct {
        double link_inertia_kg_m2, link_damping_n_m_s;
        double weight_n_m; /* torque of the link's weight when it is level */
        double stiffness_n_m;
        double motor_inertia_kg_m2, motor_damping_n_m_s, torque_n_m_per_a;
    } joint;
    edo_smc_encoder_t encoders[2]; /* on the link, on the motor */
    edo_smc_limits_t limits;
    /* From here on by rule, but for load_n_m. */
    struct {
        double surface_rad_s, link_rad_s, motor_rad_s, reaching_per_s, offset_per_s;
    } bandwidths;
    double fast_ratios[2];
    edo_smc_switching_t switching;
    double gate_steps[2];
    double lost_ticks;
    double hold;
    double safe_u;
    double load_n_m; /* largest sudden load on the link, yours to write before the rule */
    double uncertain;
    double stops_at;
} edo_smc_config_joint_t;

/* The same of a joint that is designed as a whole. Take it for a stiff spring: gears, harmonic drives, belts. Its
 * gains come from a search of the host: `host-sim export FILE --lang c` writes them all, a constant of this type. */
typedef struct edo_smc_config_coupled {
    double period_s;
    struct {
        double link_inertia_kg_m2, link_damping_n_m_s;
        double weight_n_m;
        double stiffness_n_m;
        double motor_inertia_kg_m2, motor_damping_n_m_s, torque_n_m_per_a;
    } joint;
    edo_smc_encoder_t encoders[2]; /* on the link, on the motor */
    edo_smc_limits_t limits;
    struct {
        double surface_rad_s, link_rad_s, motor_rad_s, reaching_per_s; /* poles of a rigid shaft: surface, reaching */
        double offset_per_s;                                           /* half of surface */
    } bandwidths;
    double fast_ratios[2];
    edo_smc_switching_t switching; /* of it smoothing_s and keep_s are read */
    double gate_steps[2];
    double lost_ticks;
    double hold;
    double safe_u;
    struct {
        double lag_s;             /* of the current loop */
        double resolution_rad[2]; /* behind the gear: one step of the encoder, or with noise more */
        double calm_steps[2];     /* smoothed innovation at which the fast set comes in; all in at 2.67 times as many */
    } coupled;
    double load_n_m; /* largest sudden load on the link */
    double uncertain;
    double stops_at;
} edo_smc_config_coupled_t;

/* Limits of position, speed and following error of the shaft, of a joint's link: INFINITY, and -INFINITY for low_rad,
 * where there is none. The range is from low_rad to high_rad, counted from angle 0 over whole turns. */
typedef struct edo_smc_fence_limits {
    double low_rad, high_rad;
    double max_speed_rad_s;
    double following_rad; /* largest distance from the target */
} edo_smc_fence_limits_t;

/* The same as a tick compares them. Zeros are a fence that every motion breaks. */
typedef struct edo_smc_fence {
    uint32_t words[9];
} edo_smc_fence_t;

/* Which number of a configuration was refused. */
typedef struct edo_smc_refusal {
    char field[32]; /* as C writes it behind `config.` or `limits.`; "fallback": hold and safe_u */
    double given;   /* or what it makes, such as a bandwidth times the period, in the unit of the next two */
    double low, high;
} edo_smc_refusal_t;

/* Where the shaft should be: 2 pi turn + r, and its derivatives, in rad and s. */
typedef struct edo_smc_target_motor {
    int32_t turn;
    float r, r_dot;
} edo_smc_target_motor_t;

typedef struct edo_smc_target_joint {
    int32_t turn;
    float r, r_dot, r_ddot, r_dddot;
} edo_smc_target_joint_t;

/* What a tick is given: counts, and where the shaft should be at both ends of the tick in which u is held. */
typedef struct edo_smc_sample_motor {
    uint32_t count;
    uint32_t lost; /* 1: the count did not come, or its checksum was wrong */
    edo_smc_target_motor_t begin, end;
} edo_smc_sample_motor_t;

typedef struct edo_smc_sample_joint {
    uint32_t link, motor; /* counts */
    uint32_t lost;        /* 1 for that of the link, 2 for that of the motor, 3 for both */
    edo_smc_target_joint_t begin, end;
} edo_smc_sample_joint_t;

/* What a drive knows, in rad and s of each shaft. */
typedef struct edo_smc_estimates_motor {
    int32_t turn;   /* to which the position is to be added */
    float position; /* with a gear it may be some turns */
    float speed;
    float disturbance; /* acceleration that the model does not explain */
    float load;        /* the same as a torque against the shaft, N m: load and friction */
} edo_smc_estimates_motor_t;

typedef struct edo_smc_estimates_joint {
    int32_t turn;
    float position[2], speed[2], disturbance[2], load[2]; /* of the link, of the motor */
} edo_smc_estimates_joint_t;

/* Plans: where the shaft should be at every tick. Ticks are counted by you, from anywhere; they may wrap. A plan begins
 * with what another one, the one that is played, has at the tick `start`, and takes `ticks` from there: so a new goal
 * in flight is no jump. Asked before its start it gives its beginning; its end is ahead for less than 2^31 ticks. They are made in double, in software on most cores: outside of the interrupt, and not in the
 * plan that is played; hand it over between two ticks, at `start`. Whether the current suffices is not asked: a move of
 * D rad in t s takes up to 5.8 D/t^2 rad/s^2 of a motor.
 *
 * edo_smc_plan_rest_*  rest at 2 pi turn + angle, always: for a start, of the angle in the estimates
 * edo_smc_plan_move_*  from where the other plan is to rest there
 * edo_smc_plan_stop_*  to rest, and never back: at an even speed at half of the way that would have been gone. Of a
 *                      shaft that slows down already it takes fewer ticks where a longer stop would go back
 * edo_smc_plan_sine_*  onto amplitude sin(omega t) about angle 0, whose phase is 0 at tick 0
 * edo_smc_plan_play_*  the target at a tick: in the interrupt, once per tick, for its end. A plan that is over stays so
 *                      when ticks have wrapped (2^32 of them are five days at 10 kHz)
 * edo_smc_plan_at_*    the same of any tick, to look ahead; the plan stays as it is
 */
#define EDO_SMC_PLANS(name, derivatives)                                                                               \
    typedef struct edo_smc_plan_##name {                                                                               \
        uint32_t words[13 + 12 * (derivatives)];                                                                       \
    } edo_smc_plan_##name##_t;                                                                                         \
    edo_smc_status_t edo_smc_plan_rest_##name(edo_smc_plan_##name##_t *plan, int32_t turn, float angle);               \
    edo_smc_status_t edo_smc_plan_move_##name(edo_smc_plan_##name##_t *plan, const edo_smc_plan_##name##_t *from,      \
                                              uint32_t start, uint32_t ticks, double period_s, int32_t turn,           \
                                              float angle);                                                            \
    edo_smc_status_t edo_smc_plan_stop_##name(edo_smc_plan_##name##_t *plan, const edo_smc_plan_##name##_t *from,      \
                                              uint32_t start, uint32_t ticks, double period_s);                        \
    edo_smc_status_t edo_smc_plan_sine_##name(edo_smc_plan_##name##_t *plan, const edo_smc_plan_##name##_t *from,      \
                                              uint32_t start, uint32_t ticks, double period_s, double amplitude_rad,   \
                                              double omega_rad_s);                                                     \
    edo_smc_status_t edo_smc_plan_play_##name(edo_smc_plan_##name##_t *plan, uint32_t tick,                            \
                                              edo_smc_target_##name##_t *target);                                      \
    edo_smc_status_t edo_smc_plan_at_##name(const edo_smc_plan_##name##_t *plan, uint32_t tick,                        \
                                            edo_smc_target_##name##_t *target);

EDO_SMC_PLANS(motor, 3)
EDO_SMC_PLANS(joint, 4)

/* Profiles: set-points that come at any time become a path within limits of speed, acceleration and jerk, without
 * overshoot. In place of a plan: `next` gives the target of each tick, `go_to` takes a goal whenever there is one. The
 * path is the mean of the fastest way within speed and acceleration over windows of ticks, taken two times for a motor
 * and three times for a joint: |r_dddot| <= 2 acceleration/(window period).
 *
 *     static edo_smc_profile_motor_t profile;
 *
 *     once, at start-up: 1 ms, 100 rad/s, 1200 rad/s^2, windows of 10 ticks
 *     status = edo_smc_profile_new_motor(&profile, sizeof profile, 1e-3, 100.0, 1200.0, 10u, &refusal);
 *
 *     in the timer interrupt, in place of edo_smc_plan_play_motor:
 *     edo_smc_profile_next_motor(&profile, &sample.end);
 *
 *     between two ticks, with the control interrupt masked:
 *     status = edo_smc_profile_go_to_motor(&profile, turn, rad);
 *
 * A profile is changed between two ticks, not while the interrupt is in `next`: a goal is two words. It holds no
 * address, so it may be copied. Speeds and accelerations are rounded down to whole units of 2^-32 turns per tick and
 * per tick squared. All functions but `next` and `has_arrived` compute in double, in software on most cores.
 *
 * edo_smc_profile_new_*   at rest at angle 0. EDO_SMC_OUT_OF_RANGE for a period outside of 1 us to 1 s, a window outside
 *                         of 1 to EDO_SMC_PROFILE_WINDOW ticks, a speed or an acceleration outside of 2^-32 turns to a
 *                         quarter of a turn per tick or per tick squared; `refusal` (which may be NULL) names it
 * edo_smc_profile_limit_* another speed and acceleration, in motion too: above a lower speed it brakes as the
 *                         acceleration has it. Refused as by `new`; then the old ones stay
 * edo_smc_profile_keep_within_*  goals are taken between 2 pi turn + rad of both, and so is the present one
 * edo_smc_profile_go_to_* to 2 pi turn + rad, from where it is. EDO_SMC_PROFILE_END where that is beyond the range
 * edo_smc_profile_stop_*  to rest as soon as the acceleration allows it. A stop that ends beyond the range goes back to
 *                         its end
 * edo_smc_profile_start_* anew at 2 pi turn + rad with this speed, and to rest from there: to take over a shaft that
 *                         turns, from its estimates
 * edo_smc_profile_has_arrived_*  1 if it is at rest at its goal; 0 if not, and for what is no profile
 * edo_smc_profile_next_*  the target at the end of the next tick: in the interrupt, once per tick
 */
#define EDO_SMC_PROFILE_WINDOW 128 /* ticks of a window at most */
#define EDO_SMC_PROFILES(name, averages)                                                                               \
    typedef struct edo_smc_profile_##name {                                                                            \
        uint32_t words[26 + (2 + EDO_SMC_PROFILE_WINDOW) * (averages)];                                                \
    } edo_smc_profile_##name##_t;                                                                                      \
    edo_smc_status_t edo_smc_profile_new_##name(edo_smc_profile_##name##_t *profile, size_t profile_size,              \
                                                double period_s, double speed_rad_s, double acceleration_rad_s2,       \
                                                uint32_t window, edo_smc_refusal_t *refusal);                          \
    edo_smc_status_t edo_smc_profile_limit_##name(edo_smc_profile_##name##_t *profile, double speed_rad_s,             \
                                                  double acceleration_rad_s2, edo_smc_refusal_t *refusal);             \
    edo_smc_status_t edo_smc_profile_keep_within_##name(edo_smc_profile_##name##_t *profile, int32_t low_turn,         \
                                                        double low_rad, int32_t high_turn, double high_rad);           \
    edo_smc_status_t edo_smc_profile_go_to_##name(edo_smc_profile_##name##_t *profile, int32_t turn, double rad);      \
    edo_smc_status_t edo_smc_profile_stop_##name(edo_smc_profile_##name##_t *profile);                                 \
    edo_smc_status_t edo_smc_profile_start_##name(edo_smc_profile_##name##_t *profile, int32_t turn, double rad,       \
                                                  double speed_rad_s);                                                 \
    uint32_t edo_smc_profile_has_arrived_##name(const edo_smc_profile_##name##_t *profile);                            \
    edo_smc_status_t edo_smc_profile_next_##name(edo_smc_profile_##name##_t *profile,                                  \
                                                 edo_smc_target_##name##_t *target);

EDO_SMC_PROFILES(motor, 2)
EDO_SMC_PROFILES(joint, 3)

/* All of one drive: its configuration, its plant, and how many words law and state have. Samples, estimates, plans and
 * profiles of a joint as a whole are those of a joint.
 *
 * edo_smc_by_rule_NAME    fills a configuration: all but period, data sheet, encoders, limits, and lag_s or load_n_m.
 *                         Not of a joint as a whole: the search for its gains takes a host.
 * edo_smc_tune_NAME       another surface, all bandwidths in the same proportions, and the gates for them: then design
 *                         and retune. For bandwidths of your own write them, and tune to the surface that they have. Of
 *                         a joint as a whole the host has made sure of its own gains only, in the corners of the data
 *                         sheet; ask it for others (`host-sim design FILE --set drive.surface_rad_s=..`).
 * edo_smc_design_NAME     designs on the spot, to the same bits as on the host. Double precision in software: for the
 *                         main loop. Of what is refused, `refusal` (which may be NULL) says which number it was. On a
 *                         Cortex-M4F that of a joint as a whole takes 9 kB of stack and some 80 kB of flash.
 * edo_smc_init_NAME       looks at a design and makes a state that waits for its first good sample: all counts there,
 *                         at most half a counter from angle 0. No current flows before the counts have agreed with
 *                         each other for 10 ms, three ticks at least (EDO_SMC_WAITS).
 * edo_smc_tick_NAME       one tick. After an alarm of stops_at the safe u goes out, 0 without one, until reset.
 * edo_smc_go_on_NAME      the same but for a start, which is left to a caller that has the time: its bound is shorter.
 *                         Until `tick` has started, the fallback goes out.
 * edo_smc_missed_NAME     so many periods have passed without a tick, the current held all the while: a missed timer
 *                         interrupt that its overflow flag or a time stamp tells of. Before the coming tick.
 * edo_smc_report_applied_NAME  what the power stage held since the last tick, where that is another u: the only
 *                         anti-windup. Before the next tick. Twice the same and clearly less than was put out is taken
 *                         for the limit of the stage, until some ticks have passed.
 * edo_smc_limit_NAME      from now on the power stage gives at most this u of either sign. A start forgets it: call it
 *                         before each tick. EDO_SMC_NOT_FINITE for a number below 0 or none.
 * edo_smc_trip_NAME       what follows an alarm, from the next tick on, for a reason of yours: a switch, a door.
 * edo_smc_fence_NAME      limits of position, speed and following error, for the drive of this configuration. Braking
 *                         takes v^2/(2 a) + |v| (1/k_v + 2 T), with 60 % of the current; another current, inertia,
 *                         surface or period needs another fence. It designs once more: for the main loop.
 * edo_smc_guard_NAME      after a tick, with its sample and its output: where the estimates break a limit, its bit is
 *                         set in output.health, and from the next tick on follows what follows an alarm (trip). u stays.
 *                         The target is sample.begin. A drive that waits or has stopped is left as it is; before the
 *                         start the answer is EDO_SMC_NOT_STARTED.
 * edo_smc_estimates_NAME  what is known at the instant of the last tick.
 * edo_smc_reset_NAME      forgets all but the design: the next good sample starts again.
 * edo_smc_retune_NAME     another design, checked here once more, takes over before the coming tick, of which this is
 *                         the sample: the estimates go on, u does not jump. Then tick with it and the same sample.
 */
#define EDO_SMC_DRIVE(name, config_of, plant, law_words, state_words)                                                  \
    typedef struct edo_smc_design_##name {                                                                             \
        uint32_t version, instance;                                                                                    \
        uint32_t words[law_words];                                                                                     \
        uint32_t check;                                                                                                \
    } edo_smc_design_##name##_t;                                                                                       \
    typedef struct edo_smc_state_##name {                                                                              \
        uintptr_t design;                                                                                              \
        uint32_t tag;                                                                                                  \
        uint32_t words[state_words];                                                                                   \
    } edo_smc_state_##name##_t;                                                                                        \
    size_t edo_smc_design_size_##name(void);                                                                           \
    size_t edo_smc_state_size_##name(void);                                                                            \
    edo_smc_status_t edo_smc_tune_##name(edo_smc_config_##config_of##_t *config, size_t config_size,                   \
                                         double surface_rad_s);                                                        \
    edo_smc_status_t edo_smc_design_##name(const edo_smc_config_##config_of##_t *config, size_t config_size,           \
                                           edo_smc_design_##name##_t *design, size_t design_size,                      \
                                           edo_smc_refusal_t *refusal);                                                \
    edo_smc_status_t edo_smc_init_##name(const edo_smc_design_##name##_t *design, size_t design_size,                  \
                                         edo_smc_state_##name##_t *state, size_t state_size);                          \
    edo_smc_status_t edo_smc_tick_##name(const edo_smc_design_##name##_t *design, edo_smc_state_##name##_t *state,     \
                                         const edo_smc_sample_##plant##_t *sample, edo_smc_output_t *output);          \
    edo_smc_status_t edo_smc_go_on_##name(const edo_smc_design_##name##_t *design, edo_smc_state_##name##_t *state,    \
                                          const edo_smc_sample_##plant##_t *sample, edo_smc_output_t *output);         \
    edo_smc_status_t edo_smc_missed_##name(const edo_smc_design_##name##_t *design, edo_smc_state_##name##_t *state,   \
                                           uint32_t periods);                                                          \
    edo_smc_status_t edo_smc_trip_##name(const edo_smc_design_##name##_t *design, edo_smc_state_##name##_t *state);    \
    edo_smc_status_t edo_smc_fence_##name(const edo_smc_config_##config_of##_t *config, size_t config_size,            \
                                          const edo_smc_fence_limits_t *limits, edo_smc_fence_t *fence,                \
                                          size_t fence_size, edo_smc_refusal_t *refusal);                              \
    edo_smc_status_t edo_smc_guard_##name(const edo_smc_design_##name##_t *design, edo_smc_state_##name##_t *state,    \
                                          const edo_smc_fence_t *fence, const edo_smc_sample_##plant##_t *sample,      \
                                          edo_smc_output_t *output);                                                   \
    edo_smc_status_t edo_smc_report_applied_##name(edo_smc_state_##name##_t *state, float u);                          \
    edo_smc_status_t edo_smc_limit_##name(edo_smc_state_##name##_t *state, float u);                                   \
    edo_smc_status_t edo_smc_estimates_##name(const edo_smc_design_##name##_t *design,                                 \
                                              const edo_smc_state_##name##_t *state,                                   \
                                              edo_smc_estimates_##plant##_t *estimates);                               \
    edo_smc_status_t edo_smc_reset_##name(edo_smc_state_##name##_t *state);                                            \
    edo_smc_status_t edo_smc_retune_##name(const edo_smc_design_##name##_t *from, const edo_smc_design_##name##_t *to, \
                                           size_t design_size, edo_smc_state_##name##_t *state,                        \
                                           const edo_smc_sample_##plant##_t *sample);

EDO_SMC_DRIVE(motor, motor, motor, 63, 26)
EDO_SMC_DRIVE(motor_fast, motor, motor, 70, 28)
EDO_SMC_DRIVE(motor_late, motor, motor, 63, 27)
EDO_SMC_DRIVE(motor_fast_late, motor, motor, 70, 29)
EDO_SMC_DRIVE(joint, joint, joint, 105, 38)
EDO_SMC_DRIVE(joint_fast, joint, joint, 121, 42)
EDO_SMC_DRIVE(joint_late, joint, joint, 105, 39)
EDO_SMC_DRIVE(joint_fast_late, joint, joint, 121, 43)
EDO_SMC_DRIVE(coupled, coupled, joint, 137, 37)
EDO_SMC_DRIVE(coupled_fast, coupled, joint, 151, 41)
EDO_SMC_DRIVE(coupled_late, coupled, joint, 137, 38)
EDO_SMC_DRIVE(coupled_fast_late, coupled, joint, 151, 42)

/* The drives whose gains have a rule. */
#define EDO_SMC_BY_RULE(name, plant)                                                                                   \
    edo_smc_status_t edo_smc_by_rule_##name(edo_smc_config_##plant##_t *config, size_t config_size);

EDO_SMC_BY_RULE(motor, motor)
EDO_SMC_BY_RULE(motor_fast, motor)
EDO_SMC_BY_RULE(motor_late, motor)
EDO_SMC_BY_RULE(motor_fast_late, motor)
EDO_SMC_BY_RULE(joint, joint)
EDO_SMC_BY_RULE(joint_fast, joint)
EDO_SMC_BY_RULE(joint_late, joint)
EDO_SMC_BY_RULE(joint_fast_late, joint)

EDO_SMC_ASSERT(config_motor, sizeof(edo_smc_config_motor_t) == 8 * 27)
EDO_SMC_ASSERT(config_joint, sizeof(edo_smc_config_joint_t) == 8 * 39)
EDO_SMC_ASSERT(config_coupled, sizeof(edo_smc_config_coupled_t) == 8 * 44)
EDO_SMC_ASSERT(config_coupled_1, offsetof(edo_smc_config_coupled_t, coupled) == 8 * 36)
EDO_SMC_ASSERT(sample_motor, sizeof(edo_smc_sample_motor_t) == 4 * 8)
EDO_SMC_ASSERT(sample_joint, sizeof(edo_smc_sample_joint_t) == 4 * 13)
EDO_SMC_ASSERT(estimates_motor, sizeof(edo_smc_estimates_motor_t) == 4 * 5)
EDO_SMC_ASSERT(estimates_joint, sizeof(edo_smc_estimates_joint_t) == 4 * 9)

/* All of one chain: n, r, the observed channels as a mask (bit i - 1 for channel i), and how many they are.
 *
 * edo_smc_design_NAME_t   what the tick multiplies with, in flash; made by `host-sim export` or by edo_smc_design_NAME.
 *                         Numbers in the order that controller_core::LAYOUT declares, with the row of a(x)/b
 *                         before their check.
 * edo_smc_config_NAME_t   what a design is made of. Of each observed channel, the lowest first: gains l_1 .. l_r and the
 *                         order that is used of them (1 .. r). Poles all at -w: order 1 {w}, order 2 {2w, w^2}, order
 *                         3 {3w, 3w^2, w^3}. observer_pole_limit: 1 unless you know why. d_hat: guess of the
 *                         disturbances to start with, read where there is an observer.
 * edo_smc_state_NAME_t    what the controller remembers. Its words are its own.
 *
 * edo_smc_init_NAME       looks at a design and makes a state that waits for its first good sample.
 * edo_smc_tick_NAME       one tick. The first good sample starts it; until then the fallback goes out.
 * edo_smc_report_applied_NAME  tells what the actuator really holds since the last tick, where that is not the u that
 *                         it answered: the observers live on it, and it is the only anti-windup. Before the next tick.
 *                         For limits and brakes; a u that is right and only late is better not told.
 * edo_smc_estimates_NAME  what the observers know at the instant of the last tick: of each channel the disturbance and
 *                         its derivatives, in physical units, 0 where there is no observer.
 * edo_smc_reset_NAME      forgets all but the design: the next good sample starts again. For the end of a fault.
 * edo_smc_retune_NAME     another design takes over before the coming tick, of which x is the sample: the estimates go
 *                         on, u does not jump. Then tick with it and the same x. It looks at the whole design.
 * edo_smc_design_NAME     designs on the spot, to the same bits as on the host. Arithmetic of double precision in
 *                         software: for a start-up, not for an interrupt. `channel` may be NULL; else the number of the
 *                         channel that a refusal is about (0: none) is written to it.
 * .._design_size_NAME, .._state_size_NAME   sizes as the archive has them.
 */
#define EDO_SMC_INSTANCE(name, n, r, mask, o)                                                                           \
    typedef struct edo_smc_design_##name {                                                                             \
        uint32_t version;  /* EDO_SMC_VERSION */                                                                       \
        uint32_t instance; /* EDO_SMC_ID(n, r, mask) */                                                                \
        float d_hat[n];                                                                                                \
        float rate, rate_n, theta_n;                                                                                   \
        float gamma[o][r];                                                                                             \
        float c[n];                                                                                                    \
        float g[o][r];                                                                                                 \
        float kx[n];                                                                                                   \
        float kw, us;                                                                                                  \
        float k[o][r];                                                                                                 \
        float satk, lim, unit, decay, u_min, u_max, plausible, ko, sigma_star_bound, hold, fallback;                   \
        float period, input_gain, mu2_n;                                                                               \
        float a_row[n];                                                                                                \
        float check; /* of every number before it: what was changed afterwards is refused */                           \
    } edo_smc_design_##name##_t;                                                                                       \
    typedef struct edo_smc_config_##name {                                                                             \
        double period_s;                                                                                               \
        double c[n]; /* c_1 .. c_n of the surface, c_n = 1; all roots at -w: the powers of (p + w)^(n-1) */            \
        double alpha_per_s;                                                                                            \
        double gains[o][r];                                                                                            \
        double k_l, k_s, epsilon;                                                                                      \
        double gradient[n]; /* of a(x) to x_1 .. x_n */                                                                \
        double input_gain;  /* b */                                                                                    \
        double u_min, u_max;                                                                                           \
        double safe_u; /* read if fallback is EDO_SMC_SAFE_U */                                                        \
        double sigma_star_bound;                                                                                       \
        double observer_pole_limit;                                                                                    \
        double d_hat[n];                                                                                               \
        uint32_t order[o];                                                                                             \
        uint32_t fallback;                                                                                             \
    } edo_smc_config_##name##_t;                                                                                       \
    typedef struct edo_smc_state_##name {                                                                              \
        uintptr_t design;                                                                                              \
        uint32_t tag;                                                                                                  \
        uint32_t words[(o) * (r) + 2 * (o) + 4];                                                                       \
    } edo_smc_state_##name##_t;                                                                                        \
    EDO_SMC_ASSERT(name##_1, sizeof(edo_smc_design_##name##_t) == 4 * (22 + 4 * (n) + 3 * (o) * (r)))                  \
    EDO_SMC_ASSERT(name##_2, offsetof(edo_smc_design_##name##_t, rate) == 4 * (2 + (n)))                               \
    EDO_SMC_ASSERT(name##_3, offsetof(edo_smc_design_##name##_t, gamma) == 4 * (5 + (n)))                              \
    EDO_SMC_ASSERT(name##_4, offsetof(edo_smc_design_##name##_t, kx) == 4 * (5 + 2 * (n) + 2 * (o) * (r)))             \
    EDO_SMC_ASSERT(name##_5, offsetof(edo_smc_design_##name##_t, satk) == 4 * (7 + 3 * (n) + 3 * (o) * (r)))           \
    EDO_SMC_ASSERT(name##_6, offsetof(edo_smc_design_##name##_t, a_row) == 4 * (21 + 3 * (n) + 3 * (o) * (r)))         \
    EDO_SMC_ASSERT(name##_7, offsetof(edo_smc_config_##name##_t, order) == 8 * (11 + 3 * (n) + (o) * (r)))             \
    EDO_SMC_ASSERT(name##_8, sizeof(edo_smc_config_##name##_t) ==                                                      \
                                 EDO_SMC_ROUND_UP(8 * (11 + 3 * (n) + (o) * (r)) + 4 * ((o) + 1), 8))                  \
    EDO_SMC_ASSERT(name##_9,                                                                                           \
                   sizeof(edo_smc_state_##name##_t) ==                                                                 \
                       EDO_SMC_ROUND_UP(sizeof(uintptr_t) + 4 * ((o) * (r) + 2 * (o) + 5), sizeof(uintptr_t)))         \
    size_t edo_smc_design_size_##name(void);                                                                           \
    size_t edo_smc_state_size_##name(void);                                                                            \
    edo_smc_status_t edo_smc_init_##name(const edo_smc_design_##name##_t *design, size_t design_size,                  \
                                         edo_smc_state_##name##_t *state, size_t state_size);                          \
    edo_smc_status_t edo_smc_tick_##name(const edo_smc_design_##name##_t *design, edo_smc_state_##name##_t *state,     \
                                         const float x[n], edo_smc_output_t *output);                                  \
    edo_smc_status_t edo_smc_report_applied_##name(edo_smc_state_##name##_t *state, float u);                          \
    edo_smc_status_t edo_smc_estimates_##name(const edo_smc_design_##name##_t *design,                                 \
                                              const edo_smc_state_##name##_t *state, float d_hat[n][r]);               \
    edo_smc_status_t edo_smc_reset_##name(edo_smc_state_##name##_t *state);                                            \
    edo_smc_status_t edo_smc_retune_##name(const edo_smc_design_##name##_t *from, const edo_smc_design_##name##_t *to, \
                                           size_t design_size, edo_smc_state_##name##_t *state, const float x[n]);     \
    edo_smc_status_t edo_smc_design_##name(const edo_smc_config_##name##_t *config, size_t config_size,                \
                                           edo_smc_design_##name##_t *design, size_t design_size, uint32_t *channel);

EDO_SMC_ASSERT(output, sizeof(edo_smc_output_t) == 16 && offsetof(edo_smc_output_t, health) == 12)

/* Every set of channels that holds the driven one and that Eq. (44) of the paper allows. */
EDO_SMC_INSTANCE(n2_r1_c2, 2, 1, 0x2, 1)
EDO_SMC_INSTANCE(n2_r1_c12, 2, 1, 0x3, 2)
EDO_SMC_INSTANCE(n2_r2_c2, 2, 2, 0x2, 1)
EDO_SMC_INSTANCE(n2_r2_c12, 2, 2, 0x3, 2)
EDO_SMC_INSTANCE(n3_r2_c3, 3, 2, 0x4, 1)
EDO_SMC_INSTANCE(n3_r2_c13, 3, 2, 0x5, 2)
EDO_SMC_INSTANCE(n3_r2_c23, 3, 2, 0x6, 2)
EDO_SMC_INSTANCE(n3_r2_c123, 3, 2, 0x7, 3)
EDO_SMC_INSTANCE(n4_r2_c4, 4, 2, 0x8, 1)
EDO_SMC_INSTANCE(n4_r2_c24, 4, 2, 0xa, 2)
EDO_SMC_INSTANCE(n4_r2_c34, 4, 2, 0xc, 2)
EDO_SMC_INSTANCE(n4_r2_c234, 4, 2, 0xe, 3)
EDO_SMC_INSTANCE(n4_r3_c4, 4, 3, 0x8, 1)
EDO_SMC_INSTANCE(n4_r3_c14, 4, 3, 0x9, 2)
EDO_SMC_INSTANCE(n4_r3_c24, 4, 3, 0xa, 2)
EDO_SMC_INSTANCE(n4_r3_c124, 4, 3, 0xb, 3)
EDO_SMC_INSTANCE(n4_r3_c34, 4, 3, 0xc, 2)
EDO_SMC_INSTANCE(n4_r3_c134, 4, 3, 0xd, 3)
EDO_SMC_INSTANCE(n4_r3_c234, 4, 3, 0xe, 3)
EDO_SMC_INSTANCE(n4_r3_c1234, 4, 3, 0xf, 4)

#ifdef __cplusplus
}
#endif

#endif
