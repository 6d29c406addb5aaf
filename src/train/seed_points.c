/* train/seed_points.c -- points from photo consistency, for data sets without any. */
#include "train/seed_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"

enum { CANDIDATES = 400000, KEPT = 20000, LEVEL = 3, MIN_VIEWS = 4, BLOCK = 1024, STREAM_SEEDS = 3 };

typedef struct candidate {
    float position[3], color[3], deviation;
    uint32_t index;
} candidate;

typedef struct seeding {
    const image *images; /* [view_count] small photos */
    const gbt_camera *cameras;
    size_t view_count;
    double near, far; /* depths along a ray */
    uint64_t seed;
    candidate *out;
} seeding;

/* Point nearest to all optical axes in the least-squares sense; the mean distance to it is the scene's scale. */
static void find_focus(const gbt_camera *cameras, size_t count, double focus[3], double *distance)
{
    double a[3][4] = {{0}};
    for (size_t i = 0; i < count; i++) {
        const double *d = cameras[i].rotation + 6; /* third row: the optical axis in the world */
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++) {
                const double p = (r == c ? 1 : 0) - d[r] * d[c];
                a[r][c] += p;
                a[r][3] += p * cameras[i].center[c];
            }
    }
    for (int r = 0; r < 3; r++)
        a[r][r] += 1e-6 * (double)count; /* parallel axes: stay near the cameras */
    for (int k = 0; k < 3; k++) /* the matrix is positive definite: no pivoting needed */
        for (int r = 0; r < 3; r++) {
            if (r == k)
                continue;
            const double f = a[r][k] / a[k][k];
            for (int c = k; c < 4; c++)
                a[r][c] -= f * a[k][c];
        }
    for (int k = 0; k < 3; k++)
        focus[k] = a[k][3] / a[k][k];
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        const double d[3] = {focus[0] - cameras[i].center[0], focus[1] - cameras[i].center[1], focus[2] - cameras[i].center[2]};
        sum += dvec_length(d);
    }
    *distance = sum / (double)count > 1e-6 ? sum / (double)count : 1;
}

/* Colours of the views that see the point: mean, and root mean square deviation; false when too few do. */
static bool judge(const seeding *s, candidate *c)
{
    double sum[3] = {0}, square = 0;
    size_t seen = 0;
    for (size_t v = 0; v < s->view_count; v++) {
        const gbt_camera *camera = &s->cameras[v];
        double d[3], cam[3], pixel[2];
        for (int k = 0; k < 3; k++)
            d[k] = (double)c->position[k] - camera->center[k];
        dmat_apply(camera->rotation, d, cam);
        if (cam[2] <= 0 || !gbt_camera_project(camera, cam, pixel) || pixel[0] < 0 || pixel[1] < 0 || pixel[0] >= camera->width || pixel[1] >= camera->height)
            continue;
        const float *p = s->images[v].pixels + 3 * ((size_t)pixel[1] * (size_t)camera->width + (size_t)pixel[0]);
        for (int k = 0; k < 3; k++)
            sum[k] += (double)p[k], square += (double)p[k] * (double)p[k];
        seen++;
    }
    if (seen < MIN_VIEWS && seen < s->view_count)
        return false;
    double mean_square = 0;
    for (int k = 0; k < 3; k++) {
        c->color[k] = (float)(sum[k] / (double)seen);
        mean_square += sum[k] / (double)seen * (sum[k] / (double)seen);
    }
    /* A point that few views see agrees by chance more often. */
    c->deviation = (float)(sqrt(fmax(0, square / (double)seen - mean_square)) + 0.05 / sqrt((double)seen));
    return true;
}

static void seed_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const seeding *s = context;
    for (size_t i = begin; i < end; i++) {
        candidate *c = &s->out[i];
        c->index = (uint32_t)i;
        c->deviation = INFINITY;
        uint32_t words[4];
        rng_philox(s->seed, STREAM_SEEDS, i, words);
        const gbt_camera *camera = &s->cameras[((uint64_t)words[0] * s->view_count) >> 32];
        const double px = (double)words[1] * 0x1p-32 * camera->width, py = (double)words[2] * 0x1p-32 * camera->height;
        double dir[3];
        if (!gbt_camera_unproject(camera, px, py, dir))
            continue;
        dmat_apply_transposed(camera->rotation, dir, dir);
        const double u = (double)words[3] * 0x1p-32;
        const double depth = 1 / ((1 - u) / s->near + u / s->far); /* even in inverse depth: even steps along the other images' lines */
        for (int k = 0; k < 3; k++)
            c->position[k] = (float)(camera->center[k] + depth * dir[k]);
        if (!judge(s, c))
            c->deviation = INFINITY;
    }
}

static int by_deviation(const void *a, const void *b)
{
    const candidate *x = a, *y = b;
    if (x->deviation != y->deviation)
        return x->deviation < y->deviation ? -1 : 1;
    return x->index < y->index ? -1 : x->index > y->index;
}

gbt_status seed_points_make(photos *source, const size_t *views, size_t view_count, uint64_t seed, scene_points *out, gbt_error *err)
{
    seeding s = {.view_count = view_count, .seed = seed};
    gbt_status status = GBT_ERR_NO_MEMORY;
    image *images = mem_calloc(view_count, sizeof *images, "seed images", err);
    gbt_camera *cameras = mem_alloc(view_count, sizeof *cameras, "seed cameras", err);
    s.out = mem_alloc(CANDIDATES, sizeof *s.out, "seed candidates", err);
    if (images == NULL || cameras == NULL || s.out == NULL)
        goto done;
    for (size_t i = 0; i < view_count; i++) {
        status = photos_get(source, views[i], LEVEL, &images[i], err);
        if (status != GBT_OK)
            goto done;
        cameras[i] = photos_camera(source, views[i], LEVEL);
    }
    s.images = images, s.cameras = cameras;
    double focus[3], distance;
    find_focus(cameras, view_count, focus, &distance);
    s.near = 0.3 * distance, s.far = 6 * distance;
    parallel_blocks(CANDIDATES, BLOCK, seed_block, &s);
    qsort(s.out, CANDIDATES, sizeof *s.out, by_deviation);
    size_t kept = 0;
    while (kept < KEPT && isfinite(s.out[kept].deviation))
        kept++;
    if (kept == 0) {
        status = base_fail(err, GBT_ERR_FORMAT, "no sparse points, and no place that several photos see (check the poses)");
        goto done;
    }
    mem_free(out->position); /* a cloud of no points owns its arrays too */
    mem_free(out->color);
    out->position = mem_alloc(kept, 3 * sizeof *out->position, "seed points", err);
    out->color = mem_alloc(kept, 3 * sizeof *out->color, "seed points", err);
    status = out->position == NULL || out->color == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    for (size_t i = 0; status == GBT_OK && i < kept; i++)
        for (size_t k = 0; k < 3; k++)
            out->position[3 * i + k] = s.out[i].position[k], out->color[3 * i + k] = s.out[i].color[k];
    if (status == GBT_OK)
        out->count = kept, out->has_color = true;
done:
    for (size_t i = 0; images != NULL && i < view_count; i++)
        image_free(&images[i]);
    mem_free(images);
    mem_free(cameras);
    mem_free(s.out);
    return status;
}
