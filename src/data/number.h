/* SPDX-License-Identifier: Apache-2.0 */
/* data/number.h -- parses and formats numbers independently of the locale (base/plain_numbers.h). */
#ifndef GBT_DATA_NUMBER_H
#define GBT_DATA_NUMBER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum number_result { NUMBER_OK, NUMBER_BAD, NUMBER_RANGE } number_result;

/** Find the next run of non-blank bytes in [*at, end) and move `*at` behind it. False when there is none. */
bool number_next_token(const char **at, const char *end, const char **token, size_t *length);

/**
 * Parse a complete token as a double, correctly rounded.
 *
 * Decimal digits with an optional point and exponent; also nan, nan(...), inf and infinity with a sign, as C
 * libraries print them. NUMBER_RANGE when the value overflows (1e999). Hexadecimal, a decimal comma and
 * anything behind the number are NUMBER_BAD.
 */
number_result number_parse_double(const char *text, size_t length, double *out);

/** Parse a complete token of decimal digits; NUMBER_RANGE above 2^64 - 1. */
number_result number_parse_u64(const char *text, size_t length, uint64_t *out);

enum { NUMBER_TEXT_SIZE = 40 };

/** Format with the fewest of 15, 16 or 17 significant digits that read back as the same double; the decimal
    separator is '.'. */
void number_format_double(double value, char out[NUMBER_TEXT_SIZE]);

#endif
