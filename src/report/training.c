/* SPDX-License-Identifier: Apache-2.0 */
/* report/training.c -- the sections about training: curves over time, and the time of each stage. */
#include "report/training.h"

#include <math.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "report/chart.h"
#include "report/log.h"
#include "report/metrics.h"

/* ---- curves ---- */

typedef struct time_unit {
    const char *name;
    double seconds;
} time_unit;

static time_unit choose_time_unit(double longest)
{
    return longest > 3 * 3600 ? (time_unit){"h", 3600}
           : longest > 180    ? (time_unit){"min", 60}
                              : (time_unit){"s", 1};
}

enum { HELD_OUT_LIMIT = 256 };

typedef struct curves {
    training_log log;
    time_unit unit;
    double *block, *time, *loss, *psnr, *rays, *gaussians, *blended,
        *megabytes; /* one block owns all arrays, [log.count] each */
    double held_out_time[HELD_OUT_LIMIT], held_out_psnr[HELD_OUT_LIMIT];
    size_t held_out_count;
} curves;

static void add_held_out(curves *c, double seconds, double psnr)
{
    if (c->held_out_count < HELD_OUT_LIMIT && isfinite(seconds) && isfinite(psnr)) {
        c->held_out_time[c->held_out_count] = seconds / c->unit.seconds;
        c->held_out_psnr[c->held_out_count++] = psnr;
    }
}

static gbt_status curves_make(curves *c, const char *run, const evaluation *e, const json_t *metrics,
                              gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, run, "log.csv", err));
    GBT_TRY(training_log_read(path, &c->log, err));
    const size_t n = c->log.count;
    const double trained = metrics_number(metrics, "train_seconds");
    double longest = n > 0 ? c->log.column[LOG_SECONDS][n - 1] : 0;
    if (isfinite(trained))
        longest = fmax(longest, trained);
    c->unit = choose_time_unit(longest);
    size_t i;
    json_t *at;
    json_array_foreach(json_object_get(metrics, "held_out"), i, at)
        add_held_out(c, metrics_number(at, "seconds"), metrics_number(at, "psnr"));
    add_held_out(c, trained, e->psnr);
    c->block = mem_alloc(n + 1, 7 * sizeof *c->block, "curves", err);
    if (c->block == NULL)
        return GBT_ERR_NO_MEMORY;
    c->time = c->block, c->loss = c->time + n, c->psnr = c->loss + n, c->rays = c->psnr + n,
    c->gaussians = c->rays + n, c->blended = c->gaussians + n, c->megabytes = c->blended + n;
    if (n == 0)
        return GBT_OK;
    const double reach = 0.015 * longest; /* on each side; a few seconds for a short run */
    training_log_smooth(&c->log, LOG_LOSS, reach, c->loss);
    training_log_smooth(&c->log, LOG_TRAIN_PSNR, reach, c->psnr);
    training_log_smooth(&c->log, LOG_RAYS_PER_SECOND, reach, c->rays);
    training_log_smooth(&c->log, LOG_GAUSSIANS, reach, c->gaussians);
    training_log_smooth(&c->log, LOG_BLENDED, reach, c->blended);
    for (size_t j = 0; j < n; j++) {
        c->megabytes[j] = c->log.column[LOG_MEMORY][j] * 1e-6;
        c->time[j] = c->log.column[LOG_SECONDS][j] / c->unit.seconds;
    }
    return GBT_OK;
}

static void curves_free(curves *c)
{
    mem_free(c->block);
    training_log_free(&c->log);
}

static void add_curves(text *out, const curves *c)
{
    const size_t n = c->log.count;
    double *const *column = c->log.column;
    const chart_series loss[] = {{NULL, c->time, column[LOG_LOSS], n, 0, CHART_FAINT},
                                 {"loss, smoothed", c->time, c->loss, n, 0, CHART_LINE}};
    const chart_series psnr[] = {
        {NULL, c->time, column[LOG_TRAIN_PSNR], n, 0, CHART_FAINT},
        {"training, smoothed", c->time, c->psnr, n, 0, CHART_LINE},
        {"held-out", c->held_out_time, c->held_out_psnr, c->held_out_count, 1, CHART_DOTS}};
    const chart_series counts[] = {{NULL, c->time, column[LOG_GAUSSIANS], n, 1, CHART_FAINT},
                                   {"Gaussians per view, smoothed", c->time, c->gaussians, n, 1, CHART_LINE},
                                   {"anchors", c->time, column[LOG_ANCHORS], n, 0, CHART_LINE}};
    const chart_series rays[] = {{NULL, c->time, column[LOG_RAYS_PER_SECOND], n, 2, CHART_FAINT},
                                 {"rays, smoothed", c->time, c->rays, n, 2, CHART_LINE}};
    const chart_series blended[] = {{NULL, c->time, column[LOG_BLENDED], n, 3, CHART_FAINT},
                                    {"blended, smoothed", c->time, c->blended, n, 3, CHART_LINE}};
    const chart_series memory[] = {{"resident memory", c->time, c->megabytes, n, 0, CHART_LINE}};
    const line_chart charts[] = {
        {.title = "Loss",
         .y_unit = "log scale",
         .log_y = true,
         .y_decimals = 4,
         .series = loss,
         .series_count = 2},
        {.title = "PSNR",
         .y_unit = "dB",
         .y_decimals = 2,
         .series = psnr,
         .series_count = 3,
         .note =
             "Training photos are scored on the pixels that a step looks at, from the middle of the run on "
             "half of them on a random background; held-out views at full size."},
        {.title = "Anchors and Gaussians",
         .y_unit = "count",
         .from_zero = true,
         .y_decimals = -1,
         .series = counts,
         .series_count = 3},
        {.title = "Rays per second",
         .y_unit = "rays/s, forward and adjoint",
         .from_zero = true,
         .y_decimals = -1,
         .series = rays,
         .series_count = 2},
        {.title = "Gaussians per ray",
         .y_unit = "blended on a ray",
         .from_zero = true,
         .y_decimals = 1,
         .series = blended,
         .series_count = 2},
        {.title = "Memory",
         .y_unit = "MB, highest so far",
         .from_zero = true,
         .y_decimals = 0,
         .series = memory,
         .series_count = 1},
    };
    text_add(out, "<section id=\"training\"><h2>Training</h2>\n");
    text_add(out, "<div class=\"grid2\">\n");
    for (size_t i = 0; i < sizeof charts / sizeof *charts; i++) {
        line_chart chart = charts[i];
        chart.x_unit = c->unit.name;
        chart_lines(out, &chart);
    }
    text_add(out, "</div></section>\n");
}

/* ---- where the time went ---- */

static void add_stage_layers(text *out, const curves *c)
{
    /* Similar stages share one layer: more layers could not be told apart. */
    static const struct {
        const char *name;
        log_column first, last;
        int color;
    } kinds[] = {{"photo and rays", LOG_PHOTO_MS, LOG_RAYS_MS, 0},
                 {"anchors, decode", LOG_VISIBLE_MS, LOG_DECODE_MS, 1},
                 {"build tree", LOG_BUILD_MS, LOG_BUILD_MS, 2},
                 {"draw", LOG_TRACE_MS, LOG_TRACE_MS, 3},
                 {"loss", LOG_LOSS_MS, LOG_LOSS_MS, 4},
                 {"draw, adjoint", LOG_ADJOINT_MS, LOG_ADJOINT_MS, 5},
                 {"decode, adjoint", LOG_DECODE_ADJOINT_MS, LOG_DECODE_ADJOINT_MS, 6},
                 {"optimizer", LOG_OPTIMIZER_MS, LOG_OPTIMIZER_MS, 7},
                 {"grow and prune", LOG_ADJUST_MS, LOG_ADJUST_MS, 8}};
    enum { KINDS = sizeof kinds / sizeof *kinds };
    const size_t n = c->log.count;
    chart_layer layers[KINDS];
    double *sum = mem_calloc(n + 1, KINDS * sizeof *sum, "stages", out->err);
    if (sum == NULL) {
        out->status = GBT_ERR_NO_MEMORY;
        return;
    }
    for (size_t k = 0; k < KINDS; k++) {
        layers[k] = (chart_layer){kinds[k].name, sum + k * n, kinds[k].color};
        for (int column = (int)kinds[k].first; column <= (int)kinds[k].last; column++)
            for (size_t i = 0; i < n; i++)
                sum[k * n + i] += c->log.column[column][i];
    }
    chart_stack(out, "Time by stage, over training", c->unit.name, "ms per step", c->time, n, layers, KINDS);
    mem_free(sum);
}

/* Stages of a step, named as in train.json and in order of execution. Those with the same colour form one
   layer. */
static const struct {
    const char *key, *name;
    int color;
} stages[] = {{"photo", "photo", 0},
              {"rays", "camera rays", 0},
              {"visible", "anchors in view", 1},
              {"decode", "decode networks", 1},
              {"build", "build tree", 2},
              {"trace", "draw", 3},
              {"loss", "loss", 4},
              {"adjoint", "draw, adjoint", 5},
              {"decode_adjoint", "decode, adjoint", 6},
              {"optimizer", "optimizer", 7},
              {"adjust", "grow and prune", 8}};
enum { STAGES = sizeof stages / sizeof *stages };

static void add_stages(text *out, const curves *c, const json_t *metrics)
{
    chart_bar bars[STAGES + 1];
    const json_t *all = json_object_get(metrics, "stage_ms_per_step");
    const double whole = metrics_number(all, "all");
    double rest = whole;
    size_t count = 0;
    for (; count < STAGES; count++) {
        bars[count] =
            (chart_bar){stages[count].name, metrics_number(all, stages[count].key), stages[count].color};
        rest -= isfinite(bars[count].value) ? bars[count].value : 0;
    }
    if (rest > 0)
        bars[count++] = (chart_bar){"the rest", rest, 8};
    text_add(out, "<section id=\"time\"><h2>Where the time goes</h2>\n<div class=\"grid2\">\n");
    chart_bars(out, "Time by stage, mean of all steps", "ms", bars, count, whole);
    add_stage_layers(out, c);
    text_add(out, "</div></section>\n");
}

/* ---- entry ---- */

void report_training(text *out, const char *run, const evaluation *e, const json_t *metrics)
{
    if (out->status != GBT_OK)
        return;
    curves *c = mem_calloc(1, sizeof *c, "curves", out->err);
    out->status = c == NULL ? GBT_ERR_NO_MEMORY : curves_make(c, run, e, metrics, out->err);
    if (out->status == GBT_OK) {
        add_curves(out, c);
        add_stages(out, c, metrics);
    }
    if (c != NULL)
        curves_free(c);
    mem_free(c);
}
