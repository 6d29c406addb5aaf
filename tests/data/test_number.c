/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/test_number.c -- numbers from text: grammar, rounding, locales; and back. */
#include "data_support.h"

#include <locale.h>

#include "base/plain_numbers.h"
#include "base/rng.h"
#include "data/number.h"

typedef struct number_case {
    const char *text;
    number_result result;
    double value;
} number_case;

static const number_case number_cases[] = {
    {"0", NUMBER_OK, 0},
    {"-0", NUMBER_OK, 0},
    {"+1.5", NUMBER_OK, 1.5},
    {".5", NUMBER_OK, 0.5},
    {"5.", NUMBER_OK, 5},
    {"1e3", NUMBER_OK, 1000},
    {"1E-3", NUMBER_OK, 0.001},
    {"0.1", NUMBER_OK, 0.1},
    {"9007199254740993", NUMBER_OK, 9007199254740992.0},
    {"9007199254740993.00000000000000000000001", NUMBER_OK, 9007199254740994.0},
    {"12345678901234567890123", NUMBER_OK, 12345678901234567890123.0},
    {"0.00000000000000000000000000000000000012345", NUMBER_OK, 1.2345e-37},
    {"1.7976931348623157e308", NUMBER_OK, 1.7976931348623157e308},
    {"4.9406564584124654e-324", NUMBER_OK, 4.9406564584124654e-324},
    {"1e-999", NUMBER_OK, 0},
    {"0e99999999999999999999", NUMBER_OK, 0},
    {"1e999", NUMBER_RANGE, 0},
    {"-1e309", NUMBER_RANGE, 0},
    {"inf", NUMBER_OK, INFINITY},
    {"-Infinity", NUMBER_OK, -INFINITY},
    {"", NUMBER_BAD, 0},
    {"-", NUMBER_BAD, 0},
    {".", NUMBER_BAD, 0},
    {"e5", NUMBER_BAD, 0},
    {"1e", NUMBER_BAD, 0},
    {"1e+", NUMBER_BAD, 0},
    {"1,5", NUMBER_BAD, 0},
    {"1.5.5", NUMBER_BAD, 0},
    {"0x10", NUMBER_BAD, 0},
    {"1.5f", NUMBER_BAD, 0},
    {"--1", NUMBER_BAD, 0},
    {"infinite", NUMBER_BAD, 0},
    {"nano", NUMBER_BAD, 0},
    {"nan(ind", NUMBER_BAD, 0},
};

static void parses(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof number_cases / sizeof number_cases[0]; i++) {
        const number_case *c = &number_cases[i];
        double value = -77;
        const number_result result = number_parse_double(c->text, strlen(c->text), &value);
        if (result != c->result || (result == NUMBER_OK && value != c->value))
            fail_msg("%s: result %d, value %.17g", c->text, (int)result, value);
    }
    static const char *const nans[] = {"nan", "NaN", "-nan", "-nan(ind)", "+nan(0x1)"};
    for (size_t i = 0; i < sizeof nans / sizeof nans[0]; i++) {
        double value = 0;
        assert_int_equal(number_parse_double(nans[i], strlen(nans[i]), &value), NUMBER_OK);
        assert_true(isnan(value));
    }
}

static void reads_only_its_bytes(void **state)
{
    (void)state;
    unsigned char *text = exact_copy("12.5e1", 6);
    double value = 0;
    assert_int_equal(number_parse_double((const char *)text, 6, &value), NUMBER_OK);
    assert_true(value == 125);
    assert_int_equal(number_parse_double((const char *)text, 4, &value), NUMBER_OK);
    assert_true(value == 12.5);
    assert_int_equal(number_parse_double((const char *)text, 5, &value), NUMBER_BAD);
    free(text);
}

static void long_tokens_are_refused(void **state)
{
    (void)state;
    char *text = malloc(10000000);
    memset(text, '9', 10000000);
    double value = 0;
    assert_int_equal(number_parse_double(text, 10000000, &value), NUMBER_BAD);
    uint64_t whole;
    assert_int_equal(number_parse_u64(text, 10000000, &whole), NUMBER_RANGE);
    free(text);
}

static void whole_numbers(void **state)
{
    (void)state;
    uint64_t value = 0;
    assert_int_equal(number_parse_u64("18446744073709551615", 20, &value), NUMBER_OK);
    assert_true(value == UINT64_MAX);
    assert_int_equal(number_parse_u64("18446744073709551616", 20, &value), NUMBER_RANGE);
    assert_int_equal(number_parse_u64("00012", 5, &value), NUMBER_OK);
    assert_true(value == 12);
    assert_int_equal(number_parse_u64("-1", 2, &value), NUMBER_BAD);
    assert_int_equal(number_parse_u64("", 0, &value), NUMBER_BAD);
    assert_int_equal(number_parse_u64("1.0", 3, &value), NUMBER_BAD);
}

/* Every double that prints must read back as itself, for all bit patterns and for the sizes that files
   hold. */
static void round_trip(void **state)
{
    (void)state;
    for (uint64_t i = 0; i < 40000; i++) {
        uint32_t words[4];
        rng_philox(7, 1, i, words);
        double value;
        const uint64_t bits = (uint64_t)words[0] << 32 | words[1];
        memcpy(&value, &bits, sizeof value);
        if (i % 2 == 1)
            value = ((double)words[0] - 2e9) * (i % 4 == 1 ? 1e-7 : 1e-3);
        if (!isfinite(value))
            continue;
        char text[NUMBER_TEXT_SIZE], plain[64];
        number_format_double(value, text);
        snprintf(plain, sizeof plain, "%.*e", (int)(words[2] % 20), value);
        double back = 0, want = strtod(plain, NULL), got = 0;
        assert_int_equal(number_parse_double(text, strlen(text), &back), NUMBER_OK);
        if (isfinite(want))
            assert_int_equal(number_parse_double(plain, strlen(plain), &got), NUMBER_OK);
        if (back != value || (isfinite(want) && got != want))
            fail_msg("index %llu: %.17g: printed %s; %s", (unsigned long long)i, value, text, plain);
    }
}

static void tokens(void **state)
{
    (void)state;
    const char text[] = " \t ab\rc\v\fd ", *at = text, *token;
    size_t length;
    const char *const want[] = {"ab", "c", "d"};
    for (int i = 0; i < 3; i++) {
        assert_true(number_next_token(&at, text + strlen(text), &token, &length));
        assert_int_equal(length, strlen(want[i]));
        assert_memory_equal(token, want[i], length);
    }
    assert_false(number_next_token(&at, text + strlen(text), &token, &length));
}

/* A host program with a decimal comma must not change what we read or write. */
static void any_locale(void **state)
{
    (void)state;
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "de_DE", "fr_FR.UTF-8"};
    const char *set = NULL;
    for (size_t i = 0; i < sizeof names / sizeof names[0] && set == NULL; i++)
        set = setlocale(LC_ALL, names[i]);
    if (set == NULL) {
        print_message("skipped: no locale with a decimal comma is installed\n");
        skip();
    }
    PLAIN_NUMBERS;
    double value = 0;
    char text[NUMBER_TEXT_SIZE];
    const number_result result = number_parse_double("1.23456789012345678901234", 25, &value);
    number_format_double(0.1, text);
    setlocale(LC_ALL, "C");
    assert_int_equal(result, NUMBER_OK);
    assert_true(value == 1.23456789012345678901234);
    assert_string_equal(text, "0.1");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parses),
        cmocka_unit_test(reads_only_its_bytes),
        cmocka_unit_test(long_tokens_are_refused),
        cmocka_unit_test(whole_numbers),
        cmocka_unit_test(round_trip),
        cmocka_unit_test(tokens),
        cmocka_unit_test(any_locale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
