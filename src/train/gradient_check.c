/* SPDX-License-Identifier: Apache-2.0 */
/* train/gradient_check.c -- find gradients that would ruin the parameters permanently. */
#include "train/gradient_check.h"

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>

#include "base/clones.h"
#include "base/parallel.h"

enum { ROW_BLOCK = 1024 };

/* The comparison is written so that NaN counts as bad. No branch inside the loop, so that the compiler
   vectorises it. */
FASTEST_CLONE static bool any_bad(const float *values, size_t count)
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

typedef struct row_job {
    const anchors *gradient;
    const uint32_t *anchor; /* of each row that is checked */
    bool packed;            /* the gradient has only these rows */
    atomic_bool bad;
} row_job;

static const float *row_of(const row_job *job, size_t i, int field, size_t width)
{
    return job->gradient->field[field] + (job->packed ? i : job->anchor[i]) * width;
}

static void check_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    row_job *job = context;
    bool bad = false;
    for (size_t i = begin, next; i < end; i = next) {
        for (next = i + 1; next < end && (job->packed || job->anchor[next] == job->anchor[next - 1] + 1);)
            next++; /* extends a run of rows that are adjacent in memory */
        for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++) {
            const size_t width = anchors_width(job->gradient, f);
            bad |= any_bad(row_of(job, i, f, width), (next - i) * width);
        }
    }
    if (bad)
        atomic_store(&job->bad, true);
}

static void name_row(const row_job *job, size_t count, char *where, size_t size)
{
    for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++)
        for (size_t i = 0; i < count; i++) {
            const size_t width = anchors_width(job->gradient, f),
                         at = first_bad(row_of(job, i, f, width), width);
            if (at < width) {
                snprintf(where, size, "%s of anchor %u, value %zu", anchor_fields[f].label, job->anchor[i],
                         at);
                return;
            }
        }
}

bool gradient_is_bad(const learnables *g, const frame *f, const decoder *d,
                     const double exposure[AFFINE_NUMBERS], char *where, size_t size)
{
    row_job job = {
        .gradient = &g->anchors, .anchor = f->visible, .packed = g->anchors.count == f->visible_count};
    atomic_init(&job.bad, false);
    parallel_blocks(f->visible_count, ROW_BLOCK, check_rows, &job);
    if (atomic_load(&job.bad)) {
        name_row(&job, f->visible_count, where, size);
        return true;
    }
    decoder_network networks[DECODER_NETWORKS];
    decoder_networks(d, networks);
    for (int i = 0; i < DECODER_NETWORKS; i++) {
        const size_t count = networks[i].end - networks[i].begin,
                     at = first_bad(g->networks + networks[i].begin, count);
        if (at < count) {
            snprintf(where, size, "%s network, value %zu", networks[i].label, at);
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
