/* $title$
 * FMI 2.0. Exported by version $version$ of the library. Do not edit; export again.
 *
 * Compile this file alone; it includes the others. Compile with -std=c99 -ffp-contract=off. */
$head$#include <math.h>
#include <stdbool.h>

#define FMU_GUID "$guid$"
#define FMU_STEP_S $step$ /* largest step of Co-Simulation */
#define FMU_INPUTS 2
#define FMU_OUTPUTS 0
#define FMU_BOOLEANS 0
#define FMU_STATES $states$

typedef struct {
    char nothing;
} fmu_memory;

static void fmu_start(fmu_memory *memory, fmi2Real in[], fmi2Real x[], fmi2Boolean flag[]);
static void fmu_rates(const fmi2Real in[], const fmi2Real x[], fmi2Real dx[]);

#include "fmi2_wrapper.h"

static void fmu_start(fmu_memory *memory, fmi2Real in[], fmi2Real x[], fmi2Boolean flag[])
{
    (void)memory;
    (void)in;
    (void)flag;
$start$}

static void fmu_rates(const fmi2Real in[], const fmi2Real x[], fmi2Real dx[])
{
    const double current = $current$; /* A */
$torque$$rates$}
