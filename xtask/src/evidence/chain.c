/* Every function of an exported chain, in any order, with anything: for an analyser, not to be run. */
#include "@.h"
static volatile float number;
static volatile unsigned any;
static @_state state;
static @_output output;
static float estimates[@@_N][@@_R];

int main(void)
{
    for (;;) {
        float x[@@_N];
        for (int i = 0; i < @@_N; i++) {
            x[i] = number;
        }
        switch (any) {
        case 0u: (void)@_report_applied(&state, number); break;
        case 1u: (void)@_estimates(&state, estimates); break;
        case 2u: @_reset(&state); break;
        default: (void)@_tick_or_start(&state, x, &output); break;
        }
    }
}
