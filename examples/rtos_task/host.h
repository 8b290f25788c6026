/* The calls of FreeRTOS that rtos_task.c uses, on this PC: tasks are contexts, time is simulated. Every RTOS tick moves the
 * motor. In the ticks of `host_is_held` no task runs, as if an interrupt held the CPU. */
#ifndef HOST_H
#define HOST_H
#ifndef _XOPEN_SOURCE
#define _XOPEN_SOURCE 700
#endif
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <ucontext.h>

#define configTICK_RATE_HZ ((unsigned)(1.0 / EDO_SMC_PERIOD_S + 0.5))
typedef uint32_t TickType_t;
typedef void (*TaskFunction_t)(void *);

static void host_advance(void);              /* the motor, by one RTOS tick */
static bool host_is_held(TickType_t now);

static struct host_task {
    ucontext_t context;
    unsigned priority;
    TickType_t wakes;
    char stack[65536];
} host_tasks[2];
static unsigned host_count, host_running;
static ucontext_t host_scheduler;
static TickType_t host_now;

static TickType_t xTaskGetTickCount(void) { return host_now; }

static int xTaskCreate(TaskFunction_t run, const char *name, unsigned words, void *with, unsigned priority, void *handle)
{
    struct host_task *const task = &host_tasks[host_count++];
    (void)name, (void)words, (void)with, (void)handle;
    (void)getcontext(&task->context);
    task->context.uc_stack.ss_sp = task->stack;
    task->context.uc_stack.ss_size = sizeof task->stack;
    task->priority = priority;
    makecontext(&task->context, (void (*)(void))run, 1, NULL);
    return 1;
}

static void host_sleep_until(TickType_t wakes)
{
    host_tasks[host_running].wakes = wakes;
    (void)swapcontext(&host_tasks[host_running].context, &host_scheduler);
}

static void vTaskDelay(TickType_t ticks) { host_sleep_until(host_now + ticks); }

static void vTaskDelayUntil(TickType_t *last, TickType_t period)
{
    *last += period;
    if ((int32_t)(*last - host_now) > 0) {
        host_sleep_until(*last);
    }
}

/* Runs for 2 s; in every tick the task of highest priority first. */
static void vTaskStartScheduler(void)
{
    for (host_now = 0; host_now < 2u * configTICK_RATE_HZ; host_now++) {
        for (unsigned priority = 8; !host_is_held(host_now) && priority-- > 0;) {
            for (host_running = 0; host_running < host_count; host_running++) {
                struct host_task *const task = &host_tasks[host_running];
                if (task->priority == priority && (int32_t)(task->wakes - host_now) <= 0) {
                    (void)swapcontext(&host_scheduler, &task->context);
                }
            }
        }
        host_advance();
    }
}
#endif
