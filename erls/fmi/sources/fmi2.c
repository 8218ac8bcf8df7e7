/* written by erls: the functions of FMI 2.0. */

#include "unit.h"

#include <string.h>

typedef struct {
    Logger2 logger;
    void *allocate, *release, *finished;
    void *environment;
} Callbacks2;

DOOR const char *fmi2GetVersion(void) { return "2.0"; }
DOOR const char *fmi2GetTypesPlatform(void) { return "default"; }

DOOR int fmi2SetDebugLogging(Unit *unit, int on, size_t count, const char *const *categories) {
    (void)unit, (void)on, (void)count, (void)categories;
    return OK;
}

static int hex(char digit) {
    const char *digits = "0123456789abcdef", *at = strchr(digits, digit | 32);
    return digit && at ? (int)(at - digits) : -1;
}

/* The folder of a file URI. */
static void folder_of(const char *uri, char *folder, size_t size) {
    size_t k = 0;
    if (!strncmp(uri, "file:", 5)) uri += 5;
    if (!strncmp(uri, "//", 2)) uri = strchr(uri + 2, '/') ? strchr(uri + 2, '/') : uri + 2; /* past the host */
    for (; *uri && k + 1 < size; uri++) {
        int high = *uri == '%' ? hex(uri[1]) : -1, low = high >= 0 ? hex(uri[2]) : -1;
        folder[k++] = low >= 0 ? (char)(16 * high + low) : *uri;
        if (low >= 0) uri += 2;
    }
    folder[k] = 0;
}

DOOR Unit *fmi2Instantiate(const char *name, int type, const char *token, const char *uri, const Callbacks2 *callbacks,
                           int visible, int logging) {
    char folder[4096];
    (void)visible, (void)logging;
    if (type != 1) return NULL; /* model exchange */
    folder_of(uri ? uri : "", folder, sizeof folder);
    return unit_begin(name, token, folder, callbacks ? callbacks->environment : NULL, NULL,
                 callbacks ? callbacks->logger : NULL);
}

DOOR void fmi2FreeInstance(Unit *unit) { unit_end(unit); }

DOOR int fmi2SetupExperiment(Unit *unit, int tolerant, double tolerance, double time, int stops, double stop) {
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    return unit_begins_at(unit, time);
}

DOOR int fmi2EnterInitializationMode(Unit *unit) { return (void)unit, OK; }
DOOR int fmi2ExitInitializationMode(Unit *unit) { return (void)unit, OK; }
DOOR int fmi2Terminate(Unit *unit) { return (void)unit, OK; }
DOOR int fmi2Reset(Unit *unit) { return unit_reset(unit); }

DOOR int fmi2GetReal(Unit *unit, const Reference *references, size_t count, double *values) {
    return unit_get(unit, references, count, values);
}

DOOR int fmi2SetReal(Unit *unit, const Reference *references, size_t count, const double *values) {
    return unit_set(unit, references, count, values);
}

DOOR int fmi2DoStep(Unit *unit, double time, double length, int keeps) {
    return (void)keeps, unit_step(unit, time, length);
}

DOOR int fmi2GetFMUstate(Unit *unit, void **state) { return unit_keep(unit, state); }
DOOR int fmi2SetFMUstate(Unit *unit, void *state) { return unit_go(unit, state); }
DOOR int fmi2FreeFMUstate(Unit *unit, void **state) { return unit_forget(unit, state); }

NONE(fmi2, Integer) NONE(fmi2, Boolean) NONE(fmi2, String)

NOT(fmi2SerializedFMUstateSize) NOT(fmi2SerializeFMUstate) NOT(fmi2DeSerializeFMUstate)
NOT(fmi2GetDirectionalDerivative) NOT(fmi2SetRealInputDerivatives) NOT(fmi2GetRealOutputDerivatives)
NOT(fmi2CancelStep) NOT(fmi2GetStatus) NOT(fmi2GetRealStatus) NOT(fmi2GetIntegerStatus)
NOT(fmi2GetBooleanStatus) NOT(fmi2GetStringStatus)
