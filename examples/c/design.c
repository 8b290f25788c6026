/* A design computed on the target, for gains that are available only there. It is bit-identical to the host design. */
#include "board.h"
#include "edo_smc.h"
#include "paper_design.h"

/* Gradient of a(x), and b. */
#define JOINT_GRADIENT 378274.87974594877, 0.0, -9667.02470461869, -75.18796992481204
#define JOINT_INPUT_GAIN 5001.6345210853215

/* The controller of paper.c: all three roots of the surface at -10, both poles of each observer at -100. */
static const edo_smc_config_n4_r2_c24_t config = {
    .period_s = 1e-4,
    .c = {1000.0, 300.0, 30.0, 1.0},
    .alpha_per_s = 10.0,
    .gains = {{200.0, 10000.0}, {200.0, 10000.0}},
    .k_l = 50.0,
    .k_s = 0.0,
    .epsilon = 0.01,
    .gradient = {JOINT_GRADIENT},
    .input_gain = JOINT_INPUT_GAIN,
    .u_min = -30.0,
    .u_max = 30.0,
    .safe_u = 0.0,
    .sigma_star_bound = 10.0,
    .observer_pole_limit = 1.0,
    .order = {2, 2},
    .fallback = EDO_SMC_SAFE_U,
};

static edo_smc_design_n4_r2_c24_t design;

int main(void) {
    uint32_t channel = 0;
    board_text_start();
    const edo_smc_status_t status =
        edo_smc_design_n4_r2_c24(&config, sizeof config, &design, sizeof design, &channel);
    board_text("status ");
    board_hex((uint32_t)status);
    board_text(" channel ");
    board_hex(channel);
    board_text("\n");
    const uint32_t *words = (const uint32_t *)&design;
    const uint32_t *expected = (const uint32_t *)&paper_design;
    uint32_t differ = 0;
    for (uint32_t i = 0; i < sizeof design / 4; i++) {
        differ += words[i] != expected[i];
        board_text("word ");
        board_hex(words[i]);
        board_text("\n");
    }
    board_text("differ ");
    board_hex(differ);
    board_text("\ndone\n");
    for (;;) {
        board_sleep();
    }
}
