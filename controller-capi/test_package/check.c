/* A motor designed by the library moves a simulated rotor to rest at 0.5 rad. The status is 0 if it arrives. */
#include "edo_smc.h"
#include <stdio.h>
#ifdef EXPORTED
#include "motor_drive.h"
#endif

static edo_smc_config_motor_t config = {
    .period_s = 1e-3,
    .motor = {.inertia_kg_m2 = 2e-4, .torque_n_m_per_a = 0.05, .damping_n_m_s = 1e-5},
    .encoder = {.bits = 14, .counts_per_turn = 16384, .gear_num = 1, .gear_den = 1},
    .limits = {.min = -10.0, .max = 10.0},
    .lag_s = 2e-4,
};
static edo_smc_design_motor_fast_t design;
static edo_smc_state_motor_fast_t state;
static edo_smc_plan_motor_t plan;
static edo_smc_sample_motor_t sample;

int main(void)
{
    const double counts_per_rad = 16384.0 / 6.283185307179586;
    double angle = 0.0;
    double speed = 0.0;
    edo_smc_refusal_t refusal;
    if (edo_smc_version() != EDO_SMC_VERSION || edo_smc_modes_ok() != 1) {
        return 1;
    }
    if (edo_smc_by_rule_motor_fast(&config, sizeof config) != EDO_SMC_OK ||
        edo_smc_design_motor_fast(&config, sizeof config, &design, sizeof design, &refusal) != EDO_SMC_OK ||
        edo_smc_init_motor_fast(&design, sizeof design, &state, sizeof state) != EDO_SMC_OK) {
        return 2;
    }
    for (uint32_t tick = 0; tick < 600u; tick++) {
        edo_smc_output_t output = {0};
        if (tick == 100u) {
            static edo_smc_plan_motor_t move;
            if (edo_smc_plan_move_motor(&move, &plan, tick + 1u, 300u, 1e-3, 0, 0.5f) != EDO_SMC_OK) {
                return 3;
            }
            plan = move;
        }
        sample.count = (uint32_t)(int32_t)(angle * counts_per_rad + (angle < 0.0 ? -0.5 : 0.5));
        sample.begin = sample.end;
        (void)edo_smc_plan_play_motor(&plan, tick + 1u, &sample.end);
        (void)edo_smc_tick_motor_fast(&design, &state, &sample, &output);
        for (int k = 0; k < 50; k++) {
            speed += 2e-5 / 2e-4 * (0.05 * (double)output.u - 1e-5 * speed);
            angle += 2e-5 * speed;
        }
    }
    printf("edo_smc %06x: %.4f rad at the end of a move to 0.5 rad\n", (unsigned)edo_smc_version(), angle);
#ifdef EXPORTED
    printf("exported drive %08x\n", (unsigned)EXPORTED_DESIGN);
    if (!exported_modes_ok()) {
        return 5;
    }
#endif
    return (angle > 0.499 && angle < 0.501) ? 0 : 4;
}
