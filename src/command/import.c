/* SPDX-License-Identifier: Apache-2.0 */
/* command/import.c -- import a trained Scaffold-GS model as a run. */
#include "gbtrace/import.h"

#include <math.h>
#include <stdlib.h>

#include "base/choice.h"
#include "base/def.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "data/result_folder.h"
#include "data/scene.h"
#include "frame/frame.h"
#include "gbtrace/train.h"
#include "io/model_file.h"
#include "io/scaffold_file.h"
#include "train/config.h"
#include "train/photos.h"
#include "train/rules.h"

gbt_import_def gbt_import_def_default(void)
{
    return (gbt_import_def){.renderer = GBT_RENDERER_RASTER, .cookie_ = DEF_COOKIE};
}

static gbt_status find_input(const char *input, result_folder *out, gbt_error *err)
{
    bool found = false;
    if (file_is_folder(input)) {
        GBT_TRY(result_folder_find(input, out, &found, err));
        if (found)
            return GBT_OK;
        GBT_TRY(file_join(out->ply, sizeof out->ply, input, "point_cloud.ply", err));
        if (!file_exists(out->ply))
            return base_fail(err, GBT_ERR_IO,
                             "%s: no model of Scaffold-GS (wanted point_cloud/iteration_N/point_cloud.ply or "
                             "point_cloud.ply in it)",
                             input);
        return GBT_OK;
    }
    GBT_TRY(scaffold_file_check_name(input, err));
    return snprintf(out->ply, sizeof out->ply, "%s", input) < (int)sizeof out->ply
               ? GBT_OK
               : base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", input);
}

/* By how much training reduced the photos. If cfg_args gives a width, or photos came from a folder images_N
   of unknown N, only the photos themselves can tell. */
static gbt_status find_downscale(const result_folder *from, const char *data, double *out, gbt_error *err)
{
    scene s;
    gbt_error why = {0};
    *out = fmax(from->downscale, from->reduced);
    if (from->width == 0 && from->reduced == 0)
        return GBT_OK;
    if (scene_load(data, NULL, &s, &why) != GBT_OK) {
        if (from->width > 0)
            log_warn("trained on photos %d pixels wide, and the data set cannot be read: set the "
                     "downscale when you run gbtrace eval (%s)",
                     from->width, why.text);
        return GBT_OK;
    }
    const gbt_status status = photos_result_downscale(&s, from->width, from->reduced, out, err);
    scene_free(&s);
    return status;
}

/* Fill in the model's settings and scene data. */
static gbt_status describe(model *m, const result_folder *from, const gbt_import_def *def, gbt_error *err)
{
    char full[RESULT_PATH_SIZE];
    const char *data = def->data != NULL ? def->data : from->source;
    if (data[0] != '\0' && realpath(data, full) != NULL)
        data = full;
    if (snprintf(m->data_folder, sizeof m->data_folder, "%s", data) >= (int)sizeof m->data_folder)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", data);
    gbt_train_def train = gbt_train_def_default();
    train.renderer = def->renderer;
    train.footprint = 0;
    GBT_TRY(find_downscale(from, m->data_folder, &train.downscale, err));
    train.compat = true;
    train.offsets = m->anchors.offset_count;
    train.alpha = from->white_background ? GBT_ALPHA_WHITE : GBT_ALPHA_BLACK;
    config_text(&train, m->data_folder, m->config, sizeof m->config);
    m->iterations = from->iteration;
    m->t_near = train_rules_of(&train).near_depth;
    for (int c = 0; c < 3; c++)
        m->background[c] = from->white_background;
    return GBT_OK;
}

/* Check the output files before any work is done. */
static gbt_status check_places(const char *run, const gbt_import_def *def, gbt_error *err)
{
    static const char *const names[] = {"config", "model.gbt"};
    char path[RESULT_PATH_SIZE];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        GBT_TRY(file_join(path, sizeof path, run, names[i], err));
        if (file_exists(path))
            return base_fail(err, GBT_ERR_ARGUMENT, "%.1000s: holds a trained run (wanted another folder)",
                             run);
    }
    return def->data == NULL || file_exists(def->data)
               ? GBT_OK
               : base_fail(err, GBT_ERR_IO, "%.1000s: the data set does not exist", def->data);
}

static gbt_status write_run(const model *m, const char *run, gbt_error *err)
{
    char path[RESULT_PATH_SIZE];
    GBT_TRY(file_make_folder(run, err));
    GBT_TRY(file_join(path, sizeof path, run, "model.gbt", err));
    return model_save(path, m, err);
}

gbt_status gbt_import(const char *input, const gbt_import_def *def, const char *run, FILE *report,
                      gbt_error *err)
{
    PLAIN_NUMBERS;
    GBT_TRY(def_check(def->cookie_, "gbt_import_def_default", err));
    GBT_TRY(choice_check("renderer", GBT_RENDERER_TRAINING_NAMES, (int)def->renderer, err));
    GBT_TRY(check_places(run, def, err));
    result_folder *from = mem_calloc(1, sizeof *from, "import", err);
    model *m = mem_calloc(1, sizeof *m, "import", err);
    size_t dropped = 0;
    gbt_status status = from == NULL || m == NULL ? GBT_ERR_NO_MEMORY : find_input(input, from, err);
    if (status == GBT_OK)
        status = scaffold_file_read(from->ply, m, &dropped, err);
    if (status == GBT_OK)
        status = describe(m, from, def, err);
    if (status == GBT_OK)
        status = write_run(m, run, err);
    if (status == GBT_OK && report != NULL)
        fprintf(report,
                "%s: %zu anchors with %d Gaussians each at most, %zu unusable ones dropped; networks %s the "
                "distance; written to %s\n",
                from->ply, m->anchors.count, m->anchors.offset_count, dropped,
                m->decoder.has_distance ? "with" : "without", run);
    if (m != NULL)
        model_free(m);
    mem_free(m);
    mem_free(from);
    return status;
}
