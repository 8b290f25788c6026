/* Drive of a motor with one encoder, f32, T = 0.001 s.
 * Position control, 3 observer states per encoder, 2 gain sets, no delay.
 * Exported by version 0.1.0 of the library. Do not edit; export again. C99 and C++11, no library needed.
 *
 *     #include "this file"
 *     static edo_smc_state state;            once; zeros before the start
 *     static edo_smc_monitor monitor;
 *     static edo_smc_sample sample;
 *     edo_smc_output output;                 in the timer interrupt, every T
 *     sample.count = encoder();              the low 14 bits are read; or sample.lost = true;
 *     sample.begin = sample.end;             a tick begins where the last one ended
 *     sample.end = next;                     target at the end of this tick
 *     unsigned health = edo_smc_watched_tick(&monitor, &state, &sample, &output);
 *     set_current(output.u);                 A
 *     edo_smc_report_applied(&state, held);  only if the stage holds another current
 *
 * CALLS. Everything else is internal.
 *
 *     edo_smc_watched_tick, edo_smc_watched_lost          a tick with monitors; without a sample
 *     edo_smc_watched_reset, edo_smc_watched_trip         restart after a stop; stop for your own reason
 *     edo_smc_estimates                                   angle, speed and load of each shaft
 *     edo_smc_report_applied, edo_smc_limit               held current; largest current of a derated stage
 *     edo_smc_missed                                      missed timer interrupts, before the next tick
 *     edo_smc_tick_or_start, edo_smc_lost, edo_smc_reset  the same without monitors: no alarm
 *     edo_smc_start, edo_smc_tick                         their parts: start at a sample; tick of a started drive
 *     edo_smc_plan_rest, _move, _stop, _sine              make a plan, in the main loop
 *     edo_smc_plan_play                                   the target of a tick, in the interrupt
 *     edo_smc_plan_at, edo_smc_plan_jet                   the target at any tick; start of the next plan
 *     edo_smc_profile_new, _start, _limit                 set-points that keep limits of speed and acceleration
 *     edo_smc_profile_go_to, _stop, _keep_within          their goal; their range
 *     edo_smc_profile_next, _has_arrived                  the target of a tick, in the interrupt
 *     edo_smc_modes_ok                                    checks the floating-point modes, once at start-up
 *
 * COMPILER OPTIONS. The bits equal the bits of the Rust tick only if every operation is rounded on its own. A fused
 * multiply-add rounds a * b + c once, which is another number and takes longer on a Cortex-M4F. So compile with
 * -ffp-contract=off. This file also switches fusing off by itself where the compiler permits it. GCC then inlines
 * edo_smc_tick only if the option is given, too. Reordering (-ffast-math and its parts) and the precision of x87 change
 * bits as well: if the compiler reports them, this file does not compile. clang reports only -ffast-math and
 * -ffinite-math-only; with clang the file switches reordering off. No check detects -fno-signed-zeros (also part of
 * -funsafe-math-optimizations), -fno-honor-nans and -fno-honor-infinities: never use them.
 *
 * FLOATING-POINT MODES. The tick assumes rounding to nearest, subnormal numbers, and float computed as float. They must
 * hold wherever it runs: in main, in an interrupt or in a host program. On a Cortex-M, FPSCR has RMode = 00 and FZ = 0.
 * An interrupt starts with FPDSCR instead of the FPSCR of main, and it needs FPCCR.ASPEN = 1. All three are correct
 * after reset. On x86, MXCSR has neither FTZ nor DAZ; linking with -ffast-math sets them. Call edo_smc_modes_ok once
 * at start-up in the context of the tick. Under other modes u is still a number within its limits; its bits differ.
 *
 * Design 0xabea4f8c (FNV-1a; `design_hash` in the run.json of a run).
 * Scenario motor.toml (CRC-32 0xf8c77f26):
 *
 *     # A motor with one encoder. Enter the numbers of its data sheet, then
 *     #
 *     #     host-sim run THIS_FILE.toml
 *     #
 *     # The gains follow by rule from the data sheet. Commented keys are optional; they show the default or an example. All
 *     # units are SI; the unit is the suffix of the key. Angles, load and friction refer to the output side of the gear.
 *
 *     name = "motor"
 *     title = "Motor by its data sheet, 1 rad at 1 Hz"
 *     span_s = 2.0
 *     # window_s = [0.25, 2.0] # window of the error metrics; default: from the end of the transition to the end of the run
 *     # settling_band = 0.005 # band that counts as settled, rad; default in mode "speed": 2 % of the speed
 *     # seed = 0              # of the random noise and jitter
 *
 *     [motor]                       # data sheet; the first three keys are required
 *     inertia_kg_m2 = 2e-4          # of rotor and load; or [smallest, largest] if it varies
 *     torque_n_m_per_a = 0.05       # torque constant K_t
 *     max_current_a = 10.0          # peak of motor or inverter, not the rated current; rms or peak A as in K_t
 *     damping_n_m_s = 1e-5          # viscous friction; 0 if unknown
 *     # gear = [1, 1]               # motor revolutions, output revolutions
 *     # load_inertia_kg_m2 = 0.0    # at the output; or [smallest, largest], as 0.0 to 2e-3 for an axis with its load
 *     # play_rad = 0.0              # backlash between motor and load, at the output, from flank to flank
 *     # gear_stiffness_n_m = 20.0   # N m/rad, of the gear with backlash; default: load and motor oscillate on it at 75 Hz
 *     # current_lag_s = 2e-4        # time constant of the current loop: 1/(2 pi bandwidth in Hz)
 *     # supply_v = 24.0             # supply voltage; three-phase motor with K_t per A of phase peak: 0.866 of the bus voltage
 *     # resistance_ohm = 0.5        # between the terminals; three-phase motor: 1.5 times the resistance of a phase
 *     # no_load_rad_s = 480.0       # no-load speed of the motor shaft, instead of supply_v. Without a supply: no speed limit
 *     # start_rad = 0.0
 *
 *     [encoder]
 *     bits = 14                     # width of the counter; required. 2500 lines: bits = 14, and the next two keys = 10000
 *     # counts_per_turn = 16384     # if other than 2^bits: four per line of an incremental encoder
 *     # states = 16384              # counts before the counter wraps: 10000 for a timer with a reload value of 9999
 *     # behind_gear = false
 *     # reversed = false            # true: the count decreases while the angle increases
 *     # offset_counts = 0           # count at angle 0
 *     # noise_rad = 1e-4            # standard deviation of white noise on the angle before quantisation
 *     # eccentricity_rad = 0.005    # amplitude of the angle error with one period per revolution, as of a magnet off centre
 *
 *     [drive]
 *     period_s = 1e-3
 *     # mode = "position"           # or "speed"
 *     # margin = "fast"             # or "standard": more stability margin, less stiff; or the peak sensitivity, 1.2 to 3
 *     # surface_rad_s = 125.0       # closed-loop position bandwidth; the other two scale with it. Default: by rule
 *     # observer_rad_s = 187.5      # bandwidth of the disturbance observer; `host-sim tune` finds all three bandwidths
 *     # reaching_per_s = 1000.0     # reaching gain k_l: rate at which sigma* is driven to zero, 1/s
 *     # gain_sets = 2               # 2: high gains are scheduled in on the observer innovation while a load acts; or 1
 *     # fast_ratio = 2.0            # observer bandwidth of the high gains over the base gains
 *     # uncertain_percent = 20.0    # tolerance of J and K_t; above 20, up to 50: one gain set
 *     # accept_unstable = false     # true: `export` accepts a drive that is unstable within this tolerance
 *     # delay_ticks = 0             # 0 to 3: ticks from the computation of a current until it is applied
 *     # jitter_s = 1e-5             # largest age of a count at its tick, random
 *     # observer_states = 3         # or 4
 *     # lost_ticks = 50             # consecutive missing counts that are bridged by prediction
 *     # fallback = "hold"           # safe output after that: the last current, or a number in A
 *     # rest_band = "learns"        # position dead band at rest, wider if friction makes the shaft hunt; or "fixed", "off"
 *
 *     [reference]
 *     kind = "sine"                 # or "move", "points", "set_points", "speed", "rest"
 *     amplitude_rad = 1.0           # sine
 *     frequency_hz = 1.0            # sine
 *     # to_rad = 1.0                # move: target
 *     # points_rad = [0.0, 0.1, 0.3, 0.6] # points, set_points
 *     # every_s = 0.01              # points, set_points: time between two points
 *     # max_speed_rad_s = 100.0     # set_points: limit of the trajectory
 *     # max_acceleration_rad_s2 = 1000.0 # set_points: limit of the trajectory
 *     # smooth_s = 0.01             # set_points: averaging time; jerk at most 2 max_acceleration_rad_s2/smooth_s
 *     # speed_rad_s = 20.0          # speed
 *     # start_s = 0.0
 *     # duration_s = 0.25           # transition from rest to the reference; default: the shortest within the current limit
 *
 *     [monitor]                     # alarms; only the monitors detect an encoder that freezes at standstill
 *     reaction = "brake"            # brakes on the estimated speed, then 0 A; or "fallback" (0 A or safe current, coasts),
 *                                   # "joined_stop" (controlled stop, needs valid counts), "tell" (report only)
 *     # stop_s = 0.25               # joined_stop: time from alarm to rest; if the current is too small, fallback
 *     # load_n_m = 0.2              # alarm above this torque of load, friction and data-sheet errors; default: by rule
 *     # sigma_star = 8.0            # alarm above this sliding variable |sigma*| if unsaturated, rad/s; default: by rule
 *     # saturated_s = 0.2           # alarm after this total time at the current limit while |sigma| does not fall
 *
 *     # [limits]                    # exceeding a limit is an alarm; planned durations respect the speed limit
 *     # low_rad = -100.0           # ends of the travel range; the drive brakes before an end
 *     # high_rad = 100.0
 *     # max_speed_rad_s = 400.0
 *     # following_error_rad = 0.1   # largest distance from the reference
 *
 *     # Friction and torque ripple of the simulated motor; the controller's model has none. Default: none.
 *     [friction]
 *     coulomb_n_m = 0.005
 *     static_n_m = 0.008
 *     # stribeck_rad_s = 0.1
 *     # model = "holds"             # a shaft at rest holds up to static_n_m; or "faded": no stiction, the shaft creeps
 *     # smooth_rad_s = 0.005        # faded: below this speed friction fades to 0
 *     cogging_n_m = 0.003
 *     # cogging_per_turn = 7
 *     # ripple_percent = 0.0
 *     # ripple_per_turn = 42
 *
 *     # Load torque against positive motion, N m: the sum of all terms.
 *     # [[load]]
 *     # kind = "step"               # or "const", "ramp", "sin", "cos"
 *     # amplitude = 0.1
 *     # t0_s = 1.0
 *
 *     # [[load]]
 *     # kind = "sin"
 *     # amplitude = 0.02
 *     # omega_rad_s = 30.0
 *     # phase_rad = 0.0
 *
 *     # [[load]]
 *     # kind = "ramp"
 *     # slope = 0.01
 *
 *     # [[fault]]
 *     # kind = "lost"               # or "stuck" (frozen), "jump", "derated" (less current), "missed" (no control interrupt)
 *     # at_s = 1.0
 *     # for_s = 0.02                # default: to the end of the run
 *     # counts = 1000               # jump: offset of the count
 *     # current_a = 2.0             # derated: largest current that the power stage still delivers
 *
 *     # [error]                     # deviation of the true motor from its data sheet
 *     # inertia_percent = 20.0
 *     # torque_percent = -20.0
 *     # reversed = false            # true: two phases are swapped, the motor turns against its current command
 *     # damping_percent = 0.0
 */
#ifdef EDO_SMC_STANDALONE
#if EDO_SMC_STANDALONE != 0xdd993292u
#error "two designs with the prefix edo_smc, 0xdd993292u here and EDO_SMC_STANDALONE before: export one with another --prefix"
#define EDO_SMC_STANDALONE 0xdd993292u
#endif
#else
#define EDO_SMC_STANDALONE 0xdd993292u

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
#define EDO_SMC_AS_WRITTEN
#elif defined(__clang__) && __clang_major__ >= 18
#define EDO_SMC_AS_WRITTEN _Pragma("clang fp contract(off) reassociate(off) reciprocal(off)")
#elif defined(__clang__) && __clang_major__ >= 14
#define EDO_SMC_AS_WRITTEN _Pragma("clang fp contract(off) reassociate(off)")
#else
#define EDO_SMC_AS_WRITTEN _Pragma("STDC FP_CONTRACT OFF")
#endif

#define EDO_SMC_VERSION "0.1.0"
#define EDO_SMC_DESIGN 0xabea4f8cu /* identifies the design: log it */
#define EDO_SMC_PERIOD_S 0.001
#define EDO_SMC_MAX_CURRENT_A 10.0 /* of either sign */
#define EDO_SMC_DELAY_TICKS 0 /* from the computation of a current to its output */
#define EDO_SMC_CURRENT_LAG_S 0.0002 /* time constant of the current loop */
#define EDO_SMC_INERTIA_KG_M2 0.0002 /* at the controlled shaft, behind the gear */
#define EDO_SMC_TORQUE_N_M_PER_A 0.05
#define EDO_SMC_DAMPING_N_M_S 1e-5
#define EDO_SMC_ENCODER_BITS 14 /* on the shaft itself; counts up with the angle, 0 at angle 0 */
#define EDO_SMC_ENCODER_STATES 16384u /* number of counts before it wraps; 0 for 2^32 */
#define EDO_SMC_ENCODER_COUNTS_PER_TURN 16384
#define EDO_SMC_ENCODER_UNIT_RAD 0.0003834951969714103 /* angle of the shaft per count */
#define EDO_SMC_ENCODER_REVERSED 0
#define EDO_SMC_ENCODER_OFFSET_COUNTS 0

/* Status flags of a tick. */
enum {
    EDO_SMC_OK = 0,
    EDO_SMC_INPUT_REJECTED = 1, /* no valid sample yet, too many missing, an invalid target, or a stopped drive: fallback */
    EDO_SMC_SATURATED = 2, /* the demanded u exceeds the limits */
    EDO_SMC_SAMPLE_LOST = 8, /* a count was missing or physically impossible: the observer predicts */
    EDO_SMC_POSITION_STEPPED = 128, /* missed tick or slip: the position was set from the counts again */
    EDO_SMC_WAITS = 256, /* the counts are not consistent yet: the current is 0 until they are */
    /* set by the monitors */
    EDO_SMC_SIGMA_STAR_OVER_BOUND = 4,
    EDO_SMC_DISTURBANCE_OVER_BOUND = 16,
    EDO_SMC_STUCK_AT_LIMIT = 32,
    EDO_SMC_WRONG_WAY = 512, /* the shaft accelerates against its current: encoder or phases are reversed */
    EDO_SMC_OSCILLATES = 1024, /* the disturbance exceeds its bound in both directions: a limit cycle */
    EDO_SMC_BRAKES = 2048, /* after an alarm: the current opposes the speed, the target is ignored */
    /* set by the limits of motion */
    EDO_SMC_OVERSPEED = 4096,
    EDO_SMC_FOLLOWING_ERROR = 8192,
    EDO_SMC_END_OF_RANGE = 16384, /* beyond an end of the range, or braking must begin now */
    EDO_SMC_HUNTS = 32768, /* the shaft hunts at rest: a wider rest band or lower gains are in use */
    EDO_SMC_STOPPED = 64 /* the output is the safe current until the monitor is reset */
};

/* Target at an instant: position 2 pi turn + r, and its derivatives, which must match. */
typedef struct {
    int32_t turn; /* revolutions; may wrap */
    float r; /* rad; keep it within two revolutions */
    float r_dot; /* rad/s */
} edo_smc_target;

/* Input of a tick. */
typedef struct {
    uint32_t count; /* register of the counter */
    bool lost; /* true: no count in this tick */
    edo_smc_target begin; /* target at the begin of the tick in which u is held */
    edo_smc_target end; /* target at the end of that tick */
} edo_smc_sample;

typedef struct {
    float u; /* A; hold until the next tick; within the limits */
    float sigma; /* sliding variable, unit of the last derivative of the target */
    float sigma_star; /* sliding variable without its initial offset */
} edo_smc_output;

/* Estimates of each shaft. */
typedef struct {
    int32_t turn; /* revolutions to add to the positions */
    float position; /* rad */
    float speed; /* rad/s */
    float disturbance; /* rad/s^2, acceleration that the model does not explain */
    float load; /* N m, torque against the shaft: load and friction */
} edo_smc_estimates_of;

/* State between two ticks; zeros before the start. */
typedef struct {
    bool fresh; /* no tick has passed since the start */
    uint32_t last; /* last valid count */
    uint32_t at; /* last valid count, relative to the base */
    uint32_t turn; /* revolution of the base */
    float p; /* estimated position minus the position of its count */
    float v; /* estimated speed */
    float d; /* estimated disturbance, an acceleration */
    float smoothed; /* smoothed innovation */
    float level; /* share of the high gains, 0 to 1 */
    float reach; /* temporary widening of the innovation gate */
    float missed; /* consecutive counts that were not used */
    float off; /* innovation of the last unused count */
    float doubt; /* cost of recent position steps; while fresh: consistent counts still needed */
    float offset; /* W = sigma(0) e^(-alpha t) */
    float held; /* current that the actuator held since the last tick, A */
    float limit; /* largest current of the power stage, A */
    float reported; /* last report well below the output, A; below 0: the limit was set */
    bool started;
} edo_smc_state;

/* Values that one part of a tick passes to the next. */
typedef struct {
    bool begins;
    bool missing;
    bool stepped;
} edo_smc_between;

/* Converts a count to a signed number; the result of a cast would depend on the compiler. */
static inline int32_t edo_smc_signed(uint32_t count)
{
    const uint32_t below = 0xffffffffu - count;
    return (count < 0x80000000u) ? (int32_t)count : (-(int32_t)below - 1);
}

/* First part of the first tick after a start, whose estimates are from its sample. Returns false while
 * the drive waits for consistent counts. */
static inline bool edo_smc_begin(edo_smc_state *state, const edo_smc_sample *sample, edo_smc_between *between)
{
    EDO_SMC_AS_WRITTEN
    static const float unit = 3.83495208e-4f; /* one count */
    static const float period = 1.00000005e-3f; /* T, s */
    static const float agreement = 4.52793669e-3f; /* tolerance of consistent counts per tick */
    static const float start_ticks = 10.0f; /* ticks of consistent counts before a current flows */
    static const float fallback = 0.0f; /* fallback, A */
    const uint32_t count = sample->count;
    const bool begins = state->doubt > 0.0f;
    const bool holds = state->reach > 0.0f;
    const uint32_t part = (((sample->lost ? state->last : (count - state->last)) & 0x3fffu) ^ 0x2000u) - 0x2000u;
    const float part_2 = unit * (float)edo_smc_signed(part);
    const float part_3 = part_2 - (period * state->v);
    const float part_4 = agreement + agreement;
    const bool holds_2 = (part_3 >= (-part_4)) && (part_3 <= part_4);
    const float part_5 = part_2 / period;
    const float part_6 = 0.5f * (state->v + part_5);
    const uint32_t part_7 = sample->lost ? part : (state->at + part);
    const uint32_t part_8 = (((part_7
            - ((part_7 < 0x80000000u) ? ((part_7 / 16384u) * 16384u)
            : (0u - (((0u - part_7) / 16384u) * 16384u)))) & 0x1ffffu) ^ 0x10000u) - 0x10000u;
    const uint32_t part_9 = (sample->lost ? 0u : state->turn)
            + ((part_7 < 0x80000000u) ? ((part_7 / 16384u) * 1u) : (0u - (((0u - part_7) / 16384u) * 1u)));
    const uint32_t part_10 = ((count & 0x3fffu) ^ 0x2000u) - 0x2000u;
    const bool holds_3 = state->doubt <= start_ticks;
    const float part_11 = state->doubt
            - (((period * ((part_6 < 0.0f) ? (-part_6) : (part_6 + 0.0f))) > part_4) ? (0.5f * start_ticks) : 1.0f);
    const bool holds_4 = part_11 <= 0.0f;
    const bool holds_5 = !begins;
    const bool holds_6 = holds_2 && holds_3 && holds_4;
    const bool holds_7 = !holds_2;
    const bool holds_8 = !holds_3;
    const bool holds_9 = begins && holds;
    const bool holds_10 = begins && holds_7 && holds;
    between->missing = false;
    between->stepped = false;
    between->begins = begins;
    const uint32_t next_1 = sample->lost
            ? (holds_9 ? part_9
            : (state->turn
            + ((state->at < 0x80000000u) ? ((state->at / 16384u) * 1u) : (0u - (((0u - state->at) / 16384u) * 1u)))))
            : (holds_10
            ? (0u + ((part_10 < 0x80000000u) ? ((part_10 / 16384u) * 1u) : (0u - (((0u - part_10) / 16384u) * 1u))))
            : part_9);
    if (!sample->lost) {
        state->last = count;
    }
    if (begins) {
        state->p = 0.0f;
        state->v = sample->lost ? 0.0f : (holds_2 ? part_6 : part_5);
        state->smoothed = 0.0f;
        state->level = 0.0f;
        state->missed = 0.0f;
        state->off = 0.0f;
        state->doubt = (sample->lost || holds_7 || holds_8 || (part_11 > start_ticks)) ? start_ticks
                : ((part_11 < 0.0f) ? 0.0f : part_11);
        state->offset = 0.0f;
        state->held = fallback;
    }
    if ((!sample->lost) && begins && holds_6) {
        state->reach = 0.0f;
    }
    state->fresh = sample->lost ? begins : (begins && (holds_7 || holds_8 || (!holds_4)));
    state->at = sample->lost
            ? (holds_9 ? part_8
            : ((((state->at
            - ((state->at < 0x80000000u) ? ((state->at / 16384u) * 16384u)
            : (0u - (((0u - state->at) / 16384u) * 16384u)))) & 0x1ffffu) ^ 0x10000u) - 0x10000u))
            : (holds_10
            ? ((((part_10
            - ((part_10 < 0x80000000u) ? ((part_10 / 16384u) * 16384u)
            : (0u - (((0u - part_10) / 16384u) * 16384u)))) & 0x1ffffu) ^ 0x10000u) - 0x10000u) : part_8);
    state->turn = next_1;
    return sample->lost ? holds_5 : (holds_5 || holds_6);
}

/* Part of a tick: predicts the counts, accepts or rejects them, and updates the observers. Returns
 * false if more consecutive samples are missing than the observers can bridge. */
static inline bool edo_smc_observe(edo_smc_state *state, const edo_smc_sample *sample, edo_smc_between *between)
{
    EDO_SMC_AS_WRITTEN
    static const float b = 250.0f;
    static const float g2 = 9.99975018e-4f; /* coupled model of a tick */
    static const float g1 = 4.99991643e-7f; /* coupled model of a tick */
    static const float phi = 9.99949992e-1f; /* coupled model of a tick */
    static const float half_span = 3.14159274e0f; /* half a counter */
    static const float unit = 3.83495208e-4f; /* one count */
    static const float gate = 3.62234935e-2f; /* innovation gate */
    static const float step_price = 1.90985930e0f; /* cost of a position step, plus 1 each; 4 in 0.1 s are too many */
    static const float agreement = 4.52793669e-3f; /* tolerance of consistent counts per tick */
    static const float period = 1.00000005e-3f; /* T, s */
    static const float lost_ticks = 50.0f; /* largest number of consecutive missing samples */
    static const float smoothing = 2.83468693e-1f; /* 1 - e^(-T/3 ms), by default */
    static const float calm = 5.75242797e-4f; /* smoothed innovation at which the high gains begin */
    static const float rate = 1.04303784e3f; /* slope of the high gains over the innovation */
    static const float keep = 9.51229453e-1f; /* e^(-T/20 ms), by default */
    static const float more_1 = 2.32130900e-1f; /* observer gain, high minus base */
    static const float gain_1 = 3.66249532e-1f; /* observer gain */
    static const float more_2 = 1.54279572e2f; /* observer gain, high minus base */
    static const float gain_2 = 6.93015289e1f; /* observer gain */
    static const float more_3 = 2.83580664e4f; /* observer gain, high minus base */
    static const float gain_3 = 5.25515381e3f; /* observer gain */
    static const float closing = 9.63194430e-1f; /* closing rate of the innovation gate after a re-tune */
    static const float forgetting = 9.90049839e-1f; /* e^(-T/0.1 s), for the cost of position steps */
    const uint32_t count = sample->count;

    /* 1. Where the counts are, and whether they are believed. */
    const bool holds = !sample->lost;
    const float d = state->d + (b * state->held);
    const float p = state->p + ((g2 * state->v) + (g1 * d));
    const float part = (phi * state->v) + (g2 * d);
    const float part_2 = half_span + half_span;
    const uint32_t part_3 = (((count - state->last) & 0x3fffu) ^ 0x2000u) - 0x2000u;
    const float part_4 = p - (unit * (float)edo_smc_signed(part_3));
    const bool holds_2 = (part_4 >= (-(gate + state->reach))) && (part_4 <= (gate + state->reach));
    const bool holds_3 = !holds_2;
    const float part_5 = state->missed + 1.0f;
    const float part_6 = state->doubt + ((step_price * ((part_4 < 0.0f) ? (-part_4) : (part_4 + 0.0f))) + 1.0f);
    const float part_7 = agreement * state->missed;
    const float part_8 = part_7 - gate;
    const float part_9 = part_4 - state->off;
    const float part_10 = ((part_7 + gate) - ((part_8 < 0.0f) ? (-part_8) : (part_8 + 0.0f)))
            - (((part_9 < 0.0f) ? (-part_9) : (part_9 + 0.0f)) + ((part_9 < 0.0f) ? (-part_9) : (part_9 + 0.0f)));
    const float part_11 = (gate * (part_5 * part_5)) - ((part_4 < 0.0f) ? (-part_4) : (part_4 + 0.0f));
    const float part_12 = 4.0f - part_6;
    const float part_13 = ((period * ((state->v < 0.0f) ? (-state->v) : (state->v + 0.0f))) > (agreement + agreement))
            ? 1.0f : (state->missed - 8.0f);
    const float part_14 = part_10 - part_11;
    const float part_15 = (part_10 + part_11) - ((part_14 < 0.0f) ? (-part_14) : (part_14 + 0.0f));
    const float part_16 = part_12 - part_13;
    const float part_17 = (part_12 + part_13) - ((part_16 < 0.0f) ? (-part_16) : (part_16 + 0.0f));
    const float part_18 = part_15 - part_17;
    const bool holds_4 = ((part_15 + part_17) - ((part_18 < 0.0f) ? (-part_18) : (part_18 + 0.0f))) >= 0.0f;
    const bool stepped = holds && holds_3 && holds_4;
    const float part_19 = ((state->missed < 0.0f) ? (-state->missed) : (state->missed + 0.0f)) + 1.0f;
    const bool holds_5 = part_19 <= lost_ticks;

    /* 3. Observers. */
    const float smoothed = state->smoothed - (smoothing * (part_4 + state->smoothed));
    const float part_20 = (((smoothed < 0.0f) ? (-smoothed) : (smoothed + 0.0f)) - calm) * rate;
    const float part_21 = state->level * keep;
    const float part_22 = (part_20 > part_21) ? part_20 : part_21;
    const float level = (part_22 > 1.0f) ? 1.0f : ((part_22 < 0.0f) ? 0.0f : part_22);
    const bool holds_6 = holds_2 || holds_4;
    const bool holds_7 = holds && holds_6;
    const float p1 = sample->lost ? p
            : (holds_2 ? (part_4 - ((gain_1 + (level * more_1)) * part_4)) : (holds_4 ? 0.0f : p));
    const bool holds_8 = holds && holds_2;
    const float d_2 = holds_8 ? (state->d - ((gain_3 + (level * more_3)) * part_4)) : state->d;
    between->missing = sample->lost || (holds_3 && (!holds_4));
    between->stepped = stepped;
    between->begins = false;
    if (holds_7) {
        state->last = count;
        state->at = state->at + part_3;
    }
    if (holds_8) {
        state->smoothed = smoothed;
        state->level = level;
    }
    state->p = p1;
    state->v = holds_8 ? (part - ((gain_2 + (level * more_2)) * part_4)) : part;
    state->d = d_2;
    state->reach = state->reach * closing;
    state->missed = holds_7 ? 0.0f : part_19;
    state->off = sample->lost ? (part_2 + part_2) : (holds_6 ? state->off : part_4);
    state->doubt = (stepped ? part_6 : state->doubt) * forgetting;
    return sample->lost ? holds_5 : (holds_2 || holds_4 || holds_5);
}

/* Part of a tick: the control law and the update of the state. */
static inline unsigned edo_smc_law(edo_smc_state *state, const edo_smc_sample *sample, const edo_smc_between *between,
    edo_smc_output *output)
{
    EDO_SMC_AS_WRITTEN
    static const float unit = 3.83495208e-4f; /* one count */
    static const float drag = -5.00000007e-2f; /* -B/J, 1/s */
    static const float full_turn = 6.28318548e0f; /* 2 pi */
    static const float u_min = -10.0f; /* limit, A */
    static const float u_max = 10.0f; /* limit, A */
    static const float most = 10.0f;
    static const float far_per_u = 9.60000046e-3f; /* limit of e_1 */
    static const float far = 9.60000008e-2f; /* limit of e_1 */
    static const float input_limit = 9.99999996e11f; /* largest valid number */
    static const float c_1 = 125.0f; /* surface */
    static const float per_b = 4.00000019e-3f; /* 1/b */
    static const float kx_2 = -4.70599771e-1f; /* law, on the errors */
    static const float feed_2 = 4.00010014e0f; /* feed-forward, on the change of the reference in the tick */
    static const float kw = -2.28097588e-1f; /* law, on the offset W */
    static const float hold = 1.0f; /* output of a rejected tick: hold u + fallback */
    static const float fallback = 0.0f; /* fallback, A */
    static const float decay = 6.05869368e-2f; /* 1 - e^(-alpha T) */
    static const float k_offset = 3.53670049e0f; /* law, on W if us acts on sigma */
    static const float us = -3.76479816e0f; /* law, on sigma* */
    static const float plausible = 5120.0f; /* a demand above it is checked, A */

    /* 5. Law. */
    const float part = ((unit * (float)edo_smc_signed(state->at)) + state->p)
            - ((full_turn * (float)edo_smc_signed((uint32_t)sample->begin.turn - state->turn)) + sample->begin.r);
    const float v = state->v - sample->begin.r_dot;
    const float part_2 = -(((-u_min) > ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)))
            ? ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)) : (-u_min));
    const float part_3 = (u_max > ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)))
            ? ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)) : u_max;
    const bool holds = (state->limit > (-most)) && (state->limit < most);
    const float part_4 = holds ? part_2 : u_min;
    const float part_5 = holds ? part_3 : u_max;
    const float part_6 = holds ? (far_per_u * ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))) : far;
    const bool holds_2 = (part >= (-part_6)) && (part <= part_6);
    if (!between->begins) {
        if (!holds_2) {
            const bool holds_3 = (part >= (-input_limit)) && (part <= input_limit);
            if (!holds_3) {
                const float part_32 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit))
                        ? state->held : 0.0f)) + fallback;
                const float part_33 = (part_32 > part_3) ? part_3 : part_32;
                const float u_2 = (part_33 < part_2) ? part_2 : part_33;
                output->u = u_2;
                output->sigma = 0.0f;
                output->sigma_star = 0.0f;
                state->held = u_2;
                return (unsigned)EDO_SMC_INPUT_REJECTED;
            }
            const float part_7 = ((part < 0.0f) ? (-part) : (part + 0.0f)) - part_6;
            const float part_8 = 3.0f * part_6;
            const float part_9 = part_7 - part_8;
            const float part_10 = 0.5f * ((part_7 + part_8) - ((part_9 < 0.0f) ? (-part_9) : (part_9 + 0.0f)));
            const float part_11 = part_7 - part_10;
            const float part_12 = 4.0f * part_8;
            const float part_13 = 0.5f * 3.33333343e-1f;
            const float part_14 = part_11 - part_12;
            const float part_15 = 0.5f * ((part_11 + part_12) - ((part_14 < 0.0f) ? (-part_14) : (part_14 + 0.0f)));
            const float part_16 = part_11 - part_15;
            const float part_17 = 4.0f * part_12;
            const float part_18 = 0.5f * part_13;
            const float part_19 = part_16 - part_17;
            const float part_20 = 0.5f * ((part_16 + part_17) - ((part_19 < 0.0f) ? (-part_19) : (part_19 + 0.0f)));
            const float part_21 = part_16 - part_20;
            const float part_22 = 4.0f * part_17;
            const float part_23 = part_21 - part_22;
            const float part_24 = (((part_6 + (3.33333343e-1f * part_10)) + (part_13 * part_15)) + (part_18 * part_20))
                    + ((0.5f * part_18) * (0.5f * ((part_21 + part_22)
                    - ((part_23 < 0.0f) ? (-part_23) : (part_23 + 0.0f)))));
            const float part_25 = (part > 0.0f) ? part_24 : (-part_24);
            const float sigma_5 = v + (c_1 * part_25);
            float bare = -(per_b * ((drag * state->v) + state->d));
            bare += kx_2 * v;
            bare += feed_2 * (sample->end.r_dot - sample->begin.r_dot);
            const float part_34 = bare + (k_offset * state->offset);
            const float demand_2 = part_34 + (us * sigma_5);
            if ((demand_2 >= (-plausible)) && (demand_2 <= plausible)) {
                const float u_6 = (part_5 < demand_2) ? part_5 : ((demand_2 < part_4) ? part_4 : demand_2);

                /* 6. Memory. */
                const float offset = state->offset - (decay * state->offset);
                const float part_30 = state->reported + 1.0f;
                const float part_31 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                        + ((((part_30 < (-1.0f)) || (part_30 > 1.0f)) ? 1.0f
                        : ((part_30 < 0.0f) ? (-part_30) : (part_30 + 0.0f))) * (0.015625f * most));
                const float limit = holds ? ((part_31 > most) ? most : part_31) : state->limit;
                output->u = u_6;
                output->sigma = sigma_5;
                output->sigma_star = 0.0f;
                state->offset = offset;
                state->held = u_6;
                state->limit = limit;
                return (u_6 != demand_2) ? (unsigned)EDO_SMC_SATURATED : 0u;
            }
            const float part_36 = bare + (kw * sigma_5);
            if (!((part_36 >= (-input_limit)) && (part_36 <= input_limit))) {
                const float part_32 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit))
                        ? state->held : 0.0f)) + fallback;
                const float part_33 = (part_32 > part_3) ? part_3 : part_32;
                const float part_30 = state->reported + 1.0f;
                const float part_31 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                        + ((((part_30 < (-1.0f)) || (part_30 > 1.0f)) ? 1.0f
                        : ((part_30 < 0.0f) ? (-part_30) : (part_30 + 0.0f))) * (0.015625f * most));
                const float limit = holds ? ((part_31 > most) ? most : part_31) : state->limit;
                const float u_2 = (part_33 < part_2) ? part_2 : part_33;
                output->u = u_2;
                output->sigma = 0.0f;
                output->sigma_star = 0.0f;
                state->held = u_2;
                state->limit = limit;
                return (unsigned)EDO_SMC_INPUT_REJECTED;
            }
            const float u_7 = (part_5 < part_36) ? part_5 : ((part_36 < part_4) ? part_4 : part_36);

            /* 6. Memory. */
            const float sigma_6 = sigma_5 - (decay * sigma_5);
            const float part_30 = state->reported + 1.0f;
            const float part_31 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                    + ((((part_30 < (-1.0f)) || (part_30 > 1.0f)) ? 1.0f
                    : ((part_30 < 0.0f) ? (-part_30) : (part_30 + 0.0f))) * (0.015625f * most));
            const float limit = holds ? ((part_31 > most) ? most : part_31) : state->limit;
            output->u = u_7;
            output->sigma = sigma_5;
            output->sigma_star = 0.0f;
            state->offset = sigma_6;
            state->held = u_7;
            state->limit = limit;
            return (u_7 != part_36) ? (unsigned)EDO_SMC_SATURATED : 0u;
        }
        const float sigma_3 = v + (c_1 * part);
        float bare = -(per_b * ((drag * state->v) + state->d));
        bare += kx_2 * v;
        bare += feed_2 * (sample->end.r_dot - sample->begin.r_dot);
        const float sigma_star = sigma_3 - state->offset;
        const float part_34 = bare + (k_offset * state->offset);
        const float demand = part_34 + (us * sigma_3);
        if ((demand >= (-plausible)) && (demand <= plausible)) {
            const float u_4 = (part_5 < demand) ? part_5 : ((demand < part_4) ? part_4 : demand);

            /* 6. Memory. */
            const float offset = state->offset - (decay * state->offset);
            const float part_30 = state->reported + 1.0f;
            const float part_31 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                    + ((((part_30 < (-1.0f)) || (part_30 > 1.0f)) ? 1.0f
                    : ((part_30 < 0.0f) ? (-part_30) : (part_30 + 0.0f))) * (0.015625f * most));
            const float limit = holds ? ((part_31 > most) ? most : part_31) : state->limit;
            output->u = u_4;
            output->sigma = sigma_3;
            output->sigma_star = sigma_star;
            state->offset = offset;
            state->held = u_4;
            state->limit = limit;
            return (u_4 != demand) ? (unsigned)EDO_SMC_SATURATED : 0u;
        }
        const float part_35 = bare + (kw * sigma_3);
        if (!((part_35 >= (-input_limit)) && (part_35 <= input_limit))) {
            const float part_32 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit))
                    ? state->held : 0.0f)) + fallback;
            const float part_33 = (part_32 > part_3) ? part_3 : part_32;
            const float part_30 = state->reported + 1.0f;
            const float part_31 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                    + ((((part_30 < (-1.0f)) || (part_30 > 1.0f)) ? 1.0f
                    : ((part_30 < 0.0f) ? (-part_30) : (part_30 + 0.0f))) * (0.015625f * most));
            const float limit = holds ? ((part_31 > most) ? most : part_31) : state->limit;
            const float u_2 = (part_33 < part_2) ? part_2 : part_33;
            output->u = u_2;
            output->sigma = 0.0f;
            output->sigma_star = 0.0f;
            state->held = u_2;
            state->limit = limit;
            return (unsigned)EDO_SMC_INPUT_REJECTED;
        }
        const float u_5 = (part_5 < part_35) ? part_5 : ((part_35 < part_4) ? part_4 : part_35);

        /* 6. Memory. */
        const float sigma_4 = sigma_3 - (decay * sigma_3);
        const float part_30 = state->reported + 1.0f;
        const float part_31 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                + ((((part_30 < (-1.0f)) || (part_30 > 1.0f)) ? 1.0f
                : ((part_30 < 0.0f) ? (-part_30) : (part_30 + 0.0f))) * (0.015625f * most));
        const float limit = holds ? ((part_31 > most) ? most : part_31) : state->limit;
        output->u = u_5;
        output->sigma = sigma_3;
        output->sigma_star = 0.0f;
        state->offset = sigma_4;
        state->held = u_5;
        state->limit = limit;
        return (u_5 != part_35) ? (unsigned)EDO_SMC_SATURATED : 0u;
    }
    const bool holds_3 = (part >= (-input_limit)) && (part <= input_limit);
    const float part_7 = ((part < 0.0f) ? (-part) : (part + 0.0f)) - part_6;
    const float part_8 = 3.0f * part_6;
    const float part_9 = part_7 - part_8;
    const float part_10 = 0.5f * ((part_7 + part_8) - ((part_9 < 0.0f) ? (-part_9) : (part_9 + 0.0f)));
    const float part_11 = part_7 - part_10;
    const float part_12 = 4.0f * part_8;
    const float part_13 = 0.5f * 3.33333343e-1f;
    const float part_14 = part_11 - part_12;
    const float part_15 = 0.5f * ((part_11 + part_12) - ((part_14 < 0.0f) ? (-part_14) : (part_14 + 0.0f)));
    const float part_16 = part_11 - part_15;
    const float part_17 = 4.0f * part_12;
    const float part_18 = 0.5f * part_13;
    const float part_19 = part_16 - part_17;
    const float part_20 = 0.5f * ((part_16 + part_17) - ((part_19 < 0.0f) ? (-part_19) : (part_19 + 0.0f)));
    const float part_21 = part_16 - part_20;
    const float part_22 = 4.0f * part_17;
    const float part_23 = part_21 - part_22;
    const float part_24 = (((part_6 + (3.33333343e-1f * part_10)) + (part_13 * part_15)) + (part_18 * part_20))
            + ((0.5f * part_18) * (0.5f * ((part_21 + part_22) - ((part_23 < 0.0f) ? (-part_23) : (part_23 + 0.0f)))));
    const float part_25 = (part > 0.0f) ? part_24 : (-part_24);
    const float sigma = v + (c_1 * (holds_2 ? part : part_25));
    float bare = -(per_b * ((drag * state->v) + state->d));
    bare += kx_2 * v;
    bare += feed_2 * (sample->end.r_dot - sample->begin.r_dot);
    const float part_26 = bare + (kw * sigma);
    const float part_27 = (holds_2 || holds_3) ? part_26 : state->held;
    const bool holds_4 = (part_27 >= (-input_limit)) && (part_27 <= input_limit);
    const float part_28 = (hold * (holds_4 ? state->held : 0.0f)) + fallback;
    const float part_29 = (part_28 > part_3) ? part_3 : part_28;
    if (!holds_2) {
        if (!holds_3) {
            const float u_3 = (part_29 < part_2) ? part_2 : part_29;
            output->u = u_3;
            output->sigma = 0.0f;
            output->sigma_star = 0.0f;
            state->held = u_3;
            return (unsigned)EDO_SMC_INPUT_REJECTED;
        }
        if (!holds_4) {
            const float part_32 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit))
                    ? state->held : 0.0f)) + fallback;
            const float part_33 = (part_32 > part_3) ? part_3 : part_32;
            const float part_30 = state->reported + 1.0f;
            const float part_31 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                    + ((((part_30 < (-1.0f)) || (part_30 > 1.0f)) ? 1.0f
                    : ((part_30 < 0.0f) ? (-part_30) : (part_30 + 0.0f))) * (0.015625f * most));
            const float limit = holds ? ((part_31 > most) ? most : part_31) : state->limit;
            const float u_2 = (part_33 < part_2) ? part_2 : part_33;
            output->u = u_2;
            output->sigma = 0.0f;
            output->sigma_star = 0.0f;
            state->held = u_2;
            state->limit = limit;
            return (unsigned)EDO_SMC_INPUT_REJECTED;
        }
        const float u = (part_5 < part_26) ? part_5 : ((part_26 < part_4) ? part_4 : part_26);

        /* 6. Memory. */
        const float sigma_2 = sigma - (decay * sigma);
        const bool saturated = u != part_26;
        const float part_30 = state->reported + 1.0f;
        const float part_31 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                + ((((part_30 < (-1.0f)) || (part_30 > 1.0f)) ? 1.0f
                : ((part_30 < 0.0f) ? (-part_30) : (part_30 + 0.0f))) * (0.015625f * most));
        const float limit = holds ? ((part_31 > most) ? most : part_31) : state->limit;
        output->u = u;
        output->sigma = sigma;
        output->sigma_star = 0.0f;
        state->offset = sigma_2;
        state->held = u;
        state->limit = limit;
        return saturated ? (unsigned)EDO_SMC_SATURATED : 0u;
    }
    if (!holds_4) {
        const float part_32 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit)) ? state->held
                : 0.0f)) + fallback;
        const float part_33 = (part_32 > part_3) ? part_3 : part_32;
        const float part_30 = state->reported + 1.0f;
        const float part_31 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
                + ((((part_30 < (-1.0f)) || (part_30 > 1.0f)) ? 1.0f
                : ((part_30 < 0.0f) ? (-part_30) : (part_30 + 0.0f))) * (0.015625f * most));
        const float limit = holds ? ((part_31 > most) ? most : part_31) : state->limit;
        const float u_2 = (part_33 < part_2) ? part_2 : part_33;
        output->u = u_2;
        output->sigma = 0.0f;
        output->sigma_star = 0.0f;
        state->held = u_2;
        state->limit = limit;
        return (unsigned)EDO_SMC_INPUT_REJECTED;
    }
    const float u = (part_5 < part_26) ? part_5 : ((part_26 < part_4) ? part_4 : part_26);

    /* 6. Memory. */
    const float sigma_2 = sigma - (decay * sigma);
    const bool saturated = u != part_26;
    const float part_30 = state->reported + 1.0f;
    const float part_31 = ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f))
            + ((((part_30 < (-1.0f)) || (part_30 > 1.0f)) ? 1.0f
            : ((part_30 < 0.0f) ? (-part_30) : (part_30 + 0.0f))) * (0.015625f * most));
    const float limit = holds ? ((part_31 > most) ? most : part_31) : state->limit;
    output->u = u;
    output->sigma = sigma;
    output->sigma_star = 0.0f;
    state->offset = sigma_2;
    state->held = u;
    state->limit = limit;
    return saturated ? (unsigned)EDO_SMC_SATURATED : 0u;
}

/* Part of a tick without valid estimates: the output is the fallback, and the observers restart at the
 * counts. */
static inline unsigned edo_smc_give_up(edo_smc_state *state, const edo_smc_sample *sample, edo_smc_output *output)
{
    EDO_SMC_AS_WRITTEN
    static const float input_limit = 9.99999996e11f; /* largest valid number */
    static const float u_min = -10.0f; /* limit, A */
    static const float u_max = 10.0f; /* limit, A */
    static const float hold = 1.0f; /* output of a rejected tick: hold u + fallback */
    static const float fallback = 0.0f; /* fallback, A */
    static const float start_ticks = 10.0f; /* ticks of consistent counts before a current flows */
    const float part = -(((-u_min) > ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)))
            ? ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)) : (-u_min));
    const float part_2 = (u_max > ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)))
            ? ((state->limit < 0.0f) ? (-state->limit) : (state->limit + 0.0f)) : u_max;
    const float part_3 = (hold * (((state->held >= (-input_limit)) && (state->held <= input_limit)) ? state->held
            : 0.0f)) + fallback;
    const float part_4 = (part_3 > part_2) ? part_2 : part_3;
    const float u = (part_4 < part) ? part : part_4;
    const bool waits = !sample->lost;
    output->u = u;
    output->sigma = 0.0f;
    output->sigma_star = 0.0f;
    if (waits) {
        state->fresh = true;
    }
    if (!sample->lost) {
        state->d = 0.0f;
        state->doubt = start_ticks;
    }
    state->reach = 0.0f;
    state->held = u;
    return ((unsigned)EDO_SMC_INPUT_REJECTED) | ((unsigned)EDO_SMC_SAMPLE_LOST)
            | (waits ? (unsigned)EDO_SMC_WAITS : 0u);
}

/* Part of a tick without a target: the output is the fallback. */
static inline unsigned edo_smc_refuse(edo_smc_state *state, edo_smc_output *output)
{
    EDO_SMC_AS_WRITTEN
    static const float input_limit = 9.99999996e11f; /* largest valid number */
    static const float u_min = -10.0f; /* limit, A */
    static const float u_max = 10.0f; /* limit, A */
    static const float hold = 1.0f; /* output of a rejected tick: hold u + fallback */
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
    return ((unsigned)EDO_SMC_INPUT_REJECTED) | ((unsigned)EDO_SMC_SAMPLE_LOST);
}

/* Predicts over a period without a tick. Returns false if more periods are missing than the model can
 * predict. */
static inline bool edo_smc_pass(edo_smc_state *state)
{
    EDO_SMC_AS_WRITTEN
    static const float b = 250.0f;
    static const float g2 = 9.99975018e-4f; /* coupled model of a tick */
    static const float g1 = 4.99991643e-7f; /* coupled model of a tick */
    static const float phi = 9.99949992e-1f; /* coupled model of a tick */
    static const float half_span = 3.14159274e0f; /* half a counter */
    static const float lost_ticks = 50.0f; /* largest number of consecutive missing samples */
    static const float closing = 9.63194430e-1f; /* closing rate of the innovation gate after a re-tune */
    static const float forgetting = 9.90049839e-1f; /* e^(-T/0.1 s), for the cost of position steps */
    static const float decay = 6.05869368e-2f; /* 1 - e^(-alpha T) */

    /* 1. Where the counts are, and whether they are believed. */
    const float d = state->d + (b * state->held);
    const float p1 = state->p + ((g2 * state->v) + (g1 * d));
    const float part = half_span + half_span;
    const float missed = ((state->missed < 0.0f) ? (-state->missed) : (state->missed + 0.0f)) + 1.0f;

    /* 3. Observers. */
    const float offset = state->offset - (decay * state->offset);
    state->p = p1;
    state->v = (phi * state->v) + (g2 * d);
    state->reach = state->reach * closing;
    state->missed = missed;
    state->off = part + part;
    state->doubt = state->doubt * forgetting;
    state->offset = offset;
    return missed <= lost_ticks;
}

/* Part of a tick: moves the base by whole revolutions of the shaft. */
static inline void edo_smc_follow(edo_smc_state *state)
{
    EDO_SMC_AS_WRITTEN
    static const float unit = 3.83495208e-4f; /* one count */
    static const float edge = 3.53429174e0f; /* 9/16 of the base count range */
    const float part = unit * (float)edo_smc_signed(state->at);
    if ((part >= (-edge)) && (part <= edge)) {
        return;
    }
    const bool holds = part > 0.0f;
    state->at = (((holds ? (state->at - 16384u) : (state->at + 16384u)) & 0x1ffffu) ^ 0x10000u) - 0x10000u;
    state->turn = holds ? (state->turn + 1u) : (state->turn - 1u);
}

/* Part of a tick with a missing count: moves the last counts with the prediction, by quarters of the
 * counter. */
static inline void edo_smc_carry(edo_smc_state *state)
{
    EDO_SMC_AS_WRITTEN
    static const float quarter = 1.57079637e0f; /* quarter of the counter or of the base, the smaller */
    if (((state->p >= (-quarter)) && (state->p <= quarter))
            || ((state->p < (-(quarter + quarter))) || (state->p > (quarter + quarter)))) {
        return;
    }
    if (!(state->p > 0.0f)) {
        state->last = state->last - 4096u;
        state->at = state->at - 4096u;
        state->p = state->p + quarter;
        return;
    }
    state->last = state->last + 4096u;
    state->at = state->at + 4096u;
    state->p = state->p - quarter;
}

/* Starts the state with a sample that has all counts; pass the same sample to the first tick. Its angle
 * is then within half a counter of 0. Returns false and leaves the state unchanged if the sample is invalid: try the
 * next one. */
static inline bool edo_smc_start(edo_smc_state *state, const edo_smc_sample *sample)
{
    EDO_SMC_AS_WRITTEN
    static const float unit = 3.83495208e-4f; /* one count */
    static const float full_turn = 6.28318548e0f; /* 2 pi */
    static const float input_limit = 9.99999996e11f; /* largest valid number */
    static const float far = 9.60000008e-2f; /* limit of e_1 */
    static const float c_1 = 125.0f; /* surface */
    static const float half_span = 3.14159274e0f; /* half a counter */
    static const float most = 10.0f;
    const uint32_t count = sample->count;
    if (sample->lost) {
        return false;
    }
    const uint32_t part = ((count & 0x3fffu) ^ 0x2000u) - 0x2000u;
    const float d = 0.0f * 1.0f;
    const uint32_t at = (((part
            - ((part < 0x80000000u) ? ((part / 16384u) * 16384u)
            : (0u - (((0u - part) / 16384u) * 16384u)))) & 0x1ffffu) ^ 0x10000u) - 0x10000u;
    const uint32_t turn = 0u + ((part < 0x80000000u) ? ((part / 16384u) * 1u) : (0u - (((0u - part) / 16384u) * 1u)));

    /* 5. Law. */
    const float part_2 = ((unit * (float)edo_smc_signed(at)) + 0.0f)
            - ((full_turn * (float)edo_smc_signed((uint32_t)sample->begin.turn - turn)) + sample->begin.r);
    const float sigma = 0.0f - sample->begin.r_dot;
    if (!(((part_2 >= (-input_limit)) && (part_2 <= input_limit))
            && ((sigma >= (-input_limit)) && (sigma <= input_limit)))) {
        return false;
    }
    const float part_3 = ((part_2 < 0.0f) ? (-part_2) : (part_2 + 0.0f)) - far;
    const float part_4 = 3.0f * far;
    const float part_5 = part_3 - part_4;
    const float part_6 = 0.5f * ((part_3 + part_4) - ((part_5 < 0.0f) ? (-part_5) : (part_5 + 0.0f)));
    const float part_7 = part_3 - part_6;
    const float part_8 = 4.0f * part_4;
    const float part_9 = 0.5f * 3.33333343e-1f;
    const float part_10 = part_7 - part_8;
    const float part_11 = 0.5f * ((part_7 + part_8) - ((part_10 < 0.0f) ? (-part_10) : (part_10 + 0.0f)));
    const float part_12 = part_7 - part_11;
    const float part_13 = 4.0f * part_8;
    const float part_14 = 0.5f * part_9;
    const float part_15 = part_12 - part_13;
    const float part_16 = 0.5f * ((part_12 + part_13) - ((part_15 < 0.0f) ? (-part_15) : (part_15 + 0.0f)));
    const float part_17 = part_12 - part_16;
    const float part_18 = 4.0f * part_13;
    const float part_19 = part_17 - part_18;
    const float part_20 = (((far + (3.33333343e-1f * part_6)) + (part_9 * part_11)) + (part_14 * part_16))
            + ((0.5f * part_14) * (0.5f * ((part_17 + part_18) - ((part_19 < 0.0f) ? (-part_19) : (part_19 + 0.0f)))));
    const float sigma_2 = sigma
            + (c_1 * (((part_2 >= (-far)) && (part_2 <= far)) ? part_2 : ((part_2 > 0.0f) ? part_20 : (-part_20))));
    const bool answer = ((sigma_2 >= (-input_limit)) && (sigma_2 <= input_limit))
            && ((d >= (-input_limit)) && (d <= input_limit));
    if (answer) {
        state->fresh = true;
        state->last = count;
        state->at = at;
        state->turn = turn;
        state->p = 0.0f;
        state->v = 0.0f;
        state->d = d;
        state->smoothed = 0.0f;
        state->level = 0.0f;
        state->reach = half_span;
        state->missed = 0.0f;
        state->off = 0.0f;
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
static inline unsigned edo_smc_not_started(edo_smc_output *output)
{
    EDO_SMC_AS_WRITTEN
    static const float fallback = 0.0f; /* fallback, A */
    output->u = fallback;
    output->sigma = 0.0f;
    output->sigma_star = 0.0f;
    return ((unsigned)EDO_SMC_INPUT_REJECTED) | ((unsigned)EDO_SMC_WAITS);
}

/* Computes one tick: counts and targets in, current out. Call it once per period, with the counts read at its begin.
 * Returns the status flags. output->u is valid for every sample. */
static inline unsigned edo_smc_tick(edo_smc_state *state, const edo_smc_sample *sample, edo_smc_output *output)
{
    edo_smc_between between;
    unsigned health;
    if (state->fresh) {
        if (!edo_smc_begin(state, sample, &between)) {
            return edo_smc_not_started(output);
        }
    } else {
        if (!edo_smc_observe(state, sample, &between)) {
            health = edo_smc_give_up(state, sample, output);
            edo_smc_follow(state);
            edo_smc_carry(state);
            return health;
        }
    }
    health = edo_smc_law(state, sample, &between, output);
    edo_smc_follow(state);
    health |= between.stepped ? (unsigned)EDO_SMC_POSITION_STEPPED : 0u;
    if (between.missing) {
        edo_smc_carry(state);
        health |= (unsigned)EDO_SMC_SAMPLE_LOST;
    }
    return health;
}

/* Computes one tick and starts the drive after 10 ticks with valid and consistent samples. Until then the
 * output is the fallback. Pass a state of zeros at first. */
static inline unsigned edo_smc_tick_or_start(edo_smc_state *state, const edo_smc_sample *sample, edo_smc_output *output)
{
    if (!state->started) {
        if (!edo_smc_start(state, sample)) {
            return edo_smc_not_started(output);
        }
        state->doubt = 10.0f;
    }
    return edo_smc_tick(state, sample, output);
}

/* Computes one tick without counts and targets: the observers predict, and the output is the fallback. */
static inline unsigned edo_smc_lost(edo_smc_state *state, edo_smc_output *output)
{
    if (!state->started) {
        return edo_smc_not_started(output);
    }
    static const edo_smc_sample nothing = {0u, true, {0, 0.0f, 0.0f}, {0, 0.0f, 0.0f}};
    edo_smc_between between;
    unsigned health;
    if (state->fresh && (state->doubt > 0.0f)) {
        (void)edo_smc_begin(state, &nothing, &between);
        return edo_smc_not_started(output);
    }
    if (!state->fresh && !edo_smc_observe(state, &nothing, &between)) {
        health = edo_smc_give_up(state, &nothing, output);
    } else {
        health = edo_smc_refuse(state, output);
    }
    edo_smc_follow(state);
    edo_smc_carry(state);
    return health;
}

/* Reports the number of periods that passed without a tick while the current was held. A time stamp of a free-running
 * timer counts them; an update flag is one bit. Call it before the next tick. Missed periods use at most half of the
 * permitted missing samples. */
static inline void edo_smc_missed(edo_smc_state *state, uint32_t periods)
{
    uint32_t left = periods;
    while ((left > 0u) && state->started && !state->fresh && edo_smc_pass(state)) {
        edo_smc_follow(state);
        edo_smc_carry(state);
        left--;
    }
    state->missed = (state->missed > 25.0f) ? 25.0f : state->missed;
}

/* Sets the largest current of either sign that the power stage can hold from now on, A: for a hot stage, a low supply,
 * a full brake resistor. u stays within it. A start clears it: call it before each tick. Returns false before the
 * start, for NaN and for a number below 0. */
static inline bool edo_smc_limit(edo_smc_state *state, float current)
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
static inline bool edo_smc_report_applied(edo_smc_state *state, float u)
{
    EDO_SMC_AS_WRITTEN
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
static inline bool edo_smc_estimates(const edo_smc_state *state, edo_smc_estimates_of *estimates)
{
    EDO_SMC_AS_WRITTEN
    static const float unit = 3.83495208e-4f; /* one count */
    static const float inertia = 1.99999995e-4f; /* inertia, kg m^2 */
    if (!state->started) {
        estimates->turn = 0;
        estimates->position = 0.0f;
        estimates->speed = 0.0f;
        estimates->disturbance = 0.0f;
        estimates->load = 0.0f;
        return false;
    }
    const float disturbance = state->d / 1.0f;
    estimates->turn = edo_smc_signed(state->turn);
    estimates->position = ((unit * (float)edo_smc_signed(state->at)) + state->p) / 1.0f;
    estimates->speed = state->v / 1.0f;
    estimates->disturbance = disturbance;
    estimates->load = (-inertia) * disturbance;
    return true;
}

/* Clears everything except the design: consistent counts start the drive again. Use it after a fault. */
static inline void edo_smc_reset(edo_smc_state *state)
{
    EDO_SMC_AS_WRITTEN
    if (state->started) {
        state->fresh = false;
        state->last = 0u;
        state->at = 0u;
        state->turn = 0u;
        state->p = 0.0f;
        state->v = 0.0f;
        state->d = 0.0f;
        state->smoothed = 0.0f;
        state->level = 0.0f;
        state->reach = 0.0f;
        state->missed = 0.0f;
        state->off = 0.0f;
        state->doubt = 0.0f;
        state->offset = 0.0f;
        state->held = 0.0f;
        state->limit = 0.0f;
        state->reported = 0.0f;
    }
    state->started = false;
}

/* MONITORS. An encoder that freezes at standstill looks like a load: u rises against it, and the shaft runs away. No
 * observer detects this. If a runaway is dangerous, call edo_smc_watched_tick and edo_smc_watched_lost instead of
 * edo_smc_tick_or_start and edo_smc_lost.
 * An alarm (any of SIGMA_STAR_OVER_BOUND, DISTURBANCE_OVER_BOUND, STUCK_AT_LIMIT, INPUT_REJECTED)
 * lets the drive brake on its estimated speed while its counts are valid (EDO_SMC_BRAKES).
 * After that, or at rest, the safe current is the output (EDO_SMC_STOPPED), as in the scenario.
 * WRONG_WAY and OSCILLATES stop the drive in any case. A stopped drive stays stopped until edo_smc_watched_reset. */
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
    float side; /* last disturbance of the shaft over its bound */
    float rest_share; /* active share of the rest band, 0 to 1 */
    float rest_width; /* rad to either side; 0: the minimum */
    float rest_side; /* side of the target on which the shaft last stood outside the band */
    float rest_ticks; /* ticks at standstill */
    float rest_error; /* error at the last standstill, rad */
    float rest_slipped; /* 1: moved since the last standstill outside the band */
    int32_t rest_turn; /* revolution of the target */
    float rest_angle;
    float calm_mean; /* mean of the current, A */
    float calm_side; /* last side of the current, relative to its mean */
    float calm_reversals; /* recent reversals of the current */
    uint32_t calm_set; /* lower gain set in use; 0 for none */
    float calm_ticks; /* ticks with this gain set */
    uint32_t calm_returns; /* loads that have ended the use of lower gains */
    float calm_q; /* estimates with lower gains: error in rad, speed, disturbance */
    float calm_v;
    float calm_d;
    float calm_u; /* output of the lower gains, A */
} edo_smc_monitor; /* zeros before the start */

static inline float edo_smc_magnitude(float number)
{
    return (number < 0.0f) ? -number : number;
}

/* Stops the drive: the output is the safe current from now on. */
static inline unsigned edo_smc_watch_stop(edo_smc_monitor *monitor, edo_smc_output *output)
{
    edo_smc_output safe;
    (void)edo_smc_not_started(&safe);
    output->u = safe.u;
    monitor->stopped = true;
    return EDO_SMC_STOPPED;
}

/* Returns number - by, at least 0. */
static inline float edo_smc_lessened(float number, float by)
{
    const float less = number - by;
    return (less > 0.0f) ? less : 0.0f;
}

/* Returns whether d exceeds its bound; sets has_changed if the sign differs from the last time. */
static inline bool edo_smc_watch_side(float d, float bound, float *side, bool *has_changed)
{
    if (edo_smc_magnitude(d) <= bound) {
        return false;
    }
    *has_changed = *has_changed || ((d * *side) < 0.0f);
    *side = d;
    return true;
}

/* Counts a tick at a limit of the current; `falling` must decrease there. */
static inline void edo_smc_watch_limit(edo_smc_monitor *monitor, const edo_smc_state *state, float falling, float current, bool is_lost, bool over)
{
    const float wanted = 250.0f * current; /* acceleration by the current */
    const float speed = edo_smc_magnitude(state->v);
    const float found = edo_smc_magnitude(state->d);
    /* The shaft accelerates against its current, as the reversed current would accelerate it. */
    bool wrong_way = ((state->v * wanted) < 0.0f) && ((state->d * wanted) < 0.0f) &&
                     (speed > monitor->last_speed) && (found > (1.25f * edo_smc_magnitude(wanted))) &&
                     (found < (3.5f * edo_smc_magnitude(wanted)));
    if (wrong_way && over) {
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
static inline void edo_smc_watch_within(edo_smc_monitor *monitor)
{
    monitor->against = 0.0f;
    monitor->stuck = edo_smc_lessened(monitor->stuck, 0.1f);
}

/* Counts a tick over a bound or without a sample. */
static inline void edo_smc_watch_over(edo_smc_monitor *monitor, bool is_over)
{
    monitor->over = is_over ? (monitor->over + 1.0f) : edo_smc_lessened(monitor->over, 1.0f);
}

/* Returns the alarms that stop every drive. The stop begins at the next tick. */
static inline unsigned edo_smc_watch_runaway(edo_smc_monitor *monitor)
{
    const bool wrong_way = monitor->against > 6.0f;
    const bool oscillates = monitor->swings > 400.0f;
    unsigned alarms = wrong_way ? (unsigned)EDO_SMC_WRONG_WAY : 0u;
    alarms |= oscillates ? (unsigned)EDO_SMC_OSCILLATES : 0u;
    monitor->swings = edo_smc_lessened(monitor->swings, 1.0f);
    monitor->stopped = monitor->stopped || wrong_way || oscillates;
    return alarms;
}

/* Starts the brake at the next tick. */
static inline void edo_smc_watch_brakes(edo_smc_monitor *monitor)
{
    monitor->braking = 1.0f;
    monitor->most = 0.0f; /* unknown before the first tick of the brake */
    monitor->stuck = 0.0f;
    monitor->over = 0.0f;
}

/* Checks a tick of the brake. */
static inline void edo_smc_watch_brake(edo_smc_monitor *monitor, const edo_smc_state *state, float speed, float asks, float slowing,
    bool is_short, bool is_blind)
{
    EDO_SMC_AS_WRITTEN
    bool has_changed = false;
    const bool over =
        edo_smc_watch_side(state->d, 1031.25f, &monitor->side, &has_changed);
    if (!(edo_smc_magnitude(state->d) <= 1546.875f)) {
        monitor->most = -edo_smc_magnitude(monitor->most);
    }
    monitor->swings += has_changed ? 200.0f : 0.0f;
    if (is_short) {
        edo_smc_watch_limit(monitor, state, speed, slowing, false, over);
        /* Faster than at the begin: the brake does not work. */
        if (asks > edo_smc_magnitude(monitor->most)) {
            monitor->stuck = 200.0f + 1.0f;
        }
    } else {
        edo_smc_watch_within(monitor);
        if (!((speed < monitor->last_sigma) && (asks > (0.0078125f * edo_smc_magnitude(monitor->most))))) {
            monitor->braking += 1.0f;
        }
        monitor->last_sigma = speed;
    }
    edo_smc_watch_over(monitor, is_blind);
}

/* Computes one tick of the brake: the current opposes the speed and the load within its bound. At a limit the speed must decrease. */
static inline unsigned edo_smc_brake(edo_smc_monitor *monitor, edo_smc_state *state, unsigned told, edo_smc_output *output)
{
    EDO_SMC_AS_WRITTEN
    const unsigned blind = EDO_SMC_SAMPLE_LOST | EDO_SMC_INPUT_REJECTED;
    const float limit = edo_smc_magnitude(state->limit);
    const float u_max = (10.0f > limit) ? limit : 10.0f;
    const float u_min = (-10.0f < -limit) ? -limit : -10.0f;
    const float speed = edo_smc_magnitude(state->v);
    const float asks = edo_smc_magnitude(0.25f * speed);
    float opposed = -(0.25f * state->v);
    const float load = (monitor->most > 0.0f) ? state->d : 0.0f;
    opposed -= 0.004f * load;
    const float asked = (edo_smc_magnitude(opposed) <= 1e30f) ? opposed : 0.0f;
    float slowing = (asked > u_max) ? u_max : asked;
    slowing = (slowing < u_min) ? u_min : slowing;
    const bool is_short = slowing != asked;
    if (edo_smc_magnitude(monitor->most) <= 0.0f) {
        const float most = (1.25f * asks) + (0.5f * (10.0f - (-10.0f)));
        monitor->most = (edo_smc_magnitude(state->d) <= 1546.875f) ? most : -most;
    } else {
        edo_smc_watch_brake(monitor, state, speed, asks, slowing, is_short, (told & blind) == blind);
    }
    const bool is_stuck = monitor->stuck > 200.0f;
    unsigned health = told | (is_stuck ? (unsigned)EDO_SMC_STUCK_AT_LIMIT : 0u);
    if (is_stuck || (monitor->over > 8.0f) || (monitor->braking > 64.0f)) {
        health |= edo_smc_watch_stop(monitor, output);
    } else {
        state->held = slowing;
        state->offset = 0.0f;
        output->u = slowing;
        health &= ~(unsigned)EDO_SMC_SATURATED;
        health |= (unsigned)EDO_SMC_BRAKES;
        if (is_short) {
            health |= (unsigned)EDO_SMC_SATURATED;
        }
    }
    return health | edo_smc_watch_runaway(monitor);
}

/* Checks a completed tick, returns its flags, and starts the reaction to an alarm. */
static inline unsigned edo_smc_watch(edo_smc_monitor *monitor, edo_smc_state *state, unsigned told, edo_smc_output *output)
{
    const bool is_lost = (told & EDO_SMC_SAMPLE_LOST) != 0u;
    const bool is_rejected = (told & EDO_SMC_INPUT_REJECTED) != 0u;
    bool has_changed = false;
    bool is_star_over = false;
    if (!state->started) {
        return told;
    }
    if ((told & EDO_SMC_WAITS) != 0u) {
        if (is_lost) { /* the estimates are no longer valid */
            return told | edo_smc_watch_stop(monitor, output);
        }
        return told;
    }
    if (monitor->braking > 0.0f) {
        return edo_smc_brake(monitor, state, told, output);
    }
    const bool over =
        edo_smc_watch_side(state->d, 1031.25f, &monitor->side, &has_changed);
    monitor->swings += has_changed ? 200.0f : 0.0f;
    if ((told & EDO_SMC_SATURATED) != 0u) {
        edo_smc_watch_limit(monitor, state, edo_smc_magnitude(output->sigma), output->u, is_lost, over);
    } else {
        edo_smc_watch_within(monitor);
        is_star_over = !(edo_smc_magnitude(output->sigma_star) <= 2.7020795f);
    }
    const bool is_any_over = over;
    edo_smc_watch_over(monitor, is_any_over || is_star_over || is_rejected);
    const bool is_late = monitor->over > 8.0f;
    unsigned health = told;
    health |= (monitor->stuck > 200.0f) ? (unsigned)EDO_SMC_STUCK_AT_LIMIT : 0u;
    if (is_late) {
        health |= is_any_over ? (unsigned)EDO_SMC_DISTURBANCE_OVER_BOUND : 0u;
        health |= is_star_over ? (unsigned)EDO_SMC_SIGMA_STAR_OVER_BOUND : 0u;
    }
    /* A missing sample is an alarm only after some ticks. */
    const unsigned alarms = is_late ? health : (health & ~(unsigned)EDO_SMC_INPUT_REJECTED);
    if ((alarms & 1589u) != 0u) {
        if (is_rejected && is_lost) {
            health |= edo_smc_watch_stop(monitor, output);
        } else {
            /* If encoder or phases are reversed, braking accelerates the shaft: wait some ticks for that alarm. */
            if (!(monitor->against > 0.0f)) {
                edo_smc_watch_brakes(monitor);
            }
        }
    }
    return health | edo_smc_watch_runaway(monitor);
}

/* Starts the reaction to an alarm at the next tick, for an external cause such as a door switch. */
static inline void edo_smc_watched_trip(edo_smc_monitor *monitor)
{
    if (!(monitor->braking > 0.0f)) {
        edo_smc_watch_brakes(monitor);
    }
}

/* REST BAND. With friction a shaft at rest hunts: the current rises until the shaft slips, and it sticks on the other
 * side of its target. Within a band around a target at rest the position error does not count. The band is
 * 0.0003834952 rad to either side. If the shaft slips to the other side, it widens, to
 * 0.0023009712 rad at most, until the target moves or a load acts. edo_smc_watched_tick uses the shifted target.
 * HUNTS is set while the band is wider. */
static inline float edo_smc_rest_shift(edo_smc_monitor *monitor, float error, float speed)
{
    EDO_SMC_AS_WRITTEN
    const float away = edo_smc_magnitude(error);
    const float moved = edo_smc_magnitude(error - monitor->rest_error);
    const bool is_slow = edo_smc_magnitude(speed) < 0.016666668f;
    const bool is_near = moved <= 0.0003834952f;
    float width = (monitor->rest_width > 0.0003834952f) ? monitor->rest_width : 0.0003834952f;
    float within;
    monitor->rest_share += 0.17097089f * (1.0f - monitor->rest_share);
    if (!(is_slow || is_near)) {
        monitor->rest_slipped = 1.0f;
        monitor->rest_ticks = 0.0f;
    } else {
        monitor->rest_ticks = (monitor->rest_ticks < 16.0f) ? (monitor->rest_ticks + 1.0f) : 16.0f;
    }
    if (is_slow || !is_near) {
        monitor->rest_error = error;
    }
    if (away > 0.007286409f) {
        width = 0.0003834952f; /* a load, not a slip */
        monitor->rest_side = 0.0f;
    }
    const float stands_at = edo_smc_magnitude(monitor->rest_error);
    if ((monitor->rest_ticks >= 16.0f) && (stands_at > width)) {
        const float side = (monitor->rest_error > 0.0f) ? 1.0f : -1.0f;
        if (((side * monitor->rest_side) * monitor->rest_slipped) < 0.0f) {
            const float grown = 1.5f * width;
            const float here = (1.25f * stands_at) + 0.0001917476f;
            const float wanted = (here > grown) ? here : grown;
            width = (wanted < 0.0023009712f) ? wanted : 0.0023009712f;
        }
        monitor->rest_side = side;
        monitor->rest_slipped = 0.0f;
    }
    monitor->rest_width = width;
    /* The effect of the band decreases outside of it, so a load meets the full gains. */
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

/* Returns the position error of a shaft whose target is at rest, rad. */
static inline float edo_smc_rest_error(const edo_smc_monitor *monitor, const edo_smc_estimates_of *known)
{
    EDO_SMC_AS_WRITTEN
    const uint32_t turns = (uint32_t)monitor->rest_turn - (uint32_t)known->turn;
    return known->position - (((float)edo_smc_signed(turns) * 6.2831855f) + monitor->rest_angle);
}

/* LOWER GAINS. In the play of a gear a shaft swings around a target at rest. If the current alternates by more than
 * 0.5 A around its mean several times, an observer and a law with a quarter of the bandwidth act instead. If they
 * swing, too, an eighth of the bandwidth acts. They end when the target moves or a load moves the shaft by more than
 * 0.046019424 rad. HUNTS is set while they act. */
static inline void edo_smc_calm_listens(edo_smc_monitor *monitor, float error, float speed, float u)
{
    EDO_SMC_AS_WRITTEN
    const float away = u - monitor->calm_mean;
    monitor->calm_mean += 0.015503563f * away;
    if (edo_smc_magnitude(away) > 0.5f) {
        const float side = (away > 0.0f) ? 1.0f : -1.0f;
        monitor->calm_reversals += ((side * monitor->calm_side) < 0.0f) ? 1.0f : 0.0f;
        monitor->calm_side = side;
    }
    monitor->calm_reversals =
        edo_smc_lessened(monitor->calm_reversals, (monitor->calm_set > 0u) ? 0.01875f : 0.075f);
    if ((monitor->calm_reversals > 5.0f) && (monitor->calm_set < 2u)) {
        if (monitor->calm_set == 0u) {
            monitor->calm_q = error;
            monitor->calm_v = speed;
            monitor->calm_d = -(250.0f * monitor->calm_mean);
            monitor->calm_u = monitor->calm_mean;
        }
        monitor->calm_set += 1u;
        monitor->calm_reversals = 0.0f;
        monitor->calm_ticks = 0.0f;
    }
}

/* Returns whether a load acts on settled lower gains. */
static inline bool edo_smc_calm_is_load(edo_smc_monitor *monitor, float error)
{
    if ((monitor->calm_set > 0u) && (monitor->calm_ticks < 512.0f)) {
        monitor->calm_ticks += 1.0f;
        return false;
    }
    return (monitor->calm_set > 0u) && (edo_smc_magnitude(error) > 0.046019424f) && (monitor->calm_returns < 4u);
}

static inline float edo_smc_calm_asks(edo_smc_monitor *monitor, float error)
{
    EDO_SMC_AS_WRITTEN
    static const float gains[2][5] = { /* observer, law */
        {0.13118495f, 6.147043f, 96.02997f, 156250.0f, 875.0f},
        {0.067897506f, 1.5912021f, 12.430697f, 39062.5f, 437.5f}
    };
    const float *set = gains[(monitor->calm_set > 1u) ? 1 : 0];
    const float acceleration = (250.0f * monitor->calm_u) + monitor->calm_d;
    const float foreseen = monitor->calm_q + (0.001f * (monitor->calm_v + (0.0005f * acceleration)));
    const float innovation = error - foreseen;
    monitor->calm_q = foreseen + (set[0] * innovation);
    monitor->calm_v = (monitor->calm_v + (0.001f * acceleration)) + (set[1] * innovation);
    monitor->calm_d += set[2] * innovation;
    float within = (monitor->calm_q > 0.009203885f) ? 0.009203885f : monitor->calm_q;
    within = (within < -0.009203885f) ? -0.009203885f : within;
    return -(0.004f * (((set[3] * (monitor->calm_q - within)) + (set[4] * monitor->calm_v)) + monitor->calm_d));
}

static inline void edo_smc_calm_leave(edo_smc_monitor *monitor)
{
    monitor->calm_mean = 0.0f;
    monitor->calm_ticks = 0.0f;
    monitor->calm_returns = 0u;
    monitor->calm_side = 0.0f;
    monitor->calm_reversals = 0.0f;
    monitor->calm_set = 0u;
    monitor->calm_q = 0.0f;
    monitor->calm_v = 0.0f;
    monitor->calm_d = 0.0f;
    monitor->calm_u = 0.0f;
}

/* Replaces the output of a tick by the current of the lower gains if they are in use. */
static inline unsigned edo_smc_calm(edo_smc_monitor *monitor, edo_smc_state *state, unsigned health, edo_smc_output *output)
{
    const unsigned out_of_use = ((unsigned)EDO_SMC_BRAKES | (unsigned)EDO_SMC_WAITS) | (unsigned)EDO_SMC_INPUT_REJECTED;
    if (!(monitor->rest_share > 0.0f) || ((health & (unsigned)EDO_SMC_STOPPED) != 0u)) {
        return health;
    }
    if (!state->started || ((health & out_of_use) != 0u)) {
        edo_smc_calm_leave(monitor);
        return health;
    }
    edo_smc_estimates_of known;
    (void)edo_smc_estimates(state, &known);
    const float error = edo_smc_rest_error(monitor, &known);
    edo_smc_calm_listens(monitor, error, known.speed, (monitor->calm_set > 0u) ? monitor->calm_u : output->u);
    if (edo_smc_calm_is_load(monitor, error)) { /* back to the normal gains */
        const uint32_t returns = monitor->calm_returns + 1u;
        const float mean = monitor->calm_u;
        edo_smc_calm_leave(monitor);
        monitor->calm_returns = returns;
        monitor->calm_mean = mean;
    }
    if (monitor->calm_set == 0u) {
        return health;
    }
    const float asked = edo_smc_calm_asks(monitor, error);
    if (!(edo_smc_magnitude(asked) <= 1e30f)) {
        edo_smc_calm_leave(monitor);
        return health;
    }
    const float limit = edo_smc_magnitude(state->limit);
    const float u_max = (10.0f > limit) ? limit : 10.0f;
    const float u_min = (-10.0f < -limit) ? -limit : -10.0f;
    float u = (asked > u_max) ? u_max : asked;
    u = (u < u_min) ? u_min : u;
    state->held = u;
    state->offset = 0.0f;
    monitor->calm_u = u;
    output->u = u;
    const unsigned told = (health & ~(unsigned)EDO_SMC_SATURATED) | (unsigned)EDO_SMC_HUNTS;
    return told | ((u != asked) ? (unsigned)EDO_SMC_SATURATED : 0u);
}

static inline void edo_smc_rest_leave(edo_smc_monitor *monitor)
{
    monitor->rest_share = 0.0f;
    monitor->rest_width = 0.0f;
    monitor->rest_side = 0.0f;
    monitor->rest_ticks = 0.0f;
    monitor->rest_error = 0.0f;
    monitor->rest_slipped = 0.0f;
    monitor->rest_turn = 0;
    monitor->rest_angle = 0.0f;
    edo_smc_calm_leave(monitor);
}

/* Returns whether the target is at rest; if not, resets the band. */
static inline bool edo_smc_rests(edo_smc_monitor *monitor, const edo_smc_state *state, const edo_smc_sample *sample)
{
    const edo_smc_target *begin = &sample->begin;
    const edo_smc_target *end = &sample->end;
    if ((begin->r >= end->r) && (begin->r <= end->r) && (begin->turn == end->turn) &&
        (begin->turn == monitor->rest_turn) && (begin->r >= monitor->rest_angle) &&
        (begin->r <= monitor->rest_angle) && (edo_smc_magnitude(begin->r_dot) <= 0.0f) &&
        (edo_smc_magnitude(end->r_dot) <= 0.0f) && state->started) {
        return true;
    }
    if (monitor->rest_share > 0.0f) {
        edo_smc_rest_leave(monitor);
    }
    monitor->rest_turn = end->turn;
    monitor->rest_angle = end->r;
    return false;
}

/* Shifts a target at rest. */
static inline unsigned edo_smc_rest(edo_smc_monitor *monitor, const edo_smc_state *state, edo_smc_sample *sample)
{
    EDO_SMC_AS_WRITTEN
    edo_smc_estimates_of known;
    (void)edo_smc_estimates(state, &known);
    const float error = edo_smc_rest_error(monitor, &known);
    if (monitor->calm_set > 0u) { /* the main law sees no error */
        sample->begin.r += error;
        sample->begin.r_dot = known.speed;
        sample->end = sample->begin;
        return (unsigned)EDO_SMC_HUNTS;
    }
    const float shift = edo_smc_rest_shift(monitor, error, known.speed);
    sample->begin.r += shift;
    sample->end.r = sample->begin.r;
    return (monitor->rest_width > 0.0003834952f) ? (unsigned)EDO_SMC_HUNTS : 0u;
}

/* Computes edo_smc_tick_or_start with the monitors. */
static inline unsigned edo_smc_watched_tick(edo_smc_monitor *monitor, edo_smc_state *state, const edo_smc_sample *sample, edo_smc_output *output)
{
    edo_smc_sample placed;
    const edo_smc_sample *taken = sample;
    unsigned hunts = 0u;
    if (edo_smc_rests(monitor, state, sample)) {
        placed = *sample;
        hunts = edo_smc_rest(monitor, state, &placed);
        taken = &placed;
    }
    if (monitor->stopped) {
        (void)edo_smc_not_started(output);
        return EDO_SMC_INPUT_REJECTED | EDO_SMC_STOPPED;
    }
    unsigned health = edo_smc_watch(monitor, state, edo_smc_tick_or_start(state, taken, output), output);
    health |= ((health & ((unsigned)EDO_SMC_STOPPED | (unsigned)EDO_SMC_BRAKES)) == 0u) ? hunts : 0u;
    health = edo_smc_calm(monitor, state, health, output);
    return health;
}

/* Computes edo_smc_lost with the monitors. */
static inline unsigned edo_smc_watched_lost(edo_smc_monitor *monitor, edo_smc_state *state, edo_smc_output *output)
{
    if (monitor->stopped) {
        (void)edo_smc_not_started(output);
        return EDO_SMC_INPUT_REJECTED | EDO_SMC_STOPPED;
    }
    return edo_smc_watch(monitor, state, edo_smc_lost(state, output), output);
}

/* Clears monitor and state after a stop, at rest: counts that are consistent for 10 ms start the drive. */
static inline void edo_smc_watched_reset(edo_smc_monitor *monitor, edo_smc_state *state)
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
    edo_smc_rest_leave(monitor);
    monitor->side = 0.0f;
    edo_smc_reset(state);
}

/* Start of a plan: a target with one more derivative, so that u has no step. */
typedef struct {
    int32_t turn;
    float r;
    float r_dot;
    float r_ddot;
} edo_smc_jet;

/* Goal of a plan: rest at 2 pi turn + angle, or a sine about angle 0 whose phase is 0 at tick 0. */
typedef struct {
    int32_t turn;
    float angle; /* rad */
    float amplitude; /* rad */
    float omega; /* rad/s */
    uint32_t phase_per_tick; /* 2^-32 revolutions; 0: rest */
} edo_smc_goal;

/* Plan: the target of every tick. Ticks count from any number and may wrap. Zeros are rest at angle 0. */
typedef struct {
    edo_smc_goal goal;
    uint32_t end; /* tick at which the goal is reached */
    uint32_t ticks; /* duration of the transition */
    float per_tick;
    float per_s;
    uint64_t share; /* 2^64/ticks */
    float power[2][6]; /* coefficients for the first and for the second half */
    uint64_t way[2][6]; /* the coefficients in 2^-32 revolutions, modulo 2^64 */
} edo_smc_plan;

/* Part of a plan: position and derivatives of A sin at a phase in 2^-32 revolutions. */
static inline void edo_smc_jet_of_sine(uint32_t phase, float amplitude, float omega, edo_smc_jet *jet)
{
    EDO_SMC_AS_WRITTEN
    const float part = (float)edo_smc_signed(phase) * 1.46291812e-9f;
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

/* Part of a plan: adds the transition to position and derivatives of the goal. */
static inline void edo_smc_join(const float power[6], uint32_t ticks, uint32_t rest, uint32_t early, float per_tick,
    float rate, float instant_s, edo_smc_jet *jet)
{
    EDO_SMC_AS_WRITTEN
    const float part = (float)edo_smc_signed(ticks) * per_tick;
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
            + (((float)edo_smc_signed(rest) * 1.46291812e-9f) + (((float)edo_smc_signed(early) * instant_s) * part_10));
    jet->r_dot = jet->r_dot + part_10;
    jet->r_ddot = jet->r_ddot + (((part_9 * rate) * 2.0f) * (((((part_2 + part_4) * part) + part_6) * part) + part_8));
}

/* Part of a plan: coefficients of a transition that closes a gap in tau_s seconds. */
static inline void edo_smc_powers_of_join(const double gap[3], double tau_s, double s[6],
    double left[6])
{
    EDO_SMC_AS_WRITTEN
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

/* Part of a plan: returns whether a number is valid for the drive. */
static inline bool edo_smc_is_number(double number)
{
    return (number >= -1e12) && (number <= 1e12);
}

/* Part of a plan: position and derivatives of the goal at a tick. */
static inline void edo_smc_jet_of_goal(const edo_smc_goal *goal, uint32_t tick, edo_smc_jet *jet)
{
    if (goal->phase_per_tick != 0u) {
        jet->turn = 0;
        edo_smc_jet_of_sine(goal->phase_per_tick * tick, goal->amplitude, goal->omega, jet);
    } else {
        jet->turn = goal->turn;
        jet->r = goal->angle;
        jet->r_dot = 0.0f;
        jet->r_ddot = 0.0f;
    }
}

/* Part of a plan: ticks until the goal is reached, 0 afterwards. The end must be less than 2^31 ticks ahead. */
static inline uint32_t edo_smc_plan_left(const edo_smc_plan *plan, uint32_t tick)
{
    const uint32_t left = plan->end - tick;
    return ((plan->ticks == 0u) || (left > 0x7fffffffu)) ? 0u : left;
}

/* Part of a plan: multiplies a sum in 2^-32 revolutions by s in 2^-32, s at most a half. */
static inline uint64_t edo_smc_share(uint64_t sum, uint32_t s)
{
    const int64_t turns = (int64_t)edo_smc_signed((uint32_t)(sum >> 32)) * (int64_t)edo_smc_signed(s);
    return (uint64_t)turns + (((sum & 0xffffffffu) * (uint64_t)s) >> 32);
}

/* Part of a plan: adds one half of the transition, at a part of its ticks, to position and derivatives of the goal. The
 * position is whole revolutions and a remainder in 2^-32 revolutions, so its resolution is the same at any distance.
 * The argument s has 32 bits, rounded down; `early` corrects the rounding, in 2^-32 ticks. */
static inline void edo_smc_go_along(const edo_smc_plan *plan, uint32_t half, uint32_t part, edo_smc_jet *jet)
{
    const uint32_t s = (uint32_t)(((uint64_t)part * plan->share) >> 32);
    const uint32_t early = 0u - (s * plan->ticks);
    const float rate = (half == 0u) ? plan->per_s : -plan->per_s;
    const float instant_s = (half == 0u) ? 2.3283065e-13f : -2.3283065e-13f;
    uint64_t sum = plan->way[half][5];
    sum = edo_smc_share(sum, s) + plan->way[half][4];
    sum = edo_smc_share(sum, s) + plan->way[half][3];
    sum = edo_smc_share(sum, s) + plan->way[half][2];
    sum = edo_smc_share(sum, s) + plan->way[half][1];
    sum = edo_smc_share(sum, s) + plan->way[half][0];
    jet->turn = edo_smc_signed((uint32_t)jet->turn + (uint32_t)(sum >> 32) + ((uint32_t)sum >> 31));
    edo_smc_join(plan->power[half], part, (uint32_t)sum, early, plan->per_tick, rate, instant_s, jet);
}

/* Writes position and derivatives of a plan at a tick, from which another plan can start. Before the start of the plan
 * it writes the first ones. */
static inline void edo_smc_plan_jet(const edo_smc_plan *plan, uint32_t tick, edo_smc_jet *jet)
{
    const uint32_t ahead = edo_smc_plan_left(plan, tick);
    const uint32_t left = (ahead > plan->ticks) ? plan->ticks : ahead;
    edo_smc_jet_of_goal(&plan->goal, (left == 0u) ? tick : (plan->end - left), jet);
    if (left != 0u) {
        const uint32_t done = plan->ticks - left;
        edo_smc_go_along(plan, (done < left) ? 0u : 1u, (done < left) ? done : left, jet);
    }
}

/* Writes the target at any tick, to look ahead. */
static inline void edo_smc_plan_at(const edo_smc_plan *plan, uint32_t tick, edo_smc_target *target)
{
    edo_smc_jet jet;
    edo_smc_plan_jet(plan, tick, &jet);
    target->turn = jet.turn;
    target->r = jet.r;
    target->r_dot = jet.r_dot;
}

/* Writes the target at a tick. Call it in the interrupt once per tick, for the end of the tick. A completed plan stays
 * completed when the ticks wrap (2^32 ticks are five days at 10 kHz). */
static inline void edo_smc_plan_play(edo_smc_plan *plan, uint32_t tick, edo_smc_target *target)
{
    if (edo_smc_plan_left(plan, tick) == 0u) {
        plan->ticks = 0u;
    }
    edo_smc_plan_at(plan, tick, target);
}

/* Part of a plan: returns whether a coefficient fits into 64 bits of 2^-32 revolutions. */
static inline bool edo_smc_is_near(double rad)
{
    return (rad >= -6000000000.0) && (rad <= 6000000000.0);
}

/* Part of a plan: rounds to 2^-32 revolutions, modulo 2^64. */
static inline uint64_t edo_smc_units(double rad)
{
    const double units = rad * 683565275.5764316;
    const double rounded = units + ((units < 0.0) ? -0.5 : 0.5);
    return (uint64_t)(int64_t)rounded;
}

/* Part of a plan: makes the transition to a goal. It uses double: do not call it in the interrupt. */
static inline bool edo_smc_plan_onto(edo_smc_plan *plan, const edo_smc_goal *goal, const edo_smc_jet *present, uint32_t start,
    uint32_t ticks)
{
    EDO_SMC_AS_WRITTEN
    const double tau_s = (double)ticks * 0.001;
    uint32_t turns;
    double gap[3];
    double power[2][6];
    bool good = (ticks >= 1u) && (ticks <= 16777216u);
    edo_smc_jet at;
    edo_smc_jet_of_goal(goal, start, &at);
    turns = (uint32_t)present->turn - (uint32_t)at.turn;
    gap[0] = (double)present->r - (double)at.r;
    gap[1] = (double)present->r_dot - (double)at.r_dot;
    gap[2] = (double)present->r_ddot - (double)at.r_ddot;
    gap[0] += 6.283185307179586 * (double)edo_smc_signed(turns);
    for (unsigned k = 0; k < 3u; k++) {
        good = good && edo_smc_is_number(gap[k]);
    }
    edo_smc_powers_of_join(gap, tau_s, power[0], power[1]);
    for (unsigned k = 0; k < 6u; k++) {
        good = good && edo_smc_is_near(power[0][k]) && edo_smc_is_near(power[1][k]);
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
            plan->way[half][k] = edo_smc_units(power[half][k]);
        }
    }
    return true;
}

/* Makes a permanent rest at 2 pi turn + angle: for a start. This function and the next three return false for invalid
 * arguments and leave the plan unchanged. Invalid are a number that is NaN or above 1e12, a distance of some 10 million
 * revolutions, and ticks outside of 1 to 2^24. The functions use double, in software on most cores. Make a plan outside
 * of the interrupt and never in the plan that is played, except for a rest at a start. Switch to it between two ticks. */
static inline bool edo_smc_plan_rest(edo_smc_plan *plan, int32_t turn, float angle)
{
    edo_smc_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    if (!edo_smc_is_number((double)angle)) {
        return false;
    }
    goal.turn = turn;
    goal.angle = angle;
    plan->goal = goal;
    plan->ticks = 0u;
    return true;
}

/* Makes a move to rest at 2 pi turn + angle. It begins at tick `start` with `present` and takes `ticks` ticks. During a
 * motion take `present` from the old plan at this tick (edo_smc_plan_jet), never from a measurement. The function does
 * not check the current and the supply. */
static inline bool edo_smc_plan_move(edo_smc_plan *plan, const edo_smc_jet *present, uint32_t start, uint32_t ticks, int32_t turn,
    float angle)
{
    edo_smc_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    goal.turn = turn;
    goal.angle = angle;
    return edo_smc_is_number((double)angle) && edo_smc_plan_onto(plan, &goal, present, start, ticks);
}

/* Part of a stop: writes its distance for a number of ticks and returns whether it moves back. Its speed is
 * (1 - s)^m (part[0] + part[1] s + ..). */
static inline bool edo_smc_stop_goes_back(const edo_smc_jet *present, uint32_t ticks, double *way)
{
    EDO_SMC_AS_WRITTEN
    const double tau_s = (double)ticks * 0.001;
    double part[2] = { (double)present->r_dot, (double)present->r_ddot };
    double scale = 1.0;
    double share = 1.0 / 3.0;
    bool forward = false;
    bool back = false;
    for (unsigned k = 0; k < 2u; k++) {
        const unsigned next = k + 1u;
        part[k] = scale * part[k];
        scale = scale * (tau_s / (double)next);
    }
    for (unsigned times = 0; times < 2u; times++) {
        for (unsigned k = 1; k < 2u; k++) {
            part[k] = part[k] + part[k - 1u];
        }
    }
    *way = 0.0;
    for (unsigned k = 0; k < 2u; k++) {
        const unsigned next = k + 1u;
        const unsigned after = next + 3u;
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
static inline bool edo_smc_plan_stop(edo_smc_plan *plan, const edo_smc_jet *present, uint32_t start, uint32_t ticks)
{
    EDO_SMC_AS_WRITTEN
    uint32_t taken = ticks;
    uint32_t too_many = ticks;
    double way;
    double angle;
    if ((ticks < 1u) || (ticks > 16777216u)) {
        return false;
    }
    if (edo_smc_stop_goes_back(present, ticks, &way)) {
        taken = 1u;
        while ((taken + 1u) < too_many) {
            const uint32_t middle = taken + ((too_many - taken) / 2u);
            if (edo_smc_stop_goes_back(present, middle, &way)) {
                too_many = middle;
            } else {
                taken = middle;
            }
        }
        (void)edo_smc_stop_goes_back(present, taken, &way);
    }
    angle = (double)present->r + way;
    return edo_smc_is_number(angle) && edo_smc_plan_move(plan, present, start, taken, present->turn, (float)angle);
}

/* Makes a transition to A sin(omega t) about angle 0, whose phase is 0 at tick 0. omega is rounded to a multiple of
 * 2^-32 revolutions per tick. It must be at least one of them and less than half a revolution per tick. */
static inline bool edo_smc_plan_sine(edo_smc_plan *plan, const edo_smc_jet *present, uint32_t start, uint32_t ticks,
    double amplitude_rad, double omega_rad_s)
{
    EDO_SMC_AS_WRITTEN
    const double phase = (omega_rad_s * 0.001 / 6.283185307179586 * 4294967296.0) + 0.5;
    edo_smc_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    if (!((phase >= 1.0) && (phase < 2147483648.0)) || !edo_smc_is_number(amplitude_rad)) {
        return false;
    }
    goal.amplitude = (float)amplitude_rad;
    goal.phase_per_tick = (uint32_t)phase;
    goal.omega = (float)((double)goal.phase_per_tick / 4294967296.0 * 6.283185307179586 / 0.001);
    return edo_smc_plan_onto(plan, &goal, present, start, ticks);
}

/* Part of a profile: target from the movement of the averages in the last ticks and their lag behind the base. */
static inline void edo_smc_jet_of_profile(const uint32_t moved[4], const uint32_t behind[2], uint32_t rest, float part_rad,
    float per_s, edo_smc_jet *jet)
{
    EDO_SMC_AS_WRITTEN
    const float part = ((float)edo_smc_signed(moved[0]) * 4.29496730e9f) + (float)edo_smc_signed(moved[1]);
    const float part_2 = ((float)edo_smc_signed(moved[2]) * 4.29496730e9f) + (float)edo_smc_signed(moved[3]);
    jet->r = ((float)edo_smc_signed(rest) * 1.46291812e-9f)
            - (((((float)edo_smc_signed(behind[0]) * 4.29496730e9f) + (float)edo_smc_signed(behind[1]))
            + ((8.33333313e-1f * part) + (1.66666672e-1f * part_2))) * part_rad);
    jet->r_dot = ((0.5f * (part + part_2)) * part_rad) * per_s;
    jet->r_ddot = ((part - part_2) * part_rad) * (per_s * per_s);
}

/* PROFILE. A profile turns set-points that arrive at any time into targets within limits of speed, acceleration and
 * jerk, without overshoot. The interrupt takes the target of each tick from edo_smc_profile_next. Set a goal at any
 * time.
 * The path is averaged over 2 windows of ticks: its jerk is at most 2 acceleration / (window period). For a
 * stream of points use a window of as many ticks as lie between two points. A late, repeated or missing point changes
 * only the path between the points. Change a profile between two ticks, never while the interrupt computes one. */
#ifndef EDO_SMC_PROFILE_WINDOW
#define EDO_SMC_PROFILE_WINDOW 32u /* largest window, 1 to 512 ticks of 8 bytes each */
#endif
#if EDO_SMC_PROFILE_WINDOW > 512
#error "EDO_SMC_PROFILE_WINDOW is more than 512"
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
    int32_t steps[2u * EDO_SMC_PROFILE_WINDOW]; /* steps of the last windows; the oldest is at `oldest` */
    uint32_t oldest;
    uint32_t window;
    uint32_t all; /* window^2: scale of the following members */
    uint64_t sums[2]; /* the last is the movement of the path */
    uint64_t earlier[2];
    uint64_t behind; /* lag of the path behind the base */
    float part_rad;
} edo_smc_profile;

/* Part of a profile: converts to a signed number. */
static inline int64_t edo_smc_signed_long(uint64_t units)
{
    const uint64_t below = UINT64_MAX - units; /* -1 - units, if not negative */
    return (units <= 0x7fffffffffffffffu) ? (int64_t)units : (-1 - (int64_t)below);
}

/* Part of a profile: returns 2 pi turn + rad in 2^-32 revolutions, saturated. */
static inline uint64_t edo_smc_place(int32_t turn, double rad)
{
    const int64_t turns = (int64_t)turn * 4294967296;
    const int64_t rest = edo_smc_signed_long(edo_smc_units(rad));
    int64_t sum;
    if (rest >= 0) {
        sum = (turns > (9223372036854775807 - rest)) ? 9223372036854775807 : (turns + rest);
    } else {
        sum = (turns < (-9223372036854775807 - rest)) ? (-9223372036854775807 - 1) : (turns + rest);
    }
    return (uint64_t)sum;
}

/* Part of a profile: returns whether the limits are in range. */
static inline bool edo_smc_profile_is_limit(double speed_rad_s, double acceleration_rad_s2)
{
    EDO_SMC_AS_WRITTEN
    return (speed_rad_s >= 1.4629180792671595e-6) && (speed_rad_s <= (1073741823.0 * 1.4629180792671595e-6)) &&
           (acceleration_rad_s2 >= 0.0014629180792671598) &&
           (acceleration_rad_s2 <= (1073741823.0 * 0.0014629180792671598));
}

/* Sets the limits, also in motion: above a lower speed the path brakes with the acceleration. Returns false and changes
 * nothing if a limit is NaN, below 2^-32 or above 1/4 revolution per tick (or tick squared). */
static inline bool edo_smc_profile_limit(edo_smc_profile *profile, double speed_rad_s, double acceleration_rad_s2)
{
    EDO_SMC_AS_WRITTEN
    const bool good = edo_smc_profile_is_limit(speed_rad_s, acceleration_rad_s2);
    if (good) {
        profile->fastest = (int32_t)(speed_rad_s / 1.4629180792671595e-6);
        profile->acceleration = (int32_t)(acceleration_rad_s2 / 0.0014629180792671598);
        profile->fastest_whole = profile->fastest / profile->acceleration;
        profile->whole = ((profile->step < 0) ? -profile->step : profile->step) / profile->acceleration;
    }
    return good;
}

/* Part of a profile: sets a goal within the range. */
static inline void edo_smc_profile_set_goal(edo_smc_profile *profile, uint64_t place)
{
    const int64_t goal = edo_smc_signed_long(place);
    const int64_t below = (goal < profile->high) ? goal : profile->high;
    profile->goal = (uint64_t)((below > profile->low) ? below : profile->low);
}

/* Limits the present and all later goals to the range between the two angles, 2 pi turn + rad. Returns false and
 * changes nothing if an angle is NaN or too large, or if the first one is above the second. */
static inline bool edo_smc_profile_keep_within(edo_smc_profile *profile, int32_t low_turn, double low_rad, int32_t high_turn,
    double high_rad)
{
    int64_t low;
    int64_t high;
    if (!edo_smc_is_near(low_rad) || !edo_smc_is_near(high_rad)) {
        return false;
    }
    low = edo_smc_signed_long(edo_smc_place(low_turn, low_rad));
    high = edo_smc_signed_long(edo_smc_place(high_turn, high_rad));
    if (low > high) {
        return false;
    }
    profile->low = low;
    profile->high = high;
    edo_smc_profile_set_goal(profile, profile->goal);
    return true;
}

/* Sets the goal 2 pi turn + rad. Returns false if the goal is beyond the range, and sets it to the end of the range.
 * Returns false and keeps the goal if the angle is NaN or too large. It uses double: some hundred cycles on
 * most cores. */
static inline bool edo_smc_profile_go_to(edo_smc_profile *profile, int32_t turn, double rad)
{
    uint64_t goal;
    if (!edo_smc_is_near(rad)) {
        return false;
    }
    goal = edo_smc_place(turn, rad);
    edo_smc_profile_set_goal(profile, goal);
    return profile->goal == goal;
}

/* Stops as soon as the acceleration permits. The path does not move back unless it has reversed in the last
 * 2 windows. A stop that ends beyond the range returns to the end of the range. */
static inline void edo_smc_profile_stop(edo_smc_profile *profile)
{
    const int64_t speed = (profile->step < 0) ? -(int64_t)profile->step : (int64_t)profile->step;
    const int64_t whole = (int64_t)profile->whole;
    const int64_t way = (whole * ((2 * speed) - ((int64_t)profile->acceleration * (whole + 1)))) / 2;
    const int64_t base = edo_smc_signed_long(profile->base);
    profile->goal = profile->base + (uint64_t)((profile->step < 0) ? -way : way);
    /* A stop that begins beyond the range rests there. */
    if ((base >= profile->low) && (base <= profile->high)) {
        edo_smc_profile_set_goal(profile, profile->goal);
    }
}

/* Restarts at 2 pi turn + rad with a speed and brakes to rest: for a shaft that is in motion. Returns false and changes
 * nothing if a number is NaN or too large, or if the speed exceeds a quarter of a revolution per tick. */
static inline bool edo_smc_profile_start(edo_smc_profile *profile, int32_t turn, double rad, double speed_rad_s)
{
    EDO_SMC_AS_WRITTEN
    const double units = speed_rad_s / 1.4629180792671595e-6;
    const double rounded = units + ((units < 0.0) ? -0.5 : 0.5);
    int64_t step;
    int64_t sum;
    int64_t behind;
    int64_t mean;
    if (!edo_smc_is_near(rad) || !edo_smc_is_near(speed_rad_s) || (units > 1073741823.0) || (units < -1073741823.0) ||
        (profile->acceleration < 1)) {
        return false;
    }
    step = (int64_t)rounded;
    profile->step = (int32_t)step;
    profile->whole = ((profile->step < 0) ? -profile->step : profile->step) / profile->acceleration;
    for (uint32_t k = 0; k < (2u * EDO_SMC_PROFILE_WINDOW); k++) {
        profile->steps[k] = profile->step;
    }
    for (uint32_t k = 0; k < 1u; k++) {
        profile->sums[k] = 0u;
    }
    sum = step * (int64_t)profile->all;
    behind = (sum * (2 * ((int64_t)profile->window - 1))) / 2;
    mean = ((step * 2) * (int64_t)profile->window) / 2;
    profile->sums[1] = (uint64_t)sum;
    profile->earlier[0] = profile->sums[1];
    profile->earlier[1] = profile->sums[1];
    profile->behind = (uint64_t)behind;
    profile->base = edo_smc_place(turn, rad) + (uint64_t)mean;
    edo_smc_profile_stop(profile);
    return true;
}

/* Makes a profile at rest at angle 0. Returns false and changes nothing if a limit is out of range, as for
 * edo_smc_profile_limit, or if the window is not 1 to EDO_SMC_PROFILE_WINDOW. */
static inline bool edo_smc_profile_new(edo_smc_profile *profile, double speed_rad_s, double acceleration_rad_s2, uint32_t window)
{
    EDO_SMC_AS_WRITTEN
    if ((window < 1u) || (window > EDO_SMC_PROFILE_WINDOW) ||
        !edo_smc_profile_is_limit(speed_rad_s, acceleration_rad_s2)) {
        return false;
    }
    profile->step = 0;
    (void)edo_smc_profile_limit(profile, speed_rad_s, acceleration_rad_s2);
    profile->low = -4611686018427387904;
    profile->high = 4611686018427387903;
    profile->oldest = 0u;
    profile->window = window;
    profile->all = window * window;
    profile->part_rad = (float)(1.4629180792671596e-9 / (double)profile->all);
    return edo_smc_profile_start(profile, 0, 0.0, 0.0);
}

/* Returns whether the path rests at its goal. */
static inline bool edo_smc_profile_has_arrived(const edo_smc_profile *profile)
{
    bool still = (profile->goal == profile->base) && (profile->step == 0) && (profile->behind == 0u) &&
                 (profile->earlier[0] == 0u) && (profile->earlier[1] == 0u);
    for (uint32_t k = 0; k < 2u; k++) {
        still = still && (profile->sums[k] == 0u);
    }
    return still;
}

/* Part of a profile: returns whether a stop within a distance is possible after a tick with this step. */
static inline bool edo_smc_profile_stops(const edo_smc_profile *profile, int64_t distance, int32_t step, int32_t whole)
{
    const int32_t twice = (2 * step) - (profile->acceleration * whole);
    return (((int64_t)whole + 1) * (int64_t)twice) <= (2 * distance);
}

/* Part of a profile: computes the next step of the base. Forward is towards the goal. */
static inline void edo_smc_profile_advance(edo_smc_profile *profile)
{
    const int64_t far = 2305843009213693952;
    const int64_t left = edo_smc_signed_long(profile->goal - profile->base);
    const bool back = left < 0;
    const int64_t apart = back ? edo_smc_signed_long(profile->base - profile->goal) : left;
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
        if (edo_smc_profile_stops(profile, distance, up, up_whole)) {
            next = up;
            whole = up_whole;
        } else if (whole == 0) {
            next = (acceleration < fastest) ? acceleration : fastest;
            next = ((int64_t)next < distance) ? next : (int32_t)distance;
            whole = 0;
            if (next == acceleration) {
                whole = 1;
            }
        } else if (within && edo_smc_profile_stops(profile, distance, step, whole)) {
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
static inline uint64_t edo_smc_profile_before(const edo_smc_profile *profile, uint32_t windows)
{
    const uint32_t length = 2u * profile->window;
    const uint32_t at = profile->oldest + ((2u - windows) * profile->window);
    return (uint64_t)(int64_t)profile->steps[(at < length) ? at : (at - length)];
}

/* Part of a profile: splits into the nearest whole number and the remainder in 2^-32. */
static inline void edo_smc_profile_split(uint64_t units, uint32_t *number)
{
    number[0] = (uint32_t)(units >> 32) + ((uint32_t)units >> 31);
    number[1] = (uint32_t)units;
}

/* Writes the target at the end of the next tick. Call it in the interrupt, once per tick. */
static inline void edo_smc_profile_next(edo_smc_profile *profile, edo_smc_target *target)
{
    uint32_t moved[2 * 2];
    uint32_t behind[2];
    uint32_t base[2];
    uint64_t sum;
    edo_smc_jet jet;
    edo_smc_profile_advance(profile);
    sum = ((uint64_t)(int64_t)profile->step - (2u * edo_smc_profile_before(profile, 1u))) + edo_smc_profile_before(profile, 2u);
    profile->steps[profile->oldest] = profile->step;
    profile->oldest = ((profile->oldest + 1u) < (2u * profile->window)) ? (profile->oldest + 1u) : 0u;
    sum += profile->sums[0];
    profile->sums[0] = sum;
    sum += profile->sums[1];
    profile->sums[1] = sum;
    profile->behind += ((uint64_t)(int64_t)profile->step * profile->all) - sum;
    edo_smc_profile_split(sum, &moved[0]);
    edo_smc_profile_split(profile->earlier[0], &moved[2]);
    edo_smc_profile_split(profile->behind, behind);
    edo_smc_profile_split(profile->base, base);
    edo_smc_jet_of_profile(moved, behind, base[1], profile->part_rad, 1000.0f, &jet);
    profile->earlier[1] = profile->earlier[0];
    profile->earlier[0] = sum;
    target->turn = edo_smc_signed(base[0]);
    target->r = jet.r;
    target->r_dot = jet.r_dot;
}

/* Returns whether the floating-point modes of this context are the assumed ones. Call it once at start-up in the
 * context of the tick: an interrupt of a Cortex-M starts with the modes of FPDSCR. Returns false if rounding is not to
 * nearest, subnormal numbers are flushed, or the compiler fuses, reorders or widens operations. No tick calls it. */
static inline bool edo_smc_modes_ok(void)
{
    EDO_SMC_AS_WRITTEN
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

#undef EDO_SMC_AS_WRITTEN
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
#endif
