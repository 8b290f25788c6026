/* Profiles of the static library (NAME, and MOTOR or JOINT), driven by requests: goals, ranges, limits, stops, starts,
 * and the targets of the following ticks. */
#include "edo_smc.h"

#define JOIN3(a, b, c) a##b##c
#define JOINED3(a, b, c) JOIN3(a, b, c)
#define CALL(function) JOINED3(edo_smc_profile_##function, _, NAME)
#define TYPE(of) JOINED3(edo_smc_##of##_, NAME, _t)
#ifdef MOTOR
#define PERIOD_S 1e-3
#define DERIVATIVES 2
#else
#define PERIOD_S 2e-4
#define DERIVATIVES 4
#endif

enum { NEW, GO_TO, STOP, WITHIN, LIMIT, START };

static struct {
    double numbers[2];
    uint32_t what, window, ticks;
    int32_t turns[2];
    uint32_t unused;
} asks[16];
static uint32_t replies_of[16][4 + DERIVATIVES];

static uint32_t bits(float number) {
    union {
        float number;
        uint32_t word;
    } both;
    both.number = number;
    return both.word;
}

static void put(uint32_t *word, const TYPE(target) *target) {
    word[0] = (uint32_t)target->turn;
    word[1] = bits(target->r);
    word[2] = bits(target->r_dot);
#ifdef JOINT
    word[3] = bits(target->r_ddot);
    word[4] = bits(target->r_dddot);
#endif
}

int main(void) {
    static TYPE(profile) profile;
    size_t count;
    while ((count = receive(asks, sizeof asks) / sizeof asks[0]) > 0) {
        for (size_t k = 0; k < count; k++) {
            uint32_t *const reply = replies_of[k];
            const double *const x = asks[k].numbers;
            const int32_t *const turns = asks[k].turns;
            TYPE(target) last = {0};
            uint32_t sum = 0x811c9dc5u;
            edo_smc_status_t status;
            switch (asks[k].what) {
            /* A rejected request leaves a profile in motion unchanged. */
            case NEW:
                status = CALL(new)(&profile, sizeof profile, PERIOD_S, x[0], x[1], asks[k].window, NULL);
                break;
            case GO_TO: status = CALL(go_to)(&profile, turns[0], x[0]); break;
            case STOP: status = CALL(stop)(&profile); break;
            case WITHIN: status = CALL(keep_within)(&profile, turns[0], x[0], turns[1], x[1]); break;
            case LIMIT: status = CALL(limit)(&profile, x[0], x[1], NULL); break;
            default: status = CALL(start)(&profile, turns[0], x[0], x[1]); break;
            }
            for (uint32_t tick = 0; tick < asks[k].ticks; tick++) {
                uint32_t words[1 + DERIVATIVES];
                if (CALL(next)(&profile, &last) != EDO_SMC_OK) {
                    return 1;
                }
                put(words, &last);
                for (int i = 0; i < 1 + DERIVATIVES; i++) {
                    sum = (sum ^ words[i]) * 0x01000193u;
                }
            }
            reply[0] = (uint32_t)status;
            reply[1] = sum;
            reply[2] = CALL(has_arrived)(&profile);
            put(&reply[3], &last);
        }
        send(replies_of, count * sizeof replies_of[0]);
    }
    return 0;
}
