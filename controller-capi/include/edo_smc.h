/* Sliding mode control with an extended disturbance observer, for firmware in C99 and C++.
 *
 * DRIVES. A drive controls a motor with one encoder or a flexible joint with two. Its input is encoder counts and a
 * target; its output is a current in A. Monitors check each tick. A name is `motor`, `joint` (one observer per
 * encoder) or `coupled` (one observer for both shafts of a joint). `_fast` adds high gains under a load. `_late` adds
 * one tick between the computation of the current and its output. See "Drives" below, with an example.
 *
 * CHAINS. A chain is a plant of n integrators with a disturbance in every channel. The input acts on the last channel:
 *
 *     x_i' = x_(i+1) + d_i (i < n),      x_n' = a(x) + b u + d_n,      y = x_1
 *
 * a(x) is linear. The observers estimate the rest of the dynamics. An INSTANCE is a plant order n, an observer order r
 * and the set of observed channels. It is a part of every name: edo_smc_tick_n4_r2_c24 is the tick of order 4 with
 * observers of order 2 in channels 2 and 4. A channel without an observer needs no memory and no instruction. The end
 * of this file lists all instances.
 *
 *     #include "edo_smc.h"
 *     #include "my_design.h"                              my_design, an edo_smc_design_n4_r2_c24_t
 *     static edo_smc_state_n4_r2_c24_t state;             one per controller, in any memory
 *
 *     once, at start-up; checks the whole design:
 *     status = edo_smc_init_n4_r2_c24(&my_design, sizeof my_design, &state, sizeof state);
 *
 *     in the timer interrupt, every period:
 *     edo_smc_output_t output = {0};
 *     edo_smc_tick_n4_r2_c24(&my_design, &state, x, &output);   x: the newest sample, float[4]
 *     pwm_set(output.u);
 *     edo_smc_report_applied_n4_r2_c24(&state, held);           only if the actuator holds another u
 *
 * STATUS. 0 is success. A positive status is a success with a remark. A negative status means that the call was
 * rejected and wrote nothing. Rejected are NULL and misaligned pointers, a wrong size, version or instance, numbers
 * that are not finite, and a state that init did not make. A call also rejects arguments that share memory if it would
 * write there (EDO_SMC_OVERLAP). A tick checks this only until the state has started, because the check costs 8
 * instructions per tick. Later it writes an output that lies inside the state or the design.
 *
 * A call rejects a state with another design, another tag or a flag byte above 1. The numbers of a damaged state may
 * have any value. A tick accepts them, and u stays within its limits. At most two valid samples then bring the
 * estimates back to values that the design can have. reset does so at once.
 *
 * The caller guarantees two facts that no call can check: each pointer points to memory of its type, and the design
 * does not change while a state belongs to it.
 *
 * CORES. There is an archive for each of: Cortex-M4F and M7 (-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard);
 * M33 with FPU (-mfloat-abi=hard); M3, and larger cores, with -mfloat-abi=soft; M0 and M0+. If the linker reports "uses
 * VFP register arguments, .. does not", your code has another -mfloat-abi. For any other core, ABI or compiler use
 * the self-contained file of `host-sim export --standalone` (C99, no archive).
 *
 * INTERRUPTS. No function allocates memory, locks, or has static variables. Calls with different states may interrupt
 * each other. Calls with the same state must not.
 *
 * FLOATING-POINT MODES. The results are bit-identical to the Rust library on any machine under these modes: rounding to
 * nearest, subnormal numbers kept. They must hold wherever a call runs: in main, in an interrupt or in a host program.
 * On a Cortex-M, FPSCR has RMode = 00 and FZ = 0. An interrupt starts with FPDSCR instead of the FPSCR of main, and it
 * needs FPCCR.ASPEN = 1. All three are correct after reset. On x86, MXCSR has neither FTZ nor DAZ; linking with
 * -ffast-math sets them. edo_smc_modes_ok checks the modes. Under other modes u is still a number within its limits,
 * but its bits differ.
 */
#ifndef EDO_SMC_H
#define EDO_SMC_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version 0.1.0: one byte each for major, minor and patch. Header, archive and designs must have the same version. */
#define EDO_SMC_VERSION 0x000100u

/* Returns the version of the archive, in the format of EDO_SMC_VERSION. */
uint32_t edo_smc_version(void);

/* Returns 1 if the floating-point modes of this context are the assumed ones, else 0. Call it once at start-up in the
 * context of the tick: an interrupt of a Cortex-M has its own modes. */
uint32_t edo_smc_modes_ok(void);

typedef int32_t edo_smc_status_t;

enum {
    EDO_SMC_OK = 0,
    /* tick: the sample was not finite, or demanded more than 1e12. output.u is the fallback of the design: the last u
     * or the safe one. The estimates are kept, and the next valid sample resumes. */
    EDO_SMC_REJECTED = 1,
    EDO_SMC_PROFILE_END = 2,       /* profile_go_to: the goal is beyond the range and was set to the end of the range */

    EDO_SMC_NULL = -1,
    EDO_SMC_MISALIGNED = -2,
    EDO_SMC_SIZE = -3,             /* the size is not the size of this instance in this version */
    EDO_SMC_WRONG_VERSION = -4,    /* the design has another version: export it again */
    EDO_SMC_WRONG_INSTANCE = -5,   /* the design belongs to another instance */
    EDO_SMC_NOT_FINITE = -6,       /* a number is NaN or infinite (report_applied: or above 1e12; an angle or a speed
                                    * of a profile: or above 6e9) */
    EDO_SMC_BAD_COEFFICIENTS = -7, /* no design has these numbers: check whether the file was edited */
    EDO_SMC_OVERLAP = -8,          /* two arguments share memory (tick: checked only until the state has started) */
    EDO_SMC_NOT_INITIALISED = -9,  /* init of this instance did not make the state, or profile_new the profile */
    EDO_SMC_OTHER_DESIGN = -10,    /* the state belongs to another design */
    EDO_SMC_DAMAGED = -11,         /* a flag of the state was overwritten: call init; or a profile was overwritten: call
                                    * profile_new */
    EDO_SMC_NOT_STARTED = -12,     /* there was no valid sample yet: report_applied, estimates and go_on need a started
                                    * state */

    /* retune: the new design cannot be switched in now. The running design continues. */
    EDO_SMC_RETUNE_SAMPLE = -13,   /* a tick would reject this sample: retry with the next one */
    EDO_SMC_RETUNE_DECAY = -14,    /* alpha is within a tenth of k_l, so u would step: change one of them */
    EDO_SMC_RETUNE_OFFSET = -15,   /* no offset gives the same u under the new design: choose a closer one, or reset */
    EDO_SMC_RETUNE_ENCODER = -16,  /* the new design has another encoder or gear: reset */

    /* Plans. */
    EDO_SMC_PLAN_TICKS = -17,      /* the duration is not 1 to 2^24 ticks */
    EDO_SMC_PLAN_FREQUENCY = -18,  /* a sine must advance by at least 2^-32 and less than half a revolution per tick */

    /* Profiles. */
    EDO_SMC_PROFILE_RANGE = -19,   /* keep_within: the lower end is above the upper end */
    EDO_SMC_PROFILE_SPEED = -42,   /* start: the speed exceeds a quarter of a revolution per tick */

    /* edo_smc_design_*. If one channel is the cause, the call also returns its number. */
    EDO_SMC_FALLBACK_UNKNOWN = -20,         /* fallback is neither EDO_SMC_HOLD_LAST nor EDO_SMC_SAFE_U */
    EDO_SMC_CONFIG_NOT_FINITE = -21,        /* a number is NaN or infinite */
    EDO_SMC_PERIOD_NOT_POSITIVE = -22,      /* period_s <= 0 */
    EDO_SMC_INPUT_GAIN_ZERO = -23,          /* b = 0: the law divides by b */
    EDO_SMC_SURFACE_LEAD = -24,             /* c_n must be 1: divide all c by c_n */
    EDO_SMC_SURFACE_NOT_HURWITZ = -25,      /* the sliding motion would diverge */
    EDO_SMC_OFFSET_DECAY_NOT_POSITIVE = -26, /* alpha_per_s <= 0 */
    EDO_SMC_OFFSET_DECAY_TOO_SLOW = -27,    /* alpha_per_s times period_s is below 1e-7: no decay in float */
    EDO_SMC_NEGATIVE = -28,                 /* k_l, k_s, sigma_star_bound or observer_pole_limit is below 0 */
    EDO_SMC_BOUNDARY_LAYER_EMPTY = -29,     /* k_s > 0 with epsilon < 0, or with epsilon = 0 and k_s times period 0 */
    EDO_SMC_LIMITS_TOO_WIDE = -30,          /* a limit exceeds 1e12: give +-1e12 for no limit */
    EDO_SMC_LIMITS_REVERSED = -31,          /* u_min > u_max */
    EDO_SMC_FALLBACK_OUTSIDE_LIMITS = -32,  /* safe_u is outside of the limits */
    EDO_SMC_CHANNEL_MISMATCH = -33,         /* reserved: the name of the instance fixes the channels */
    EDO_SMC_OBSERVER_ORDER = -34,           /* an observer order must be 1 .. r */
    EDO_SMC_ORDER_TOO_LOW = -35,            /* channel i < n needs an observer order of at least n - i */
    EDO_SMC_OBSERVER_NOT_FINITE = -36,      /* an observer gain is NaN or infinite */
    EDO_SMC_OBSERVER_NOT_HURWITZ = -37,     /* the observer would diverge */
    EDO_SMC_OBSERVER_TOO_FAST = -38,        /* the fastest pole times period_s exceeds observer_pole_limit */
    EDO_SMC_COEFFICIENT_RANGE = -39,        /* a coefficient overflows or underflows in float: check the units */
    EDO_SMC_OTHER_RULE = -40,               /* a rule of the library that this header does not name */
    EDO_SMC_OUT_OF_RANGE = -41              /* a drive: the refusal contains the number and its range */
};

/* Flags of output.health. Chains set only the first three. */
enum {
    EDO_SMC_INPUT_REJECTED = 1,          /* no valid sample, too many missing, a target that is not a number, or STOPPED */
    EDO_SMC_SATURATED = 2,               /* the demanded u exceeds the limits */
    EDO_SMC_SIGMA_STAR_OVER_BOUND = 4,   /* sigma_star exceeds its bound: the plant differs from the design */
    EDO_SMC_SAMPLE_LOST = 8,             /* a count was missing or physically impossible: the observers predict */
    EDO_SMC_DISTURBANCE_OVER_BOUND = 16, /* a load, friction, or a frozen encoder */
    EDO_SMC_STUCK_AT_LIMIT = 32,         /* u was at a limit for too long while sigma did not fall */
    EDO_SMC_STOPPED = 64,                /* an alarm has stopped the drive: reset restarts it */
    EDO_SMC_POSITION_STEPPED = 128,      /* missed tick or slip: the position was set from the counts again */
    EDO_SMC_WAITS = 256,                 /* the counts are not consistent yet: the current is 0 until they are */
    EDO_SMC_WRONG_WAY = 512,             /* the shaft accelerates against its current: encoder or phases are reversed */
    EDO_SMC_OSCILLATES = 1024,           /* the disturbance exceeds its bound in both directions: a limit cycle */
    EDO_SMC_BRAKES = 2048,               /* after an alarm: the current opposes the speed, the target is ignored */
    EDO_SMC_OVERSPEED = 4096,            /* guard: the speed exceeds the limit of the fence */
    EDO_SMC_FOLLOWING_ERROR = 8192,      /* guard: the distance to the target exceeds the limit of the fence */
    EDO_SMC_END_OF_RANGE = 16384         /* guard: the distance to an end of the range is below the braking distance */
};
/* Values of config.stops_at. ALARMS: all alarms of the monitors. BEYOND_CONTROL: the alarms that a planned stop cannot
 * handle. BRAKING: all alarms, and the drive brakes before it stops while its counts are valid. RUNAWAY: the alarms
 * that stop every drive. */
enum {
    EDO_SMC_ALARMS = 1 + 4 + 16 + 32 + 512 + 1024,
    EDO_SMC_BEYOND_CONTROL = 1 + 32 + 512 + 1024,
    EDO_SMC_BRAKING = 1 + 4 + 16 + 32 + 512 + 1024 + 2048,
    EDO_SMC_RUNAWAY = 512 + 1024
};

/* Output of a tick. */
typedef struct edo_smc_output {
    float u;          /* hold until the next tick; within the limits; unit of the input, A for a drive */
    float sigma;      /* sliding variable, unit of x_n */
    float sigma_star; /* sliding variable without its offset at the start, unit of x_n */
    uint16_t health;  /* status flags, 0 for none */
} edo_smc_output_t;

/* Values of config.fallback: the output for a rejected sample. */
enum { EDO_SMC_HOLD_LAST = 0, EDO_SMC_SAFE_U = 1 };

/* Value of design.instance. */
#define EDO_SMC_ID(n, r, mask) ((uint32_t)(n) | (uint32_t)(r) << 8 | (uint32_t)(mask) << 16)

/* Static assertion that C99 supports. */
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
 *     edo_smc_by_rule_motor_fast(&config, sizeof config);       fills the values that are not on the data sheet
 *     status = edo_smc_design_motor_fast(&config, sizeof config, &design, sizeof design, &refusal);
 *     status = edo_smc_init_motor_fast(&design, sizeof design, &state, sizeof state);
 *
 *     in the timer interrupt, every period:
 *     edo_smc_output_t output = {0};
 *     sample.count = encoder_register();                        the register itself; it may wrap
 *     sample.begin = sample.end;                                a tick begins where the previous one ended
 *     edo_smc_plan_play_motor(&plan, ++tick, &sample.end);
 *     edo_smc_tick_motor_fast(&design, &state, &sample, &output);
 *     pwm_set(output.u);
 *
 * The count must increase with the angle and be 0 at angle 0. For a reversed encoder pass 0u - register, for an encoder
 * with an offset pass register - offset. Only the low `bits` are read. For a counter that does not wrap at 2^bits, such
 * as a timer with the reload value 9999 and 10000 states, all bits are read.
 *
 * A _late drive holds its current in the tick after the computation. For it, `begin` and `end` belong to that tick.
 *
 * The configuration of a coupled joint comes from `host-sim export FILE --lang c --prefix my -o my_config.h`:
 *
 *     #include "my_config.h"                                    my_config, an edo_smc_config_coupled_t
 *     static edo_smc_design_coupled_fast_t design;
 *
 *     status = edo_smc_design_coupled_fast(&my_config, sizeof my_config, &design, sizeof design, &refusal);
 *
 * The command also writes configurations for motors and for joints with one observer per encoder.
 */
typedef struct edo_smc_encoder {
    double bits;               /* width of the counter, 2 .. 32 */
    double counts_per_turn;    /* counts per revolution of the encoder */
    double gear_num, gear_den; /* gear_num revolutions of the encoder are gear_den of the controlled shaft, 1 .. 1000 */
    double states;             /* number of counts before the counter wraps, if not 2^bits; else 0 */
} edo_smc_encoder_t;

typedef struct edo_smc_limits {
    double min, max; /* limits of u, A */
} edo_smc_limits_t;

/* Gain scheduling: when the high gains of a _fast drive act. Other drives do not read it. */
typedef struct edo_smc_switching {
    double calm_steps, alert_steps; /* smoothed innovation, counts: high gains begin at calm, act fully at alert */
    double smoothing_s, keep_s;     /* time constants of the smoothing and of the fade-out, s */
} edo_smc_switching_t;

/* Configuration of a motor drive. Write the data sheet, call edo_smc_by_rule_* for the other values, then change single
 * values if needed. `host-sim export FILE --lang c` writes a complete configuration instead. */
typedef struct edo_smc_config_motor {
    double period_s; /* 2e-5 .. 1e-2 */
    struct {
        double inertia_kg_m2, torque_n_m_per_a, damping_n_m_s; /* at the controlled shaft, load included */
    } motor;
    edo_smc_encoder_t encoder;
    edo_smc_limits_t limits;
    /* by_rule fills all further members except lag_s. */
    struct {
        double surface_rad_s;  /* position bandwidth w_c: the error obeys e' = -w_c e */
        double observer_rad_s; /* observer bandwidth; by rule 1.5 w_c */
        double reaching_per_s; /* reaching gain; by rule 8 w_c, at most 1/period */
        double offset_per_s;   /* decay rate of the offset; by rule w_c/2 */
    } bandwidths;
    double fast_ratio; /* ratio of the high observer bandwidth to the base one, 1 .. 4 */
    edo_smc_switching_t switching;
    double gate_steps; /* innovation gate, counts, at least 2: a count with a larger innovation is rejected */
    double lost_ticks; /* consecutive missing counts that the observer bridges, 1 .. 1e6 */
    double hold;       /* 1: the fallback is the last u; 0: the fallback is safe_u */
    double safe_u;     /* A, within the limits */
    double lag_s;     /* time constant of the current loop, 0 .. 1; write it before by_rule: 2e-4 if unknown */
    double uncertain; /* tolerance of inertia and torque constant, 0 .. 0.9, for the monitors; by rule 0.2 */
    double stops_at;  /* reaction to alarms: EDO_SMC_BRAKING by rule, or the alarm bits that stop the drive */
} edo_smc_config_motor_t;

/* Configuration of a joint with one observer per encoder. All values apply on the side of the link of a gear. */
typedef struct edo_smc_config_joint {
    double period_s;
    struct {
        double link_inertia_kg_m2, link_damping_n_m_s;
        double weight_n_m; /* torque of the link's weight when the link is level */
        double stiffness_n_m;
        double motor_inertia_kg_m2, motor_damping_n_m_s, torque_n_m_per_a;
    } joint;
    edo_smc_encoder_t encoders[2]; /* link, motor */
    edo_smc_limits_t limits;
    /* by_rule fills all further members except load_n_m. */
    struct {
        double surface_rad_s, link_rad_s, motor_rad_s, reaching_per_s, offset_per_s;
    } bandwidths;
    double fast_ratios[2];
    edo_smc_switching_t switching;
    double gate_steps[2];
    double lost_ticks;
    double hold;
    double safe_u;
    double load_n_m; /* largest sudden load on the link, 0 .. 1e9; write it before by_rule */
    double uncertain;
    double stops_at;
} edo_smc_config_joint_t;

/* Configuration of a coupled joint: one observer for both shafts. Use it for a stiff spring: gears, harmonic drives,
 * belts. A search on the host finds its gains: `host-sim export FILE --lang c` writes a constant of this type. */
typedef struct edo_smc_config_coupled {
    double period_s;
    struct {
        double link_inertia_kg_m2, link_damping_n_m_s;
        double weight_n_m;
        double stiffness_n_m;
        double motor_inertia_kg_m2, motor_damping_n_m_s, torque_n_m_per_a;
    } joint;
    edo_smc_encoder_t encoders[2]; /* link, motor */
    edo_smc_limits_t limits;
    struct {
        double surface_rad_s, link_rad_s, motor_rad_s, reaching_per_s; /* surface, reaching: poles of a rigid shaft */
        double offset_per_s;                                           /* half of surface_rad_s */
    } bandwidths;
    double fast_ratios[2];
    edo_smc_switching_t switching; /* only smoothing_s and keep_s are read */
    double gate_steps[2];
    double lost_ticks;
    double hold;
    double safe_u;
    struct {
        double lag_s;             /* time constant of the current loop */
        double resolution_rad[2]; /* behind the gear: one count of link and motor encoder, or more with noise */
        double calm_steps[2];     /* smoothed innovation, counts: high gains begin; they act fully at 2.67 times it */
    } coupled;
    double load_n_m; /* largest sudden load on the link, 0 .. 1e9 */
    double uncertain;
    double stops_at;
} edo_smc_config_coupled_t;

/* Limits of position, speed and following error, of the motor's shaft or the joint's link. INFINITY (-INFINITY for
 * low_rad) is no limit. The range is from low_rad to high_rad, from angle 0 on and over any number of revolutions. */
typedef struct edo_smc_fence_limits {
    double low_rad, high_rad;
    double max_speed_rad_s;
    double following_rad; /* largest distance to the target */
} edo_smc_fence_limits_t;

/* Limits in the form that guard compares. Zeros are a fence that every motion violates. */
typedef struct edo_smc_fence {
    uint32_t words[9];
} edo_smc_fence_t;

/* Rejected number of a configuration. */
typedef struct edo_smc_refusal {
    char field[32]; /* C name behind `config.` or `limits.`; "fallback": hold and safe_u; empty if none is rejected */
    double given;   /* the number or a result of it, such as bandwidth times period, in the unit of low and high */
    double low, high; /* permitted range */
} edo_smc_refusal_t;

/* Target: position 2 pi turn + r in rad, and its derivatives in rad/s, rad/s^2, rad/s^3. */
typedef struct edo_smc_target_motor {
    int32_t turn;
    float r, r_dot;
} edo_smc_target_motor_t;

typedef struct edo_smc_target_joint {
    int32_t turn;
    float r, r_dot, r_ddot, r_dddot;
} edo_smc_target_joint_t;

/* Input of a tick: counts, and the targets at the begin and the end of the tick in which u is held. */
typedef struct edo_smc_sample_motor {
    uint32_t count; /* register of the counter */
    uint32_t lost; /* 1: no count arrived, or its checksum is wrong */
    edo_smc_target_motor_t begin, end;
} edo_smc_sample_motor_t;

typedef struct edo_smc_sample_joint {
    uint32_t link, motor; /* registers of the counters */
    uint32_t lost;        /* missing counts: 1 for the link, 2 for the motor, 3 for both */
    edo_smc_target_joint_t begin, end;
} edo_smc_sample_joint_t;

/* Estimates of a drive at the instant of the last tick, in rad and s of the shaft. */
typedef struct edo_smc_estimates_motor {
    int32_t turn;   /* revolutions to add to the position */
    float position; /* rad; several revolutions are possible with a gear */
    float speed;       /* rad/s */
    float disturbance; /* acceleration that the model does not explain, rad/s^2 */
    float load;        /* torque that acts against the shaft, N m: load and friction */
} edo_smc_estimates_motor_t;

typedef struct edo_smc_estimates_joint {
    int32_t turn;
    float position[2], speed[2], disturbance[2], load[2]; /* link, motor */
} edo_smc_estimates_joint_t;

/* Plans: the target of every tick. The caller counts the ticks from any number; the count may wrap. A new plan begins
 * with the target of the plan `from` at tick `start`, and takes `ticks` from there (1 .. 2^24). So a new goal during a
 * motion causes no step. Before its start a plan returns its first target. Its end must be less than 2^31 ticks ahead.
 *
 * Make a plan outside of the interrupt: the calculation uses double, which most cores compute in software. Never make
 * it in the plan that is played, except for a rest at a start. Switch to it between two ticks, at `start`. The planner does not check the current. A
 * move of D rad in t s takes up to 5.8 D/t^2 rad/s^2 for a motor.
 *
 * A plan call returns EDO_SMC_OK or a negative status, and a rejected call leaves the plan unchanged. The statuses are
 * EDO_SMC_PLAN_TICKS, EDO_SMC_PLAN_FREQUENCY, and EDO_SMC_NOT_FINITE for a number that is not usable.
 *
 * edo_smc_plan_rest_*  makes a permanent rest at 2 pi turn + angle (rad): for a start, at the angle of the estimates.
 * edo_smc_plan_move_*  makes a move from the plan `from` to rest at 2 pi turn + angle. period_s: period of a tick, s.
 * edo_smc_plan_stop_*  makes a stop that never moves back. From a constant speed the shaft stops after half of the
 *                      distance that it would have moved. If the shaft decelerates already and a longer stop would
 *                      move back, the stop takes fewer ticks.
 * edo_smc_plan_sine_*  makes a transition to amplitude_rad sin(omega_rad_s t) about angle 0. The phase is 0 at tick 0.
 * edo_smc_plan_play_*  writes the target at a tick. Call it in the interrupt once per tick, for the end of the tick. A
 *                      completed plan stays completed when the ticks wrap (2^32 ticks are five days at 10 kHz).
 * edo_smc_plan_at_*    writes the target at any tick, to look ahead. The plan does not change.
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

/* Profiles: a path to set-points that arrive at any time, within limits of speed, acceleration and jerk, without
 * overshoot. Use a profile instead of a plan: `next` returns the target of each tick, `go_to` accepts a goal at any
 * time. The path is the time-optimal path within speed and acceleration, averaged over a window of ticks. A motor
 * averages twice, a joint three times, so |r_dddot| <= 2 acceleration/(window period).
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
 * Change a profile between two ticks, never while the interrupt is in `next`: a goal has two words. A profile contains
 * no address, so it may be copied. Speed and acceleration are rounded down to multiples of 2^-32 revolutions per tick
 * and per tick squared. All functions except `next` and `has_arrived` use double, in software on most cores.
 *
 * A function returns EDO_SMC_OK or a negative status unless stated otherwise. A rejected call leaves the profile
 * unchanged. An angle or a
 * speed above 6e9 or NaN gives EDO_SMC_NOT_FINITE.
 *
 * edo_smc_profile_new_*   makes a profile at rest at angle 0. It returns EDO_SMC_OUT_OF_RANGE if a number is outside of
 *                         its range: period 1e-6 .. 1 s, window 1 .. EDO_SMC_PROFILE_WINDOW ticks, speed and
 *                         acceleration 2^-32 .. 1/4 revolution per tick and per tick squared. `refusal` (may be NULL)
 *                         then contains the number.
 * edo_smc_profile_limit_* sets speed (rad/s) and acceleration (rad/s^2), also in motion. Above a lower speed the path
 *                         brakes with the acceleration. It rejects the same ranges as `new` and then keeps the limits.
 * edo_smc_profile_keep_within_*  limits the present and all later goals to the range between the two angles,
 *                         2 pi turn + rad. It returns EDO_SMC_PROFILE_RANGE if the lower end is above the upper end.
 * edo_smc_profile_go_to_* sets the goal 2 pi turn + rad. It returns EDO_SMC_PROFILE_END if the goal is beyond the
 *                         range; the goal is then the end of the range.
 * edo_smc_profile_stop_*  stops as soon as the acceleration permits. A stop that ends beyond the range returns to the
 *                         end of the range.
 * edo_smc_profile_start_* restarts at 2 pi turn + rad with a speed (rad/s) and brakes to rest. Use it with the
 *                         estimates of a moving shaft. It returns EDO_SMC_PROFILE_SPEED above a quarter of a revolution
 *                         per tick.
 * edo_smc_profile_has_arrived_*  returns 1 if the path rests at its goal, else 0. For memory without a profile it
 *                         returns 0.
 * edo_smc_profile_next_*  writes the target at the end of the next tick. Call it in the interrupt, once per tick.
 */
#define EDO_SMC_PROFILE_WINDOW 128 /* largest window, ticks */
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

/* Types and functions of one drive. Arguments of the macro: name, configuration, plant, words of design and state. A
 * coupled joint uses the samples, estimates, plans and profiles of a joint.
 *
 * A function returns EDO_SMC_OK or a negative status unless stated otherwise. `refusal` may be NULL.
 * EDO_SMC_OUT_OF_RANGE writes the rejected number and its range to it.
 *
 * edo_smc_by_rule_NAME    fills a configuration. It keeps period, data sheet, encoders, limits, and lag_s or load_n_m.
 *                         A coupled joint has no rule here: the search for its gains runs on the host.
 * edo_smc_tune_NAME       scales all bandwidths to another surface_rad_s and sets the innovation gates. Then call
 *                         design and retune. For your own bandwidths write them, then tune to their surface_rad_s. For
 *                         a coupled joint the host has checked only its own gains in the corners of the data sheet.
 *                         Check other gains with `host-sim design FILE --set drive.surface_rad_s=..`.
 * edo_smc_design_NAME     computes the design, bit-identical to the host. It uses double precision in software: call it
 *                         in the main loop. For a coupled joint it needs 9 kB of stack and some 80 kB of flash on a
 *                         Cortex-M4F.
 * edo_smc_init_NAME       checks a design and makes a state that waits for its first valid sample. That sample has all
 *                         counts and is at most half a counter from angle 0. The current is 0 until the counts have
 *                         been consistent for 10 ms, at least three ticks (EDO_SMC_WAITS).
 * edo_smc_tick_NAME       computes one tick: call it every period. It returns EDO_SMC_REJECTED for an unusable sample.
 *                         After an alarm of stops_at the output is safe_u until reset, or 0 if the drive has none.
 * edo_smc_go_on_NAME      computes one tick but never starts the drive, so its cycle bound is lower. Before the start
 *                         it returns EDO_SMC_NOT_STARTED with the fallback as output; then call tick where there is
 *                         time.
 * edo_smc_missed_NAME     reports the number of periods that passed without a tick while the current was held. A time
 *                         stamp of a free-running timer counts them; an update flag is one bit. Call it before the next
 *                         tick.
 * edo_smc_report_applied_NAME  reports the current (A) that the power stage has held since the last tick, if it is not
 *                         u. This is the only anti-windup. Call it before the next tick. Two equal reports well below
 *                         the output are taken as the limit of the stage for some ticks.
 * edo_smc_limit_NAME      sets the largest current of either sign (A) that the power stage can hold from now on. A
 *                         start clears it: call it before each tick. EDO_SMC_NOT_FINITE: the number is NaN or below 0.
 * edo_smc_trip_NAME       starts the reaction to an alarm at the next tick, for an external cause such as a door
 *                         switch.
 * edo_smc_fence_NAME      makes the limits of position, speed and following error for a drive with this configuration.
 *                         The braking distance is v^2/(2 a) + |v| (1/k_v + 2 T), with 60 % of the current. Another
 *                         current, inertia, surface or period needs a new fence. It computes a design: call it in the
 *                         main loop.
 * edo_smc_guard_NAME      checks the estimates against the fence, after a tick, with its sample and its output. If a
 *                         limit is violated, it sets the flag in output.health and trips the drive at the next tick. u
 *                         does not change. The target is sample.begin. A drive that waits or has stopped is not
 *                         checked. Before the start it returns EDO_SMC_NOT_STARTED.
 * edo_smc_estimates_NAME  writes the estimates at the instant of the last tick. A stopped drive keeps those of its stop:
 *                         measure its speed from the counts.
 * edo_smc_reset_NAME      clears everything except the design. Counts that are consistent for 10 ms start the drive
 *                         again. The shaft must be at rest.
 * edo_smc_retune_NAME     checks another design and switches to it before the next tick. The estimates continue, and u
 *                         has no step. `sample` is the sample of that tick: then call tick with the new design and this
 *                         sample.
 * edo_smc_design_size_NAME, edo_smc_state_size_NAME   return the sizes in the archive, bytes.
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

/* Drives whose gains follow from a rule. */
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

/* Types and functions of one chain. Arguments of the macro: name, n, r, the mask of the observed channels (bit i - 1
 * for channel i), and their number.
 *
 * edo_smc_design_NAME_t   coefficients of the tick, in flash. `host-sim export` or edo_smc_design_NAME makes them.
 *                         Their order is controller_core::LAYOUT, with the row of a(x)/b before the check.
 * edo_smc_config_NAME_t   configuration of a design. For each observed channel, the lowest first: gains l_1 .. l_r and
 *                         the order in use (1 .. r). Gains for all poles at -w: order 1 {w}, order 2 {2w, w^2}, order
 *                         3 {3w, 3w^2, w^3}. observer_pole_limit: normally 1. d_hat: initial estimates of the
 *                         disturbances, read for observed channels.
 * edo_smc_state_NAME_t    state of the controller; its words are private.
 *
 * A function returns EDO_SMC_OK or a negative status unless stated otherwise.
 *
 * edo_smc_init_NAME       checks a design and makes a state that waits for its first valid sample.
 * edo_smc_tick_NAME       computes one tick: call it every period. The first valid sample starts the state. Until then,
 *                         and for an invalid sample, the output is the fallback and the status EDO_SMC_REJECTED.
 * edo_smc_report_applied_NAME  reports the u that the actuator has held since the last tick, if it is not output.u. The
 *                         observers need it, and it is the only anti-windup. Call it before the next tick. Report
 *                         limits and brakes; never report a correct u that is only late.
 * edo_smc_estimates_NAME  writes the estimates at the instant of the last tick: for each channel the disturbance and
 *                         its derivatives, in physical units; 0 without an observer.
 * edo_smc_reset_NAME      clears everything except the design: the next valid sample starts again. Use it after a
 *                         fault.
 * edo_smc_retune_NAME     checks another design and switches to it before the next tick, whose sample is x. The
 *                         estimates continue, and u has no step. Then call tick with the new design and the same x.
 * edo_smc_design_NAME     computes the design, bit-identical to the host. It uses double precision in software: call it
 *                         at start-up, not in an interrupt. If `channel` is not NULL, it receives the number of the
 *                         channel that a rejection is about (0: none).
 * edo_smc_design_size_NAME, edo_smc_state_size_NAME   return the sizes in the archive, bytes.
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
        float check; /* checksum of all numbers before it: a changed design is rejected */                             \
    } edo_smc_design_##name##_t;                                                                                       \
    typedef struct edo_smc_config_##name {                                                                             \
        double period_s;                                                                                               \
        double c[n]; /* surface c_1 .. c_n, c_n = 1; all roots at -w: coefficients of (p + w)^(n-1) */                 \
        double alpha_per_s;                                                                                            \
        double gains[o][r];                                                                                            \
        double k_l, k_s, epsilon;                                                                                      \
        double gradient[n]; /* derivatives of a(x) by x_1 .. x_n */                                                    \
        double input_gain;  /* b, not 0 */                                                                             \
        double u_min, u_max;                                                                                           \
        double safe_u; /* used if fallback is EDO_SMC_SAFE_U */                                                        \
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

/* Every channel set that contains the last channel and that Eq. (44) of the paper permits. */
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
