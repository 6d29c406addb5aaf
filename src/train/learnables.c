/* SPDX-License-Identifier: Apache-2.0 */
/* train/learnables.c -- learning rates of all parameters, listed in a table, and Adam over them. */
#include "train/learnables.h"

#include <math.h>
#include <string.h>

#include "base/clones.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "train/adam.h"
#include "train/schedule.h"

enum { ADAM_BLOCK = 256 };

typedef struct rate_rule {
    double first, last; /* the reference's rates, log-linear from first to last over the run */
    double own_factor;  /* factor of our rate over the reference's */
    bool times_extent;  /* the reference's is proportional to the extent of the cameras */
    bool ages_with_run; /* Adam's bias is corrected by the age of the run, not of the anchor */
    bool is_log_scale;  /* clamped between scale_log_min and the anchor's scale_log_max */
} rate_rule;

/* Bias correction by the age of the run would make the first steps of a new anchor up to six times too long,
   because its second moments are still near 0. Offsets and scales start near their final values and would
   overshoot, so they use the anchor's age. Features are copied from other anchors and have far to go, so they
   use the age of the run. */
static const rate_rule anchor_rules[ANCHOR_FIELDS] = {
    [ANCHOR_FEATURE] = {.first = 0.0075, .last = 0.0075, .own_factor = 1.5, .ages_with_run = true},
    [ANCHOR_OFFSET] = {.first = 0.01, .last = 0.0001, .own_factor = 4.5, .times_extent = true},
    [ANCHOR_SCALE_LOG] = {.first = 0.007, .last = 0.007, .own_factor = 3, .is_log_scale = true},
};
static const rate_rule network_rules[DECODER_NETWORKS] = {
    [DECODER_OPACITY] = {.first = 0.002, .last = 0.00002, .own_factor = 2},
    [DECODER_SHAPE] = {.first = 0.004, .last = 0.004, .own_factor = 2},
    [DECODER_COLOR] = {.first = 0.008, .last = 0.00005, .own_factor = 2},
};

/* ---- rates ---- */

static const double cool_end = 0.02;

static double decay(double first, double last, double progress)
{
    return first == last ? first : exp((1 - progress) * log(first) + progress * log(last));
}

static double rate_at(const rate_rule *r, const learning_rates_def *def, double factor)
{
    const double scale = def->uses_own_rates ? r->own_factor
                         : r->times_extent   ? def->extent
                                             : 1,
                 last = def->uses_own_rates && r->first == r->last ? def->end * r->first : r->last;
    return factor * decay(r->first, last, def->progress) * scale;
}

learning_rates learning_rates_at(const learning_rates_def *def)
{
    learning_rates rates = {.views = def->views};
    double factor = def->factor;
    if (def->uses_own_rates && def->progress > SCHEDULE_COOL_FROM)
        factor *= cool_end + (1 - cool_end) * fmax(1 - def->progress, 0) / (1 - SCHEDULE_COOL_FROM);
    for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++)
        rates.anchor[f] = rate_at(&anchor_rules[f], def, factor);
    if (def->geometry_stays)
        rates.anchor[ANCHOR_OFFSET] = rates.anchor[ANCHOR_SCALE_LOG] = 0;
    for (int i = 0; i < DECODER_NETWORKS; i++)
        rates.network[i] = rate_at(&network_rules[i], def, factor);
    return rates;
}

/* ---- memory ---- */

gbt_status learnables_make(learnables *l, size_t anchor_count, const decoder *d, gbt_error *err)
{
    l->anchors.offset_count = d->offset_count;
    GBT_TRY(anchors_resize(&l->anchors, anchor_count, err));
    l->networks = mem_calloc(d->param_count, sizeof *l->networks, "networks", err);
    return l->networks == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
}

void learnables_free(learnables *l)
{
    anchors_free(&l->anchors);
    mem_free(l->networks);
    *l = (learnables){0};
}

void learnables_zero(learnables *l, size_t param_count)
{
    anchors_zero_learned(&l->anchors);
    memset(l->networks, 0, param_count * sizeof *l->networks);
}

gbt_status learnables_follow(learnables *l, const growth_result *result, gbt_error *err)
{
    anchors *a = &l->anchors;
    GBT_TRY(anchors_resize(a, result->count > a->count ? result->count : a->count, err));
    rows_keep(a->field, anchor_fields, ANCHOR_FIELDS, a->offset_count, result->source, result->survivors);
    a->count = result->survivors;
    return anchors_resize(a, result->count, err);
}

/* ---- Adam ---- */

typedef struct anchor_job {
    const learning_model *m;
    const learning_rates *rates;
    uint64_t age; /* of the run */
} anchor_job;

/* Clamp rows to [least, most of the row]; `least` wins. */
FASTEST_CLONE static void keep_between(float *values, size_t rows, size_t width, float least,
                                       const float *most)
{
    for (size_t r = 0; r < rows; r++)
        for (size_t i = r * width; i < (r + 1) * width; i++)
            values[i] = larger(smaller(values[i], most[r]), least);
}

/* Adam step of rows [begin, end), which all have the same age. */
static void learn_rows(const anchor_job *job, size_t begin, size_t end)
{
    const learning_model *m = job->m;
    const uint64_t age = job->age - m->created[begin];
    for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++) {
        const rate_rule *rule = &anchor_rules[f];
        const size_t width = anchors_width(m->anchors, f), at = begin * width, count = (end - begin) * width;
        float *values = m->anchors->field[f] + at;
        adam_step(values, m->gradient->anchors.field[f] + at, m->moment1->anchors.field[f] + at,
                  m->moment2->anchors.field[f] + at, count,
                  adam_rates_of_views(job->rates->anchor[f], rule->ages_with_run ? job->age : age,
                                      job->rates->views));
        if (rule->is_log_scale)
            keep_between(values, end - begin, width, m->scale_log_min, m->scale_log_max + begin);
    }
}

static void learn_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const anchor_job *job = context;
    const uint64_t *created = job->m->created;
    for (size_t i = begin, next; i < end; i = next) {
        for (next = i + 1; next < end && created[next] == created[i];)
            next++;
        learn_rows(job, i, next);
    }
}

void learn_anchors(const learning_model *m, const learning_rates *rates, uint64_t age)
{
    anchor_job job = {m, rates, age};
    parallel_blocks(m->anchors->count, ADAM_BLOCK, learn_block, &job);
}

void learn_networks(const learning_model *m, const learning_rates *rates, uint64_t age)
{
    decoder_network networks[DECODER_NETWORKS];
    decoder_networks(m->decoder, networks);
    for (int i = 0; i < DECODER_NETWORKS; i++) {
        const size_t at = networks[i].begin;
        adam_step(m->decoder->params + at, m->gradient->networks + at, m->moment1->networks + at,
                  m->moment2->networks + at, networks[i].end - at,
                  adam_rates_of_views(rates->network[i], age, rates->views));
    }
}
