/* SPDX-License-Identifier: Apache-2.0 */
/* stability/partition.c -- cases of the study "stability" about what sorts and measures: growth, balls,
   SSIM. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/compare.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "stability/draw.h"
#include "gb/balls.h"
#include "image/metrics.h"
#include "frame/frame.h"
#include "growth/growth.h"

/* ---- A14: growth explodes, or all anchors go ---- */

typedef struct colony {
    anchors a;
    growth_stats stats;
    growth_result result;
} colony;

static void colony_free(colony *c)
{
    anchors_free(&c->a);
    growth_stats_free(&c->stats);
    mem_free(c->result.source);
    memset(c, 0, sizeof *c);
}

/* Anchors in a cube of 2 around `at`, every Gaussian with the same gradient, every anchor judged. */
static void colony_make(stability *s, colony *c, size_t count, double at, float opacity)
{
    c->a.offset_count = 5;
    if (s->status != GBT_OK || !stability_ok(s, anchors_resize(&c->a, count, s->err)) ||
        !stability_ok(s, growth_stats_resize(&c->stats, count, 5, s->err)))
        return;
    for (size_t i = 0; i < count; i++) {
        for (size_t k = 0; k < 3; k++)
            c->a.position[3 * i + k] = (float)(at + 2 * (double)rng_uniform(14, k, i));
        for (size_t k = 0; k < 15; k++)
            c->a.offset[15 * i + k] = rng_uniform(14, 10 + k, i);
        for (size_t k = 0; k < 5; k++) {
            c->stats.grad_count[5 * i + k] = 100;
            c->stats.grad_accum[5 * i + k] = 100;
        }
        c->stats.visit_count[i] = c->stats.shown_count[i] = 100;
        c->stats.importance_accum[i] = 100 * opacity * (1 + rng_uniform(14, 30, i));
    }
}

static void colony_round(stability *s, colony *c, size_t cap, float voxel)
{
    growth_def def = growth_def_default();
    def.grad_threshold = 0;
    def.voxel_size = voxel;
    def.max_anchors = cap;
    if (s->status == GBT_OK)
        stability_ok(s, growth_round(&c->a, &c->stats, &def, &c->result, s->err));
}

static void explosion(stability *s)
{
    const size_t count = (size_t)stability_number(s, "anchors"),
                 cap = (size_t)stability_number(s, "max_anchors");
    const int before = parallel_threads();
    colony c[2] = {0}, whole = {0};
    for (int i = 0; i < 2; i++) {
        parallel_set_threads(1 + i);
        colony_make(s, &c[i], count, 0, 1);
        colony_round(s, &c[i], cap, 0.001f);
    }
    parallel_set_threads(before);
    colony_make(s, &whole, count, 0, 1);
    colony_round(s, &whole, SIZE_MAX, 0.001f);
    const size_t rows = c[0].a.count;
    const bool same =
        rows == c[1].a.count && memcmp(c[0].a.position, c[1].a.position, 3 * rows * sizeof(float)) == 0;
    const bool best = s->status == GBT_OK && rows <= whole.a.count &&
                      memcmp(c[0].a.position, whole.a.position, 3 * rows * sizeof(float)) == 0;
    stability_check(s, "A14a", (double)rows - (double)cap, NAN,
                    "%zu anchors, all %zu Gaussians ask for more; without a cap there would be %zu.", count,
                    5 * count, whole.a.count);
    stability_check(s, "A14b", !same + !best, NAN,
                    "With 1 and 2 threads; equal gradients go by level and cell.");
    colony_free(&c[0]);
    colony_free(&c[1]);
    colony_free(&whole);
}

/* A model without anchors is a picture of the background. */
static void nobody_left(stability *s)
{
    static const double here[3] = {0, 0, 0};
    const gbt_camera camera = draw_pinhole(40, 30, 30, here);
    anchors none = {.offset_count = 5};
    decoder d = {0};
    frame f = {0};
    trace_settings settings = trace_settings_default();
    settings.background[0] = 0.25f;
    settings.background[1] = 0.5f;
    settings.background[2] = 0.75f;
    double off = NAN;
    if (s->status == GBT_OK && stability_ok(s, decoder_init(&d, 5, false, 1, s->err)) &&
        stability_ok(s, frame_render(&f, frame_neural(&none, &d), &camera, &settings, false, s->err))) {
        off = 0;
        for (size_t i = 0; i < 3 * 40 * 30; i++)
            off = larger_or_nan(off, fabs((double)f.rgb.pixels[i] - (double)settings.background[i % 3]));
    }
    stability_check(s, "A14d", off, NAN, "%s", "");
    frame_free(&f);
    decoder_free(&d);
}

gbt_status stability_a14(stability *s)
{
    colony c = {0};
    explosion(s);
    colony_make(s, &c, 1000, 0, 0.0001f);
    for (size_t i = 0; i < 5000 && s->status == GBT_OK; i++)
        c.stats.grad_count[i] = 0; /* nothing grows */
    colony_round(s, &c, SIZE_MAX, 0.001f);
    stability_check(s, "A14c", fabs((double)c.a.count - 1), NAN, "The most opaque one; training says so.");
    colony_free(&c);
    nobody_left(s);

    /* Cells of a millimetre on a map grid. */
    colony_make(s, &c, 100, 4.5e6, 1);
    colony_round(s, &c, SIZE_MAX, 0.001f / 16);
    double far = 0;
    for (size_t i = 100; i < c.a.count; i++)
        for (size_t k = 0; k < 3; k++)
            far = larger_or_nan(far, fabs((double)c.a.position[3 * i + k] - 4.5e6));
    stability_check(s, "A14e", c.a.count > 100 ? far : (double)NAN, NAN,
                    "%zu new anchors; a 32-bit index would have put them 2,147 km away.", c.a.count - 100);
    colony_free(&c);
    return s->status;
}

/* ---- A15: balls ---- */

typedef void cloud_shape(size_t i, size_t n, double out[3]);

static void same_place(size_t i, size_t n, double out[3])
{
    (void)i;
    (void)n;
    out[0] = 1;
    out[1] = 2;
    out[2] = 3;
}

static void on_a_line(size_t i, size_t n, double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = (k + 1) * (double)i / (double)n;
}

static void on_a_plane(size_t i, size_t n, double out[3])
{
    (void)n;
    out[0] = (double)rng_uniform(15, 0, i);
    out[1] = (double)rng_uniform(15, 1, i);
    out[2] = 0.5;
}

static void octahedron(size_t i, size_t n, double out[3])
{
    (void)n;
    memset(out, 0, 3 * sizeof *out);
    out[i / 2 % 3] = i % 2 == 0 ? 1 : -1;
}

static void in_a_cube(size_t i, size_t n, double out[3])
{
    (void)n;
    for (uint64_t k = 0; k < 3; k++)
        out[k] = (double)rng_uniform(15, 2 + k, i);
}

static void one_outlier(size_t i, size_t n, double out[3])
{
    in_a_cube(i, n, out);
    if (i == n / 2)
        out[0] = 1e6;
}

static void far_away(size_t i, size_t n, double out[3])
{
    in_a_cube(i, n, out);
    for (int k = 0; k < 3; k++)
        out[k] = 4.5e6 + 100 * out[k];
}

static const struct {
    const char *name;
    cloud_shape *shape;
    size_t count;
} clouds[] = {
    {"one", in_a_cube, 1},           {"two", in_a_cube, 2},
    {"identical", same_place, 1000}, {"a line", on_a_line, 1000},
    {"a plane", on_a_plane, 1000},   {"octahedron", octahedron, 6},
    {"octahedra", octahedron, 600},  {"an outlier at 1e6", one_outlier, 1000},
    {"at 4.5e6", far_away, 1000},    {"a cube", in_a_cube, 1000},
};

static size_t permuted(size_t i, size_t n)
{
    return (i * 7919 + n / 3) % n; /* 7919 is prime and divides no count here */
}

static gbt_status build_cloud(stability *s, cloud_shape *shape, size_t n, bool permute, balls *out)
{
    balls_def def = balls_def_default();
    def.voxel_size = 0.01f;
    def.max_depth = 64;
    float *position = mem_alloc(3 * n, sizeof *position, "points", s->err);
    if (position == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < n; i++) {
        double at[3];
        shape(permute ? permuted(i, n) : i, n, at);
        for (size_t k = 0; k < 3; k++)
            position[3 * i + k] = (float)at[k];
    }
    const gbt_status status = balls_build(position, NULL, n, &def, out, s->err);
    mem_free(position);
    return status;
}

/* Points that are not in exactly one ball, balls too deep, centres that are not finite. */
static size_t count_wrong(const balls *b, size_t n, unsigned char *seen)
{
    size_t wrong = (b->point_count != n) + (b->count == 0 || b->first[b->count] != n);
    memset(seen, 0, n);
    for (size_t i = 0; i < b->point_count; i++)
        if (b->member[i] < n)
            seen[b->member[i]]++;
    for (size_t i = 0; i < n; i++)
        wrong += seen[i] != 1;
    for (size_t i = 0; i < b->count; i++)
        wrong += b->depth[i] > 64;
    return wrong + draw_count_bad(b->center, 3 * b->count) + draw_count_bad(b->radius, b->count);
}

/* Centre and radius of each ball, in the order of these numbers. */
typedef struct ball {
    float numbers[4];
} ball;

static int compare_balls(const void *a, const void *b)
{
    const ball *p = a, *q = b;
    for (int k = 0; k < 4; k++)
        if (p->numbers[k] < q->numbers[k] || p->numbers[k] > q->numbers[k])
            return p->numbers[k] < q->numbers[k] ? -1 : 1;
    return 0;
}

enum { LARGEST_CLOUD = 1000 };

static void list_balls(const balls *b, ball out[LARGEST_CLOUD])
{
    for (size_t i = 0; i < b->count; i++)
        out[i] = (ball){{b->center[3 * i], b->center[3 * i + 1], b->center[3 * i + 2], b->radius[i]}};
    qsort(out, b->count, sizeof *out, compare_balls);
}

static bool same_balls(const balls *a, const balls *b)
{
    ball lists[2][LARGEST_CLOUD];
    if (a->count != b->count)
        return false;
    list_balls(a, lists[0]);
    list_balls(b, lists[1]);
    return memcmp(lists[0], lists[1], a->count * sizeof *lists[0]) == 0;
}

gbt_status stability_a15(stability *s)
{
    const int before = parallel_threads();
    unsigned char seen[LARGEST_CLOUD];
    size_t wrong = 0, threads_differ = 0, order_differs = 0;
    for (size_t i = 0; i < sizeof clouds / sizeof *clouds && s->status == GBT_OK; i++) {
        const size_t n = clouds[i].count;
        balls b[3] = {{0}};
        for (int k = 0; k < 3 && s->status == GBT_OK; k++) {
            parallel_set_threads(k == 1 ? 2 : 1);
            if (stability_ok(s, build_cloud(s, clouds[i].shape, n, k == 2, &b[k])))
                wrong += count_wrong(&b[k], n, seen);
        }
        if (s->status == GBT_OK) {
            threads_differ += !same_balls(&b[0], &b[1]);
            order_differs += !same_balls(&b[0], &b[2]);
        }
        for (int k = 0; k < 3; k++)
            balls_free(&b[k]);
    }
    parallel_set_threads(before);
    balls many = {0};
    const size_t large = (size_t)stability_number(s, "identical");
    const double start = clock_wall();
    if (s->status == GBT_OK)
        stability_ok(s, build_cloud(s, same_place, large, false, &many));
    const double seconds = clock_wall() - start;
    stability_check(s, "A15a", (double)wrong, NAN,
                    "One, two, identical, in a line, in a plane, an octahedron, an outlier at 1e6, "
                    "coordinates of 4.5e6, a cube.");
    stability_check(s, "A15b", (double)threads_differ, NAN, "%s", "");
    stability_check(s, "A15c", (double)order_differs, NAN,
                    "Centres and radii, bit for bit. Of a hundred octahedra, whose three variances tie, the "
                    "same balls come in another order.");
    stability_check(s, "A15d", seconds, NAN, "%zu points, %zu ball.", large, many.count);
    balls_free(&many);
    return s->status;
}

/* ---- A17: SSIM ---- */

/* By definition, in two passes in long double; windows see 0 beyond the border. */
static double ssim_exact(const image *a, const image *b)
{
    long double sum = 0, taps[11], all = 0;
    for (int k = 0; k < 11; k++)
        all += taps[k] = expl(-(k - 5) * (k - 5) / 4.5L);
    const int width = a->width, height = a->height;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            for (int c = 0; c < 3; c++) {
                long double mean[2] = {0, 0}, var[2] = {0, 0}, cov = 0;
                for (int pass = 0; pass < 2; pass++)
                    for (int v = -5; v <= 5; v++)
                        for (int u = -5; u <= 5; u++) {
                            const bool inside = x + u >= 0 && x + u < width && y + v >= 0 && y + v < height;
                            const int at = inside ? 3 * ((y + v) * width + x + u) + c : 0;
                            const long double w = taps[u + 5] * taps[v + 5] / (all * all);
                            const long double p = inside ? (long double)a->pixels[at] : 0,
                                              q = inside ? (long double)b->pixels[at] : 0;
                            if (pass == 0) {
                                mean[0] += w * p;
                                mean[1] += w * q;
                            } else
                                var[0] += w * (p - mean[0]) * (p - mean[0]),
                                    var[1] += w * (q - mean[1]) * (q - mean[1]),
                                    cov += w * (p - mean[0]) * (q - mean[1]);
                        }
                sum += (2 * mean[0] * mean[1] + 1e-4L) * (2 * cov + 9e-4L) /
                       ((mean[0] * mean[0] + mean[1] * mean[1] + 1e-4L) * (var[0] + var[1] + 9e-4L));
            }
    return (double)(sum / (3 * width * height));
}

static double ssim_of(stability *s, const image *a, const image *b)
{
    double ssim = (double)NAN;
    stability_ok(s, metric_ssim(a, b, &ssim, s->err));
    return ssim;
}

typedef struct similarity {
    double equal, error, beyond; /* |1 - SSIM| of equal pictures; against the definition; outside [-1, 1] */
    size_t bad;                  /* gradients that are not finite */
} similarity;

static void compare_pictures(stability *s, int width, int height, float low, float high, float shift,
                             similarity *out)
{
    image a = {0}, b = {0}, d = {0};
    loss_scratch scratch = {0};
    image_loss_result loss;
    stability_ok(s, image_alloc(&a, width, height, 3, s->err));
    stability_ok(s, image_alloc(&b, width, height, 3, s->err));
    stability_ok(s, image_alloc(&d, width, height, 3, s->err));
    for (size_t i = 0; s->status == GBT_OK && i < 3 * (size_t)width * (size_t)height; i++) {
        a.pixels[i] = low + (high - low) * rng_uniform(17, 0, i);
        b.pixels[i] = a.pixels[i] + shift * rng_uniform(17, 1, i);
    }
    if (s->status == GBT_OK && stability_ok(s, image_loss(&a, &b, NULL, 0.2, &scratch, &d, &loss, s->err))) {
        const double got = ssim_of(s, &a, &b);
        out->equal = larger_or_nan(out->equal,
                                   larger_or_nan(fabs(1 - ssim_of(s, &a, &a)), fabs(1 - ssim_of(s, &b, &b))));
        out->error = larger_or_nan(out->error, fabs(got - ssim_exact(&a, &b)));
        out->beyond = larger_or_nan(out->beyond, fabs(got) - 1);
        out->bad += draw_count_bad(d.pixels, 3 * (size_t)width * (size_t)height);
    }
    image_free(&a);
    image_free(&b);
    image_free(&d);
    loss_scratch_free(&scratch);
}

gbt_status stability_a17(stability *s)
{
    static const int sizes[][2] = {{1, 1}, {1, 11}, {10, 10}, {11, 11}, {31, 29}};
    static const float ranges[][3] = {{0, 0, 0},         {0.6f, 0.6f, 1e-7f}, {1, 1, 0},    {100, 100, 0},
                                      {255, 255, 1e-4f}, {0, 1, 0.1f},        {0, 255, 20}, {0, 1, -2}};
    similarity all = {.beyond = -INFINITY};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (size_t k = 0; k < sizeof ranges / sizeof *ranges && s->status == GBT_OK; k++)
            compare_pictures(s, sizes[i][0], sizes[i][1], ranges[k][0], ranges[k][1], ranges[k][2], &all);
    image nan = {0};
    double with_nan = 0;
    if (stability_ok(s, image_alloc(&nan, 20, 20, 3, s->err))) {
        memset(nan.pixels, 0, 1200 * sizeof *nan.pixels);
        nan.pixels[600] = NAN;
        with_nan = ssim_of(s, &nan, &nan);
    }
    stability_check(s, "A17a", all.equal, NAN,
                    "Constants of 0, 0.6, 1, 100 and 255, noise up to 255; 1 x 1 to 31 x 29 pixels.");
    stability_check(s, "A17b", all.error, NAN,
                    "Two passes in long double, every pixel, zeros beyond the border; below 11 pixels too.");
    stability_check(s, "A17c", all.beyond, NAN, "%s", "");
    stability_check(s, "A17d", (double)all.bad, NAN, "%s", "");
    stability_check(s, "A17e", !isnan(with_nan), NAN,
                    "A picture with a NaN has no SSIM; training leaves such pixels of photos out.");
    image_free(&nan);
    return s->status;
}
