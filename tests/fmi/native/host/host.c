/* A host of native FMUs for Linux and Windows, of FMI 2.0 or 3.0 (FMI_VERSION).

   host LIBRARY TOKEN PLAN ROWS STATE CYCLES

   Loads the library, does what cycle.h says, and unloads it, CYCLES times; writes the outputs to the file ROWS and the
   state after half of the steps to STATE. CYCLES 0: goes on from STATE and writes the rows after half of the steps. */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#include <windows.h>
typedef wchar_t Letter;
typedef HMODULE Library;
#define OPEN(path, mode) _wfopen(path, L##mode)
#define LOAD(path) LoadLibraryW(path)
#define FIND(library, name) ((void *)GetProcAddress(library, name))
#define UNLOAD(library) FreeLibrary(library)
#define NUMBER(text) _wtoi(text)
#define main wmain
#else
#include <dlfcn.h>
typedef char Letter;
typedef void *Library;
#define OPEN(path, mode) fopen(path, mode)
#define LOAD(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(library, name) dlsym(library, name)
#define UNLOAD(library) (!dlclose(library))
#define NUMBER(text) atoi(text)
#endif

static Library library;
static long blocks; /* of memory that the FMU holds */

static void tell(const char *what) { fprintf(stderr, "host: %s\n", what); }

static void fail(const char *what) {
  tell(what);
  exit(1);
}

#if FMI_VERSION == 2
static void *allocate(size_t count, size_t size) {
  blocks++;
  return calloc(count, size);
}

static void release(void *memory) {
  blocks--;
  free(memory);
}
#endif

static void *find(const char *name) {
  void *address = FIND(library, name);
  if (!address) fail(name);
  return address;
}

#define FUNCTION(name) ((name##TYPE *)find(#name))
#include "cycle.h"

static void *read_all(const Letter *path, size_t *size) {
  FILE *file = OPEN(path, "rb");
  if (!file || fseek(file, 0, SEEK_END)) fail("a file cannot be read");
  *size = (size_t)ftell(file);
  rewind(file);
  void *content = malloc(*size + 1);
  if (!content || fread(content, 1, *size, file) != *size) fail("a file cannot be read");
  fclose(file);
  return content;
}

static void write_all(const Letter *path, const void *content, size_t size) {
  FILE *file = OPEN(path, "wb");
  if (!file || fwrite(content, 1, size, file) != size || fclose(file)) fail("a file cannot be written");
}

int main(int count, Letter **words) {
  if (count != 7) fail("LIBRARY TOKEN PLAN ROWS STATE CYCLES");
  char token[200] = "";
  for (size_t i = 0; words[2][i] && i < sizeof token - 1; i++) token[i] = (char)words[2][i];
  size_t size = 0, room = 1 << 20;
  double *file = read_all(words[3], &size);
  const Plan plan = read_plan(file);
  const size_t all = (plan.steps + 1) * plan.outputs.count, half = (plan.steps / 2 + 1) * plan.outputs.count;
  double *rows = calloc(all, sizeof(double)), *again = calloc(all, sizeof(double));
  const int cycles = NUMBER(words[6]);
  char *state = cycles ? malloc(room) : read_all(words[5], &size);
  for (int k = 0; k < (cycles ? cycles : 1); k++) {
    library = LOAD(words[1]);
    if (!library) fail("the library does not load");
    if (cycles) size = cycle(token, &plan, rows, again, state, room);
    else resume(token, &plan, rows, state, size);
    if (!UNLOAD(library)) fail("the library does not unload");
    if (blocks) fail("the FMU keeps memory");
  }
  if (cycles) write_all(words[5], state, size);
  write_all(words[4], cycles ? rows : rows + half, (cycles ? all : all - half) * sizeof(double));
  free(file), free(rows), free(again), free(state);
  return 0;
}
