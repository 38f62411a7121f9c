/* FMI 3.0 co-simulation (FMI 3.0.1, chapters 2 and 4) of one model. */
#include "twip_instance.h"

#if defined(FMI3_FUNCTION_PREFIX) && !defined(FMI3_OVERRIDE_FUNCTION_PREFIX)
#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)
#define FMI(name) JOIN(FMI3_FUNCTION_PREFIX, fmi3##name)
#else
#define FMI(name) fmi3##name
#endif
#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

typedef twip_Status Status;
typedef twip_Instance Instance;
typedef uint32_t Reference;
typedef void (*Logger)(void *, Status, const char *, const char *);

/* FMI 3.0 has no callbacks for memory: it comes from what the process has anyway. */
#if defined(_WIN32) && defined(TWIP_NO_LIBRARY)
__declspec(dllimport) void *__stdcall GetProcessHeap(void);
__declspec(dllimport) void *__stdcall HeapAlloc(void *heap, unsigned long flags, size_t size);
__declspec(dllimport) int __stdcall HeapFree(void *heap, unsigned long flags, void *memory);
enum { ZEROED = 8 };

static void *allocate(size_t count, size_t size) { return HeapAlloc(GetProcessHeap(), ZEROED, count * size); }

static void release(void *memory) { HeapFree(GetProcessHeap(), 0, memory); }
#elif defined(TWIP_NO_LIBRARY)
extern void *calloc(size_t count, size_t size);
extern void free(void *memory);

static void *allocate(size_t count, size_t size) { return calloc(count, size); }

static void release(void *memory) { free(memory); }
#else
#include <stdlib.h>

static void *allocate(size_t count, size_t size) { return calloc(count, size); }

static void release(void *memory) { free(memory); }
#endif

static void tell_host(Instance *c, Status status, const char *category, const char *text) {
  ((Logger)c->logger)(c->environment, status, category, text);
}

static void tell_nobody(Instance *c, Status status, const char *category, const char *text) {
  (void)c, (void)status, (void)category, (void)text;
}

EXPORT const char *FMI(GetVersion)(void) { return "3.0"; }

EXPORT Instance *FMI(InstantiateCoSimulation)(const char *name, const char *token, const char *resources, bool visible,
    bool logging, bool event_mode, bool early_return, const Reference *intermediate, size_t intermediates,
    void *environment, Logger logger, void (*update)(void)) {
  (void)resources, (void)visible, (void)event_mode, (void)early_return, (void)intermediate, (void)update;
  const char *wrong = NULL;
  if (!name || !*name) wrong = "an instance needs a name";
  else if (!token || !twip_same(token, TWIP_TOKEN)) wrong = "the instantiation token is not that of this FMU";
  else if (intermediates) wrong = "there are no intermediate variables";
  if (wrong) {
    if (logger) logger(environment, TWIP_ERROR, TWIP_CATEGORIES[TWIP_ERROR], wrong);
    return NULL;
  }
  Instance *c = twip_instantiate(name, allocate, release, logging);
  if (!c) return NULL;
  c->log = logger ? tell_host : tell_nobody;
  c->logger = (void (*)(void))logger;
  c->environment = environment;
  return c;
}

static Instance *co_simulation_only(void *environment, Logger logger) {
  if (logger) logger(environment, TWIP_ERROR, TWIP_CATEGORIES[TWIP_ERROR], "this FMU is for co-simulation");
  return NULL;
}

EXPORT Instance *FMI(InstantiateModelExchange)(const char *name, const char *token, const char *resources, bool visible,
    bool logging, void *environment, Logger logger) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging;
  return co_simulation_only(environment, logger);
}

EXPORT Instance *FMI(InstantiateScheduledExecution)(const char *name, const char *token, const char *resources,
    bool visible, bool logging, void *environment, Logger logger, void (*clock_update)(void), void (*lock)(void),
    void (*unlock)(void)) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)clock_update, (void)lock, (void)unlock;
  return co_simulation_only(environment, logger);
}

EXPORT void FMI(FreeInstance)(Instance *c) {
  if (c) c->release(c);
}

EXPORT Status FMI(SetDebugLogging)(Instance *c, bool on, size_t count, const char *const *categories) {
  return twip_set_logging(c, on, count, categories);
}

EXPORT Status FMI(EnterInitializationMode)(
    Instance *c, bool with_tolerance, double tolerance, double start, bool with_stop, double stop) {
  (void)with_tolerance, (void)tolerance, (void)with_stop, (void)stop;
  const Status status = twip_setup(c, start);
  return status == TWIP_OK ? twip_enter_initialization(c) : status;
}

EXPORT Status FMI(ExitInitializationMode)(Instance *c) { return twip_exit_initialization(c); }

EXPORT Status FMI(Terminate)(Instance *c) { return twip_terminate(c); }

EXPORT Status FMI(Reset)(Instance *c) {
  twip_reset(c);
  return TWIP_OK;
}

static Status wrong_count(Instance *c) { return twip_refuse(c, "the number of values is not that of the variables"); }

static bool is_time(Reference reference) { return reference == TWIP_MODEL.exposed; }

EXPORT Status FMI(GetFloat64)(
    Instance *c, const Reference *references, size_t count, double *values, size_t value_count) {
  if (count != value_count) return wrong_count(c);
  twip_refresh(c);
  for (size_t i = 0; i < count; i++) {
    if (is_time(references[i])) values[i] = c->state.reached;
    else if (twip_known(references[i], TWIP_REAL)) values[i] = *twip_value(c, references[i]);
    else return twip_no_variable(c, references[i], "Float64");
  }
  return TWIP_OK;
}

#define GET(FUNCTION, TYPE, KIND, NAME, VALUE) \
  EXPORT Status FMI(FUNCTION)( \
      Instance *c, const Reference *references, size_t count, TYPE *values, size_t value_count) { \
    if (count != value_count) return wrong_count(c); \
    twip_refresh(c); \
    for (size_t i = 0; i < count; i++) { \
      if (!twip_known(references[i], KIND)) return twip_no_variable(c, references[i], NAME); \
      const double x = *twip_value(c, references[i]); \
      values[i] = VALUE; \
    } \
    return TWIP_OK; \
  }
GET(GetInt32, int32_t, TWIP_INTEGER, "Int32", (int32_t)twip_integer(x))
GET(GetBoolean, bool, TWIP_BOOLEAN, "Boolean", x != 0.0)

#define SET(FUNCTION, TYPE, KIND, NAME, VALUE) \
  EXPORT Status FMI(FUNCTION)( \
      Instance *c, const Reference *references, size_t count, const TYPE *values, size_t value_count) { \
    if (count != value_count) return wrong_count(c); \
    Status worst = TWIP_OK; \
    for (size_t i = 0; i < count; i++) { \
      const TYPE x = values[i]; \
      const Status status = twip_set(c, references[i], KIND, NAME, VALUE); \
      if (status > worst) worst = status; \
    } \
    return worst; \
  }
SET(SetFloat64, double, TWIP_REAL, "Float64", x)
SET(SetInt32, int32_t, TWIP_INTEGER, "Int32", (double)x)
SET(SetBoolean, bool, TWIP_BOOLEAN, "Boolean", x ? 1.0 : 0.0)

/* Types that no variable has. */
#define GET_NONE(NAME, TYPE) \
  EXPORT Status FMI(Get##NAME)( \
      Instance *c, const Reference *references, size_t count, TYPE *values, size_t value_count) { \
    (void)values, (void)value_count; \
    return count ? twip_no_variable(c, references[0], #NAME) : TWIP_OK; \
  }
#define SET_NONE(NAME, TYPE) \
  EXPORT Status FMI(Set##NAME)( \
      Instance *c, const Reference *references, size_t count, const TYPE *values, size_t value_count) { \
    (void)values, (void)value_count; \
    return count ? twip_no_variable(c, references[0], #NAME) : TWIP_OK; \
  }
#define NO_VARIABLES(NAME, TYPE) GET_NONE(NAME, TYPE) SET_NONE(NAME, TYPE)
NO_VARIABLES(Float32, float)
NO_VARIABLES(Int8, int8_t)
NO_VARIABLES(UInt8, uint8_t)
NO_VARIABLES(Int16, int16_t)
NO_VARIABLES(UInt16, uint16_t)
NO_VARIABLES(UInt32, uint32_t)
NO_VARIABLES(Int64, int64_t)
NO_VARIABLES(UInt64, uint64_t)
NO_VARIABLES(String, char *)

EXPORT Status FMI(GetBinary)(Instance *c, const Reference *references, size_t count, size_t *sizes,
    const uint8_t **values, size_t value_count) {
  (void)sizes, (void)values, (void)value_count;
  return count ? twip_no_variable(c, references[0], "Binary") : TWIP_OK;
}

EXPORT Status FMI(SetBinary)(Instance *c, const Reference *references, size_t count, const size_t *sizes,
    const uint8_t *const *values, size_t value_count) {
  (void)sizes, (void)values, (void)value_count;
  return count ? twip_no_variable(c, references[0], "Binary") : TWIP_OK;
}

EXPORT Status FMI(GetClock)(Instance *c, const Reference *references, size_t count, bool *values) {
  (void)values;
  return count ? twip_no_variable(c, references[0], "Clock") : TWIP_OK;
}

EXPORT Status FMI(SetClock)(Instance *c, const Reference *references, size_t count, const bool *values) {
  (void)values;
  return count ? twip_no_variable(c, references[0], "Clock") : TWIP_OK;
}

EXPORT Status FMI(DoStep)(Instance *c, double time, double step_size, bool no_set_state_prior, bool *event,
    bool *terminate, bool *early_return, double *reached) {
  (void)no_set_state_prior;
  const Status status = twip_do_step(c, time, step_size);
  if (event) *event = false;
  if (terminate) *terminate = false;
  if (early_return) *early_return = false;
  if (reached) *reached = c->state.reached;
  return status;
}

EXPORT Status FMI(GetFMUState)(Instance *c, void **state) { return twip_get_state(c, state); }

EXPORT Status FMI(SetFMUState)(Instance *c, const void *state) { return twip_set_state(c, state); }

EXPORT Status FMI(FreeFMUState)(Instance *c, void **state) { return twip_free_state(c, state); }

EXPORT Status FMI(SerializedFMUStateSize)(Instance *c, const void *state, size_t *size) {
  (void)c, (void)state;
  *size = twip_serialized_size();
  return TWIP_OK;
}

EXPORT Status FMI(SerializeFMUState)(Instance *c, const void *state, uint8_t *bytes, size_t size) {
  return twip_serialize(c, state, (char *)bytes, size);
}

EXPORT Status FMI(DeserializeFMUState)(Instance *c, const uint8_t *bytes, size_t size, void **state) {
  return twip_deserialize(c, (const char *)bytes, size, state);
}

/* What this FMU does not do, as its description says. */
#define NOT_OFFERED(NAME, WHAT, ...) \
  EXPORT Status FMI(NAME)(Instance *c, __VA_ARGS__) { return twip_out_of_turn(c, WHAT); }
#define NOT_OFFERED_AT_ALL(NAME, WHAT) \
  EXPORT Status FMI(NAME)(Instance *c) { return twip_out_of_turn(c, WHAT); }
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
NOT_OFFERED_AT_ALL(EnterEventMode, "there are no events")
NOT_OFFERED_AT_ALL(EnterStepMode, "there is no other mode to step in")
NOT_OFFERED_AT_ALL(EnterConfigurationMode, "there are no structural parameters")
NOT_OFFERED_AT_ALL(ExitConfigurationMode, "there are no structural parameters")
NOT_OFFERED_AT_ALL(EvaluateDiscreteStates, "there are no events")
NOT_OFFERED(UpdateDiscreteStates, "there are no events", bool *a, bool *b, bool *n, bool *v, bool *e, double *t)
NOT_OFFERED(GetNumberOfVariableDependencies, "dependencies are in the model description", Reference r, size_t *n)
NOT_OFFERED(GetVariableDependencies, "dependencies are in the model description", Reference r, size_t *a, Reference *b,
    size_t *e, int *k, size_t n)
NOT_OFFERED(GetDirectionalDerivative, "there are no directional derivatives", const Reference *u, size_t nu,
    const Reference *k, size_t nk, const double *s, size_t ns, double *d, size_t nd)
NOT_OFFERED(GetAdjointDerivative, "there are no adjoint derivatives", const Reference *u, size_t nu, const Reference *k,
    size_t nk, const double *s, size_t ns, double *d, size_t nd)
NOT_OFFERED(GetOutputDerivatives, "outputs have no derivatives", const Reference *r, size_t n, const int32_t *o,
    double *v, size_t nv)
NOT_OFFERED(GetIntervalDecimal, "there are no clocks", const Reference *r, size_t n, double *i, int *q)
NOT_OFFERED(GetIntervalFraction, "there are no clocks", const Reference *r, size_t n, uint64_t *c_, uint64_t *s, int *q)
NOT_OFFERED(GetShiftDecimal, "there are no clocks", const Reference *r, size_t n, double *s)
NOT_OFFERED(GetShiftFraction, "there are no clocks", const Reference *r, size_t n, uint64_t *c_, uint64_t *s)
NOT_OFFERED(SetIntervalDecimal, "there are no clocks", const Reference *r, size_t n, const double *i)
NOT_OFFERED(SetIntervalFraction, "there are no clocks", const Reference *r, size_t n, const uint64_t *c_, const uint64_t *s)
NOT_OFFERED(SetShiftDecimal, "there are no clocks", const Reference *r, size_t n, const double *s)
NOT_OFFERED(SetShiftFraction, "there are no clocks", const Reference *r, size_t n, const uint64_t *c_, const uint64_t *s)
NOT_OFFERED_AT_ALL(EnterContinuousTimeMode, "this FMU is for co-simulation")
NOT_OFFERED(CompletedIntegratorStep, "this FMU is for co-simulation", bool p, bool *e, bool *t)
NOT_OFFERED(SetTime, "this FMU is for co-simulation", double t)
NOT_OFFERED(SetContinuousStates, "this FMU is for co-simulation", const double *x, size_t n)
NOT_OFFERED(GetContinuousStateDerivatives, "this FMU is for co-simulation", double *d, size_t n)
NOT_OFFERED(GetEventIndicators, "this FMU is for co-simulation", double *z, size_t n)
NOT_OFFERED(GetContinuousStates, "this FMU is for co-simulation", double *x, size_t n)
NOT_OFFERED(GetNominalsOfContinuousStates, "this FMU is for co-simulation", double *x, size_t n)
NOT_OFFERED(GetNumberOfEventIndicators, "this FMU is for co-simulation", size_t *n)
NOT_OFFERED(GetNumberOfContinuousStates, "this FMU is for co-simulation", size_t *n)
NOT_OFFERED(ActivateModelPartition, "this FMU is for co-simulation", Reference r, double t)
