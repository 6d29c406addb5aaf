/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_rows.c -- convert gradients and statistics of views to rows, sum them, and convert back. */
#include "train/step_rows.h"

#include <string.h>

#include "base/fail.h"
#include "base/parallel.h"
#include "cluster/cluster.h"
#include "train/growing.h"
#include "train/step_exchange.h"
#include "train/trainer.h"

enum { ROW_BLOCK = 512 };

/* An array that one part of each row is copied from or to. */
typedef struct row_part {
    float *values;
    size_t width;
} row_part;

enum { PARTS_MAX = ANCHOR_FIELDS + GROWTH_STATS };

/* The parts of a row, in order. */
typedef struct row_shape {
    row_part part[PARTS_MAX];
    int learned, count; /* the first `learned` of `count` parts are gradients */
    size_t width;
} row_shape;

static row_shape shape_of(const anchors *gradient, const growth_stats *stats, bool gathers)
{
    row_shape s = {.count = 0};
    for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++)
        s.part[s.count++] = (row_part){gradient->field[f], anchors_width(gradient, f)};
    s.learned = s.count;
    for (int f = 0; gathers && f < GROWTH_STATS; f++)
        s.part[s.count++] =
            (row_part){stats->field[f], row_field_width(&growth_stat_fields[f], gradient->offset_count)};
    for (int i = 0; i < s.count; i++)
        s.width += s.part[i].width;
    return s;
}

/* ---- to rows ---- */

typedef struct take_job {
    row_shape shape;
    const uint32_t *visible;
    row_list *rows;
} take_job;

static void take_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const take_job *job = context;
    for (size_t i = begin; i < end; i++) {
        row_word *to = row_list_row(job->rows, i);
        (to++)->number = job->visible[i];
        for (int p = 0; p < job->shape.count; p++) {
            const row_part *part = &job->shape.part[p];
            memcpy(to, part->values + i * part->width, part->width * sizeof *to);
            to += part->width;
        }
    }
}

gbt_status step_rows_take(const trainer *t, step_view *v, gbt_error *err)
{
    const size_t visible = v->frame.visible_count, numbers = t->decoder.param_count;
    const take_job job = {.shape = shape_of(&v->gradient.anchors, &v->stats, growing_gathers(t)),
                          .visible = v->frame.visible,
                          .rows = &v->rows};
    const size_t width = job.shape.width, more = (numbers + width - 1) / width;
    GBT_TRY(row_list_resize(&v->rows, visible + more, width, err));
    parallel_blocks(visible, ROW_BLOCK, take_block, (void *)&job);
    for (size_t i = 0; i < more; i++) {
        const size_t at = i * width, count = numbers - at < width ? numbers - at : width;
        row_word *to = row_list_row(&v->rows, visible + i);
        memset(to, 0, (1 + width) * sizeof *to);
        to->number = (uint32_t)(t->anchors.count + i);
        memcpy(to + 1, v->gradient.networks + at, count * sizeof *to);
    }
    return GBT_OK;
}

/* ---- and back ---- */

typedef struct give_job {
    row_shape shape;
    trainer *t;
    const row_list *rows;
    float share; /* weight of a view in the mean */
} give_job;

static void give_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const give_job *job = context;
    const size_t anchor_count = job->t->anchors.count;
    for (size_t i = begin; i < end; i++) {
        const row_word *from = row_list_row(job->rows, i);
        const size_t number = (from++)->number;
        if (number >= anchor_count) {
            const size_t width = job->rows->width, at = (number - anchor_count) * width;
            for (size_t k = 0; k < width && at + k < job->t->decoder.param_count; k++)
                job->t->gradient.networks[at + k] += job->share * from[k].value;
            continue;
        }
        for (int p = 0; p < job->shape.count; p++) {
            const row_part *part = &job->shape.part[p];
            float *to = part->values + number * part->width;
            for (size_t k = 0; k < part->width; k++)
                to[k] += p < job->shape.learned ? job->share * from[k].value : from[k].value;
            from += part->width;
        }
    }
}

gbt_status step_rows_add_up(trainer *t, step_report *out, gbt_error *err)
{
    const row_list *lists[STEP_VIEWS_MAX], *sum = &t->rows;
    for (size_t i = 0; i < t->view_count; i++)
        lists[i] = &t->views[i].rows;
    if (t->view_count > 1)
        GBT_TRY(row_list_sum(lists, t->view_count, &t->own_rows, err));
    const row_list *own = t->view_count > 1 ? &t->own_rows : lists[0];
    if (gbt_cluster_size() > 1) {
        const size_t network_rows = (t->decoder.param_count + own->width - 1) / own->width;
        const cluster_traffic before = cluster_traffic_so_far();
        GBT_TRY(step_exchange_rows(t, own, t->anchors.count + network_rows, err));
        const cluster_traffic after = cluster_traffic_so_far();
        out->exchange_bytes = after.bytes - before.bytes;
        out->exchange_seconds = after.seconds - before.seconds;
    } else {
        sum = own;
    }
    give_job job = {.shape = shape_of(&t->gradient.anchors, &t->stats, growing_gathers(t)),
                    .t = t,
                    .rows = sum,
                    .share = 1 / (float)t->def.views};
    parallel_blocks(sum->count, ROW_BLOCK, give_block, &job);
    return GBT_OK;
}
