/* The paper's law in C at 10 kHz, on a state that is measured as a whole: what its tick costs, and its bits.
 *
 * The timer's interrupt samples, ticks the controller and drives; the main loop reports. After 1000 ticks it sends the
 * bits of every u, which the project's tests hold against the Rust library's: not one differs. A drive behind encoders
 * is drive.c.
 */
#include "board.h"

#define TICK_HZ 10000u
#define TICKS 1000u

/* The controller, three times: from the archive with its design, as one file that needs nothing else, or as assembly
 * for this core, a file to link and its header. All were exported from paper.toml, with the same bits. A status of 0 is
 * good. */
#if defined STANDALONE || defined ASSEMBLY
#ifdef ASSEMBLY
#include "paper_assembly.h"
#else
#include "paper_standalone.h"
#endif

/* The controller's memory. */
static paper_state state;

static uint32_t controller_start(void) {
    return 0; /* zeros are right, and the first good sample starts it */
}

static uint32_t controller_tick(const float x[4], float *u) {
    paper_output output;
    const unsigned health = paper_tick_or_start(&state, x, &output);
    *u = output.u;
    return health & PAPER_INPUT_REJECTED;
}
#else
#include "edo_smc.h"
#include "paper_design.h"

/* The controller's memory. In the design: what it multiplies with, in flash. */
static edo_smc_state_n4_r2_c24_t state;

static uint32_t controller_start(void) {
    const edo_smc_status_t status =
        edo_smc_init_n4_r2_c24(&paper_design, sizeof paper_design, &state, sizeof state);
    return status == EDO_SMC_OK && edo_smc_version() != EDO_SMC_VERSION ? (uint32_t)EDO_SMC_WRONG_VERSION
                                                                        : (uint32_t)status;
}

static uint32_t controller_tick(const float x[4], float *u) {
    edo_smc_output_t output = {0}; /* what goes out if the call refuses: u = 0 */
    const edo_smc_status_t status = edo_smc_tick_n4_r2_c24(&paper_design, &state, x, &output);
    *u = output.u;
    return (uint32_t)status;
}
#endif

/* What the interrupt leaves for the main loop. */
static volatile uint32_t ticks;
static volatile uint32_t worst;
static float told[TICKS];

/* BOARD: a stand-in for the motor, so that the example runs on a bare board and in an emulator. At rest 0.1 rad off. */
static float motor[4] = {0.1f, 0.0f, 0.0f, 0.0f};
static float held;

static void motor_goes_on(void) {
    const float period = 0.0001f;
    /* In the unit of u: a(x)/b with its largest terms, the u that is held, and a load that nobody measures. */
    const float push = 75.63025f * motor[0] - 1.9327731f * motor[2] + held + 1.0f;
    motor[3] += period * (5001.6345f * push);
    motor[2] += period * motor[3];
    motor[1] += period * (motor[2] + 0.5f);
    motor[0] += period * motor[1];
}

void TIM3_IRQHandler(void) {
    board_ticker_acknowledge();
    if (ticks == TICKS) {
        return;
    }
    motor_goes_on();
    const float x[4] = {motor[0], motor[1], motor[2], motor[3]}; /* BOARD: read the encoders, in chain coordinates */
    float u;
    const uint32_t status = controller_tick(x, &u);
    held = u; /* BOARD: write the PWM; if it holds anything else, say so by the function report_applied */
    if (status != 0) {
        worst = status;
    }
    told[ticks] = u;
    ticks = ticks + 1;
}

int main(void) {
    board_text_start();
    const uint32_t status = controller_start();
    if (status != 0) {
        board_text("no controller: status ");
        board_hex(status);
        board_text("\nstopped\n");
        return 1;
    }
    board_ticker_start(TICK_HZ);
    while (ticks < TICKS) {
        board_sleep();
    }
    for (uint32_t i = 0; i < TICKS; i++) {
        board_text("u ");
        board_hex(board_bits(told[i]));
        board_text("\n");
    }
    board_text("status ");
    board_hex(worst);
    board_text("\ndone\n");
    for (;;) {
        board_sleep();
    }
}
