/* FMI 2.0 for Model Exchange and Co-Simulation around a sampled controller or a continuous plant.
 *
 * The file that includes this one defines FMU_GUID, FMU_INPUTS, FMU_OUTPUTS, FMU_BOOLEANS, FMU_STATES and the type
 * fmu_memory. A controller (FMU_STATES is 0) defines FMU_PERIOD_S, fmu_start and fmu_compute. A plant defines FMU_STEP_S, fmu_start
 * and fmu_rates.
 *
 * Value references of reals: inputs, outputs, states, derivatives of the states. Integer 0 is the health, Boolean 0
 * the reset, further ones are parameters.
 *
 * Controller. Tick k is at the start time plus k T. In Model Exchange it is a time event. In Co-Simulation fmi2DoStep
 * computes every tick from the begin of the step to before its end, with the inputs as set. If a tick is due and
 * inputs were set, fmi2GetReal returns its outputs in advance, computed on a copy.
 *
 * Plant. In Co-Simulation fmi2DoStep integrates with Runge and Kutta's method of order 4. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
    FMU_REALS = FMU_INPUTS + FMU_OUTPUTS + (2 * FMU_STATES),
    FMU_FIRST_STATE = FMU_INPUTS + FMU_OUTPUTS,
    FMU_FIRST_RATE = FMU_INPUTS + FMU_OUTPUTS + FMU_STATES
};

/* Modes of FMI, one bit each. */
enum {
    FMU_INSTANTIATED = 1,
    FMU_INITIALISES = 2,
    FMU_EVENT = 4,
    FMU_CONTINUOUS = 8,
    FMU_STEPS = 16,
    FMU_TERMINATED = 32,
    FMU_ALL = 63
};

/* Everything that changes. Saving it is a copy. */
typedef struct {
    uint32_t mode;
    bool is_set; /* inputs were set since the last tick */
    fmi2Boolean flag[FMU_BOOLEANS + 1];
    fmi2Integer health;
    fmi2Real start; /* time of tick 0, s */
    fmi2Real time; /* s */
    fmi2Real ticks; /* computed ticks, a whole number */
    fmi2Real in[FMU_INPUTS];
    fmi2Real out[FMU_OUTPUTS + 1];
    fmi2Real x[FMU_STATES + 1];
    fmu_memory memory;
} fmu_now;

/* A saved state. Its bytes are valid for one GUID and one layout. */
typedef struct {
    uint64_t key;
    fmu_now now;
} fmu_saved;

typedef struct {
    fmu_now now;
    fmu_now ahead; /* after the tick that is due, if is_ahead */
    bool is_ahead;
    bool is_exchange;
    fmi2CallbackFunctions callbacks;
    bool is_theirs; /* the memory is from the importer */
    char name[64];
} fmu_instance;

static uint64_t fmu_key(void)
{
    const char *letter = FMU_GUID;
    uint64_t key = 14695981039346656037u;
    while (*letter != '\0') {
        key = (key ^ (uint64_t)(unsigned char)*letter) * 1099511628211u;
        letter++;
    }
    return key ^ (uint64_t)sizeof(fmu_saved);
}

static void fmu_log(const fmi2CallbackFunctions *callbacks, const char *name, const char *text)
{
    if ((callbacks != NULL) && (callbacks->logger != NULL)) {
        callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "logStatusError", "%s", text);
    }
}

/* Returns the instance, or NULL if a call is not allowed in its mode. */
static fmu_instance *fmu_in(fmi2Component component, uint32_t modes, const char *call)
{
    fmu_instance *instance = component;
    if ((instance != NULL) && ((instance->now.mode & modes) == 0u)) {
        fmu_log(&instance->callbacks, instance->name, call);
        instance = NULL;
    }
    return instance;
}

static fmi2Status fmu_refuse(const fmu_instance *instance, const char *text)
{
    fmu_log(&instance->callbacks, instance->name, text);
    return fmi2Error;
}

static bool fmu_is_finite(fmi2Real number)
{
    return (number - number) == 0.0;
}

/* Returns whether there is a variable with this reference among `count` of its type. */
static bool fmu_has(size_t reference, size_t count)
{
    return reference < count;
}

static void fmu_begin(fmu_instance *instance)
{
    (void)memset(&instance->now, 0, sizeof instance->now);
    instance->now.mode = FMU_INSTANTIATED;
    instance->is_ahead = false;
    fmu_start(&instance->now.memory, instance->now.in, instance->now.x, instance->now.flag);
}

#if FMU_STATES > 0
static bool fmu_is_due(const fmu_now *now)
{
    (void)now;
    return false;
}

static void fmu_tick(fmu_now *now)
{
    (void)now;
}

/* Integrates over a step of Co-Simulation. Returns false if it is too long. */
static bool fmu_advance(fmu_now *now, fmi2Real step)
{
    const fmi2Real parts = ceil((step / FMU_STEP_S) - 1e-6);
    if (!(parts <= 1e9)) {
        return false;
    }
    const fmi2Real h = (parts > 0.0) ? (step / parts) : 0.0;
    for (uint32_t part = 0u; (fmi2Real)part < parts; part++) {
        fmi2Real k[4][FMU_STATES];
        fmi2Real x[FMU_STATES];
        fmu_rates(now->in, now->x, k[0]);
        for (int stage = 1; stage < 4; stage++) {
            const fmi2Real share = (stage < 3) ? (0.5 * h) : h;
            for (int i = 0; i < FMU_STATES; i++) {
                x[i] = now->x[i] + (share * k[stage - 1][i]);
            }
            fmu_rates(now->in, x, k[stage]);
        }
        for (int i = 0; i < FMU_STATES; i++) {
            now->x[i] += (h / 6.0) * (k[0][i] + (2.0 * (k[1][i] + k[2][i])) + k[3][i]);
        }
    }
    return true;
}
#else
static fmi2Real fmu_next(const fmu_now *now)
{
    return now->start + (now->ticks * FMU_PERIOD_S);
}

/* Returns whether the outputs are the outputs of the tick at this instant, which has not been computed yet. */
static bool fmu_is_due(const fmu_now *now)
{
    const bool is_time = now->time >= (fmu_next(now) - (1e-6 * FMU_PERIOD_S));
    const bool is_step = (now->mode == FMU_STEPS) && (now->is_set || (now->ticks == 0.0));
    return is_time && (is_step || (now->mode == FMU_INITIALISES) || (now->mode == FMU_EVENT));
}

static void fmu_tick(fmu_now *now)
{
    now->health = fmu_compute(&now->memory, now->in, now->flag, now->out);
    now->ticks += 1.0;
    now->is_set = false;
}

/* Computes the ticks before an instant. Returns false if they are too many. */
static bool fmu_advance(fmu_now *now, fmi2Real step)
{
    const fmi2Real end = (now->time + step) - (1e-6 * FMU_PERIOD_S);
    if (!(step <= (1e9 * FMU_PERIOD_S))) {
        return false;
    }
    while (fmu_next(now) < end) {
        fmu_tick(now);
    }
    return true;
}
#endif

/* Returns the values at this instant. */
static const fmu_now *fmu_seen(fmu_instance *instance)
{
    if (!fmu_is_due(&instance->now)) {
        return &instance->now;
    }
    if (!instance->is_ahead) {
        instance->ahead = instance->now;
        fmu_tick(&instance->ahead);
        instance->is_ahead = true;
    }
    return &instance->ahead;
}

FMI2_Export const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

FMI2_Export const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

FMI2_Export fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean is_on, size_t count,
                                           const fmi2String categories[])
{
    (void)is_on;
    (void)count;
    (void)categories;
    return (component == NULL) ? fmi2Error : fmi2OK;
}

FMI2_Export fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                          const fmi2CallbackFunctions *callbacks, fmi2Boolean is_visible,
                                          fmi2Boolean is_logging)
{
    (void)resources;
    (void)is_visible;
    (void)is_logging;
    const char *shown = (name == NULL) ? "" : name;
    if ((guid == NULL) || (strcmp(guid, FMU_GUID) != 0)) {
        fmu_log(callbacks, shown, "another design: this binary is of the GUID " FMU_GUID ". Export the FMU again");
        return NULL;
    }
    if ((type != fmi2ModelExchange) && (type != fmi2CoSimulation)) {
        fmu_log(callbacks, shown, "the type is neither Model Exchange nor Co-Simulation");
        return NULL;
    }
    const bool is_theirs =
        (callbacks != NULL) && (callbacks->allocateMemory != NULL) && (callbacks->freeMemory != NULL);
    fmu_instance *instance =
        is_theirs ? callbacks->allocateMemory(1, sizeof *instance) : calloc(1, sizeof *instance);
    if (instance == NULL) {
        fmu_log(callbacks, shown, "no memory");
        return NULL;
    }
    (void)memset(instance, 0, sizeof *instance);
    instance->is_theirs = is_theirs;
    instance->is_exchange = type == fmi2ModelExchange;
    (void)strncpy(instance->name, shown, (sizeof instance->name) - 1u);
    if (callbacks != NULL) {
        instance->callbacks = *callbacks;
    }
    fmu_begin(instance);
    return instance;
}

FMI2_Export void fmi2FreeInstance(fmi2Component component)
{
    fmu_instance *instance = component;
    if ((instance != NULL) && instance->is_theirs) {
        void (*release)(void *) = instance->callbacks.freeMemory;
        release(instance);
    } else {
        free(instance);
    }
}

FMI2_Export fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean has_tolerance, fmi2Real tolerance,
                                           fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    fmu_instance *instance = fmu_in(component, FMU_INSTANTIATED, "fmi2SetupExperiment: not in this mode");
    if (instance == NULL) {
        return fmi2Error;
    }
    if (!fmu_is_finite(start)) {
        return fmu_refuse(instance, "fmi2SetupExperiment: the start time is not finite");
    }
    instance->now.start = start;
    instance->now.time = start;
    return fmi2OK;
}

/* Changes the mode. */
static fmi2Status fmu_go(fmi2Component component, uint32_t from, uint32_t to, const char *call)
{
    fmu_instance *instance = fmu_in(component, from, call);
    if (instance == NULL) {
        return fmi2Error;
    }
    instance->now.mode = to;
    instance->is_ahead = false;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2EnterInitializationMode(fmi2Component component)
{
    return fmu_go(component, FMU_INSTANTIATED, FMU_INITIALISES, "fmi2EnterInitializationMode: not in this mode");
}

FMI2_Export fmi2Status fmi2ExitInitializationMode(fmi2Component component)
{
    const fmu_instance *instance = component;
    const uint32_t next = ((instance != NULL) && instance->is_exchange) ? FMU_EVENT : FMU_STEPS;
    return fmu_go(component, FMU_INITIALISES, next, "fmi2ExitInitializationMode: not in this mode");
}

FMI2_Export fmi2Status fmi2Terminate(fmi2Component component)
{
    return fmu_go(component, FMU_EVENT | FMU_CONTINUOUS | FMU_STEPS, FMU_TERMINATED,
                  "fmi2Terminate: not in this mode");
}

FMI2_Export fmi2Status fmi2Reset(fmi2Component component)
{
    if (component == NULL) {
        return fmi2Error;
    }
    fmu_begin(component);
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                   fmi2Real value[])
{
    fmu_instance *instance = component;
    if ((instance == NULL) || ((count > 0u) && ((which == NULL) || (value == NULL)))) {
        return fmi2Error;
    }
    for (size_t i = 0u; i < count; i++) {
        const fmi2ValueReference at = which[i];
        if (at < FMU_INPUTS) {
            value[i] = instance->now.in[at];
        } else if (at < FMU_FIRST_STATE) {
            value[i] = fmu_seen(instance)->out[at - FMU_INPUTS];
        } else if (at < FMU_FIRST_RATE) {
            value[i] = instance->now.x[at - FMU_FIRST_STATE];
        } else if (at < FMU_REALS) {
#if FMU_STATES > 0
            fmi2Real rates[FMU_STATES];
            fmu_rates(instance->now.in, instance->now.x, rates);
            value[i] = rates[at - FMU_FIRST_RATE];
#endif
        } else {
            return fmu_refuse(instance, "fmi2GetReal: no such variable");
        }
    }
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                   const fmi2Real value[])
{
    fmu_instance *instance = fmu_in(component, FMU_ALL & ~(uint32_t)FMU_TERMINATED, "fmi2SetReal: not in this mode");
    if ((instance == NULL) || ((count > 0u) && ((which == NULL) || (value == NULL)))) {
        return fmi2Error;
    }
    const bool is_before = (instance->now.mode & (FMU_INSTANTIATED | FMU_INITIALISES)) != 0u;
    for (size_t i = 0u; i < count; i++) {
        const fmi2ValueReference at = which[i];
        if (at < FMU_INPUTS) {
            instance->now.in[at] = value[i];
            instance->now.is_set = true;
            instance->is_ahead = false;
        } else if (is_before && (at >= FMU_FIRST_STATE) && (at < FMU_FIRST_RATE)) {
            instance->now.x[at - FMU_FIRST_STATE] = value[i];
        } else {
            return fmu_refuse(instance, "fmi2SetReal: the variable cannot be set");
        }
    }
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetInteger(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                      fmi2Integer value[])
{
    fmu_instance *instance = component;
    if ((instance == NULL) || ((count > 0u) && ((which == NULL) || (value == NULL)))) {
        return fmi2Error;
    }
    for (size_t i = 0u; i < count; i++) {
        if ((which[i] != 0u) || (FMU_STATES > 0)) {
            return fmu_refuse(instance, "fmi2GetInteger: no such variable");
        }
        value[i] = fmu_seen(instance)->health;
    }
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetBoolean(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                      fmi2Boolean value[])
{
    const fmu_instance *instance = component;
    if ((instance == NULL) || ((count > 0u) && ((which == NULL) || (value == NULL)))) {
        return fmi2Error;
    }
    for (size_t i = 0u; i < count; i++) {
        if (!fmu_has(which[i], FMU_BOOLEANS)) {
            return fmu_refuse(instance, "fmi2GetBoolean: no such variable");
        }
        value[i] = instance->now.flag[which[i]];
    }
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetBoolean(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                      const fmi2Boolean value[])
{
    fmu_instance *instance =
        fmu_in(component, FMU_ALL & ~(uint32_t)FMU_TERMINATED, "fmi2SetBoolean: not in this mode");
    if ((instance == NULL) || ((count > 0u) && ((which == NULL) || (value == NULL)))) {
        return fmi2Error;
    }
    for (size_t i = 0u; i < count; i++) {
        if (!fmu_has(which[i], FMU_BOOLEANS)) {
            return fmu_refuse(instance, "fmi2SetBoolean: no such variable");
        }
        instance->now.flag[which[i]] = value[i];
        instance->now.is_set = true;
        instance->is_ahead = false;
    }
    return fmi2OK;
}

/* Calls for variables that do not exist: only an empty list is right. */
static fmi2Status fmu_none(fmi2Component component, size_t count)
{
    return ((component == NULL) || (count > 0u)) ? fmi2Error : fmi2OK;
}

FMI2_Export fmi2Status fmi2SetInteger(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                      const fmi2Integer value[])
{
    (void)which;
    (void)value;
    return fmu_none(component, count);
}

FMI2_Export fmi2Status fmi2GetString(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                     fmi2String value[])
{
    (void)which;
    (void)value;
    return fmu_none(component, count);
}

FMI2_Export fmi2Status fmi2SetString(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                     const fmi2String value[])
{
    (void)which;
    (void)value;
    return fmu_none(component, count);
}

FMI2_Export fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknown[],
                                                    size_t unknowns, const fmi2ValueReference known[], size_t knowns,
                                                    const fmi2Real change[], fmi2Real value[])
{
    (void)component;
    (void)unknown;
    (void)unknowns;
    (void)known;
    (void)knowns;
    (void)change;
    (void)value;
    return fmi2Error;
}

FMI2_Export fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *state)
{
    const fmu_instance *instance = component;
    if ((instance == NULL) || (state == NULL)) {
        return fmi2Error;
    }
    fmu_saved *saved = *state;
    if (saved == NULL) {
        saved = calloc(1, sizeof *saved);
    } else if (saved->key != fmu_key()) {
        return fmu_refuse(instance, "fmi2GetFMUstate: a state of another FMU");
    }
    if (saved == NULL) {
        return fmu_refuse(instance, "fmi2GetFMUstate: no memory");
    }
    saved->key = fmu_key();
    saved->now = instance->now;
    *state = saved;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate state)
{
    fmu_instance *instance = component;
    const fmu_saved *saved = state;
    if ((instance == NULL) || (saved == NULL)) {
        return fmi2Error;
    }
    if (saved->key != fmu_key()) {
        return fmu_refuse(instance, "fmi2SetFMUstate: a state of another FMU");
    }
    instance->now = saved->now;
    instance->is_ahead = false;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *state)
{
    (void)component;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate state, size_t *size)
{
    if ((component == NULL) || (state == NULL) || (size == NULL)) {
        return fmi2Error;
    }
    *size = sizeof(fmu_saved);
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate state, fmi2Byte bytes[],
                                             size_t size)
{
    const fmu_instance *instance = component;
    if ((instance == NULL) || (state == NULL) || (bytes == NULL)) {
        return fmi2Error;
    }
    if (size < sizeof(fmu_saved)) {
        return fmu_refuse(instance, "fmi2SerializeFMUstate: too few bytes");
    }
    (void)memcpy(bytes, state, sizeof(fmu_saved));
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte bytes[], size_t size,
                                               fmi2FMUstate *state)
{
    const fmu_instance *instance = component;
    uint64_t key = 0u;
    if ((instance == NULL) || (bytes == NULL) || (state == NULL)) {
        return fmi2Error;
    }
    if (size < sizeof(fmu_saved)) {
        return fmu_refuse(instance, "fmi2DeSerializeFMUstate: too few bytes");
    }
    (void)memcpy(&key, bytes, sizeof key);
    if (key != fmu_key()) {
        return fmu_refuse(instance, "fmi2DeSerializeFMUstate: a state of another FMU");
    }
    if (*state == NULL) {
        *state = calloc(1, sizeof(fmu_saved));
    }
    if (*state == NULL) {
        return fmu_refuse(instance, "fmi2DeSerializeFMUstate: no memory");
    }
    (void)memcpy(*state, bytes, sizeof(fmu_saved));
    return fmi2OK;
}

/* Co-Simulation */

FMI2_Export fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference which[],
                                                   size_t count, const fmi2Integer order[], const fmi2Real value[])
{
    (void)which;
    (void)order;
    (void)value;
    return fmu_none(component, count);
}

FMI2_Export fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference which[],
                                                    size_t count, const fmi2Integer order[], fmi2Real value[])
{
    (void)which;
    (void)order;
    (void)value;
    return fmu_none(component, count);
}

FMI2_Export fmi2Status fmi2DoStep(fmi2Component component, fmi2Real time, fmi2Real step, fmi2Boolean is_final)
{
    (void)is_final;
    fmu_instance *instance = fmu_in(component, FMU_STEPS, "fmi2DoStep: not in this mode");
    if (instance == NULL) {
        return fmi2Error;
    }
    if (!fmu_is_finite(time) || !fmu_is_finite(step) || !(step >= 0.0)) {
        return fmu_refuse(instance, "fmi2DoStep: time and step are finite, the step is not negative");
    }
    if (fabs(time - instance->now.time) > (1e-9 + (1e-9 * fabs(time)))) {
        return fmu_refuse(instance, "fmi2DoStep: a step begins where the last one ended");
    }
    instance->now.time = time;
    instance->is_ahead = false;
    if (!fmu_advance(&instance->now, step)) {
        return fmu_refuse(instance, "fmi2DoStep: the step is too long");
    }
    instance->now.time = time + step;
    instance->now.is_set = false;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2CancelStep(fmi2Component component)
{
    (void)component;
    return fmi2Error;
}

FMI2_Export fmi2Status fmi2GetStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)kind;
    (void)value;
    return (component == NULL) ? fmi2Error : fmi2Discard;
}

FMI2_Export fmi2Status fmi2GetRealStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Real *value)
{
    const fmu_instance *instance = component;
    if ((instance == NULL) || (value == NULL)) {
        return fmi2Error;
    }
    if (kind != fmi2LastSuccessfulTime) {
        return fmi2Discard;
    }
    *value = instance->now.time;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetIntegerStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)kind;
    (void)value;
    return (component == NULL) ? fmi2Error : fmi2Discard;
}

FMI2_Export fmi2Status fmi2GetBooleanStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Boolean *value)
{
    const fmu_instance *instance = component;
    if ((instance == NULL) || (value == NULL)) {
        return fmi2Error;
    }
    if (kind != fmi2Terminated) {
        return fmi2Discard;
    }
    *value = fmi2False;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetStringStatus(fmi2Component component, const fmi2StatusKind kind, fmi2String *value)
{
    (void)kind;
    (void)value;
    return (component == NULL) ? fmi2Error : fmi2Discard;
}

/* Model Exchange */

FMI2_Export fmi2Status fmi2EnterEventMode(fmi2Component component)
{
    return fmu_go(component, FMU_CONTINUOUS, FMU_EVENT, "fmi2EnterEventMode: not in this mode");
}

FMI2_Export fmi2Status fmi2EnterContinuousTimeMode(fmi2Component component)
{
    return fmu_go(component, FMU_EVENT, FMU_CONTINUOUS, "fmi2EnterContinuousTimeMode: not in this mode");
}

FMI2_Export fmi2Status fmi2NewDiscreteStates(fmi2Component component, fmi2EventInfo *info)
{
    fmu_instance *instance = fmu_in(component, FMU_EVENT, "fmi2NewDiscreteStates: not in this mode");
    if ((instance == NULL) || (info == NULL)) {
        return fmi2Error;
    }
    info->terminateSimulation = fmi2False;
    info->nominalsOfContinuousStatesChanged = fmi2False;
    info->valuesOfContinuousStatesChanged = fmi2False;
    if (fmu_is_due(&instance->now)) {
        fmu_tick(&instance->now);
        instance->is_ahead = false;
    }
    info->newDiscreteStatesNeeded = fmu_is_due(&instance->now) ? fmi2True : fmi2False;
#if FMU_STATES > 0
    info->nextEventTimeDefined = fmi2False;
    info->nextEventTime = 0.0;
#else
    info->nextEventTimeDefined = fmi2True;
    info->nextEventTime = fmu_next(&instance->now);
#endif
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2CompletedIntegratorStep(fmi2Component component, fmi2Boolean is_final,
                                                   fmi2Boolean *has_event, fmi2Boolean *ends)
{
    (void)is_final;
    if ((fmu_in(component, FMU_CONTINUOUS, "fmi2CompletedIntegratorStep: not in this mode") == NULL) ||
        (has_event == NULL) || (ends == NULL)) {
        return fmi2Error;
    }
    *has_event = fmi2False;
    *ends = fmi2False;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetTime(fmi2Component component, fmi2Real time)
{
    fmu_instance *instance = fmu_in(component, FMU_EVENT | FMU_CONTINUOUS, "fmi2SetTime: not in this mode");
    if (instance == NULL) {
        return fmi2Error;
    }
#if FMU_STATES == 0
    /* An importer stops at each event; more than two missed ticks are an error of its own. */
    if (!(time <= (fmu_next(&instance->now) + (2.0 * FMU_PERIOD_S)))) {
        return fmu_refuse(instance, "fmi2SetTime: after the next event");
    }
#endif
    if (!fmu_is_finite(time)) {
        return fmu_refuse(instance, "fmi2SetTime: the time is not finite");
    }
    instance->now.time = time;
    instance->is_ahead = false;
    return fmi2OK;
}

/* Copies from or to the states: fails for another number of them. */
static fmi2Status fmu_copy(fmi2Real to[], const fmi2Real from[], size_t count)
{
    if ((count != (size_t)FMU_STATES) || ((count > 0u) && ((to == NULL) || (from == NULL)))) {
        return fmi2Error;
    }
    if (count > 0u) {
        (void)memcpy(to, from, count * sizeof to[0]);
    }
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetContinuousStates(fmi2Component component, const fmi2Real x[], size_t count)
{
    fmu_instance *instance = fmu_in(component, FMU_CONTINUOUS, "fmi2SetContinuousStates: not in this mode");
    return (instance == NULL) ? fmi2Error : fmu_copy(instance->now.x, x, count);
}

FMI2_Export fmi2Status fmi2GetContinuousStates(fmi2Component component, fmi2Real x[], size_t count)
{
    const fmu_instance *instance = component;
    return (instance == NULL) ? fmi2Error : fmu_copy(x, instance->now.x, count);
}

FMI2_Export fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component component, fmi2Real x[], size_t count)
{
    if ((component == NULL) || (count != (size_t)FMU_STATES) || ((count > 0u) && (x == NULL))) {
        return fmi2Error;
    }
    for (size_t i = 0u; i < count; i++) {
        x[i] = 1.0;
    }
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetDerivatives(fmi2Component component, fmi2Real rates[], size_t count)
{
    const fmu_instance *instance = component;
    if ((instance == NULL) || (count != (size_t)FMU_STATES) || ((count > 0u) && (rates == NULL))) {
        return fmi2Error;
    }
#if FMU_STATES > 0
    fmu_rates(instance->now.in, instance->now.x, rates);
#endif
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetEventIndicators(fmi2Component component, fmi2Real indicators[], size_t count)
{
    (void)indicators;
    return fmu_none(component, count);
}
