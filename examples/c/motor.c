/* A position drive of your own motor in C: encoder count in, current out.
 *
 * The controller is one file, exported from the data sheet of the motor (docs/c.md, "Exported C99 file"):
 *
 *     timer interrupt, every EDO_SMC_PERIOD_S:   count -> watched tick along the plan -> current -> PWM
 *     main loop, in the remaining time:          plans: onto a sine, then to rest at half a radian
 *
 * `make run-motor` runs it in the emulator with a simulated motor and prints the largest difference between the true
 * angle and the plan. For a board fill in the three functions marked BOARD and build with `make board`.
 */
#include "board.h"
#include <stdbool.h>
#ifndef DRIVE
#define DRIVE "motor_drive.h"
#endif
#include DRIVE
#ifndef EDO_SMC_INERTIA_KG_M2
#error "motor.c drives a [motor] with the prefix edo_smc; a joint is in drive.c"
#endif

#ifdef EMULATED
#include "simulated_motor.h"
#else
/* BOARD: returns the raw counter register. */
static uint32_t encoder(void) { return 0u; }
/* BOARD: returns false if an absolute encoder sent a bad frame. */
static bool encoder_is_good(void) { return true; }
/* BOARD: commands the current loop or PWM; returns the current that the stage really holds, A. */
static float current(float ampere) { return ampere; }
#endif

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
    sample.count = encoder();
    sample.lost = !encoder_is_good();
    sample.begin = sample.end; /* a tick begins at the end of the previous tick */
    const uint32_t end = tick + EDO_SMC_DELAY_TICKS + 1u;
    if (ready && end == changeover) {
        playing ^= 1u;
        ready = false;
    }
    edo_smc_plan_play(&plans[playing], end, &sample.end);
    const unsigned health = edo_smc_watched_tick(&monitor, &state, &sample, &output);
    if ((health & EDO_SMC_WAITS) != 0u && edo_smc_estimates(&state, &here)) {
        /* At a start, and after edo_smc_watched_reset: no current flows yet. Hold the present position. */
        (void)edo_smc_plan_rest(&plans[playing], here.turn, here.position);
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

static void onto_a_sine(double amplitude_rad, double frequency_hz, double seconds) {
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

static void wait_until(uint32_t last) {
    while (tick < last) {
        board_sleep();
#ifdef EMULATED
        simulated_motor_print_line();
#endif
    }
}

int main(void) {
    board_text_start();
    board_ticker_start((uint32_t)(1.0 / EDO_SMC_PERIOD_S + 0.5));
    while (!started) {
        board_sleep();
    }
#ifdef EMULATED
    board_text("  time s  planned rad    true rad   error rad current A\n");
    judged = TICKS_OF(0.25);
#endif
    onto_a_sine(1.0, 1.0, 0.23);
    wait_until(TICKS_OF(2.25));
#ifdef EMULATED
    simulated_motor_print_peak("sine of 1 rad at 1 Hz, from 0.25 s on", tick);
#endif
    to_rest_at(0, 0.5f, 0.3);
    wait_until(TICKS_OF(2.75));
#ifdef EMULATED
    simulated_motor_print_peak("from there to rest at 0.5 rad in 0.3 s", tick);
#endif
    board_text("status flags of all ticks: ");
    board_hex(trouble);
    board_text((trouble & ~((unsigned)EDO_SMC_SATURATED | EDO_SMC_HUNTS)) == 0u ? ", no alarm" : ", see the exported file");
    board_text("\ndone\n");
    board_end();
}
