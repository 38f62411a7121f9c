/* What compilers expect of a C library even where none is linked. */
#include <stddef.h>

#define KEEP_THE_LOOP __asm__ volatile("" ::: "memory") /* or it would become a call of itself */

void *memcpy(void *restrict to, const void *restrict from, size_t count);
void *memmove(void *to, const void *from, size_t count);
void *memset(void *to, int byte, size_t count);

void *memcpy(void *restrict to, const void *restrict from, size_t count) {
  for (size_t i = 0; i < count; i++) {
    ((char *)to)[i] = ((const char *)from)[i];
    KEEP_THE_LOOP;
  }
  return to;
}

void *memmove(void *to, const void *from, size_t count) {
  if ((char *)to <= (const char *)from) return memcpy(to, from, count);
  while (count--) {
    ((char *)to)[count] = ((const char *)from)[count];
    KEEP_THE_LOOP;
  }
  return to;
}

void *memset(void *to, int byte, size_t count) {
  for (size_t i = 0; i < count; i++) {
    ((char *)to)[i] = (char)byte;
    KEEP_THE_LOOP;
  }
  return to;
}

#if defined(_WIN32)
extern int _fltused;
int _fltused = 1;

int __stdcall DllMainCRTStartup(void *module, unsigned long reason, void *reserved);
int __stdcall DllMainCRTStartup(void *module, unsigned long reason, void *reserved) {
  (void)module, (void)reason, (void)reserved;
  return 1;
}
#endif
