/* An FMI 3.0 co-simulation FMU with a scalar and an array of every type, for the tests of the master.

   A step copies every input to its output, arrays in reverse order, and integrates: x += step * u.
   `mode` makes the step that reaches the time `at` end in a special way. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

#define LENGTH 3
#define TEXT 64

/* value reference = 100 * number of the type + one of these */
enum { IN = 1, ARRAY_IN = 2, OUT = 11, ARRAY_OUT = 12 };
enum { MODE = 1, AT = 2, U = 3, X = 4, SETS = 5, TABLE = 6, LOW = 8 };

#define TYPES(_) _(Float64, 1) _(Float32, 2) _(Int8, 3) _(UInt8, 4) _(Int16, 5) _(UInt16, 6) _(Int32, 7) \
                 _(UInt32, 8) _(Int64, 9) _(UInt64, 10) _(Boolean, 11)

typedef char Text[TEXT];

typedef struct {
#define FIELDS(T, k) fmi3##T in_##T, out_##T, array_in_##T[LENGTH], array_out_##T[LENGTH];
    TYPES(FIELDS)
    Text in_String, out_String, array_in_String[LENGTH], array_out_String[LENGTH];
    double u, x, at, table[6];
    int mode;
    unsigned sets;
    fmi3UInt8 low; /* the last 8 bits of in_Int64 */
} Values;

typedef struct {
    Values values;
    int running;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Instance;

static void say(Instance *m, fmi3Status status, const char *text) {
    if (m->log) m->log(m->environment, status, "test", text);
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    Instance *m = instance;
    memset(&m->values, 0, sizeof m->values);
    m->running = 0;
    m->values.at = 1e300;
    for (int i = 0; i < LENGTH; ++i) m->values.array_in_Float64[i] = i + 1;
    for (int i = 0; i < 6; ++i) m->values.table[i] = i;
    return fmi3OK;
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference intermediate[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    if (strcmp(token, "echo3") || events || early) return NULL;
    Instance *m = calloc(1, sizeof *m);
    m->environment = environment;
    m->log = log;
    fmi3Reset(m);
    return m;
}

fmi3Instance fmi3InstantiateModelExchange(
    fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e, fmi3InstanceEnvironment f,
    fmi3LogMessageCallback g) { return NULL; }

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e, fmi3InstanceEnvironment f,
    fmi3LogMessageCallback g, fmi3ClockUpdateCallback h, fmi3LockPreemptionCallback i,
    fmi3UnlockPreemptionCallback j) { return NULL; }

void fmi3FreeInstance(fmi3Instance m) { free(m); }

static void echo(Values *v) {
#define ECHO(T, k) \
    v->out_##T = v->in_##T; \
    for (int i = 0; i < LENGTH; ++i) v->array_out_##T[i] = v->array_in_##T[LENGTH - 1 - i];
    TYPES(ECHO)
    v->low = (fmi3UInt8)v->in_Int64;
    memcpy(v->out_String, v->in_String, TEXT);
    for (int i = 0; i < LENGTH; ++i) memcpy(v->array_out_String[i], v->array_in_String[LENGTH - 1 - i], TEXT);
}

#define OK_FUNCTION(name) fmi3Status name(fmi3Instance m) { return fmi3OK; }
fmi3Status fmi3EnterInitializationMode(
    fmi3Instance m, fmi3Boolean a, fmi3Float64 b, fmi3Float64 c, fmi3Boolean d, fmi3Float64 e) { return fmi3OK; }
fmi3Status fmi3ExitInitializationMode(fmi3Instance m) {
    ((Instance *)m)->running = 1;
    ((Instance *)m)->values.sets = 0;
    echo(&((Instance *)m)->values);
    return fmi3OK;
}
OK_FUNCTION(fmi3Terminate)

/* Access: find the memory of a variable, copy it whole. */
#define FIND(T, k) \
    static fmi3##T *find_##T(Values *v, fmi3ValueReference r, size_t *size) { \
        *size = 1; \
        switch ((int)r - 100 * k) { \
            case IN: return &v->in_##T; \
            case OUT: return &v->out_##T; \
            case ARRAY_IN: *size = LENGTH; return v->array_in_##T; \
            case ARRAY_OUT: *size = LENGTH; return v->array_out_##T; \
        } \
        return special_##T(v, r, size); \
    }
static fmi3Float64 *special_Float64(Values *v, fmi3ValueReference r, size_t *size) {
    if (r == TABLE) *size = 6;
    return r == AT ? &v->at : r == U ? &v->u : r == X ? &v->x : r == TABLE ? v->table : NULL;
}
static fmi3Int32 *special_Int32(Values *v, fmi3ValueReference r, size_t *size) { return r == MODE ? &v->mode : NULL; }
static fmi3UInt32 *special_UInt32(Values *v, fmi3ValueReference r, size_t *size) {
    return r == SETS ? &v->sets : NULL;
}
#define NOTHING(T) \
    static fmi3##T *special_##T(Values *v, fmi3ValueReference r, size_t *size) { return NULL; }
static fmi3UInt8 *special_UInt8(Values *v, fmi3ValueReference r, size_t *size) { return r == LOW ? &v->low : NULL; }
NOTHING(Float32) NOTHING(Int8) NOTHING(Int16) NOTHING(UInt16) NOTHING(Int64) NOTHING(UInt64)
NOTHING(Boolean)

#define ACCESS(T, k) \
    FIND(T, k) \
    fmi3Status fmi3Get##T(fmi3Instance m, const fmi3ValueReference r[], size_t n, fmi3##T x[], size_t nx) { \
        size_t at = 0, size; \
        if (!((Instance *)m)->running) echo(&((Instance *)m)->values); \
        for (size_t i = 0; i < n; ++i, at += size) { \
            fmi3##T *p = find_##T(&((Instance *)m)->values, r[i], &size); \
            if (!p || at + size > nx) return fmi3Error; \
            memcpy(x + at, p, size * sizeof *p); \
        } \
        return at == nx ? fmi3OK : fmi3Error; \
    } \
    fmi3Status fmi3Set##T(fmi3Instance m, const fmi3ValueReference r[], size_t n, const fmi3##T x[], size_t nx) { \
        size_t at = 0, size; \
        for (size_t i = 0; i < n; ++i, at += size) { \
            fmi3##T *p = find_##T(&((Instance *)m)->values, r[i], &size); \
            if (!p || at + size > nx) return fmi3Error; \
            memcpy(p, x + at, size * sizeof *p); \
            ++((Instance *)m)->values.sets; \
        } \
        return at == nx ? fmi3OK : fmi3Error; \
    }
TYPES(ACCESS)

static Text *find_String(Values *v, fmi3ValueReference r, size_t *size) {
    *size = r % 100 == ARRAY_IN || r % 100 == ARRAY_OUT ? LENGTH : 1;
    switch ((int)r - 1200) {
        case IN: return &v->in_String;
        case OUT: return &v->out_String;
        case ARRAY_IN: return v->array_in_String;
        case ARRAY_OUT: return v->array_out_String;
    }
    return NULL;
}
fmi3Status fmi3GetString(fmi3Instance m, const fmi3ValueReference r[], size_t n, fmi3String x[], size_t nx) {
    size_t at = 0, size;
    if (!((Instance *)m)->running) echo(&((Instance *)m)->values);
    for (size_t i = 0; i < n; ++i) {
        Text *p = find_String(&((Instance *)m)->values, r[i], &size);
        if (!p || at + size > nx) return fmi3Error;
        for (size_t j = 0; j < size; ++j) x[at++] = p[j];
    }
    return at == nx ? fmi3OK : fmi3Error;
}
fmi3Status fmi3SetString(fmi3Instance m, const fmi3ValueReference r[], size_t n, const fmi3String x[], size_t nx) {
    size_t at = 0, size;
    for (size_t i = 0; i < n; ++i) {
        Text *p = find_String(&((Instance *)m)->values, r[i], &size);
        if (!p || at + size > nx) return fmi3Error;
        for (size_t j = 0; j < size; ++j) snprintf(p[j], TEXT, "%s", x[at++]);
        ++((Instance *)m)->values.sets;
    }
    return at == nx ? fmi3OK : fmi3Error;
}

fmi3Status fmi3DoStep(
    fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean forward, fmi3Boolean *event,
    fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached) {
    Instance *m = instance;
    Values *v = &m->values;
    *reached = time + step;
    v->x += step * v->u;
    echo(v);
    if (time + step < v->at - 1e-9) return fmi3OK;
    switch (v->mode) {
        case 1: say(m, fmi3Warning, "careful"); return fmi3Warning;
        case 2: say(m, fmi3Warning, "100%s sure: no"); return fmi3Discard;
        case 3: say(m, fmi3Error, "out of range"); return fmi3Error;
        case 4: say(m, fmi3Fatal, "broken"); return fmi3Fatal;
        case 5: *terminate = fmi3True; return fmi3OK;
        case 6: *early = fmi3True; *reached = time + step / 2; return fmi3OK;
        case 7: v->out_Float64 = NAN; return fmi3OK;
        case 8: v->out_Int64 = (1LL << 53) + 1; return fmi3OK;
        case 9: v->array_out_UInt64[1] = ~0ULL; return fmi3OK;
        case 10: v->out_Float32 = INFINITY; return fmi3OK;
        case 11: *event = fmi3True; return fmi3OK;
    }
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance m, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(Values));
    memcpy(*state, &((Instance *)m)->values, sizeof(Values));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance m, fmi3FMUState state) {
    memcpy(&((Instance *)m)->values, state, sizeof(Values));
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance m, fmi3FMUState *state) {
    free(*state);
    *state = NULL;
    return fmi3OK;
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance m, fmi3FMUState state, size_t *size) {
    *size = sizeof(Values);
    return fmi3OK;
}
fmi3Status fmi3SerializeFMUState(fmi3Instance m, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    memcpy(bytes, state, sizeof(Values));
    return fmi3OK;
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance m, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    if (size != sizeof(Values)) return fmi3Error;
    *state = malloc(sizeof(Values));
    memcpy(*state, bytes, sizeof(Values));
    return fmi3OK;
}

/* What the standard also wants to be there. */
#define MISSING(name, ...) fmi3Status name(__VA_ARGS__) { return fmi3Error; }
typedef fmi3Instance I;
typedef const fmi3ValueReference *R;
MISSING(fmi3SetDebugLogging, I m, fmi3Boolean on, size_t n, const fmi3String c[])
MISSING(fmi3EnterEventMode, I m)
MISSING(fmi3GetBinary, I m, R r, size_t n, size_t s[], fmi3Binary x[], size_t nx)
MISSING(fmi3SetBinary, I m, R r, size_t n, const size_t s[], const fmi3Binary x[], size_t nx)
MISSING(fmi3GetClock, I m, R r, size_t n, fmi3Clock x[])
MISSING(fmi3SetClock, I m, R r, size_t n, const fmi3Clock x[])
MISSING(fmi3GetNumberOfVariableDependencies, I m, fmi3ValueReference r, size_t *n)
MISSING(fmi3GetVariableDependencies, I m, fmi3ValueReference r, size_t a[], fmi3ValueReference b[], size_t c[],
        fmi3DependencyKind d[], size_t n)
MISSING(fmi3GetDirectionalDerivative, I m, R u, size_t nu, R k, size_t nk, const fmi3Float64 s[], size_t ns,
        fmi3Float64 x[], size_t nx)
MISSING(fmi3GetAdjointDerivative, I m, R u, size_t nu, R k, size_t nk, const fmi3Float64 s[], size_t ns,
        fmi3Float64 x[], size_t nx)
MISSING(fmi3EnterConfigurationMode, I m)
MISSING(fmi3ExitConfigurationMode, I m)
MISSING(fmi3GetIntervalDecimal, I m, R r, size_t n, fmi3Float64 a[], fmi3IntervalQualifier q[])
MISSING(fmi3GetIntervalFraction, I m, R r, size_t n, fmi3UInt64 a[], fmi3UInt64 b[], fmi3IntervalQualifier q[])
MISSING(fmi3GetShiftDecimal, I m, R r, size_t n, fmi3Float64 a[])
MISSING(fmi3GetShiftFraction, I m, R r, size_t n, fmi3UInt64 a[], fmi3UInt64 b[])
MISSING(fmi3SetIntervalDecimal, I m, R r, size_t n, const fmi3Float64 a[])
MISSING(fmi3SetIntervalFraction, I m, R r, size_t n, const fmi3UInt64 a[], const fmi3UInt64 b[])
MISSING(fmi3SetShiftDecimal, I m, R r, size_t n, const fmi3Float64 a[])
MISSING(fmi3SetShiftFraction, I m, R r, size_t n, const fmi3UInt64 a[], const fmi3UInt64 b[])
MISSING(fmi3EvaluateDiscreteStates, I m)
MISSING(fmi3UpdateDiscreteStates, I m, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *c, fmi3Boolean *d,
        fmi3Boolean *e, fmi3Float64 *f)
MISSING(fmi3EnterContinuousTimeMode, I m)
MISSING(fmi3CompletedIntegratorStep, I m, fmi3Boolean a, fmi3Boolean *b, fmi3Boolean *c)
MISSING(fmi3SetTime, I m, fmi3Float64 t)
MISSING(fmi3SetContinuousStates, I m, const fmi3Float64 x[], size_t n)
MISSING(fmi3GetContinuousStateDerivatives, I m, fmi3Float64 x[], size_t n)
MISSING(fmi3GetEventIndicators, I m, fmi3Float64 x[], size_t n)
MISSING(fmi3GetContinuousStates, I m, fmi3Float64 x[], size_t n)
MISSING(fmi3GetNominalsOfContinuousStates, I m, fmi3Float64 x[], size_t n)
MISSING(fmi3GetNumberOfEventIndicators, I m, size_t *n)
MISSING(fmi3GetNumberOfContinuousStates, I m, size_t *n)
MISSING(fmi3EnterStepMode, I m)
MISSING(fmi3GetOutputDerivatives, I m, R r, size_t n, const fmi3Int32 o[], fmi3Float64 x[], size_t nx)
MISSING(fmi3ActivateModelPartition, I m, fmi3ValueReference r, fmi3Float64 t)
