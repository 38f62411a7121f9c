/* A host that is linked with one FMU's sources, for WebAssembly: no files, no library; JavaScript owns the memory. */

#include <stddef.h>

#include "identity.h"

/* Functions are called by their plain names. */
#undef FMI2_FUNCTION_PREFIX
#undef FMI3_FUNCTION_PREFIX

static _Alignas(16) char arena[1 << 20];
static size_t used;
static long blocks; /* of memory that the FMU holds */
static const char *said = "";

static void tell(const char *what) { said = what; }

static void fail(const char *what) {
  said = what;
  __builtin_trap();
}

void *calloc(size_t count, size_t size);
void *calloc(size_t count, size_t size) {
  const size_t wanted = (count * size + 15) / 16 * 16;
  if (wanted > sizeof arena - used) return NULL;
  char *memory = arena + used;
  used += wanted;
  blocks++;
  for (size_t i = 0; i < wanted; i++) memory[i] = 0;
  return memory;
}

void free(void *memory);
void free(void *memory) {
  if (memory && !--blocks) used = 0;
}

#define allocate calloc
#define release free
#define FUNCTION(name) name
#include "cycle.h"

const char *message(void) { return said; }

/* Returns the size of the saved state. */
size_t run(const double *file, double *rows, double *again, char *state, size_t room) {
  const Plan plan = read_plan(file);
  const size_t size = cycle(TWIP_TOKEN, &plan, rows, again, state, room);
  if (blocks) fail("the FMU keeps memory");
  const size_t from = (plan.steps / 2 + 1) * plan.outputs.count;
  for (size_t i = from; i < (plan.steps + 1) * plan.outputs.count; i++) again[i] = 0.0;
  resume(TWIP_TOKEN, &plan, again, state, size);
  same(rows, again, (plan.steps + 1) * plan.outputs.count * sizeof(double), "a deserialized state goes on otherwise");
  return size;
}
