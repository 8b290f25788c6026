/* Every detectable caller error with a drive, its fence, its plans and its profiles. C99 and C++. */
#include <math.h>
#include <string.h>

#include "checks.h"
#include "edo_smc.h"

typedef edo_smc_config_motor_t config_t;
typedef edo_smc_design_motor_fast_t design_t;
typedef edo_smc_state_motor_fast_t state_t;

static config_t config;
static design_t design, other_design;
static state_t state;
static edo_smc_sample_motor_t sample;
static edo_smc_output_t output;
static edo_smc_estimates_motor_t known;
static edo_smc_refusal_t refusal;

/* Checks that a rejected call leaves all writable memory unchanged. */
#define REFUSED(status, call)                                                                                          \
    do {                                                                                                               \
        const state_t state_was = state;                                                                               \
        const design_t design_was = design;                                                                            \
        memset(&output, 0x5a, sizeof output);                                                                          \
        memset(&known, 0x5a, sizeof known);                                                                            \
        const edo_smc_output_t output_was = output;                                                                    \
        const edo_smc_estimates_motor_t known_was = known;                                                             \
        expect_at(__LINE__, status, call);                                                                             \
        expect_at(__LINE__, 0, memcmp(&state, &state_was, sizeof state));                                              \
        expect_at(__LINE__, 0, memcmp(&design, &design_was, sizeof design));                                           \
        expect_at(__LINE__, 0, memcmp(&output, &output_was, sizeof output));                                           \
        expect_at(__LINE__, 0, memcmp(&known, &known_was, sizeof known));                                              \
    } while (0)

static edo_smc_status_t redesign(void) {
    return edo_smc_design_motor_fast(&config, sizeof config, &design, sizeof design, &refusal);
}

static edo_smc_status_t init(void) {
    return edo_smc_init_motor_fast(&design, sizeof design, &state, sizeof state);
}

static edo_smc_status_t tick(void) {
    return edo_smc_tick_motor_fast(&design, &state, &sample, &output);
}

/* The current is 0 until the counts agree with each other. */
static void believe(void) {
    for (int k = 0; k < 12; k++) {
        (void)tick();
    }
}

/* A configuration with one wrong number, which the error names, then corrected. */
#define BAD_NUMBER(name, number)                                                                                       \
    do {                                                                                                               \
        const config_t right = config;                                                                                 \
        config.name = number;                                                                                          \
        REFUSED(EDO_SMC_OUT_OF_RANGE, redesign());                                                                     \
        expect_at(__LINE__, 0, strcmp(refusal.field, #name));                                                          \
        expect_at(__LINE__, 1, !(refusal.given >= refusal.low && refusal.given <= refusal.high));                      \
        config = right;                                                                                                \
    } while (0)

static void designs(void) {
    char *const odd = (char *)&refusal + 4;
    EXPECT(EDO_SMC_NULL, edo_smc_by_rule_motor_fast(NULL, sizeof config));
    EXPECT(EDO_SMC_SIZE, edo_smc_by_rule_motor_fast(&config, sizeof config - 8));
    EXPECT(EDO_SMC_NULL, edo_smc_tune_motor_fast(NULL, sizeof config, 10.0));
    EXPECT(EDO_SMC_SIZE, edo_smc_tune_motor_fast(&config, sizeof config + 8, 10.0));
    REFUSED(EDO_SMC_NULL, edo_smc_design_motor_fast(NULL, sizeof config, &design, sizeof design, NULL));
    REFUSED(EDO_SMC_NULL, edo_smc_design_motor_fast(&config, sizeof config, NULL, sizeof design, NULL));
    REFUSED(EDO_SMC_SIZE, edo_smc_design_motor_fast(&config, sizeof config - 8, &design, sizeof design, NULL));
    REFUSED(EDO_SMC_SIZE, edo_smc_design_motor_fast(&config, sizeof config, &design, sizeof design + 4, NULL));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_design_motor_fast(&config, sizeof config, (design_t *)(void *)&config,
                                                       sizeof design, NULL));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_design_motor_fast(&config, sizeof config, &design, sizeof design,
                                                       (edo_smc_refusal_t *)(void *)&config));
    REFUSED(EDO_SMC_MISALIGNED, edo_smc_design_motor_fast(&config, sizeof config, &design, sizeof design,
                                                          (edo_smc_refusal_t *)(void *)odd));
    BAD_NUMBER(period_s, 0.1);
    BAD_NUMBER(period_s, NAN);
    BAD_NUMBER(motor.inertia_kg_m2, 0.0);
    BAD_NUMBER(motor.torque_n_m_per_a, -1.0);
    config.encoder.bits = 1.0;
    REFUSED(EDO_SMC_OUT_OF_RANGE, redesign());
    EXPECT(0, strcmp(refusal.field, "encoder"));
    config.encoder.bits = 14.0;
    BAD_NUMBER(limits.max, INFINITY);
    BAD_NUMBER(limits.min, 11.0);
    BAD_NUMBER(bandwidths.surface_rad_s, 1e4);
    BAD_NUMBER(bandwidths.observer_rad_s, 0.0);
    BAD_NUMBER(bandwidths.reaching_per_s, 1e4);
    BAD_NUMBER(bandwidths.offset_per_s, -1.0);
    BAD_NUMBER(fast_ratio, 5.0);
    BAD_NUMBER(switching.alert_steps, 0.0);
    BAD_NUMBER(gate_steps, 1.0);
    BAD_NUMBER(lost_ticks, 0.0);
    BAD_NUMBER(lag_s, -1.0);
    BAD_NUMBER(uncertain, 0.95);
    BAD_NUMBER(stops_at, 32768.0);
    config.hold = 0.0;
    config.safe_u = 11.0;
    REFUSED(EDO_SMC_OUT_OF_RANGE, redesign());
    EXPECT(0, strcmp(refusal.field, "fallback"));
    config.safe_u = 0.0;
    EXPECT(EDO_SMC_OK, redesign());
    EXPECT(0, refusal.field[0]);
}

#define BAD_DESIGN(status, wrong)                                                                                      \
    do {                                                                                                               \
        const design_t right = design;                                                                                 \
        wrong;                                                                                                         \
        REFUSED(status, init());                                                                                       \
        design = right;                                                                                                \
    } while (0)

/* Memory without init, of another size, of another drive; every word of a design and of a state in turn. */
static void memory(void) {
    char *const odd = (char *)&state + 1;
    REFUSED(EDO_SMC_NOT_INITIALISED, tick());
    REFUSED(EDO_SMC_NOT_INITIALISED, edo_smc_reset_motor_fast(&state));
    REFUSED(EDO_SMC_NULL, edo_smc_init_motor_fast(NULL, sizeof design, &state, sizeof state));
    REFUSED(EDO_SMC_SIZE, edo_smc_init_motor_fast(&design, sizeof design - 4, &state, sizeof state));
    REFUSED(EDO_SMC_SIZE, edo_smc_init_motor_fast(&design, sizeof design, &state, sizeof state + 8));
    REFUSED(EDO_SMC_MISALIGNED, edo_smc_init_motor_fast(&design, sizeof design, (state_t *)(void *)odd, sizeof state));
    REFUSED(EDO_SMC_OVERLAP,
            edo_smc_init_motor_fast(&design, sizeof design, (state_t *)(void *)&design.words, sizeof state));
    BAD_DESIGN(EDO_SMC_WRONG_VERSION, design.version ^= 0x100u);
    BAD_DESIGN(EDO_SMC_WRONG_INSTANCE, design.instance ^= 0x100u);
    for (size_t i = 0; i < sizeof design.words / 4; i++) {
        BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.words[i] ^= 1u);
    }
    BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.check += 1u);
    edo_smc_state_motor_late_t late;
    EXPECT(EDO_SMC_WRONG_INSTANCE,
           edo_smc_init_motor_late((const edo_smc_design_motor_late_t *)(const void *)&design,
                                   sizeof(edo_smc_design_motor_late_t), &late, sizeof late));

    /* Before the first valid sample the output is the fallback. */
    EXPECT(EDO_SMC_OK, init());
    REFUSED(EDO_SMC_NOT_STARTED, edo_smc_report_applied_motor_fast(&state, 1.0f));
    REFUSED(EDO_SMC_NOT_STARTED, edo_smc_estimates_motor_fast(&design, &state, &known));
    REFUSED(EDO_SMC_NOT_STARTED, edo_smc_missed_motor_fast(&design, &state, 1));
    REFUSED(EDO_SMC_NOT_STARTED, edo_smc_trip_motor_fast(&design, &state));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_tick_motor_fast(&design, &state, &sample, (edo_smc_output_t *)(void *)&state));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_go_on_motor_fast(&design, &state, &sample, (edo_smc_output_t *)(void *)&state));
    output.u = 1.0f;
    EXPECT(EDO_SMC_NOT_STARTED, edo_smc_go_on_motor_fast(&design, &state, &sample, &output));
    EXPECT(EDO_SMC_INPUT_REJECTED + EDO_SMC_WAITS, output.health);
    EXPECT(0, output.u != 0.0f);
    EXPECT(EDO_SMC_NOT_STARTED, edo_smc_go_on_motor_fast(&design, &state, &sample, &output));
    sample.lost = 1;
    EXPECT(EDO_SMC_REJECTED, tick());
    EXPECT(EDO_SMC_INPUT_REJECTED + EDO_SMC_WAITS, output.health);
    EXPECT(0, output.u != 0.0f);
    sample.lost = 0;
    believe();
    EXPECT(EDO_SMC_OK, tick());
    EXPECT(EDO_SMC_OK, tick());

    REFUSED(EDO_SMC_NULL, edo_smc_tick_motor_fast(&design, NULL, &sample, &output));
    REFUSED(EDO_SMC_NULL, edo_smc_tick_motor_fast(&design, &state, NULL, &output));
    REFUSED(EDO_SMC_NULL, edo_smc_tick_motor_fast(&design, &state, &sample, NULL));
    REFUSED(EDO_SMC_OTHER_DESIGN, edo_smc_tick_motor_fast(NULL, &state, &sample, &output));
    REFUSED(EDO_SMC_OTHER_DESIGN, edo_smc_tick_motor_fast(&other_design, &state, &sample, &output));
    REFUSED(EDO_SMC_MISALIGNED, edo_smc_tick_motor_fast(&design, (state_t *)(void *)odd, &sample, &output));
    REFUSED(EDO_SMC_NULL, edo_smc_missed_motor_fast(&design, NULL, 1));
    REFUSED(EDO_SMC_OTHER_DESIGN, edo_smc_missed_motor_fast(&other_design, &state, 1));
    REFUSED(EDO_SMC_NULL, edo_smc_trip_motor_fast(&design, NULL));
    REFUSED(EDO_SMC_OTHER_DESIGN, edo_smc_trip_motor_fast(&other_design, &state));
    REFUSED(EDO_SMC_NOT_FINITE, edo_smc_report_applied_motor_fast(&state, NAN));
    REFUSED(EDO_SMC_NOT_INITIALISED, edo_smc_reset_motor((edo_smc_state_motor_t *)(void *)&state));
    REFUSED(EDO_SMC_OVERLAP,
            edo_smc_estimates_motor_fast(&design, &state, (edo_smc_estimates_motor_t *)(void *)&state.words));
    EXPECT(EDO_SMC_OK, edo_smc_estimates_motor_fast(&design, &state, &known));

    const state_t good = state;
    int damaged = 0;
    for (size_t i = 0; i < sizeof state / 4; i++) {
        uint32_t words[sizeof state / 4];
        memcpy(words, &good, sizeof words);
        words[i] ^= 0xffffffffu;
        memcpy(&state, words, sizeof state);
        const edo_smc_status_t status = tick();
        damaged += status == EDO_SMC_DAMAGED;
        EXPECT(1, status == EDO_SMC_OK || status == EDO_SMC_REJECTED || status == EDO_SMC_NOT_INITIALISED ||
                      status == EDO_SMC_OTHER_DESIGN || status == EDO_SMC_DAMAGED);
        EXPECT(1, status < 0 || (output.u >= -10.0f && output.u <= 10.0f));
    }
    EXPECT(2, damaged);
    state = good;
    EXPECT(EDO_SMC_OK, edo_smc_missed_motor_fast(&design, &state, 2));
    EXPECT(EDO_SMC_OK, tick());
    EXPECT(0, output.health & EDO_SMC_BRAKES);
    EXPECT(EDO_SMC_OK, edo_smc_trip_motor_fast(&design, &state));
    EXPECT(EDO_SMC_OK, tick());
    EXPECT(EDO_SMC_BRAKES, output.health & EDO_SMC_BRAKES);
    EXPECT(EDO_SMC_OK, edo_smc_reset_motor_fast(&state));
    believe();
    EXPECT(EDO_SMC_OK, tick());
}

static edo_smc_status_t retune(const design_t *to) {
    return edo_smc_retune_motor_fast(&design, to, sizeof *to, &state, &sample);
}

static edo_smc_status_t design_other(void) {
    return edo_smc_design_motor_fast(&config, sizeof config, &other_design, sizeof other_design, NULL);
}

/* An incompatible design leaves the active one unchanged. */
static void retuned(void) {
    const config_t right = config;
    EXPECT(EDO_SMC_OK, init());
    believe();
    EXPECT(EDO_SMC_OK, tick());
    REFUSED(EDO_SMC_NULL, retune(NULL));
    REFUSED(EDO_SMC_SIZE, edo_smc_retune_motor_fast(&design, &other_design, 4, &state, &sample));
    REFUSED(EDO_SMC_NULL, edo_smc_retune_motor_fast(&design, &design, sizeof design, &state, NULL));
    REFUSED(EDO_SMC_WRONG_VERSION, retune(&other_design));
    EXPECT(EDO_SMC_OK, design_other());
    REFUSED(EDO_SMC_OTHER_DESIGN,
            edo_smc_retune_motor_fast(&other_design, &design, sizeof design, &state, &sample));
    other_design.words[3] ^= 1u;
    REFUSED(EDO_SMC_BAD_COEFFICIENTS, retune(&other_design));
    config.encoder.counts_per_turn = 8192.0;
    EXPECT(EDO_SMC_OK, design_other());
    REFUSED(EDO_SMC_RETUNE_ENCODER, retune(&other_design));
    config = right;
    config.bandwidths.reaching_per_s = 100.0;
    config.bandwidths.offset_per_s = 105.0;
    EXPECT(EDO_SMC_OK, design_other());
    REFUSED(EDO_SMC_RETUNE_DECAY, retune(&other_design));
    config = right;
    EXPECT(EDO_SMC_OK, design_other());
    sample.begin.r = NAN;
    REFUSED(EDO_SMC_RETUNE_SAMPLE, retune(&other_design));
    sample.begin.r = 0.0f;
    EXPECT(EDO_SMC_OK, tick());
    EXPECT(EDO_SMC_OK, retune(&other_design));
    REFUSED(EDO_SMC_OTHER_DESIGN, tick());
    EXPECT(EDO_SMC_OK, edo_smc_tick_motor_fast(&other_design, &state, &sample, &output));
}

static edo_smc_fence_limits_t limits;
static edo_smc_fence_t fence;

static edo_smc_status_t fence_off(void) {
    return edo_smc_fence_motor_fast(&config, sizeof config, &limits, &fence, sizeof fence, &refusal);
}

static edo_smc_status_t guard(void) {
    return edo_smc_guard_motor_fast(&design, &state, &fence, &sample, &output);
}

#define FENCE_REFUSED(status, call)                                                                                    \
    do {                                                                                                               \
        const edo_smc_fence_t fence_was = fence;                                                                       \
        expect_at(__LINE__, status, call);                                                                             \
        expect_at(__LINE__, 0, memcmp(&fence, &fence_was, sizeof fence));                                              \
    } while (0)

#define BAD_LIMIT(name, number)                                                                                        \
    do {                                                                                                               \
        const edo_smc_fence_limits_t right = limits;                                                                   \
        limits.name = number;                                                                                          \
        FENCE_REFUSED(EDO_SMC_OUT_OF_RANGE, fence_off());                                                              \
        expect_at(__LINE__, 0, strcmp(refusal.field, #name));                                                          \
        expect_at(__LINE__, 1, !(refusal.given >= refusal.low && refusal.given <= refusal.high));                      \
        limits = right;                                                                                                \
    } while (0)

static void fences(void) {
    edo_smc_fence_t *const within = (edo_smc_fence_t *)(void *)&config.limits;
    edo_smc_refusal_t *const crooked = (edo_smc_refusal_t *)(void *)((char *)&refusal + 4);
    const config_t right_config = config;
    limits.low_rad = -INFINITY;
    limits.high_rad = 20.0;
    limits.max_speed_rad_s = 50.0;
    limits.following_rad = 0.5;
    FENCE_REFUSED(EDO_SMC_NULL, edo_smc_fence_motor_fast(NULL, sizeof config, &limits, &fence, sizeof fence, NULL));
    FENCE_REFUSED(EDO_SMC_NULL, edo_smc_fence_motor_fast(&config, sizeof config, NULL, &fence, sizeof fence, NULL));
    EXPECT(EDO_SMC_NULL, edo_smc_fence_motor_fast(&config, sizeof config, &limits, NULL, sizeof fence, NULL));
    FENCE_REFUSED(EDO_SMC_SIZE, edo_smc_fence_motor_fast(&config, 8, &limits, &fence, sizeof fence, NULL));
    FENCE_REFUSED(EDO_SMC_SIZE, edo_smc_fence_motor_fast(&config, sizeof config, &limits, &fence, 40, NULL));
    FENCE_REFUSED(EDO_SMC_MISALIGNED,
                  edo_smc_fence_motor_fast(&config, sizeof config, &limits, &fence, sizeof fence, crooked));
    EXPECT(EDO_SMC_OVERLAP, edo_smc_fence_motor_fast(&config, sizeof config, &limits, within, sizeof fence, NULL));
    EXPECT(EDO_SMC_OVERLAP, edo_smc_fence_motor_fast(&config, sizeof config, &limits, &fence, sizeof fence,
                                                     (edo_smc_refusal_t *)(void *)&limits));
    EXPECT(0, memcmp(&config, &right_config, sizeof config));
    BAD_LIMIT(low_rad, NAN);
    BAD_LIMIT(high_rad, NAN);
    limits.low_rad = 1.0;
    BAD_LIMIT(high_rad, 0.9);
    limits.low_rad = -INFINITY;
    BAD_LIMIT(max_speed_rad_s, -1.0);
    BAD_LIMIT(max_speed_rad_s, NAN);
    BAD_LIMIT(following_rad, NAN);
    config.period_s = 0.1;
    FENCE_REFUSED(EDO_SMC_OUT_OF_RANGE, fence_off());
    EXPECT(0, strcmp(refusal.field, "period_s"));
    config = right_config;
    EXPECT(EDO_SMC_OK, fence_off());
    EXPECT(0, refusal.field[0]);

    EXPECT(EDO_SMC_OK, init());
    REFUSED(EDO_SMC_NOT_STARTED, guard());
    believe();
    EXPECT(EDO_SMC_OK, tick());
    REFUSED(EDO_SMC_NULL, edo_smc_guard_motor_fast(NULL, &state, &fence, &sample, &output));
    REFUSED(EDO_SMC_NULL, edo_smc_guard_motor_fast(&design, NULL, &fence, &sample, &output));
    REFUSED(EDO_SMC_NULL, edo_smc_guard_motor_fast(&design, &state, NULL, &sample, &output));
    REFUSED(EDO_SMC_NULL, edo_smc_guard_motor_fast(&design, &state, &fence, NULL, &output));
    REFUSED(EDO_SMC_NULL, edo_smc_guard_motor_fast(&design, &state, &fence, &sample, NULL));
    REFUSED(EDO_SMC_OTHER_DESIGN, edo_smc_guard_motor_fast(&other_design, &state, &fence, &sample, &output));
    REFUSED(EDO_SMC_MISALIGNED, edo_smc_guard_motor_fast(&design, &state, &fence, &sample,
                                                         (edo_smc_output_t *)(void *)((char *)&output + 1)));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_guard_motor_fast(&design, &state, &fence, &sample,
                                                      (edo_smc_output_t *)(void *)&state.words[2]));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_guard_motor_fast(&design, &state, &fence, &sample,
                                                      (edo_smc_output_t *)(void *)&design.words[2]));
    FENCE_REFUSED(EDO_SMC_OVERLAP, edo_smc_guard_motor_fast(&design, &state, &fence, &sample,
                                                            (edo_smc_output_t *)(void *)&fence));

    /* Within the limits nothing changes. Too far from the target the flag is set, and the next tick brakes. */
    EXPECT(EDO_SMC_OK, tick());
    const edo_smc_output_t output_was = output;
    const state_t state_was = state;
    EXPECT(EDO_SMC_OK, guard());
    EXPECT(0, memcmp(&output, &output_was, sizeof output));
    EXPECT(0, memcmp(&state, &state_was, sizeof state));
    sample.begin.r = 0.6f;
    EXPECT(EDO_SMC_OK, guard());
    EXPECT(output_was.health + EDO_SMC_FOLLOWING_ERROR, output.health);
    EXPECT(0, memcmp(&output.u, &output_was.u, sizeof output.u));
    sample.begin.r = 0.0f;
    EXPECT(EDO_SMC_OK, tick());
    EXPECT(EDO_SMC_BRAKES, output.health & EDO_SMC_BRAKES);
    EXPECT(EDO_SMC_OK, edo_smc_reset_motor_fast(&state));
}

#define PLAN_REFUSED(status, call)                                                                                     \
    do {                                                                                                               \
        const edo_smc_plan_motor_t plan_was = plan;                                                                    \
        expect_at(__LINE__, status, call);                                                                             \
        expect_at(__LINE__, 0, memcmp(&plan, &plan_was, sizeof plan));                                                 \
    } while (0)

static void plans(void) {
    static edo_smc_plan_motor_t from, plan;
    static edo_smc_target_motor_t target;
    PLAN_REFUSED(EDO_SMC_NULL, edo_smc_plan_rest_motor(NULL, 0, 0.0f));
    PLAN_REFUSED(EDO_SMC_NOT_FINITE, edo_smc_plan_rest_motor(&plan, 0, NAN));
    PLAN_REFUSED(EDO_SMC_NULL, edo_smc_plan_move_motor(&plan, NULL, 0, 10, 1e-3, 0, 1.0f));
    PLAN_REFUSED(EDO_SMC_OVERLAP, edo_smc_plan_move_motor(&plan, &plan, 0, 10, 1e-3, 0, 1.0f));
    PLAN_REFUSED(EDO_SMC_PLAN_TICKS, edo_smc_plan_move_motor(&plan, &from, 0, 0, 1e-3, 0, 1.0f));
    PLAN_REFUSED(EDO_SMC_PLAN_TICKS, edo_smc_plan_stop_motor(&plan, &from, 0, 0x1000001u, 1e-3));
    PLAN_REFUSED(EDO_SMC_NOT_FINITE, edo_smc_plan_move_motor(&plan, &from, 0, 10, 0.0, 0, 1.0f));
    PLAN_REFUSED(EDO_SMC_NOT_FINITE, edo_smc_plan_stop_motor(&plan, &from, 0, 10, NAN));
    PLAN_REFUSED(EDO_SMC_NOT_FINITE, edo_smc_plan_move_motor(&plan, &from, 0, 10, 1e-3, 0, INFINITY));
    PLAN_REFUSED(EDO_SMC_NOT_FINITE, edo_smc_plan_sine_motor(&plan, &from, 0, 10, 1e-3, NAN, 1.0));
    PLAN_REFUSED(EDO_SMC_PLAN_FREQUENCY, edo_smc_plan_sine_motor(&plan, &from, 0, 10, 1e-3, 1.0, 3142.0));
    PLAN_REFUSED(EDO_SMC_PLAN_FREQUENCY, edo_smc_plan_sine_motor(&plan, &from, 0, 10, 1e-3, 1.0, 0.0));
    PLAN_REFUSED(EDO_SMC_NULL, edo_smc_plan_at_motor(NULL, 0, &target));
    PLAN_REFUSED(EDO_SMC_NULL, edo_smc_plan_at_motor(&plan, 0, NULL));
    PLAN_REFUSED(EDO_SMC_OVERLAP, edo_smc_plan_at_motor(&plan, 0, (edo_smc_target_motor_t *)(void *)&plan));
    PLAN_REFUSED(EDO_SMC_MISALIGNED,
                 edo_smc_plan_at_motor(&plan, 0, (edo_smc_target_motor_t *)(void *)((char *)&target + 1)));
    /* All zeros is rest at angle 0, and a move from there ends at its goal. */
    target.r = 7.0f;
    EXPECT(EDO_SMC_OK, edo_smc_plan_at_motor(&plan, 5, &target));
    EXPECT(0, target.turn != 0 || target.r != 0.0f || target.r_dot != 0.0f);
    EXPECT(EDO_SMC_OK, edo_smc_plan_move_motor(&plan, &from, 7, 10, 1e-3, 3, 1.0f));
    EXPECT(EDO_SMC_OK, edo_smc_plan_at_motor(&plan, 17, &target));
    EXPECT(0, target.turn != 3 || target.r != 1.0f || target.r_dot != 0.0f);
    /* `at` evaluates any tick; once `play` has completed a plan, it stays completed, also after the ticks wrap. */
    EXPECT(EDO_SMC_OK, edo_smc_plan_at_motor(&plan, 8, &target));
    EXPECT(1, target.turn != 3 || target.r != 1.0f || target.r_dot != 0.0f);
    EXPECT(EDO_SMC_NULL, edo_smc_plan_play_motor(NULL, 0, &target));
    PLAN_REFUSED(EDO_SMC_NULL, edo_smc_plan_play_motor(&plan, 0, NULL));
    PLAN_REFUSED(EDO_SMC_OVERLAP, edo_smc_plan_play_motor(&plan, 0, (edo_smc_target_motor_t *)(void *)&plan));
    EXPECT(EDO_SMC_OK, edo_smc_plan_play_motor(&plan, 17, &target));
    EXPECT(EDO_SMC_OK, edo_smc_plan_play_motor(&plan, 8, &target));
    EXPECT(0, target.turn != 3 || target.r != 1.0f || target.r_dot != 0.0f);
}

#define PROFILE_REFUSED(status, call)                                                                                  \
    do {                                                                                                               \
        const edo_smc_profile_motor_t profile_was = profile;                                                           \
        expect_at(__LINE__, status, call);                                                                             \
        expect_at(__LINE__, 0, memcmp(&profile, &profile_was, sizeof profile));                                        \
    } while (0)

static edo_smc_profile_motor_t profile;
static edo_smc_target_motor_t aim;

static edo_smc_status_t profile_new(double period_s, double speed, double acceleration, uint32_t window) {
    return edo_smc_profile_new_motor(&profile, sizeof profile, period_s, speed, acceleration, window, &refusal);
}

/* Every call rejects memory without `new` and leaves it unchanged. */
static void no_profile(edo_smc_status_t status) {
    PROFILE_REFUSED(status, edo_smc_profile_limit_motor(&profile, 50.0, 500.0, &refusal));
    PROFILE_REFUSED(status, edo_smc_profile_keep_within_motor(&profile, 0, 0.0, 1, 0.0));
    PROFILE_REFUSED(status, edo_smc_profile_go_to_motor(&profile, 0, 1.0));
    PROFILE_REFUSED(status, edo_smc_profile_stop_motor(&profile));
    PROFILE_REFUSED(status, edo_smc_profile_start_motor(&profile, 0, 1.0, 1.0));
    aim.r = 7.0f;
    PROFILE_REFUSED(status, edo_smc_profile_next_motor(&profile, &aim));
    EXPECT(0, aim.r != 7.0f);
    EXPECT(0, edo_smc_profile_has_arrived_motor(&profile));
}

static void profile_limits(void) {
    static const struct {
        const char *field;
        double period_s, speed, acceleration;
        uint32_t window;
    } bad[] = {
        {"period_s", 0.0, 100.0, 1200.0, 10},      {"period_s", -1e-3, 100.0, 1200.0, 10},
        {"period_s", NAN, 100.0, 1200.0, 10},      {"period_s", 1e-300, 100.0, 1200.0, 10},
        {"speed_rad_s", 1e-3, 0.0, 1200.0, 10},    {"speed_rad_s", 1e-3, NAN, 1200.0, 10},
        {"speed_rad_s", 1e-3, 1.6e3, 1200.0, 10},  {"acceleration_rad_s2", 1e-3, 100.0, -1.0, 10},
        {"acceleration_rad_s2", 1e-3, 100.0, INFINITY, 10}, {"window", 1e-3, 100.0, 1200.0, 0},
        {"window", 1e-3, 100.0, 1200.0, EDO_SMC_PROFILE_WINDOW + 1},
        {"window", 1e-3, 100.0, 1200.0, 0x10000001u},
    };
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        PROFILE_REFUSED(EDO_SMC_OUT_OF_RANGE,
                        profile_new(bad[k].period_s, bad[k].speed, bad[k].acceleration, bad[k].window));
        EXPECT(0, strcmp(refusal.field, bad[k].field));
        EXPECT(1, !(refusal.given >= refusal.low && refusal.given <= refusal.high));
    }
    char *const odd = (char *)&profile + 1;
    edo_smc_refusal_t *const within = (edo_smc_refusal_t *)(void *)profile.words;
    edo_smc_refusal_t *const crooked = (edo_smc_refusal_t *)(void *)((char *)&refusal + 4);
    EXPECT(EDO_SMC_NULL, edo_smc_profile_new_motor(NULL, sizeof profile, 1e-3, 1.0, 1.0, 1, NULL));
    PROFILE_REFUSED(EDO_SMC_SIZE, edo_smc_profile_new_motor(&profile, sizeof profile - 4, 1e-3, 1.0, 1.0, 1, NULL));
    PROFILE_REFUSED(EDO_SMC_MISALIGNED, edo_smc_profile_new_motor((edo_smc_profile_motor_t *)(void *)odd,
                                                                  sizeof profile, 1e-3, 1.0, 1.0, 1, NULL));
    PROFILE_REFUSED(EDO_SMC_MISALIGNED,
                    edo_smc_profile_new_motor(&profile, sizeof profile, 1e-3, 1.0, 1.0, 1, crooked));
    if (((uintptr_t)within & 7u) == 0) {
        PROFILE_REFUSED(EDO_SMC_OVERLAP,
                        edo_smc_profile_new_motor(&profile, sizeof profile, 1e-3, 1.0, 1.0, 1, within));
        PROFILE_REFUSED(EDO_SMC_OVERLAP, edo_smc_profile_limit_motor(&profile, 1.0, 1.0, within));
    }
}

static void profiles(void) {
    no_profile(EDO_SMC_NOT_INITIALISED);
    profile_limits();
    EXPECT(EDO_SMC_OK, profile_new(1e-3, 100.0, 1200.0, 10));
    EXPECT(0, refusal.field[0]);
    EXPECT(1, edo_smc_profile_has_arrived_motor(&profile));
    /* A profile of the other plant is rejected. */
    edo_smc_profile_joint_t other;
    memset(&other, 0, sizeof other);
    memcpy(&other, &profile, sizeof profile);
    EXPECT(EDO_SMC_NOT_INITIALISED, edo_smc_profile_stop_joint(&other));

    profile_limits();
    PROFILE_REFUSED(EDO_SMC_OUT_OF_RANGE, edo_smc_profile_limit_motor(&profile, NAN, 1200.0, &refusal));
    EXPECT(0, strcmp(refusal.field, "speed_rad_s"));
    PROFILE_REFUSED(EDO_SMC_OUT_OF_RANGE, edo_smc_profile_limit_motor(&profile, 100.0, 0.0, NULL));
    PROFILE_REFUSED(EDO_SMC_NOT_FINITE, edo_smc_profile_go_to_motor(&profile, 0, NAN));
    PROFILE_REFUSED(EDO_SMC_NOT_FINITE, edo_smc_profile_go_to_motor(&profile, 0, 7e9));
    PROFILE_REFUSED(EDO_SMC_NOT_FINITE, edo_smc_profile_start_motor(&profile, 0, INFINITY, 0.0));
    PROFILE_REFUSED(EDO_SMC_NOT_FINITE, edo_smc_profile_start_motor(&profile, 0, 0.0, NAN));
    PROFILE_REFUSED(EDO_SMC_PROFILE_SPEED, edo_smc_profile_start_motor(&profile, 0, 0.0, 1.6e3));
    PROFILE_REFUSED(EDO_SMC_PROFILE_RANGE, edo_smc_profile_keep_within_motor(&profile, 1, 0.0, 0, 6.0));
    PROFILE_REFUSED(EDO_SMC_NOT_FINITE, edo_smc_profile_keep_within_motor(&profile, 0, NAN, 1, 0.0));
    EXPECT(EDO_SMC_NULL, edo_smc_profile_limit_motor(NULL, 1.0, 1.0, NULL));
    EXPECT(EDO_SMC_NULL, edo_smc_profile_keep_within_motor(NULL, 0, 0.0, 1, 0.0));
    EXPECT(EDO_SMC_NULL, edo_smc_profile_go_to_motor(NULL, 0, 0.0));
    EXPECT(EDO_SMC_NULL, edo_smc_profile_stop_motor(NULL));
    EXPECT(EDO_SMC_NULL, edo_smc_profile_start_motor(NULL, 0, 0.0, 0.0));
    EXPECT(EDO_SMC_NULL, edo_smc_profile_next_motor(NULL, &aim));
    EXPECT(0, edo_smc_profile_has_arrived_motor(NULL));
    PROFILE_REFUSED(EDO_SMC_NULL, edo_smc_profile_next_motor(&profile, NULL));
    PROFILE_REFUSED(EDO_SMC_OVERLAP,
                    edo_smc_profile_next_motor(&profile, (edo_smc_target_motor_t *)(void *)&profile.words[40]));
    PROFILE_REFUSED(EDO_SMC_MISALIGNED,
                    edo_smc_profile_next_motor(&profile, (edo_smc_target_motor_t *)(void *)((char *)&aim + 1)));

    /* A goal beyond the range moves to the end of the range and rests there. */
    EXPECT(EDO_SMC_OK, edo_smc_profile_keep_within_motor(&profile, -1, 0.0, 2, 1.0));
    EXPECT(EDO_SMC_PROFILE_END, edo_smc_profile_go_to_motor(&profile, 3, 0.0));
    int ticks = 0;
    while (!edo_smc_profile_has_arrived_motor(&profile) && ticks < 1000) {
        EXPECT(EDO_SMC_OK, edo_smc_profile_next_motor(&profile, &aim));
        EXPECT(1, aim.r_dot >= 0.0f && aim.r_dot <= 100.0f);
        ticks++;
    }
    EXPECT(1, ticks > 200 && ticks < 320);
    EXPECT(2, aim.turn);
    EXPECT(1, aim.r > 0.99999f && aim.r < 1.00001f);

    /* Every word of a profile in motion in turn: a call continues or rejects it, within the bounds of memory. */
    EXPECT(EDO_SMC_OK, edo_smc_profile_go_to_motor(&profile, 0, 0.0));
    EXPECT(EDO_SMC_OK, edo_smc_profile_next_motor(&profile, &aim));
    const edo_smc_profile_motor_t good = profile;
    int damaged = 0, not_made = 0;
    for (size_t i = 0; i < 4 * (sizeof profile.words / 4); i++) {
        static const uint32_t wrong[] = {0u, 0x80000000u, 0xffffffffu, 0x7fffffffu};
        profile = good;
        profile.words[i / 4] = wrong[i % 4];
        const edo_smc_status_t status = edo_smc_profile_next_motor(&profile, &aim);
        damaged += status == EDO_SMC_DAMAGED;
        not_made += status == EDO_SMC_NOT_INITIALISED;
        EXPECT(1, status == EDO_SMC_OK || status == EDO_SMC_DAMAGED || status == EDO_SMC_NOT_INITIALISED);
        if (status != EDO_SMC_OK) {
            no_profile(status);
        } else {
            (void)edo_smc_profile_go_to_motor(&profile, 1, 1.0);
            (void)edo_smc_profile_limit_motor(&profile, 50.0, 500.0, NULL);
            (void)edo_smc_profile_start_motor(&profile, 1, 1.0, 10.0);
            EXPECT(EDO_SMC_OK, edo_smc_profile_stop_motor(&profile));
            EXPECT(EDO_SMC_OK, edo_smc_profile_next_motor(&profile, &aim));
        }
    }
    /* Acceleration and window must be at least 1; window and position of the oldest step must not be too large. */
    EXPECT(4, not_made);
    EXPECT(3 + 4 + 3, damaged);
    profile = good;
}

int main(void) {
    config.period_s = 1e-3;
    config.motor.inertia_kg_m2 = 2e-4;
    config.motor.torque_n_m_per_a = 0.05;
    config.encoder.bits = 14.0;
    config.encoder.counts_per_turn = 16384.0;
    config.encoder.gear_num = config.encoder.gear_den = 1.0;
    config.limits.min = -10.0;
    config.limits.max = 10.0;
    config.lag_s = 2e-4;
    EXPECT(EDO_SMC_OK, edo_smc_by_rule_motor_fast(&config, sizeof config));
    designs();
    memory();
    retuned();
    fences();
    plans();
    profiles();
    return checked();
}
