/* tests/cli/test_options.c -- the text of one option to its value, at and beyond every edge; guesses at mistyped names. */
#include "cli/options.h"
#include "test_support.h"

typedef union any_value {
    bool flag;
    int whole;
    uint64_t word;
    float single;
    double number;
    const char *text;
    size_t size;
} any_value;

typedef struct value_case {
    option_kind kind;
    const char *text;
    double min, max;
    bool ok;
    double value; /* if ok; texts are compared with the input */
} value_case;

static const value_case value_cases[] = {
    {OPTION_INT, "0", 0, 10, true, 0}, {OPTION_INT, "10", 0, 10, true, 10}, {OPTION_INT, "11", 0, 10, false, 0}, {OPTION_INT, "-1", 0, 10, false, 0},
    {OPTION_INT, "-5", -5, 5, true, -5}, {OPTION_INT, "-6", -5, 5, false, 0}, {OPTION_INT, "2147483647", 0, 2147483647, true, 2147483647},
    {OPTION_INT, "2147483648", 0, 2147483647, false, 0}, {OPTION_INT, "9223372036854775808", 0, 2147483647, false, 0}, {OPTION_INT, "", 0, 10, false, 0},
    {OPTION_INT, "-", -5, 5, false, 0}, {OPTION_INT, "1e1", 0, 10, false, 0}, {OPTION_INT, "--1", -5, 5, false, 0}, {OPTION_INT, "007", 0, 10, true, 7},
    {OPTION_INT, " 3", 0, 10, false, 0}, {OPTION_INT, "3 ", 0, 10, false, 0}, {OPTION_INT, "3.0", 0, 10, false, 0}, {OPTION_INT, "+3", 0, 10, false, 0},
    {OPTION_INT, "0x10", 0, 99, false, 0}, {OPTION_INT, "-9223372036854775809", -5, 5, false, 0}, {OPTION_FLOAT, "1,5", 0, 9, false, 0},
    {OPTION_FLOAT, ".", 0, 9, false, 0}, {OPTION_FLOAT, "1e", 0, 9, false, 0}, {OPTION_FLOAT, "-inf", -9, 9, false, 0},
    {OPTION_UINT64, "18446744073709551615", 0, 0, true, 0x1p64}, {OPTION_UINT64, "18446744073709551616", 0, 0, false, 0},
    {OPTION_UINT64, "0", 1, 5, false, 0}, {OPTION_UINT64, "1", 1, 5, true, 1}, {OPTION_UINT64, "6", 1, 5, false, 0}, {OPTION_UINT64, "+1", 0, 0, false, 0},
    {OPTION_FLOAT, "0.5", 0, 1, true, 0.5}, {OPTION_FLOAT, "1", 0, 1, true, 1}, {OPTION_FLOAT, "1.0000001", 0, 1, false, 0}, {OPTION_FLOAT, ".5", 0, 1, true, 0.5},
    {OPTION_FLOAT, "5.", 0, 9, true, 5}, {OPTION_FLOAT, "5e-1", 0, 1, true, 0.5}, {OPTION_FLOAT, "5E0", 0, 9, true, 5}, {OPTION_FLOAT, "e5", 0, 9, false, 0},
    {OPTION_FLOAT, "infinity", 0, 9, false, 0}, {OPTION_FLOAT, "nan", 0, 9, false, 0}, {OPTION_FLOAT, "0x1p0", 0, 9, false, 0}, {OPTION_FLOAT, "-0", 0, 9, true, 0},
    {OPTION_FLOAT, "1 ", 0, 9, false, 0}, {OPTION_FLOAT, "1_0", 0, 99, false, 0},
    {OPTION_DOUBLE, "1e308", 0, 1e308, true, 1e308}, {OPTION_DOUBLE, "1e309", 0, HUGE_VAL, false, 0}, {OPTION_DOUBLE, "-2.5e+0", -3, 0, true, -2.5},
    {OPTION_DURATION, "90", 1, 1e6, true, 90}, {OPTION_DURATION, "90s", 1, 1e6, true, 90}, {OPTION_DURATION, "10m", 1, 1e6, true, 600},
    {OPTION_DURATION, "1h", 1, 1e6, true, 3600}, {OPTION_DURATION, "1h30m", 1, 1e6, true, 5400}, {OPTION_DURATION, "1h1s", 1, 1e6, true, 3601},
    {OPTION_DURATION, "1.5m", 1, 1e6, true, 90}, {OPTION_DURATION, "30m1h", 1, 1e6, false, 0}, {OPTION_DURATION, "1m1m", 1, 1e6, false, 0},
    {OPTION_DURATION, "1m30", 1, 1e6, false, 0}, {OPTION_DURATION, "10d", 1, 1e6, false, 0}, {OPTION_DURATION, "m", 1, 1e6, false, 0},
    {OPTION_DURATION, "-1m", -1e6, 1e6, false, 0}, {OPTION_DURATION, "1h-1m", 1, 1e6, false, 0}, {OPTION_DURATION, "0.5", 1, 1e6, false, 0},
    {OPTION_DURATION, "", 0, 1e6, false, 0}, {OPTION_DURATION, "10 m", 1, 1e6, false, 0}, {OPTION_DURATION, "1e400h", 1, HUGE_VAL, false, 0},
    {OPTION_SIZE, "6G", 1, 0x1p50, true, 6442450944.0}, {OPTION_SIZE, "512M", 1, 0x1p50, true, 536870912}, {OPTION_SIZE, "1K", 1, 0x1p50, true, 1024},
    {OPTION_SIZE, "0.5K", 1, 0x1p50, true, 512}, {OPTION_SIZE, "100", 1, 0x1p50, true, 100}, {OPTION_SIZE, "2T", 1, 0x1p50, true, 2199023255552.0},
    {OPTION_SIZE, "6g", 1, 0x1p50, false, 0}, {OPTION_SIZE, "6GB", 1, 0x1p50, false, 0}, {OPTION_SIZE, "-6G", -1e9, 0x1p50, false, 0},
    {OPTION_SIZE, "1023", 1024, 0x1p50, false, 0}, {OPTION_SIZE, "9223372036854775808", 0, 1e30, false, 0}, {OPTION_SIZE, "G", 0, 1e30, false, 0},
    {OPTION_STRING, "a b", 0, 0, true, 0}, {OPTION_STRING, "", 0, 0, false, 0},
    {OPTION_CHOICE, "one", 0, 0, true, 0}, {OPTION_CHOICE, "two", 0, 0, true, 0}, {OPTION_CHOICE, "three", 0, 0, true, 0}, {OPTION_CHOICE, "on", 0, 0, false, 0},
    {OPTION_CHOICE, "one|two", 0, 0, false, 0}, {OPTION_CHOICE, "", 0, 0, false, 0}, {OPTION_CHOICE, "One", 0, 0, false, 0}, {OPTION_CHOICE, "threes", 0, 0, false, 0},
    {OPTION_FLAG, "true", 0, 0, true, 1}, {OPTION_FLAG, "false", 0, 0, true, 0}, {OPTION_FLAG, "1", 0, 0, false, 0},
    {OPTION_FLAG_OFF, "true", 0, 0, true, 0}, {OPTION_FLAG_OFF, "false", 0, 0, true, 1},
};

static double number_of(option_kind kind, const any_value *v)
{
    switch (kind) {
    case OPTION_FLAG:
    case OPTION_FLAG_OFF: return v->flag ? 1 : 0;
    case OPTION_INT: return v->whole;
    case OPTION_UINT64: return (double)v->word;
    case OPTION_FLOAT: return (double)v->single;
    case OPTION_DOUBLE:
    case OPTION_DURATION: return v->number;
    case OPTION_SIZE: return (double)v->size;
    case OPTION_STRING:
    case OPTION_CHOICE: return 0;
    }
    return NAN;
}

static void values(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof value_cases / sizeof *value_cases; i++) {
        const value_case *c = &value_cases[i];
        any_value value;
        memset(&value, 0x5a, sizeof value);
        const option o = {.name = "x", .kind = c->kind, .value = &value, .min = c->min, .max = c->max, .choices = "one|two|three"};
        char wanted[256] = "";
        const bool ok = options_read_value(&o, c->text, wanted, sizeof wanted);
        if (ok != c->ok)
            fail_msg("kind %d, \"%s\": %s", (int)c->kind, c->text, ok ? "accepted" : "refused");
        if (wanted[0] == '\0')
            fail_msg("kind %d says nothing about what is wanted", (int)c->kind);
        if (!ok)
            continue;
        if ((c->kind == OPTION_STRING || c->kind == OPTION_CHOICE) && value.text != c->text)
            fail_msg("\"%s\" was not kept", c->text);
        if (number_of(c->kind, &value) != c->value)
            fail_msg("kind %d, \"%s\": got %.17g", (int)c->kind, c->text, number_of(c->kind, &value));
    }
}

/** What cannot be a value leaves the default alone. */
static void refused_values_change_nothing(void **state)
{
    (void)state;
    int whole = 7;
    float single = 0.25f;
    double seconds = 600;
    const char *choice = "one";
    const option rows[] = {
        {.name = "a", .kind = OPTION_INT, .value = &whole, .min = 0, .max = 9}, {.name = "b", .kind = OPTION_FLOAT, .value = &single, .min = 0, .max = 1},
        {.name = "c", .kind = OPTION_DURATION, .value = &seconds, .min = 1, .max = 1e6},
        {.name = "d", .kind = OPTION_CHOICE, .value = &choice, .choices = "one|two"},
    };
    char wanted[256];
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        assert_false(options_read_value(&rows[i], "10000000000x", wanted, sizeof wanted));
    assert_int_equal(whole, 7);
    assert_true(single == 0.25f && seconds == 600);
    assert_string_equal(choice, "one");
}

static void order_of_config_and_command_line(void **state)
{
    (void)state;
    char path[] = "/tmp/gbt_options_XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0);
    FILE *file = fdopen(fd, "w");
    fputs("depth = 3\nname=from file # not a comment\ngrow = false\nno-prune = true\n", file);
    fclose(file);
    int depth = 1, other = 2;
    bool grow = true, prune = true;
    const char *name = NULL;
    const option options[] = {
        {.name = "depth", .short_name = 'd', .kind = OPTION_INT, .value = &depth, .min = 0, .max = 9, .value_name = "N", .help = ""},
        {.name = "other", .kind = OPTION_INT, .value = &other, .min = 0, .max = 9, .value_name = "N", .help = ""},
        {.name = "name", .kind = OPTION_STRING, .value = &name, .value_name = "TEXT", .help = "", .required = true},
        {.name = "grow", .kind = OPTION_FLAG, .value = &grow, .help = ""},
        {.name = "no-prune", .kind = OPTION_FLAG_OFF, .value = &prune, .help = ""},
    };
    const command self = {.name = "test", .summary = "", .usage = ""};
    operands found;
    char *argv[] = {"first", "-d", "4", "--config", path, "-", "--", "--depth", NULL};
    assert_int_equal(options_parse(&self, options, 5, 0, 3, 8, argv, &found), -1);
    assert_int_equal(depth, 4);
    assert_int_equal(other, 2);
    assert_false(grow);
    assert_false(prune);
    assert_string_equal(name, "from file # not a comment");
    assert_int_equal(found.count, 3);
    assert_string_equal(found.value[0], "first");
    assert_string_equal(found.value[1], "-");
    assert_string_equal(found.value[2], "--depth");
    remove(path);
}

static void nearest_names(void **state)
{
    (void)state;
    static const char *const names[] = {"info", "init", "make-scene", "train", "render", "eval"};
    const struct { const char *typed, *nearest; } rows[] = {
        {"info", "info"}, {"ifno", "info"}, {"inif", "init"}, {"trian", "train"}, {"makescene", "make-scene"}, {"rendr", "render"}, {"evaluate", NULL},
        {"x", NULL}, {"", NULL}, {"completely else", NULL}, {"an absurdly long word that no table can hold", NULL},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const char *got = command_nearest(rows[i].typed, names, 6);
        if ((got == NULL) != (rows[i].nearest == NULL) || (got != NULL && strcmp(got, rows[i].nearest) != 0))
            fail_msg("%s: got %s", rows[i].typed, got != NULL ? got : "nothing");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values),
        cmocka_unit_test(refused_values_change_nothing),
        cmocka_unit_test(order_of_config_and_command_line),
        cmocka_unit_test(nearest_names),
    };
    return cmocka_run_group_tests_name("options", tests, NULL, NULL);
}
