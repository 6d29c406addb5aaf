/* SPDX-License-Identifier: Apache-2.0 */
/* command/compress.c -- compress a trained model into a small file, and report what its bytes are used for.
 */
#include "gbtrace/compress.h"

#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/def.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "base/stop_signal.h"
#include "cluster/cluster.h"
#include "data/json_out.h"
#include "io/model_file.h"
#include "run/run_sensitivity.h"
#include "io/model_code.h"
#include "train/config.h"

gbt_compress_def gbt_compress_def_default(void)
{
    return (gbt_compress_def){.quality = 60, .cookie_ = DEF_COOKIE};
}

/* Sizes and times, for the report. */
typedef struct compression {
    size_t anchors, before;
    model_sizes after;
    double probe_seconds, encode_seconds, decode_seconds;
    const char *steps_from; /* what the quantization steps were computed from */
    bool lossless;
    bool kept; /* the file was already small: it was copied */
} compression;

/* Whether the settings of RUN ask for a lossless model. */
static gbt_status wants_lossless(const char *run, bool *lossless, gbt_error *err)
{
    char path[4096];
    unsigned char *text = NULL;
    size_t size;
    gbt_train_def settings = gbt_train_def_default();
    config_strings strings;
    GBT_TRY(file_join(path, sizeof path, run, "config", err));
    GBT_TRY(file_read(path, &text, &size, err));
    const gbt_status status = config_parse((const char *)text, path, &settings, &strings, err);
    *lossless = settings.lossless;
    mem_free(text);
    return status;
}

/* The model file: that of a run folder, or `run` itself if it is a file. */
static gbt_status find_model(const char *run, char *path, size_t size, gbt_error *err)
{
    if (file_is_folder(run))
        return file_join(path, size, run, "model.gbt", err);
    return snprintf(path, size, "%s", run) < (int)size
               ? GBT_OK
               : base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", run);
}

static gbt_status open_run(const char *run, const gbt_compress_def *def, loaded_run *r, bool *has_views,
                           gbt_error *err)
{
    *has_views = false;
    GBT_TRY(loaded_run_open_model(run, r, err));
    GBT_TRY(loaded_run_need_anchors(r, run, err));
    if (def->lossless)
        return GBT_OK;
    *has_views = def->data != NULL || r->data.place[0] != '\0';
    if (!*has_views) {
        log_info(
            "%s%s: quantization steps are estimated from the model alone, which makes the file larger (name "
            "the folder where the data set is)",
            r->model.data_folder[0] != '\0' ? r->model.data_folder : run,
            r->model.data_folder[0] != '\0' ? " is not there" : " names no data set");
        return GBT_OK;
    }
    r->data_is_known = def->after_training;
    return loaded_run_open_views(run, def->data, 0, r, err);
}

static gbt_status check_stop(gbt_error *err)
{
    return stop_signal_seen() ? base_fail(err, GBT_ERR_INTERRUPTED, MAKING_SMALL_STOPPED) : GBT_OK;
}

static gbt_status code_run(loaded_run *r, bool has_views, const gbt_compress_def *def, const char *out,
                           compression *c, gbt_error *err)
{
    model_sensitivity s = {0};
    model_steps steps = {0};
    gbt_status status = GBT_OK;
    const double start = clock_wall();
    c->lossless = def->lossless;
    if (!c->lossless)
        status = has_views ? run_sensitivity(r, &s, err) : model_sensitivity_guess(&r->model, &s, err);
    if (status == GBT_OK && !c->lossless && !model_positions_fit(&r->model, &s, def->quality)) {
        log_warn("%s: an anchor is so far from the others that their positions would be rounded too much: "
                 "the model is stored without loss, in a larger file (sparse points far outside the scene?)",
                 out);
        c->lossless = true;
    }
    if (!c->lossless) {
        if (status == GBT_OK)
            status = model_transform_features(&r->model, &s, err);
        if (status == GBT_OK)
            status = model_steps_at(&r->model, &s, def->quality, &steps, err);
    }
    const double probed = clock_wall();
    if (status == GBT_OK)
        status = check_stop(err);
    if (status == GBT_OK)
        status = model_save_coded(out, &r->model, c->lossless ? NULL : &steps, &c->after, err);
    const double coded = clock_wall();
    model back = {0};
    if (status == GBT_OK)
        status = model_load(out, &back, err);
    c->probe_seconds = probed - start;
    c->encode_seconds = coded - probed;
    c->decode_seconds = clock_wall() - coded;
    c->anchors = r->model.anchors.count;
    c->steps_from = c->lossless ? "lossless" : has_views ? "training views" : "the model alone";
    model_free(&back);
    model_sensitivity_free(&s);
    model_steps_free(&steps);
    return status;
}

/* ---- a file that is already small ---- */

/**
 * If `path` is a coded model that would not get smaller, make `out` a copy of it.
 *
 * A quantized file does not record its quality, which is the default unless the user chose another. So it is
 * quantized again only if the wanted quality is below the default.
 */
static gbt_status keep_small(const char *path, const gbt_compress_def *def, const char *out, compression *c,
                             gbt_error *err)
{
    unsigned char *bytes = NULL;
    container file = {0};
    model m = {0};
    gbt_error unreadable = {0}; /* ignored here: whoever reads the file next reports it */
    if (file_read(path, &bytes, &c->before, &unreadable) != GBT_OK)
        return GBT_OK;
    gbt_status status = GBT_OK;
    if (container_parse(bytes, c->before, path, &file, &unreadable) == GBT_OK && model_is_coded(&file) &&
        (def->lossless || (model_is_coarse(&file) && def->quality >= gbt_compress_def_default().quality))) {
        c->kept = true;
        c->steps_from = "already small";
        status = model_from_container(&file, &m, err);
        c->anchors = m.anchors.count;
        if (status == GBT_OK)
            status = model_sizes_read(&file, c->before, &c->after, err);
        if (status == GBT_OK && !file_is_same(path, out))
            status = file_write_atomic(out, bytes, c->before, err);
    }
    model_free(&m);
    container_free(&file);
    mem_free(bytes);
    return status;
}

/* ---- report ---- */

enum { PARTS = 8 };

typedef struct part_row {
    const char *name;
    size_t bytes;
} part_row;

static void list_parts(const model_sizes *s, part_row rows[PARTS])
{
    const size_t rest =
        s->total - s->positions - s->features - s->offsets - s->scales - s->pixels - s->steps - s->networks;
    const part_row all[PARTS] = {{"positions", s->positions}, {"features", s->features},
                                 {"offsets", s->offsets},     {"scales", s->scales},
                                 {"pixels", s->pixels},       {"steps", s->steps},
                                 {"networks", s->networks},   {"rest", rest}};
    memcpy(rows, all, sizeof all);
}

static void print_report(const compression *c, const char *out, FILE *report)
{
    part_row rows[PARTS];
    const double count = c->anchors > 0 ? (double)c->anchors : 1;
    list_parts(&c->after, rows);
    fprintf(
        report,
        "%s: %zu anchors, %zu bytes before, %zu after: %.1f times smaller, %.2f bytes per anchor (%s%s)\n",
        out, c->anchors, c->before, c->after.total, (double)c->before / (double)c->after.total,
        (double)c->after.total / count, c->lossless ? "" : "quantization steps from ", c->steps_from);
    for (int i = 0; i < PARTS; i++)
        fprintf(report, "  %-10s%10zu bytes %8.2f per anchor\n", rows[i].name, rows[i].bytes,
                (double)rows[i].bytes / count);
    fprintf(report,
            "  quantization steps found in %.2f s, encoded and checked in %.2f s, decoded in %.2f s\n",
            c->probe_seconds, c->encode_seconds, c->decode_seconds);
}

static void print_kept(const compression *c, const char *path, const char *out, bool lossless, FILE *report)
{
    const bool itself = file_is_same(path, out);
    fprintf(report, "%s: already small: %zu anchors, %zu bytes, %.2f bytes per anchor; %s%s\n", path,
            c->anchors, c->before, (double)c->before / (c->anchors > 0 ? (double)c->anchors : 1),
            itself ? "nothing to do" : out, itself ? "" : " is a copy");
    if (!lossless)
        fprintf(report, "  a quality below %g makes it smaller\n", gbt_compress_def_default().quality);
}

static gbt_status save_report(const compression *c, const gbt_compress_def *def, gbt_error *err)
{
    part_row rows[PARTS];
    const double count = c->anchors > 0 ? (double)c->anchors : 1;
    json_t *parts = json_object();
    list_parts(&c->after, rows);
    for (int i = 0; i < PARTS; i++)
        json_object_set_new(parts, rows[i].name,
                            json_pack("{s:I,s:f}", "bytes", (json_int_t)rows[i].bytes, "per_anchor",
                                      (double)rows[i].bytes / count));
    json_t *root = json_pack(
        "{s:i,s:I,s:I,s:I,s:f,s:s,s:o,s:o,s:f,s:f,s:f}", "schema", 1, "anchors", (json_int_t)c->anchors,
        "bytes_before", (json_int_t)c->before, "bytes", (json_int_t)c->after.total, "bytes_per_anchor",
        (double)c->after.total / count, "steps_from", c->steps_from, "quality",
        c->lossless || c->kept ? json_null() : json_real(def->quality), "parts", parts, "probe_seconds",
        c->probe_seconds, "encode_seconds", c->encode_seconds, "decode_seconds", c->decode_seconds);
    const gbt_status status = json_save(root, def->json, err);
    json_decref(root);
    return status;
}

static gbt_status compress(const char *run, const gbt_compress_def *def, const char *out, FILE *report,
                           gbt_error *err)
{
    GBT_TRY(def_check(def->cookie_, "gbt_compress_def_default", err));
    if (!def->lossless && !(def->quality >= 20 && def->quality <= 90))
        return base_fail(err, GBT_ERR_ARGUMENT, "quality: %g dB (wanted 20 to 90)", def->quality);
    GBT_TRY(file_check_creatable(out, err));
    if (def->json != NULL)
        GBT_TRY(file_check_creatable(def->json, err));
    compression c = {0};
    char path[4096];
    bool has_views = false, stays = false;
    if (def->after_training)
        GBT_TRY(wants_lossless(run, &stays, err));
    if (stays)
        return GBT_OK;
    GBT_TRY(find_model(run, path, sizeof path, err));
    if (def->json != NULL && (file_is_one(def->json, out) || file_is_same(def->json, path)))
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: would be overwritten (`json` must be another file)",
                         def->json);
    loaded_run *r = mem_calloc(1, sizeof *r, "run", err);
    if (r == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = keep_small(path, def, out, &c, err);
    if (status == GBT_OK && !c.kept)
        status = open_run(run, def, r, &has_views, err);
    if (status == GBT_OK && !c.kept)
        status = code_run(r, has_views, def, out, &c, err);
    if (status == GBT_OK && report != NULL && c.kept)
        print_kept(&c, path, out, def->lossless, report);
    else if (status == GBT_OK && report != NULL)
        print_report(&c, out, report);
    if (status == GBT_OK && def->json != NULL)
        status = save_report(&c, def, err);
    loaded_run_close(r);
    mem_free(r);
    return status == GBT_OK ? check_stop(err) : status; /* after a stop request nothing more is started */
}

/* One process works for all. */
gbt_status gbt_compress(const char *run, const gbt_compress_def *def, const char *out, FILE *report,
                        gbt_error *err)
{
    PLAIN_NUMBERS;
    stop_signal_catch();
    const gbt_status status =
        cluster_follow(cluster_leads() ? compress(run, def, out, report, err) : GBT_OK, err);
    stop_signal_release();
    return status;
}
