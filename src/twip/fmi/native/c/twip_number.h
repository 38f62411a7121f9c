/* Arithmetic of the kernels as Python has it, without a library. */
#ifndef TWIP_NUMBER_H
#define TWIP_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define TWIP_INFINITY __builtin_inf()
#define TWIP_NAN __builtin_nan("")
#define twip_sqrt __builtin_sqrt
#define twip_fabs __builtin_fabs
#define twip_copysign __builtin_copysign
#else
#include <math.h>
#define TWIP_INFINITY INFINITY
#define TWIP_NAN NAN
#define twip_sqrt sqrt
#define twip_fabs fabs
#define twip_copysign copysign
#endif

static inline bool twip_isnan(double x) { return x != x; }

static inline bool twip_isfinite(double x) { return x - x == 0.0; }

/* The largest whole number not above x. Python's is an integer, which has no -0. */
static inline double twip_floor(double x) {
  if (!(x > -4503599627370496.0 && x < 4503599627370496.0)) return x; /* whole already, infinite, or not a number */
  const double whole = (double)(int64_t)x;
  return whole > x ? whole - 1.0 : whole;
}

/* x without its fraction; what 64 bits cannot hold becomes the nearest that they can, and what is no number 0. */
static inline int64_t twip_integer(double x) {
  if (x >= 9223372036854775808.0) return INT64_MAX;
  if (x <= -9223372036854775808.0) return INT64_MIN;
  return x == x ? (int64_t)x : 0;
}

static inline double twip_max(double a, double b) { return b > a ? b : a; }

static inline double twip_min(double a, double b) { return b < a ? b : a; }

/* a // b and a % b of integers, b > 0. */
static inline int64_t twip_floor_divide(int64_t a, int64_t b) { return a / b - (a % b < 0); }

static inline int64_t twip_floor_remainder(int64_t a, int64_t b) { return a % b < 0 ? a % b + b : a % b; }

typedef union {
  double number;
  uint64_t bits;
} twip_Double;

/* A power of two, -1022 <= n <= 1023. */
static inline double twip_power_of_two(int64_t n) {
  twip_Double result;
  result.bits = (uint64_t)(n + 1023) << 52;
  return result.number;
}

/* x 2^n, rounded once: a way down that ends below the normal numbers is gone in steps that keep all 53 bits. */
static inline double twip_ldexp(double x, int64_t n) {
  for (int i = 0; i < 3 && n > 1023; i++) x *= twip_power_of_two(1023), n -= 1023;
  for (int i = 0; i < 3 && n < -1022; i++) x *= twip_power_of_two(-969), n += 969;
  return x * twip_power_of_two(n > 1023 ? 1023 : n < -1022 ? -1022 : n);
}

/* x = fraction 2^exponent with the fraction in [0.5, 1); 0, infinities and what is no number have the exponent 0. */
static inline int64_t twip_exponent(double x) {
  twip_Double of;
  of.number = x;
  const int64_t biased = (int64_t)(of.bits >> 52 & 0x7ff);
  if (biased == 0x7ff || x == 0.0) return 0;
  if (biased) return biased - 1022;
  of.number = x * 18014398509481984.0; /* 2^54 */
  return (int64_t)(of.bits >> 52 & 0x7ff) - 1022 - 54;
}

static inline double twip_fraction(double x) {
  twip_Double of;
  of.number = x;
  if (x == 0.0 || !twip_isfinite(x)) return x;
  if (!(of.bits >> 52 & 0x7ff)) of.number = x * 18014398509481984.0;
  of.bits = (of.bits & ~(UINT64_C(0x7ff) << 52)) | UINT64_C(1022) << 52;
  return of.number;
}

/* The place of an element in a table: Python counts negative ones from the end and raises beyond; here none is. */
static inline int64_t twip_index(int64_t i, int64_t size) {
  if (i < 0) i += size;
  return i < 0 ? 0 : i >= size ? size - 1 : i;
}

#endif
