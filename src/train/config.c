/* SPDX-License-Identifier: Apache-2.0 */
/* train/config.c -- the settings of a run to text and back. */
#include "train/config.h"

#include <float.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"

/* As many digits, at least 6, as read back as the same number: 0.7, not 0.69999999999999996. */
static const char *shortest(double value, char *out, size_t size)
{
    for (int digits = 6; digits <= DBL_DECIMAL_DIG; digits++) {
        snprintf(out, size, "%.*g", digits, value);
        if (strtod(out, NULL) == value)
            break;
    }
    return out;
}

#define SHORT(value) shortest(value, (char[32]){0}, 32)

void config_text(const gbt_train_def *d, const char *data, char *out, size_t size)
{
    snprintf(out, size,
             "data = %s\ninit = %s\ninit-count = %s\nscale-prior = %s\nmax-depth = %d\nvoxel-size = "
             "%.9g\noffsets = %d\ndistance = %s\niterations = %llu\n"
             "budget-seconds = %s\npace = %s\ndownscale = %s\nrenderer = %s\nfootprint = %s\nnear = "
             "%s\nstart-level = %d\n"
             "eval-split = %s\nalpha = %s\nseed = %llu\nmax-anchors = %zu\n"
             "grow = %d\nthrift = %s\nlast-thrift = %s\ncompat = %d\nexposure = %d\nsplats-until = %s\n"
             "grow-until = %s\nscale-factor = %s\nlearning-rate = %s\n",
             data, d->init, SHORT(d->init_count), d->scale_prior, d->max_depth, (double)d->voxel_size,
             d->offsets, d->distance, (unsigned long long)d->iterations, SHORT(d->budget_seconds),
             d->pace != NULL ? d->pace : "", SHORT(d->downscale), d->renderer, SHORT(d->footprint),
             SHORT(d->near), d->start_level, d->eval_split, d->alpha, (unsigned long long)d->seed,
             d->max_anchors, d->grow, SHORT(d->thrift), SHORT(d->last_thrift), d->compat, d->exposure,
             SHORT(d->splats_until), SHORT(d->grow_until), SHORT(d->scale_factor),
             SHORT(d->learning_rate_factor));
}

static void set_string(char *to, size_t size, const char *value, const char **field)
{
    snprintf(to, size, "%s", value);
    *field = to;
}

/* What no int holds becomes a value that no setting allows. */
static int to_int(double number) { return number >= -1e9 && number <= 1e9 ? (int)number : INT_MIN; }

static bool set_key(const char *key, const char *value, gbt_train_def *d, config_strings *s)
{
    char *end;
    const double number = strtod(value, &end);
    const unsigned long long whole = strtoull(value, NULL, 10);
    const bool is_number = end != value && *end == '\0';
    if (strcmp(key, "data") == 0)
        return snprintf(s->data, sizeof s->data, "%s", value) < (int)sizeof s->data;
    if (strcmp(key, "init") == 0) {
        set_string(s->init, sizeof s->init, value, &d->init);
        return true;
    }
    if (strcmp(key, "scale-prior") == 0) {
        set_string(s->scale_prior, sizeof s->scale_prior, value, &d->scale_prior);
        return true;
    }
    if (strcmp(key, "distance") == 0) {
        set_string(s->distance, sizeof s->distance, value, &d->distance);
        return true;
    }
    if (strcmp(key, "renderer") == 0) {
        set_string(s->renderer, sizeof s->renderer, value, &d->renderer);
        return true;
    }
    if (strcmp(key, "eval-split") == 0) {
        set_string(s->eval_split, sizeof s->eval_split, value, &d->eval_split);
        return true;
    }
    if (strcmp(key, "alpha") == 0) {
        set_string(s->alpha, sizeof s->alpha, value, &d->alpha);
        return true;
    }
    if (strcmp(key, "pace") == 0) {
        set_string(s->pace, sizeof s->pace, value, &d->pace);
        if (value[0] == '\0')
            d->pace = NULL;
        return true;
    }
    if (!is_number)
        return false;
    if (strcmp(key, "init-count") == 0) {
        d->init_count = number;
        return true;
    }
    if (strcmp(key, "max-depth") == 0) {
        d->max_depth = to_int(number);
        return true;
    }
    if (strcmp(key, "voxel-size") == 0) {
        d->voxel_size = (float)number;
        return true;
    }
    if (strcmp(key, "offsets") == 0) {
        d->offsets = to_int(number);
        return true;
    }
    if (strcmp(key, "iterations") == 0) {
        d->iterations = whole;
        return true;
    }
    if (strcmp(key, "budget-seconds") == 0) {
        d->budget_seconds = number;
        return true;
    }
    if (strcmp(key, "downscale") == 0) {
        d->downscale = number;
        return true;
    }
    if (strcmp(key, "footprint") == 0) {
        d->footprint = number;
        return true;
    }
    if (strcmp(key, "near") == 0) {
        d->near = number;
        return true;
    }
    if (strcmp(key, "start-level") == 0) {
        d->start_level = to_int(number);
        return true;
    }
    if (strcmp(key, "seed") == 0) {
        d->seed = whole;
        return true;
    }
    if (strcmp(key, "max-anchors") == 0) {
        d->max_anchors = (size_t)whole;
        return true;
    }
    if (strcmp(key, "grow") == 0) {
        d->grow = number != 0;
        return true;
    }
    if (strcmp(key, "thrift") == 0) {
        d->thrift = number;
        return true;
    }
    if (strcmp(key, "last-thrift") == 0) {
        d->last_thrift = number;
        return true;
    }
    if (strcmp(key, "compat") == 0) {
        d->compat = number != 0;
        return true;
    }
    if (strcmp(key, "exposure") == 0) {
        d->exposure = number != 0;
        return true;
    }
    if (strcmp(key, "splats-until") == 0) {
        d->splats_until = number;
        return true;
    }
    if (strcmp(key, "grow-until") == 0) {
        d->grow_until = number;
        return true;
    }
    if (strcmp(key, "scale-factor") == 0) {
        d->scale_factor = number;
        return true;
    }
    if (strcmp(key, "resume") == 0) {
        d->resume = number != 0;
        return true;
    }
    if (strcmp(key, "overwrite") == 0) {
        d->overwrite = number != 0;
        return true;
    }
    if (strcmp(key, "learning-rate") == 0) {
        d->learning_rate_factor = number;
        return true;
    }
    return false;
}

gbt_status config_parse(const char *text, const char *path, gbt_train_def *def, config_strings *strings,
                        gbt_error *err)
{
    int line_number = 1;
    for (const char *line = text; *line != '\0'; line_number++) {
        const char *end = strchr(line, '\n');
        if (end == NULL)
            end = line + strlen(line);
        char copy[CONFIG_TEXT_SIZE];
        snprintf(copy, sizeof copy, "%.*s", (int)(end - line), line);
        char *equals = strstr(copy, " =");
        if (equals == NULL)
            return base_fail(err, GBT_ERR_FORMAT, "%s:%d: \"%.60s\" (wanted key = value)", path, line_number,
                             copy);
        *equals = '\0';
        const char *value = equals + 2 + (equals[2] == ' ');
        if (!set_key(copy, value, def, strings))
            return base_fail(err, GBT_ERR_FORMAT, "%s:%d: unknown setting or bad value: %.60s = %.60s", path,
                             line_number, copy, value);
        line = *end == '\0' ? end : end + 1;
    }
    return GBT_OK;
}
