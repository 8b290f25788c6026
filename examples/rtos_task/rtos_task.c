/* A position drive in an RTOS: a control task with the period of the drive, and plans in a task of lower priority.
 *
 *     host-sim export mine.toml --lang c --standalone -o motor_drive.h
 *     cc -std=c99 -ffp-contract=off rtos_task.c -o rtos_task -lm && ./rtos_task      on this PC (Linux), simulated motor
 *
 * With -DFREERTOS it includes FreeRTOS. Fill in the functions marked BOARD, and give the drive a timer interrupt instead
 * of a task if the period is below some milliseconds: a task has the jitter of the RTOS tick. For Zephyr replace
 * vTaskDelayUntil by k_timer_status_sync, which returns the number of expired periods: more than 1 means missed ones. */
#ifndef DRIVE
#define DRIVE "motor_drive.h"
#endif
#include DRIVE
#ifdef FREERTOS
#include "FreeRTOS.h"
#include "task.h"
#else
#include "host.h" /* the same calls on this PC; an RTOS tick is one control period */
#endif

#ifdef FREERTOS
/* BOARD: returns the raw counter register. */
static uint32_t encoder(void) { return 0u; }
/* BOARD: commands the current loop; returns the current that the stage really holds, A. */
static float current(float ampere) { return ampere; }
#else
#include "host_motor.h"
#endif

/* RTOS ticks per control period. It must be a whole number, which main checks. */
#define ROUNDED ((TickType_t)(EDO_SMC_PERIOD_S * configTICK_RATE_HZ + 0.5))
#define PERIOD ((ROUNDED > 0u) ? ROUNDED : 1u)
#define TICKS_OF(seconds) ((uint32_t)((seconds) / EDO_SMC_PERIOD_S + 0.5))
#define LEAD_S 0.010 /* time to make a plan before its first tick */

static edo_smc_state state; /* zeros are valid */
static edo_smc_monitor monitor;
static edo_smc_plan plans[2]; /* the control task plays one, the plan task makes the other */
static volatile unsigned playing;
static volatile bool ready;
static uint32_t changeover; /* first tick of the other plan */
static volatile uint32_t tick;
static volatile bool started;

/* Changes over to the other plan at its first tick. */
static void change_over(uint32_t at)
{
    if (ready && (int32_t)(at - changeover) >= 0) {
        playing = playing ^ 1u;
        ready = false;
    }
}

static void control_task(void *unused)
{
    edo_smc_sample sample = {0};
    TickType_t due = xTaskGetTickCount();
    (void)unused;
    for (;;) {
        edo_smc_output output;
        edo_smc_estimates_of here;
        uint32_t late;
        vTaskDelayUntil(&due, PERIOD);
        /* Whole periods that passed since the tick was due: another task or interrupt held the CPU. */
        late = (uint32_t)((xTaskGetTickCount() - due) / PERIOD);
        if (late > 0u) {
            due += (TickType_t)late * PERIOD;
            tick = tick + late;
#ifndef WITHOUT_MISSED
            edo_smc_missed(&state, late);
#endif
            change_over(tick + EDO_SMC_DELAY_TICKS);
            edo_smc_plan_at(&plans[playing], tick + EDO_SMC_DELAY_TICKS, &sample.end);
        }
        const uint32_t end = tick + EDO_SMC_DELAY_TICKS + 1u;
        sample.count = encoder();
        sample.begin = sample.end;
        change_over(end);
        edo_smc_plan_play(&plans[playing], end, &sample.end);
        const unsigned health = edo_smc_watched_tick(&monitor, &state, &sample, &output);
        if ((health & EDO_SMC_WAITS) != 0u && edo_smc_estimates(&state, &here)) {
            (void)edo_smc_plan_rest(&plans[playing], here.turn, here.position); /* hold the present position */
            edo_smc_plan_at(&plans[playing], end, &sample.end);
        }
        started = state.started && ((health & EDO_SMC_WAITS) == 0u);
        const float held = current(output.u);
        if (held < output.u || held > output.u) {
            (void)edo_smc_report_applied(&state, held); /* the only anti-windup */
        }
        tick = tick + 1u;
#ifndef FREERTOS
        host_motor_compare(health, started, &sample.begin);
#endif
    }
}

/* Moves to rest at an angle, from the plan in motion. */
static void move_to(float angle_rad, double seconds)
{
    edo_smc_jet present;
    bool made;
    do {
        while (ready || !started) {
            vTaskDelay(1);
        }
        changeover = tick + EDO_SMC_DELAY_TICKS + 2u + TICKS_OF(LEAD_S);
        edo_smc_plan_jet(&plans[playing], changeover, &present);
        made = edo_smc_plan_move(&plans[playing ^ 1u], &present, changeover, TICKS_OF(seconds), 0, angle_rad);
        /* Again if other tasks held this one until after its first tick. */
    } while (made && (int32_t)(changeover - (tick + EDO_SMC_DELAY_TICKS + 1u)) <= 0);
    __atomic_thread_fence(__ATOMIC_SEQ_CST); /* the plan is in memory before the control task sees the flag */
    ready = made;
}

static void plan_task(void *unused)
{
    (void)unused;
    for (;;) {
        move_to(3.0f, 0.2);
        vTaskDelay((TickType_t)(0.4 * configTICK_RATE_HZ));
        move_to(0.0f, 0.2);
        vTaskDelay((TickType_t)(0.4 * configTICK_RATE_HZ));
    }
}

int main(void)
{
    const double ratio = (double)PERIOD / (EDO_SMC_PERIOD_S * configTICK_RATE_HZ);
    if (!(ratio > 0.999 && ratio < 1.001)) {
        return 2; /* the control period must be a whole number of RTOS ticks */
    }
    (void)xTaskCreate(control_task, "control", 512, NULL, 3, NULL);
    (void)xTaskCreate(plan_task, "plan", 512, NULL, 1, NULL);
    vTaskStartScheduler();
#ifndef FREERTOS
    return host_motor_result();
#else
    return 1;
#endif
}
