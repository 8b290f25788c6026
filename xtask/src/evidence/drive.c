/* Every function of an exported drive, monitors and plans included, in any order, with anything: for an analyser, not to
 * be run. A sine is asked for with a whole frequency: the analyser keeps NaN after a comparison that none passes. */
#include "@.h"
static volatile float number;
static volatile unsigned any;
static volatile @_target target;
static volatile @_jet present;
static @_state state;
static @_monitor monitor;
static @_plan plan;
static @_output output;
static @_estimates_of estimates;

int main(void)
{
    for (;;) {
        const uint32_t tick = any;
        const @_jet jet = present;
        @_sample sample;
        COUNTS
        sample.begin = target;
        sample.end = target;
        if (any != 0u) {
            @_plan_at(&plan, tick, &sample.begin);
            @_plan_at(&plan, tick + 1u, &sample.end);
        }
        switch (any) {
        case 0u: (void)@_tick_or_start(&state, &sample, &output); break;
        case 1u: (void)@_lost(&state, &output); break;
        case 2u: (void)@_watched_tick(&monitor, &state, &sample, &output); break;
        case 3u: (void)@_watched_lost(&monitor, &state, &output); break;
        case 4u: (void)@_report_applied(&state, number); break;
        case 5u: (void)@_estimates(&state, &estimates); break;
        case 6u: @_reset(&state); break;
        case 7u: @_watched_reset(&monitor, &state); break;
        case 8u: (void)@_plan_rest(&plan, present.turn, number); break;
        case 9u: (void)@_plan_move(&plan, &jet, tick, any, present.turn, number); break;
        case 10u: (void)@_plan_stop(&plan, &jet, tick, any); break;
        default: (void)@_plan_sine(&plan, &jet, tick, any, (double)number, (double)any); break;
        }
    }
}
