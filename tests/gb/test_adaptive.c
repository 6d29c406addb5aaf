/* SPDX-License-Identifier: Apache-2.0 */
/* tests/gb/test_adaptive.c -- the best-first partition: a naive one in long double, colour, outliers,
   degenerate clouds, promises. */
#include <stdbool.h>

#include "ball_checks.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "clouds.h"
#include "gb/adaptive.h"
#include "gb/joint.h"

enum { DIM = 6, NAIVE_POINTS = 96 };

static adaptive_def def_of(float voxel_size, size_t most)
{
    adaptive_def def = adaptive_def_default();
    def.voxel_size = voxel_size;
    def.balls_max = most;
    return def;
}

static void check_adaptive(const balls *b, const float *position, const float *color, size_t count,
                           const adaptive_def *def)
{
    const balls_def like = {.voxel_size = def->voxel_size, .max_depth = 254, .min_scale = def->min_scale};
    check_balls(b, position, color, count, &like);
}

/* ---- the same thing, naively ---- */

typedef struct naive_set {
    size_t count, left_count;
    uint32_t member[NAIVE_POINTS];
    bool goes_left[NAIVE_POINTS];
    long double saving;
} naive_set;

static void naive_point(const cloud *c, const adaptive_def *def, uint32_t i, long double y[DIM])
{
    for (int k = 0; k < 3; k++) {
        y[k] = (long double)c->position[3 * i + k] / (long double)def->voxel_size;
        y[3 + k] = (long double)c->color[3 * i + k] / (long double)def->color_unit;
    }
}

static void naive_moments(const cloud *c, const adaptive_def *def, const uint32_t *member, size_t n,
                          long double mean[DIM], long double cov[DIM][DIM])
{
    long double y[DIM];
    for (int k = 0; k < DIM; k++)
        mean[k] = 0;
    for (size_t i = 0; i < n; i++) {
        naive_point(c, def, member[i], y);
        for (int k = 0; k < DIM; k++)
            mean[k] += y[k] / (long double)n;
    }
    memset(cov, 0, DIM * sizeof *cov);
    for (size_t i = 0; i < n; i++) {
        naive_point(c, def, member[i], y);
        for (int k = 0; k < DIM; k++)
            for (int l = 0; l < DIM; l++)
                cov[k][l] += (y[k] - mean[k]) * (y[l] - mean[l]) / (long double)n;
    }
}

/* Gaussian elimination without pivots: the matrix is positive definite. */
static long double naive_nats(long double cov[DIM][DIM], size_t n)
{
    long double a[DIM][DIM], sum = 0;
    for (int k = 0; k < DIM; k++)
        for (int l = 0; l < DIM; l++)
            a[k][l] = cov[k][l] + (k == l);
    for (int k = 0; k < DIM; k++) {
        sum += logl(a[k][k]);
        for (int i = k + 1; i < DIM; i++)
            for (int l = DIM; l-- > k;)
                a[i][l] -= a[i][k] / a[k][k] * a[k][l];
    }
    return sum * (long double)n / 2;
}

/* Squaring the matrix doubles the exponent of a power iteration. */
static void naive_axis(long double cov[DIM][DIM], long double axis[DIM])
{
    long double a[DIM][DIM], b[DIM][DIM];
    memcpy(a, cov, sizeof a);
    for (int round = 0; round < 40; round++) {
        long double trace = 0;
        for (int k = 0; k < DIM; k++)
            trace += a[k][k];
        for (int k = 0; k < DIM; k++)
            for (int l = 0; l < DIM; l++) {
                b[k][l] = 0;
                for (int m = 0; m < DIM; m++)
                    b[k][l] += a[k][m] / trace * (a[m][l] / trace);
            }
        memcpy(a, b, sizeof a);
    }
    int best = 0; /* a is the projector onto the axis: its largest column is the least cancelled */
    for (int k = 1; k < DIM; k++)
        if (a[k][k] > a[best][best])
            best = k;
    for (int k = 0; k < DIM; k++)
        axis[k] = a[k][best] / sqrtl(a[best][best]); /* its largest component is positive */
}

static void naive_cut(const cloud *c, const adaptive_def *def, naive_set *s)
{
    long double mean[DIM], cov[DIM][DIM], axis[DIM], y[DIM], key[NAIVE_POINTS], bound = 0;
    s->left_count = 0;
    if (s->count < 2)
        return;
    naive_moments(c, def, s->member, s->count, mean, cov);
    naive_axis(cov, axis);
    for (size_t i = 0; i < s->count; i++) {
        naive_point(c, def, s->member[i], y);
        key[i] = 0;
        for (int k = 0; k < DIM; k++)
            key[i] += (y[k] - mean[k]) * axis[k];
    }
    for (int round = 0; round < 16; round++) {
        long double sum[2] = {0, 0};
        size_t in[2] = {0, 0};
        for (size_t i = 0; i < s->count; i++) {
            sum[key[i] > bound] += key[i];
            in[key[i] > bound]++;
        }
        bound = (sum[0] / (long double)in[0] + sum[1] / (long double)in[1]) / 2;
    }
    uint32_t side[2][NAIVE_POINTS];
    size_t in[2] = {0, 0};
    for (size_t i = 0; i < s->count; i++) {
        s->goes_left[i] = key[i] <= bound;
        side[!s->goes_left[i]][in[!s->goes_left[i]]++] = s->member[i];
    }
    s->left_count = in[0];
    s->saving = naive_nats(cov, s->count);
    for (int k = 0; k < 2; k++) {
        naive_moments(c, def, side[k], in[k], mean, cov);
        s->saving -= naive_nats(cov, in[k]);
    }
}

/* Sets stay in the order of the tree: the left part takes the place, the right part comes behind it. */
static size_t naive_partition(const cloud *c, const adaptive_def *def, naive_set *sets)
{
    size_t count = 1;
    sets[0].count = c->count;
    for (size_t i = 0; i < c->count; i++)
        sets[0].member[i] = (uint32_t)i;
    while (count < def->balls_max) {
        size_t best = SIZE_MAX;
        for (size_t j = 0; j < count; j++) {
            naive_cut(c, def, &sets[j]);
            if (sets[j].left_count > 0 && (best == SIZE_MAX || sets[j].saving > sets[best].saving))
                best = j;
        }
        if (best == SIZE_MAX)
            break;
        memmove(sets + best + 1, sets + best, (count++ - best) * sizeof *sets);
        naive_set *left = &sets[best], *right = left + 1;
        const naive_set whole = *left;
        left->count = right->count = 0;
        for (size_t i = 0; i < whole.count; i++) {
            naive_set *to = whole.goes_left[i] ? left : right;
            to->member[to->count++] = whole.member[i];
        }
    }
    return count;
}

static void agrees_with_the_naive_partition(void **state)
{
    (void)state;
    static naive_set sets[NAIVE_POINTS + 1];
    for (uint64_t seed = 0; seed < 40; seed++) {
        cloud c = cloud_random(3 + (size_t)(seed * 37 % (NAIVE_POINTS - 3)), seed, seed % 3 == 0 ? 50 : 0,
                               seed % 4 == 0 ? 0.1 : 1);
        adaptive_def def = def_of(seed % 2 == 0 ? 1 : 0.05f, 1 + c.count / (1 + seed % 4));
        def.color_unit = seed % 5 == 0 ? 0.5f : 0.1f;
        const size_t wanted = naive_partition(&c, &def, sets);
        balls b;
        assert_ok(balls_adapt(c.position, c.color, c.count, &def, &b, &assert_ok_err_));
        assert_int_equal(b.count, wanted);
        for (size_t j = 0; j < b.count; j++) {
            const size_t got = b.first[j + 1] - b.first[j];
            if (got != sets[j].count)
                fail_msg("seed %llu, ball %zu: wanted %zu points, got %zu", (unsigned long long)seed, j,
                         sets[j].count, got);
            assert_memory_equal(b.member + b.first[j], sets[j].member, sets[j].count * sizeof *b.member);
        }
        check_adaptive(&b, c.position, c.color, c.count, &def);
        balls_free(&b);
        cloud_free(&c);
    }
}

/* ---- what it is for ---- */

static void counts_are_met_and_nested(void **state)
{
    (void)state;
    cloud c = cloud_random(700, 5, 0, 1);
    balls coarse = {0};
    for (size_t most = 1; most <= 720; most += most < 40 || most > 690 ? 1 : 13) {
        const adaptive_def def = def_of(0.2f, most);
        balls fine;
        assert_ok(balls_adapt(c.position, c.color, c.count, &def, &fine, &assert_ok_err_));
        assert_int_equal(fine.count, most < 700 ? most : 700);
        size_t next =
            0; /* the finer balls begin wherever the coarser ones do: both are in the order of the tree */
        for (size_t j = 0; j < coarse.count; j++) {
            while (next < fine.count && fine.first[next] < coarse.first[j])
                next++;
            assert_true(next < fine.count && fine.first[next] == coarse.first[j]);
        }
        balls_free(&coarse);
        coarse = fine;
    }
    balls_free(&coarse);
    cloud_free(&c);
}

/* Eight points a step apart on a line; the sixth differs in colour from there on. */
static void colour_moves_the_cut(void **state)
{
    (void)state;
    float position[24] = {0}, color[24];
    for (size_t i = 0; i < 8; i++) {
        position[3 * i] = (float)i;
        for (size_t k = 0; k < 3; k++)
            color[3 * i + k] = i < 5 ? 0.25f : 0.75f;
    }
    const struct {
        const float *color;
        float color_unit;
        uint32_t left;
    } rows[] = {{NULL, 0.1f, 4}, {color, 10, 4}, {color, 0.05f, 5}};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        adaptive_def def = def_of(1, 2);
        def.color_unit = rows[r].color_unit;
        balls b;
        assert_ok(balls_adapt(position, rows[r].color, 8, &def, &b, &assert_ok_err_));
        assert_int_equal(b.count, 2);
        assert_int_equal(b.first[1], rows[r].left);
        balls_free(&b);
    }
}

/* Detail gets the balls: a strip that is even in colour, and one of the same size and count that is not. */
static void balls_go_where_colours_differ(void **state)
{
    (void)state;
    enum { N = 1000 };
    cloud c = cloud_random(2 * N, 8, 0, 1);
    for (size_t i = 0; i < 2 * N; i++) {
        c.position[3 * i] += i < N ? -20.0f : 20.0f;
        for (size_t k = 0; k < 3 && i < N; k++)
            c.color[3 * i + k] = 0.5f;
    }
    const adaptive_def def = def_of(0.5f, 200);
    balls b;
    assert_ok(balls_adapt(c.position, c.color, c.count, &def, &b, &assert_ok_err_));
    size_t even = 0;
    for (size_t j = 0; j < b.count; j++)
        even += b.center[3 * j] < 0;
    assert_in_range(even, 20, 60);
    balls_free(&b);
    cloud_free(&c);
}

/* A surface of 4,000 points, 40 lone points around it, 100 balls: the surface keeps most; no ball holds a
   lone point and the surface. */
static void outliers_neither_take_all_nor_stretch_balls(void **state)
{
    (void)state;
    enum { SURFACE = 4000, LONE = 40, BALLS = 100 };
    cloud c = cloud_random(SURFACE + LONE, 9, 0, 1);
    for (size_t i = 0; i < 3 * SURFACE; i++)
        c.position[i] = i % 3 == 2 ? 0 : 40 * rng_uniform(9, 2, i) - 20;
    for (size_t i = 3 * SURFACE; i < 3 * c.count; i++)
        c.position[i] *= 300;
    const adaptive_def def = def_of(0.3f, BALLS);
    balls b;
    assert_ok(balls_adapt(c.position, NULL, c.count, &def, &b, &assert_ok_err_));
    size_t on_surface = 0, lone = 0;
    for (size_t j = 0; j < b.count; j++) {
        const bool has_lone = b.member[b.first[j + 1] - 1] >= SURFACE,
                   has_surface = b.member[b.first[j]] < SURFACE;
        assert_true(has_lone != has_surface);
        on_surface += has_surface;
        lone += has_lone && b.first[j + 1] - b.first[j] == 1;
    }
    if (on_surface < BALLS * 3 / 4 || lone >= LONE / 2)
        fail_msg("%zu balls on the surface, %zu of lone points", on_surface, lone);
    balls_free(&b);
    cloud_free(&c);
}

/* Lone points over 8.5 decades: each cut takes those within a small factor of the farthest. */
static void outliers_over_many_decades_leave_no_surface_whole(void **state)
{
    (void)state;
    enum { SURFACE = 4000, LONE = 3000, BALLS = 2048 };
    cloud c = cloud_random(SURFACE + LONE, 9, 0, 1);
    for (size_t i = 0; i < 3 * SURFACE; i++)
        c.position[i] = i % 3 == 2 ? 0 : 2 * rng_uniform(9, 2, i) - 1;
    for (size_t i = SURFACE; i < c.count; i++) {
        float *at = c.position + 3 * i;
        const double length = sqrt((double)(at[0] * at[0] + at[1] * at[1] + at[2] * at[2])),
                     far = pow(10, 2 + 8.5 * (double)rng_uniform(9, 3, i));
        for (int k = 0; k < 3; k++)
            at[k] = (float)((double)at[k] * far / length);
    }
    const adaptive_def def = def_of(0.02f, BALLS);
    balls b;
    assert_ok(balls_adapt(c.position, NULL, c.count, &def, &b, &assert_ok_err_));
    for (size_t j = 0; j < b.count; j++) {
        size_t surface = 0;
        for (uint32_t i = b.first[j]; i < b.first[j + 1]; i++)
            surface += b.member[i] < SURFACE;
        assert_in_range(surface, 0, 64);
    }
    balls_free(&b);
    cloud_free(&c);
}

/* ---- degenerate clouds ---- */

typedef struct shape {
    const char *name;
    size_t points, most, balls;
    double step[3];       /* of the grid that the points are on */
    size_t columns, rows; /* of the grid; points beyond the grid repeat it */
} shape;

static shape shapes[] = {
    {"no points", 0, 5, 0, {1, 1, 1}, 1, 1},
    {"one point", 1, 5, 1, {1, 1, 1}, 1, 1},
    {"two points", 2, 5, 2, {1, 0, 0}, 2, 1},
    {"two points, one ball", 2, 1, 1, {1, 0, 0}, 2, 1},
    {"all in one place, colours differ", 50, 20, 1, {0, 0, 0}, 1, 1},
    {"three places, many copies", 300, 300, 3, {1, 0, 0}, 3, 1},
    {"collinear", 64, 64, 64, {0, 1, 0}, 64, 1},
    {"coplanar grid", 256, 256, 256, {0.25, 0, 0.5}, 16, 16},
    {"wider than float squares", 40, 40, 40, {1e30, 0, 1e30}, 8, 5},
    {"subnormal", 40, 40, 40, {1e-42, 0, 1e-42}, 8, 5},
};

static void shape_is_covered(void **state)
{
    const shape *s = *state;
    cloud c = cloud_random(s->points, 3, 0, 1);
    for (size_t i = 0; i < s->points; i++) {
        const double at[3] = {(double)(i % s->columns), (double)(i % s->columns),
                              (double)(i / s->columns % s->rows)};
        for (size_t k = 0; k < 3; k++)
            c.position[3 * i + k] = (float)(s->step[k] * at[k]);
    }
    for (int colored = 0; colored < (s->balls == s->points ? 2 : 1); colored++) { /* copies of a place part
                                                                                     when colours differ */
        const adaptive_def def = def_of(0.1f, s->most);
        balls b;
        assert_ok(balls_adapt(c.position, colored ? c.color : NULL, s->points, &def, &b, &assert_ok_err_));
        assert_int_equal(b.count, s->balls);
        check_adaptive(&b, c.position, colored ? c.color : NULL, s->points, &def);
        balls_free(&b);
    }
    cloud_free(&c);
}

static void one_place_is_one_ball_whatever_the_colours(void **state)
{
    (void)state;
    cloud c = cloud_random(100, 4, 0, 1);
    for (size_t i = 0; i < 300; i++)
        c.position[i] = 0.1f;
    const adaptive_def def = def_of(1, 50);
    balls b;
    assert_ok(balls_adapt(c.position, c.color, c.count, &def, &b, &assert_ok_err_));
    assert_int_equal(b.count, 1);
    assert_true(b.radius[0] == 0.25f);
    balls_free(&b);
    cloud_free(&c);
}

/* On each axis points that are four times as far as the one before: every cut takes one off, or a few, to the
   depth where cutting ends. */
static void skewed_clouds_end_at_depth_254(void **state)
{
    (void)state;
    enum { FAR = 126, N = 3 * FAR };
    float position[3 * N] = {0};
    for (int i = 0; i < N; i++)
        position[3 * i + i % 3] = ldexpf(1, 2 * (i / 3) - FAR);
    const adaptive_def def = def_of(1e-3f, N);
    balls b;
    assert_ok(balls_adapt(position, NULL, N, &def, &b, &assert_ok_err_));
    assert_in_range(b.count, 255, N - 1);
    size_t deepest = 0;
    for (size_t j = 0; j < b.count; j++)
        if (b.depth[j] == 254 && b.first[j + 1] - b.first[j] > deepest)
            deepest = b.first[j + 1] - b.first[j];
    assert_true(deepest > 1);
    check_adaptive(&b, position, NULL, N, &def);
    balls_free(&b);
}

/* Points on a line; exact in floating point. */
static void ties_are_settled(void **state)
{
    (void)state;
    const struct {
        const char *name;
        float x[4];
        size_t count, most, balls;
        uint32_t first[4];
    } rows[] = {
        {"a point at the mean starts on the left", {0, 1, 2}, 3, 2, 2, {0, 2, 3}},
        {"of equal savings the left one is taken", {0, 1, 10, 11}, 4, 3, 3, {0, 1, 2, 4}},
        {"whatever the order", {11, 0, 10, 1}, 4, 3, 3, {0, 1, 2, 4}},
        {"2-means moves the cut from the mean", {0, 4, 5, 100}, 4, 2, 2, {0, 3, 4}},
    };
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++)
        for (int axis = 0; axis < 3; axis++) {
            float position[12] = {0};
            for (size_t i = 0; i < rows[r].count; i++)
                position[3 * i + (size_t)axis] = rows[r].x[i];
            const adaptive_def def = def_of(1, rows[r].most);
            balls b;
            assert_ok(balls_adapt(position, NULL, rows[r].count, &def, &b, &assert_ok_err_));
            if (b.count != rows[r].balls ||
                memcmp(b.first, rows[r].first, (b.count + 1) * sizeof *b.first) != 0)
                fail_msg("%s: %zu balls, %u %u %u", rows[r].name, b.count, b.first[0], b.first[1],
                         b.first[2]);
            balls_free(&b);
        }
}

static void nats_and_axis_by_hand(void **state)
{
    (void)state;
    const struct {
        double diagonal[DIM], off, wanted, within;
        int axis;
    } rows[] = {
        {{0}, 0, 0, 0, 0},
        {{0, 3, 0, 1, 0, 0}, 0, 5 * log(4 * 2), 1e-14, 1},
        {{0.5, 0.5, 0.5, 0.5, 0.5, 2}, 0, 5 * (5 * log(1.5) + log(3)), 1e-13, 5},
        {{1e20, 1e20, 1e20}, 1e20, 5 * log(3e20), 6, 0}, /* rounding leaves nothing of I: less by a factor of
                                                            3, never -inf */
    };
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        joint_moments m = {0};
        for (int k = 0; k < DIM; k++)
            for (int l = 0; l < DIM; l++)
                m.covariance[k][l] = k == l ? rows[r].diagonal[k] : k < 3 && l < 3 ? rows[r].off : 0;
        double axis[DIM];
        joint_axis(&m, axis);
        const double nats = joint_nats(&m, 10);
        if (!(fabs(nats - rows[r].wanted) <= rows[r].within))
            fail_msg("row %zu: wanted %.17g nats, got %.17g", r, rows[r].wanted, nats);
        assert_true(fabs(axis[rows[r].axis] - (rows[r].off > 0 ? sqrt(1.0 / 3) : 1)) < 1e-12);
    }
}

/* ---- promises ---- */

static void input_order_does_not_matter(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 30; seed++) {
        cloud c = cloud_random(3 + (size_t)(seed * seed * 5), seed, seed % 3 == 0 ? 1e3 : 0, 1), s;
        uint32_t *to = cloud_shuffle(&c, seed, &s);
        const adaptive_def def = def_of(seed % 2 == 0 ? 0.3f : 0.01f, 1 + c.count / 3);
        balls a, b;
        assert_ok(balls_adapt(c.position, c.color, c.count, &def, &a, &assert_ok_err_));
        assert_ok(balls_adapt(s.position, s.color, s.count, &def, &b, &assert_ok_err_));
        check_same_partition(&a, &b, to);
        balls_free(&a);
        balls_free(&b);
        cloud_free(&c);
        cloud_free(&s);
        free(to);
    }
}

static void same_bits_for_any_thread_count(void **state)
{
    (void)state;
    const int before = parallel_threads();
    cloud c = cloud_random(20000, 21, 100, 1);
    const adaptive_def def = def_of(0.05f, 7000);
    uint64_t hash[3];
    for (int t = 0; t < 3; t++) {
        parallel_set_threads(1 + 2 * t);
        balls b;
        assert_ok(balls_adapt(c.position, c.color, c.count, &def, &b, &assert_ok_err_));
        hash[t] = hash_balls(&b);
        balls_free(&b);
    }
    parallel_set_threads(before);
    assert_true(hash[0] == hash[1] && hash[0] == hash[2]);
    cloud_free(&c);
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    cloud c = cloud_random(300, 31, 0, 1);
    const adaptive_def def = def_of(0.1f, 60);
    long failures = 0;
    for (;; failures++) {
        gbt_error err = {0};
        balls b;
        memset(&b, 0xAA, sizeof b);
        mem_fail_after(failures);
        const gbt_status status = balls_adapt(c.position, c.color, c.count, &def, &b, &err);
        mem_fail_after(-1);
        if (status == GBT_OK) {
            balls_free(&b);
            break;
        }
        assert_int_equal(status, GBT_ERR_NO_MEMORY);
        assert_true(err.text[0] != '\0' && b.count == 0 && b.first == NULL && b.depth == NULL);
    }
    assert_int_equal(failures, 12); /* 4 scratch arrays and 8 fields */
    cloud_free(&c);
}

static void bad_settings_are_refused(void **state)
{
    (void)state;
    const struct {
        adaptive_def def;
        float position, color;
        const char *text;
    } rows[] = {
        {{0, 0.1f, 2, 0.25f}, 0, 0, "voxel_size"},        {{NAN, 0.1f, 2, 0.25f}, 0, 0, "voxel_size"},
        {{INFINITY, 0.1f, 2, 0.25f}, 0, 0, "voxel_size"}, {{1, 0, 2, 0.25f}, 0, 0, "color_unit"},
        {{1, NAN, 2, 0.25f}, 0, 0, "color_unit"},         {{1, INFINITY, 2, 0.25f}, 0, 0, "color_unit"},
        {{1, 0.1f, 0, 0.25f}, 0, 0, "balls_max"},         {{1, 0.1f, 2, -1}, 0, 0, "min_scale"},
        {{1, 0.1f, 2, NAN}, 0, 0, "min_scale"},           {{1, 0.1f, 2, 0.25f}, NAN, 0, "point 1 "},
        {{1, 0.1f, 2, 0.25f}, 0, 1.5f, "point 1 "},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const float position[6] = {1, 2, 3, 4, rows[i].position, 6},
                    color[6] = {0, 0, 0, 0, rows[i].color, 0};
        balls b;
        gbt_error err = {0};
        assert_int_equal(balls_adapt(position, color, 2, &rows[i].def, &b, &err), GBT_ERR_ARGUMENT);
        if (strstr(err.text, rows[i].text) == NULL)
            fail_msg("row %zu: \"%s\" does not name %s", i, err.text, rows[i].text);
        assert_true(b.count == 0 && b.first == NULL);
    }
}

int main(void)
{
    enum { SHAPES = sizeof shapes / sizeof *shapes };
    static const struct CMUnitTest others[] = {
        cmocka_unit_test(agrees_with_the_naive_partition),
        cmocka_unit_test(counts_are_met_and_nested),
        cmocka_unit_test(colour_moves_the_cut),
        cmocka_unit_test(balls_go_where_colours_differ),
        cmocka_unit_test(outliers_neither_take_all_nor_stretch_balls),
        cmocka_unit_test(outliers_over_many_decades_leave_no_surface_whole),
        cmocka_unit_test(one_place_is_one_ball_whatever_the_colours),
        cmocka_unit_test(skewed_clouds_end_at_depth_254),
        cmocka_unit_test(input_order_does_not_matter),
        cmocka_unit_test(same_bits_for_any_thread_count),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(bad_settings_are_refused),
        cmocka_unit_test(ties_are_settled),
        cmocka_unit_test(nats_and_axis_by_hand),
    };
    enum { OTHERS = sizeof others / sizeof *others };
    struct CMUnitTest tests[SHAPES + OTHERS];
    size_t n = 0;
    for (int i = 0; i < SHAPES; i++)
        tests[n++] = (struct CMUnitTest){
            .name = shapes[i].name, .test_func = shape_is_covered, .initial_state = &shapes[i]};
    for (int i = 0; i < OTHERS; i++)
        tests[n++] = others[i];
    return _cmocka_run_group_tests("adaptive", tests, n, NULL, NULL);
}
