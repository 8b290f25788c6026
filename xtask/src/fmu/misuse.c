/* Calls the functions of an FMU in wrong orders and with wrong arguments. The sanitizers of the compiler end the
 * program at an invalid access. */
#include FMU

#include <assert.h>
#include <stdio.h>

static int logged;

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    (void)environment;
    (void)name;
    (void)status;
    (void)category;
    (void)message;
    logged++;
}

static void *none(size_t count, size_t size)
{
    (void)count;
    (void)size;
    return NULL;
}

int main(void)
{
    const fmi2CallbackFunctions plain = { logger, calloc, free, NULL, NULL };
    const fmi2CallbackFunctions empty = { logger, none, free, NULL, NULL };
    const fmi2Real edges[] = { NAN, INFINITY, -INFINITY, 1e300, -1e300, 1e15, -0.0, 1e-320, 3.0 };
    const size_t many = sizeof edges / sizeof edges[0];
    fmi2ValueReference which[FMU_REALS + 1];
    fmi2Real reals[FMU_REALS + 1];
    fmi2Integer whole = 0;
    fmi2Boolean flag = fmi2True;
    fmi2FMUstate state = NULL;
    fmi2EventInfo info;
    const fmi2ValueReference zero = 0u;
    const fmi2ValueReference far = 0xffffffffu;
    for (fmi2ValueReference i = 0; i <= (fmi2ValueReference)FMU_REALS; i++) {
        which[i] = i;
    }

    assert(fmi2Instantiate("a", fmi2CoSimulation, NULL, NULL, &plain, 0, 0) == NULL);
    assert(fmi2Instantiate(NULL, fmi2CoSimulation, "another", NULL, &plain, 0, 0) == NULL);
    assert(fmi2Instantiate("a", (fmi2Type)7, FMU_GUID, NULL, &plain, 0, 0) == NULL);
    assert(fmi2Instantiate("a", fmi2CoSimulation, FMU_GUID, NULL, &empty, 0, 0) == NULL);
    assert(logged == 4);
    fmi2FreeInstance(NULL);
    assert(fmi2Reset(NULL) == fmi2Error && fmi2DoStep(NULL, 0, 1, 0) == fmi2Error);
    assert(fmi2GetReal(NULL, which, 1, reals) == fmi2Error && fmi2NewDiscreteStates(NULL, &info) == fmi2Error);
    assert(fmi2SetFMUstate(NULL, NULL) == fmi2Error && fmi2GetFMUstate(NULL, &state) == fmi2Error);

    for (int k = 0; k < 4; k++) {
        const fmi2Type type = (k & 1) ? fmi2ModelExchange : fmi2CoSimulation;
        const char *name = (k & 2) ? NULL : "a name that is longer than the place that an instance has for its name, by far";
        fmi2Component c = fmi2Instantiate(name, type, FMU_GUID, NULL, (k & 2) ? NULL : &plain, 0, 0);
        assert(c != NULL);
        /* Before the initialisation. */
        assert(fmi2DoStep(c, 0, 1e-3, 0) == fmi2Error && fmi2NewDiscreteStates(c, &info) == fmi2Error);
        assert(fmi2ExitInitializationMode(c) == fmi2Error && fmi2Terminate(c) == fmi2Error);
        assert(fmi2SetupExperiment(c, 0, 0, NAN, 0, 0) == fmi2Error);
        assert(fmi2SetupExperiment(c, 1, 1e-9, 0, 1, 1) == fmi2OK);
        assert(fmi2GetReal(c, which, FMU_REALS, reals) == fmi2OK);
        assert(fmi2GetReal(c, which, FMU_REALS + 1, reals) == fmi2Error && fmi2GetReal(c, NULL, 1, reals) == fmi2Error);
        assert(fmi2GetReal(c, which, 1, NULL) == fmi2Error && fmi2GetReal(c, &far, 1, reals) == fmi2Error);
        assert(fmi2SetReal(c, &far, 1, reals) == fmi2Error && fmi2SetReal(c, which, 1, NULL) == fmi2Error);
        assert(fmi2GetInteger(c, &far, 1, &whole) == fmi2Error && fmi2GetBoolean(c, &far, 1, &flag) == fmi2Error);
        assert(fmi2SetInteger(c, &zero, 1, &whole) == fmi2Error && fmi2SetBoolean(c, &far, 1, &flag) == fmi2Error);
        assert(fmi2GetString(c, &zero, 1, NULL) == fmi2Error && fmi2SetString(c, &zero, 0, NULL) == fmi2OK);
        assert(fmi2EnterInitializationMode(c) == fmi2OK && fmi2EnterInitializationMode(c) == fmi2Error);
        assert(fmi2GetReal(c, which, FMU_REALS, reals) == fmi2OK);
        assert(fmi2ExitInitializationMode(c) == fmi2OK && fmi2SetupExperiment(c, 0, 0, 0, 0, 0) == fmi2Error);
        /* Edge values as inputs, and the wrong functions of the other type. */
        for (size_t i = 0; i < 40u * many; i++) {
            for (fmi2ValueReference input = 0; input < FMU_INPUTS; input++) {
                const fmi2Real edge = edges[(i + input * 5u) % many];
                assert(fmi2SetReal(c, &input, 1, &edge) == fmi2OK);
            }
#if FMU_STATES == 0
            flag = (i % 29u) == 0u;
            assert(fmi2SetBoolean(c, &zero, 1, &flag) == fmi2OK && fmi2GetInteger(c, &zero, 1, &whole) == fmi2OK);
#endif
            if (type == fmi2CoSimulation) {
                const fmi2Real time = 1e-3 * (double)i;
                assert(fmi2DoStep(c, time, 1e-3, 1) == fmi2OK && fmi2DoStep(c, time, 1e-3, 1) == fmi2Error);
                assert(fmi2EnterEventMode(c) == fmi2Error && fmi2SetTime(c, 0) == fmi2Error);
            } else {
                assert(fmi2NewDiscreteStates(c, NULL) == fmi2Error);
                do {
                    assert(fmi2NewDiscreteStates(c, &info) == fmi2OK);
                } while (info.newDiscreteStatesNeeded);
                assert(fmi2EnterContinuousTimeMode(c) == fmi2OK && fmi2NewDiscreteStates(c, &info) == fmi2Error);
                assert(fmi2SetTime(c, NAN) == fmi2Error && fmi2SetTime(c, INFINITY) == fmi2Error);
                assert(fmi2SetTime(c, info.nextEventTimeDefined ? info.nextEventTime : 1e-3 * (double)i) == fmi2OK);
                assert(fmi2GetDerivatives(c, reals, FMU_STATES) == fmi2OK);
                assert(fmi2GetDerivatives(c, reals, FMU_STATES + 1) == fmi2Error);
                assert(fmi2SetContinuousStates(c, NULL, FMU_STATES + 1) == fmi2Error);
                assert(fmi2GetContinuousStates(c, reals, FMU_STATES) == fmi2OK);
                assert(fmi2GetNominalsOfContinuousStates(c, reals, FMU_STATES) == fmi2OK);
                assert(fmi2GetEventIndicators(c, NULL, 0) == fmi2OK);
                assert(fmi2CompletedIntegratorStep(c, 1, NULL, NULL) == fmi2Error);
                assert(fmi2EnterEventMode(c) == fmi2OK && fmi2DoStep(c, 0, 1e-3, 0) == fmi2Error);
            }
            assert(fmi2GetReal(c, which, FMU_REALS, reals) == fmi2OK);
#if FMU_STATES == 0
            assert(fabs(reals[FMU_INPUTS]) < 1e3); /* u is a number within its limits */
#endif
        }
        if (type == fmi2CoSimulation) {
            const fmi2Real time = 1e-3 * 40.0 * (double)many;
            assert(fmi2DoStep(c, time, -1, 0) == fmi2Error && fmi2DoStep(c, time, NAN, 0) == fmi2Error);
            assert(fmi2DoStep(c, time, 1e300, 0) == fmi2Error && fmi2DoStep(c, NAN, 1, 0) == fmi2Error);
            assert(fmi2DoStep(c, time, 0, 0) == fmi2OK);
        }
        /* Saved states. */
        size_t size = 0;
        assert(fmi2GetFMUstate(c, NULL) == fmi2Error && fmi2GetFMUstate(c, &state) == fmi2OK);
        assert(fmi2GetFMUstate(c, &state) == fmi2OK && fmi2SetFMUstate(c, NULL) == fmi2Error);
        assert(fmi2SerializedFMUstateSize(c, state, &size) == fmi2OK && size == sizeof(fmu_saved));
        fmi2Byte *bytes = malloc(size);
        fmi2FMUstate again = NULL;
        assert(fmi2SerializeFMUstate(c, state, bytes, size - 1u) == fmi2Error);
        assert(fmi2SerializeFMUstate(c, state, bytes, size) == fmi2OK);
        assert(fmi2DeSerializeFMUstate(c, bytes, size - 1u, &again) == fmi2Error && again == NULL);
        assert(fmi2DeSerializeFMUstate(c, bytes, size, &again) == fmi2OK);
        bytes[0] ^= 1;
        assert(fmi2DeSerializeFMUstate(c, bytes, size, &again) == fmi2Error);
        assert(fmi2SetFMUstate(c, again) == fmi2OK);
        assert(fmi2FreeFMUstate(c, &again) == fmi2OK && again == NULL && fmi2FreeFMUstate(c, &again) == fmi2OK);
        assert(fmi2FreeFMUstate(c, &state) == fmi2OK && fmi2FreeFMUstate(NULL, NULL) == fmi2OK);
        free(bytes);
        assert(fmi2Terminate(c) == fmi2OK && fmi2Terminate(c) == fmi2Error && fmi2SetReal(c, which, 1, reals) == fmi2Error);
        assert(fmi2GetReal(c, which, FMU_REALS, reals) == fmi2OK && fmi2Reset(c) == fmi2OK);
        assert(fmi2EnterInitializationMode(c) == fmi2OK);
        fmi2FreeInstance(c);
    }
    printf("misuse: every wrong call returns an error\n");
    return 0;
}
