/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/photo.c -- renders a world with stratified, adaptive sampling. */
#include "scenes/photo.h"

#include <math.h>

#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"

/* The largest difference of displayed colour among the first samples that counts as one colour: 15 of 255. */
static const float same_color = 0.06f;

bool photo_ray(const gbt_camera *camera, double px, double py, float origin[3], float dir[3])
{
    double start[3], forward[3];
    if (!gbt_camera_ray(camera, px, py, start, forward))
        return false;
    for (int k = 0; k < 3; k++) {
        origin[k] = (float)start[k];
        dir[k] = (float)forward[k];
    }
    return true;
}

typedef struct photo_job {
    const world *w;
    const gbt_camera *camera;
    int side;
    uint64_t seed, view;
    image *out;
} photo_job;

/** The strata of the first pass: a quarter of all, one per row and column of every 4 x 4 block; or all, where
    there are too few. */
static bool is_first_pass(int x, int y, int side) { return side <= 2 || (x + 2 * y + y / 2) % 4 == 0; }

static float fraction(float x) { return x - floorf(x); }

/** @return the material that is seen, combined with its variant; -1 for the sky */
static int sample(const photo_job *job, int column, int row, int x, int y, int number, float rgb[3])
{
    const uint64_t pixel = (uint64_t)row * (uint64_t)job->camera->width + (uint64_t)column;
    const uint64_t strata = (uint64_t)job->side * (uint64_t)job->side;
    uint32_t words[4];
    rng_philox(job->seed, 1 + job->view, pixel * strata + (uint64_t)(y * job->side + x), words);
    const double u = (double)words[0] * 0x1p-32, v = (double)words[1] * 0x1p-32;
    float origin[3], dir[3];
    rgb[0] = rgb[1] = rgb[2] = 0;
    if (!photo_ray(job->camera, column + (x + u) / job->side, row + (y + v) / job->side, origin, dir))
        return -1;
    surface s;
    if (!world_trace(job->w, origin, dir, &s)) {
        world_sky(job->w, dir, rgb);
        return -1;
    }
    /* The lamp is sampled by an additive recurrence (R2, Roberts 2018), which is even for every number of
       samples. It is the same for every pixel: a soft shadow then has faint steps but no grain, and all views
       agree about it. */
    const float jitter[2] = {fraction(0.5f + 0.7548777f * (float)number),
                             fraction(0.5f + 0.5698403f * (float)number)};
    world_shade(job->w, &s, dir, jitter, rgb);
    return s.material * 65536 + s.variant;
}

static void render_pixel(const photo_job *job, int column, int row)
{
    const int side = job->side;
    float sum[3] = {0}, low[3] = {1, 1, 1}, high[3] = {0};
    int number = 0, first_seen = 0;
    bool is_even = true;
    for (int pass = 0; pass < 2; pass++) {
        for (int y = 0; y < side; y++)
            for (int x = 0; x < side; x++) {
                if (is_first_pass(x, y, side) != (pass == 0))
                    continue;
                float rgb[3];
                const int seen = sample(job, column, row, x, y, number, rgb);
                if (number == 0)
                    first_seen = seen;
                is_even = is_even && seen == first_seen;
                for (int k = 0; k < 3; k++) {
                    sum[k] += rgb[k];
                    low[k] = fminf(low[k], rgb[k]);
                    high[k] = fmaxf(high[k], rgb[k]);
                }
                number++;
            }
        for (int k = 0; k < 3; k++)
            is_even = is_even && high[k] - low[k] <= same_color;
        if (is_even)
            break;
    }
    float *pixel = job->out->pixels + 3 * ((size_t)row * (size_t)job->camera->width + (size_t)column);
    for (int k = 0; k < 3; k++)
        pixel[k] = sum[k] / (float)number;
}

static void render_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const photo_job *job = context;
    for (size_t row = begin; row < end; row++)
        for (int column = 0; column < job->camera->width; column++)
            render_pixel(job, column, (int)row);
}

void photo_render(const world *w, const gbt_camera *camera, int side, uint64_t seed, uint64_t view,
                  image *out)
{
    photo_job job = {w, camera, side, seed, view, out};
    parallel_blocks((size_t)camera->height, 4, render_rows, &job);
}

static void depth_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const photo_job *job = context;
    for (size_t row = begin; row < end; row++)
        for (int column = 0; column < job->camera->width; column++) {
            float origin[3], dir[3], depth = 0;
            surface s;
            if (photo_ray(job->camera, column + 0.5, (double)row + 0.5, origin, dir) &&
                world_trace(job->w, origin, dir, &s))
                depth = s.distance;
            job->out->pixels[row * (size_t)job->camera->width + (size_t)column] = depth;
        }
}

void photo_depth(const world *w, const gbt_camera *camera, image *out)
{
    photo_job job = {.w = w, .camera = camera, .out = out};
    parallel_blocks((size_t)camera->height, 4, depth_rows, &job);
}
