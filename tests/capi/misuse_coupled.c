/* Every detectable caller error with a coupled joint, and the drive in motion. Every number out of range is rejected by
 * name, and every overwritten word is detected. A re-tune causes no step in u, and reported missing ticks are
 * compensated. The plant is a harmonic drive, 100 : 1. C99 and C++. */
#include <math.h>
#include <string.h>

#include "checks.h"
#include "edo_smc.h"

#define PERIOD_S 1e-3
#define TURN_RAD 6.283185307179586

typedef edo_smc_config_coupled_t config_t;
typedef edo_smc_design_coupled_fast_t design_t;
typedef edo_smc_state_coupled_fast_t state_t;

static config_t config;
static design_t design, other_design;
static state_t state;
static edo_smc_sample_joint_t sample;
static edo_smc_output_t output;
static edo_smc_estimates_joint_t known;
static edo_smc_refusal_t refusal;

/* Checks that a rejected call leaves state and design unchanged. */
#define REFUSED(status, call)                                                                                          \
    do {                                                                                                               \
        const state_t state_was = state;                                                                               \
        const design_t design_was = design;                                                                            \
        expect_at(__LINE__, status, call);                                                                             \
        expect_at(__LINE__, 0, memcmp(&state, &state_was, sizeof state));                                              \
        expect_at(__LINE__, 0, memcmp(&design, &design_was, sizeof design));                                           \
    } while (0)

static void configure(void) {
    static const edo_smc_encoder_t link = {19, 524288, 1, 1, 0}, motor = {32, 16384, 100, 1, 0};
    memset(&config, 0, sizeof config);
    config.period_s = PERIOD_S;
    config.joint.link_inertia_kg_m2 = 0.4;
    config.joint.link_damping_n_m_s = 0.5;
    config.joint.weight_n_m = 10.0;
    config.joint.stiffness_n_m = 8000.0;
    config.joint.motor_inertia_kg_m2 = 1.2;
    config.joint.motor_damping_n_m_s = 2.0;
    config.joint.torque_n_m_per_a = 8.0;
    config.encoders[0] = link;
    config.encoders[1] = motor;
    config.limits.min = -8.0;
    config.limits.max = 8.0;
    config.bandwidths.surface_rad_s = 45.0;
    config.bandwidths.link_rad_s = 170.0;
    config.bandwidths.motor_rad_s = 230.0;
    config.bandwidths.reaching_per_s = 80.0;
    config.bandwidths.offset_per_s = 22.5;
    config.fast_ratios[0] = 1.6;
    config.fast_ratios[1] = 1.4;
    config.switching.calm_steps = 1.5;
    config.switching.alert_steps = 4.0;
    config.lost_ticks = 50.0;
    config.hold = 1.0;
    config.coupled.lag_s = 2e-4;
    config.coupled.resolution_rad[0] = TURN_RAD / 524288.0;
    config.coupled.resolution_rad[1] = TURN_RAD / 1638400.0;
    config.coupled.calm_steps[0] = 1.5;
    config.coupled.calm_steps[1] = 1.5;
    config.load_n_m = 20.0;
    config.uncertain = 0.2;
    config.stops_at = EDO_SMC_BRAKING;
    /* Sets the innovation gates, and the smoothing that fits the observers. */
    EXPECT(EDO_SMC_OK, edo_smc_tune_coupled_fast(&config, sizeof config, config.bandwidths.surface_rad_s));
    EXPECT(0, config.bandwidths.link_rad_s != 170.0 || config.bandwidths.offset_per_s != 22.5);
    EXPECT(1, config.gate_steps[0] >= 8.0 && config.gate_steps[0] < 1e6 && config.gate_steps[1] >= 8.0 &&
                  config.gate_steps[1] < 1e6 && config.switching.smoothing_s > 0.0 && config.switching.keep_s > 0.0);
}

static edo_smc_status_t redesign(void) {
    return edo_smc_design_coupled_fast(&config, sizeof config, &design, sizeof design, &refusal);
}

static edo_smc_status_t init(void) {
    return edo_smc_init_coupled_fast(&design, sizeof design, &state, sizeof state);
}

static edo_smc_status_t tick(void) {
    return edo_smc_tick_coupled_fast(&design, &state, &sample, &output);
}

/* A configuration with one wrong number, which the refusal names, then corrected. */
#define BAD_NUMBER_OF(named, name, number)                                                                             \
    do {                                                                                                               \
        const config_t right = config;                                                                                 \
        config.name = number;                                                                                          \
        REFUSED(EDO_SMC_OUT_OF_RANGE, redesign());                                                                     \
        expect_at(__LINE__, 0, strcmp(refusal.field, named));                                                          \
        expect_at(__LINE__, 1, !(refusal.given >= refusal.low && refusal.given <= refusal.high));                      \
        config = right;                                                                                                \
    } while (0)
#define BAD_NUMBER(name, number) BAD_NUMBER_OF(#name, name, number)

/* Every number of a configuration, out of its range. */
static void numbers(void) {
    BAD_NUMBER(period_s, 0.1);
    BAD_NUMBER(period_s, 0.0);
    BAD_NUMBER(joint.link_inertia_kg_m2, 0.0);
    BAD_NUMBER(joint.link_damping_n_m_s, -1.0);
    BAD_NUMBER(joint.weight_n_m, -1.0);
    BAD_NUMBER(joint.stiffness_n_m, 0.0);
    BAD_NUMBER(joint.motor_inertia_kg_m2, -1.0);
    BAD_NUMBER(joint.motor_damping_n_m_s, 1e9);
    BAD_NUMBER(joint.torque_n_m_per_a, -8.0);
    for (int i = 0; i < 2; i++) {
        const char *const named = i == 0 ? "encoders[0]" : "encoders[1]";
        BAD_NUMBER_OF(named, encoders[i].bits, 1.0);
        BAD_NUMBER_OF(named, encoders[i].counts_per_turn, 3.0);
        BAD_NUMBER_OF(named, encoders[i].gear_num, 0.0);
        BAD_NUMBER_OF(named, encoders[i].gear_den, 0.0);
        BAD_NUMBER_OF(named, encoders[i].states, 1.0);
    }
    BAD_NUMBER(limits.min, 1.0);
    BAD_NUMBER(limits.max, INFINITY);
    BAD_NUMBER(bandwidths.surface_rad_s, 1.1e3);
    BAD_NUMBER(bandwidths.surface_rad_s, 0.0);
    BAD_NUMBER(bandwidths.link_rad_s, 2.1e3);
    BAD_NUMBER(bandwidths.motor_rad_s, 4.1e3);
    BAD_NUMBER(bandwidths.reaching_per_s, 44.0);
    BAD_NUMBER(bandwidths.reaching_per_s, 2.1e3);
    BAD_NUMBER(bandwidths.offset_per_s, -1.0);
    BAD_NUMBER(fast_ratios[0], 0.4);
    BAD_NUMBER(fast_ratios[1], 5.1);
    BAD_NUMBER(switching.calm_steps, -1.0);
    BAD_NUMBER(switching.alert_steps, 0.0);
    BAD_NUMBER(switching.smoothing_s, -1.0);
    BAD_NUMBER(switching.keep_s, -1.0);
    BAD_NUMBER(gate_steps[0], 1.0);
    BAD_NUMBER(gate_steps[1], 1.0);
    BAD_NUMBER(lost_ticks, 0.0);
    BAD_NUMBER(coupled.lag_s, 0.2);
    BAD_NUMBER(coupled.lag_s, -1e-4);
    BAD_NUMBER(coupled.resolution_rad[0], 0.0);
    BAD_NUMBER(coupled.resolution_rad[1], 2.0);
    BAD_NUMBER(coupled.calm_steps[0], 0.0);
    BAD_NUMBER(coupled.calm_steps[1], INFINITY);
    BAD_NUMBER(load_n_m, -1.0);
    BAD_NUMBER(uncertain, 0.95);
    BAD_NUMBER(stops_at, 32768.0);
    config.hold = 0.0;
    BAD_NUMBER_OF("fallback", safe_u, 9.0);
    config.hold = 1.0;
    /* Each number as NaN; an integer is then read as 0, and hold is not 1. */
    for (size_t i = 0; i < sizeof config / sizeof(double); i++) {
        const config_t right = config;
        double words[sizeof config / sizeof(double)];
        memcpy(words, &config, sizeof words);
        words[i] = NAN;
        memcpy(&config, words, sizeof config);
        const edo_smc_status_t status = redesign();
        const int is_free = memcmp(&config.encoders[0].states, &right.encoders[0].states, sizeof(double)) != 0 ||
                            memcmp(&config.encoders[1].states, &right.encoders[1].states, sizeof(double)) != 0 ||
                            memcmp(&config.hold, &right.hold, sizeof(double)) != 0 ||
                            memcmp(&config.safe_u, &right.safe_u, sizeof(double)) != 0;
        EXPECT(is_free ? EDO_SMC_OK : EDO_SMC_OUT_OF_RANGE, status);
        EXPECT(is_free, refusal.field[0] == 0);
        config = right;
    }
    /* A tuning to an invalid bandwidth is rejected; a tuning back restores the design. */
    const config_t right = config;
    EXPECT(EDO_SMC_OK, edo_smc_tune_coupled_fast(&config, sizeof config, 600.0));
    REFUSED(EDO_SMC_OUT_OF_RANGE, redesign());
    EXPECT(0, strcmp(refusal.field, "bandwidths.link_rad_s"));
    config = right;
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

static void memory(void) {
    edo_smc_refusal_t *const within = (edo_smc_refusal_t *)(void *)&config;
    EXPECT(EDO_SMC_NULL, edo_smc_tune_coupled_fast(NULL, sizeof config, 10.0));
    EXPECT(EDO_SMC_SIZE, edo_smc_tune_coupled_fast(&config, sizeof(edo_smc_config_joint_t), 10.0));
    REFUSED(EDO_SMC_NULL, edo_smc_design_coupled_fast(NULL, sizeof config, &design, sizeof design, NULL));
    REFUSED(EDO_SMC_SIZE, edo_smc_design_coupled_fast(&config, sizeof(edo_smc_config_joint_t), &design, sizeof design,
                                                      NULL));
    REFUSED(EDO_SMC_OVERLAP, edo_smc_design_coupled_fast(&config, sizeof config, &design, sizeof design, within));
    BAD_DESIGN(EDO_SMC_WRONG_VERSION, design.version ^= 0x100u);
    BAD_DESIGN(EDO_SMC_WRONG_INSTANCE, design.instance ^= 0x100u);
    for (size_t i = 0; i < sizeof design.words / 4; i++) {
        BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.words[i] ^= 1u);
    }
    BAD_DESIGN(EDO_SMC_BAD_COEFFICIENTS, design.check += 1u);
    /* Designs of another form have the same number of words. */
    edo_smc_state_coupled_fast_late_t late;
    EXPECT(EDO_SMC_WRONG_INSTANCE,
           edo_smc_init_coupled_fast_late((const edo_smc_design_coupled_fast_late_t *)(const void *)&design,
                                          sizeof(edo_smc_design_coupled_fast_late_t), &late, sizeof late));
    EXPECT(EDO_SMC_OK, init());
    REFUSED(EDO_SMC_NOT_STARTED, edo_smc_missed_coupled_fast(&design, &state, 1));
    REFUSED(EDO_SMC_NOT_STARTED, edo_smc_report_applied_coupled_fast(&state, 1.0f));
    REFUSED(EDO_SMC_NOT_STARTED, edo_smc_estimates_coupled_fast(&design, &state, &known));
    for (int k = 0; k < 12; k++) {
        (void)tick();
    }
    EXPECT(EDO_SMC_OK, tick());
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
        EXPECT(1, status < 0 || (output.u >= -8.0f && output.u <= 8.0f));
    }
    EXPECT(2, damaged);
    state = good;
    EXPECT(EDO_SMC_OK, edo_smc_trip_coupled_fast(&design, &state));
    EXPECT(EDO_SMC_OK, tick());
    EXPECT(EDO_SMC_BRAKES, output.health & EDO_SMC_BRAKES);
    EXPECT(EDO_SMC_OK, edo_smc_reset_coupled_fast(&state));
}

/* Simulated plant in double: link and motor, with the lag of the current. */
static double angle[2], speed[2], current;

static void advance(double u, double load_n_m) {
    const double h = PERIOD_S / 200.0;
    for (int k = 0; k < 200; k++) {
        const double twist = 8000.0 * (angle[1] - angle[0]);
        current += h / 2e-4 * (u - current);
        speed[0] += h * (twist - 0.5 * speed[0] - 10.0 * sin(angle[0]) - load_n_m) / 0.4;
        speed[1] += h * (8.0 * current - twist - 2.0 * speed[1]) / 1.2;
        angle[0] += h * speed[0];
        angle[1] += h * speed[1];
    }
}

static uint32_t count(double rad, double counts_per_turn) {
    return (uint32_t)(int32_t)floor(rad / TURN_RAD * counts_per_turn + 0.5);
}

/* A move of 1 rad with a re-tune, three missing ticks, and a load at the end. Checks the largest error, and the steps
 * of u during the move, at the re-tune, and after the missing ticks. */
static void moving(int is_told) {
    static edo_smc_plan_joint_t rest, plan;
    const design_t *running = &design;
    double worst = 0.0, step = 0.0, retuned = 0.0, after = 0.0, last = 0.0;
    unsigned health = 0;
    memset(angle, 0, sizeof angle);
    memset(speed, 0, sizeof speed);
    current = 0.0;
    memset(&sample, 0, sizeof sample);
    EXPECT(EDO_SMC_OK, redesign());
    EXPECT(EDO_SMC_OK, init());
    EXPECT(EDO_SMC_OK, edo_smc_plan_move_joint(&plan, &rest, 100, 1000, PERIOD_S, 0, 1.0f));
    for (uint32_t now = 0; now < 2000; now++) {
        const double load = now >= 1500 ? 9.0 : 0.0;
        if (now == 400) {
            /* Three missing interrupts; the current is held. */
            for (int k = 0; k < 3; k++, now++) {
                EXPECT(EDO_SMC_OK, edo_smc_plan_play_joint(&plan, now + 1, &sample.end));
                advance(output.u, load);
            }
            if (is_told) {
                EXPECT(EDO_SMC_OK, edo_smc_missed_coupled_fast(running, &state, 3));
            }
        }
        sample.link = count(angle[0], 524288.0);
        sample.motor = count(angle[1], 1638400.0);
        sample.begin = sample.end;
        EXPECT(EDO_SMC_OK, edo_smc_plan_play_joint(&plan, now + 1, &sample.end));
        worst = fmax(worst, fabs(angle[0] - (double)sample.begin.r));
        if (now == 600) {
            EXPECT(EDO_SMC_OK, edo_smc_tune_coupled_fast(&config, sizeof config, 30.0));
            EXPECT(EDO_SMC_OK, edo_smc_design_coupled_fast(&config, sizeof config, &other_design, sizeof other_design,
                                                           &refusal));
            EXPECT(EDO_SMC_OK,
                   edo_smc_retune_coupled_fast(&design, &other_design, sizeof other_design, &state, &sample));
            REFUSED(EDO_SMC_OTHER_DESIGN, tick());
            running = &other_design;
        }
        const edo_smc_status_t status = edo_smc_tick_coupled_fast(running, &state, &sample, &output);
        EXPECT(1, status == EDO_SMC_OK || (status == EDO_SMC_REJECTED && now < 20));
        health |= now < 20 ? 0u : output.health;
        const double changed = fabs((double)output.u - last);
        if (now == 600) {
            retuned = changed;
        } else if (now == 403) {
            after = changed;
        } else if (now > 120 && now < 1400) {
            step = fmax(step, changed);
        }
        last = (double)output.u;
        advance(output.u, load);
    }
#ifdef TELL
    printf("error %.2e rad, steps of u %.3f A, at the re-tune %.3f A, after the gap %.3f A, health %u\n", worst, step,
           retuned, after, health);
#endif
    EXPECT(1, retuned < 0.05);
    /* Without a call of `missed` u has a step. */
    EXPECT(1, is_told ? after < 0.2 && worst < 3e-3 && health == 0 : after > 1.0);
    EXPECT(EDO_SMC_OK, edo_smc_estimates_coupled_fast(running, &state, &known));
    /* At the end the estimates of load and link position are correct. */
    EXPECT(1, fabs((double)known.load[0] - 9.0) < 0.5);
    EXPECT(1, fabs((double)known.position[0] - angle[0]) < 1e-4 && known.turn == 0);
}

/* A drive beyond its fence brakes. */
static void fences(void) {
    static const edo_smc_fence_limits_t limits = {-INFINITY, 2.0, 50.0, 0.5};
    static edo_smc_fence_t fence;
    EXPECT(EDO_SMC_SIZE, edo_smc_fence_coupled_fast(&config, sizeof(edo_smc_config_joint_t), &limits, &fence,
                                                    sizeof fence, NULL));
    EXPECT(EDO_SMC_OK, edo_smc_fence_coupled_fast(&config, sizeof config, &limits, &fence, sizeof fence, &refusal));
    EXPECT(EDO_SMC_OK, edo_smc_guard_coupled_fast(&other_design, &state, &fence, &sample, &output));
    EXPECT(0, output.health);
    sample.begin.r += 0.6f;
    EXPECT(EDO_SMC_OK, edo_smc_guard_coupled_fast(&other_design, &state, &fence, &sample, &output));
    EXPECT(EDO_SMC_FOLLOWING_ERROR, output.health);
    sample.begin.r -= 0.6f;
    EXPECT(EDO_SMC_OK, edo_smc_tick_coupled_fast(&other_design, &state, &sample, &output));
    EXPECT(EDO_SMC_BRAKES, output.health & EDO_SMC_BRAKES);
}

int main(void) {
    configure();
    EXPECT(EDO_SMC_OK, redesign());
    numbers();
    memory();
    moving(0);
    configure();
    moving(1);
    fences();
    return checked();
}
