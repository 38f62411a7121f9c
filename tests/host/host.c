/* A host that is not Python: drives one FMU through the C interface of FMI 2.0 or FMI 3.0.

   host VERSION LIBRARY TOKEN RESOURCES STEP STEPS CYCLES REFERENCE...

   VERSION 2 or 3; RESOURCES a URI in FMI 2.0, a path in FMI 3.0; STEP in s. Instantiates, initializes, steps, reads the
   variables of the value references and frees, CYCLES times. Prints the values after the last step as hexadecimal
   floats, then the resident memory in kB after a tenth of the cycles and after all. */

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"

static void fail(const char *what) {
    fprintf(stderr, "host: %s\n", what);
    exit(1);
}

static void log_fmi2(fmi2ComponentEnvironment e, fmi2String i, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)i, (void)c;
    if (s > fmi2OK) fprintf(stderr, "log: %s\n", m);
}

static void log_fmi3(fmi3InstanceEnvironment e, fmi3Status s, fmi3String c, fmi3String m) {
    (void)e, (void)c;
    if (s > fmi3OK) fprintf(stderr, "log: %s\n", m);
}

static long resident(void) {
    long pages = 0, unused = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file || fscanf(file, "%ld %ld", &unused, &pages) != 2) fail("no /proc/self/statm");
    fclose(file);
    return pages * (sysconf(_SC_PAGESIZE) / 1024);
}

static void *library;

static void *function(const char *name) {
    void *address = dlsym(library, name);
    if (!address) fail(dlerror());
    return address;
}

#define CALL2(name, ...) \
    if (((name##TYPE *)function(#name))(__VA_ARGS__) != fmi2OK) fail(#name)
#define CALL3(name, ...) \
    if (((name##TYPE *)function(#name))(__VA_ARGS__) != fmi3OK) fail(#name)

static void cycle2(const char *token, const char *resources, double h, int steps, const fmi2ValueReference *r, int n,
                   double *values) {
    static const fmi2CallbackFunctions callbacks = {log_fmi2, calloc, free, NULL, NULL};
    fmi2Component c = ((fmi2InstantiateTYPE *)function("fmi2Instantiate"))("host", fmi2CoSimulation, token, resources,
                                                                           &callbacks, fmi2False, fmi2True);
    if (!c) fail("fmi2Instantiate");
    CALL2(fmi2SetupExperiment, c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    CALL2(fmi2EnterInitializationMode, c);
    CALL2(fmi2ExitInitializationMode, c);
    for (int k = 0; k < steps; k++) CALL2(fmi2DoStep, c, k * h, h, fmi2True);
    CALL2(fmi2GetReal, c, r, (size_t)n, values);
    CALL2(fmi2Terminate, c);
    ((fmi2FreeInstanceTYPE *)function("fmi2FreeInstance"))(c);
}

static void cycle3(const char *token, const char *resources, double h, int steps, const fmi3ValueReference *r, int n,
                   double *values) {
    fmi3Instance c = ((fmi3InstantiateCoSimulationTYPE *)function("fmi3InstantiateCoSimulation"))(
        "host", token, resources, fmi3False, fmi3True, fmi3False, fmi3False, NULL, 0, NULL, log_fmi3, NULL);
    if (!c) fail("fmi3InstantiateCoSimulation");
    CALL3(fmi3EnterInitializationMode, c, fmi3False, 0.0, 0.0, fmi3False, 0.0);
    CALL3(fmi3ExitInitializationMode, c);
    for (int k = 0; k < steps; k++) {
        fmi3Boolean event = fmi3False, end = fmi3False, early = fmi3False;
        double reached = 0.0;
        CALL3(fmi3DoStep, c, k * h, h, fmi3True, &event, &end, &early, &reached);
    }
    CALL3(fmi3GetFloat64, c, r, (size_t)n, values, (size_t)n);
    CALL3(fmi3Terminate, c);
    ((fmi3FreeInstanceTYPE *)function("fmi3FreeInstance"))(c);
}

int main(int count, char **words) {
    if (count < 9) fail("VERSION LIBRARY TOKEN RESOURCES STEP STEPS CYCLES REFERENCE...");
    int n = count - 8, steps = atoi(words[6]), cycles = atoi(words[7]);
    double h = atof(words[5]), *values = calloc((size_t)n, sizeof(double));
    unsigned *references = calloc((size_t)n, sizeof(unsigned));
    for (int i = 0; i < n; i++) references[i] = (unsigned)strtoul(words[8 + i], NULL, 10);
    library = dlopen(words[2], RTLD_NOW | RTLD_LOCAL);
    if (!library) fail(dlerror());
    long early = 0;
    for (int k = 1; k <= cycles; k++) {
        if (words[1][0] == '2')
            cycle2(words[3], words[4], h, steps, references, n, values);
        else
            cycle3(words[3], words[4], h, steps, references, n, values);
        if (k == (cycles + 9) / 10) early = resident();
    }
    for (int i = 0; i < n; i++) printf("%a\n", values[i]);
    printf("%ld %ld\n", early, resident());
    free(references), free(values);
    return 0;
}
