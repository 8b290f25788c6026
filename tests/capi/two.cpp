// C++ part of a program with a controller of order 2 here and a controller of order 4 in Rust, two.rs.
#include <cstdio>
#include <cstring>

#include "edo_smc.h"

static edo_smc_design_n2_r2_c12_t design2;
static edo_smc_state_n2_r2_c12_t state2;
static edo_smc_design_n4_r2_c24_t design4;

template <class Config> static void fill(Config &config, const double *c, int n) {
    std::memset(&config, 0, sizeof config);
    config.period_s = 1e-3;
    for (int i = 0; i < n; i++) {
        config.c[i] = c[i];
        config.gradient[i] = -(i + 1.0);
        config.d_hat[i] = 0.25 * (i + 1.0);
    }
    config.alpha_per_s = 2.0;
    for (int s = 0; s < 2; s++) {
        config.gains[s][0] = 100.0;
        config.gains[s][1] = 2500.0;
        config.order[s] = 2;
    }
    config.k_l = 50.0;
    config.k_s = 0.5;
    config.epsilon = 0.01;
    config.input_gain = 20.0;
    config.u_min = -300.0;
    config.u_max = 250.0;
    config.sigma_star_bound = 1.0;
    config.observer_pole_limit = 1.0;
}

extern "C" const void *cpp_start() {
    static const double c2[] = {5.0, 1.0}, c4[] = {125.0, 75.0, 15.0, 1.0};
    edo_smc_config_n2_r2_c12_t config2;
    edo_smc_config_n4_r2_c24_t config4;
    fill(config2, c2, 2);
    fill(config4, c4, 4);
    const bool good =
        edo_smc_design_n2_r2_c12(&config2, sizeof config2, &design2, sizeof design2, 0) == EDO_SMC_OK &&
        edo_smc_design_n4_r2_c24(&config4, sizeof config4, &design4, sizeof design4, 0) == EDO_SMC_OK &&
        edo_smc_init_n2_r2_c12(&design2, sizeof design2, &state2, sizeof state2) == EDO_SMC_OK;
    return good ? &design4 : 0;
}

extern "C" float cpp_tick(const float *x) {
    edo_smc_output_t output = {0, 0, 0, 0};
    const edo_smc_status_t status = edo_smc_tick_n2_r2_c12(&design2, &state2, x, &output);
    if (status != EDO_SMC_OK) {
        std::printf("status %d\n", static_cast<int>(status));
    }
    return output.u;
}
