/* An FMI 2.0 co-simulation FMU that does on demand what FMUs should not: `what` in the function numbered `where`, from
   the time `at` on. Its output y counts the steps; z passes the input u through. At instantiation, where no parameter
   is known yet, a name that ends in `instantiate_<what>` asks for it. */

#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef void *Instance;
typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    Logger log;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

enum { SETUP = 1, ENTER, EXIT, SET, STEP, GET, TERMINATE, FREE, RESET, SAVE, RESTORE };
enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING, CRASH = 10, QUIT, LOOP, ABORT, PRINT, TALK, LEAK, NOT_A_STATUS, END,
       LEAVE, VANISH, CLOSE, FORK, MUTE, REMOVE };

typedef struct {
    Callbacks callbacks;
    char name[64];
    int where, what;
    double at, time, u, y;
} State;

static int forked;

static int act(State *s, int what) {
    int i;
    switch (what) {
    case CRASH:
        s->callbacks.log(s->callbacks.environment, s->name, WARNING, "log", "a bit %s", "warm");
        *(volatile int *)0 = 1;
        return OK;
    case QUIT: exit(3);
    case LOOP:
        for (;;) pause();
    case ABORT: abort();
    case PRINT: printf("printed by %s\n", s->name); fflush(stdout); return OK;
    case TALK:
        for (i = 0; i < 1000; i++) s->callbacks.log(s->callbacks.environment, s->name, OK, "log", "line %d", i);
        return OK;
    case LEAK: return malloc(1 << 20) ? OK : ERROR;
    case NOT_A_STATUS: return -7;
    case END: return DISCARD;
    case LEAVE: exit(0);
    case VANISH: _exit(0);
    case CLOSE:
        for (i = 3; i < 256; i++) close(i);
        return OK;
    case MUTE: close(1); return OK;
    case REMOVE: return unlink("run.mcap") ? ERROR : OK;
    case FORK: return forked++ ? OK : fork() < 0 ? ERROR : OK;
    }
    if (what > OK && what <= PENDING)
        s->callbacks.log(s->callbacks.environment, s->name, what, "log", "status %d on demand", what);
    return what;
}

static int at(State *s, int where) { return s->where == where && s->time >= s->at - 1e-9 ? act(s, s->what) : OK; }

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(Instance c, int on, size_t n, const char *const names[]) { return OK; }

Instance fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks,
                         int visible, int logging) {
    const char *demand = strstr(name, "instantiate_");
    State *s = calloc(1, sizeof(State));
    s->callbacks = *callbacks;
    strncpy(s->name, name, sizeof s->name - 1);
    if (demand && act(s, atoi(demand + strlen("instantiate_")))) return NULL;
    return s;
}

void fmi2FreeInstance(Instance c) { at(c, FREE); free(c); }
int fmi2SetupExperiment(Instance c, int relative, double tolerance, double start, int bounded, double stop) {
    return at(c, SETUP);
}
int fmi2EnterInitializationMode(Instance c) { return at(c, ENTER); }
int fmi2ExitInitializationMode(Instance c) { return at(c, EXIT); }
int fmi2Terminate(Instance c) { return at(c, TERMINATE); }
int fmi2Reset(Instance c) { return at(c, RESET); }

int fmi2SetReal(Instance c, const unsigned r[], size_t n, const double v[]) {
    State *s = c;
    size_t i;
    for (i = 0; i < n; i++) *(r[i] == 0 ? &s->u : &s->at) = v[i];
    return at(s, SET);
}
int fmi2SetInteger(Instance c, const unsigned r[], size_t n, const int v[]) {
    State *s = c;
    size_t i;
    for (i = 0; i < n; i++) *(r[i] == 3 ? &s->where : &s->what) = v[i];
    return OK;
}
int fmi2GetReal(Instance c, const unsigned r[], size_t n, double v[]) {
    State *s = c;
    size_t i;
    for (i = 0; i < n; i++) v[i] = r[i] == 0 ? s->u : r[i] == 1 ? s->at : r[i] == 2 ? s->y : 2.0 * s->u;
    return at(s, GET);
}
int fmi2GetInteger(Instance c, const unsigned r[], size_t n, int v[]) { return ERROR; }
int fmi2SetBoolean(Instance c, const unsigned r[], size_t n, const int v[]) { return ERROR; }
int fmi2GetBoolean(Instance c, const unsigned r[], size_t n, int v[]) { return ERROR; }
int fmi2SetString(Instance c, const unsigned r[], size_t n, const char *const v[]) { return ERROR; }
int fmi2GetString(Instance c, const unsigned r[], size_t n, const char *v[]) { return ERROR; }

int fmi2DoStep(Instance c, double time, double step, int no_restore) {
    State *s = c;
    int status;
    s->time = time;
    status = at(s, STEP);
    if (status > WARNING) return status;
    s->time = time + step;
    s->y += 1.0;
    return status;
}
int fmi2CancelStep(Instance c) { return ERROR; }
int fmi2GetStatus(Instance c, int kind, int *value) { return DISCARD; }
int fmi2GetRealStatus(Instance c, int kind, double *value) {
    *value = ((State *)c)->time + 0.025;
    return kind == 2 ? OK : DISCARD;
}
int fmi2GetIntegerStatus(Instance c, int kind, int *value) { return DISCARD; }
int fmi2GetBooleanStatus(Instance c, int kind, int *value) {
    *value = ((State *)c)->what == END;
    return kind == 3 ? OK : DISCARD;
}
int fmi2GetStringStatus(Instance c, int kind, const char **value) { return DISCARD; }
int fmi2SetRealInputDerivatives(Instance c, const unsigned r[], size_t n, const int o[], const double v[]) { return ERROR; }
int fmi2GetRealOutputDerivatives(Instance c, const unsigned r[], size_t n, const int o[], double v[]) { return ERROR; }
int fmi2GetDirectionalDerivative(Instance c, const unsigned u[], size_t n, const unsigned k[], size_t m, const double d[],
                                 double v[]) {
    return ERROR;
}

int fmi2GetFMUstate(Instance c, void **state) {
    if (!*state) *state = malloc(sizeof(State));
    memcpy(*state, c, sizeof(State));
    return at(c, SAVE);
}
int fmi2SetFMUstate(Instance c, void *state) {
    State *s = c, *saved = state;
    s->time = saved->time, s->u = saved->u, s->y = saved->y;
    return at(s, RESTORE);
}
int fmi2FreeFMUstate(Instance c, void **state) {
    free(*state);
    *state = NULL;
    return OK;
}
int fmi2SerializedFMUstateSize(Instance c, void *state, size_t *size) {
    *size = sizeof(State);
    return OK;
}
int fmi2SerializeFMUstate(Instance c, void *state, char bytes[], size_t size) {
    memset(bytes, 0, size);
    ((State *)bytes)->time = ((State *)state)->time;
    ((State *)bytes)->u = ((State *)state)->u;
    ((State *)bytes)->y = ((State *)state)->y;
    return OK;
}
int fmi2DeSerializeFMUstate(Instance c, const char bytes[], size_t size, void **state) {
    *state = malloc(sizeof(State));
    memcpy(*state, bytes, sizeof(State));
    return OK;
}
