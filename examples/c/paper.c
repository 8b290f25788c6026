/* The paper's controller in C at 10 kHz, on a fully measured state.
 *
 * The timer interrupt samples, runs the controller and sets the output; the main loop reports. After 1000 ticks it
 * sends the bits of every u. The project's tests check that these bits equal the bits of the Rust library. For a drive
 * on encoder counts see drive.c.
 */
#include "board.h"

#define TICK_HZ 10000u
#define TICKS 1000u

/* The controller in three versions, all exported from paper.toml and bit-identical: a design for the static library,
 * one file that needs nothing else, or assembly for this core with its header. Status 0 is success. */
#if defined STANDALONE || defined ASSEMBLY
#ifdef ASSEMBLY
#include "paper_assembly.h"
#else
#include "paper_standalone.h"
#endif

/* State of the controller. */
static paper_state state;

static uint32_t controller_start(void) {
    return 0; /* all zeros is valid, and the first valid sample starts the controller */
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

/* State of the controller. The design holds the coefficients, in flash. */
static edo_smc_state_n4_r2_c24_t state;

static uint32_t controller_start(void) {
    const edo_smc_status_t status =
        edo_smc_init_n4_r2_c24(&paper_design, sizeof paper_design, &state, sizeof state);
    return status == EDO_SMC_OK && edo_smc_version() != EDO_SMC_VERSION ? (uint32_t)EDO_SMC_WRONG_VERSION
                                                                        : (uint32_t)status;
}

static uint32_t controller_tick(const float x[4], float *u) {
    edo_smc_output_t output = {0}; /* output if the call is rejected: u = 0 */
    const edo_smc_status_t status = edo_smc_tick_n4_r2_c24(&paper_design, &state, x, &output);
    *u = output.u;
    return (uint32_t)status;
}
#endif

/* Results of the interrupt for the main loop. */
static volatile uint32_t ticks;
static volatile uint32_t worst;
static float told[TICKS];

/* BOARD: delete. Simulated motor for a bare board or an emulator; it starts at rest, 0.1 rad off. */
static float motor[4] = {0.1f, 0.0f, 0.0f, 0.0f};
static float held;

static void motor_goes_on(void) {
    const float period = 0.0001f;
    /* In the unit of u: a(x)/b with its largest terms, the applied u, and an unmeasured load. */
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
    held = u; /* BOARD: write the PWM; if it applies another value, call the function report_applied */
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
