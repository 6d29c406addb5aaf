/* SPDX-License-Identifier: Apache-2.0 */
/* pose/colmap.c -- builds command lines for COLMAP 3.6 to 4, runs them, and follows their progress by the
   output. */
#include "pose/colmap.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/choice.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/parallel.h"
#include "data/bytes.h"
#include "pose/child.h"
#include "pose/database.h"

enum {
    OPTIONS_MAX = 12,     /* of one command */
    EXHAUSTIVE_FILM = 80, /* up to this many frames or photos, every pair is matched */
    EXHAUSTIVE_PHOTOS = 200,
    OPENCV_LEAST = 20, /* as many photos of one camera determine its eight parameters */
    BLOCK = 10,        /* photos in a block of exhaustive matching */
    KEY_FRAMES = 20    /* of a film, matched exhaustively to find where the camera returns to a place */
};

/* ---- arguments ---- */

typedef struct command_line {
    const char *arguments[2 * OPTIONS_MAX + 3];
    int count;
    char names[OPTIONS_MAX][48], values[OPTIONS_MAX][JOB_PATH_SIZE];
    int option_count;
} command_line;

static void add(command_line *c, const char *name, const char *value)
{
    if (c->option_count == OPTIONS_MAX)
        return;
    const int i = c->option_count++;
    snprintf(c->names[i], sizeof c->names[i], "--%s", name);
    snprintf(c->values[i], sizeof c->values[i], "%s", value);
    c->arguments[c->count++] = c->names[i];
    c->arguments[c->count++] = c->values[i];
    c->arguments[c->count] = NULL;
}

static void add_number(command_line *c, const char *name, long value)
{
    char text[24];
    snprintf(text, sizeof text, "%ld", value);
    add(c, name, text);
}

static void begin_command(command_line *c, const job *j, const char *verb)
{
    *c = (command_line){.arguments = {"colmap", verb}, .count = 2};
    add(c, "database_path", j->database);
}

/* ---- which version ---- */

static void find_extraction_options(const char *line, void *context)
{
    colmap_options *d = context;
    d->new_extraction = d->new_extraction || strstr(line, "FeatureExtraction.use_gpu") != NULL;
    d->camera_per_image = d->camera_per_image || strstr(line, "ImageReader.single_camera_per_image") != NULL;
}

static void find_matching_options(const char *line, void *context)
{
    colmap_options *d = context;
    d->new_matching = d->new_matching || strstr(line, "FeatureMatching.use_gpu") != NULL;
}

static void find_mapper_options(const char *line, void *context)
{
    colmap_options *d = context;
    d->global_tolerance = d->global_tolerance || strstr(line, "Mapper.ba_global_function_tolerance") != NULL;
}

gbt_status colmap_find(const job *j, colmap_options *out, gbt_error *err)
{
    static const char *const extraction[] = {"colmap", "feature_extractor", "-h", NULL};
    static const char *const matching[] = {"colmap", "exhaustive_matcher", "-h", NULL};
    static const char *const mapper[] = {"colmap", "mapper", "-h", NULL};
    char log_path[JOB_PATH_SIZE];
    *out = (colmap_options){0};
    GBT_TRY(job_path(j, "options.log", log_path, err));
    unlink(log_path);
    GBT_TRY(child_run(extraction, log_path, find_extraction_options, out, err));
    GBT_TRY(child_run(matching, log_path, find_matching_options, out, err));
    return child_run(mapper, log_path, find_mapper_options, out, err);
}

/* ---- progress ---- */

typedef struct progress {
    const char *stage;
    uint64_t before, done, total; /* before: photos in earlier groups */
} progress;

static void tell(progress *p, uint64_t done)
{
    if (done > p->done && done <= p->total) {
        p->done = done;
        log_count(p->stage, p->done, p->total, (double)NAN);
    }
}

/* Start the clock of a stage now, not at its first line of output. */
static progress begin(const char *stage, uint64_t total)
{
    log_count(stage, 0, total, (double)NAN);
    return (progress){.stage = stage, .total = total};
}

/* "Processed file [3/30]" */
static void hear_features(const char *line, void *context)
{
    progress *p = context;
    unsigned long long done, total;
    const char *at = strstr(line, "rocessed file [");
    if (at != NULL && sscanf(at, "rocessed file [%llu/%llu", &done, &total) == 2)
        tell(p, p->before + done);
}

/* "Matching block [2/3, 1/3]", "Matching image [3/30]", "Processing image [3/30]" */
static void hear_matches(const char *line, void *context)
{
    progress *p = context;
    unsigned long long a, b, c, d;
    const char *at = strchr(line, '[');
    if (at == NULL || (strstr(line, "atching ") == NULL && strstr(line, "rocessing ") == NULL))
        return;
    const int numbers = sscanf(at, "[%llu/%llu, %llu/%llu", &a, &b, &c, &d);
    if (numbers < 2 || b == 0 || a > b || b > 1000000 || (numbers == 4 && d > 1000000))
        return;
    p->total = numbers == 4 ? b * d : b;
    tell(p, numbers == 4 && a > 0 ? (a - 1) * d + c : a);
}

/* "Registering image #12 (3)", "Registering image #12 (num_reg_frames=3)" */
static void hear_mapping(const char *line, void *context)
{
    progress *p = context;
    const char *at = strstr(line, "Registering image #");
    const char *open = at != NULL ? strchr(at, '(') : NULL;
    if (open == NULL)
        return;
    open += strcspn(open, "0123456789");
    tell(p, strtoull(open, NULL, 10));
}

/* ---- features ---- */

/* The camera model for a group of `photos` photos. */
static const char *model_name(const job *j, size_t photos, char name[CHOICE_TEXT_SIZE])
{
    gbt_pose_camera model = j->def.camera_model;
    if (model == GBT_POSE_CAMERA_AUTO)
        model = photos >= OPENCV_LEAST ? GBT_POSE_CAMERA_OPENCV : GBT_POSE_CAMERA_SIMPLE_RADIAL;
    return choice_name(GBT_POSE_CAMERA_NAMES, (int)model, name);
}

/* Write a list of the photos of a group, or of all photos (-1), one per line. */
static gbt_status write_list(const job *j, int group, char path[JOB_PATH_SIZE], size_t *count, gbt_error *err)
{
    char name[32];
    sink list = {.err = err};
    snprintf(name, sizeof name, "camera_%d.txt", group + 1);
    gbt_status status = job_path(j, name, path, err);
    *count = 0;
    for (size_t i = 0; i < j->photo_count; i++) {
        if (group >= 0 && j->photos[i].group != group)
            continue;
        sink_put_text(&list, j->photos[i].name);
        sink_put_text(&list, "\n");
        (*count)++;
    }
    status = status == GBT_OK ? list.status : status;
    if (status == GBT_OK)
        status = file_write_atomic(path, list.bytes, list.size, err);
    sink_free(&list);
    return status;
}

/* The camera id that an interrupted run gave to the photos of the group; 0: none. */
static gbt_status camera_of(const job *j, int group, uint32_t *camera, gbt_error *err)
{
    database *d;
    database_photo found = {0};
    gbt_error why = {0};
    *camera = 0;
    if (!file_exists(j->database))
        return GBT_OK;
    gbt_status status = database_open(j->database, &d, &why);
    if (status == GBT_ERR_FORMAT)
        return GBT_OK; /* stopped before COLMAP created its tables; anything worse COLMAP reports itself */
    if (status != GBT_OK)
        return base_fail(err, status, "%s", why.text);
    for (size_t i = 0; i < j->photo_count && found.camera == 0 && status == GBT_OK; i++)
        if (j->photos[i].group == group)
            status = database_find(d, j->photos[i].name, &found, err);
    database_close(d);
    *camera = found.camera;
    return status;
}

static gbt_status extract_group(const job *j, const colmap_options *d, int group, progress *p, gbt_error *err)
{
    char list[JOB_PATH_SIZE], log_path[JOB_PATH_SIZE], model[CHOICE_TEXT_SIZE];
    size_t count;
    GBT_TRY(write_list(j, group, list, &count, err));
    GBT_TRY(job_path(j, "features.log", log_path, err));
    command_line c;
    begin_command(&c, j, "feature_extractor");
    add(&c, "image_path", j->images);
    add(&c, "image_list_path", list);
    add(&c, "ImageReader.camera_model", model_name(j, group >= 0 ? count : 1, model));
    if (group >= 0) {
        uint32_t camera;
        GBT_TRY(camera_of(j, group, &camera, err));
        add(&c, "ImageReader.single_camera", "1");
        if (camera > 0)
            add_number(&c, "ImageReader.existing_camera_id", (long)camera);
    } else if (d->camera_per_image) {
        add(&c, "ImageReader.single_camera_per_image", "1");
    }
    add(&c, d->new_extraction ? "FeatureExtraction.use_gpu" : "SiftExtraction.use_gpu", "0");
    add_number(&c, d->new_extraction ? "FeatureExtraction.num_threads" : "SiftExtraction.num_threads",
               parallel_threads());
    const gbt_status status = child_run(c.arguments, log_path, hear_features, p, err);
    p->before += count;
    return status;
}

static gbt_status extract(const job *j, const colmap_options *d, gbt_error *err)
{
    char log_path[JOB_PATH_SIZE], model[CHOICE_TEXT_SIZE];
    GBT_TRY(job_path(j, "features.log", log_path, err));
    unlink(log_path);
    if (j->groups > JOB_GROUPS_MAX)
        log_info("features: %zu photos, %s, a camera for each", j->photo_count, model_name(j, 1, model));
    else if (j->groups == 1)
        log_info("features: %zu photos, %s, 1 camera by size and EXIF", j->photo_count,
                 model_name(j, j->photo_count, model));
    else
        log_info("features: %zu photos, %d cameras by size and EXIF", j->photo_count, j->groups);
    progress p = begin("features", j->photo_count);
    if (j->groups > JOB_GROUPS_MAX)
        GBT_TRY(extract_group(j, d, -1, &p, err));
    for (int group = 0; j->groups <= JOB_GROUPS_MAX && group < j->groups; group++)
        GBT_TRY(extract_group(j, d, group, &p, err));
    return job_set_done(j, "features", err);
}

/* ---- matching ---- */

static gbt_pose_matcher matcher_of(const job *j, size_t with_position)
{
    if (j->def.matcher != GBT_POSE_MATCHER_AUTO)
        return j->def.matcher;
    if (j->photo_count <= (j->is_film ? EXHAUSTIVE_FILM : EXHAUSTIVE_PHOTOS))
        return GBT_POSE_MATCHER_EXHAUSTIVE;
    return with_position == j->photo_count ? GBT_POSE_MATCHER_SPATIAL : GBT_POSE_MATCHER_SEQUENTIAL;
}

/* @param steps [in] number of steps that its progress will count, as far as known in advance */
static gbt_status run_matcher(const job *j, const colmap_options *d, command_line *c, uint64_t steps,
                              gbt_error *err)
{
    char log_path[JOB_PATH_SIZE];
    progress p = begin("matching", steps);
    GBT_TRY(job_path(j, "matching.log", log_path, err));
    add(c, d->new_matching ? "FeatureMatching.use_gpu" : "SiftMatching.use_gpu", "0");
    add_number(c, d->new_matching ? "FeatureMatching.num_threads" : "SiftMatching.num_threads",
               parallel_threads());
    return child_run(c->arguments, log_path, hear_matches, &p, err);
}

/* Match frames evenly spaced over the film exhaustively: sequential matching alone does not notice when the
   camera returns to a place. */
static gbt_status match_key_frames(const job *j, const colmap_options *d, gbt_error *err)
{
    char path[JOB_PATH_SIZE];
    sink list = {.err = err};
    GBT_TRY(job_path(j, "key_frames.txt", path, err));
    const size_t step = j->photo_count / KEY_FRAMES + 1;
    for (size_t a = 0; a < j->photo_count; a += step)
        for (size_t b = a + step; b < j->photo_count; b += step) {
            sink_put_text(&list, j->photos[a].name);
            sink_put_text(&list, " ");
            sink_put_text(&list, j->photos[b].name);
            sink_put_text(&list, "\n");
        }
    gbt_status status = list.status;
    if (status == GBT_OK)
        status = file_write_atomic(path, list.bytes, list.size, err);
    sink_free(&list);
    GBT_TRY(status);
    command_line c;
    begin_command(&c, j, "matches_importer");
    add(&c, "match_list_path", path);
    return run_matcher(j, d, &c, 1, err);
}

static gbt_status match(const job *j, const colmap_options *d, gbt_error *err)
{
    static const char *const verbs[] = {NULL, "exhaustive_matcher", "sequential_matcher", "spatial_matcher"};
    database *base;
    char log_path[JOB_PATH_SIZE];
    GBT_TRY(job_path(j, "matching.log", log_path, err));
    unlink(log_path);
    GBT_TRY(database_open(j->database, &base, err));
    size_t with_position;
    const gbt_status status = database_positions(base, &with_position, err);
    database_close(base);
    GBT_TRY(status);
    const gbt_pose_matcher matcher = matcher_of(j, with_position);
    if (matcher == GBT_POSE_MATCHER_SPATIAL && with_position == 0)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: no photo has a position from GPS in its EXIF (wanted for the spatial matcher)",
                         j->source);
    command_line c;
    begin_command(&c, j, verbs[matcher]);
    uint64_t steps = j->photo_count;
    if (matcher == GBT_POSE_MATCHER_EXHAUSTIVE) { /* small blocks show progress, and lose little work when
                                                     killed */
        const uint64_t blocks = (j->photo_count + BLOCK - 1) / BLOCK;
        add_number(&c, "ExhaustiveMatching.block_size", BLOCK);
        steps = blocks * blocks;
    }
    log_info("matching: %s", matcher == GBT_POSE_MATCHER_EXHAUSTIVE ? "every photo with every other"
                             : matcher == GBT_POSE_MATCHER_SEQUENTIAL
                                 ? "photos that follow each other"
                                 : "photos that GPS puts near each other");
    GBT_TRY(run_matcher(j, d, &c, steps, err));
    if (matcher == GBT_POSE_MATCHER_SEQUENTIAL && j->is_film)
        GBT_TRY(match_key_frames(j, d, err));
    return job_set_done(j, "matching", err);
}

/* ---- mapping ---- */

/* Whether COLMAP failed only because no two photos were suitable to start from; this is a result, not an
   error. */
static bool found_no_start(const gbt_error *why)
{
    return strstr(why->text, "sparse model") != NULL || strstr(why->text, "initial image pair") != NULL;
}

/* Remove the models of a killed run. */
static gbt_status remove_models(const job *j, gbt_error *err)
{
    unsigned long largest;
    for (unsigned long i = 0; file_largest_number(j->models, "", &largest) && i <= largest; i++) {
        char name[32], path[JOB_PATH_SIZE];
        snprintf(name, sizeof name, "%lu", i);
        GBT_TRY(file_join(path, sizeof path, j->models, name, err));
        job_remove_folder(path);
    }
    return GBT_OK;
}

static gbt_status map(const job *j, const colmap_options *d, gbt_error *err)
{
    char log_path[JOB_PATH_SIZE];
    gbt_error why = {0};
    GBT_TRY(job_path(j, "mapping.log", log_path, err));
    unlink(log_path);
    GBT_TRY(file_make_folder(j->models, err));
    GBT_TRY(remove_models(j, err));
    command_line c;
    begin_command(&c, j, "mapper");
    add(&c, "image_path", j->images);
    add(&c, "output_path", j->models);
    if (d->global_tolerance)
        add(&c, "Mapper.ba_global_function_tolerance", "0.000001"); /* the default, 0, never ends early */
    add_number(&c, "Mapper.num_threads", parallel_threads());
    progress p = begin("mapping", j->photo_count);
    gbt_status status = child_run(c.arguments, log_path, hear_mapping, &p, &why);
    if (status == GBT_ERR_IO && found_no_start(&why))
        status = GBT_OK;
    if (status != GBT_OK)
        return base_fail(err, status, "%s", why.text);
    return job_set_done(j, "mapping", err);
}

gbt_status colmap_stages(const job *j, const colmap_options *d, gbt_error *err)
{
    if (!job_is_done(j, "features"))
        GBT_TRY(extract(j, d, err));
    if (!job_is_done(j, "matching"))
        GBT_TRY(match(j, d, err));
    return job_is_done(j, "mapping") ? GBT_OK : map(j, d, err);
}
