/* One instance of a model, as FMI 2.0 and 3.0 share it: modes, values, checks, steps and saved states. It has no memory
   but its own: nothing here is global and writable. */
#ifndef TWIP_INSTANCE_H
#define TWIP_INSTANCE_H

#include "identity.h"
#include "twip_model.h"

extern const twip_Model TWIP_MODEL;

typedef enum { TWIP_OK, TWIP_WARNING, TWIP_DISCARD, TWIP_ERROR, TWIP_FATAL } twip_Status;
enum { TWIP_INSTANTIATED, TWIP_INITIALIZATION, TWIP_STEPPING, TWIP_TERMINATED };

static const char *const TWIP_CATEGORIES[] = {"", "logStatusWarning", "logStatusDiscard", "logStatusError"};

/* What a saved state holds; behind it lie the values, and behind them the refused value of each variable (none: not a
   number), which a later valid one heals. */
typedef struct {
  double start_time, reached;
  uint32_t size, mode;
  uint8_t stale, unchecked, warned, failed;
  char reasons[500]; /* why steps fail, for the log */
} twip_State;

typedef struct twip_Instance {
  void (*log)(struct twip_Instance *instance, twip_Status status, const char *category, const char *text);
  void (*logger)(void); /* the host's, and what it wants back */
  void *environment;
  void *(*allocate)(size_t count, size_t size);
  void (*release)(void *memory);
  const char *name;
  uint8_t logged[TWIP_ERROR + 1]; /* by status */
  double *values, *refused;
  twip_State state; /* in front of the values */
} twip_Instance;

static inline size_t twip_state_size(void) {
  return sizeof(twip_State) + sizeof(double) * ((size_t)TWIP_MODEL.size + TWIP_MODEL.exposed);
}

static inline void twip_copy(void *to, const void *from, size_t count) {
  for (size_t i = 0; i < count; i++) ((char *)to)[i] = ((const char *)from)[i];
}

static inline bool twip_same(const char *a, const char *b) {
  while (*a && *a == *b) a++, b++;
  return *a == *b;
}

static inline double *twip_value(const twip_Instance *c, uint32_t reference) {
  return c->values + (TWIP_MODEL.places ? TWIP_MODEL.places[reference] : reference);
}

/* Log */

static inline twip_Status twip_tell(twip_Instance *c, twip_Status status, const char *text) {
  if (c->logged[status]) c->log(c, status, TWIP_CATEGORIES[status], text);
  return status;
}

static inline twip_Status twip_set_logging(twip_Instance *c, bool on, size_t count, const char *const *categories) {
  twip_Status result = TWIP_OK;
  for (int s = TWIP_WARNING; s <= TWIP_ERROR && !count; s++) c->logged[s] = on;
  for (size_t i = 0; i < count; i++) {
    int s = TWIP_ERROR;
    while (s && !twip_same(categories[i], TWIP_CATEGORIES[s])) s--;
    if (s) c->logged[s] = on;
    else result = twip_tell(c, TWIP_ERROR, "unknown log category");
  }
  return result;
}

/* Logs an error and keeps it: every step fails until reset, or until a state from before is restored. */
static inline void twip_fail(void *instance, const char *sentence) {
  twip_Instance *c = instance;
  size_t used = 0;
  while (c->state.reasons[used]) used++;
  twip_Text text = {c->state.reasons + used, c->state.reasons + sizeof c->state.reasons - 1};
  if (used) twip_put(&text, "; ");
  twip_put(&text, sentence);
  *text.at = 0;
  c->state.failed = 1;
  twip_tell(c, TWIP_ERROR, sentence);
}

static inline void twip_discard(void *instance, const char *sentence) { twip_tell(instance, TWIP_DISCARD, sentence); }

static inline void twip_warn(void *instance, const char *sentence) { twip_tell(instance, TWIP_WARNING, sentence); }

static inline twip_Report twip_report(twip_Instance *c, void (*tell)(void *, const char *)) {
  twip_Report report = {tell, c, "", {0, 0}, {0}};
  return report;
}

static inline twip_Status twip_refuse(twip_Instance *c, const char *sentence) {
  twip_fail(c, sentence);
  return TWIP_ERROR;
}

/* Refuses a call that the mode does not allow; the instance goes on as it was. */
static inline twip_Status twip_out_of_turn(twip_Instance *c, const char *sentence) {
  return twip_tell(c, TWIP_ERROR, sentence);
}

/* Checks */

static inline bool twip_below(const twip_Variable *v, double x) { return x < v->minimum; }

static inline bool twip_above(const twip_Variable *v, double x) { return x > v->maximum; }

static inline void twip_say_bound(twip_Report *report, const twip_Variable *v, double x) {
  twip_begin(report);
  twip_say(report, v->name);
  twip_say(report, " = ");
  twip_say_value(report, v, x);
  twip_say(report, twip_below(v, x) ? " must be at least " : " must be at most ");
  twip_say_value(report, v, twip_below(v, x) ? v->minimum : v->maximum);
  twip_end(report);
}

/* Tells one sentence per rule that the parameters break: their bounds, then the rules between them. */
static inline int twip_broken_rules(const twip_Instance *c, twip_Report *report) {
  int broken = 0;
  for (uint32_t r = 0; r < TWIP_MODEL.exposed; r++) {
    const twip_Variable *v = TWIP_MODEL.variables + r;
    const double x = twip_isnan(c->refused[r]) ? *twip_value(c, r) : c->refused[r];
    if (v->causality == TWIP_PARAMETER && (twip_below(v, x) || twip_above(v, x))) {
      twip_say_bound(report, v, x);
      broken++;
    }
  }
  return broken ? broken : TWIP_MODEL.check(c->values, report);
}

static inline bool twip_rules_kept(twip_Instance *c) {
  twip_Report report = twip_report(c, twip_fail);
  c->state.unchecked = 0;
  return twip_broken_rules(c, &report) == 0;
}

static inline void twip_say_step(twip_Report *report, double time, double step_size) {
  twip_say(report, "the step from ");
  twip_say_number(report, time, 10);
  twip_say(report, " s by ");
  twip_say_number(report, step_size, 10);
  twip_say(report, " s");
}

static inline bool twip_outputs_finite(twip_Instance *c, bool after_step, double time, double step_size) {
  double sum = 0.0;
  for (uint32_t r = 0; r < TWIP_MODEL.exposed; r++)
    if (TWIP_MODEL.variables[r].causality == TWIP_OUTPUT) sum += *twip_value(c, r);
  if (twip_isfinite(sum)) return true;
  twip_Report report = twip_report(c, twip_fail);
  for (uint32_t r = 0; r < TWIP_MODEL.exposed; r++) {
    const twip_Variable *v = TWIP_MODEL.variables + r;
    if (v->causality != TWIP_OUTPUT || twip_isfinite(*twip_value(c, r))) continue;
    twip_begin(&report);
    twip_say(&report, v->name);
    twip_say(&report, " = ");
    twip_say_value(&report, v, *twip_value(c, r));
    twip_say(&report, after_step ? " after " : " after initialization");
    if (after_step) twip_say_step(&report, time, step_size);
    twip_say(&report, " must be finite");
    twip_end(&report);
  }
  return !c->state.failed; /* large numbers may have an infinite sum */
}

/* Says once when ticks fall between communication points. */
static inline void twip_warn_of_sampling(twip_Instance *c, double step_size) {
  if (c->state.warned) return;
  c->state.warned = 1;
  const double step = TWIP_MODEL.inner_step > 0.0 ? TWIP_MODEL.inner_step : step_size;
  for (uint32_t r = 0; r < TWIP_MODEL.exposed; r++) {
    const twip_Variable *v = TWIP_MODEL.variables + r;
    const char *last = v->name;
    for (const char *at = v->name; *at; at++)
      if (*at == '.') last = at + 1;
    if (v->causality != TWIP_PARAMETER) continue;
    if (!twip_same(last, "sample_time") && !twip_same(last, "sample_offset")) continue;
    const double steps = *twip_value(c, r) / step;
    if (twip_fabs(steps - twip_floor(steps + 0.5)) <= 1e-9 * twip_max(1.0, steps)) continue;
    twip_Report report = twip_report(c, twip_warn);
    twip_begin(&report);
    twip_say(&report, v->name);
    twip_say(&report, " = ");
    twip_say_number(&report, *twip_value(c, r), 10);
    twip_say(&report, " s is not a multiple of the step ");
    twip_say_number(&report, step, 10);
    twip_say(&report, " s: a sample is taken in the first step that reaches it");
    twip_end(&report);
  }
}

/* Life */

static inline void twip_reset(twip_Instance *c) {
  const twip_State fresh = {0.0, 0.0, TWIP_MODEL.size, TWIP_INSTANTIATED, 1, 1, 0, 0, {0}};
  c->state = fresh;
  for (uint32_t i = 0; i < TWIP_MODEL.size; i++) c->values[i] = 0.0;
  for (uint32_t r = 0; r < TWIP_MODEL.exposed; r++) {
    *twip_value(c, r) = TWIP_MODEL.variables[r].start;
    c->refused[r] = TWIP_NAN;
  }
}

/* Memory in one piece: the instance, its state, its values, its name. */
static inline twip_Instance *twip_instantiate(
    const char *name, void *(*allocate)(size_t, size_t), void (*release)(void *), bool logging) {
  size_t length = 0;
  while (name[length]) length++;
  twip_Instance *c = allocate(1, sizeof *c - sizeof c->state + twip_state_size() + length + 1);
  if (!c) return NULL;
  c->allocate = allocate;
  c->release = release;
  c->values = (double *)(c + 1);
  c->refused = c->values + TWIP_MODEL.size;
  char *kept = (char *)(c->refused + TWIP_MODEL.exposed);
  twip_copy(kept, name, length + 1);
  c->name = kept;
  c->logged[TWIP_WARNING] = logging;
  c->logged[TWIP_DISCARD] = c->logged[TWIP_ERROR] = 1; /* why a call failed is no debugging */
  twip_reset(c);
  return c;
}

/* Runs the initialization if anything it depends on has changed: its result depends on parameters and inputs alone. */
static inline void twip_refresh(twip_Instance *c) {
  if (!c->state.stale) return;
  c->state.stale = 0;
  TWIP_MODEL.clear(c->values);
  if (!twip_broken_rules(c, NULL)) TWIP_MODEL.initialize(c->values, c->state.start_time);
}

static inline twip_Status twip_setup(twip_Instance *c, double start_time) {
  if (c->state.mode != TWIP_INSTANTIATED) return twip_out_of_turn(c, "the start time is set before initialization");
  if (!twip_isfinite(start_time)) return twip_refuse(c, "the start time must be finite");
  c->state.start_time = c->state.reached = start_time;
  c->state.stale = 1;
  return TWIP_OK;
}

static inline twip_Status twip_enter_initialization(twip_Instance *c) {
  if (c->state.mode != TWIP_INSTANTIATED) return twip_out_of_turn(c, "initialization begins once, after instantiation");
  c->state.mode = TWIP_INITIALIZATION;
  return TWIP_OK;
}

static inline twip_Status twip_exit_initialization(twip_Instance *c) {
  if (c->state.mode != TWIP_INITIALIZATION) return twip_out_of_turn(c, "initialization has not begun");
  c->state.mode = TWIP_STEPPING;
  twip_refresh(c);
  if (!twip_rules_kept(c) || c->state.failed) return TWIP_ERROR;
  return twip_outputs_finite(c, false, 0.0, 0.0) ? TWIP_OK : TWIP_ERROR;
}

static inline twip_Status twip_terminate(twip_Instance *c) {
  if (c->state.mode != TWIP_STEPPING) return twip_out_of_turn(c, "termination comes after initialization, once");
  c->state.mode = TWIP_TERMINATED;
  return TWIP_OK;
}

/* Values */

static inline twip_Status twip_no_variable(twip_Instance *c, uint32_t reference, const char *type) {
  twip_Report report = twip_report(c, twip_fail);
  twip_begin(&report);
  twip_say(&report, "value reference ");
  twip_say_number(&report, reference, 10);
  twip_say(&report, " is no ");
  twip_say(&report, type);
  twip_say(&report, " variable of block ");
  twip_say(&report, TWIP_MODEL.name);
  twip_end(&report);
  return TWIP_ERROR;
}

static inline twip_Status twip_cannot_set(twip_Instance *c, const twip_Variable *v, const char *rule, double x, bool shown) {
  twip_Report report = twip_report(c, twip_fail);
  twip_begin(&report);
  twip_say(&report, v->name);
  if (shown) {
    twip_say(&report, " = ");
    twip_say_value(&report, v, x);
  }
  twip_say(&report, rule);
  twip_end(&report);
  return TWIP_ERROR;
}

static inline bool twip_known(uint32_t reference, int type) {
  return reference < TWIP_MODEL.exposed && TWIP_MODEL.variables[reference].type == type;
}

static inline twip_Status twip_set_parameter(twip_Instance *c, uint32_t reference, double x) {
  const twip_Variable *v = TWIP_MODEL.variables + reference;
  if (c->state.mode == TWIP_STEPPING && !v->tunable)
    return twip_cannot_set(c, v, " is a fixed parameter: it cannot be set after initialization", x, false);
  c->state.unchecked = 1;
  if (twip_below(v, x) || twip_above(v, x)) { /* remembered: a host that goes on fails at the next check */
    twip_Report report = twip_report(c, twip_discard);
    twip_say_bound(&report, v, x);
    c->refused[reference] = x;
    return TWIP_DISCARD;
  }
  c->refused[reference] = TWIP_NAN;
  return TWIP_OK;
}

static inline twip_Status twip_set(twip_Instance *c, uint32_t reference, int type, const char *type_name, double x) {
  if (!twip_known(reference, type)) return twip_no_variable(c, reference, type_name);
  const twip_Variable *v = TWIP_MODEL.variables + reference;
  if (v->causality > TWIP_INPUT)
    return twip_cannot_set(
        c, v, v->causality == TWIP_OUTPUT ? " cannot be set: its causality is output" : " cannot be set: its causality is local",
        x, false);
  if (!twip_isfinite(x)) return twip_cannot_set(c, v, " must be finite", x, true);
  if (c->state.mode == TWIP_TERMINATED) return twip_cannot_set(c, v, " cannot be set after termination", x, false);
  if (v->causality == TWIP_PARAMETER) {
    const twip_Status status = twip_set_parameter(c, reference, x);
    if (status != TWIP_OK) return status;
  }
  *twip_value(c, reference) = x;
  if (c->state.mode != TWIP_STEPPING) c->state.stale = 1;
  return TWIP_OK;
}

/* Steps */

static inline twip_Status twip_not_ready(twip_Instance *c, double time, double step_size) {
  twip_Report report = twip_report(c, twip_fail);
  twip_begin(&report);
  if (c->state.mode != TWIP_STEPPING) {
    twip_say(&report, "a step is possible only between initialization and termination");
  } else {
    twip_say_step(&report, time, step_size);
    twip_say(&report, " needs a finite begin and a positive length");
  }
  twip_end(&report);
  return TWIP_ERROR;
}

static inline twip_Status twip_failed_before(twip_Instance *c, double time) {
  twip_Report report = twip_report(c, twip_discard);
  twip_begin(&report);
  twip_say(&report, "no step from ");
  twip_say_number(&report, time, 10);
  twip_say(&report, " s, because of: ");
  twip_say(&report, c->state.reasons);
  twip_end(&report);
  return TWIP_ERROR;
}

static inline twip_Status twip_do_step(twip_Instance *c, double time, double step_size) {
  if (c->state.failed) return twip_failed_before(c, time);
  if (c->state.mode != TWIP_STEPPING || !(step_size > 0.0) || !twip_isfinite(step_size) || !twip_isfinite(time))
    return twip_not_ready(c, time, step_size);
  if (c->state.unchecked && !twip_rules_kept(c)) return TWIP_ERROR;
  twip_warn_of_sampling(c, step_size);
  twip_Report report;
  report.tell = twip_fail;
  report.to = c;
  report.prefix = "";
  if (TWIP_MODEL.step(c->values, time, step_size, &report)) return TWIP_ERROR;
  c->state.reached = time + step_size;
  return twip_outputs_finite(c, true, time, step_size) ? TWIP_OK : TWIP_ERROR;
}

/* Saved states */

static inline twip_Status twip_get_state(twip_Instance *c, void **state) {
  if (!state) return twip_out_of_turn(c, "there is no place for the state");
  if (!*state) *state = c->allocate(1, twip_state_size());
  if (!*state) return twip_out_of_turn(c, "the host gives no memory for the state");
  twip_copy(*state, &c->state, twip_state_size());
  return TWIP_OK;
}

static inline twip_Status twip_set_state(twip_Instance *c, const void *state) {
  if (!state || ((const twip_State *)state)->size != TWIP_MODEL.size)
    return twip_refuse(c, "what is to be restored into block " TWIP_NAME " is not the state of a block");
  twip_copy(&c->state, state, twip_state_size());
  return TWIP_OK;
}

static inline twip_Status twip_free_state(twip_Instance *c, void **state) {
  if (state && *state) c->release(*state);
  if (state) *state = NULL;
  return TWIP_OK;
}

/* The bytes of a state: the token of this build, then the state as it is in memory. */
static inline size_t twip_serialized_size(void) { return sizeof TWIP_TOKEN + twip_state_size(); }

static inline twip_Status twip_serialize(twip_Instance *c, const void *state, char *bytes, size_t size) {
  if (!state || !bytes || size < twip_serialized_size()) return twip_out_of_turn(c, "the memory for the state is too small");
  twip_copy(bytes, TWIP_TOKEN, sizeof TWIP_TOKEN);
  twip_copy(bytes + sizeof TWIP_TOKEN, state, twip_state_size());
  return TWIP_OK;
}

static inline twip_Status twip_deserialize(twip_Instance *c, const char *bytes, size_t size, void **state) {
  if (!bytes || !state || size < sizeof TWIP_TOKEN)
    return twip_out_of_turn(c, "what is to be restored into block " TWIP_NAME " is not the state of a block");
  for (size_t i = 0; i < sizeof TWIP_TOKEN; i++)
    if (bytes[i] != TWIP_TOKEN[i])
      return twip_out_of_turn(c, "the state was not saved by this build of block " TWIP_NAME " and cannot be restored into it");
  if (size != twip_serialized_size()) return twip_out_of_turn(c, "the state of block " TWIP_NAME " is incomplete");
  twip_State head;
  twip_copy(&head, bytes + sizeof TWIP_TOKEN, sizeof head);
  if (head.size != TWIP_MODEL.size || head.mode > TWIP_TERMINATED || head.reasons[sizeof head.reasons - 1])
    return twip_out_of_turn(c, "the state of block " TWIP_NAME " is damaged");
  if (!*state) *state = c->allocate(1, twip_state_size());
  if (!*state) return twip_out_of_turn(c, "the host gives no memory for the state");
  twip_copy(*state, bytes + sizeof TWIP_TOKEN, twip_state_size());
  return TWIP_OK;
}

#endif
