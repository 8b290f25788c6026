/* Prints the targets of a plan of an exported drive, one line per tick from 0: position and derivatives at the end of
 * the tick in which u is held. Arguments: start, ticks, last, then amplitude and frequency of a sine, or turn and angle
 * of a move after the letter m. */
#include DRIVE
#include <stdio.h>
#include <stdlib.h>

#define TAU 6.283185307179586

int main(int count, char **words)
{
    edo_smc_plan plan;
    edo_smc_jet jet;
    edo_smc_target target;
    if (count != 7) {
        return 2;
    }
    const uint32_t start = (uint32_t)atoi(words[1]);
    const uint32_t ticks = (uint32_t)atoi(words[2]);
    bool is_made = edo_smc_plan_rest(&plan, 0, 0.0f);
    edo_smc_plan_jet(&plan, start, &jet);
    if (words[4][0] == 'm') {
        is_made = is_made && edo_smc_plan_move(&plan, &jet, start, ticks, atoi(words[5]), (float)atof(words[6]));
    } else {
        is_made = is_made && edo_smc_plan_sine(&plan, &jet, start, ticks, atof(words[5]), TAU * atof(words[6]));
    }
    for (uint32_t tick = 0; is_made && (tick <= (uint32_t)atoi(words[3])); tick++) {
        edo_smc_plan_at(&plan, tick + 1u + EDO_SMC_DELAY_TICKS, &target);
        printf("%.17g %.9g", (TAU * target.turn) + (double)target.r, (double)target.r_dot);
#ifdef EDO_SMC_STIFFNESS_N_M
        printf(" %.9g %.9g", (double)target.r_ddot, (double)target.r_dddot);
#endif
        printf("\n");
    }
    return is_made ? 0 : 1;
}
