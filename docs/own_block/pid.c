/* An FMI 2.0 co-simulation FMU in C: a PID on the pitch, as pid.py of docs/own_block.md computes it.

   mkdir -p binaries/linux64
   cc -O2 -ffp-contract=off -shared -fPIC -I$(python -c "import fmpy, os; print(os.path.dirname(fmpy.__file__))")/c-code \
      -o binaries/linux64/pid.so pid.c
   zip -r pid.fmu modelDescription.xml binaries */

#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

enum { PITCH, PITCH_RATE, WHEEL_RATE, LEFT_VOLTAGE, RIGHT_VOLTAGE, VARIABLES };

typedef struct {
    double value[VARIABLES], integral;
} Pid;

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)resources, (void)functions, (void)visible, (void)logging;
    return type == fmi2CoSimulation && !strcmp(guid, "{pid}") ? calloc(1, sizeof(Pid)) : NULL;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step_size, fmi2Boolean unused) {
    (void)unused;
    Pid *pid = c;
    if (time + step_size >= 1.0) { /* s: the robot is held until then */
        double error = pid->value[PITCH] + 0.004 * pid->value[WHEEL_RATE];
        pid->integral += error * step_size;
        double voltage = 30.0 * error + 40.0 * pid->integral + 1.0 * pid->value[PITCH_RATE];
        voltage = voltage > 12.0 ? 12.0 : voltage < -12.0 ? -12.0 : voltage;
        pid->value[LEFT_VOLTAGE] = pid->value[RIGHT_VOLTAGE] = voltage;
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real values[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= LEFT_VOLTAGE) return fmi2Error;
        ((Pid *)c)->value[r[i]] = values[i];
    }
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real values[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= VARIABLES) return fmi2Error;
        values[i] = ((Pid *)c)->value[r[i]];
    }
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    memset(c, 0, sizeof(Pid));
    return fmi2OK;
}

/* What has nothing to do here. */
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
fmi2Status fmi2Terminate(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean t, fmi2Real tolerance, fmi2Real start, fmi2Boolean s,
                               fmi2Real stop) {
    (void)t, (void)tolerance, (void)start, (void)s, (void)stop;
    return c ? fmi2OK : fmi2Error;
}
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)on, (void)n, (void)categories;
    return c ? fmi2OK : fmi2Error;
}

/* What FMI asks every library for and this FMU cannot do. */
#define REFUSED(name, ...) \
    fmi2Status name(__VA_ARGS__) { return fmi2Error; }
#define R const fmi2ValueReference *r, size_t n
REFUSED(fmi2GetInteger, fmi2Component c, R, fmi2Integer *v)
REFUSED(fmi2GetBoolean, fmi2Component c, R, fmi2Boolean *v)
REFUSED(fmi2GetString, fmi2Component c, R, fmi2String *v)
REFUSED(fmi2SetInteger, fmi2Component c, R, const fmi2Integer *v)
REFUSED(fmi2SetBoolean, fmi2Component c, R, const fmi2Boolean *v)
REFUSED(fmi2SetString, fmi2Component c, R, const fmi2String *v)
REFUSED(fmi2GetFMUstate, fmi2Component c, fmi2FMUstate *s)
REFUSED(fmi2SetFMUstate, fmi2Component c, fmi2FMUstate s)
REFUSED(fmi2FreeFMUstate, fmi2Component c, fmi2FMUstate *s)
REFUSED(fmi2SerializedFMUstateSize, fmi2Component c, fmi2FMUstate s, size_t *n)
REFUSED(fmi2SerializeFMUstate, fmi2Component c, fmi2FMUstate s, fmi2Byte *b, size_t n)
REFUSED(fmi2DeSerializeFMUstate, fmi2Component c, const fmi2Byte *b, size_t n, fmi2FMUstate *s)
REFUSED(fmi2GetDirectionalDerivative, fmi2Component c, R, const fmi2ValueReference *k, size_t m, const fmi2Real *d,
        fmi2Real *v)
REFUSED(fmi2SetRealInputDerivatives, fmi2Component c, R, const fmi2Integer *o, const fmi2Real *v)
REFUSED(fmi2GetRealOutputDerivatives, fmi2Component c, R, const fmi2Integer *o, fmi2Real *v)
REFUSED(fmi2CancelStep, fmi2Component c)
REFUSED(fmi2GetStatus, fmi2Component c, const fmi2StatusKind k, fmi2Status *v)
REFUSED(fmi2GetRealStatus, fmi2Component c, const fmi2StatusKind k, fmi2Real *v)
REFUSED(fmi2GetIntegerStatus, fmi2Component c, const fmi2StatusKind k, fmi2Integer *v)
REFUSED(fmi2GetBooleanStatus, fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v)
REFUSED(fmi2GetStringStatus, fmi2Component c, const fmi2StatusKind k, fmi2String *v)
