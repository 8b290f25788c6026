/* One drive of the static library (NAME, and MOTOR, JOINT or COUPLED), driven by requests: retunes in motion between
 * four designs, ticks with counts and targets, applied currents, missed ticks, restarts. Each answer has statuses,
 * output and estimates. The configurations precede the first answer: by rule, for COUPLED from exported_config. */
#include "edo_smc.h"

#define JOIN3(a, b, c) a##b##c
#define JOINED3(a, b, c) JOIN3(a, b, c)
#define CALL(function) JOINED3(edo_smc_##function, _, NAME)
#define TYPE(of) JOINED3(edo_smc_##of##_, NAME, _t)
#define DESIGNS 4

#ifdef MOTOR
#define ENCODERS 1
#define OTHER_PERIOD_S 2e-3
typedef edo_smc_config_motor_t config_t;
typedef edo_smc_sample_motor_t sample_t;
typedef edo_smc_estimates_motor_t estimates_t;
#else
#define ENCODERS 2
#define OTHER_PERIOD_S 8e-4
#ifdef COUPLED
typedef edo_smc_config_coupled_t config_t;
#else
typedef edo_smc_config_joint_t config_t;
#endif
typedef edo_smc_sample_joint_t sample_t;
typedef edo_smc_estimates_joint_t estimates_t;
#endif

enum { TICK, REPORT, RESET, RETUNE, MISSED };

static struct {
    uint32_t what, which, lost, counts[2];
    int32_t turns[2];
    float jets[2][4];
    float held;
} asks[16];

#define WORDS (7 + 1 + 4 * ENCODERS)
static uint32_t replies_of[16][WORDS];
static config_t config;
static TYPE(design) designs[DESIGNS];
static TYPE(state) state;
#ifdef FENCED
static const edo_smc_fence_limits_t limits = {LOW_RAD, HIGH_RAD, MAX_SPEED_RAD_S, FOLLOWING_RAD};
static edo_smc_fence_t fence;
#endif

static uint32_t bits(float number) {
    union {
        float number;
        uint32_t word;
    } both;
    both.number = number;
    return both.word;
}

/* Data sheet, rule, and the differences between the designs. */
static edo_smc_status_t configure(int which) {
    edo_smc_status_t status;
#ifdef MOTOR
    static const config_t data_sheet = {
        .period_s = 1e-3,
        .motor = {.inertia_kg_m2 = 2e-4, .torque_n_m_per_a = 0.05, .damping_n_m_s = 1e-5},
        .encoder = {.bits = 14, .counts_per_turn = 16384, .gear_num = 1, .gear_den = 1},
        .limits = {.min = -10.0, .max = 8.0},
        .lag_s = 3e-4,
    };
#elif defined COUPLED
    const config_t data_sheet = exported_config;
#else
    static const config_t data_sheet = {
        .period_s = 1e-3,
        .joint = {.link_inertia_kg_m2 = 0.23,
                  .link_damping_n_m_s = 0.07,
                  .weight_n_m = 0.23,
                  .stiffness_n_m = 9.0,
                  .motor_inertia_kg_m2 = 9.31e-4,
                  .motor_damping_n_m_s = 0.07,
                  .torque_n_m_per_a = 0.119},
        .encoders = {{20, 1048576, 1, 1}, {18, 262144, 1, 1}},
        .limits = {.min = -30.0, .max = 25.0},
        .load_n_m = 1.3,
    };
#endif
    config = data_sheet;
    if (which == 2) {
        config.period_s = OTHER_PERIOD_S;
    }
    if (which == 3) {
#ifdef MOTOR
        config.encoder.counts_per_turn = 8192;
#else
        config.encoders[1].counts_per_turn *= 0.5;
#endif
    }
#ifdef COUPLED
    /* Sets the innovation gates for the changed values. */
    status = CALL(tune)(&config, sizeof config, config.bandwidths.surface_rad_s);
#else
    status = CALL(by_rule)(&config, sizeof config);
#endif
    if (which == 1 && status == EDO_SMC_OK) {
        status = CALL(tune)(&config, sizeof config, 0.7 * config.bandwidths.surface_rad_s);
        config.hold = 0;
        config.safe_u = -0.25;
    }
    if (which == 2) {
        config.uncertain = 0.5;
        config.stops_at = EDO_SMC_BEYOND_CONTROL;
    }
    return status;
}

static void put(uint32_t *word, const estimates_t *known) {
    *word++ = (uint32_t)known->turn;
#ifdef MOTOR
    *word++ = bits(known->position);
    *word++ = bits(known->speed);
    *word++ = bits(known->disturbance);
    *word++ = bits(known->load);
#else
    for (int i = 0; i < 2; i++) {
        *word++ = bits(known->position[i]);
        *word++ = bits(known->speed[i]);
        *word++ = bits(known->disturbance[i]);
        *word++ = bits(known->load[i]);
    }
#endif
}

int main(void) {
    unsigned running = 0;
    size_t count;
    for (int which = 0; which < DESIGNS; which++) {
        if (configure(which) != EDO_SMC_OK ||
            CALL(design)(&config, sizeof config, &designs[which], sizeof designs[which], NULL) != EDO_SMC_OK) {
            return 1;
        }
        send(&config, sizeof config);
#ifdef FENCED
        if (which == 0 && CALL(fence)(&config, sizeof config, &limits, &fence, sizeof fence, NULL) != EDO_SMC_OK) {
            return 3;
        }
#endif
    }
    if (CALL(design_size)() != sizeof designs[0] || CALL(state_size)() != sizeof state ||
        CALL(init)(&designs[0], sizeof designs[0], &state, sizeof state) != EDO_SMC_OK) {
        return 2;
    }
    while ((count = receive(asks, sizeof asks) / sizeof asks[0]) > 0) {
        for (size_t k = 0; k < count; k++) {
            uint32_t *const reply = replies_of[k];
            edo_smc_output_t output = {0};
            estimates_t known = {0};
            sample_t sample = {0};
            sample.lost = asks[k].lost;
#ifdef MOTOR
            sample.count = asks[k].counts[0];
#else
            sample.link = asks[k].counts[0];
            sample.motor = asks[k].counts[1];
#endif
            for (int at_end = 0; at_end < 2; at_end++) {
                const float *const jet = asks[k].jets[at_end];
#ifdef MOTOR
                const edo_smc_target_motor_t target = {asks[k].turns[at_end], jet[0], jet[1]};
#else
                const edo_smc_target_joint_t target = {asks[k].turns[at_end], jet[0], jet[1], jet[2], jet[3]};
#endif
                if (at_end) {
                    sample.end = target;
                } else {
                    sample.begin = target;
                }
            }
            reply[0] = 0;
            if (asks[k].what == REPORT) {
                reply[0] = (uint32_t)CALL(report_applied)(&state, asks[k].held);
            } else if (asks[k].what == RESET) {
                reply[0] = (uint32_t)CALL(reset)(&state);
            } else if (asks[k].what == RETUNE) {
                const unsigned other = asks[k].which;
                reply[0] = (uint32_t)CALL(retune)(&designs[running], &designs[other], sizeof designs[other], &state,
                                                  &sample);
                if (reply[0] == 0) {
                    running = other;
                }
            }
            if (asks[k].what == MISSED) {
                reply[0] = (uint32_t)CALL(missed)(&designs[running], &state, asks[k].which);
            }
            reply[1] = 0;
            if (asks[k].what == TICK || asks[k].what == RETUNE) {
                /* A tick continues or starts: both calls give the same bits. */
                reply[1] = (uint32_t)CALL(go_on)(&designs[running], &state, &sample, &output);
                if (reply[1] == (uint32_t)EDO_SMC_NOT_STARTED) {
                    reply[1] = (uint32_t)CALL(tick)(&designs[running], &state, &sample, &output);
                }
            }
#ifdef FENCED
            if (asks[k].what == TICK || asks[k].what == RETUNE) {
                const edo_smc_status_t guarded = CALL(guard)(&designs[running], &state, &fence, &sample, &output);
                if (guarded != EDO_SMC_OK && guarded != EDO_SMC_NOT_STARTED) {
                    return 4;
                }
            }
#endif
            reply[2] = bits(output.u);
            reply[3] = bits(output.sigma);
            reply[4] = bits(output.sigma_star);
            reply[5] = output.health;
            reply[6] = (uint32_t)CALL(estimates)(&designs[running], &state, &known);
            put(&reply[7], &known);
        }
        send(replies_of, count * sizeof replies_of[0]);
    }
    return 0;
}
