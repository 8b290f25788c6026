/* A drive of a flexible joint in C at 4 kHz: counts of two encoders in, current out. Copy this file and replace every
 * line marked BOARD.
 *
 *     timer interrupt:  counts -> tick along the plan, with monitors -> current -> PWM
 *     EXTI0:            the longer ticks: the first one, and one that switches to another design
 *     main loop:        plans moves, designs, reports
 *
 * It runs unchanged on a bare STM32F405 and in the emulator, with a simulated joint. The drive's model has neither the
 * load nor the friction of the simulated joint. The program moves, retunes and gets a new goal in flight. Then the link
 * encoder fails, and the monitors stop the drive. The project's tests check the last lines of the output.
 */
#include "board.h"
#include <stdbool.h>

#define RATE_HZ 4000u
#define PERIOD_S (1.0 / RATE_HZ)
#define TICKS_OF(seconds) ((uint32_t)((seconds) / PERIOD_S + 0.5))
#define LAST TICKS_OF(3.4)

/* The drive in two versions. The static library designs the drive here from its data sheet. The single file is exported
 * from drive.toml and needs nothing else. Both are bit-identical. Status 0 is success. */
#ifdef STANDALONE
#include "drive_standalone.h"

static drive_state state; /* all zeros is valid: the first valid counts start the drive */
static drive_monitor monitor;
static drive_sample sample;
static drive_plan plans[2];

static uint32_t drive_prepare(void) {
    return 0;
}

/* The single design is constant, and a start is short. */
#define drive_takes_longer(end) false
#define drive_tune(surface_rad_s, start) ((void)0)

static unsigned drive_step(uint32_t link, uint32_t motor, drive_plan *plan, uint32_t end, bool longer, float *u) {
    drive_output output;
    (void)longer;
    sample.count_link = link;
    sample.count_motor = motor;
    sample.begin = sample.end; /* a tick begins at the end of the previous tick */
    drive_plan_play(plan, end, &sample.end);
    const unsigned health = drive_watched_tick(&monitor, &state, &sample, &output);
    *u = output.u;
    return health;
}

static bool plan_move(drive_plan *plan, const drive_plan *from, uint32_t start, uint32_t ticks, float angle) {
    drive_jet present;
    drive_plan_jet(from, start, &present);
    return drive_plan_move(plan, &present, start, ticks, 0, angle);
}

#define STOPPED DRIVE_STOPPED
#else
#include "edo_smc.h"

static edo_smc_config_joint_t config = {
    .period_s = PERIOD_S,
    .joint = {.link_inertia_kg_m2 = 0.23,
              .link_damping_n_m_s = 0.07,
              .weight_n_m = 0.23,
              .stiffness_n_m = 9.0,
              .motor_inertia_kg_m2 = 931e-6,
              .motor_damping_n_m_s = 0.07,
              .torque_n_m_per_a = 0.119},
    .encoders = {{.bits = 20, .counts_per_turn = 1048576, .gear_num = 1, .gear_den = 1},
                 {.bits = 20, .counts_per_turn = 1048576, .gear_num = 1, .gear_den = 1}},
    .limits = {.min = -30.0, .max = 30.0},
    .load_n_m = 1.3,
};
static edo_smc_design_joint_fast_t designs[2];
static edo_smc_state_joint_fast_t state;
static edo_smc_sample_joint_t sample;
static edo_smc_plan_joint_t plans[2]; /* zeros: rest at angle 0 */
static const edo_smc_design_joint_fast_t *design = &designs[0];
static volatile uint32_t tuned_at; /* tick at whose end the other design, once complete, becomes active */
static volatile bool waits = true; /* true until the first valid counts */

static uint32_t drive_prepare(void) {
    edo_smc_status_t status = edo_smc_by_rule_joint_fast(&config, sizeof config);
    config.hold = 0.0; /* safe output: 0 A */
    if (status == EDO_SMC_OK) {
        status = edo_smc_design_joint_fast(&config, sizeof config, &designs[0], sizeof designs[0], NULL);
    }
    if (status == EDO_SMC_OK) {
        status = edo_smc_init_joint_fast(design, sizeof *design, &state, sizeof state);
    }
    return (uint32_t)status;
}

/* Changes the surface bandwidth and, in proportion, all others, from the tick that ends at `start`. A design takes a
 * million cycles, here in the main loop. If a design is rejected, the active one stays. */
static void drive_tune(double surface_rad_s, uint32_t start) {
    edo_smc_design_joint_fast_t *const other = design == &designs[0] ? &designs[1] : &designs[0];
    (void)edo_smc_tune_joint_fast(&config, sizeof config, surface_rad_s);
    if (edo_smc_design_joint_fast(&config, sizeof config, other, sizeof *other, NULL) == EDO_SMC_OK) {
        __asm__ volatile("" ::: "memory"); /* the design is in memory before the interrupt sees it */
        tuned_at = start;
    }
}

/* The WCET bound of a normal tick covers neither a start nor a change of the design: EXTI0 runs them. */
static bool drive_takes_longer(uint32_t end) {
    return waits || end == tuned_at;
}

static inline __attribute__((always_inline)) unsigned drive_step(uint32_t link, uint32_t motor,
                                                                edo_smc_plan_joint_t *plan, uint32_t end,
                                                                bool longer, float *u) {
    edo_smc_output_t output = {0}; /* output if a call is rejected: 0 A */
    sample.link = link;
    sample.motor = motor;
    sample.begin = sample.end; /* a tick begins at the end of the previous tick */
    (void)edo_smc_plan_play_joint(plan, end, &sample.end);
    if (longer) {
        const edo_smc_design_joint_fast_t *const other = design == &designs[0] ? &designs[1] : &designs[0];
        if (end == tuned_at && edo_smc_retune_joint_fast(design, other, sizeof *other, &state, &sample) == EDO_SMC_OK) {
            design = other; /* bumpless: u does not jump */
        }
        waits = edo_smc_tick_joint_fast(design, &state, &sample, &output) != EDO_SMC_OK;
    } else {
        waits = edo_smc_go_on_joint_fast(design, &state, &sample, &output) == EDO_SMC_NOT_STARTED;
    }
    *u = output.u;
    return output.health;
}

static bool plan_move(edo_smc_plan_joint_t *plan, const edo_smc_plan_joint_t *from, uint32_t start, uint32_t ticks,
                      float angle) {
    return edo_smc_plan_move_joint(plan, from, start, ticks, PERIOD_S, 0, angle) == EDO_SMC_OK;
}

#define STOPPED EDO_SMC_STOPPED
#endif

/* Shared by interrupt and main loop. */
static volatile uint32_t tick; /* tick at which the next period begins */
static volatile unsigned playing;
static volatile bool ready;
static uint32_t changeover;
static volatile unsigned health_seen;
static volatile uint32_t stopped_at;

/* Shared by interrupt and simulated joint: in place of the encoders and the power stage of a board. */
static uint32_t counts[2];
static float current;
static void remember(float u);

/* Inlined once per interrupt, so that neither contains the code of the other. */
static inline __attribute__((always_inline)) void period(bool longer) {
    float u;
    const uint32_t end = tick + 1u;
    if (ready && end == changeover) {
        playing ^= 1u;
        ready = false;
    }
    /* BOARD: both raw counter registers. Mark a missing count with the sample's `lost` field. The simulated joint starts
     * at angle 0. At another angle put the plan to the estimates while EDO_SMC_WAITS is reported, as motor.c does. */
    const unsigned health = drive_step(counts[0], counts[1], &plans[playing], end, longer, &u);
    current = u; /* BOARD: PWM or current loop; if it applies another current, call report_applied */
    health_seen |= health;
    if ((health & STOPPED) != 0u && stopped_at == 0u) {
        stopped_at = tick;
    }
    remember(u); /* BOARD: delete this line and the next: the real joint moves by itself */
    board_pend();
    tick = end;
}

void TIM3_IRQHandler(void) {
    board_ticker_acknowledge();
    if (drive_takes_longer(tick + 1u)) {
        board_pend_longer();
    } else {
        period(false);
    }
}

/* Runs as soon as TIM3_IRQHandler returns; neither interrupts the other. */
void EXTI0_IRQHandler(void) { period(true); }

/* Plans a move from the active plan's position at tick `start`. Call it some ticks ahead: a plan takes ten thousand
 * cycles or more of software double. */
static void move_to(float angle, uint32_t start, uint32_t ticks) {
    while (ready) {
        board_sleep(); /* the previous plan has not begun yet */
    }
    const bool made = plan_move(&plans[playing ^ 1u], &plans[playing], start, ticks, angle);
    changeover = start;
    __asm__ volatile("" ::: "memory"); /* the plan is in memory before the interrupt sees the flag */
    ready = made;
}

/* BOARD: delete everything from here to the line below. Simulated joint, advanced after the control interrupt. */
#define BROKEN_S 3.15
static float angle[2], speed[2]; /* link, motor; rad and rad/s */
static uint32_t advanced;

void PendSV_Handler(void) {
    const float t = (float)PERIOD_S, x = angle[0], xx = x * x;
    const float sine = x * (1.0f - xx * (1.0f / 6.0f - xx * (1.0f / 120.0f - xx * (1.0f / 5040.0f))));
    const float torsion = 9.0f * (angle[1] - x);
    const float load = advanced / RATE_HZ % 2u == 1u ? 0.3f : 0.0f; /* N m, a second on, a second off */
    const float steep = 100.0f * speed[1];
    const float friction = 0.05f * (steep > 1.0f ? 1.0f : steep < -1.0f ? -1.0f : steep);
    speed[0] += t * ((torsion - 0.07f * speed[0] - 0.23f * sine - load) / 0.23f);
    speed[1] += t * ((0.119f * current - torsion - 0.07f * speed[1] - friction) / 931e-6f);
    for (int i = 0; i < 2; i++) {
        angle[i] += t * speed[i];
        if (i == 1 || advanced < TICKS_OF(BROKEN_S)) {
            counts[i] = (uint32_t)(int32_t)(angle[i] * 166886.05f);
        }
    }
    advanced = advanced + 1u;
}

/* Results: a checksum over the bits of every current until the last tick, and a line of values every 0.1 s. */
static uint32_t sum = 0x811c9dc5u;
static volatile struct {
    uint32_t tick;
    float planned, angle, ampere;
} line;

static void remember(float u) {
    if (tick >= LAST) {
        return;
    }
    sum = (sum ^ board_bits(u)) * 0x01000193u;
    if (tick % TICKS_OF(0.1) == 0u) {
        line.tick = tick;
        line.planned = sample.begin.r;
        line.angle = angle[0];
        line.ampere = u;
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
            board_row((float)told * (float)PERIOD_S, line.planned, line.angle, line.ampere);
        }
    }
}

int main(void) {
    board_text_start();
    const uint32_t status = drive_prepare();
    if (status != 0) {
        board_text("no drive: status ");
        board_hex(status);
        board_text("\nstopped\n");
        return 1;
    }
    board_ticker_start(RATE_HZ);
    board_text("  time s  planned rad    true rad   error rad current A\n");
    move_to(1.0f, TICKS_OF(0.1), TICKS_OF(1.0));
    report_until(TICKS_OF(1.22));
    drive_tune(16.0, TICKS_OF(1.45)); /* at rest; a retune in motion works as well */
    report_until(TICKS_OF(1.5));
    move_to(-0.5f, TICKS_OF(1.6), TICKS_OF(1.4));
    report_until(TICKS_OF(2.3));
    move_to(0.5f, TICKS_OF(2.4), TICKS_OF(1.6)); /* in flight */
    report_until(LAST);
    board_text("stopped at tick ");
    board_number((float)stopped_at, 0, 0);
    board_text("\nhealth ");
    board_hex(health_seen);
    board_text("\nsum ");
    board_hex(sum);
    board_text("\ndone\n");
    for (;;) {
        board_sleep();
    }
}
