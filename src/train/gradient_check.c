/* SPDX-License-Identifier: Apache-2.0 */
/* train/gradient_check.c -- look for gradients that would spoil the parameters for good. */
#include "train/gradient_check.h"

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>

#include "base/parallel.h"

enum { ROW_BLOCK = 1024 };

/* Written so that NaN is bad. Whole runs without a branch: the compiler makes vectors of them. */
static bool any_bad(const float *values, size_t count)
{
    int bad = 0;
    for (size_t i = 0; i < count; i++)
        bad |= !(fabsf(values[i]) <= GRADIENT_LIMIT);
    return bad != 0;
}

static size_t first_bad(const float *values, size_t count)
{
    size_t i = 0;
    while (i < count && fabsf(values[i]) <= GRADIENT_LIMIT)
        i++;
    return i;
}

/* The rows of one field of the anchors. */
typedef struct field {
    const char *name;
    const float *values;
    size_t width;
} field;

enum { FIELD_COUNT = 3 };

static void anchor_fields(const anchors *g, field out[FIELD_COUNT])
{
    out[0] = (field){"feature", g->feature, ANCHOR_FEATURE_DIM};
    out[1] = (field){"offset", g->offset, 3 * (size_t)g->offset_count};
    out[2] = (field){"scale", g->scale_log, 6};
}

typedef struct row_job {
    field fields[FIELD_COUNT];
    const uint32_t *rows;
    atomic_bool bad;
} row_job;

static void check_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    row_job *job = context;
    bool bad = false;
    for (size_t i = begin; i < end; i++)
        for (int k = 0; k < FIELD_COUNT; k++)
            bad |= any_bad(job->fields[k].values + job->rows[i] * job->fields[k].width, job->fields[k].width);
    if (bad)
        atomic_store(&job->bad, true);
}

static void name_row(const row_job *job, size_t count, char *where, size_t size)
{
    for (int k = 0; k < FIELD_COUNT; k++)
        for (size_t i = 0; i < count; i++) {
            const size_t width = job->fields[k].width,
                         at = first_bad(job->fields[k].values + job->rows[i] * width, width);
            if (at < width) {
                snprintf(where, size, "%s of anchor %u, value %zu", job->fields[k].name, job->rows[i], at);
                return;
            }
        }
}

bool gradient_is_bad(const trainer *t, const double exposure[AFFINE_NUMBERS], char *where, size_t size)
{
    row_job job = {.rows = t->frame.visible};
    anchor_fields(&t->gradient, job.fields);
    atomic_init(&job.bad, false);
    parallel_blocks(t->frame.visible_count, ROW_BLOCK, check_rows, &job);
    if (atomic_load(&job.bad)) {
        name_row(&job, t->frame.visible_count, where, size);
        return true;
    }
    static const char *const networks[3] = {"opacity", "shape", "colour"};
    decoder_part parts[3];
    decoder_parts(&t->decoder, parts);
    for (int i = 0; i < 3; i++) {
        const size_t count = parts[i].end - parts[i].begin,
                     at = first_bad(t->d_params + parts[i].begin, count);
        if (at < count) {
            snprintf(where, size, "%s network, value %zu", networks[i], at);
            return true;
        }
    }
    for (int i = 0; exposure != NULL && i < AFFINE_NUMBERS; i++)
        if (!(fabs(exposure[i]) <= (double)GRADIENT_LIMIT)) {
            snprintf(where, size, "exposure, value %d", i);
            return true;
        }
    return false;
}
