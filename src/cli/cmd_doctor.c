/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_doctor.c -- gbtrace doctor: check the build and the machine. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "cli/options.h"
#include "cli/progress.h"
#include "gbtrace/doctor.h"
#include "gbtrace/version.h"

static const char *const level_names[] = {"ok", "warn", "fail"};

/* ---- environment variables that set nothing ---- */

/** Whether a variable, NAME=VALUE, sets an option of some command. */
static bool sets_option(const char *variable)
{
    for (int c = 0; c < command_list_count; c++) {
        option_table t;
        options_table(command_list[c], &t);
        for (int i = 0; i < 2 * t.count; i++) {
            char name[128];
            const option *o = &t.rows[i / 2];
            options_variable(i % 2 == 1 ? command_list[c]->name : NULL, o->name, name, sizeof name);
            const size_t length = strlen(name);
            if (options_in_environment(o) && strncmp(variable, name, length) == 0 && variable[length] == '=')
                return true;
        }
    }
    return false;
}

static void check_environment(gbt_diagnosis *d)
{
    if (d->count >= GBT_DOCTOR_MAX)
        return;
    gbt_check *c = &d->checks[d->count++];
    int known = 0, unknown = 0;
    *c = (gbt_check){.name = "environment"};
    for (char **variable = environ; *variable != NULL; variable++) {
        if (strncmp(*variable, "GBTRACE_", 8) != 0 || strncmp(*variable, "GBTRACE_LIBRARY=", 16) == 0)
            continue; /* the latter belongs to the Python package */
        const bool found = sets_option(*variable);
        known += found;
        unknown += !found;
        if (!found && unknown == 1)
            snprintf(c->advice, sizeof c->advice,
                     "no command has the option of %.*s: unset it, or correct its name",
                     (int)strcspn(*variable, "="), *variable);
    }
    c->level = unknown > 0 ? GBT_CHECK_WARN : GBT_CHECK_OK;
    snprintf(c->found, sizeof c->found, "%d variables set options, %d name no option", known, unknown);
}

/* ---- report ---- */

static void print_lines(const gbt_diagnosis *d)
{
    for (int i = 0; i < d->count; i++) {
        const gbt_check *c = &d->checks[i];
        printf("%-5s%-12s%s\n", level_names[c->level], c->name, c->found);
        if (c->advice[0] != '\0')
            printf("%17s-> %s\n", "", c->advice);
    }
}

static void print_json(const gbt_diagnosis *d, int failed)
{
    printf("{\"schema\": 1, \"version\": \"%s\", \"failed\": %d, \"checks\": [", gbt_version(), failed);
    for (int i = 0; i < d->count; i++) {
        const gbt_check *c = &d->checks[i];
        printf("%s\n  {\"name\": \"%s\", \"level\": \"%s\", \"found\": ", i > 0 ? "," : "", c->name,
               level_names[c->level]);
        json_write_text(stdout, c->found);
        fputs(", \"advice\": ", stdout);
        json_write_text(stdout, c->advice);
        putchar('}');
    }
    puts("\n]}");
}

static bool json;

static const option *options(int *count)
{
    static const option rows[] = {
        {.name = "json", .kind = OPTION_FLAG, .value = &json, .help = "print JSON"},
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    static gbt_diagnosis d; /* 16 kB, too much for the stack */
    gbt_error err = {0};
    const gbt_status status = gbt_doctor(given->count > 0 ? given->value[0] : ".", &d, &err);
    if (status != GBT_OK)
        return command_failed(status, &err);
    check_environment(&d);
    int failed = 0;
    for (int i = 0; i < d.count; i++)
        failed += d.checks[i].level == GBT_CHECK_FAIL;
    if (json)
        print_json(&d, failed);
    else
        print_lines(&d);
    return failed > 0;
}

const command command_doctor = {
    .name = "doctor",
    .summary =
        "check build, machine and folder: version, processor, memory, libraries, tracer, gradients, speed",
    .usage = "[FOLDER]",
    .options = options,
    .min_operands = 0,
    .max_operands = 1,
    .run = run};
