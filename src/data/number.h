/* SPDX-License-Identifier: Apache-2.0 */
/* data/number.h -- numbers from and to text, in the C locale (base/plain_numbers.h). */
#ifndef GBT_DATA_NUMBER_H
#define GBT_DATA_NUMBER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum number_result { NUMBER_OK, NUMBER_BAD, NUMBER_RANGE } number_result;

/** The next run of non-blank bytes in [*at, end); false at the end. Moves `*at` behind it. */
bool number_next_token(const char **at, const char *end, const char **token, size_t *length);

/**
 * A whole token as a double, correctly rounded.
 *
 * Decimal digits with an optional point and exponent; also nan, nan(...), inf and infinity with a sign, as C
 * libraries print them. NUMBER_RANGE when the value overflows (1e999). Hexadecimal, a decimal comma and
 * anything behind the number are NUMBER_BAD.
 */
number_result number_parse_double(const char *text, size_t length, double *out);

/** A whole token of decimal digits; NUMBER_RANGE past 2^64 - 1. */
number_result number_parse_u64(const char *text, size_t length, uint64_t *out);

enum { NUMBER_TEXT_SIZE = 40 };

/** The shortest of 15, 16 or 17 significant digits that reads back as the same double, with a '.'. */
void number_format_double(double value, char out[NUMBER_TEXT_SIZE]);

#endif
