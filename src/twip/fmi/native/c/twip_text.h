/* Text with numbers as Python's :.10g writes them, exactly, without a library. */
#ifndef TWIP_TEXT_H
#define TWIP_TEXT_H

#include <stddef.h>

#include "twip_number.h"

/* A text that grows up to the end of its memory; what is longer is cut. */
typedef struct {
  char *at, *end;
} twip_Text;

static inline void twip_put(twip_Text *text, const char *part) {
  while (*part && text->at < text->end) *text->at++ = *part++;
}

static inline void twip_put_digit(twip_Text *text, int digit) {
  if (text->at < text->end) *text->at++ = (char)('0' + digit);
}

enum { TWIP_WORDS = 132, TWIP_WORD_DIGITS = 9, TWIP_DIGITS = TWIP_WORDS * TWIP_WORD_DIGITS };

/* The decimal digits of a finite x > 0 without leading zeros, into `digits`; returns their number, and in `exponent`
   the power of ten of the first. A double m 2^e is a whole number where e >= 0, else m 5^-e / 10^-e. */
static inline int twip_decimal_digits(double x, char digits[TWIP_DIGITS], int *exponent) {
  union {
    double number;
    uint64_t bits;
  } of = {x};
  int e = (int)(of.bits >> 52) - 1075;
  uint64_t m = of.bits & ((UINT64_C(1) << 52) - 1);
  if (e == -1075) e++;
  else m |= UINT64_C(1) << 52;
  while (m % 2 == 0) m /= 2, e++;
  /* words of nine digits, the lowest first */
  const uint32_t base = 1000000000;
  uint32_t word[TWIP_WORDS];
  int words = 0;
  for (; m; m /= base) word[words++] = (uint32_t)(m % base);
  for (int left = e < 0 ? -e : e; left > 0; left -= 12) {
    uint64_t factor = 1, carry = 0;
    for (int i = 0; i < 12 && i < left; i++) factor *= e < 0 ? 5 : 2;
    for (int i = 0; i < words; i++) {
      carry += word[i] * factor;
      word[i] = (uint32_t)(carry % base);
      carry /= base;
    }
    for (; carry; carry /= base) word[words++] = (uint32_t)(carry % base);
  }
  int count = 0;
  for (int i = words - 1; i >= 0; i--)
    for (uint32_t unit = base / 10; unit; unit /= 10) {
      const int digit = (int)(word[i] / unit % 10);
      if (count || digit) digits[count++] = (char)digit;
    }
  *exponent = count - 1 + (e < 0 ? e : 0);
  return count;
}

/* Rounds digits to `wanted`, to the even one in the middle; returns how many are left. */
static inline int twip_round_digits(char digits[TWIP_DIGITS], int count, int wanted, int *exponent) {
  if (count <= wanted) return count;
  bool beyond = false;
  for (int i = wanted + 1; i < count; i++) beyond = beyond || digits[i];
  const bool up = digits[wanted] > 5 || (digits[wanted] == 5 && (beyond || digits[wanted - 1] % 2));
  if (!up) return wanted;
  int i = wanted - 1;
  while (i >= 0 && digits[i] == 9) digits[i--] = 0;
  if (i >= 0) {
    digits[i]++;
  } else {
    digits[0] = 1;
    ++*exponent;
  }
  return wanted;
}

/* A number with `wanted` significant digits, as Python's format `.<wanted>g`. */
static inline void twip_put_number(twip_Text *text, double x, int wanted) {
  if (twip_isnan(x)) {
    twip_put(text, "nan");
    return;
  }
  if (twip_copysign(1.0, x) < 0.0) {
    twip_put(text, "-");
    x = -x;
  }
  if (x == 0.0 || !twip_isfinite(x)) {
    twip_put(text, x == 0.0 ? "0" : "inf");
    return;
  }
  char digits[TWIP_DIGITS];
  int exponent;
  int count = twip_round_digits(digits, twip_decimal_digits(x, digits, &exponent), wanted, &exponent);
  while (count > 1 && !digits[count - 1]) count--;
  const bool scientific = exponent < -4 || exponent >= wanted;
  const int before = scientific ? 1 : exponent + 1; /* digits before the point */
  if (before <= 0) twip_put(text, "0.");
  for (int i = before; i < 0; i++) twip_put(text, "0");
  for (int i = 0; i < count || i < before; i++) {
    if (i == before && i > 0) twip_put(text, ".");
    twip_put_digit(text, i < count ? digits[i] : 0);
  }
  if (scientific) {
    const int size = exponent < 0 ? -exponent : exponent;
    twip_put(text, exponent < 0 ? "e-" : "e+");
    if (size > 99) twip_put_digit(text, size / 100);
    twip_put_digit(text, size / 10 % 10);
    twip_put_digit(text, size % 10);
  }
}

#endif
