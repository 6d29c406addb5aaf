/* SPDX-License-Identifier: Apache-2.0 */
/* tests/cli/test_options.c -- the text of one option to its value, at and beyond every edge; guesses at
   mistyped names. */
#include <unistd.h>

#include "cli/options.h"
#include "cli/progress.h"
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
    {OPTION_INT, "0", 0, 10, true, 0},
    {OPTION_INT, "10", 0, 10, true, 10},
    {OPTION_INT, "11", 0, 10, false, 0},
    {OPTION_INT, "-1", 0, 10, false, 0},
    {OPTION_INT, "-5", -5, 5, true, -5},
    {OPTION_INT, "-6", -5, 5, false, 0},
    {OPTION_INT, "2147483647", 0, 2147483647, true, 2147483647},
    {OPTION_INT, "2147483648", 0, 2147483647, false, 0},
    {OPTION_INT, "9223372036854775808", 0, 2147483647, false, 0},
    {OPTION_INT, "", 0, 10, false, 0},
    {OPTION_INT, "-", -5, 5, false, 0},
    {OPTION_INT, "1e1", 0, 10, false, 0},
    {OPTION_INT, "--1", -5, 5, false, 0},
    {OPTION_INT, "007", 0, 10, true, 7},
    {OPTION_INT, " 3", 0, 10, false, 0},
    {OPTION_INT, "3 ", 0, 10, false, 0},
    {OPTION_INT, "3.0", 0, 10, false, 0},
    {OPTION_INT, "+3", 0, 10, false, 0},
    {OPTION_INT, "0x10", 0, 99, false, 0},
    {OPTION_INT, "-9223372036854775809", -5, 5, false, 0},
    {OPTION_FLOAT, "1,5", 0, 9, false, 0},
    {OPTION_FLOAT, ".", 0, 9, false, 0},
    {OPTION_FLOAT, "1e", 0, 9, false, 0},
    {OPTION_FLOAT, "-inf", -9, 9, false, 0},
    {OPTION_UINT64, "18446744073709551615", 0, 0, true, 0x1p64},
    {OPTION_UINT64, "18446744073709551616", 0, 0, false, 0},
    {OPTION_UINT64, "0", 1, 5, false, 0},
    {OPTION_UINT64, "1", 1, 5, true, 1},
    {OPTION_UINT64, "6", 1, 5, false, 0},
    {OPTION_UINT64, "+1", 0, 0, false, 0},
    {OPTION_FLOAT, "0.5", 0, 1, true, 0.5},
    {OPTION_FLOAT, "1", 0, 1, true, 1},
    {OPTION_FLOAT, "1.0000001", 0, 1, false, 0},
    {OPTION_FLOAT, ".5", 0, 1, true, 0.5},
    {OPTION_FLOAT, "5.", 0, 9, true, 5},
    {OPTION_FLOAT, "5e-1", 0, 1, true, 0.5},
    {OPTION_FLOAT, "5E0", 0, 9, true, 5},
    {OPTION_FLOAT, "e5", 0, 9, false, 0},
    {OPTION_FLOAT, "infinity", 0, 9, false, 0},
    {OPTION_FLOAT, "nan", 0, 9, false, 0},
    {OPTION_FLOAT, "0x1p0", 0, 9, false, 0},
    {OPTION_FLOAT, "-0", 0, 9, true, 0},
    {OPTION_FLOAT, "1 ", 0, 9, false, 0},
    {OPTION_FLOAT, "1_0", 0, 99, false, 0},
    {OPTION_DOUBLE, "1e308", 0, 1e308, true, 1e308},
    {OPTION_DOUBLE, "1e309", 0, HUGE_VAL, false, 0},
    {OPTION_DOUBLE, "-2.5e+0", -3, 0, true, -2.5},
    {OPTION_DURATION, "90", 1, 1e6, true, 90},
    {OPTION_DURATION, "90s", 1, 1e6, true, 90},
    {OPTION_DURATION, "10m", 1, 1e6, true, 600},
    {OPTION_DURATION, "1h", 1, 1e6, true, 3600},
    {OPTION_DURATION, "1h30m", 1, 1e6, true, 5400},
    {OPTION_DURATION, "1h1s", 1, 1e6, true, 3601},
    {OPTION_DURATION, "90sec", 1, 1e6, true, 90},
    {OPTION_DURATION, "10min", 1, 1e6, true, 600},
    {OPTION_DURATION, "2hr", 1, 1e6, true, 7200},
    {OPTION_DURATION, "1hour30mins5s", 1, 1e6, true, 5405},
    {OPTION_DURATION, "2hours", 1, 1e6, true, 7200},
    {OPTION_DURATION, "10minutesx", 1, 1e6, false, 0},
    {OPTION_DURATION, "1hrm", 1, 1e6, false, 0},
    {OPTION_DURATION, "10M", 1, 1e6, false, 0},
    {OPTION_DURATION, "1min1m", 1, 1e6, false, 0},
    {OPTION_DURATION, "10minutesminutes", 1, 1e6, false, 0},
    {OPTION_DURATION, "1.5m", 1, 1e6, true, 90},
    {OPTION_DURATION, "30m1h", 1, 1e6, false, 0},
    {OPTION_DURATION, "1m1m", 1, 1e6, false, 0},
    {OPTION_DURATION, "1m30", 1, 1e6, false, 0},
    {OPTION_DURATION, "10d", 1, 1e6, false, 0},
    {OPTION_DURATION, "m", 1, 1e6, false, 0},
    {OPTION_DURATION, "-1m", -1e6, 1e6, false, 0},
    {OPTION_DURATION, "1h-1m", 1, 1e6, false, 0},
    {OPTION_DURATION, "0.5", 1, 1e6, false, 0},
    {OPTION_DURATION, "", 0, 1e6, false, 0},
    {OPTION_DURATION, "10 m", 1, 1e6, false, 0},
    {OPTION_DURATION, "1e400h", 1, HUGE_VAL, false, 0},
    {OPTION_SIZE, "6G", 1, 0x1p50, true, 6442450944.0},
    {OPTION_SIZE, "512M", 1, 0x1p50, true, 536870912},
    {OPTION_SIZE, "1K", 1, 0x1p50, true, 1024},
    {OPTION_SIZE, "0.5K", 1, 0x1p50, true, 512},
    {OPTION_SIZE, "100", 1, 0x1p50, true, 100},
    {OPTION_SIZE, "2T", 1, 0x1p50, true, 2199023255552.0},
    {OPTION_SIZE, "6g", 1, 0x1p50, false, 0},
    {OPTION_SIZE, "6GB", 1, 0x1p50, false, 0},
    {OPTION_SIZE, "-6G", -1e9, 0x1p50, false, 0},
    {OPTION_SIZE, "1023", 1024, 0x1p50, false, 0},
    {OPTION_SIZE, "9223372036854775808", 0, 1e30, false, 0},
    {OPTION_SIZE, "G", 0, 1e30, false, 0},
    {OPTION_STRING, "a b", 0, 0, true, 0},
    {OPTION_STRING, "", 0, 0, false, 0},
    {OPTION_CHOICE, "one", 0, 0, true, 0},
    {OPTION_CHOICE, "two", 0, 0, true, 1},
    {OPTION_CHOICE, "three", 0, 0, true, 2},
    {OPTION_CHOICE, "on", 0, 0, false, 0},
    {OPTION_CHOICE, "one|two", 0, 0, false, 0},
    {OPTION_CHOICE, "", 0, 0, false, 0},
    {OPTION_CHOICE, "One", 0, 0, false, 0},
    {OPTION_CHOICE, "threes", 0, 0, false, 0},
    {OPTION_FLAG, "true", 0, 0, true, 1},
    {OPTION_FLAG, "false", 0, 0, true, 0},
    {OPTION_FLAG, "1", 0, 0, true, 1},
    {OPTION_FLAG, "0", 0, 0, true, 0},
    {OPTION_FLAG, "yes", 0, 0, false, 0},
    {OPTION_FLAG_OFF, "true", 0, 0, true, 0},
    {OPTION_FLAG_OFF, "false", 0, 0, true, 1},
    {OPTION_FLAG_OFF, "1", 0, 0, true, 0},
    {OPTION_FLAG_OFF, "", 0, 0, false, 0},
    {OPTION_OPERAND, "a b", 0, 0, true, 0},
    {OPTION_OPERAND, "", 0, 0, false, 0},
};

static double number_of(option_kind kind, const any_value *v)
{
    switch (kind) {
    case OPTION_FLAG:
    case OPTION_FLAG_OFF:
        return v->flag ? 1 : 0;
    case OPTION_INT:
    case OPTION_CHOICE:
        return v->whole;
    case OPTION_UINT64:
        return (double)v->word;
    case OPTION_FLOAT:
        return (double)v->single;
    case OPTION_DOUBLE:
    case OPTION_DURATION:
        return v->number;
    case OPTION_SIZE:
        return (double)v->size;
    case OPTION_STRING:
    case OPTION_OPERAND:
    case OPTION_ELSEWHERE:
        return 0;
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
        const option o = {.name = "x",
                          .kind = c->kind,
                          .value = &value,
                          .min = c->min,
                          .max = c->max,
                          .choices = "one|two|three"};
        char wanted[256] = "";
        const bool ok = options_read_value(&o, c->text, wanted, sizeof wanted);
        if (ok != c->ok)
            fail_msg("kind %d, \"%s\": %s", (int)c->kind, c->text, ok ? "accepted" : "refused");
        if (wanted[0] == '\0')
            fail_msg("kind %d says nothing about what is wanted", (int)c->kind);
        if (!ok)
            continue;
        if ((c->kind == OPTION_STRING || c->kind == OPTION_OPERAND) && value.text != c->text)
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
    int choice = 0;
    const option rows[] = {
        {.name = "a", .kind = OPTION_INT, .value = &whole, .min = 0, .max = 9},
        {.name = "b", .kind = OPTION_FLOAT, .value = &single, .min = 0, .max = 1},
        {.name = "c", .kind = OPTION_DURATION, .value = &seconds, .min = 1, .max = 1e6},
        {.name = "d", .kind = OPTION_CHOICE, .value = &choice, .choices = "one|two"},
    };
    char wanted[256];
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        assert_false(options_read_value(&rows[i], "10000000000x", wanted, sizeof wanted));
    assert_int_equal(whole, 7);
    assert_true(single == 0.25f && seconds == 600);
    assert_int_equal(choice, 0);
}

static int depth = 1, other = 2;
static bool grow = true, prune = true;
static const char *name;

static const option *ordered(int *count)
{
    static const option rows[] = {
        {.name = "depth",
         .short_name = 'd',
         .kind = OPTION_INT,
         .value = &depth,
         .min = 0,
         .max = 9,
         .value_name = "N",
         .help = ""},
        {.name = "other",
         .kind = OPTION_INT,
         .value = &other,
         .min = 0,
         .max = 9,
         .value_name = "N",
         .help = ""},
        {.name = "name",
         .kind = OPTION_STRING,
         .value = &name,
         .value_name = "TEXT",
         .help = "",
         .required = true},
        {.name = "grow", .kind = OPTION_FLAG, .value = &grow, .help = ""},
        {.name = "no-prune", .kind = OPTION_FLAG_OFF, .value = &prune, .field = "prune", .help = ""},
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static void order_of_config_and_command_line(void **state)
{
    (void)state;
    char path[] = "/tmp/gbt_options_XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0);
    FILE *file = fdopen(fd, "w");
    fputs("depth = 3\nname=from file # not a comment\ngrow = false\nno-prune = true\nthreads = 3\n", file);
    unsetenv("GBTRACE_THREADS");
    fclose(file);
    const command self = {.name = "test", .summary = "", .usage = "", .options = ordered, .max_operands = 3};
    operands found;
    char *argv[] = {"first", "-d", "4", "--config", path, "-", "--", "--depth", NULL};
    assert_int_equal(options_parse(&self, 8, argv, &found), -1);
    assert_int_equal(depth, 4);
    assert_int_equal(other, 2);
    assert_false(grow);
    assert_false(prune);
    assert_string_equal(name, "from file # not a comment");
    assert_int_equal(options_threads, 3); /* of every command */
    assert_true(options_typed(&depth));
    assert_false(options_typed(&grow));
    assert_int_equal(found.count, 3);
    assert_string_equal(found.value[0], "first");
    assert_string_equal(found.value[1], "-");
    assert_string_equal(found.value[2], "--depth");
    remove(path);
}

/* One command of every kind of spelling, for the tests below. */
typedef struct spelled {
    int depth;
    bool grow;
    int split;
    const char *name, *folder;
} spelled;

static spelled typed;

static const option *spelled_rows(int *count)
{
    typed = (spelled){.depth = 1, .grow = true};
    static const option rows[] = {
        {.name = "folder",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &typed.folder,
         .value_name = "DIR",
         .help = "",
         .aliases = "m model-path"},
        {.name = "source",
         .short_name = 's',
         .kind = OPTION_OPERAND,
         .value_name = "DATA",
         .help = "",
         .aliases = "data"},
        {.name = "max-depth",
         .kind = OPTION_INT,
         .value = &typed.depth,
         .min = 0,
         .max = 9,
         .value_name = "N",
         .help = "",
         .aliases = "r resolution"},
        {.name = "split",
         .kind = OPTION_CHOICE,
         .value = &typed.split,
         .choices = "test|train|all",
         .help = ""},
        {.name = "skip-test",
         .kind = OPTION_CHOICE,
         .value = &typed.split,
         .choices = "test|train|all",
         .fixed = "train",
         .help = ""},
        {.name = "no-grow", .kind = OPTION_FLAG_OFF, .value = &typed.grow, .help = ""},
        {.name = "gpu", .kind = OPTION_ELSEWHERE, .aliases = "w", .help = "leave it out"},
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int parse_spelled(spelled *s, int argc, char **argv, operands *found)
{
    static const command self = {.name = "my-test",
                                 .summary = "",
                                 .usage = "",
                                 .options = spelled_rows,
                                 .min_operands = 1,
                                 .max_operands = 2};
    const int code = options_parse(&self, argc, argv, found);
    *s = typed;
    return code;
}

static void other_names(void **state)
{
    (void)state;
    spelled s;
    operands found;
    assert_int_equal(
        parse_spelled(&s, 8, (char *[]){"-s", "data", "-m", "run", "-r", "4", "--skip_test", "--no_grow"},
                      &found),
        -1);
    assert_true(found.count == 1 && strcmp(found.value[0], "data") == 0);
    assert_true(strcmp(s.folder, "run") == 0 && s.depth == 4 && s.split == 1 && !s.grow);
    assert_int_equal(parse_spelled(&s, 4, (char *[]){"second", "--data=first", "--split", "all"}, &found),
                     -1);
    assert_true(found.count == 2 && strcmp(found.value[0], "first") == 0 &&
                strcmp(found.value[1], "second") == 0);
    assert_int_equal(s.split, 2);
    static char *const wrong[][4] = {{"x", "--skip-test", "--split", "all"},
                                     {"x", "-w"},
                                     {"x", "--gpu=0"},
                                     {"x", "--r", "4"},
                                     {"x", "--skip-test=all"},
                                     {"x", "-data", "y"},
                                     {"-s", "a", "b", "c"},
                                     {"x", "-o", "y", "--model_path=z"},
                                     {"x", "--resolution", "10"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        int argc = 0;
        while (argc < 4 && wrong[i][argc] != NULL)
            argc++;
        if (parse_spelled(&s, argc, (char **)wrong[i], &found) != 2)
            fail_msg("%s %s was accepted", wrong[i][0], wrong[i][1]);
    }
}

static void environment(void **state)
{
    (void)state;
    spelled s;
    operands found;
    char path[] = "/tmp/gbt_options_XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0 && write(fd, "max-depth = 2\nsplit = all\ndata = here\nfolder =\n", 47) == 47);
    close(fd);
    const struct {
        const char *general, *own, *typed;
        int depth;
    } rows[] = {{NULL, NULL, NULL, 2}, {"3", NULL, NULL, 3},           {"3", "4", NULL, 4},
                {NULL, "4", NULL, 4},  {"3", "4", "--max-depth=5", 5}, {"", "", NULL, 2},
                {"3", "", NULL, 3}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        unsetenv("GBTRACE_MAX_DEPTH");
        unsetenv("GBTRACE_MY_TEST_MAX_DEPTH");
        if (rows[i].general != NULL)
            setenv("GBTRACE_MAX_DEPTH", rows[i].general, 1);
        if (rows[i].own != NULL)
            setenv("GBTRACE_MY_TEST_MAX_DEPTH", rows[i].own, 1);
        char *argv[] = {"--config", path, (char *)rows[i].typed};
        assert_int_equal(parse_spelled(&s, rows[i].typed != NULL ? 3 : 2, argv, &found), -1);
        if (s.depth != rows[i].depth)
            fail_msg("row %zu: got %d", i, s.depth);
        assert_true(s.split == 2 && s.folder == NULL);
        assert_true(found.count == 1 && strcmp(found.value[0], "here") == 0);
    }
    setenv("GBTRACE_MY_TEST_MAX_DEPTH", "10", 1);
    assert_int_equal(parse_spelled(&s, 1, (char *[]){"x"}, &found), 2);
    setenv("GBTRACE_MY_TEST_MAX_DEPTH", "1", 1);
    setenv("GBTRACE_NO_GROW", "true", 1);
    setenv("GBTRACE_SKIP_TEST", "true", 1); /* a spelling, not an option */
    setenv("GBTRACE_CONFIG", path, 1);
    assert_int_equal(parse_spelled(&s, 1, (char *[]){"x"}, &found), -1);
    assert_false(s.grow);
    assert_int_equal(s.split, 2); /* from the file that the environment named */
    assert_string_equal(found.value[0], "x");
    unsetenv("GBTRACE_CONFIG"), unsetenv("GBTRACE_NO_GROW"), unsetenv("GBTRACE_SKIP_TEST"),
        unsetenv("GBTRACE_MY_TEST_MAX_DEPTH"), unsetenv("GBTRACE_MAX_DEPTH");
    remove(path);
}

static void json_texts(void **state)
{
    (void)state;
#define BAD "\\ufffd"
    const struct {
        const char *text, *json;
    } rows[] = {{"", "\"\""},
                {"a\"b\\c", "\"a\\\"b\\\\c\""},
                {"\n\x01\x7f", "\"\\u000a\\u0001\\u007f\""},
                {"\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80", "\"\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80\""},
                {"\xff|\xc3|\xc0\x80|\xed\xa0\x80|\xe2\x82",
                 "\"" BAD "|" BAD "|" BAD BAD "|" BAD BAD BAD "|" BAD BAD "\""},
                {"\xf4\x90\x80\x80", "\"" BAD BAD BAD BAD "\""}};
#undef BAD
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char *got = NULL;
        size_t size;
        FILE *out = open_memstream(&got, &size);
        json_write_text(out, rows[i].text);
        fclose(out);
        if (strcmp(got, rows[i].json) != 0)
            fail_msg("row %zu: got %s", i, got);
        free(got);
    }
}

static void nearest_names(void **state)
{
    (void)state;
    static const char *const names[] = {"info", "init", "make-scene", "train", "render", "eval"};
    const struct {
        const char *typed, *nearest;
    } rows[] = {
        {"info", "info"},
        {"ifno", "info"},
        {"inif", "init"},
        {"trian", "train"},
        {"makescene", "make-scene"},
        {"rendr", "render"},
        {"evaluate", NULL},
        {"x", NULL},
        {"", NULL},
        {"completely else", NULL},
        {"an absurdly long word that no table can hold", NULL},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const char *got = command_nearest(rows[i].typed, names, 6);
        if ((got == NULL) != (rows[i].nearest == NULL) || (got != NULL && strcmp(got, rows[i].nearest) != 0))
            fail_msg("%s: got %s", rows[i].typed, got != NULL ? got : "nothing");
    }
}

/* Errors of the library, as they reach the terminal: leading fields, and quoted ones anywhere. */
static void fields_as_options(void **state)
{
    (void)state;
    static option_table t = {.rows = {{.name = "init-count"}, {.name = "resume"}}, .own = 2, .count = 2};
    options_set_fields(&t);
    const struct {
        const char *text, *leading, *quoted;
    } rows[] = {
        {"init_count: 3", "--init-count: 3", "init_count: 3"},
        {"init_count, resume: not both", "--init-count, --resume: not both", "init_count, resume: not both"},
        {"init_count, other: no", "init_count, other: no", "init_count, other: no"},
        {"r: by `resume`, `other` or `", "r: by `resume`, `other` or `", "r: by --resume, `other` or `"},
        {"`init_count``resume`", "`init_count``resume`", "--init-count--resume"},
        {"", "", ""},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char got[64];
        options_name_fields(rows[i].text, got, sizeof got);
        assert_string_equal(got, rows[i].leading);
        options_name_quoted(rows[i].text, got, sizeof got);
        assert_string_equal(got, rows[i].quoted);
        for (size_t size = 1; size < sizeof got; size++) { /* cut, never past the end */
            memset(got, 'x', sizeof got);
            options_name_quoted(rows[i].text, got, size);
            assert_true(strlen(got) < size && got[size] == 'x');
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values),
        cmocka_unit_test(refused_values_change_nothing),
        cmocka_unit_test(order_of_config_and_command_line),
        cmocka_unit_test(other_names),
        cmocka_unit_test(environment),
        cmocka_unit_test(json_texts),
        cmocka_unit_test(nearest_names),
        cmocka_unit_test(fields_as_options),
    };
    return cmocka_run_group_tests_name("options", tests, NULL, NULL);
}
