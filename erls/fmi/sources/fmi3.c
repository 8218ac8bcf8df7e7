/* written by erls: the functions of FMI 3.0. */

#include "unit.h"

DOOR const char *fmi3GetVersion(void) { return "3.0"; }

DOOR int fmi3SetDebugLogging(Unit *unit, bool on, size_t count, const char *const *categories) {
    (void)unit, (void)on, (void)count, (void)categories;
    return OK;
}

DOOR Unit *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *folder, bool visible,
                                       bool logging, bool events, bool early, const Reference *needed, size_t count,
                                       void *environment, Logger3 logger, void *intermediate) {
    (void)visible, (void)logging, (void)events, (void)early, (void)needed, (void)count, (void)intermediate;
    return unit_begin(name, token, folder, environment, logger, NULL);
}

DOOR void fmi3FreeInstance(Unit *unit) { unit_end(unit); }

DOOR int fmi3EnterInitializationMode(Unit *unit, bool tolerant, double tolerance, double time, bool stops, double stop) {
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    return unit_begins_at(unit, time);
}

DOOR int fmi3ExitInitializationMode(Unit *unit) { return (void)unit, OK; }
DOOR int fmi3Terminate(Unit *unit) { return (void)unit, OK; }
DOOR int fmi3Reset(Unit *unit) { return unit_reset(unit); }

DOOR int fmi3GetFloat64(Unit *unit, const Reference *references, size_t count, double *values, size_t many) {
    return (void)many, unit_get(unit, references, count, values);
}

DOOR int fmi3SetFloat64(Unit *unit, const Reference *references, size_t count, const double *values, size_t many) {
    return (void)many, unit_set(unit, references, count, values);
}

DOOR int fmi3DoStep(Unit *unit, double time, double length, bool keeps, bool *event, bool *stop, bool *early,
                    double *reached) {
    (void)keeps;
    *event = *stop = *early = false;
    int status = unit_step(unit, time, length);
    *reached = unit->values[0];
    return status;
}

DOOR int fmi3GetFMUState(Unit *unit, void **state) { return unit_keep(unit, state); }
DOOR int fmi3SetFMUState(Unit *unit, void *state) { return unit_go(unit, state); }
DOOR int fmi3FreeFMUState(Unit *unit, void **state) { return unit_forget(unit, state); }

DOOR void *fmi3InstantiateModelExchange(void) { return NULL; }
DOOR void *fmi3InstantiateScheduledExecution(void) { return NULL; }

NONE(fmi3, Float32) NONE(fmi3, Int8) NONE(fmi3, UInt8) NONE(fmi3, Int16) NONE(fmi3, UInt16) NONE(fmi3, Int32) NONE(fmi3, UInt32) NONE(fmi3, Int64)
NONE(fmi3, UInt64) NONE(fmi3, Boolean) NONE(fmi3, String) NONE(fmi3, Binary) NONE(fmi3, Clock)

NOT(fmi3EnterEventMode) NOT(fmi3EnterStepMode) NOT(fmi3GetOutputDerivatives) NOT(fmi3ActivateModelPartition)
NOT(fmi3SerializedFMUStateSize) NOT(fmi3SerializeFMUState) NOT(fmi3DeserializeFMUState)
NOT(fmi3GetDirectionalDerivative) NOT(fmi3GetAdjointDerivative) NOT(fmi3GetNumberOfVariableDependencies)
NOT(fmi3GetVariableDependencies) NOT(fmi3EnterConfigurationMode) NOT(fmi3ExitConfigurationMode)
NOT(fmi3GetIntervalDecimal) NOT(fmi3GetIntervalFraction) NOT(fmi3GetShiftDecimal) NOT(fmi3GetShiftFraction)
NOT(fmi3SetIntervalDecimal) NOT(fmi3SetIntervalFraction) NOT(fmi3SetShiftDecimal) NOT(fmi3SetShiftFraction)
NOT(fmi3EvaluateDiscreteStates) NOT(fmi3UpdateDiscreteStates) NOT(fmi3EnterContinuousTimeMode)
NOT(fmi3CompletedIntegratorStep) NOT(fmi3SetTime) NOT(fmi3SetContinuousStates) NOT(fmi3GetContinuousStates)
NOT(fmi3GetContinuousStateDerivatives) NOT(fmi3GetEventIndicators) NOT(fmi3GetNominalsOfContinuousStates)
NOT(fmi3GetNumberOfEventIndicators) NOT(fmi3GetNumberOfContinuousStates)
