/* Every detectable caller error: checks the status, and that nothing was written. C99 and C++. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "checks.h"
#include "edo_smc.h"

typedef edo_smc_design_n4_r2_c24_t design_t;
typedef edo_smc_state_n4_r2_c24_t state_t;
typedef edo_smc_config_n4_r2_c24_t config_t;

static config_t config;
static design_t design, other_design;
static state_t state;
static edo_smc_output_t output;
static const float x[4] = {0.1f, 0.0f, 0.0f, 0.0f};

/* Checks that a rejected call leaves state and output unchanged. */
#define REFUSED(status, call)                                                                                          \
    do {                                                                                                               \
        const state_t state_was = state;                                                                               \
        memset(&output, 0x5a, sizeof output);                                                                          \
        const edo_smc_output_t output_was = output;                                                                    \
        expect_at(__LINE__, status, call);                                                                             \
        expect_at(__LINE__, 0, memcmp(&state, &state_was, sizeof state));                                              \
        expect_at(__LINE__, 0, memcmp(&output, &output_was, sizeof output));                                           \
    } while (0)

static edo_smc_status_t init(const design_t *of) {
    return edo_smc_init_n4_r2_c24(of, sizeof *of, &state, sizeof state);
}

static edo_smc_status_t tick(const float *sample) {
    return edo_smc_tick_n4_r2_c24(&design, &state, sample, &output);
}

static edo_smc_status_t redesign(void) {
    return edo_smc_design_n4_r2_c24(&config, sizeof config, &design, sizeof design, NULL);
}

/* A configuration with one wrong value, then corrected. */
#define BAD_CONFIG(status, wrong)                                                                                      \
    do {                                                                                                               \
        const config_t right = config;                                                                                 \
        const design_t design_was = design;                                                                            \
        wrong;                                                                                                         \
        expect_at(__LINE__, status, redesign());                                                                       \
        expect_at(__LINE__, 0, memcmp(&design, &design_was, sizeof design));                                           \
        config = right;                                                                                                \
    } while (0)

#define BAD_DESIGN(status, wrong)                                                                                      \
    do {                                                                                                               \
        const design_t right = design;                                                                                 \
        wrong;                                                                                                         \
        REFUSED(status, init(&design));                                                                                \
        design = right;                                                                                                \
    } while (0)

static void configure(void) {
    static const double c[4] = {125.0, 75.0, 15.0, 1.0};
    memcpy(config.c, c, sizeof c);
    config.period_s = 1e-3;
    config.alpha_per_s = 1.0;
    for (int s = 0; s < 2; s++) {
        config.gains[s][0] = 100.0;
        config.gains[s][1] = 2500.0;
        config.order[s] = 2;
    }
    config.k_l = 50.0;
    config.input_gain = 20.0;
    config.u_min = -300.0;
    config.u_max = 300.0;
    config.sigma_star_bound = 1.0;
    config.observer_pole_limit = 1.0;
}

static void designs(void) {
    uint32_t channel = 0;
    BAD_CONFIG(EDO_SMC_FALLBACK_UNKNOWN, config.fallback = 2);
    BAD_CONFIG(EDO_SMC_CONFIG_NOT_FINITE, config.k_l = NAN);
    BAD_CONFIG(EDO_SMC_PERIOD_NOT_POSITIVE, config.period_s = 0.0);
    BAD_CONFIG(EDO_SMC_INPUT_GAIN_ZERO, config.input_gain = 0.0);
    BAD_CONFIG(EDO_SMC_SURFACE_LEAD, config.c[3] = 2.0);
    BAD_CONFIG(EDO_SMC_SURFACE_NOT_HURWITZ, config.c[0] = -1.0);
    BAD_CONFIG(EDO_SMC_OFFSET_DECAY_NOT_POSITIVE, config.alpha_per_s = 0.0);
    BAD_CONFIG(EDO_SMC_OFFSET_DECAY_TOO_SLOW, config.alpha_per_s = 1e-6);
    BAD_CONFIG(EDO_SMC_NEGATIVE, config.k_s = -1.0);
    BAD_CONFIG(EDO_SMC_BOUNDARY_LAYER_EMPTY, (config.k_s = 1.0, config.epsilon = -1.0));
    BAD_CONFIG(EDO_SMC_LIMITS_TOO_WIDE, config.u_max = 1e13);
    BAD_CONFIG(EDO_SMC_LIMITS_REVERSED, config.u_min = 301.0);
    BAD_CONFIG(EDO_SMC_FALLBACK_OUTSIDE_LIMITS, (config.fallback = EDO_SMC_SAFE_U, config.safe_u = 400.0));
    BAD_CONFIG(EDO_SMC_OBSERVER_ORDER, config.order[1] = 4000000000u);
    BAD_CONFIG(EDO_SMC_ORDER_TOO_LOW, config.order[0] = 1);
    BAD_CONFIG(EDO_SMC_OBSERVER_NOT_FINITE, config.gains[0][1] = INFINITY);
    BAD_CONFIG(EDO_SMC_OBSERVER_NOT_HURWITZ, config.gains[1][0] = -1.0);
    BAD_CONFIG(EDO_SMC_OBSERVER_TOO_FAST, (config.gains[1][0] = 4000.0, config.gains[1][1] = 4e6));
    BAD_CONFIG(EDO_SMC_COEFFICIENT_RANGE, config.input_gain = 1e-40);
    BAD_CONFIG(EDO_SMC_NOT_FINITE, config.d_hat[2] = NAN);
    config.gains[1][0] = -1.0;
    EXPECT(EDO_SMC_OBSERVER_NOT_HURWITZ,
           edo_smc_design_n4_r2_c24(&config, sizeof config, &design, sizeof design, &channel));
    EXPECT(4, (edo_smc_status_t)channel);
    config.gains[1][0] = 100.0;
    EXPECT(EDO_SMC_NULL, edo_smc_design_n4_r2_c24(NULL, sizeof config, &design, sizeof design, NULL));
    EXPECT(EDO_SMC_NULL, edo_smc_design_n4_r2_c24(&config, sizeof config, NULL, sizeof design, NULL));
    EXPECT(EDO_SMC_SIZE, edo_smc_design_n4_r2_c24(&config, sizeof config - 8, &design, sizeof design, NULL));
    EXPECT(EDO_SMC_SIZE, edo_smc_design_n4_r2_c24(&config, sizeof config, &design, sizeof design + 4, NULL));
    EXPECT(EDO_SMC_OVERLAP, edo_smc_design_n4_r2_c24(&config, sizeof config, (design_t *)(void *)&config,
                                                     sizeof design, NULL));
    EXPECT(EDO_SMC_MISALIGNED, edo_smc_design_n4_r2_c24(&config, sizeof config, &design, sizeof design,
                                                        (uint32_t *)(void *)((char *)&channel + 1)));
}

/* Two arguments that share memory, where the call would write one of them; nothing may be written. */
static void overlaps(void) {
    const config_t config_was = config;
    const design_t design_was = design;
    EXPECT(EDO_SMC_OVERLAP, edo_smc_design_n4_r2_c24(&config, sizeof config, &design, sizeof design,
                                                     (uint32_t *)(void *)&design.kx[1]));
    EXPECT(EDO_SMC_OVERLAP,
           edo_smc_design_n4_r2_c24(&config, sizeof config, &design, sizeof design, &config.order[1]));
    EXPECT(EDO_SMC_OK, init(&design));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_tick_n4_r2_c24(&design, &state, x, (edo_smc_output_t *)(void *)&state));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_tick_n4_r2_c24(&design, &state, x, (edo_smc_output_t *)(void *)&state.words[2]));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_tick_n4_r2_c24(&design, &state, x, (edo_smc_output_t *)(void *)&design.g));
    EXPECT(0, memcmp(&config, &config_was, sizeof config) || memcmp(&design, &design_was, sizeof design));
}

/* Estimates and retunes: a state not yet started, a state of another design, and incompatible designs. */
static void knows_and_is_retuned(void) {
    float d_hat[4][2] = {{7.0f}};
    static const float bad[4] = {NAN, 0.0f, 0.0f, 0.0f};
    const size_t size = sizeof design;
    EXPECT(EDO_SMC_OK, redesign());
    EXPECT(EDO_SMC_OK, init(&design));
    REFUSED(EDO_SMC_NOT_STARTED, edo_smc_estimates_n4_r2_c24(&design, &state, d_hat));
    EXPECT(EDO_SMC_OK, tick(x));
    REFUSED(EDO_SMC_NULL, edo_smc_estimates_n4_r2_c24(&design, NULL, d_hat));
    REFUSED(EDO_SMC_NULL, edo_smc_estimates_n4_r2_c24(&design, &state, NULL));
    REFUSED(EDO_SMC_OTHER_DESIGN, edo_smc_estimates_n4_r2_c24(&other_design, &state, d_hat));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_estimates_n4_r2_c24(&design, &state, (float(*)[2])(void *)&state));
    EXPECT(0, d_hat[0][0] != 7.0f);
    EXPECT(EDO_SMC_OK, edo_smc_estimates_n4_r2_c24(&design, &state, d_hat));
    EXPECT(0, d_hat[0][0] != 0.0f);

    other_design = design;
    REFUSED(EDO_SMC_NULL, edo_smc_retune_n4_r2_c24(&design, NULL, size, &state, x));
    REFUSED(EDO_SMC_SIZE, edo_smc_retune_n4_r2_c24(&design, &other_design, size - 4, &state, x));
    REFUSED(EDO_SMC_NULL, edo_smc_retune_n4_r2_c24(&design, &other_design, size, &state, NULL));
    REFUSED(EDO_SMC_OTHER_DESIGN, edo_smc_retune_n4_r2_c24(&other_design, &design, size, &state, x));
    REFUSED(EDO_SMC_OTHER_DESIGN, edo_smc_retune_n4_r2_c24(NULL, &other_design, size, &state, x));
    REFUSED(EDO_SMC_RETUNE_SAMPLE, edo_smc_retune_n4_r2_c24(&design, &other_design, size, &state, bad));
    other_design.kx[2] *= 1.000001f;
    REFUSED(EDO_SMC_BAD_COEFFICIENTS, edo_smc_retune_n4_r2_c24(&design, &other_design, size, &state, x));
    config.alpha_per_s = 50.0;
    EXPECT(EDO_SMC_OK, edo_smc_design_n4_r2_c24(&config, sizeof config, &other_design, size, NULL));
    REFUSED(EDO_SMC_RETUNE_DECAY, edo_smc_retune_n4_r2_c24(&design, &other_design, size, &state, x));
    EXPECT(EDO_SMC_OK, tick(x));

    config.alpha_per_s = 5.0;
    EXPECT(EDO_SMC_OK, edo_smc_design_n4_r2_c24(&config, sizeof config, &other_design, size, NULL));
    EXPECT(EDO_SMC_OK, edo_smc_retune_n4_r2_c24(&design, &other_design, size, &state, x));
    REFUSED(EDO_SMC_OTHER_DESIGN, tick(x));
    EXPECT(EDO_SMC_OK, edo_smc_tick_n4_r2_c24(&other_design, &state, x, &output));
}

int main(void) {
    static const float bad[4] = {0.1f, NAN, 0.0f, 0.0f};
    char *const odd = (char *)&state + 1;
    configure();
    EXPECT(EDO_SMC_OK, redesign());
    designs();
    other_design = design;

    /* Memory without init: zeros, and arbitrary bytes. */
    REFUSED(EDO_SMC_NOT_INITIALISED, tick(x));
    REFUSED(EDO_SMC_NOT_INITIALISED, edo_smc_report_applied_n4_r2_c24(&state, 1.0f));
    REFUSED(EDO_SMC_NOT_INITIALISED, edo_smc_reset_n4_r2_c24(&state));
    memset(&state, 0xff, sizeof state);
    REFUSED(EDO_SMC_NOT_INITIALISED, tick(x));

    REFUSED(EDO_SMC_NULL, edo_smc_init_n4_r2_c24(NULL, sizeof design, &state, sizeof state));
    EXPECT(EDO_SMC_NULL, edo_smc_init_n4_r2_c24(&design, sizeof design, NULL, sizeof state));
    REFUSED(EDO_SMC_SIZE, edo_smc_init_n4_r2_c24(&design, sizeof design - 4, &state, sizeof state));
    REFUSED(EDO_SMC_SIZE, edo_smc_init_n4_r2_c24(&design, sizeof design, &state, sizeof state + 8));
    REFUSED(EDO_SMC_MISALIGNED, edo_smc_init_n4_r2_c24(&design, sizeof design, (state_t *)(void *)odd, sizeof state));
    EXPECT(EDO_SMC_OVERLAP,
           edo_smc_init_n4_r2_c24(&design, sizeof design, (state_t *)(void *)&design, sizeof state));
    BAD_DESIGN(EDO_SMC_WRONG_VERSION, design.version ^= 0x100u);
    BAD_DESIGN(EDO_SMC_WRONG_INSTANCE, design.instance = EDO_SMC_ID(4, 2, 0xc));
    BAD_DESIGN(EDO_SMC_NOT_FINITE, design.kx[2] = NAN);
    BAD_DESIGN(EDO_SMC_NOT_FINITE, design.a_row[0] = INFINITY);
    BAD_DESIGN(EDO_SMC_NOT_FINITE, design.d_hat[3] = NAN);
    BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.u_min = 400.0f);
    BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.hold = 0.5f);
    /* Values that no design has, or that differ from the original design. */
    BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.decay = 3.0f);
    BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.kx[2] *= 1.000001f);
    BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.gamma[1][0] = -design.gamma[1][0]);
    BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.a_row[2] += 1000.0f);
    BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.d_hat[3] = 1e9f);
    BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.check += 1.0f);

    /* Before the first valid sample the output is the fallback; the first valid sample starts. */
    EXPECT(EDO_SMC_OK, init(&design));
    REFUSED(EDO_SMC_NOT_STARTED, edo_smc_report_applied_n4_r2_c24(&state, 1.0f));
    REFUSED(EDO_SMC_NULL, edo_smc_tick_n4_r2_c24(NULL, &state, x, &output));
    EXPECT(EDO_SMC_REJECTED, tick(bad));
    EXPECT(EDO_SMC_INPUT_REJECTED, output.health);
    EXPECT(0, output.u != 0.0f);
    EXPECT(EDO_SMC_OK, tick(x));
    EXPECT(EDO_SMC_OK, tick(x));

    REFUSED(EDO_SMC_NULL, edo_smc_tick_n4_r2_c24(&design, NULL, x, &output));
    REFUSED(EDO_SMC_NULL, edo_smc_tick_n4_r2_c24(&design, &state, NULL, &output));
    REFUSED(EDO_SMC_NULL, edo_smc_tick_n4_r2_c24(&design, &state, x, NULL));
    REFUSED(EDO_SMC_OTHER_DESIGN, edo_smc_tick_n4_r2_c24(NULL, &state, x, &output));
    REFUSED(EDO_SMC_OTHER_DESIGN, edo_smc_tick_n4_r2_c24(&other_design, &state, x, &output));
    REFUSED(EDO_SMC_MISALIGNED, edo_smc_tick_n4_r2_c24(&design, (state_t *)(void *)odd, x, &output));
    REFUSED(EDO_SMC_MISALIGNED, tick((const float *)(const void *)((const char *)x + 2)));
    REFUSED(EDO_SMC_MISALIGNED,
            edo_smc_tick_n4_r2_c24(&design, &state, x, (edo_smc_output_t *)(void *)((char *)&output + 1)));
    /* State of another instance, by a cast. */
    REFUSED(EDO_SMC_NOT_INITIALISED, edo_smc_reset_n4_r2_c34((edo_smc_state_n4_r2_c34_t *)(void *)&state));
    REFUSED(EDO_SMC_NOT_FINITE, edo_smc_report_applied_n4_r2_c24(&state, NAN));
    REFUSED(EDO_SMC_NOT_FINITE, edo_smc_report_applied_n4_r2_c24(&state, 1e13f));
    EXPECT(EDO_SMC_OK, edo_smc_report_applied_n4_r2_c24(&state, 1.0f));

    /* Each word of a state overwritten in turn: the call must return; some words must be rejected. */
    const state_t good = state;
    uint32_t words[sizeof state / 4];
    for (size_t i = 0; i < sizeof state / 4; i++) {
        memcpy(words, &good, sizeof words);
        words[i] ^= 0xffffffffu;
        memcpy(&state, words, sizeof state);
        const edo_smc_status_t status = tick(x);
        if (status != EDO_SMC_OK && status != EDO_SMC_REJECTED && status != EDO_SMC_NOT_INITIALISED &&
            status != EDO_SMC_OTHER_DESIGN && status != EDO_SMC_DAMAGED) {
            EXPECT(EDO_SMC_OK, status);
        }
    }
    state = good;
    state.words[sizeof state.words / 4 - 1] = 2;
    REFUSED(EDO_SMC_DAMAGED, tick(x));
    REFUSED(EDO_SMC_DAMAGED, edo_smc_report_applied_n4_r2_c24(&state, 1.0f));
    state = good;
    EXPECT(EDO_SMC_OK, tick(x));
    EXPECT(EDO_SMC_OK, edo_smc_reset_n4_r2_c24(&state));
    EXPECT(EDO_SMC_OK, tick(x));
    EXPECT(0, output.sigma_star != 0.0f);

    overlaps();
    knows_and_is_retuned();

    return checked();
}
