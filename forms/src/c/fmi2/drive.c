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
#define FMU_BOOLEANS 2
#define FMU_STATES 0
#define FMU_TAU 6.283185307179586

typedef struct {
    @_state state;
    @_monitor monitor;
    @_sample sample;
    bool has_target;
} fmu_memory;

static void fmu_start(fmu_memory *memory, fmi2Real in[], fmi2Real x[], fmi2Boolean flag[]);
static fmi2Integer fmu_compute(fmu_memory *memory, const fmi2Real in[], const fmi2Boolean flag[],
                               fmi2Real out[]);

#include "fmi2_wrapper.h"

typedef struct {
    double counts_per_turn;
    double gear_num;
    double gear_den;
    double states;
    double offset_counts;
    bool is_reversed;
} fmu_encoder_type;

/* Writes the count of an encoder at an angle. Returns true without one: the angle is not finite or too large. */
static bool fmu_count(const fmu_encoder_type *encoder, double angle, uint32_t *count)
{
    const double position = angle / FMU_TAU * encoder->counts_per_turn * encoder->gear_num / encoder->gear_den;
    const double steps = floor(position + 0.5);
    const double signed_count = (encoder->is_reversed ? -steps : steps) + encoder->offset_counts;
    const double within = signed_count - (encoder->states * floor(signed_count / encoder->states));
    const bool is_lost = !((within >= 0.0) && (within < 4294967296.0));
    *count = is_lost ? 0u : (uint32_t)within;
    return is_lost;
}
$split$
static void fmu_start(fmu_memory *memory, fmi2Real in[], fmi2Real x[], fmi2Boolean flag[])
{
    (void)memory;
    (void)x;
    flag[1] = fmi2True;
    in[FMU_INPUTS - 1] = NAN;
}

static fmi2Integer fmu_compute(fmu_memory *memory, const fmi2Real in[], const fmi2Boolean flag[],
                               fmi2Real out[])
{
    @_output output;
    @_estimates_of known;
    if (flag[0] != fmi2False) {
        @_watched_reset(&memory->monitor, &memory->state);
    } else if (in[FMU_INPUTS - 1] == in[FMU_INPUTS - 1]) {
        (void)@_report_applied(&memory->state, (float)in[FMU_INPUTS - 1]);
    }
$sample$    if (!memory->has_target) {
        memory->has_target = true;
        memory->sample.begin = memory->sample.end;
    }
    if ((flag[1] != fmi2False) && !memory->monitor.stopped && !memory->state.started) {
        (void)@_start(&memory->state, &memory->sample);
    }
    const unsigned health = @_watched_tick(&memory->monitor, &memory->state, &memory->sample, &output);
    (void)@_estimates(&memory->state, &known);
    out[0] = (double)output.u;
    out[1] = (double)output.sigma;
    out[2] = (double)output.sigma_star;
$known$    return (fmi2Integer)health;
}
