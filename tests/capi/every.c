/* Runs every instance on equal samples, some of them invalid, and prints one line of bits per tick for Rust. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "edo_smc.h"

static uint32_t bits(float value) {
    uint32_t word;
    memcpy(&word, &value, sizeof word);
    return word;
}

static uint32_t seed;

static float noise(void) {
    seed = seed * 1664525u + 1013904223u;
    return (float)(seed >> 8) / 16777216.0f - 0.5f;
}

static float entry(int tick, int i) {
    static const float sizes[4] = {0.01f, 0.1f, 1.0f, 10.0f};
    const float value = sizes[i] * noise();
    if (tick % 17 == 0 && i == 1) {
        return NAN;
    }
    if (tick % 23 == 5 && i == 0) {
        return -INFINITY;
    }
    return tick % 29 == 7 ? 1e30f : value;
}

static const double surfaces[5][4] = {{0}, {0}, {5.0, 1.0}, {25.0, 10.0, 1.0}, {125.0, 75.0, 15.0, 1.0}};
static const double gains[4][3] = {{0}, {50.0}, {100.0, 2500.0}, {150.0, 7500.0, 125000.0}};

#define RUN(name, n, r, o)                                                                                             \
    static int run_##name(void) {                                                                                      \
        edo_smc_config_##name##_t config;                                                                              \
        edo_smc_design_##name##_t design;                                                                              \
        edo_smc_state_##name##_t state;                                                                                \
        uint32_t words[sizeof design / 4], channel = 77;                                                               \
        memset(&config, 0, sizeof config);                                                                             \
        config.period_s = 1e-3;                                                                                        \
        config.alpha_per_s = 2.0;                                                                                      \
        for (int i = 0; i < n; i++) {                                                                                  \
            config.c[i] = surfaces[n][i];                                                                              \
            config.gradient[i] = -(i + 1.0);                                                                           \
            config.d_hat[i] = 0.25 * (i + 1.0);                                                                        \
        }                                                                                                              \
        for (int s = 0; s < o; s++) {                                                                                  \
            for (int m = 0; m < r; m++) {                                                                              \
                config.gains[s][m] = gains[r][m];                                                                      \
            }                                                                                                          \
            config.order[s] = r;                                                                                       \
        }                                                                                                              \
        config.k_l = 50.0;                                                                                             \
        config.k_s = 0.5;                                                                                              \
        config.epsilon = 0.01;                                                                                         \
        config.input_gain = 20.0;                                                                                      \
        config.u_min = -300.0;                                                                                         \
        config.u_max = 250.0;                                                                                          \
        config.sigma_star_bound = 1.0;                                                                                 \
        config.observer_pole_limit = 1.0;                                                                              \
        if (edo_smc_design_size_##name() != sizeof design || edo_smc_state_size_##name() != sizeof state ||            \
            edo_smc_design_##name(&config, sizeof config, &design, sizeof design, &channel) != EDO_SMC_OK ||           \
            channel != 0 || edo_smc_init_##name(&design, sizeof design, &state, sizeof state) != EDO_SMC_OK) {         \
            return 1;                                                                                                  \
        }                                                                                                              \
        printf(#name "\n");                                                                                            \
        memcpy(words, &design, sizeof design);                                                                         \
        for (size_t i = 0; i < sizeof design / 4; i++) {                                                               \
            printf("%08x\n", (unsigned)words[i]);                                                                      \
        }                                                                                                              \
        seed = 1;                                                                                                      \
        for (int tick = 0; tick < 300; tick++) {                                                                       \
            float x[n];                                                                                                \
            edo_smc_output_t output;                                                                                   \
            for (int i = 0; i < n; i++) {                                                                              \
                x[i] = entry(tick, i);                                                                                 \
            }                                                                                                          \
            const edo_smc_status_t status = edo_smc_tick_##name(&design, &state, x, &output);                          \
            printf("%d %08x %08x %08x %u\n", (int)status, (unsigned)bits(output.u), (unsigned)bits(output.sigma),      \
                   (unsigned)bits(output.sigma_star), (unsigned)output.health);                                        \
            if (tick % 5 == 4) {                                                                                       \
                edo_smc_report_applied_##name(&state, 0.5f * output.u);                                                \
            }                                                                                                          \
            if (tick == 150 && edo_smc_reset_##name(&state) != EDO_SMC_OK) {                                           \
                return 2;                                                                                              \
            }                                                                                                          \
        }                                                                                                              \
        return 0;                                                                                                      \
    }
#include "instances.inc"
#undef RUN

#define RUN(name, n, r, o) failed |= run_##name();
int main(void) {
    int failed = edo_smc_version() != EDO_SMC_VERSION;
#include "instances.inc"
    return failed;
}
