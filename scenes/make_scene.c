/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/make_scene.c -- gbt_make_scene(): turns a recipe and a def into a folder of photos, cameras and
   sparse points. */
#include "gbtrace/make_scene.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/def.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/plain_numbers.h"
#include "base/rng.h"
#include "base/vec.h"
#include "scenes/photo.h"
#include "scenes/recipe.h"
#include "scenes/sparse.h"
#include "scenes/surface_gaussians.h"

static const recipe *const recipes[] = {&recipe_tabletop, &recipe_courtyard, &recipe_terrain,
                                        &recipe_district};

enum {
    RECIPE_COUNT = sizeof recipes / sizeof recipes[0],
    NAME_SIZE = 16,
    PATH_SIZE = 4096,
    STREAM_CAMERA = 1 << 24
};

gbt_make_scene_def gbt_make_scene_def_default(void)
{
    return (gbt_make_scene_def){.name = "tabletop",
                                .width = 320,
                                .height = 240,
                                .view_count = 64,
                                .points = 6000,
                                .point_noise = 0.001,
                                .samples = 16,
                                .seed = 1,
                                .cookie_ = DEF_COOKIE};
}

const char *const *gbt_make_scene_names(void)
{
    /* Must match `recipes`; tests compare the two through gbt_make_scene(). */
    static const char *const names[RECIPE_COUNT + 1] = {"tabletop", "courtyard", "terrain", "district", NULL};
    return names;
}

const char *gbt_make_scene_summary(const char *name)
{
    for (int i = 0; i < RECIPE_COUNT; i++)
        if (strcmp(name, recipes[i]->name) == 0)
            return recipes[i]->summary;
    return NULL;
}

static gbt_status find_recipe(const char *name, const recipe **out, gbt_error *err)
{
    char list[256] = "";
    for (int i = 0; i < RECIPE_COUNT; i++) {
        if (name != NULL && strcmp(name, recipes[i]->name) == 0) {
            *out = recipes[i];
            return GBT_OK;
        }
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i > 0 ? ", " : "", recipes[i]->name);
    }
    return base_fail(err, GBT_ERR_ARGUMENT, "make-scene: unknown scene (wanted one of %s; got %.100s)", list,
                     name != NULL ? name : "none");
}

static gbt_status check_range(const char *field, int value, int low, int high, gbt_error *err)
{
    if (value < low || value > high)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: %d (wanted %d to %d)", field, value, low, high);
    return GBT_OK;
}

typedef struct scene_lens {
    gbt_camera_model model;
    const char *option, *about;
} scene_lens;

static const scene_lens lenses[] = {
    [GBT_MAKE_SCENE_PINHOLE] = {GBT_CAMERA_PINHOLE, "", "PINHOLE"},
    [GBT_MAKE_SCENE_DISTORTED] = {GBT_CAMERA_OPENCV, " --lens distorted", "OPENCV with distortion"},
    [GBT_MAKE_SCENE_FISHEYE] = {GBT_CAMERA_FISHEYE, " --lens fisheye", "FISHEYE"},
    [GBT_MAKE_SCENE_PANORAMA] = {GBT_CAMERA_EQUIRECTANGULAR, " --lens panorama", "EQUIRECTANGULAR"},
    [GBT_MAKE_SCENE_ROLLING] = {GBT_CAMERA_PINHOLE, " --lens rolling", "PINHOLE with rolling shutters"},
};
enum { LENSES = sizeof lenses / sizeof *lenses };

static gbt_status check_def(const gbt_make_scene_def *def, gbt_error *err)
{
    GBT_TRY(check_range("width", def->width, 8, 8192, err));
    GBT_TRY(check_range("height", def->height, 8, 8192, err));
    GBT_TRY(check_range("view_count", def->view_count, 3, 9999, err));
    GBT_TRY(check_range("points", def->points, 1, 10000000, err));
    GBT_TRY(check_range("gaussians", def->gaussians, 0, 1000000000, err));
    GBT_TRY(check_range("samples", def->samples, 1, 1024, err));
    GBT_TRY(check_range("lens", (int)def->lens, 0, LENSES - 1, err));
    if (!(def->point_noise >= 0 && def->point_noise <= 0.1))
        return base_fail(err, GBT_ERR_ARGUMENT, "point_noise: %g (wanted 0 to 0.1)", def->point_noise);
    return GBT_OK;
}

static void set_lens(const recipe *r, const gbt_make_scene_def *def, gbt_camera *camera)
{
    const double width = def->width, height = def->height, focal = (double)r->focal_widths * width,
                 bent = fmin(width, height) / 3.14159265358979323846; /* 180 degrees */
    const double perspective[8] = {focal, focal, 0.5 * width, 0.5 * height, -0.10, 0.03, 0.0008, -0.0006},
                 fisheye[4] = {bent, bent, 0.5 * width, 0.5 * height}, panorama[2] = {width, height};
    camera->model = lenses[def->lens].model;
    switch (def->lens) {
    case GBT_MAKE_SCENE_PINHOLE:
    case GBT_MAKE_SCENE_ROLLING:
    case GBT_MAKE_SCENE_DISTORTED:
        memcpy(camera->params, perspective,
               (def->lens == GBT_MAKE_SCENE_DISTORTED ? 8 : 4) * sizeof *perspective);
        break;
    case GBT_MAKE_SCENE_FISHEYE:
        memcpy(camera->params, fisheye, sizeof fisheye);
        break;
    case GBT_MAKE_SCENE_PANORAMA:
        memcpy(camera->params, panorama, sizeof panorama);
        break;
    }
}

/* While the rows are read out one after the other, the camera moves by some hundredths of its distance from
   the target and turns by some degrees: like a hand-held phone that does not stop for the photo. */
static void roll(const gbt_make_scene_def *def, int view, double distance, gbt_camera *camera)
{
    static const double move = 0.02, turn = 0.02; /* std-dev: fraction of the distance; radians */
    camera->shutter = GBT_CAMERA_SHUTTER_ROWS;
    for (int k = 0; k < 6; k++)
        camera->motion[k] = (k < 3 ? move * distance : turn) *
                            rng_normal(def->seed, STREAM_CAMERA + 6 + (uint64_t)k, (uint64_t)view);
}

/** View number `view` of `def`: from one of the rings towards the target, with both positions jittered. */
static gbt_camera place_camera(const recipe *r, const gbt_make_scene_def *def, int view)
{
    gbt_camera camera = {.width = def->width, .height = def->height};
    set_lens(r, def, &camera);
    /* Rings alternate, and skip once in eight views, so that a split that holds out every eighth view takes
       from both. */
    const recipe_ring *ring = &r->rings[(view + view / 8) % 2];
    const double angle = 6.283185307179586 * view / def->view_count;
    double eye[3] = {(double)ring->radius * cos(angle), (double)ring->radius * sin(angle),
                     (double)ring->height},
           target[3], forward[3];
    for (int k = 0; k < 3; k++)
        target[k] = (double)r->target[k];
    if (r->place_camera != NULL)
        r->place_camera(view, def->view_count, eye, target);
    for (int k = 0; k < 3; k++) {
        eye[k] += (double)r->jitter * rng_normal(def->seed, STREAM_CAMERA + (uint64_t)k, (uint64_t)view);
        forward[k] =
            target[k] +
            (double)r->jitter * rng_normal(def->seed, STREAM_CAMERA + 3 + (uint64_t)k, (uint64_t)view) -
            eye[k];
    }
    const double up[3] = {0, 0, 1};
    double right[3], down[3];
    if (def->lens == GBT_MAKE_SCENE_ROLLING)
        roll(def, view, dvec_length(forward), &camera);
    dvec_normalize(forward);
    dvec_cross(forward, up, right);
    dvec_normalize(right);
    dvec_cross(forward, right, down);
    memcpy(camera.rotation, right, sizeof right);
    memcpy(camera.rotation + 3, down, sizeof down);
    memcpy(camera.rotation + 6, forward, sizeof forward);
    memcpy(camera.center, eye, sizeof eye);
    return camera;
}

typedef struct shoot {
    const world *w;
    const gbt_make_scene_def *def;
    const gbt_camera *cameras;
    const char *const *names;
    const char *folder;
    int side;
    sparse_seed *seeds; /* [view_count][per_view] */
    size_t per_view;
    gbt_status *status; /* [view_count] */
    gbt_error *errors;  /* [view_count] */
} shoot;

static gbt_status shoot_view(const shoot *job, size_t view, gbt_error *err)
{
    const gbt_make_scene_def *def = job->def;
    char path[PATH_SIZE], name[NAME_SIZE + 16];
    image photo, depth = {0};
    GBT_TRY(image_alloc(&photo, def->width, def->height, 3, err));
    photo_render(job->w, job->cameras + view, job->side, def->seed, view, &photo);
    snprintf(name, sizeof name, "images/%s", job->names[view]);
    gbt_status status = file_join(path, sizeof path, job->folder, name, err);
    if (status == GBT_OK)
        status = image_write(path, &photo, err);
    if (status == GBT_OK)
        sparse_choose(&photo, def->seed, view, job->per_view, job->seeds + view * job->per_view);
    if (status == GBT_OK && def->depth) {
        snprintf(name, sizeof name, "depth/%04zu.exr", view);
        status = file_join(path, sizeof path, job->folder, name, err);
        if (status == GBT_OK)
            status = image_alloc(&depth, def->width, def->height, 1, err);
        if (status == GBT_OK) {
            photo_depth(job->w, job->cameras + view, &depth);
            status = image_write(path, &depth, err);
        }
    }
    image_free(&photo);
    image_free(&depth);
    return status;
}

static void shoot_views(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const shoot *job = context;
    for (size_t view = begin; view < end; view++)
        job->status[view] = shoot_view(job, view, job->errors + view);
}

static gbt_status make_folder(const char *folder, const char *name, gbt_error *err)
{
    char path[PATH_SIZE];
    GBT_TRY(file_join(path, sizeof path, folder, name, err));
    return file_make_folder(path, err);
}

static gbt_status write_about(const recipe *r, const gbt_make_scene_def *def, const char *folder,
                              gbt_error *err)
{
    char path[PATH_SIZE], text[4096], gaussians[32] = "";
    const bool rolls = def->lens == GBT_MAKE_SCENE_ROLLING;
    if (def->gaussians > 0)
        snprintf(gaussians, sizeof gaussians, " --gaussians %d", def->gaussians);
    GBT_TRY(file_join(path, sizeof path, folder, "SCENE.md", err));
    const int length = snprintf(
        text, sizeof text,
        "# %s\n\n%s\n\n"
        "Made by gbtrace; everything here is computed, nothing was photographed. The command that "
        "makes it again, bit for bit on the same kind of machine:\n\n"
        "    gbtrace make-scene %s -o DIR --width %d --height %d --views %d --points %d "
        "--point-noise %.9g --samples %d --seed %" PRIu64 "%s%s%s\n\n"
        "- `images/`: %d photos of %d x %d pixels, 8 bits per channel.\n"
        "- `%s`: cameras (%s, exact poses) and at most %d points%s. "
        "A point lies on a surface that at least\n"
        "  three views see, with noise of %.9g of its distance per axis; observations have 0.3 "
        "pixels of noise; 1 point in 100 is an outlier.\n"
        "%s",
        r->name, r->about, r->name, def->width, def->height, def->view_count, def->points, def->point_noise,
        def->samples, def->seed, def->depth ? " --depth" : "", lenses[def->lens].option, gaussians,
        def->view_count, def->width, def->height, rolls ? "transforms.json`, `points.ply" : "sparse/0/",
        lenses[def->lens].about, def->points, rolls ? "" : " in COLMAP's binary format", def->point_noise,
        def->depth ? "- `depth/`: float EXR, distance along the ray through each pixel's centre to "
                     "the first surface, scene units; 0 where there is none.\n"
                   : "");
    return file_write_atomic(path, text, (size_t)length, err);
}

static gbt_status write_scene(const world *w, const recipe *r, const gbt_make_scene_def *def,
                              const char *folder, gbt_error *err)
{
    gbt_status status = GBT_ERR_NO_MEMORY;
    const size_t views = (size_t)def->view_count;
    /* Up to five candidates per wanted point: where views hardly overlap, most candidates are seen by too few
       views. */
    const size_t per_view = ((size_t)def->points * 5 + views - 1) / views + 4;
    gbt_camera *cameras = mem_alloc(views, sizeof *cameras, "cameras", err);
    char(*names)[NAME_SIZE] = mem_alloc(views, sizeof *names, "view names", err);
    const char **name_list = mem_alloc(views, sizeof *name_list, "view names", err);
    shoot job = {
        .w = w, .def = def, .cameras = cameras, .names = name_list, .folder = folder, .per_view = per_view};
    while (job.side * job.side < def->samples)
        job.side++;
    job.seeds = mem_calloc(views * per_view, sizeof *job.seeds, "sparse candidates", err);
    job.status = mem_calloc(views, sizeof *job.status, "view status", err);
    job.errors = mem_calloc(views, sizeof *job.errors, "view status", err);
    if (cameras == NULL || names == NULL || name_list == NULL || job.seeds == NULL || job.status == NULL ||
        job.errors == NULL)
        goto done;
    for (size_t v = 0; v < views; v++) {
        cameras[v] = place_camera(r, def, (int)v);
        snprintf(names[v], sizeof names[v], "%04u.png", (unsigned)v);
        name_list[v] = names[v];
    }
    parallel_blocks(views, 1, shoot_views, &job);
    status = GBT_OK;
    for (size_t v = 0; v < views && status == GBT_OK; v++)
        if (job.status[v] != GBT_OK)
            status = base_fail(err, job.status[v], "%s", job.errors[v].text);
    if (status == GBT_OK)
        status = sparse_write(&(sparse_def){.w = w,
                                            .cameras = cameras,
                                            .names = name_list,
                                            .view_count = views,
                                            .seeds = job.seeds,
                                            .per_view = per_view,
                                            .wanted = (size_t)def->points,
                                            .point_noise = def->point_noise,
                                            .view_distance = r->view_distance,
                                            .seed = def->seed},
                              folder, err);
    if (status == GBT_OK && def->gaussians > 0) {
        char path[PATH_SIZE];
        status = file_join(path, sizeof path, folder, "gaussians.ply", err);
        if (status == GBT_OK)
            status = surface_gaussians_write(w, path, (size_t)def->gaussians, def->seed, err);
    }
done:
    mem_free(cameras);
    mem_free(names);
    mem_free(name_list);
    mem_free(job.seeds);
    mem_free(job.status);
    mem_free(job.errors);
    return status;
}

/* A folder must not have both kinds of camera files: readers prefer COLMAP's, which cannot describe a rolling
   shutter. */
static gbt_status check_other_cameras(const gbt_make_scene_def *def, const char *folder, gbt_error *err)
{
    char path[PATH_SIZE];
    GBT_TRY(file_join(path, sizeof path, folder, "sparse", err));
    return def->lens != GBT_MAKE_SCENE_ROLLING || !file_exists(path)
               ? GBT_OK
               : base_fail(err, GBT_ERR_ARGUMENT,
                           "%s: exists, and a COLMAP model cannot describe a rolling shutter (wanted another "
                           "folder)",
                           path);
}

/* A data set of others has files of the same names. */
static gbt_status check_foreign(const char *folder, gbt_error *err)
{
    static const char *const names[] = {"images", "sparse", "transforms.json"};
    char path[PATH_SIZE];
    GBT_TRY(file_join(path, sizeof path, folder, "SCENE.md", err));
    if (file_exists(path))
        return GBT_OK;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        GBT_TRY(file_join(path, sizeof path, folder, names[i], err));
        if (file_exists(path))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "%s: exists, but not from a scene that was made here (wanted another folder)",
                             path);
    }
    return GBT_OK;
}

gbt_status gbt_make_scene(const gbt_make_scene_def *def, const char *folder, gbt_error *err)
{
    PLAIN_NUMBERS;
    const recipe *r = NULL;
    if (def == NULL || folder == NULL)
        return base_fail(err, GBT_ERR_ARGUMENT, "make-scene: no %s given",
                         def == NULL ? "settings" : "folder");
    GBT_TRY(def_check(def->cookie_, "gbt_make_scene_def_default", err));
    GBT_TRY(find_recipe(def->name, &r, err));
    GBT_TRY(check_def(def, err));
    GBT_TRY(check_foreign(folder, err));
    GBT_TRY(check_other_cameras(def, folder, err));
    /* Before any work: an unwritable folder should fail at once. */
    GBT_TRY(make_folder(folder, "images", err));
    if (def->depth)
        GBT_TRY(make_folder(folder, "depth", err));
    GBT_TRY(write_about(r, def, folder, err)); /* written first, so that even an incomplete folder says where
                                                  it comes from */
    world w = {.err = err};
    r->build(&w);
    /* Fewer samples also reduce the number of rays for the indirect light; the default number of samples gets
       all of them. */
    const int share = def->samples < 16 ? def->samples : 16;
    gbt_status status = world_finish(&w, (r->bake_rays * share + 15) / 16);
    if (status == GBT_OK)
        status = write_scene(&w, r, def, folder, err);
    world_free(&w);
    return status;
}
