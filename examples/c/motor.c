/* A position drive of your own motor in C: encoder count in, current out. Copy this file and replace every line marked
 * BOARD.
 *
 * The controller is one file, exported from the data sheet of the motor (docs/c.md, "Exported C99 file"):
 *
 *     timer interrupt, every EDO_SMC_PERIOD_S:   count -> tick along the plan -> current -> PWM
 *     main loop, in the remaining time:          plans: onto a sine, then to rest at half a radian
 *
 * It runs unchanged on a bare STM32F405 and in the emulator, with a simulated motor. The simulated motor has friction,
 * cogging and a current-loop lag, which no data sheet lists. At the end the program prints the largest difference
 * between the true angle and the plan.
 */
#include "board.h"
#include <math.h>
#include <stdbool.h>
#ifndef DRIVE
#define DRIVE "motor_drive.h"
#endif
#include DRIVE

#define RATE_HZ ((uint32_t)(1.0 / EDO_SMC_PERIOD_S + 0.5))
#define TICKS_OF(seconds) ((uint32_t)((seconds) / EDO_SMC_PERIOD_S + 0.5))
/* Time from the computation of a plan to its first tick, s. A plan takes some ten thousand cycles of software doubles,
 * in the main loop. */
#define LEAD_S 0.005
#define TWO_PI 6.283185307179586

static edo_smc_state state; /* all zeros is valid: the first valid count starts the drive */
static edo_smc_sample sample;
static volatile uint32_t tick; /* tick at which the next timer period begins */
static volatile bool started;
static volatile unsigned trouble; /* status flags of all ticks */

/* The main loop computes plans and the interrupt plays them: two plans, and the tick of the changeover. */
static edo_smc_plan plans[2];
static volatile unsigned playing;
static volatile bool ready;
static uint32_t changeover;

static void motor_goes_on(void);
static void compare_with_the_truth(void);
static uint32_t encoder(void);
static float current(float ampere);

void TIM3_IRQHandler(void) {
    edo_smc_output output;
    board_ticker_acknowledge();
    motor_goes_on();            /* BOARD: delete; the real motor moves by itself */
    sample.count = encoder();   /* BOARD: the raw counter register */
    sample.lost = false;        /* BOARD: true if an absolute encoder sent a bad frame */
    if (!state.started) {
        edo_smc_estimates_of known;
        if (!edo_smc_start(&state, &sample) || !edo_smc_estimates(&state, &known)) {
            return;
        }
        /* Hold the present position until the first plan. */
        (void)edo_smc_plan_rest(&plans[0], known.turn, known.position);
        edo_smc_plan_at(&plans[0], tick, &sample.end);
        started = true;
    }
    sample.begin = sample.end; /* a tick begins at the end of the previous tick */
    const uint32_t end = tick + EDO_SMC_DELAY_TICKS + 1u;
    if (ready && end == changeover) {
        playing ^= 1u;
        ready = false;
    }
    edo_smc_plan_play(&plans[playing], end, &sample.end);
    trouble |= edo_smc_tick(&state, &sample, &output);
    const float held = current(output.u);
    if (held < output.u || held > output.u) {
        (void)edo_smc_report_applied(&state, held); /* required: the only anti-windup */
    }
    compare_with_the_truth(); /* BOARD: delete */
    tick = tick + 1u;
}

/* Returns the free plan; `present` gets the trajectory point of the active plan at the changeover. */
static edo_smc_plan *next_plan(edo_smc_jet *present) {
    while (ready) {
        board_sleep(); /* the previous plan has not begun yet */
    }
    changeover = tick + 1u + TICKS_OF(LEAD_S);
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

/* BOARD: delete everything from here to the line below. Simulated motor, in steps of a fortieth of a tick. */
static const float coulomb = 0.005f, at_rest = 0.008f, stribeck = 0.1f, smooth = 0.005f; /* N m, N m, rad/s, rad/s */
static const float cogging = 0.003f, cogs = 7.0f;                                      /* N m, per revolution */
static const float lag = 2e-4f;                                                        /* current-loop lag, s */
static float angle, speed, flowing, commanded, late;

static void motor_goes_on(void) {
    const float step = (float)(EDO_SMC_PERIOD_S / 40.0);
    for (int k = 0; k < 40; k++) {
        const float bell = speed / stribeck;
        const float friction = (coulomb + (at_rest - coulomb) * expf(-bell * bell)) * tanhf(speed / smooth);
        const float torque = (float)EDO_SMC_TORQUE_N_M_PER_A * flowing - (float)EDO_SMC_DAMPING_N_M_S * speed -
                             friction - cogging * sinf(cogs * angle);
        flowing += step / lag * (commanded - flowing);
        speed += step / (float)EDO_SMC_INERTIA_KG_M2 * torque;
        angle += step * speed;
    }
}

static uint32_t encoder(void) {
    const int32_t count = (int32_t)floorf(angle / (float)EDO_SMC_ENCODER_UNIT_RAD + 0.5f);
    return (uint32_t)((EDO_SMC_ENCODER_REVERSED ? -count : count) + EDO_SMC_ENCODER_OFFSET_COUNTS);
}

static float current(float ampere) {
    commanded = EDO_SMC_DELAY_TICKS ? late : ampere;
    late = ampere;
    return ampere;
}

/* Results: the largest error since tick `judged`, rad, and a line of values every 0.1 s. */
static uint32_t judged;
static volatile float peak;
static volatile struct {
    uint32_t tick;
    float planned, angle, ampere;
} line;

static void compare_with_the_truth(void) {
    /* The planned target at the beginning of this tick. */
    static edo_smc_target last;
    const edo_smc_target now = EDO_SMC_DELAY_TICKS ? last : sample.begin;
    const float planned = now.r + (float)TWO_PI * (float)now.turn;
    last = sample.begin;
    const float error = fabsf(angle - planned);
    if (tick >= judged && error > peak) {
        peak = error;
    }
    if (tick % TICKS_OF(0.1) == 0u) {
        line.tick = tick;
        line.planned = planned;
        line.angle = angle;
        line.ampere = commanded;
    }
}
/* ------------------------------------------------------------------------------------------------------------------ */

/* Prints the lines while the drive runs, until this tick. */
static void report_until(uint32_t last) {
    static uint32_t told;
    while (tick < last) {
        board_sleep();
        if (line.tick > told) {
            told = line.tick;
            board_number((float)told * (float)EDO_SMC_PERIOD_S, 8, 1);
            board_number(line.planned, 12, 6);
            board_number(line.angle, 12, 6);
            board_number(line.angle - line.planned, 12, 6);
            board_number(line.ampere, 10, 3);
            board_text("\n");
        }
    }
}

int main(void) {
    board_text_start();
    board_ticker_start(RATE_HZ);
    while (!started) {
        board_sleep();
    }
    board_text("  time s  planned rad    true rad   error rad current A\n");
    onto_a_sine(1.0, 1.0, 0.24);
    judged = TICKS_OF(0.25);
    report_until(TICKS_OF(2.25));
    board_text("sine of 1 rad at 1 Hz, from 0.25 s on: peak error ");
    board_number(peak, 0, 6);
    board_text(" rad\n");
    judged = tick;
    peak = 0.0f;
    to_rest_at(0, 0.5f, 0.3);
    report_until(TICKS_OF(2.75));
    board_text("from there to rest at 0.5 rad in 0.3 s: peak error ");
    board_number(peak, 0, 6);
    board_text(" rad\nhealth ");
    board_hex(trouble);
    board_text("\ndone\n");
    board_end();
}
