/* SPDX-License-Identifier: Apache-2.0 */
/* train/seed_points.c -- sparse points by plane sweep: for a pixel, the depth at which its neighbourhood
   matches the neighbouring photos. */
#include "train/seed_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/camera_axes.h"
#include "base/camera_lens.h"
#include "base/camera_pose.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/paged.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"

enum {
    SAMPLES = 40000, /* pixels that are swept through depths */
    TRIED = 2000,    /* number of them used in the trial of each distance */
    KEPT = 20000,
    KEPT_AT_LEAST = 1000, /* minimum number, even of doubtful points: better than no start */
    NEIGHBORS = 4,
    DEPTHS = 96,
    PATCH = 5, /* pixels, odd */
    PATCH_AREA = PATCH * PATCH,
    BLOCK = 64
};

/* Normalised correlation that counts as a match, and the margin by which it must exceed that of every
   non-adjacent depth. */
static const float agreement = 0.7f, lead = 0.05f;

typedef struct candidate {
    float position[3], color[3];
    float doubt; /* 1 - correlation, increased when other depths match as well; INFINITY: no point */
    float depth;
    uint32_t index;
} candidate;

typedef struct seed_view {
    gbt_camera camera;
    camera_lens lens;
    image photo;
    float *gray; /* [height * width]; NaN where a pixel is invalid */
    size_t neighbor[NEIGHBORS];
    size_t neighbor_count;
} seed_view;

typedef struct seeding {
    seed_view *views;
    size_t view_count;
    double near, far; /* depths along the optical axis */
    uint64_t seed;
    candidate *out;
} seeding;

/* The scene's scale: the mean distance of the cameras from the point where their axes meet. False when they
   do not meet; then the mean distance from the middle of the cameras. */
static bool find_scale(const seed_view *views, size_t count, double *distance)
{
    gbt_camera cameras[SEED_VIEWS_MOST] = {{0}};
    double middle[3] = {0}, focus[3], sum = 0;
    for (size_t i = 0; i < count; i++) {
        cameras[i] = views[i].camera;
        for (int k = 0; k < 3; k++)
            middle[k] += cameras[i].center[k] / (double)count;
    }
    const bool meet = camera_axes_meet(cameras, count, middle, focus);
    const double *to = meet ? focus : middle;
    for (size_t i = 0; i < count; i++) {
        const double *at = cameras[i].center;
        sum += dvec_length((const double[3]){to[0] - at[0], to[1] - at[1], to[2] - at[2]});
    }
    *distance = sum > 0 ? sum / (double)count : 1;
    return meet;
}

/* For each photo, photos taken about a fifth of the scene distance away in a similar direction: near enough
   to look alike, with a baseline long enough to resolve depth. */
static void find_neighbors(seeding *s, double distance)
{
    for (size_t i = 0; i < s->view_count; i++) {
        seed_view *v = &s->views[i];
        double worst[NEIGHBORS];
        v->neighbor_count = 0;
        for (size_t j = 0; j < s->view_count; j++) {
            const gbt_camera *a = &v->camera, *b = &s->views[j].camera;
            if (j == i || dvec_dot(a->rotation + 6, b->rotation + 6) < 0.7)
                continue;
            const double d[3] = {b->center[0] - a->center[0], b->center[1] - a->center[1],
                                 b->center[2] - a->center[2]};
            const double baseline = dvec_length(d) / distance;
            if (baseline < 0.01)
                continue;
            const double cost = fabs(log(baseline / 0.2));
            size_t at = v->neighbor_count < NEIGHBORS ? v->neighbor_count++ : NEIGHBORS;
            while (at > 0 && cost < worst[at - 1]) { /* insertion sort; what falls off the end is dropped */
                if (at < NEIGHBORS) {
                    worst[at] = worst[at - 1];
                    v->neighbor[at] = v->neighbor[at - 1];
                }
                at--;
            }
            if (at < NEIGHBORS) {
                worst[at] = cost;
                v->neighbor[at] = j;
            }
        }
    }
}

static bool project(const seed_view *v, const double world[3], double pixel[2])
{
    double ahead = 0;
    for (int k = 0; k < 3; k++)
        ahead += v->camera.rotation[6 + k] * (world[k] - v->camera.center[k]);
    return ahead > 0 && camera_pixel(&v->camera, &v->lens, world, pixel);
}

/* Bilinear grey values on a grid of PATCH x PATCH points around `center` with steps `du`, `dv`; false when a
   corner is outside the photo, or an invalid pixel is involved. */
static bool read_patch(const seed_view *v, const double center[2], const double du[2], const double dv[2],
                       float out[PATCH_AREA])
{
    const double half = PATCH / 2;
    const int width = v->photo.width, height = v->photo.height;
    const double reach_x = half * (fabs(du[0]) + fabs(dv[0])), reach_y = half * (fabs(du[1]) + fabs(dv[1]));
    if (!(center[0] - reach_x >= 0.5 && center[0] + reach_x < width - 0.5 && center[1] - reach_y >= 0.5 &&
          center[1] + reach_y < height - 0.5))
        return false;
    for (int j = 0; j < PATCH; j++)
        for (int i = 0; i < PATCH; i++) {
            const double x = center[0] - 0.5 + (i - half) * du[0] + (j - half) * dv[0];
            const double y = center[1] - 0.5 + (i - half) * du[1] + (j - half) * dv[1];
            const int x0 = (int)x, y0 = (int)y, x1 = x0 + 1 < width ? x0 + 1 : x0,
                      y1 = y0 + 1 < height ? y0 + 1 : y0;
            const float fx = (float)(x - x0), fy = (float)(y - y0);
            const float *row0 = v->gray + (size_t)y0 * (size_t)width,
                        *row1 = v->gray + (size_t)y1 * (size_t)width;
            out[j * PATCH + i] =
                (1 - fy) * ((1 - fx) * row0[x0] + fx * row0[x1]) + fy * ((1 - fx) * row1[x0] + fx * row1[x1]);
        }
    for (int i = 0; i < PATCH_AREA; i++)
        if (!isfinite(out[i]))
            return false;
    return true;
}

/* Subtract the mean and divide by the length; a flat patch becomes nearly 0, so it correlates with
   nothing. */
static void normalize_patch(float p[PATCH_AREA])
{
    float mean = 0, square = 0;
    for (int i = 0; i < PATCH_AREA; i++)
        mean += p[i] / PATCH_AREA;
    for (int i = 0; i < PATCH_AREA; i++) {
        p[i] -= mean;
        square += p[i] * p[i];
    }
    const float scale = 1 / sqrtf(square + PATCH_AREA * 1e-4f); /* assumes noise of 0.01 */
    for (int i = 0; i < PATCH_AREA; i++)
        p[i] *= scale;
}

typedef struct sweep {
    const seeding *s;
    const seed_view *view;
    double start[3];  /* position of the camera when the pixel was exposed */
    double ray[3][3]; /* world directions with depth 1 through the pixel, the one to its right, and the one
                         below */
    float patch[PATCH_AREA];
} sweep;

/* Mean of the better half of the correlations: in the other photos the point may be occluded. -1 when too few
   photos see the point. */
static float agreement_at(const sweep *w, double depth)
{
    float best[NEIGHBORS];
    size_t seen = 0;
    double world[3][3];
    for (int p = 0; p < 3; p++)
        for (int k = 0; k < 3; k++)
            world[p][k] = w->start[k] + depth * w->ray[p][k];
    for (size_t n = 0; n < w->view->neighbor_count; n++) {
        const seed_view *other = &w->s->views[w->view->neighbor[n]];
        double pixel[3][2], step[2][2];
        float patch[PATCH_AREA], sum = 0;
        if (!project(other, world[0], pixel[0]) || !project(other, world[1], pixel[1]) ||
            !project(other, world[2], pixel[2]))
            continue;
        for (int k = 0; k < 2; k++) {
            step[0][k] = pixel[1][k] - pixel[0][k];
            step[1][k] = pixel[2][k] - pixel[0][k];
        }
        if (!read_patch(other, pixel[0], step[0], step[1], patch))
            continue;
        normalize_patch(patch);
        for (int i = 0; i < PATCH_AREA; i++)
            sum += patch[i] * w->patch[i];
        size_t at = seen++;
        for (; at > 0 && sum > best[at - 1]; at--)
            best[at] = best[at - 1];
        best[at] = sum;
    }
    if (seen < 2)
        return -1;
    const size_t half = (seen + 1) / 2;
    float mean = 0;
    for (size_t i = 0; i < half; i++)
        mean += best[i] / (float)half;
    return mean;
}

static bool start_sweep(const seeding *s, const seed_view *v, double px, double py, sweep *w)
{
    static const double step[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    w->s = s;
    w->view = v;
    const gbt_camera at = gbt_camera_at(&v->camera, px, py);
    memcpy(w->start, at.center, sizeof w->start);
    for (int p = 0; p < 3; p++) {
        double dir[3];
        if (!camera_lens_unproject(&v->lens, px + step[p][0], py + step[p][1], dir) || dir[2] < 0.1)
            return false;
        const double plane[3] = {dir[0] / dir[2], dir[1] / dir[2], 1};
        dmat_apply_transposed(at.rotation, plane, w->ray[p]);
    }
    if (!read_patch(v, (double[2]){px, py}, step[1], step[2], w->patch))
        return false;
    normalize_patch(w->patch);
    return true;
}

static double depth_of(const seeding *s, double index)
{
    const double u = index / (DEPTHS - 1);
    return 1 / ((1 - u) / s->near + u / s->far); /* uniform in inverse depth, so that steps along the epipolar
                                                    lines of other photos are nearly even */
}

static void find_depth(const sweep *w, candidate *c)
{
    float score[DEPTHS], rival = -1;
    int best = 0;
    for (int i = 0; i < DEPTHS; i++) {
        score[i] = agreement_at(w, depth_of(w->s, i));
        best = score[i] > score[best] ? i : best;
    }
    if (score[best] <= 0)
        return;
    for (int i = 0; i < DEPTHS; i++)
        if (abs(i - best) > 2)
            rival = fmaxf(rival, score[i]);
    double index = best;
    if (best > 0 && best + 1 < DEPTHS && score[best - 1] > -1 &&
        score[best + 1] > -1) { /* refine to the maximum of the parabola through three samples */
        const double left = (double)score[best - 1], right = (double)score[best + 1],
                     bend = left + right - 2 * (double)score[best];
        index += bend < 0 ? 0.5 * (left - right) / bend : 0;
    }
    const double depth = depth_of(w->s, index);
    for (int k = 0; k < 3; k++)
        c->position[k] = (float)(w->start[k] + depth * w->ray[0][k]);
    c->depth = (float)depth;
    c->doubt = 1 - score[best] + (rival > score[best] - lead ? 1.0f : 0.0f);
}

static void seed_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const seeding *s = context;
    for (size_t i = begin; i < end; i++) {
        candidate *c = &s->out[i];
        c->index = (uint32_t)i;
        c->doubt = INFINITY;
        uint32_t words[4];
        rng_philox(s->seed, RNG_STREAM_SEED_POINTS, i, words);
        const seed_view *v = &s->views[((uint64_t)words[0] * s->view_count) >> 32];
        const size_t x = (size_t)(((uint64_t)words[1] * (uint64_t)v->photo.width) >> 32),
                     y = (size_t)(((uint64_t)words[2] * (uint64_t)v->photo.height) >> 32);
        memcpy(c->color, v->photo.pixels + 3 * (y * (size_t)v->photo.width + x), sizeof c->color);
        sweep w;
        if (start_sweep(s, v, (double)x + 0.5, (double)y + 0.5, &w))
            find_depth(&w, c);
    }
}

static void sweep_pixels(seeding *s, size_t count, double distance)
{
    s->near = 0.2 * distance;
    s->far = 6 * distance;
    find_neighbors(s, distance);
    parallel_blocks(count, BLOCK, seed_block, s);
}

/* The scene's distance when the camera axes do not determine it: of distances from 1/64 to 64 times `scale`,
   take the one around which most pixels find a depth, then the median of these depths. A best match at either
   end of the depth range does not count, because the true depth is beyond it. */
static double try_distances(seeding *s, double scale)
{
    float depth[TRIED];
    double distance = scale;
    size_t most = 0;
    for (int power = -6; power <= 6; power += 2) {
        size_t count = 0;
        sweep_pixels(s, TRIED, ldexp(scale, power));
        for (size_t i = 0; i < TRIED; i++) {
            const candidate *c = &s->out[i];
            if (c->doubt <= 1 - agreement && (double)c->depth > 1.005 * s->near &&
                (double)c->depth < 0.8 * s->far)
                depth[count++] = c->depth;
        }
        if (count <= most)
            continue;
        most = count;
        qsort(depth, count, sizeof *depth, compare_floats);
        distance = (double)depth[count / 2];
    }
    if (most < TRIED / 100)
        log_warn("the photos look in parallel or outwards, and few of their places match: the distance of "
                 "the scene is unknown (sparse points would tell it)");
    return distance;
}

static int by_doubt(const void *a, const void *b)
{
    const candidate *x = a, *y = b;
    if (x->doubt != y->doubt)
        return x->doubt < y->doubt ? -1 : 1;
    return x->index < y->index ? -1 : x->index > y->index;
}

static gbt_status read_views(seeding *s, photos *source, const size_t *views, size_t count, gbt_error *err)
{
    for (size_t i = 0; i < s->view_count; i++) {
        seed_view *v = &s->views[i];
        const size_t view = views[i * count / s->view_count];
        int level = 0;
        v->camera = photos_camera(source, view, 0);
        while (v->camera.width > SEED_LONG_SIDE || v->camera.height > SEED_LONG_SIDE)
            v->camera = photos_camera(source, view, ++level);
        if (!camera_lens_prepare(&v->camera, &v->lens))
            return base_fail(err, GBT_ERR_ARGUMENT, "%s: unusable camera parameters",
                             source->source->views[view].name);
        const unsigned char *valid;
        GBT_TRY(photos_get(source, view, level, &v->photo, &valid, err));
        const size_t pixels = (size_t)v->photo.width * (size_t)v->photo.height;
        v->gray = mem_alloc(pixels, sizeof *v->gray, "seed images", err);
        if (v->gray == NULL)
            return GBT_ERR_NO_MEMORY;
        for (size_t p = 0; p < pixels; p++) {
            const float *rgb = v->photo.pixels + 3 * p;
            v->gray[p] =
                valid == NULL || valid[p] ? 0.299f * rgb[0] + 0.587f * rgb[1] + 0.114f * rgb[2] : NAN;
        }
        paged_check();
    }
    return GBT_OK;
}

static gbt_status keep_best(const seeding *s, scene_points *out, gbt_error *err)
{
    qsort(s->out, SAMPLES, sizeof *s->out, by_doubt);
    size_t kept = 0;
    while (kept < KEPT && isfinite(s->out[kept].doubt) &&
           (kept < KEPT_AT_LEAST || s->out[kept].doubt <= 1 - agreement))
        kept++;
    if (kept == 0)
        return base_fail(err, GBT_ERR_FORMAT,
                         "no sparse points, and no place that several photos see (check the poses; photos "
                         "from one place, only turned, give no depth)");
    mem_free(out->position); /* an empty cloud owns arrays, too */
    mem_free(out->color);
    out->position = mem_alloc(kept, 3 * sizeof *out->position, "seed points", err);
    out->color = mem_alloc(kept, 3 * sizeof *out->color, "seed points", err);
    if (out->position == NULL || out->color == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < kept; i++)
        for (size_t k = 0; k < 3; k++) {
            out->position[3 * i + k] = s->out[i].position[k];
            out->color[3 * i + k] = s->out[i].color[k];
        }
    out->count = kept;
    out->has_color = true;
    return GBT_OK;
}

gbt_status seed_points_make(photos *source, const size_t *views, size_t view_count, uint64_t seed,
                            scene_points *out, gbt_error *err)
{
    if (view_count < SEED_VIEWS_LEAST)
        return base_fail(
            err, GBT_ERR_FORMAT,
            "no sparse points, and %zu photos to train on (wanted at least %d to find points by; "
            "photos that are held out do not count)",
            view_count, SEED_VIEWS_LEAST);
    seeding s = {.view_count = view_count < SEED_VIEWS_MOST ? view_count : SEED_VIEWS_MOST, .seed = seed};
    gbt_status status = GBT_ERR_NO_MEMORY;
    s.views = mem_calloc(s.view_count, sizeof *s.views, "seed images", err);
    s.out = mem_alloc(SAMPLES, sizeof *s.out, "seed candidates", err);
    if (s.views != NULL && s.out != NULL)
        status = read_views(&s, source, views, view_count, err);
    if (status == GBT_OK) {
        double distance;
        if (!find_scale(s.views, s.view_count, &distance))
            distance = try_distances(&s, distance);
        sweep_pixels(&s, SAMPLES, distance);
        status = keep_best(&s, out, err);
    }
    for (size_t i = 0; s.views != NULL && i < s.view_count; i++) {
        image_free(&s.views[i].photo);
        mem_free(s.views[i].gray);
    }
    mem_free(s.views);
    mem_free(s.out);
    return status;
}
