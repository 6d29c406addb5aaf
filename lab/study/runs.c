/* SPDX-License-Identifier: Apache-2.0 */
/* study/runs.c -- one training run of a study: make it, or reuse it from an earlier call; read its figures
   back. study.json records the run's settings and the figures measured here. It is removed first and written
   last, so that it exists only beside a complete run. */
#include "study/runs.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/json_fields.h"
#include "data/json_out.h"
#include "eval/lpips.h"
#include "gbtrace/compress.h"
#include "gbtrace/evaluate.h"
#include "run/loaded_run.h"

enum { PATH_SIZE = 4096, SETTINGS_SIZE = CONFIG_TEXT_SIZE + PATH_SIZE };

/* ---- names ---- */

static void make_slug(const char *name, char *out, size_t size)
{
    size_t i = 0;
    for (; name[i] != '\0' && i + 1 < size; i++)
        out[i] = isalnum((unsigned char)name[i]) || name[i] == '.' || name[i] == '_' ? name[i] : '-';
    out[i] = '\0';
}

gbt_status study_runs_folder(const char *folder, const char *data_name, const char *variant, uint64_t seed,
                             char *out, size_t size, gbt_error *err)
{
    char place[STUDY_NAME_SIZE], what[STUDY_NAME_SIZE];
    make_slug(data_name, place, sizeof place);
    make_slug(variant, what, sizeof what);
    if (snprintf(out, size, "%s/runs/%s/%s/seed-%llu", folder, place, what, (unsigned long long)seed) >=
        (int)size)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", folder);
    return GBT_OK;
}

gbt_status study_runs_names(const char *const *data, size_t count, char names[][STUDY_NAME_SIZE],
                            gbt_error *err)
{
    if (data == NULL || count < 1 || count > STUDY_SCENES_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "study: wanted 1 to %d data sets", (int)STUDY_SCENES_MAX);
    for (size_t i = 0; i < count; i++) {
        char *whole = realpath(data[i], NULL); /* so that "." has a name too */
        if (whole == NULL)
            return base_fail(err, GBT_ERR_IO, "%.400s: no such data set", data[i]);
        snprintf(names[i], STUDY_NAME_SIZE, "%s", strrchr(whole, '/') + 1);
        free(whole);
        char slug[STUDY_NAME_SIZE], other[STUDY_NAME_SIZE];
        make_slug(names[i], slug, sizeof slug);
        for (size_t j = 0; j < i; j++) {
            make_slug(names[j], other, sizeof other);
            if (strcmp(slug, other) == 0)
                return base_fail(err, GBT_ERR_ARGUMENT,
                                 "study: two data sets are called %.200s; their runs would share a folder",
                                 slug);
        }
    }
    return GBT_OK;
}

/* ---- identity of a run ---- */

/* Everything that affects the figures: the requested settings, the compression, and when intermediate scores
   are taken. */
static void settings_text(const char *data, const gbt_train_def *def, char *out, size_t size)
{
    config_text(def, data, out, size);
    size_t used = strlen(out);
    used += (size_t)snprintf(out + used, size - used,
                             "quality = %g\neval-at =", gbt_compress_def_default().quality);
    for (int i = 0; i < def->eval_at_count && used < size; i++)
        used += (size_t)snprintf(out + used, size - used, " %.9g", def->eval_at_seconds[i]);
}

/* ---- reading back ---- */

static bool read_number(const json_t *object, const char *field, double *out)
{
    const json_t *value = json_object_get(object, field);
    *out = json_is_number(value) ? json_number_value(value) : (double)NAN;
    return json_is_number(value);
}

/* Read a score; null means that there is none. */
static bool read_score(const json_t *object, const char *field, double *out)
{
    return read_number(object, field, out) || json_is_null(json_object_get(object, field));
}

static bool read_marks(const json_t *array, study_figures *f)
{
    if (!json_is_array(array) || json_array_size(array) > STUDY_MARKS_MAX)
        return false;
    f->mark_count = json_array_size(array);
    for (size_t i = 0; i < f->mark_count; i++) {
        const json_t *mark = json_array_get(array, i);
        if (!read_number(mark, "seconds", &f->marks[i].seconds) ||
            !read_number(mark, "psnr", &f->marks[i].psnr))
            return false;
    }
    return true;
}

static bool read_metrics(const json_t *m, study_figures *f)
{
    read_number(m, "lpips_01", &f->lpips_01);
    return read_score(m, "psnr", &f->psnr) && read_score(m, "ssim", &f->ssim) &&
           read_number(m, "points", &f->points) && read_number(m, "anchors_initial", &f->anchors_initial) &&
           read_number(m, "anchors_final", &f->anchors_final) &&
           read_number(m, "model_bytes", &f->model_bytes) && read_number(m, "iterations", &f->iterations) &&
           read_number(m, "train_seconds", &f->train_seconds) &&
           read_marks(json_object_get(m, "held_out"), f);
}

static bool read_measured(const json_t *s, study_figures *f)
{
    return read_score(s, "anchors_in_view", &f->anchors_in_view) &&
           read_score(s, "blended_per_ray", &f->blended_per_ray) &&
           read_number(s, "macs_per_anchor", &f->macs_per_anchor) &&
           read_number(s, "network_bytes", &f->network_bytes);
}

/* Read a finished run with these settings. False if anything is missing or damaged: then the run counts as
   not finished. */
static bool read_run(const char *study_path, const char *metrics_path, const char *settings,
                     study_figures *out)
{
    json_t *study = NULL, *metrics = NULL;
    gbt_error ignored = {0};
    bool fine = json_read(study_path, &study, &ignored) == GBT_OK &&
                json_read(metrics_path, &metrics, &ignored) == GBT_OK;
    json_t *ours = json_text(settings); /* through the same conversion as when it was saved, since paths may
                                           hold any bytes */
    fine = fine && json_equal(json_object_get(study, "settings"), ours) && read_measured(study, out) &&
           read_metrics(metrics, out);
    json_decref(ours);
    json_decref(study);
    json_decref(metrics);
    return fine;
}

/* ---- measuring ---- */

static double network_macs(const decoder *d)
{
    const double heads = 3, outputs_per_offset = 1 + 7 + 3, inputs = ANCHOR_FEATURE_DIM + 3 + d->has_distance;
    return ANCHOR_HIDDEN_DIM * (heads * inputs + outputs_per_offset * d->offset_count);
}

static gbt_status measure_views(loaded_run *r, study_figures *f, gbt_error *err)
{
    double views = 0, visible = 0, blended = 0, rays = 0;
    r->frame.draw.renderer = GBT_RENDERER_TRACE;
    for (size_t view = 0; view < r->scene.view_count; view++) {
        if (!r->scene.views[view].is_test)
            continue;
        GBT_TRY(loaded_run_render(r, view, err));
        views++;
        visible += (double)r->frame.visible_count;
        blended += (double)r->frame.counters.blended;
        rays += (double)r->frame.counters.rays;
    }
    f->anchors_in_view = visible / views;
    f->blended_per_ray = blended / rays; /* 0 / 0 = NaN without held-out views */
    return GBT_OK;
}

static gbt_status measure(const char *run, study_figures *f, gbt_error *err)
{
    loaded_run *r = mem_calloc(1, sizeof *r, "run", err);
    if (r == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = loaded_run_open_model(run, r, err);
    if (status == GBT_OK)
        status = loaded_run_open_own_views(run, r, err);
    if (status == GBT_OK)
        status = measure_views(r, f, err);
    f->macs_per_anchor = network_macs(&r->model.decoder);
    f->network_bytes = (double)r->model.decoder.param_count * sizeof(float);
    loaded_run_close(r);
    mem_free(r);
    return status;
}

static gbt_status save_measured(const char *path, const char *settings, const study_figures *f,
                                gbt_error *err)
{
    json_t *root = json_pack("{s:i,s:o,s:o,s:o,s:f,s:f}", "schema", 1, "settings", json_text(settings),
                             "anchors_in_view", json_number(f->anchors_in_view), "blended_per_ray",
                             json_number(f->blended_per_ray), "macs_per_anchor", f->macs_per_anchor,
                             "network_bytes", f->network_bytes);
    const gbt_status status = json_save(root, path, err);
    json_decref(root);
    return status;
}

/* ---- making the run ---- */

static void remove_checkpoints(const char *run)
{
    static const char *const names[] = {"checkpoints/last.gbt", "checkpoints/last.gbt.prev", "checkpoints"};
    char path[PATH_SIZE];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (file_join(path, sizeof path, run, names[i], NULL) == GBT_OK)
            remove(path);
}

/* An interrupted run starts from the beginning, because its checkpoint lacks the sums and intermediate
   scores. */
static gbt_status train(const char *data, const char *run, const gbt_train_def *def, gbt_error *err)
{
    gbt_error why = {0};
    gbt_train_def anew = *def;
    anew.overwrite = true;
    const gbt_status status = gbt_train(data, run, &anew, &why);
    if (status == GBT_ERR_INTERRUPTED)
        return base_fail(err, status, "%.400s: interrupted; run the same command again to continue this run",
                         run);
    return status == GBT_OK ? GBT_OK : base_fail(err, status, "%s", why.text);
}

static gbt_status score(const char *run, const char *network, bool after_training, gbt_error *err)
{
    gbt_evaluate_def evaluate = gbt_evaluate_def_default();
    evaluate.report = 0;
    evaluate.after_training = after_training;
    evaluate.lpips = network;
    return gbt_evaluate(run, &evaluate, err);
}

static gbt_status make_run(const char *data, const char *run, const gbt_train_def *def, const char *network,
                           const char *study_path, const char *settings, gbt_error *err)
{
    gbt_compress_def compress = gbt_compress_def_default();
    study_figures measured;
    char file[PATH_SIZE];
    GBT_TRY(file_join(file, sizeof file, run, "model.gbt", err));
    unlink(study_path);
    compress.after_training = true;
    GBT_TRY(train(data, run, def, err));
    GBT_TRY(gbt_compress(run, &compress, file, NULL, err)); /* so that scores are of the file that `gbtrace
                                                               train` leaves */
    GBT_TRY(score(run, network, true, err));
    GBT_TRY(measure(run, &measured, err));
    remove_checkpoints(run);
    return save_measured(study_path, settings, &measured, err);
}

/* Whether a run has been scored with this LPIPS network; without one (NULL), always true. */
static gbt_status is_scored_by(const char *file, const char *metrics_path, bool *scored, gbt_error *err)
{
    lpips *net = NULL;
    json_t *metrics = NULL;
    *scored = file == NULL;
    if (file == NULL)
        return GBT_OK;
    gbt_status status = lpips_open(file, &net, err);
    if (status == GBT_OK)
        status = json_read(metrics_path, &metrics, err);
    const char *theirs = json_string_value(json_object_get(metrics, "lpips_network"));
    *scored = status == GBT_OK && theirs != NULL && strcmp(theirs, lpips_network(net)) == 0;
    json_decref(metrics);
    lpips_close(net);
    return status;
}

gbt_status study_runs_do(const char *data, const char *run, const gbt_train_def *def, const char *network,
                         study_figures *out, gbt_error *err)
{
    char study_path[PATH_SIZE], metrics_path[PATH_SIZE], settings[SETTINGS_SIZE];
    GBT_TRY(file_join(study_path, sizeof study_path, run, "study.json", err));
    GBT_TRY(file_join(metrics_path, sizeof metrics_path, run, "metrics.json", err));
    char *whole = realpath(data, NULL); /* one data set, one name */
    settings_text(whole != NULL ? whole : data, def, settings, sizeof settings);
    free(whole);
    if (read_run(study_path, metrics_path, settings, out)) {
        log_info("%s: there already", run);
        bool scored;
        GBT_TRY(is_scored_by(network, metrics_path, &scored, err));
        if (scored)
            return GBT_OK;
        GBT_TRY(score(run, network, false, err));
    } else {
        log_info("%s", run);
        GBT_TRY(make_run(data, run, def, network, study_path, settings, err));
    }
    return read_run(study_path, metrics_path, settings, out)
               ? GBT_OK
               : base_fail(err, GBT_ERR_INTERNAL, "%.400s: the run cannot be read back", run);
}

gbt_status study_runs_do_variant(const char *folder, const char *data, const char *data_name,
                                 const char *variant, const char *settings, gbt_train_def def,
                                 study_figures *out, gbt_error *err)
{
    char run[PATH_SIZE];
    config_strings strings;
    GBT_TRY(config_parse(settings, variant, &def, &strings, err));
    GBT_TRY(study_runs_folder(folder, data_name, variant, def.seed, run, sizeof run, err));
    return study_runs_do(data, run, &def, NULL, out, err);
}
