/* SPDX-License-Identifier: Apache-2.0 */
/* data/number.c -- parses and formats numbers. */
#include "data/number.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { TOKEN_LIMIT = 1024 }; /* enough for the exact decimal value of any double */

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool number_next_token(const char **at, const char *end, const char **token, size_t *length)
{
    const char *p = *at;
    while (p < end && is_blank(*p))
        p++;
    *token = p;
    while (p < end && !is_blank(*p))
        p++;
    *length = (size_t)(p - *token);
    *at = p;
    return *length > 0;
}

static number_result parse_named(const char *text, size_t length, bool negative, double *out)
{
    if ((length == 3 && strncasecmp(text, "inf", 3) == 0) ||
        (length == 8 && strncasecmp(text, "infinity", 8) == 0))
        *out = negative ? -(double)INFINITY : (double)INFINITY;
    else if (length >= 3 && strncasecmp(text, "nan", 3) == 0 &&
             (length == 3 || (text[3] == '(' && text[length - 1] == ')')))
        *out = (double)NAN;
    else
        return NUMBER_BAD;
    return NUMBER_OK;
}

/* The slow path, for long or extreme numbers. The syntax has already been checked. */
static number_result parse_exactly(const char *text, size_t length, double *out)
{
    char copy[TOKEN_LIMIT + 1];
    memcpy(copy, text, length);
    copy[length] = '\0';
    *out = strtod(copy, NULL);
    return isfinite(*out) ? NUMBER_OK : NUMBER_RANGE;
}

number_result number_parse_double(const char *text, size_t length, double *out)
{
    static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    if (length > TOKEN_LIMIT)
        return NUMBER_BAD;
    const char *p = text, *end = text + length;
    const bool negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+'))
        p++;
    if (p < end && !is_digit(*p) && *p != '.')
        return parse_named(p, (size_t)(end - p), negative, out);
    uint64_t mantissa = 0;
    int digit_count = 0, used_digits = 0, exponent = 0;
    for (; p < end && is_digit(*p); p++, digit_count++) {
        if (mantissa == 0 && *p == '0')
            continue;
        if (++used_digits <= 19)
            mantissa = mantissa * 10 + (uint64_t)(*p - '0');
    }
    if (p < end && *p == '.') {
        for (p++; p < end && is_digit(*p); p++, digit_count++) {
            if (used_digits >= 19) {
                used_digits++;
                continue;
            }
            mantissa = mantissa * 10 + (uint64_t)(*p - '0');
            used_digits += mantissa != 0;
            exponent--;
        }
    }
    if (digit_count == 0)
        return NUMBER_BAD;
    if (p < end && (*p == 'e' || *p == 'E')) {
        p++;
        const bool below = p < end && *p == '-';
        if (p < end && (*p == '-' || *p == '+'))
            p++;
        if (p == end)
            return NUMBER_BAD;
        int power = 0;
        for (; p < end && is_digit(*p); p++)
            power = power < 100000 ? power * 10 + (*p - '0') : power;
        exponent += below ? -power : power;
    }
    if (p != end)
        return NUMBER_BAD;
    /* Both factors are exact doubles, so the quotient or product is rounded once and therefore correctly. */
    if (used_digits <= 19 && mantissa <= (UINT64_C(1) << 53) && exponent >= -22 && exponent <= 22) {
        const double value =
            exponent < 0 ? (double)mantissa / powers[-exponent] : (double)mantissa * powers[exponent];
        *out = negative ? -value : value;
        return NUMBER_OK;
    }
    return parse_exactly(text, length, out);
}

number_result number_parse_u64(const char *text, size_t length, uint64_t *out)
{
    if (length == 0)
        return NUMBER_BAD;
    uint64_t value = 0;
    bool too_big = false;
    for (size_t i = 0; i < length; i++) {
        if (!is_digit(text[i]))
            return NUMBER_BAD;
        too_big |= __builtin_mul_overflow(value, UINT64_C(10), &value);
        too_big |= __builtin_add_overflow(value, (uint64_t)(text[i] - '0'), &value);
    }
    if (too_big)
        return NUMBER_RANGE;
    *out = value;
    return NUMBER_OK;
}

void number_format_double(double value, char out[NUMBER_TEXT_SIZE])
{
    for (int digits = 15; digits <= 17; digits++) {
        const int used = snprintf(out, NUMBER_TEXT_SIZE, "%.*g", digits, value);
        double back;
        if (!isfinite(value) || (number_parse_double(out, (size_t)used, &back) == NUMBER_OK && back == value))
            return;
    }
}
