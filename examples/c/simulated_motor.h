/* The motor or joint of motor.c in the emulator: rotor, spring and link, friction, cogging, current loop and encoders of
 * the exported data sheet. No data sheet lists friction and cogging, so their sizes are shares of the largest torque.
 * Include it once, after the exported file. It also compares the true angle with the plan and prints the result. */
#ifndef SIMULATED_MOTOR_H
#define SIMULATED_MOTOR_H

#include "board.h"
#include <math.h>

#define PEAK_N_M ((float)(EDO_SMC_TORQUE_N_M_PER_A * EDO_SMC_MAX_CURRENT_A))

/* The step of the integration does not depend on the control period: the cost is equal at every control rate. */
#define STEPS ((int)(EDO_SMC_PERIOD_S / 25e-6 + 0.5) > 0 ? (int)(EDO_SMC_PERIOD_S / 25e-6 + 0.5) : 1)

static const float coulomb = 0.01f * PEAK_N_M, at_rest = 0.016f * PEAK_N_M, stribeck = 0.1f; /* N m, N m, rad/s */
static const float cogging = 0.006f * PEAK_N_M, cogs = 7.0f;                                /* N m, per revolution */
static float angle, speed; /* of the controlled shaft: the motor, or the link of a joint */
static float flowing, commanded;
#ifdef EDO_SMC_STIFFNESS_N_M
static float motor_angle, motor_speed;
#define MOTOR_ANGLE motor_angle
#define MOTOR_SPEED motor_speed
#define MOTOR_INERTIA ((float)EDO_SMC_MOTOR_INERTIA_KG_M2)
#define MOTOR_DAMPING ((float)EDO_SMC_MOTOR_DAMPING_N_M_S)
#else
#define MOTOR_ANGLE angle
#define MOTOR_SPEED speed
#define MOTOR_INERTIA ((float)EDO_SMC_INERTIA_KG_M2)
#define MOTOR_DAMPING ((float)EDO_SMC_DAMPING_N_M_S)
#endif

/* Moves the motor by one control period. */
static void simulated_motor_advance(void) {
    const float step = (float)EDO_SMC_PERIOD_S / (float)STEPS;
    const float follows = (EDO_SMC_CURRENT_LAG_S > (double)step) ? step / (float)EDO_SMC_CURRENT_LAG_S : 1.0f;
    /* Friction passes through zero with a slope that this step can integrate. */
    const float steepest = 2.0f * step * at_rest / MOTOR_INERTIA;
    const float smooth = (steepest > 0.005f) ? steepest : 0.005f;
    for (int k = 0; k < STEPS; k++) {
        const float bell = MOTOR_SPEED / stribeck;
        const float friction = (coulomb + (at_rest - coulomb) * expf(-bell * bell)) * tanhf(MOTOR_SPEED / smooth);
        float torque = (float)EDO_SMC_TORQUE_N_M_PER_A * flowing - MOTOR_DAMPING * MOTOR_SPEED - friction -
                       cogging * sinf(cogs * MOTOR_ANGLE);
#ifdef EDO_SMC_STIFFNESS_N_M
        const float spring = (float)EDO_SMC_STIFFNESS_N_M * (motor_angle - angle);
        torque -= spring;
        speed += step / (float)EDO_SMC_LINK_INERTIA_KG_M2 *
                 (spring - (float)EDO_SMC_LINK_DAMPING_N_M_S * speed - (float)EDO_SMC_WEIGHT_N_M * sinf(angle));
#endif
        flowing += follows * (commanded - flowing);
        MOTOR_SPEED += step / MOTOR_INERTIA * torque;
        MOTOR_ANGLE += step * MOTOR_SPEED;
#ifdef EDO_SMC_STIFFNESS_N_M
        angle += step * speed;
#endif
    }
}

/* Returns the register of a counter at this angle; `states` 0 for 2^32. */
static uint32_t count_at(float at, double unit_rad, uint32_t states, bool is_reversed, int64_t offset) {
    const int64_t count = (int64_t)floorf(at / (float)unit_rad + 0.5f);
    const int64_t whole = (states != 0u) ? (int64_t)states : 4294967296LL;
    const int64_t rest = ((is_reversed ? -count : count) + offset) % whole;
    return (uint32_t)(rest < 0 ? rest + whole : rest);
}

#ifdef EDO_SMC_STIFFNESS_N_M
static uint32_t encoder_link(void) {
    return count_at(angle, EDO_SMC_ENCODER_LINK_UNIT_RAD, EDO_SMC_ENCODER_LINK_STATES, EDO_SMC_ENCODER_LINK_REVERSED,
                    EDO_SMC_ENCODER_LINK_OFFSET_COUNTS);
}
static uint32_t encoder_motor(void) {
    return count_at(motor_angle, EDO_SMC_ENCODER_MOTOR_UNIT_RAD, EDO_SMC_ENCODER_MOTOR_STATES,
                    EDO_SMC_ENCODER_MOTOR_REVERSED, EDO_SMC_ENCODER_MOTOR_OFFSET_COUNTS);
}
#else
static uint32_t encoder(void) {
    return count_at(angle, EDO_SMC_ENCODER_UNIT_RAD, EDO_SMC_ENCODER_STATES, EDO_SMC_ENCODER_REVERSED,
                    EDO_SMC_ENCODER_OFFSET_COUNTS);
}
#endif

static bool encoder_is_good(void) { return true; }

static float current(float ampere) {
    static float waiting[EDO_SMC_DELAY_TICKS + 1];
    for (int k = 0; k < EDO_SMC_DELAY_TICKS; k++) {
        waiting[k] = waiting[k + 1];
    }
    waiting[EDO_SMC_DELAY_TICKS] = ampere;
    commanded = waiting[0];
    return ampere;
}

/* Results: the largest error since tick `judged`, rad, and a line of values every 0.1 s. */
static volatile uint32_t judged;
static volatile float peak;
static volatile struct {
    uint32_t tick;
    float planned, angle, ampere;
} line;

static void simulated_motor_compare(uint32_t tick, const edo_smc_target *begin) {
    static float targets[EDO_SMC_DELAY_TICKS + 1];
    for (int k = 0; k < EDO_SMC_DELAY_TICKS; k++) {
        targets[k] = targets[k + 1];
    }
    targets[EDO_SMC_DELAY_TICKS] = begin->r + 6.2831853f * (float)begin->turn;
    /* The target at the beginning of this tick. */
    const float planned = targets[0];
    const float error = fabsf(angle - planned);
    if (tick >= judged && error > peak) {
        peak = error;
    }
    if (tick % (uint32_t)(0.1 / EDO_SMC_PERIOD_S + 0.5) == 0u) {
        line.tick = tick;
        line.planned = planned;
        line.angle = angle;
        line.ampere = commanded;
    }
}

/* Prints a new line of values, if there is one. */
static void simulated_motor_print_line(void) {
    static uint32_t printed;
    if (line.tick > printed) {
        printed = line.tick;
        board_row((float)printed * (float)EDO_SMC_PERIOD_S, line.planned, line.angle, line.ampere);
    }
}

/* The largest error counts from this tick. */
static void simulated_motor_judge(uint32_t next) {
    judged = next;
    peak = 0.0f;
}

/* Ends a line with the largest error since tick `judged`; the next one counts from `next`. */
static void simulated_motor_print_peak(const char *end, uint32_t next) {
    board_text(end);
    board_text(": peak error ");
    board_number(peak, 0, 6);
    board_text(" rad\n");
    simulated_motor_judge(next);
}

#endif
