/* SPDX-License-Identifier: Apache-2.0 */
/* cli/progress.c -- messages on stderr: as text, as JSON lines, or none. */
#include "cli/progress.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "gbtrace/progress.h"
#include "gbtrace/status.h"
#include "gbtrace/version.h"

static bool as_json, silent;
static char last_error[1024];

static void print_progress(const gbt_event *e)
{
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"fraction", e->fraction},
                   {"seconds", e->seconds},
                   {"seconds_left", e->seconds_left},
                   {"psnr", e->psnr},
                   {"loss", e->loss}};
    fputs("{\"event\": \"progress\", \"stage\": ", stderr);
    json_write_text(stderr, e->stage);
    fprintf(stderr, ", \"done\": %llu, \"total\": ", (unsigned long long)e->done);
    fprintf(stderr, e->total > 0 ? "%llu" : "null", (unsigned long long)e->total);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        fprintf(stderr, ", \"%s\": ", numbers[i].name);
        json_write_number(stderr, numbers[i].value);
    }
    if (e->anchors > 0)
        fprintf(stderr, ", \"anchors\": %zu, \"gaussians\": %zu", e->anchors, e->gaussians);
    fputs("}\n", stderr);
}

static void print_text(const char *event, const char *text)
{
    fprintf(stderr, "{\"event\": \"%s\", \"text\": ", event);
    json_write_text(stderr, text);
    fputs("}\n", stderr);
}

static void hear(const gbt_event *e, void *context)
{
    (void)context;
    if (!as_json) {
        if (e->kind == GBT_EVENT_WARNING)
            fprintf(stderr, "warning: %s\n", e->text);
    } else if (e->kind == GBT_EVENT_PROGRESS) {
        print_progress(e);
    } else {
        print_text(e->kind == GBT_EVENT_WARNING ? "warning" : "message", e->text);
    }
}

void progress_start(progress_mode mode, const char *command_name)
{
    as_json = mode == PROGRESS_JSON;
    silent = mode == PROGRESS_NONE;
    if (as_json) {
        setvbuf(stderr, NULL, _IOLBF, BUFSIZ); /* line-buffered, so that readers always see whole objects */
        fputs("{\"event\": \"start\", \"schema\": 1, \"command\": ", stderr);
        json_write_text(stderr, command_name);
        fprintf(stderr, ", \"version\": \"%s\"}\n", gbt_version());
    }
    if (as_json || silent)
        gbt_listen(hear, NULL);
}

void progress_say(const char *format, ...)
{
    char line[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    if (as_json)
        print_text("message", line);
    else if (!silent)
        fprintf(stderr, "%s\n", line);
}

bool progress_for_people(void) { return !as_json && !silent; }

void progress_error(const char *text)
{
    snprintf(last_error, sizeof last_error, "%s", text);
    const char *kind = getenv("TERM");
    const bool over = isatty(STDERR_FILENO) && kind != NULL && strcmp(kind, "dumb") != 0;
    if (!as_json)
        fprintf(stderr, "%serror: %s\n", over ? "\r\033[K" : "", text); /* first clear a progress line that
                                                                           may stand there */
}

const char *progress_last_error(void) { return last_error[0] != '\0' ? last_error : NULL; }

void progress_end(int exit_code)
{
    if (!as_json)
        return;
    fprintf(stderr, "{\"event\": \"%s\", \"exit\": %d", exit_code == 0 ? "done" : "failed", exit_code);
    if (last_error[0] != '\0') {
        fputs(", \"error\": ", stderr);
        json_write_text(stderr, last_error);
    }
    fputs("}\n", stderr);
}
