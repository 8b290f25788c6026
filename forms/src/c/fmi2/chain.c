/* $title$
 * FMI 2.0. Exported by version $version$ of the library. Do not edit; export again.
 *
 * Compile this file alone; it includes the others. Compile with -std=c99 -ffp-contract=off: $identifier$.h gives the
 * reasons. */
$head$#include "$identifier$.h"

#define FMU_GUID "$guid$"
#define FMU_PERIOD_S $period$
#define FMU_INPUTS $inputs$
#define FMU_OUTPUTS $outputs$
#define FMU_BOOLEANS 1
#define FMU_STATES 0

typedef @_state fmu_memory;

static void fmu_start(fmu_memory *memory, fmi2Real in[], fmi2Real x[], fmi2Boolean flag[]);
static fmi2Integer fmu_compute(fmu_memory *memory, const fmi2Real in[], const fmi2Boolean flag[],
                               fmi2Real out[]);

#include "fmi2_wrapper.h"

static void fmu_start(fmu_memory *memory, fmi2Real in[], fmi2Real x[], fmi2Boolean flag[])
{
    (void)memory;
    (void)x;
    (void)flag;
    in[FMU_INPUTS - 1] = NAN;
}

static fmi2Integer fmu_compute(fmu_memory *memory, const fmi2Real in[], const fmi2Boolean flag[],
                               fmi2Real out[])
{
    @_output output;
    float x[@@_N];
    float d_hat[@@_N][@@_R];
    if (flag[0] != fmi2False) {
        @_reset(memory);
    } else if (in[FMU_INPUTS - 1] == in[FMU_INPUTS - 1]) {
        (void)@_report_applied(memory, (float)in[FMU_INPUTS - 1]);
    }
    for (int i = 0; i < @@_N; i++) {
        x[i] = (float)in[i];
    }
    const unsigned health = @_tick_or_start(memory, x, &output);
    (void)@_estimates(memory, d_hat);
    out[0] = (double)output.u;
    out[1] = (double)output.sigma;
    out[2] = (double)output.sigma_star;
$known$    return (fmi2Integer)health;
}
