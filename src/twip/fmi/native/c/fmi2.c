/* FMI 2.0 co-simulation (FMI 2.0.4, chapters 2 and 4) of one model. */
#include "twip_instance.h"

#if defined(FMI2_FUNCTION_PREFIX) && !defined(FMI2_OVERRIDE_FUNCTION_PREFIX)
#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)
#define FMI(name) JOIN(FMI2_FUNCTION_PREFIX, fmi2##name)
#else
#define FMI(name) fmi2##name
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
typedef unsigned int Reference;
typedef int Boolean;
typedef void (*Logger)(void *, const char *, Status, const char *, const char *, ...);
typedef struct {
  Logger logger;
  void *(*allocate)(size_t, size_t);
  void (*release)(void *);
  void (*finished)(void *, Status);
  void *environment;
} Callbacks;

enum { CO_SIMULATION = 1, LAST_SUCCESSFUL_TIME = 2 };

/* The host reads the text as a C format: per cent signs are doubled. */
static void tell_host(Instance *c, Status status, const char *category, const char *text) {
  char format[1200];
  char *at = format;
  for (; *text && at < format + sizeof format - 2; text++) {
    *at++ = *text;
    if (*text == '%') *at++ = '%';
  }
  *at = 0;
  ((Logger)c->logger)(c->environment, c->name, status, category, format);
}

static void tell_nobody(Instance *c, Status status, const char *category, const char *text) {
  (void)c, (void)status, (void)category, (void)text;
}

EXPORT const char *FMI(GetTypesPlatform)(void) { return "default"; }

EXPORT const char *FMI(GetVersion)(void) { return "2.0"; }

EXPORT Instance *FMI(Instantiate)(const char *name, int kind, const char *guid, const char *resources,
    const Callbacks *callbacks, Boolean visible, Boolean logging) {
  (void)resources, (void)visible;
  if (!callbacks || !callbacks->allocate || !callbacks->release) return NULL;
  const char *wrong = NULL;
  if (!name || !*name) wrong = "an instance needs a name";
  else if (!guid || !twip_same(guid, TWIP_TOKEN)) wrong = "the GUID is not that of this FMU";
  else if (kind != CO_SIMULATION) wrong = "this FMU is for co-simulation";
  if (wrong) {
    if (callbacks->logger)
      callbacks->logger(callbacks->environment, name ? name : "", TWIP_ERROR, TWIP_CATEGORIES[TWIP_ERROR], wrong);
    return NULL;
  }
  Instance *c = twip_instantiate(name, callbacks->allocate, callbacks->release, logging);
  if (!c) return NULL;
  c->log = callbacks->logger ? tell_host : tell_nobody;
  c->logger = (void (*)(void))callbacks->logger;
  c->environment = callbacks->environment;
  return c;
}

EXPORT void FMI(FreeInstance)(Instance *c) {
  if (c) c->release(c);
}

EXPORT Status FMI(SetDebugLogging)(Instance *c, Boolean on, size_t count, const char *const *categories) {
  return twip_set_logging(c, on, count, categories);
}

EXPORT Status FMI(SetupExperiment)(
    Instance *c, Boolean with_tolerance, double tolerance, double start, Boolean with_stop, double stop) {
  (void)with_tolerance, (void)tolerance, (void)with_stop, (void)stop;
  return twip_setup(c, start);
}

EXPORT Status FMI(EnterInitializationMode)(Instance *c) { return twip_enter_initialization(c); }

EXPORT Status FMI(ExitInitializationMode)(Instance *c) { return twip_exit_initialization(c); }

EXPORT Status FMI(Terminate)(Instance *c) { return twip_terminate(c); }

EXPORT Status FMI(Reset)(Instance *c) {
  twip_reset(c);
  return TWIP_OK;
}

#define GET(FUNCTION, TYPE, KIND, NAME, VALUE) \
  EXPORT Status FMI(FUNCTION)(Instance *c, const Reference *references, size_t count, TYPE *values) { \
    twip_refresh(c); \
    for (size_t i = 0; i < count; i++) { \
      if (!twip_known(references[i], KIND)) return twip_no_variable(c, references[i], NAME); \
      const double x = *twip_value(c, references[i]); \
      values[i] = VALUE; \
    } \
    return TWIP_OK; \
  }
GET(GetReal, double, TWIP_REAL, "Real", x)
GET(GetInteger, int, TWIP_INTEGER, "Integer", (int)twip_integer(x))
GET(GetBoolean, Boolean, TWIP_BOOLEAN, "Boolean", x != 0.0)

#define SET(FUNCTION, TYPE, KIND, NAME, VALUE) \
  EXPORT Status FMI(FUNCTION)(Instance *c, const Reference *references, size_t count, const TYPE *values) { \
    Status worst = TWIP_OK; \
    for (size_t i = 0; i < count; i++) { \
      const TYPE x = values[i]; \
      const Status status = twip_set(c, references[i], KIND, NAME, VALUE); \
      if (status > worst) worst = status; \
    } \
    return worst; \
  }
SET(SetReal, double, TWIP_REAL, "Real", x)
SET(SetInteger, int, TWIP_INTEGER, "Integer", (double)x)
SET(SetBoolean, Boolean, TWIP_BOOLEAN, "Boolean", x ? 1.0 : 0.0)

EXPORT Status FMI(GetString)(Instance *c, const Reference *references, size_t count, const char **values) {
  (void)values;
  return count ? twip_no_variable(c, references[0], "String") : TWIP_OK;
}

EXPORT Status FMI(SetString)(Instance *c, const Reference *references, size_t count, const char *const *values) {
  (void)values;
  return count ? twip_no_variable(c, references[0], "String") : TWIP_OK;
}

EXPORT Status FMI(DoStep)(Instance *c, double time, double step_size, Boolean no_set_state_prior) {
  (void)no_set_state_prior;
  return twip_do_step(c, time, step_size);
}

EXPORT Status FMI(CancelStep)(Instance *c) { return twip_out_of_turn(c, "steps are not asynchronous"); }

EXPORT Status FMI(GetFMUstate)(Instance *c, void **state) { return twip_get_state(c, state); }

EXPORT Status FMI(SetFMUstate)(Instance *c, const void *state) { return twip_set_state(c, state); }

EXPORT Status FMI(FreeFMUstate)(Instance *c, void **state) { return twip_free_state(c, state); }

EXPORT Status FMI(SerializedFMUstateSize)(Instance *c, const void *state, size_t *size) {
  (void)c, (void)state;
  *size = twip_serialized_size();
  return TWIP_OK;
}

EXPORT Status FMI(SerializeFMUstate)(Instance *c, const void *state, char *bytes, size_t size) {
  return twip_serialize(c, state, bytes, size);
}

EXPORT Status FMI(DeSerializeFMUstate)(Instance *c, const char *bytes, size_t size, void **state) {
  return twip_deserialize(c, bytes, size, state);
}

EXPORT Status FMI(GetDirectionalDerivative)(Instance *c, const Reference *unknown, size_t unknowns,
    const Reference *known, size_t knowns, const double *seed, double *sensitivity) {
  (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)seed, (void)sensitivity;
  return twip_out_of_turn(c, "there are no directional derivatives");
}

EXPORT Status FMI(SetRealInputDerivatives)(
    Instance *c, const Reference *references, size_t count, const int *orders, const double *values) {
  (void)references, (void)count, (void)orders, (void)values;
  return twip_out_of_turn(c, "inputs are not interpolated");
}

EXPORT Status FMI(GetRealOutputDerivatives)(
    Instance *c, const Reference *references, size_t count, const int *orders, double *values) {
  (void)references, (void)count, (void)orders, (void)values;
  return twip_out_of_turn(c, "outputs have no derivatives");
}

EXPORT Status FMI(GetStatus)(Instance *c, int kind, Status *value) {
  (void)c, (void)kind, (void)value;
  return TWIP_DISCARD;
}

EXPORT Status FMI(GetRealStatus)(Instance *c, int kind, double *value) {
  if (kind != LAST_SUCCESSFUL_TIME) return TWIP_DISCARD;
  *value = c->state.reached;
  return TWIP_OK;
}

EXPORT Status FMI(GetIntegerStatus)(Instance *c, int kind, int *value) {
  (void)c, (void)kind, (void)value;
  return TWIP_DISCARD;
}

EXPORT Status FMI(GetBooleanStatus)(Instance *c, int kind, Boolean *value) {
  (void)c, (void)kind, (void)value;
  return TWIP_DISCARD;
}

EXPORT Status FMI(GetStringStatus)(Instance *c, int kind, const char **value) {
  (void)c, (void)kind, (void)value;
  return TWIP_DISCARD;
}
