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

/* ---- variables that nobody reads ---- */

typedef struct search {
    const char *name; /* up to its = */
    bool found;
} search;

static void look_in(const command *self, const option *options, int option_count, void *context)
{
    search *s = context;
    for (int i = 0; i < option_count && !s->found; i++) {
        if (!options_in_environment(&options[i]))
            continue;
        for (int own = 0; own < 2; own++) {
            char variable[128];
            options_variable(own ? self->name : NULL, options[i].name, variable, sizeof variable);
            const size_t length = strlen(variable);
            s->found = s->found || (strncmp(s->name, variable, length) == 0 && s->name[length] == '=');
        }
    }
}

static void check_environment(gbt_diagnosis *d)
{
    if (d->count >= GBT_DOCTOR_MAX)
        return;
    gbt_check *c = &d->checks[d->count++];
    int known = 0, unknown = 0;
    *c = (gbt_check){.name = "environment"};
    for (char **variable = environ; *variable != NULL; variable++) {
        search s = {.name = *variable};
        if (strncmp(s.name, "GBTRACE_", 8) != 0)
            continue;
        for (int i = 0; i < command_list_count && !s.found; i++)
            options_visit(command_list[i], look_in, &s);
        known += s.found;
        unknown += !s.found;
        if (!s.found && unknown == 1)
            snprintf(c->advice, sizeof c->advice,
                     "no command has the option of %.*s: unset it, or correct its name",
                     (int)strcspn(s.name, "="), s.name);
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

static int run(const command *self, int argc, char **argv)
{
    bool json = false;
    const option options[] = {
        {.name = "json", .kind = OPTION_FLAG, .value = &json, .help = "print JSON"},
    };
    operands folder;
    const int code =
        options_parse(self, options, sizeof options / sizeof *options, 0, 1, argc, argv, &folder);
    if (code >= 0)
        return code;
    static gbt_diagnosis d; /* 16 kB */
    gbt_error err = {0};
    const gbt_status status = gbt_doctor(folder.count > 0 ? folder.value[0] : ".", &d, &err);
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
    .run = run};
