/* A position drive of your own motor or flexible joint in C: encoder counts in, current out.
 *
 * The controller is one file, exported from the data sheet (docs/c.md, "Exported C99 file"):
 *
 *     timer interrupt, every EDO_SMC_PERIOD_S:   count -> watched tick along the plan -> current -> PWM
 *     main loop, in the remaining time:          plans: onto a sine, then to rest; a restart after an alarm
 *
 * `make run-motor` runs it in the emulator with a simulated motor or joint and prints the largest difference between the
 * true angle and the plan. For a board fill in the functions marked BOARD and build with `make board`.
 */
#include "board.h"
#include <math.h>
#include <stdbool.h>
#ifndef DRIVE
#define DRIVE "motor_drive.h"
#endif
#include DRIVE
#ifndef EDO_SMC_TORQUE_N_M_PER_A
#error "motor.c drives a [motor] or a [joint], exported with the prefix edo_smc"
#endif

#ifdef EMULATED
#include "simulated_motor.h"
#else
/* An empty function must not make the interrupt shorter than the real one: the compiler does not look into it. */
#define BOARD_FUNCTION __attribute__((noipa)) static
/* BOARD: returns the raw counter register; a joint has two encoders. */
#ifdef EDO_SMC_STIFFNESS_N_M
BOARD_FUNCTION uint32_t encoder_link(void) { return 0u; }
BOARD_FUNCTION uint32_t encoder_motor(void) { return 0u; }
#else
BOARD_FUNCTION uint32_t encoder(void) { return 0u; }
#endif
/* BOARD: returns false if an absolute encoder sent a bad frame. */
BOARD_FUNCTION bool encoder_is_good(void) { return true; }
/* BOARD: commands the current loop or PWM; returns the current that the stage really holds, A. */
BOARD_FUNCTION float current(float ampere) { return ampere; }
/* BOARD: returns true while an operator asks for a restart. Never restart after an alarm unasked. */
BOARD_FUNCTION bool restart_is_wanted(void) { return false; }

/* With all [limits] and three ticks of delay the interrupt takes some 3700 cycles of a motor and 5900 of a joint,
   without the BOARD functions. */
#ifdef EDO_SMC_STIFFNESS_N_M
#define LEAST_CYCLES 6400.0
#else
#define LEAST_CYCLES 4000.0
#endif
extern void period_is_too_short(void)
    __attribute__((error("EDO_SMC_PERIOD_S is too short for CORE_HZ: set up the clock, then its frequency in board.h")));
#endif

/* The sine has 1 rad and a frequency of at most 1 Hz, at which it takes at most 30 % of the torque that is left. */
#ifdef EDO_SMC_STIFFNESS_N_M
#define INERTIA_KG_M2 (EDO_SMC_LINK_INERTIA_KG_M2 + EDO_SMC_MOTOR_INERTIA_KG_M2)
#define TORQUE_N_M (EDO_SMC_TORQUE_N_M_PER_A * EDO_SMC_MAX_CURRENT_A - EDO_SMC_WEIGHT_N_M)
#else
#define INERTIA_KG_M2 EDO_SMC_INERTIA_KG_M2
#define TORQUE_N_M (EDO_SMC_TORQUE_N_M_PER_A * EDO_SMC_MAX_CURRENT_A)
#endif
static double frequency_hz;

#define TICKS_OF(seconds) ((uint32_t)((seconds) / EDO_SMC_PERIOD_S + 0.5))
/* Time from the computation of a plan to its first tick, s. A plan takes some ten thousand cycles of software doubles,
 * in the main loop. */
#define LEAD_S 0.005
#define TWO_PI 6.283185307179586

static edo_smc_state state; /* all zeros is valid: the first valid counts start the drive */
static edo_smc_monitor monitor;
static edo_smc_sample sample;
static volatile uint32_t tick; /* tick at which the next timer period begins */
static volatile bool started;
static volatile unsigned trouble; /* status flags of all ticks since the start */

/* The main loop computes plans and the interrupt plays them: two plans, and the tick of the changeover. */
static edo_smc_plan plans[2];
static volatile unsigned playing;
static volatile bool ready;
static uint32_t changeover;

void TIM3_IRQHandler(void) {
    edo_smc_output output;
    edo_smc_estimates_of here;
    board_ticker_acknowledge();
#ifdef EMULATED
    simulated_motor_advance();
#endif
#ifdef EDO_SMC_STIFFNESS_N_M
    sample.count_link = encoder_link();
    sample.count_motor = encoder_motor();
    sample.lost_link = sample.lost_motor = !encoder_is_good();
#else
    sample.count = encoder();
    sample.lost = !encoder_is_good();
#endif
    sample.begin = sample.end; /* a tick begins at the end of the previous tick */
    const uint32_t end = tick + EDO_SMC_DELAY_TICKS + 1u;
    if (ready && (int32_t)(end - changeover) >= 0) {
        playing ^= 1u;
        ready = false;
    }
    edo_smc_plan_play(&plans[playing], end, &sample.end);
    const unsigned health = edo_smc_watched_tick(&monitor, &state, &sample, &output);
    if ((health & EDO_SMC_WAITS) != 0u && edo_smc_estimates(&state, &here)) {
        /* At a start, and after edo_smc_watched_reset: no current flows yet. Hold the present position. */
#ifdef EDO_SMC_STIFFNESS_N_M
        (void)edo_smc_plan_rest(&plans[playing], here.turn, here.position_link);
#else
        (void)edo_smc_plan_rest(&plans[playing], here.turn, here.position);
#endif
        edo_smc_plan_at(&plans[playing], end, &sample.end);
    } else if (state.started) {
        started = true;
        trouble |= health;
    }
    const float held = current(output.u);
    if (held < output.u || held > output.u) {
        (void)edo_smc_report_applied(&state, held); /* required: the only anti-windup */
    }
#ifdef EMULATED
    simulated_motor_compare(tick, &sample.begin);
#endif
    tick = tick + 1u;
    if (board_ticker_is_due()) {
        /* BOARD: if you cannot exclude it, count the overruns with a free timer and call edo_smc_missed. */
        board_stop("the interrupt takes longer than the control period");
    }
}

/* Returns the free plan; `present` gets the trajectory point of the active plan at the changeover. */
static edo_smc_plan *next_plan(edo_smc_jet *present) {
    while (ready) {
        board_sleep(); /* the previous plan has not begun yet */
    }
    changeover = tick + EDO_SMC_DELAY_TICKS + 2u + TICKS_OF(LEAD_S); /* the interrupt plans this far ahead */
    edo_smc_plan_jet(&plans[playing], changeover, present);
    return &plans[playing ^ 1u];
}

/* The plan is in memory before the interrupt sees the flag. */
static void hand_over(bool made) {
    __asm__ volatile("" ::: "memory");
    ready = made;
}

static void onto_a_sine(double amplitude_rad, double seconds) {
    edo_smc_jet present;
    edo_smc_plan *const plan = next_plan(&present);
    hand_over(
        edo_smc_plan_sine(plan, &present, changeover, TICKS_OF(seconds), amplitude_rad, TWO_PI * frequency_hz));
}

static void to_rest_at(int32_t turn, float angle_rad, double seconds) {
    edo_smc_jet present;
    edo_smc_plan *const plan = next_plan(&present);
    hand_over(edo_smc_plan_move(plan, &present, changeover, TICKS_OF(seconds), turn, angle_rad));
}

/* Signed angle between two registers of a counter with this many states, 0 for 2^32, rad: at most half a revolution. */
static float angle_between(uint32_t before, uint32_t now, uint32_t states, double unit_rad) {
    const uint32_t a = (states != 0u) ? before % states : before;
    const uint32_t b = (states != 0u) ? now % states : now;
    const uint32_t up = (b >= a) ? b - a : states - (a - b);
    const uint32_t down = states - up; /* the other way around */
    return ((up <= down) ? (float)up : -(float)down) * (float)unit_rad;
}

/* Returns whether the shaft turns by at most 0.5 rad/s. A stopped drive computes no estimates, so the counters are added
 * up tick by tick: two registers 50 ms apart would take one revolution in 50 ms for standstill. */
static bool stands_still(void) {
    const float most = 0.5f * (float)(TICKS_OF(0.05) * EDO_SMC_PERIOD_S);
    const uint32_t begin = tick;
    edo_smc_sample before = sample;
    float way[2] = {0.0f, 0.0f};
    while (tick - begin < TICKS_OF(0.05)) {
        board_sleep();
        const edo_smc_sample now = sample;
#ifdef EDO_SMC_STIFFNESS_N_M
        way[0] += angle_between(before.count_link, now.count_link, EDO_SMC_ENCODER_LINK_STATES,
                                EDO_SMC_ENCODER_LINK_UNIT_RAD);
        way[1] += angle_between(before.count_motor, now.count_motor, EDO_SMC_ENCODER_MOTOR_STATES,
                                EDO_SMC_ENCODER_MOTOR_UNIT_RAD);
#else
        way[0] += angle_between(before.count, now.count, EDO_SMC_ENCODER_STATES, EDO_SMC_ENCODER_UNIT_RAD);
#endif
        before = now;
    }
    return fabsf(way[0]) <= most && fabsf(way[1]) <= most;
}

/* Restarts a stopped drive where the shaft stands: after a reset only the angle within a turn is known. */
static void restart(void) {
    while ((trouble & EDO_SMC_STOPPED) == 0u || !stands_still()) {
        board_sleep(); /* it still brakes, or the shaft still turns */
    }
    __asm__ volatile("cpsid i" ::: "memory"); /* no control interrupt between these lines */
    edo_smc_watched_reset(&monitor, &state);
    ready = false; /* a plan from before the stop is void */
    trouble = 0u;
    started = false;
    __asm__ volatile("cpsie i" ::: "memory");
    while (!started) {
        board_sleep();
    }
}

static void wait_until(uint32_t last) {
    while (tick < last) {
        board_sleep();
#ifdef EMULATED
        simulated_motor_print_line();
#endif
    }
}

int main(void) {
#ifndef EMULATED
    if (EDO_SMC_PERIOD_S * (double)CORE_HZ < LEAST_CYCLES) {
        period_is_too_short(); /* the compiler stops here */
    }
#endif
    board_text_start();
    board_ticker_start((uint32_t)(1.0 / EDO_SMC_PERIOD_S + 0.5));
    while (!started) {
        board_sleep();
    }
    const double fastest_hz = sqrt(0.3 * TORQUE_N_M / INERTIA_KG_M2) / TWO_PI;
    frequency_hz = (fastest_hz < 1.0) ? fastest_hz : 1.0;
    const double second = 1.0 / frequency_hz; /* a period of the sine */
#ifdef EMULATED
    board_text("  time s  planned rad    true rad   error rad current A\n");
    judged = TICKS_OF(0.5 * second);
#endif
    onto_a_sine(1.0, 0.48 * second);
    wait_until(TICKS_OF(2.25 * second));
#ifdef EMULATED
    board_text("sine of 1 rad at ");
    board_number((float)frequency_hz, 0, 3);
    board_text(" Hz, from ");
    board_number((float)(0.5 * second), 0, 2);
    simulated_motor_print_peak(" s on", tick);
#endif
    to_rest_at(0, 0.5f, 0.3 * second);
    wait_until(TICKS_OF(2.75 * second));
#ifdef EMULATED
    board_text("from there to rest at 0.5 rad in ");
    board_number((float)(0.3 * second), 0, 2);
    simulated_motor_print_peak(" s", tick);
#endif
    board_text("status flags of all ticks: ");
    board_hex(trouble);
    if ((trouble & ~((unsigned)EDO_SMC_SATURATED | EDO_SMC_HUNTS)) != 0u) {
        board_text("\n");
        board_stop("an alarm: the exported file names the flags"); /* BOARD: or restart(), if an operator wants it */
    }
    board_text(", no alarm\n");
#ifdef EMULATED
    /* As after an alarm: the drive stops, and the main loop restarts it. */
    to_rest_at(0, 0.0f, 0.3 * second);
    wait_until(TICKS_OF(3.25 * second));
    __asm__ volatile("cpsid i" ::: "memory");
    edo_smc_watched_trip(&monitor);
    __asm__ volatile("cpsie i" ::: "memory");
    wait_until(tick + TICKS_OF(0.2));
    restart();
    simulated_motor_judge(tick);
    to_rest_at(0, 0.25f, 0.3 * second);
    wait_until(tick + TICKS_OF(0.5 * second));
    board_text("stopped and restarted, then to rest at 0.25 rad");
    simulated_motor_print_peak("", tick);
    board_text("done\n");
    board_end();
#else
    for (;;) { /* BOARD: your application plans its moves here */
        if ((trouble & EDO_SMC_STOPPED) != 0u && restart_is_wanted()) {
            restart();
        }
        board_sleep();
    }
#endif
}
