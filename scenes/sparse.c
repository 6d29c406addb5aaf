/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/sparse.c -- chosen pixels -> surface points -> tracks -> files of cameras and sparse points. */
#include "scenes/sparse.h"

#include <math.h>
#include <string.h>

#include "base/camera_pose.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"
#include "data/colmap_write.h"
#include "data/ply.h"
#include "data/transforms_write.h"
#include "scenes/photo.h"

/* Streams of random numbers; photos use 1 to 10000 (photo.c), cameras 2^24 and after (make_scene.c). */
enum { STREAM_CHOICE = 1 << 20, STREAM_TRACK = 1 << 21, STREAM_NOISE = 1 << 22, STREAM_OUTLIER = 1 << 23 };

enum { MIN_TRACK = 3, OUTLIER_EVERY = 100, ROUND = 16384 /* candidates processed together */ };

static const double observation_noise_px = 0.3;
static const float least_cosine = 0.15f; /* surfaces seen at a flatter angle give no features */
static const double keep_share = 0.6;    /* fraction of the views of a point in which the detector finds it */

void sparse_choose(const image *photo, uint64_t seed, uint64_t view, size_t wanted, sparse_seed *out)
{
    /* Of three random positions take the one where the picture changes most; blank walls still get some. */
    for (size_t i = 0; i < wanted; i++) {
        float best = -1;
        for (uint64_t attempt = 0; attempt < 3; attempt++) {
            uint32_t words[4];
            rng_philox(seed, STREAM_CHOICE + view, 3 * i + attempt, words);
            const float px = (float)((double)words[0] * 0x1p-32 * photo->width),
                        py = (float)((double)words[1] * 0x1p-32 * photo->height);
            const int x = (int)px < photo->width - 1 ? (int)px : photo->width - 1,
                      y = (int)py < photo->height - 1 ? (int)py : photo->height - 1;
            float change = 0;
            const int x0 = x > 0 ? x - 1 : x, x1 = x + 1 < photo->width ? x + 1 : x, y0 = y > 0 ? y - 1 : y,
                      y1 = y + 1 < photo->height ? y + 1 : y;
            for (int c = 0; c < 3; c++) {
                const float *p = photo->pixels + c;
                const size_t stride = (size_t)photo->width;
                change += fabsf(p[3 * ((size_t)y * stride + (size_t)x1)] -
                                p[3 * ((size_t)y * stride + (size_t)x0)]) +
                          fabsf(p[3 * ((size_t)y1 * stride + (size_t)x)] -
                                p[3 * ((size_t)y0 * stride + (size_t)x)]);
            }
            if (change > best) {
                best = change;
                out[i] = (sparse_seed){px, py};
            }
        }
    }
}

/** One candidate and the views that observe it. */
typedef struct track {
    double point[3];
    float dir[3]; /* of the ray from its first view, unit */
    unsigned char color[3];
    uint32_t count; /* number of these views; 0: no usable track */
} track;

typedef struct search {
    const sparse_def *def;
    size_t first;        /* index of the first candidate of this round */
    track *tracks;       /* [ROUND] of this round, as all that follows */
    unsigned char *seen; /* [ROUND][view_count]: 1 where the view observes the candidate */
} search;

/** Does a view see this surface point: inside the picture, not hidden, and not at too flat an angle? */
static bool sees(const search *q, size_t view, const double point[3], const float normal[3])
{
    const gbt_camera *camera = q->def->cameras + view;
    double to_point[3], pixel[2];
    for (int k = 0; k < 3; k++)
        to_point[k] = point[k] - camera->center[k];
    if (q->def->view_distance > 0 && dvec_length(to_point) > (double)q->def->view_distance)
        return false;
    if (!gbt_camera_pixel(camera, point, pixel))
        return false;
    if (!(pixel[0] >= 0 && pixel[0] < camera->width && pixel[1] >= 0 && pixel[1] < camera->height))
        return false;
    const gbt_camera at = gbt_camera_at(camera, pixel[0], pixel[1]);
    for (int k = 0; k < 3; k++)
        to_point[k] = point[k] - at.center[k];
    const double distance = dvec_length(to_point);
    float origin[3], dir[3];
    for (int k = 0; k < 3; k++) {
        origin[k] = (float)at.center[k];
        dir[k] = (float)(to_point[k] / distance);
    }
    if (-(dir[0] * normal[0] + dir[1] * normal[1] + dir[2] * normal[2]) < least_cosine)
        return false;
    return !mesh_tree_blocked(q->def->w->tree, origin, dir,
                              (float)(distance * (1 - 1e-4)) - q->def->w->epsilon);
}

static void find_tracks(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const search *q = context;
    for (size_t i = q->first + begin; i < q->first + end; i++) {
        /* Candidates alternate between the views, so that any prefix of the list covers all of them. */
        const size_t view = i % q->def->view_count;
        const sparse_seed *at = q->def->seeds + view * q->def->per_view + i / q->def->view_count;
        track *t = q->tracks + (i - q->first);
        unsigned char *seen = q->seen + (i - q->first) * q->def->view_count;
        memset(t, 0, sizeof *t);
        memset(seen, 0, q->def->view_count);
        float origin[3], rgb[3];
        surface s;
        if (!photo_ray(q->def->cameras + view, (double)at->px, (double)at->py, origin, t->dir) ||
            !world_trace(q->def->w, origin, t->dir, &s))
            continue;
        static const float lamp_center[2] = {0, 0};
        world_shade(q->def->w, &s, t->dir, lamp_center, rgb);
        for (int k = 0; k < 3; k++) {
            t->point[k] = (double)origin[k] + (double)s.distance * (double)t->dir[k];
            t->color[k] = (unsigned char)(255 * (rgb[k] > 1 ? 1 : rgb[k]) + 0.5f);
        }
        uint32_t count = 0;
        for (size_t v = 0; v < q->def->view_count; v++) {
            if (v != view && (double)rng_uniform(q->def->seed, STREAM_TRACK + v, i) >= keep_share)
                continue;
            if (sees(q, v, t->point, s.geometric)) {
                seen[v] = 1;
                count++;
            }
        }
        t->count = count >= MIN_TRACK && seen[view] != 0 ? count : 0;
    }
}

/** Where a view observed the point: its projection plus the detector's noise. */
static void observe(const search *q, size_t candidate, size_t view, double pixel[2])
{
    gbt_camera_pixel(q->def->cameras + view, q->tracks[candidate - q->first].point, pixel);
    for (int k = 0; k < 2; k++)
        pixel[k] +=
            observation_noise_px * rng_normal(q->def->seed, STREAM_NOISE + 2 * view + (uint64_t)k, candidate);
}

/** The position that is written: the true one plus noise, or an outlier. */
static void disturb(const search *q, size_t candidate, size_t number, double out[3])
{
    const track *t = q->tracks + (candidate - q->first);
    const unsigned char *seen = q->seen + (candidate - q->first) * q->def->view_count;
    double nearest = INFINITY;
    for (size_t v = 0; v < q->def->view_count; v++) {
        double to_point[3];
        for (int k = 0; k < 3; k++)
            to_point[k] = t->point[k] - q->def->cameras[v].center[k];
        if (seen[v] != 0)
            nearest = fmin(nearest, dvec_length(to_point));
    }
    for (int k = 0; k < 3; k++)
        out[k] = t->point[k] + q->def->point_noise * nearest *
                                   rng_normal(q->def->seed, STREAM_OUTLIER + 1 + (uint64_t)k, candidate);
    if (number % OUTLIER_EVERY != OUTLIER_EVERY - 1)
        return;
    const double part = 0.1 + 0.3 * (double)rng_uniform(q->def->seed, STREAM_OUTLIER, candidate);
    const double shift = (number / OUTLIER_EVERY % 2 == 0 ? -part : part) * nearest;
    for (int k = 0; k < 3; k++)
        out[k] += shift * (double)t->dir[k];
}

/** Mean distance, pixels, between the observations of a point and the projections of its written position. */
static double reprojection_error(const search *q, size_t candidate, const double position[3])
{
    double sum = 0;
    int count = 0;
    for (size_t v = 0; v < q->def->view_count; v++) {
        double projected[2], observed[2];
        if (q->seen[(candidate - q->first) * q->def->view_count + v] == 0)
            continue;
        if (!gbt_camera_pixel(q->def->cameras + v, position, projected))
            continue;
        observe(q, candidate, v, observed);
        sum += dvec_length2(projected[0] - observed[0], projected[1] - observed[1]);
        count++;
    }
    return count > 0 ? sum / count : 0;
}

typedef struct cloud {
    colmap_point *points;              /* [capacity] */
    uint32_t (*track)[2];              /* all tracks, one after the other */
    colmap_observation **observations; /* [view_count] */
    size_t *observation_count, *observation_capacity;
    colmap_image *images;
    size_t point_count, point_capacity, track_count, track_capacity;
} cloud;

static void cloud_free(cloud *c, size_t view_count)
{
    for (size_t v = 0; v < view_count && c->observations != NULL; v++)
        mem_free(c->observations[v]);
    mem_free(c->observations);
    mem_free(c->observation_count);
    mem_free(c->observation_capacity);
    mem_free(c->points);
    mem_free(c->track);
    mem_free(c->images);
    memset(c, 0, sizeof *c);
}

/* Add the points of this round, up to def->wanted in total. */
static gbt_status collect(const search *q, size_t count, cloud *c, gbt_error *err)
{
    for (size_t i = q->first; i < q->first + count && c->point_count < q->def->wanted; i++) {
        const track *t = q->tracks + (i - q->first);
        if (t->count == 0)
            continue;
        GBT_TRY(mem_reserve((void **)&c->points, &c->point_capacity, c->point_count, c->point_count + 1,
                            sizeof *c->points, "sparse points", err));
        GBT_TRY(mem_reserve((void **)&c->track, &c->track_capacity, c->track_count, c->track_count + t->count,
                            sizeof *c->track, "sparse tracks", err));
        colmap_point *p = c->points + c->point_count;
        *p = (colmap_point){.track_count = t->count};
        memcpy(p->color, t->color, sizeof p->color);
        disturb(q, i, c->point_count, p->position);
        p->error = reprojection_error(q, i, p->position);
        for (size_t v = 0; v < q->def->view_count; v++) {
            if (q->seen[(i - q->first) * q->def->view_count + v] == 0)
                continue;
            GBT_TRY(mem_reserve((void **)&c->observations[v], &c->observation_capacity[v],
                                c->observation_count[v], c->observation_count[v] + 1,
                                sizeof *c->observations[v], "sparse observations", err));
            colmap_observation *o = c->observations[v] + c->observation_count[v];
            double pixel[2];
            observe(q, i, v, pixel);
            *o = (colmap_observation){pixel[0], pixel[1], c->point_count};
            c->track[c->track_count][0] = (uint32_t)v;
            c->track[c->track_count][1] = (uint32_t)c->observation_count[v];
            c->observation_count[v]++;
            c->track_count++;
        }
        c->point_count++;
    }
    return GBT_OK;
}

/* Set the points' pointers to their tracks; only now, because the array of tracks moves while it grows. */
static void refer_to_tracks(cloud *c)
{
    for (size_t i = 0, next = 0; i < c->point_count; i++) {
        c->points[i].track = &c->track[next][0];
        next += c->points[i].track_count;
    }
}

static gbt_status write_colmap(cloud *c, const sparse_def *def, const char *folder, gbt_error *err)
{
    char path[4096];
    refer_to_tracks(c);
    for (size_t v = 0; v < def->view_count; v++)
        c->images[v] =
            (colmap_image){def->names[v], def->cameras[v], c->observation_count[v], c->observations[v]};
    GBT_TRY(file_join(path, sizeof path, folder, "sparse/0", err));
    GBT_TRY(file_make_folder(path, err));
    return colmap_write(path, c->images, def->view_count, c->points, c->point_count, err);
}

/* Write cameras with a rolling shutter, which a COLMAP model cannot describe. */
static gbt_status write_transforms(const cloud *c, const sparse_def *def, const char *folder, gbt_error *err)
{
    char path[4096];
    float *position = mem_alloc(c->point_count, 3 * sizeof *position, "sparse points", err),
          *color = mem_alloc(c->point_count, 3 * sizeof *color, "sparse points", err);
    gbt_status status = position == NULL || color == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    for (size_t i = 0; i < c->point_count && status == GBT_OK; i++)
        for (size_t k = 0; k < 3; k++) {
            position[3 * i + k] = (float)c->points[i].position[k];
            color[3 * i + k] = (float)c->points[i].color[k] / 255;
        }
    if (status == GBT_OK)
        status = file_join(path, sizeof path, folder, "points.ply", err);
    if (status == GBT_OK)
        status = ply_write(
            path, &(ply_cloud){.vertex_count = c->point_count, .position = position, .color = color}, err);
    mem_free(position);
    mem_free(color);
    GBT_TRY(status);
    GBT_TRY(file_join(path, sizeof path, folder, "transforms.json", err));
    return transforms_write(path, def->names, def->cameras, def->view_count, "points.ply", err);
}

gbt_status sparse_write(const sparse_def *def, const char *folder, gbt_error *err)
{
    gbt_status status = GBT_ERR_NO_MEMORY;
    cloud c = {0};
    search q = {.def = def};
    const size_t view_count = def->view_count, candidate_count = view_count * def->per_view;
    q.tracks = mem_alloc(ROUND, sizeof *q.tracks, "sparse candidates", err);
    q.seen = mem_alloc(ROUND, view_count, "sparse visibility", err);
    c.observations = mem_calloc(view_count, sizeof *c.observations, "sparse observations", err);
    c.observation_count = mem_calloc(view_count, sizeof *c.observation_count, "sparse observations", err);
    c.observation_capacity =
        mem_calloc(view_count, sizeof *c.observation_capacity, "sparse observations", err);
    c.images = mem_calloc(view_count, sizeof *c.images, "sparse images", err);
    if (q.tracks == NULL || q.seen == NULL || c.observations == NULL || c.observation_count == NULL ||
        c.observation_capacity == NULL || c.images == NULL)
        goto done;
    status = GBT_OK;
    while (status == GBT_OK && c.point_count < def->wanted && q.first < candidate_count) {
        const size_t left = candidate_count - q.first, round = left < ROUND ? left : ROUND;
        parallel_blocks(round, 64, find_tracks, &q);
        status = collect(&q, round, &c, err);
        q.first += round;
    }
    if (status != GBT_OK)
        goto done;
    status = camera_is_still(&def->cameras[0]) ? write_colmap(&c, def, folder, err)
                                               : write_transforms(&c, def, folder, err);
done:
    cloud_free(&c, view_count);
    mem_free(q.tracks);
    mem_free(q.seen);
    return status;
}
