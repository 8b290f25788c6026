/* Plans of the static library (NAME, and MOTOR or JOINT), driven by requests: each plan starts from the last accepted
 * one and returns targets. */
#include "edo_smc.h"

#define JOIN3(a, b, c) a##b##c
#define JOINED3(a, b, c) JOIN3(a, b, c)
#define CALL(function) JOINED3(edo_smc_plan_##function, _, NAME)
#define TYPE(of) JOINED3(edo_smc_##of##_, NAME, _t)
#ifdef MOTOR
#define DERIVATIVES 2
#else
#define DERIVATIVES 4
#endif
#define ASKED 5

enum { REST, MOVE, STOP, SINE };

static struct {
    double amplitude, omega, period_s;
    uint32_t what, start, ticks;
    int32_t turn;
    float angle;
    uint32_t at[ASKED];
} asks[16];
static uint32_t replies_of[16][1 + ASKED * (1 + DERIVATIVES)];

static uint32_t bits(float number) {
    union {
        float number;
        uint32_t word;
    } both;
    both.number = number;
    return both.word;
}

int main(void) {
    static TYPE(plan) plans[2]; /* zeros: rest at angle 0 */
    unsigned played = 0;
    size_t count;
    while ((count = receive(asks, sizeof asks) / sizeof asks[0]) > 0) {
        for (size_t k = 0; k < count; k++) {
            uint32_t *word = replies_of[k];
            const TYPE(plan) *const from = &plans[played];
            TYPE(plan) *const plan = &plans[played ^ 1u];
            const uint32_t start = asks[k].start, ticks = asks[k].ticks;
            const double period_s = asks[k].period_s;
            edo_smc_status_t status;
            switch (asks[k].what) {
            case REST: status = CALL(rest)(plan, asks[k].turn, asks[k].angle); break;
            case MOVE: status = CALL(move)(plan, from, start, ticks, period_s, asks[k].turn, asks[k].angle); break;
            case STOP: status = CALL(stop)(plan, from, start, ticks, period_s); break;
            default:
                status = CALL(sine)(plan, from, start, ticks, period_s, asks[k].amplitude, asks[k].omega);
                break;
            }
            if (status == EDO_SMC_OK) {
                played ^= 1u;
            }
            *word++ = status == EDO_SMC_OK;
            for (int j = 0; j < ASKED; j++) {
                TYPE(target) target;
                TYPE(plan) gone_along = plans[played];
                TYPE(target) again;
                if (CALL(at)(&plans[played], asks[k].at[j], &target) != EDO_SMC_OK ||
                    CALL(play)(&gone_along, asks[k].at[j], &again) != EDO_SMC_OK) {
                    return 1;
                }
                if (bits(again.r) != bits(target.r) || bits(again.r_dot) != bits(target.r_dot)) {
                    return 2;
                }
                *word++ = (uint32_t)target.turn;
                *word++ = bits(target.r);
                *word++ = bits(target.r_dot);
#ifdef JOINT
                *word++ = bits(target.r_ddot);
                *word++ = bits(target.r_dddot);
#endif
            }
        }
        send(replies_of, count * sizeof replies_of[0]);
    }
    return 0;
}
