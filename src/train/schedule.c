/* SPDX-License-Identifier: Apache-2.0 */
/* train/schedule.c -- progress, and the schedules that depend on it. */
#include "train/schedule.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"

pace pace_of_iterations(uint64_t iterations)
{
    pace p = {.known = PACE_SEGMENTS};
    for (uint64_t i = 0; i < PACE_SEGMENTS; i++)
        p.steps[i] = (i + 1) * iterations / PACE_SEGMENTS - i * iterations / PACE_SEGMENTS;
    return p;
}

static const char *skip_blanks(const char *at) { return at + strspn(at, " \t\r\n"); }

gbt_status pace_parse(const char *text, pace *out, gbt_error *err)
{
    *out = (pace){.known = PACE_SEGMENTS};
    const char *at = skip_blanks(text);
    const bool in_brackets = *at == '[';
    at = skip_blanks(at + in_brackets);
    for (int i = 0; i < PACE_SEGMENTS; i++) {
        char *number_end;
        const unsigned long long n = strtoull(at, &number_end, 10);
        const char *end = skip_blanks(number_end);
        const char wanted = i + 1 < PACE_SEGMENTS ? ',' : in_brackets ? ']' : '\0';
        if (*at < '0' || *at > '9' || *end != wanted || n > 1000000000ull ||
            (wanted == ']' && *skip_blanks(end + 1) != '\0'))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "pace: entry %d of \"%.60s\" (wanted %d counts, separated by commas)", i + 1,
                             text, PACE_SEGMENTS);
        out->steps[i] = n;
        at = wanted == ',' ? skip_blanks(end + 1) : end;
    }
    return GBT_OK;
}

void pace_text(const pace *p, char out[PACE_TEXT_SIZE])
{
    size_t used = 0;
    for (int i = 0; i < PACE_SEGMENTS; i++)
        used += (size_t)snprintf(out + used, PACE_TEXT_SIZE - used, "%s%llu", i > 0 ? "," : "",
                                 (unsigned long long)p->steps[i]);
}

uint64_t pace_total(const pace *p)
{
    uint64_t sum = 0;
    for (int i = 0; i < p->known; i++)
        sum += p->steps[i];
    return sum;
}

int pace_segment(const pace *p, uint64_t step)
{
    uint64_t before = 0;
    for (int i = 0; i < p->known; i++) {
        before += p->steps[i];
        if (step < before)
            return i;
    }
    return p->known;
}

double pace_progress(const pace *p, uint64_t step)
{
    uint64_t before = 0;
    for (int i = 0; i < p->known; i++) {
        if (step < before + p->steps[i])
            return ((double)i + (double)(step - before) / (double)p->steps[i]) / PACE_SEGMENTS;
        before += p->steps[i];
    }
    return (double)p->known / PACE_SEGMENTS;
}

double pace_expected(const pace *p, uint64_t step)
{
    const int parts = pace_segment(p, step) + 1;
    uint64_t sum = 0;
    for (int i = 0; i < parts && i < p->known; i++)
        sum += p->steps[i];
    return (double)sum * PACE_SEGMENTS / parts;
}

float schedule_threshold_factor(double views)
{
    return (float)fmin(fmax(sqrt(1000 / fmax(views, 1)), 0.25), 1);
}

double schedule_rate_end(double views) { return fmin(fmax(sqrt(4000 / fmax(views, 1)), 0.1), 1); }

float schedule_left_out(double looks) { return (float)(1 - pow(100 / fmax(looks, 100), 0.3)); }
