/* eval/report.c -- the page of a run, from top to bottom.

   evaluation (scores, PNG files) --+
   metrics (the object)           --+--> one HTML text --> RUN/report.html
   RUN/log.csv                    --+ */
#include "eval/report.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "eval/report_chart.h"
#include "eval/report_log.h"
#include "eval/report_style.h"
#include "eval/report_text.h"
#include "eval/report_views.h"
#include "gbtrace/train.h"

/* ---- what metrics holds ------------------------------------------------------------------------------------------------------- */

/** NaN when it is absent or not a number. */
static double number_of(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

/** NULL when it is absent, empty or not a text. */
static const char *text_of(const json_t *object, const char *key)
{
    const char *value = json_string_value(json_object_get(object, key));
    return value != NULL && value[0] != '\0' ? value : NULL;
}

/** The last part of a path, slashes at the end left out: a data set's name. */
static void base_name(const char *path, char *out, size_t size)
{
    size_t end = strlen(path);
    while (end > 1 && path[end - 1] == '/')
        end--;
    size_t start = end;
    while (start > 0 && path[start - 1] != '/')
        start--;
    snprintf(out, size, "%.*s", (int)(end - start < size ? end - start : size - 1), path + start);
}

/* ---- top ---------------------------------------------------------------------------------------------------------------------- */

static void open_tile(text *out, const char *name)
{
    text_format(out, "<div class=\"tile card\"><dt>%s</dt><dd>", name);
}

static void close_tile(text *out, const char *unit)
{
    text_format(out, "%s%s%s</dd></div>\n", unit[0] != '\0' ? " <small>" : "", unit, unit[0] != '\0' ? "</small>" : "");
}

static void add_tiles(text *out, const evaluation *e, const json_t *metrics)
{
    text_add(out, "<dl class=\"tiles\">\n");
    open_tile(out, "Held-out PSNR");
    if (isinf(e->psnr) && e->psnr > 0)
        text_add(out, "\xe2\x88\x9e");
    else
        text_number(out, e->psnr, 2);
    close_tile(out, isnan(e->psnr) ? "" : "dB");
    open_tile(out, "SSIM");
    text_number(out, e->ssim, 4);
    close_tile(out, "");
    open_tile(out, "FLIP (0 is best)");
    text_number(out, e->flip, 4);
    close_tile(out, "");
    open_tile(out, "Training time");
    text_duration(out, number_of(metrics, "train_seconds"));
    close_tile(out, "");
    open_tile(out, "Anchors");
    text_count(out, (double)e->anchors);
    close_tile(out, "");
    open_tile(out, "Gaussians per view");
    text_count(out, isfinite(e->gaussians_per_view) ? e->gaussians_per_view : number_of(metrics, "gaussians_per_view"));
    close_tile(out, "");
    open_tile(out, "Model file");
    text_bytes(out, e->model_bytes > 0 ? (double)e->model_bytes : (double)NAN);
    close_tile(out, "");
    open_tile(out, "Iterations");
    text_count(out, number_of(metrics, "iterations"));
    close_tile(out, "");
    text_add(out, "</dl>\n");
}

static void add_head(text *out, const char *run, const evaluation *e, const json_t *metrics)
{
    char name[256];
    const char *data = text_of(metrics, "data"), *command = text_of(metrics, "command");
    base_name(data != NULL ? data : run, name, sizeof name);
    text_add(out, "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                  "<title>");
    text_escaped(out, name);
    text_add(out, " \xc2\xb7 gbtrace</title>\n<style>\n");
    text_add(out, report_css);
    text_add(out, "</style>\n</head>\n<body>\n<header>\n<h1>");
    text_escaped(out, name);
    const char *renderer = text_of(metrics, "renderer");
    const bool splats = renderer != NULL && strcmp(renderer, "trace") != 0;
    text_format(out, "</h1>\n<p class=\"lead\">A neural Gaussian scene, %s. Data: ", splats ? "rendered by splats on the CPU" : "rendered by CPU ray tracing");
    text_escaped(out, data);
    text_format(out, " \xc2\xb7 %zu held-out view%s</p>\n</header>\n<main>\n", e->view_count, e->view_count == 1 ? "" : "s");
    add_tiles(out, e, metrics);
    text_add(out, "<pre class=\"card\">");
    if (command != NULL)
        text_add(out, "$ ");
    text_escaped(out, command != NULL ? command : "command: n/a");
    text_add(out, "</pre>\n");
}

/* ---- curves ------------------------------------------------------------------------------------------------------------------- */

typedef struct time_unit { const char *name; double seconds; } time_unit;

static time_unit choose_time_unit(double longest)
{
    return longest > 3 * 3600 ? (time_unit){"h", 3600} : longest > 180 ? (time_unit){"min", 60} : (time_unit){"s", 1};
}

enum { HELD_OUT_LIMIT = 256, MARK_LIMIT = 16 };

typedef struct curves {
    training_log log;
    time_unit unit;
    double *block, *time, *loss, *psnr, *rays, *anchors; /* block owns the others, [log.count] each */
    double held_out_time[HELD_OUT_LIMIT], held_out_psnr[HELD_OUT_LIMIT];
    size_t held_out_count;
    chart_mark marks[MARK_LIMIT];
    size_t mark_count;
} curves;

static void add_held_out(curves *c, double seconds, double psnr)
{
    if (c->held_out_count < HELD_OUT_LIMIT && isfinite(seconds) && isfinite(psnr))
        c->held_out_time[c->held_out_count] = seconds / c->unit.seconds, c->held_out_psnr[c->held_out_count++] = psnr;
}

/** Where coarse to fine went on to the next resolution. */
static void find_marks(curves *c)
{
    double width = 0, height = 0;
    for (size_t i = 0; i < c->log.count && c->mark_count < MARK_LIMIT; i++) {
        const double w = c->log.column[LOG_WIDTH][i], h = c->log.column[LOG_HEIGHT][i];
        if (!(w >= 1 && h >= 1 && w < 1e6 && h < 1e6))
            continue;
        /* Photos of a set differ by a pixel or two, and a held-out score is at full size; only a step up to stay is a step of the schedule. */
        const bool stays = i + 1 == c->log.count || c->log.column[LOG_WIDTH][i + 1] * c->log.column[LOG_HEIGHT][i + 1] > 1.5 * width * height;
        if (w * h > 1.5 * width * height && stays) {
            chart_mark *mark = &c->marks[c->mark_count++];
            mark->x = c->mark_count == 1 ? 0 : c->time[i];
            snprintf(mark->label, sizeof mark->label, "%.0f\xc3\x97%.0f px", w, h);
            width = w, height = h;
        }
    }
}

static gbt_status curves_make(curves *c, const char *run, const evaluation *e, const json_t *metrics, gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, run, "log.csv", err));
    GBT_TRY(training_log_read(path, &c->log, err));
    const size_t n = c->log.count;
    const double trained = number_of(metrics, "train_seconds");
    double longest = n > 0 ? c->log.column[LOG_SECONDS][n - 1] : 0;
    if (isfinite(trained))
        longest = fmax(longest, trained);
    c->unit = choose_time_unit(longest);
    size_t i;
    json_t *at;
    json_array_foreach(json_object_get(metrics, "held_out"), i, at)
        add_held_out(c, number_of(at, "seconds"), number_of(at, "psnr"));
    add_held_out(c, trained, e->psnr);
    c->block = mem_alloc(n + 1, 5 * sizeof *c->block, "curves", err);
    if (c->block == NULL)
        return GBT_ERR_NO_MEMORY;
    c->time = c->block, c->loss = c->time + n, c->psnr = c->loss + n, c->rays = c->psnr + n, c->anchors = c->rays + n;
    if (n == 0)
        return GBT_OK;
    const double reach = 0.015 * longest; /* on each side: a few seconds of a short run */
    training_log_smooth(&c->log, LOG_LOSS, reach, c->loss);
    training_log_smooth(&c->log, LOG_TRAIN_PSNR, reach, c->psnr);
    training_log_smooth(&c->log, LOG_RAYS_PER_SECOND, reach, c->rays);
    training_log_smooth(&c->log, LOG_GAUSSIANS, reach, c->anchors);
    for (size_t j = 0; j < n; j++)
        c->time[j] = c->log.column[LOG_SECONDS][j] / c->unit.seconds;
    find_marks(c);
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
    const chart_series loss[] = {{NULL, c->time, column[LOG_LOSS], n, 0, CHART_FAINT}, {"loss, smoothed", c->time, c->loss, n, 0, CHART_LINE}};
    const chart_series psnr[] = {{NULL, c->time, column[LOG_TRAIN_PSNR], n, 0, CHART_FAINT},
                                 {"training, smoothed", c->time, c->psnr, n, 0, CHART_LINE},
                                 {"held-out", c->held_out_time, c->held_out_psnr, c->held_out_count, 1, CHART_DOTS}};
    const chart_series counts[] = {{NULL, c->time, column[LOG_GAUSSIANS], n, 1, CHART_FAINT},
                                   {"Gaussians per view, smoothed", c->time, c->anchors, n, 1, CHART_LINE},
                                   {"anchors", c->time, column[LOG_ANCHORS], n, 0, CHART_LINE}};
    const chart_series rays[] = {{NULL, c->time, column[LOG_RAYS_PER_SECOND], n, 2, CHART_FAINT}, {"rays, smoothed", c->time, c->rays, n, 2, CHART_LINE}};
    const line_chart charts[] = {
        {.title = "Loss", .y_unit = "log scale", .log_y = true, .y_decimals = 4, .series = loss, .series_count = 2},
        {.title = "PSNR", .y_unit = "dB", .y_decimals = 2, .series = psnr, .series_count = 3,
         .note = "Training photos are scored at the resolution of the moment, held-out views at full size."},
        {.title = "Anchors and Gaussians", .y_unit = "count", .from_zero = true, .y_decimals = -1, .series = counts, .series_count = 3},
        {.title = "Rays per second", .y_unit = "rays/s, forward and adjoint", .from_zero = true, .y_decimals = -1, .series = rays, .series_count = 2},
    };
    text_add(out, "<section><h2>Training</h2>\n");
    if (c->mark_count > 1)
        text_add(out, "<p class=\"lead\">Training goes from coarse to fine; dashed lines are where the pictures became larger.</p>\n");
    text_add(out, "<div class=\"grid2\">\n");
    for (size_t i = 0; i < sizeof charts / sizeof *charts; i++) {
        line_chart chart = charts[i];
        chart.x_unit = c->unit.name, chart.marks = c->marks, chart.mark_count = c->mark_count > 1 ? c->mark_count : 0;
        chart_lines(out, &chart);
    }
    text_add(out, "</div></section>\n");
}

/* ---- facts -------------------------------------------------------------------------------------------------------------------- */

static void open_row(text *out, const char *name)
{
    text_format(out, "<tr><th>%s</th><td>", name);
}

static void close_row(text *out)
{
    text_add(out, "</td></tr>\n");
}

static void text_row(text *out, const char *name, const char *value)
{
    open_row(out, name);
    text_escaped(out, value);
    close_row(out);
}

static void count_row(text *out, const char *name, double value)
{
    open_row(out, name);
    text_count(out, value);
    close_row(out);
}

static void number_row(text *out, const char *name, double value, int decimals, const char *unit)
{
    open_row(out, name);
    text_number(out, value, decimals);
    text_format(out, "%s%s", isfinite(value) ? " " : "", isfinite(value) ? unit : "");
    close_row(out);
}

static void bytes_row(text *out, const char *name, double value)
{
    open_row(out, name);
    text_bytes(out, value);
    if (isfinite(value) && value >= 1000) {
        text_add(out, " (");
        text_count(out, value);
        text_add(out, " bytes)");
    }
    close_row(out);
}

static double mean_seconds(const evaluation *e)
{
    double sum = 0;
    for (size_t i = 0; i < e->view_count; i++)
        sum += e->views[i].seconds;
    return e->view_count > 0 ? sum / (double)e->view_count : (double)NAN;
}

static void add_stages(text *out, const evaluation *e, const json_t *metrics)
{
    static const struct { const char *key, *name; } stages[] = {
        {"photo", "photo"}, {"rays", "camera rays"}, {"visible", "anchors in view"}, {"decode", "decode networks"}, {"build", "build tree"},
        {"trace", "trace rays"}, {"loss", "loss"}, {"adjoint", "trace adjoint"}, {"decode_adjoint", "decode adjoint"}, {"optimizer", "optimizer"},
        {"adjust", "grow and prune"}};
    enum { STAGES = sizeof stages / sizeof *stages };
    chart_bar bars[STAGES + 1];
    const json_t *all = json_object_get(metrics, "stage_ms_per_step");
    const double whole = number_of(all, "all");
    double rest = whole;
    size_t count = 0;
    for (; count < STAGES; count++) {
        bars[count] = (chart_bar){stages[count].name, number_of(all, stages[count].key)};
        rest -= isfinite(bars[count].value) ? bars[count].value : 0;
    }
    if (rest > 0)
        bars[count++] = (chart_bar){"the rest", rest};
    text_add(out, "<section><h2>Where the time goes</h2>\n<div class=\"grid2\">\n");
    chart_bars(out, "Time by stage, per training step", "ms", bars, count, whole);
    text_add(out, "<div class=\"box card\"><h3>Speed</h3><table class=\"facts\"><tbody>\n");
    number_row(out, "One training step", whole, 1, "ms");
    number_row(out, "Rays in training", number_of(metrics, "rays_per_second") * 1e-6, 3, "million per second, forward and adjoint");
    number_row(out, "Gaussians met per ray", number_of(metrics, "hits_per_ray"), 1, "");
    number_row(out, "Gaussians blended per ray", number_of(metrics, "blended_per_ray"), 1, "");
    number_row(out, "One held-out view", mean_seconds(e), 3, "s: decode, tree and trace");
    count_row(out, "Steps skipped", number_of(metrics, "skipped_steps"));
    bytes_row(out, "Peak memory", number_of(metrics, "peak_memory_bytes"));
    count_row(out, "Threads", number_of(metrics, "threads"));
    text_row(out, "Instructions", text_of(metrics, "isa"));
    text_row(out, "Embree", text_of(metrics, "embree_version"));
    text_add(out, "</tbody></table></div></div></section>\n");
}

/** "50,50,...": what --pace takes. False, with nothing added, unless it is a whole list of counts. */
static bool add_pace(text *out, const json_t *metrics)
{
    const json_t *pace = json_object_get(metrics, "pace");
    const size_t count = json_array_size(pace);
    for (size_t i = 0; i < count; i++)
        if (!json_is_integer(json_array_get(pace, i)))
            return false;
    for (size_t i = 0; i < count; i++)
        text_format(out, "%s%" JSON_INTEGER_FORMAT, i > 0 ? "," : "", json_integer_value(json_array_get(pace, i)));
    return count > 0;
}

static void add_counts(text *out, const evaluation *e, const json_t *metrics)
{
    const double bytes = e->model_bytes > 0 ? (double)e->model_bytes : (double)NAN;
    const double seen = number_of(metrics, "gaussians_per_view");
    text_add(out, "<section><h2>Counts and bytes</h2>\n<div class=\"grid2\">\n<div class=\"box card\"><h3>From points to a model</h3><table class=\"facts\"><tbody>\n");
    text_row(out, "Started from", text_of(metrics, "start"));
    count_row(out, "Points", number_of(metrics, "points"));
    count_row(out, "Anchors at the start", number_of(metrics, "anchors_initial"));
    count_row(out, "Anchors at the end", (double)e->anchors);
    count_row(out, "Gaussians per view", isfinite(e->gaussians_per_view) ? e->gaussians_per_view : seen);
    bytes_row(out, "Model file", bytes);
    number_row(out, "Bytes per anchor", e->anchors > 0 ? bytes / (double)e->anchors : (double)NAN, 1, "");
    text_add(out, "</tbody></table></div>\n<div class=\"box card\"><h3>The run</h3><table class=\"facts\"><tbody>\n");
    count_row(out, "Iterations", number_of(metrics, "iterations"));
    open_row(out, "Training time");
    text_duration(out, number_of(metrics, "train_seconds"));
    close_row(out);
    number_row(out, "Photos divided by", number_of(metrics, "downscale"), 3, "");
    text_row(out, "Held-out split", text_of(metrics, "eval_split"));
    count_row(out, "Held-out views", (double)e->view_count);
    number_row(out, "Seed", number_of(metrics, "seed"), 0, "");
    open_row(out, "Pace: steps in each twentieth");
    if (!add_pace(out, metrics))
        text_add(out, "n/a");
    close_row(out);
    text_add(out, "</tbody></table></div></div></section>\n");
}

/* ---- end ---------------------------------------------------------------------------------------------------------------------- */

static void add_foot(text *out, const char *run, const json_t *metrics)
{
    const char *command = text_of(metrics, "command");
    text_add(out, "</main>\n<footer>\n<h2>Make it again</h2>\n<p>A time budget decides only how many steps there are. With the pace that this run recorded, the "
                  "same photos give the same model, bit for bit, on any number of threads:</p>\n<pre class=\"card\">");
    if (command != NULL) {
        text_escaped(out, command);
    } else {
        text_add(out, "gbtrace train ");
        text_escaped(out, text_of(metrics, "data") != NULL ? text_of(metrics, "data") : "DATA");
        text_add(out, " -o NEW");
    }
    if (command == NULL || strstr(command, "--pace") == NULL) {
        const size_t before = out->length;
        text_add(out, " --pace ");
        if (!add_pace(out, metrics))
            out->length = out->status == GBT_OK ? before : out->length;
    }
    text_add(out, "</pre>\n<p>The scores, the pictures and this page, from the model:</p>\n<pre class=\"card\">gbtrace eval ");
    text_escaped(out, run);
    text_add(out, "</pre>\n<p>Pictures here are JPEG for size; the scores were made from the PNG files in <code>renders/test</code>. Every number is in "
                  "<code>metrics.json</code>, every curve in <code>log.csv</code>. This page is one file and loads nothing.</p>\n</footer>\n<script>\n");
    text_add(out, report_script);
    text_add(out, "</script>\n</body>\n</html>\n");
}

gbt_status report_write(const char *run, const evaluation *e, const json_t *metrics, gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, run, "report.html", err));
    text out = {.err = err};
    curves *c = mem_calloc(1, sizeof *c, "curves", err);
    if (c == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = curves_make(c, run, e, metrics, err);
    if (status != GBT_OK)
        goto done;
    add_head(&out, run, e, metrics);
    report_views(&out, e, text_of(metrics, "protocol"));
    add_curves(&out, c);
    add_stages(&out, e, metrics);
    add_counts(&out, e, metrics);
    add_foot(&out, run, metrics);
    status = out.status;
    if (status == GBT_OK)
        status = file_write_atomic(path, out.bytes, out.length, err);
done:
    text_free(&out);
    curves_free(c);
    mem_free(c);
    return status;
}
