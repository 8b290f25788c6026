/* Simulated motor of rtos_task.c, a CPU that is held once in motion, and the result. */
#ifndef HOST_MOTOR_H
#define HOST_MOTOR_H
#include <math.h>
#include <stdio.h>

#ifndef HELD_AT
#define HELD_AT ((TickType_t)(0.12 / EDO_SMC_PERIOD_S)) /* RTOS tick, in the first move */
#endif
#ifndef HELD_TICKS
#define HELD_TICKS 1u
#endif

static double angle_rad, speed_rad_s, held_a, worst_rad, last_rad;
static unsigned alarms;

static void host_advance(void)
{
    const double step = 1.0 / configTICK_RATE_HZ / 40.0;
    for (int k = 0; k < 40; k++) {
        speed_rad_s += step / EDO_SMC_INERTIA_KG_M2 *
                       (EDO_SMC_TORQUE_N_M_PER_A * held_a - EDO_SMC_DAMPING_N_M_S * speed_rad_s);
        angle_rad += step * speed_rad_s;
    }
}

static bool host_is_held(TickType_t now) { return now >= HELD_AT && now < HELD_AT + HELD_TICKS; }

static uint32_t encoder(void)
{
    return (uint32_t)(int64_t)floor(angle_rad / EDO_SMC_ENCODER_UNIT_RAD + 0.5) % EDO_SMC_ENCODER_STATES;
}

static float current(float ampere)
{
    held_a = (double)ampere;
    return ampere;
}

/* Keeps the largest distance of the true angle from the plan. */
static void host_motor_compare(unsigned health, bool has_started, const edo_smc_target *planned)
{
    if (has_started) {
        last_rad = angle_rad - (6.283185307179586 * planned->turn + (double)planned->r);
        worst_rad = (fabs(last_rad) > worst_rad) ? fabs(last_rad) : worst_rad;
        alarms |= health & ~((unsigned)EDO_SMC_SATURATED | EDO_SMC_HUNTS);
    }
}

/* Without a missed tick the error is about half a count. */
static int host_motor_result(void)
{
    const double most_rad = 2.6 * EDO_SMC_ENCODER_UNIT_RAD;
    printf("missed ticks: %u, largest error %.5f rad, error at the end %.5f rad, flags %04x\n", HELD_TICKS, worst_rad,
           last_rad, alarms);
    return (worst_rad < most_rad && fabs(last_rad) < most_rad) ? 0 : 1;
}
#endif
