/* What a host does with a native FMU of FMI 2.0 (FMI_VERSION 2) or FMI 3.0 (3): a run, half of it again from a saved
   state, all of it again after a reset. Who includes this says before how a function of the FMU is found,
   FUNCTION(name), and how a failure ends the host, fail(what). */

#include <stddef.h>
#include <stdint.h>

#if FMI_VERSION == 2
#include "fmi2Functions.h"
#define CALL(name) FUNCTION(fmi2##name)
typedef fmi2Component Instance;
typedef fmi2ValueReference Reference;
typedef fmi2FMUstate State;
typedef fmi2Byte Byte;
#define OK fmi2OK
#else
#include "fmi3Functions.h"
#define CALL(name) FUNCTION(fmi3##name)
typedef fmi3Instance Instance;
typedef fmi3ValueReference Reference;
typedef fmi3FMUState State;
typedef fmi3Byte Byte;
#define OK fmi3OK
#endif

#define DO(name, ...) \
  if (CALL(name)(__VA_ARGS__) != OK) fail(#name)

enum { REAL, WHOLE, FLAG };

/* Variables: value references and types, as numbers. */
typedef struct {
  size_t count;
  const double *references, *types;
} Variables;

/* What is to be run, in s. The rows of inputs hold at the beginning of each step, the first at initialization too. */
typedef struct {
  double step_size;
  size_t steps;
  Variables inputs, parameters, outputs;
  const double *values; /* of the parameters */
  const double *rows;   /* of the inputs */
} Plan;

static Variables variables(const double **at, double count) {
  Variables found = {(size_t)count, *at, *at + (size_t)count};
  *at += 2 * found.count;
  return found;
}

/* A plan lies in a file of doubles in the order of its members, after step size, steps and the numbers of variables. */
static Plan read_plan(const double *file) {
  Plan plan = {file[0], (size_t)file[1], {0}, {0}, {0}, NULL, NULL};
  const double *at = file + 5;
  plan.inputs = variables(&at, file[2]);
  plan.parameters = variables(&at, file[3]);
  plan.outputs = variables(&at, file[4]);
  plan.values = at;
  plan.rows = at + plan.parameters.count;
  return plan;
}

#if FMI_VERSION == 2
static void log_message(fmi2ComponentEnvironment e, fmi2String i, fmi2Status s, fmi2String c, fmi2String m, ...) {
  (void)e, (void)i, (void)c;
  if (s != fmi2OK) tell(m);
}

static const fmi2CallbackFunctions callbacks = {log_message, allocate, release, NULL, NULL};

static Instance make(const char *token) {
  Instance c = CALL(Instantiate)("host", fmi2CoSimulation, token, NULL, &callbacks, fmi2False, fmi2True);
  if (!c) fail("Instantiate");
  return c;
}

static void enter(Instance c) {
  DO(SetupExperiment, c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
  DO(EnterInitializationMode, c);
}

static void step(Instance c, double time, double size) { DO(DoStep, c, time, size, fmi2False); }

static void set_one(Instance c, Reference r, double type, double value) {
  fmi2Real real = value;
  fmi2Integer whole = (fmi2Integer)value;
  if (type == REAL) DO(SetReal, c, &r, 1, &real);
  if (type == WHOLE) DO(SetInteger, c, &r, 1, &whole);
  if (type == FLAG) DO(SetBoolean, c, &r, 1, &whole);
}

static double get_one(Instance c, Reference r, double type) {
  fmi2Real real = 0.0;
  fmi2Integer whole = 0;
  if (type == REAL) DO(GetReal, c, &r, 1, &real);
  if (type == WHOLE) DO(GetInteger, c, &r, 1, &whole);
  if (type == FLAG) DO(GetBoolean, c, &r, 1, &whole);
  return type == REAL ? real : (double)whole;
}

#define STATE_CALL(name) name##FMUstate
#else
static void log_message(fmi3InstanceEnvironment e, fmi3Status s, fmi3String c, fmi3String m) {
  (void)e, (void)c;
  if (s != fmi3OK) tell(m);
}

static Instance make(const char *token) {
  Instance c = CALL(InstantiateCoSimulation)("host", token, NULL, fmi3False, fmi3True, fmi3False, fmi3False, NULL, 0,
                                             NULL, log_message, NULL);
  if (!c) fail("InstantiateCoSimulation");
  return c;
}

static void enter(Instance c) { DO(EnterInitializationMode, c, fmi3False, 0.0, 0.0, fmi3False, 0.0); }

static void step(Instance c, double time, double size) {
  fmi3Boolean event = fmi3True, end = fmi3True, early = fmi3True;
  fmi3Float64 reached = -1.0;
  DO(DoStep, c, time, size, fmi3False, &event, &end, &early, &reached);
  if (event || end || early || reached != time + size) fail("DoStep returned early");
}

static void set_one(Instance c, Reference r, double type, double value) {
  fmi3Float64 real = value;
  fmi3Int32 whole = (fmi3Int32)value;
  fmi3Boolean flag = value != 0.0;
  if (type == REAL) DO(SetFloat64, c, &r, 1, &real, 1);
  if (type == WHOLE) DO(SetInt32, c, &r, 1, &whole, 1);
  if (type == FLAG) DO(SetBoolean, c, &r, 1, &flag, 1);
}

static double get_one(Instance c, Reference r, double type) {
  fmi3Float64 real = 0.0;
  fmi3Int32 whole = 0;
  fmi3Boolean flag = fmi3False;
  if (type == REAL) DO(GetFloat64, c, &r, 1, &real, 1);
  if (type == WHOLE) DO(GetInt32, c, &r, 1, &whole, 1);
  if (type == FLAG) DO(GetBoolean, c, &r, 1, &flag, 1);
  return type == REAL ? real : type == WHOLE ? (double)whole : (double)flag;
}

#define STATE_CALL(name) name##FMUState
#endif
#define DO_STATE(name, ...) DO_EXPANDED(STATE_CALL(name), __VA_ARGS__)
#define DO_EXPANDED(name, ...) DO(name, __VA_ARGS__)

static void set_all(Instance c, const Variables *which, const double *values) {
  for (size_t i = 0; i < which->count; i++) set_one(c, (Reference)which->references[i], which->types[i], values[i]);
}

static void get_all(Instance c, const Variables *which, double *values) {
  for (size_t i = 0; i < which->count; i++) values[i] = get_one(c, (Reference)which->references[i], which->types[i]);
}

/* Steps from row `from` to row `to` of the outputs. */
static void go(Instance c, const Plan *plan, size_t from, size_t to, double *rows) {
  for (size_t k = from; k < to; k++) {
    set_all(c, &plan->inputs, plan->rows + k * plan->inputs.count);
    step(c, (double)k * plan->step_size, plan->step_size);
    get_all(c, &plan->outputs, rows + (k + 1) * plan->outputs.count);
  }
}

/* Initializes and returns the first row of the outputs. */
static void begin(Instance c, const Plan *plan, double *rows) {
  set_all(c, &plan->parameters, plan->values);
  enter(c);
  set_all(c, &plan->inputs, plan->rows);
  DO(ExitInitializationMode, c);
  get_all(c, &plan->outputs, rows);
}

static void same(const void *a, const void *b, size_t size, const char *what) {
  for (size_t i = 0; i < size; i++)
    if (((const char *)a)[i] != ((const char *)b)[i]) fail(what);
}

/* Runs the plan into `rows`, of steps + 1 rows of outputs; `again` is as large. The state after half of the steps is
   serialized into `bytes`; returns its size, which is at most `room`. */
static size_t cycle(const char *token, const Plan *plan, double *rows, double *again, char *bytes, size_t room) {
  const size_t half = plan->steps / 2, row = plan->outputs.count, all = (plan->steps + 1) * row * sizeof(double);
  Instance c = make(token);
  begin(c, plan, rows);
  go(c, plan, 0, half, rows);
  State state = NULL;
  DO_STATE(Get, c, &state);
  go(c, plan, half, plan->steps, rows);
  DO_STATE(Set, c, state);
  for (size_t i = 0; i < (half + 1) * row; i++) again[i] = rows[i];
  go(c, plan, half, plan->steps, again);
  same(rows, again, all, "the run goes on otherwise from a restored state");
  size_t size = 0;
#if FMI_VERSION == 2
  DO(SerializedFMUstateSize, c, state, &size);
  if (size > room) fail("the state is larger than the host's room");
  DO(SerializeFMUstate, c, state, bytes, size);
#else
  DO(SerializedFMUStateSize, c, state, &size);
  if (size > room) fail("the state is larger than the host's room");
  DO(SerializeFMUState, c, state, (Byte *)bytes, size);
#endif
  DO_STATE(Free, c, &state);
  if (state) fail("a freed state is still there");
  DO(Reset, c);
  begin(c, plan, again);
  go(c, plan, 0, plan->steps, again);
  same(rows, again, all, "the run differs after a reset");
  DO(Terminate, c);
  CALL(FreeInstance)(c);
  return size;
}

/* Runs the second half of the plan in a new instance, from a serialized state. */
static void resume(const char *token, const Plan *plan, double *rows, const char *bytes, size_t size) {
  Instance c = make(token);
  State state = NULL;
#if FMI_VERSION == 2
  DO(DeSerializeFMUstate, c, bytes, size, &state);
#else
  DO(DeserializeFMUState, c, (const Byte *)bytes, size, &state);
#endif
  DO_STATE(Set, c, state);
  DO_STATE(Free, c, &state);
  go(c, plan, plan->steps / 2, plan->steps, rows);
  DO(Terminate, c);
  CALL(FreeInstance)(c);
}
