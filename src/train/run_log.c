/* SPDX-License-Identifier: Apache-2.0 */
/* train/run_log.c -- the progress line, log.csv and train.json. */
#include "train/run_log.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/machine.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "bvh/device.h"
#include "data/json_out.h"
#include "gbtrace/cluster.h"

static const double row_every_seconds = 1;

#define STAGE_MS(name) (1000 / n * s->stage[RUN_STAGE_##name].wall)

/* One row: its column in log.csv, its tag for TensorBoard ("": not there), how it is printed, its value. */
#define ROW_COLUMNS(X)                                                                                       \
    X("step", "", "%.0f", (double)t->step)                                                                   \
    X("seconds", "run/seconds", "%.3f", t->seconds)                                                          \
    X("progress", "run/progress", "%.5f", pace_progress(&t->pace, t->step))                                  \
    X("width", "run/width", "%.0f", (double)width)                                                           \
    X("height", "run/height", "%.0f", (double)height)                                                        \
    X("loss", "loss/all", "%.6f", s->loss / compared)                                                        \
    X("l1", "loss/l1", "%.6f", s->l1 / compared)                                                             \
    X("ssim", "train/ssim", "%.6f", s->ssim / compared)                                                      \
    X("train_psnr", "train/psnr", "%.4f", s->psnr / compared)                                                \
    X("test_psnr", "held_out/psnr", "%.4f", test_psnr)                                                       \
    X("anchors", "scene/anchors", "%.0f", (double)t->anchors.count)                                          \
    X("gaussians", "scene/gaussians", "%.0f", s->gaussians / n)                                              \
    X("visible_anchors", "scene/visible_anchors", "%.0f", s->visible / n)                                    \
    X("blended_per_ray", "scene/blended_per_ray", "%.2f", s->blended / fmax(s->rays, 1))                     \
    X("rays_per_second", "run/rays_per_second", "%.0f", s->rays / fmax(seconds_of(s), 1e-9))                 \
    X("photo_ms", "ms/photo", "%.3f", STAGE_MS(photo))                                                       \
    X("rays_ms", "ms/rays", "%.3f", STAGE_MS(rays))                                                          \
    X("visible_ms", "ms/visible", "%.3f", STAGE_MS(visible))                                                 \
    X("decode_ms", "ms/decode", "%.3f", STAGE_MS(decode))                                                    \
    X("build_ms", "ms/build", "%.3f", STAGE_MS(build))                                                       \
    X("trace_ms", "ms/trace", "%.3f", STAGE_MS(trace))                                                       \
    X("loss_ms", "ms/loss", "%.3f", STAGE_MS(loss))                                                          \
    X("adjoint_ms", "ms/adjoint", "%.3f", STAGE_MS(adjoint))                                                 \
    X("decode_adjoint_ms", "ms/decode_adjoint", "%.3f", STAGE_MS(decode_adjoint))                            \
    X("optimizer_ms", "ms/optimizer", "%.3f", STAGE_MS(optimizer))                                           \
    X("adjust_ms", "ms/adjust", "%.3f", STAGE_MS(adjust))                                                    \
    X("memory_bytes", "run/memory_bytes", "%.0f", (double)mem_peak_bytes())

static const struct {
    const char *name, *tag, *format;
} columns[] = {
#define X(name, tag, format, value) {name, tag, format},
    ROW_COLUMNS(X)
#undef X
};

enum { COLUMN_COUNT = sizeof columns / sizeof *columns };

static size_t header_text(char *out, size_t size)
{
    size_t used = 0;
    for (int i = 0; i < COLUMN_COUNT; i++)
        used += (size_t)snprintf(out + used, size - used, "%s%c", columns[i].name,
                                 i + 1 < COLUMN_COUNT ? ',' : '\n');
    return used;
}

/* Restore the held-out score from a row of log.csv, if it has one. */
static void recall_evaluation(run_log *log, const char *row, size_t length)
{
    char line[2048];
    double seconds = 0, psnr = (double)NAN;
    snprintf(line, sizeof line, "%.*s", length < sizeof line ? (int)length : (int)sizeof line - 1, row);
    const char *field = line;
    for (int i = 0; i < COLUMN_COUNT && field != NULL; i++) {
        char *end;
        const double value = strtod(field, &end);
        if (end != field && strcmp(columns[i].name, "seconds") == 0)
            seconds = value;
        if (end != field && strcmp(columns[i].name, "test_psnr") == 0)
            psnr = value;
        field = strchr(field, ',');
        field = field != NULL ? field + 1 : NULL;
    }
    if (isnan(psnr) || log->evaluated_count == GBT_TRAIN_MAX_EVALS)
        return;
    log->evaluated_seconds[log->evaluated_count] = seconds;
    log->evaluated_step[log->evaluated_count] = strtoull(line, NULL, 10);
    log->evaluated_psnr[log->evaluated_count++] = psnr;
}

/* Start log.csv, or cut it back to the checkpoint's step: rows of steps that will be repeated, and a row cut
   off by a kill, are removed. */
static gbt_status rewind_rows(run_log *log, const char *csv_path, uint64_t step, gbt_error *err)
{
    char header[1024];
    const size_t header_size = header_text(header, sizeof header);
    unsigned char *bytes = NULL;
    size_t size = 0, kept = 0;
    if (step > 0 && file_exists(csv_path))
        GBT_TRY(file_read(csv_path, &bytes, &size, err));
    if (size >= header_size && memcmp(bytes, header, header_size) == 0)
        kept = header_size;
    for (const unsigned char *end; kept > 0 && (end = memchr(bytes + kept, '\n', size - kept)) != NULL;
         kept = (size_t)(end - bytes) + 1) {
        if (strtoull((const char *)bytes + kept, NULL, 10) > step)
            break;
        recall_evaluation(log, (const char *)bytes + kept, (size_t)(end - bytes) - kept);
    }
    const gbt_status status = kept > 0 ? file_write_atomic(csv_path, bytes, kept, err)
                                       : file_write_atomic(csv_path, header, header_size, err);
    mem_free(bytes);
    return status;
}

static void flush_events(run_log *log)
{
    fwrite(log->records.bytes, 1, log->records.count, log->events);
    fflush(log->events);
    log->records.count = 0;
}

/* The same for the TensorBoard events, with a record that says that steps may be repeated. */
static gbt_status rewind_events(run_log *log, const char *path, uint64_t step, gbt_error *err)
{
    unsigned char *bytes = NULL;
    size_t size = 0;
    if (step > 0 && file_exists(path))
        GBT_TRY(file_read(path, &bytes, &size, err));
    const size_t kept = event_records_until(bytes, size, step);
    event_records *r = &log->records;
    if (kept == 0)
        event_add_version(r);
    if (step > 0)
        event_add_start(r, step + 1); /* the kept records end with `step` */
    gbt_status status = file_write_atomic(path, bytes, kept, err);
    mem_free(bytes);
    if (status == GBT_OK && (log->events = fopen(path, "ab")) == NULL)
        status = base_fail(err, GBT_ERR_IO, "%s: cannot write", path);
    if (status == GBT_OK)
        flush_events(log);
    return status;
}

gbt_status run_log_open(run_log *log, const trainer *t, const char *csv_path, const char *events_path,
                        gbt_error *err)
{
    memset(log, 0, sizeof *log);
    log->last_row_seconds = t->seconds;
    log->psnr_smooth = log->loss = (double)NAN;
    GBT_TRY(rewind_rows(log, csv_path, t->step, err));
    if (t->def.tensorboard)
        GBT_TRY(rewind_events(log, events_path, t->step, err));
    log->csv = fopen(csv_path, "a");
    if (log->csv == NULL)
        return base_fail(err, GBT_ERR_IO, "%s: cannot write", csv_path);
    log_info("%s: %zu photos to train on, %zu held out; %s -> %zu anchors x %d (voxel size %.4g, extent "
             "%.4g, distance input %s)",
             t->scene.folder, t->train_count, t->test_count, t->start_text, t->anchors.count,
             t->anchors.offset_count, (double)t->voxel_size, t->extent,
             t->decoder.has_distance ? "on" : "off");
    return GBT_OK;
}

static double seconds_of(const run_sums *s) { return s->stage[RUN_STAGE_all].wall; }

/* Does the step have a loss: not skipped, and at least one photo not fully masked? */
static bool compares(const step_report *r) { return !r->skipped && !isnan(r->psnr); }

static void add_step(run_sums *s, const step_report *r)
{
    s->steps++;
    if (compares(r)) {
        s->compared++;
        s->loss += r->loss;
        s->l1 += r->l1;
        s->ssim += r->ssim;
        s->psnr += r->psnr;
    }
    s->gaussians += (double)r->gaussians;
    s->visible += (double)r->visible;
    s->rays += (double)r->rays;
    s->hits += (double)r->hits;
    s->blended += (double)r->blended;
    s->wait += r->wait_seconds;
    s->exchange += r->exchange_seconds;
    s->exchange_bytes += (double)r->exchange_bytes;
#define X(name, time) stage_add(&s->stage[RUN_STAGE_##name], time);
    RUN_STAGE_LIST(X)
#undef X
}

static void write_row(run_log *log, const trainer *t, int width, int height, double test_psnr)
{
    const run_sums *s = &log->row;
    /* NaN when there was no step since the last row. */
    const double n = s->steps > 0 ? (double)s->steps : (double)NAN,
                 compared = s->compared > 0 ? (double)s->compared : (double)NAN;
    const double values[] = {
#define X(name, tag, format, value) value,
        ROW_COLUMNS(X)
#undef X
    };
    event_scalar scalars[COLUMN_COUNT];
    size_t scalar_count = 0;
    for (int i = 0; i < COLUMN_COUNT; i++) {
        if (isfinite(values[i]))
            fprintf(log->csv, columns[i].format, values[i]);
        fputc(i + 1 < COLUMN_COUNT ? ',' : '\n', log->csv);
        if (isfinite(values[i]) && columns[i].tag[0] != '\0')
            scalars[scalar_count++] = (event_scalar){columns[i].tag, values[i]};
    }
    fflush(log->csv);
    if (log->events != NULL) {
        event_add_scalars(&log->records, t->step, scalars, scalar_count);
        flush_events(log);
    }
    memset(&log->row, 0, sizeof log->row);
    log->last_row_seconds = t->seconds;
}

static void tell_progress(const run_log *log, const trainer *t)
{
    const step_report *r = &log->last;
    const double progress = pace_progress(&t->pace, t->step),
                 left = progress > 0 ? t->seconds * (1 - progress) / progress : 0;
    const run_sums *s = log->row.steps > 0 ? &log->row : &log->all;
    char line[512];
    gbt_event e = {.text = line,
                   .stage = "train",
                   .done = t->step,
                   .total = t->def.pace != NULL ? pace_total(&t->pace) : t->def.iterations,
                   .fraction = progress,
                   .seconds = t->seconds};
    e.seconds_left = t->pace.known < PACE_SEGMENTS ? fmax(0, t->def.budget_seconds - t->seconds) : left;
    e.psnr = log->psnr_smooth;
    e.loss = log->loss;
    e.anchors = t->anchors.count;
    e.gaussians = r->gaussians;
    snprintf(line, sizeof line,
             "step %llu  %3.0f %%  %dx%d  loss %.4f  psnr %.2f  anchors %zu  gaussians %zu  %.2f Mrays/s  "
             "%zu MB  %.0f:%02.0f left",
             (unsigned long long)t->step, 100 * progress, r->width, r->height, log->loss, log->psnr_smooth,
             t->anchors.count, r->gaussians, s->rays / fmax(seconds_of(s), 1e-9) * 1e-6,
             mem_peak_bytes() / 1000000, floor(e.seconds_left / 60), floor(fmod(e.seconds_left, 60)));
    log_progress(&e);
}

void run_log_step(run_log *log, const trainer *t, const step_report *report)
{
    add_step(&log->row, report);
    add_step(&log->all, report);
    if (compares(report)) {
        log->loss = report->loss;
        log->psnr_smooth =
            log->all.compared == 1 ? report->psnr : 0.98 * log->psnr_smooth + 0.02 * report->psnr;
    }
    log->last = *report;
    if (log_progress_due())
        tell_progress(log, t);
    if (t->seconds - log->last_row_seconds >= row_every_seconds)
        write_row(log, t, report->width, report->height, NAN);
}

void run_log_evaluation(run_log *log, const trainer *t, double psnr)
{
    if (isnan(psnr))
        return;
    if (log->evaluated_count < GBT_TRAIN_MAX_EVALS) {
        log->evaluated_seconds[log->evaluated_count] = t->seconds;
        log->evaluated_step[log->evaluated_count] = t->step;
        log->evaluated_psnr[log->evaluated_count++] = psnr;
    }
    const image *drawn = &t->views[0].frame.rgb;
    write_row(log, t, drawn->width, drawn->height, psnr);
    log_info("held-out PSNR after %.1f s (step %llu): %.3f dB", t->seconds, (unsigned long long)t->step,
             psnr);
}

/* Four tables by stage; "waiting" is the thread time in a stage that was not spent working. */
static void add_stages(json_t *root, const run_sums *s)
{
    static const char *const names[RUN_STAGES] = {
#define X(name, time) #name,
        RUN_STAGE_LIST(X)
#undef X
    };
    const double ms = 1000 / (s->steps > 0 ? (double)s->steps : 1);
    json_t *wall = json_object(), *work = json_object(), *span = json_object(), *waiting = json_object();
    for (int i = 0; i < RUN_STAGES; i++) {
        const stage_time *t = &s->stage[i];
        json_object_set_new(wall, names[i], json_real(t->wall * ms));
        json_object_set_new(work, names[i], json_real(t->work * ms));
        json_object_set_new(span, names[i], json_real(t->span * ms));
        json_object_set_new(waiting, names[i], json_real((parallel_threads() * t->wall - t->work) * ms));
    }
    json_object_set_new(root, "stage_ms_per_step", wall);
    json_object_set_new(root, "stage_work_ms_per_step", work);
    json_object_set_new(root, "stage_span_ms_per_step", span);
    json_object_set_new(root, "stage_waiting_ms_per_step", waiting);
}

gbt_status run_log_summary(run_log *log, const trainer *t, const char *json_path, gbt_error *err)
{
    if (log->row.steps > 0)
        write_row(log, t, log->last.width, log->last.height, (double)NAN);
    if (log->all.steps > 0)
        tell_progress(log, t);
    const run_sums *s = &log->all;
    const double n = s->steps > 0 ? (double)s->steps : 1;
    json_t *root = json_object(), *parts = json_array(), *evals = json_array();
    for (int i = 0; i < t->pace.known; i++)
        json_array_append_new(parts, json_integer((json_int_t)t->pace.steps[i]));
    for (int i = 0; i < log->evaluated_count; i++)
        json_array_append_new(evals,
                              json_pack("{s:f,s:I,s:f}", "seconds", log->evaluated_seconds[i], "step",
                                        (json_int_t)log->evaluated_step[i], "psnr", log->evaluated_psnr[i]));
    json_object_set_new(root, "schema", json_integer(1));
    if (t->def.command != NULL)
        json_object_set_new(root, "command", json_text(t->def.command));
    json_object_set_new(root, "data", json_text(t->scene.folder));
    json_object_set_new(root, "start", json_string(t->start_text));
    json_object_set_new(root, "points", json_integer((json_int_t)t->points_used));
    json_object_set_new(root, "anchors_initial", json_integer((json_int_t)t->anchors_initial));
    json_object_set_new(root, "anchors_final", json_integer((json_int_t)t->anchors.count));
    json_object_set_new(root, "iterations", json_integer((json_int_t)t->step));
    json_object_set_new(root, "views", json_integer(t->def.views));
    json_object_set_new(root, "skipped_steps", json_integer((json_int_t)t->skipped_steps));
    json_object_set_new(root, "opacity_raises", json_integer((json_int_t)t->opacity_raises));
    json_object_set_new(root, "exposure", json_boolean(t->exposures.count > 0));
    json_object_set_new(root, "refine_poses", json_boolean(t->poses.count > 0));
    json_object_set_new(root, "train_seconds", json_real(t->seconds));
    json_object_set_new(root, "rays_per_second", json_real(s->rays / fmax(seconds_of(s), 1e-9)));
    json_object_set_new(root, "hits_per_ray", json_real(s->hits / fmax(s->rays, 1)));
    json_object_set_new(root, "blended_per_ray", json_real(s->blended / fmax(s->rays, 1)));
    json_object_set_new(root, "gaussians_per_view", json_real(s->gaussians / n));
    json_object_set_new(root, "visible_per_view", json_real(s->visible / n));
    json_object_set_new(root, "rays_per_step", json_real(s->rays / n));
    add_stages(root, s);
    if (gbt_cluster_size() > 1)
        json_object_set_new(root, "communication",
                            json_pack("{s:i,s:f,s:f,s:f}", "processes", gbt_cluster_size(), "bytes_per_step",
                                      s->exchange_bytes / n, "ms_per_step", 1000 * s->exchange / n,
                                      "waiting_ms_per_step", 1000 * s->wait / n));
    json_object_set_new(root, "pace", parts);
    json_object_set_new(root, "held_out", evals);
    json_object_set_new(root, "downscale", json_real(t->def.downscale));
    json_object_set_new(root, "eval_split", json_text(t->def.eval_split));
    char seed[32]; /* as text: jansson's integers end at 2^63 - 1 */
    snprintf(seed, sizeof seed, "%llu", (unsigned long long)t->def.seed);
    json_object_set_new(root, "seed",
                        t->def.seed > INT64_MAX ? json_text(seed) : json_integer((json_int_t)t->def.seed));
    json_object_set_new(root, "threads", json_integer(parallel_threads()));
    const machine here = machine_read("");
    json_object_set_new(root, "processor", json_text(here.processor[0] != '\0' ? here.processor : "?"));
    json_object_set_new(root, "isa", json_string(cpu_isa_name(cpu_best_isa())));
    json_object_set_new(root, "embree_version", json_string(bvh_embree_version()));
    json_object_set_new(root, "peak_memory_bytes", json_integer((json_int_t)mem_peak_bytes()));
    const gbt_status status = json_save_styled(root, JSON_INDENT(2) | JSON_REAL_PRECISION(9), json_path, err);
    json_decref(root);
    return status;
}

bool run_log_is_of_step(const char *json_path, uint64_t step)
{
    json_t *root = json_load_file(json_path, 0, NULL);
    const bool same =
        root != NULL && (uint64_t)json_integer_value(json_object_get(root, "iterations")) == step;
    json_decref(root);
    return same;
}

void run_log_close(run_log *log)
{
    if (log->csv != NULL)
        fclose(log->csv);
    if (log->events != NULL)
        fclose(log->events);
    event_records_free(&log->records);
    log->csv = log->events = NULL;
}
