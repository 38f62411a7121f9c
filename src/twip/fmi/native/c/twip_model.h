/* What a model is to the FMI functions: its variables, and what it does with the values of an instance. */
#ifndef TWIP_MODEL_H
#define TWIP_MODEL_H

#include "twip_text.h"

enum { TWIP_PARAMETER, TWIP_INPUT, TWIP_OUTPUT, TWIP_LOCAL };
enum { TWIP_REAL, TWIP_INTEGER, TWIP_BOOLEAN };

/* A variable of the model description; its value reference is its index. */
typedef struct {
  const char *name, *unit; /* an empty unit: a pure number */
  unsigned char causality, type, tunable;
  double start, minimum, maximum;
} twip_Variable;

/* Takes sentences about what is wrong, one after the other; without one (NULL) nothing is told. */
typedef struct {
  void (*tell)(void *to, const char *sentence);
  void *to;
  const char *prefix; /* before every sentence */
  twip_Text text;
  char sentence[600];
} twip_Report;

/* All values are doubles side by side: those of the variables first, unless `places` says where they are. `clear` sets
   what initialization calculates to zero; `check` and `step` return how many sentences they have told. */
typedef struct {
  const char *name;
  uint32_t exposed, size;
  const twip_Variable *variables;
  const uint32_t *places;
  double inner_step; /* a communication step must be a whole multiple of it; 0: it may be any */
  void (*clear)(double *values);
  void (*initialize)(double *values, double time);
  int (*check)(const double *values, twip_Report *report);
  int (*step)(double *values, double time, double step_size, twip_Report *report);
} twip_Model;

static inline void twip_begin(twip_Report *report) {
  if (!report) return;
  report->text.at = report->sentence;
  report->text.end = report->sentence + sizeof report->sentence - 1;
  twip_put(&report->text, report->prefix);
}

static inline void twip_say(twip_Report *report, const char *part) {
  if (report) twip_put(&report->text, part);
}

static inline void twip_say_number(twip_Report *report, double x, int digits) {
  if (report) twip_put_number(&report->text, x, digits);
}

static inline void twip_end(twip_Report *report) {
  if (!report) return;
  *report->text.at = 0;
  report->tell(report->to, report->sentence);
}

/* A value with its variable's unit. */
static inline void twip_say_value(twip_Report *report, const twip_Variable *variable, double x) {
  twip_say_number(report, x, 10);
  if (!*variable->unit) return;
  twip_say(report, " ");
  twip_say(report, variable->unit);
}

#endif
