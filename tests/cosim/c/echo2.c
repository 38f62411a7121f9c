/* An FMI 2.0 co-simulation FMU with one variable of every type, for the tests of the master.

   A step copies every input to its output and integrates: x += step * u. */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#define TEXT 64
enum { U, X };

typedef struct {
    double u, x;
    int in[2], out[2]; /* Integer, Boolean */
    char text_in[TEXT], text_out[TEXT];
} Values;

typedef Values *Instance;

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Component fmi2Instantiate(
    fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *callbacks,
    fmi2Boolean visible, fmi2Boolean logging) { return calloc(1, sizeof(Values)); }
void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2Reset(fmi2Component c) {
    memset(c, 0, sizeof(Values));
    return fmi2OK;
}

static void echo(Instance m) {
    memcpy(m->out, m->in, sizeof m->in);
    memcpy(m->text_out, m->text_in, TEXT);
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real x[]) {
    for (size_t i = 0; i < n; ++i) x[i] = r[i] == U ? ((Instance)c)->u : ((Instance)c)->x;
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real x[]) {
    for (size_t i = 0; i < n; ++i) *(r[i] == U ? &((Instance)c)->u : &((Instance)c)->x) = x[i];
    return fmi2OK;
}
static fmi2Status get(fmi2Component c, int kind, const fmi2ValueReference r[], size_t n, int x[]) {
    for (size_t i = 0; i < n; ++i) x[i] = r[i] == 0 ? ((Instance)c)->in[kind] : ((Instance)c)->out[kind];
    return fmi2OK;
}
static fmi2Status set(fmi2Component c, int kind, const fmi2ValueReference r[], size_t n, const int x[]) {
    for (size_t i = 0; i < n; ++i) ((Instance)c)->in[kind] = x[i];
    echo(c);
    return fmi2OK;
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer x[]) {
    return get(c, 0, r, n, x);
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer x[]) {
    return set(c, 0, r, n, x);
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Boolean x[]) {
    return get(c, 1, r, n, x);
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Boolean x[]) {
    return set(c, 1, r, n, x);
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String x[]) {
    for (size_t i = 0; i < n; ++i) x[i] = r[i] == 0 ? ((Instance)c)->text_in : ((Instance)c)->text_out;
    return fmi2OK;
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String x[]) {
    for (size_t i = 0; i < n; ++i) snprintf(((Instance)c)->text_in, TEXT, "%s", x[i]);
    echo(c);
    return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean forward) {
    Instance m = c;
    m->x += step * m->u;
    echo(m);
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state) *state = malloc(sizeof(Values));
    memcpy(*state, c, sizeof(Values));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    memcpy(c, state, sizeof(Values));
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    free(*state);
    *state = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    *size = sizeof(Values);
    return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    memcpy(bytes, state, sizeof(Values));
    return fmi2OK;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    *state = malloc(sizeof(Values));
    memcpy(*state, bytes, sizeof(Values));
    return fmi2OK;
}

#define DONE(name, ...) fmi2Status name(fmi2Component c, ##__VA_ARGS__) { return fmi2OK; }
DONE(fmi2SetDebugLogging, fmi2Boolean on, size_t n, const fmi2String x[])
DONE(fmi2SetupExperiment, fmi2Boolean a, fmi2Real b, fmi2Real t, fmi2Boolean d, fmi2Real e)
DONE(fmi2EnterInitializationMode)
DONE(fmi2ExitInitializationMode)
DONE(fmi2Terminate)
DONE(fmi2GetDirectionalDerivative, const fmi2ValueReference a[], size_t b, const fmi2ValueReference d[], size_t e,
     const fmi2Real f[], fmi2Real g[])
DONE(fmi2SetRealInputDerivatives, const fmi2ValueReference r[], size_t n, const fmi2Integer o[], const fmi2Real x[])
DONE(fmi2GetRealOutputDerivatives, const fmi2ValueReference r[], size_t n, const fmi2Integer o[], fmi2Real x[])
DONE(fmi2CancelStep)
DONE(fmi2GetStatus, const fmi2StatusKind k, fmi2Status *x)
DONE(fmi2GetRealStatus, const fmi2StatusKind k, fmi2Real *x)
DONE(fmi2GetIntegerStatus, const fmi2StatusKind k, fmi2Integer *x)
DONE(fmi2GetBooleanStatus, const fmi2StatusKind k, fmi2Boolean *x)
DONE(fmi2GetStringStatus, const fmi2StatusKind k, fmi2String *x)
