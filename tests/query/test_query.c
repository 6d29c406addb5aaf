/* SPDX-License-Identifier: Apache-2.0 */
/* tests/query/test_query.c -- balls by place: every kind against a test of every ball, far from the origin;
   sources, files of queries, and what is refused. */
#include "folder.h"

#include "anchor/decode.h"
#include "base/rng.h"
#include "gbtrace/query.h"
#include "io/model_file.h"

enum { BALLS = 2000, QUERIES = 1500, K = 5 };

/* Every other coordinate on a grid, which gives ties and copies. */
static double coordinate(uint64_t seed, size_t i, size_t j, double size, double origin)
{
    const double u = size * (2 * (double)rng_uniform(seed, j, i) - 1);
    return origin + (i % 2 == 0 ? rint(u) : u);
}

static double square_to(const double *a, const double *b)
{
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

/* By the words of the header, in the same arithmetic. */
static bool is_answer(gbt_query_kind kind, const double *c, double r, const double *q, const double *d,
                      double reach, double t_min, double t_max)
{
    if (kind != GBT_QUERY_CROSSED) {
        const double far = kind == GBT_QUERY_WITHIN ? reach : kind == GBT_QUERY_CONTAINING ? r : r + reach;
        return square_to(c, q) <= far * far;
    }
    const double m[3] = {c[0] - q[0], c[1] - q[1], c[2] - q[2]};
    const double t = fmin(
        fmax((m[0] * d[0] + m[1] * d[1] + m[2] * d[2]) / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), t_min),
        t_max);
    const double e[3] = {m[0] - t * d[0], m[1] - t * d[1], m[2] - t * d[2]};
    return t_min <= t_max && e[0] * e[0] + e[1] * e[1] + e[2] * e[2] <= r * r;
}

static double position[3 * BALLS], radius[BALLS], point[3 * QUERIES], dir[3 * QUERIES], reach[QUERIES],
    t_min[QUERIES], t_max[QUERIES];

static void make(double size, double origin)
{
    for (size_t i = 0; i < BALLS; i++) {
        for (size_t j = 0; j < 3; j++)
            position[3 * i + j] = coordinate(1, i, j, size, origin);
        radius[i] = i % 7 == 0 ? 0 : 0.1 * size * (double)rng_uniform(1, 4, i);
    }
    for (size_t i = 0; i < QUERIES; i++) {
        for (size_t j = 0; j < 3; j++) {
            point[3 * i + j] = coordinate(2, i, j, 1.2 * size, origin);
            dir[3 * i + j] = i % 3 == 0 ? (double)(j == i % 2) : (double)rng_uniform(2, 8 + j, i) - 0.5;
        }
        reach[i] = i % 40 == 0 ? HUGE_VAL : i % 5 == 0 ? 1 : 0.1 * size * (double)rng_uniform(2, 4, i);
        t_min[i] = i % 4 == 0 ? -HUGE_VAL : size * ((double)rng_uniform(2, 5, i) - 0.5);
        t_max[i] = i % 4 == 1 ? HUGE_VAL : size * ((double)rng_uniform(2, 6, i) - 0.2);
    }
}

static void expect_nearest(const gbt_balls *balls, bool skip_same)
{
    static uint32_t index[QUERIES * K];
    static double distance[QUERIES * K];
    const double *from = skip_same ? position : point;
    assert_ok(gbt_balls_nearest(balls, from, QUERIES, K, skip_same, index, distance, NULL));
    for (size_t i = 0; i < QUERIES; i++) {
        double last = -1;
        uint32_t last_index = 0;
        for (size_t n = 0; n < K; n++) { /* the least pair above the last one */
            double best = HUGE_VAL;
            uint32_t best_index = UINT32_MAX;
            for (uint32_t b = 0; b < BALLS; b++) {
                const double d2 = square_to(position + 3 * (size_t)b, from + 3 * i);
                if (!(skip_same && b == i) && (d2 > last || (d2 == last && b > last_index)) && d2 < best) {
                    best = d2;
                    best_index = b;
                }
            }
            if (index[K * i + n] != best_index || distance[K * i + n] != sqrt(best))
                fail_msg("query %zu, rank %zu: ball %u (wanted %u)", i, n, index[K * i + n], best_index);
            last = best;
            last_index = best_index;
        }
    }
}

static void expect_lists(const gbt_balls *balls, gbt_query_kind kind, bool points)
{
    gbt_answers a = {0};
    gbt_error err = {0};
    const gbt_status status =
        kind == GBT_QUERY_WITHIN       ? gbt_balls_within(balls, point, reach, QUERIES, &a, &err)
        : kind == GBT_QUERY_CONTAINING ? gbt_balls_containing(balls, point, QUERIES, &a, &err)
        : kind == GBT_QUERY_OVERLAPPING
            ? gbt_balls_overlapping(balls, point, reach, QUERIES, &a, &err)
            : gbt_balls_crossed(balls, point, dir, t_min, t_max, QUERIES, &a, &err);
    if (status != GBT_OK)
        fail_msg("%s", err.text);
    assert_int_equal(a.count, QUERIES);
    for (size_t i = 0; i < QUERIES; i++) {
        size_t at = a.first[i];
        for (uint32_t b = 0; b < BALLS; b++) {
            const double *c = position + 3 * (size_t)b;
            const bool wanted = is_answer(kind, c, points ? 0 : radius[b], point + 3 * i, dir + 3 * i,
                                          reach[i], t_min[i], t_max[i]);
            const bool got = at < a.first[i + 1] && a.index[at] == b;
            if (wanted != got)
                fail_msg("kind %d, query %zu: ball %u is %s", (int)kind, i, b, got ? "there" : "missing");
            if (got && kind != GBT_QUERY_CROSSED)
                assert_true(a.value[at] == sqrt(square_to(c, point + 3 * i)));
            at += got;
        }
        assert_int_equal(at, a.first[i + 1]);
    }
    gbt_answers_free(&a);
}

static void agrees_with_every_ball(void **state)
{
    (void)state;
    const struct {
        double size, origin;
    } rows[] = {{10, 0}, {500, 5e6}, {1e-3, 0}, {1e30, 1e31}};
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++)
        for (int points = 0; points < 2; points++) {
            gbt_balls *balls;
            make(rows[row].size, rows[row].origin);
            assert_ok(gbt_balls_from_arrays(position, points ? NULL : radius, BALLS, &balls, NULL));
            expect_nearest(balls, false);
            expect_nearest(balls, true);
            for (int kind = GBT_QUERY_WITHIN; kind <= GBT_QUERY_CROSSED; kind++)
                expect_lists(balls, (gbt_query_kind)kind, points);
            gbt_balls_free(balls);
        }
}

static void few_balls(void **state)
{
    (void)state;
    gbt_balls *balls;
    uint32_t index[3];
    double distance[3];
    gbt_answers a = {0};
    assert_ok(gbt_balls_from_arrays(NULL, NULL, 0, &balls, NULL));
    assert_ok(gbt_balls_nearest(balls, (double[]){1, 2, 3}, 1, 3, false, index, distance, NULL));
    assert_true(index[0] == UINT32_MAX && distance[0] == HUGE_VAL);
    assert_ok(gbt_balls_within(balls, (double[]){1, 2, 3}, (double[]){HUGE_VAL}, 1, &a, NULL));
    assert_int_equal(a.first[1], 0);
    assert_ok(gbt_balls_within(balls, NULL, NULL, 0, &a, NULL)); /* no queries */
    assert_int_equal(a.count, 0);
    gbt_balls_free(balls);
    assert_ok(gbt_balls_from_arrays((double[]){0, 0, 0, 0, 0, 0}, NULL, 2, &balls, NULL));
    assert_ok(gbt_balls_nearest(balls, (double[]){3, 4, 0}, 1, 3, false, index, distance, NULL));
    assert_true(index[0] == 0 && index[1] == 1 && index[2] == UINT32_MAX && distance[1] == 5);
    for (int sign = -1; sign <= 1; sign += 2) { /* a ray without ends goes forwards alone */
        assert_ok(
            gbt_balls_crossed(balls, (double[]){0, 0, -1}, (double[]){0, 0, sign}, NULL, NULL, 1, &a, NULL));
        assert_int_equal(a.first[1], sign > 0 ? 2 : 0);
    }
    gbt_answers_free(&a);
    gbt_answers_free(&a);
    gbt_balls_free(balls);
    gbt_answers_free(NULL);
    gbt_balls_free(NULL);
}

/* Refused with a line that says `says`. */
static void assert_refused(gbt_status status, const gbt_error *err, gbt_status wanted, const char *says)
{
    if (status != wanted || strstr(err->text, says) == NULL)
        fail_msg("wanted status %d and \"%s\", got %d: %s", (int)wanted, says, (int)status, err->text);
}

static void what_is_refused(void **state)
{
    (void)state;
    gbt_balls *balls = (gbt_balls *)&state;
    gbt_error err = {0};
    assert_refused(gbt_balls_from_arrays((double[]){0, 0, 0, 0, NAN, 0}, NULL, 2, &balls, &err), &err,
                   GBT_ERR_ARGUMENT, "point 1: bad coordinate");
    assert_null(balls);
    err = (gbt_error){0};
    assert_refused(gbt_balls_from_arrays((double[]){0, -1e101, 0}, NULL, 1, &balls, &err), &err,
                   GBT_ERR_ARGUMENT, "wanted -1e100 to 1e100, got -1e+101");
    err = (gbt_error){0};
    assert_refused(gbt_balls_from_arrays((double[]){0, 0, 0}, (double[]){-1}, 1, &balls, &err), &err,
                   GBT_ERR_ARGUMENT, "point 0: bad radius");
    make(1, 0);
    assert_ok(gbt_balls_from_arrays(position, radius, BALLS, &balls, NULL));
    double distance[2];
    uint32_t index[2];
    const double bad[6] = {0, 0, 0, 0, INFINITY, 0}, good[6] = {0};
    err = (gbt_error){0};
    assert_refused(gbt_balls_nearest(balls, bad, 2, 1, false, index, distance, &err), &err, GBT_ERR_ARGUMENT,
                   "query 1: points: bad query");
    err = (gbt_error){0};
    assert_refused(gbt_balls_nearest(balls, good, 2, 0, false, index, distance, &err), &err, GBT_ERR_ARGUMENT,
                   "k: 0");
    gbt_answers a = {0};
    err = (gbt_error){0};
    assert_refused(gbt_balls_within(balls, good, (double[]){1, NAN}, 2, &a, &err), &err, GBT_ERR_ARGUMENT,
                   "query 1: points: bad search radius");
    err = (gbt_error){0};
    assert_refused(gbt_balls_crossed(balls, good, good, NULL, NULL, 1, &a, &err), &err, GBT_ERR_ARGUMENT,
                   "query 0: points: bad ray");
    err = (gbt_error){0};
    assert_refused(gbt_balls_crossed(balls, good, (double[]){0, 1e-101, 0}, NULL, NULL, 1, &a, &err), &err,
                   GBT_ERR_ARGUMENT, "a component from 1e-100 to 1e100");
    err = (gbt_error){0};
    assert_refused(gbt_balls_containing(balls, (double[]){0, 0, 1e101}, 1, &a, &err), &err, GBT_ERR_ARGUMENT,
                   "wanted coordinates from -1e100 to 1e100");
    assert_null(a.index);
    gbt_balls_free(balls);
}

/* ---- files ---- */

static void expect_printed(const char *path, const gbt_query_def *def, const char *wanted)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    gbt_error err = {0};
    const gbt_status status = gbt_query(path, def, out, &err);
    fclose(out);
    if (status != GBT_OK || strcmp(text, wanted) != 0)
        fail_msg("got %d %s\n%s\nwanted\n%s", (int)status, err.text, text, wanted);
    free(text);
}

/* Not even a header. */
static void expect_refused_silently(const char *path, const gbt_query_def *def, const char *says)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    gbt_error err = {0};
    assert_refused(gbt_query(path, def, out, &err), &err, GBT_ERR_FORMAT, says);
    fclose(out);
    assert_string_equal(text, "");
    free(text);
}

static void files_of_balls_and_queries(void **state)
{
    (void)state;
    const char *balls = in_folder("balls.txt"), *ply = in_folder("balls.ply"), *from = in_folder("from.csv"),
               *bad = in_folder("bad.txt"), *lists = in_folder("lists.ply");
    write_text(balls, "# x y z radius\n0 0 0 1\n\n5000000.25, 0, 0, 2 # far\n");
    write_text(ply, "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\n"
                    "property double z\nproperty float radius\nend_header\n0 0 0 1\n5000000.25 0 0 2\n");
    write_text(from, "0,0,3\n5000000,0,0\n");
    write_text(bad, "1 2 3\n1 2 x\n");
    gbt_query_def def = gbt_query_def_default();
    for (int i = 0; i < 2; i++) {
        const char *path = i == 0 ? balls : ply;
        def.from = from;
        def.kind = GBT_QUERY_NEAREST;
        expect_printed(
            path, &def,
            "query,rank,ball,distance,x,y,z,radius\n0,0,0,3,0,0,0,1\n1,0,1,0.25,5000000.25,0,0,2\n");
        def.kind = GBT_QUERY_CONTAINING;
        expect_printed(path, &def, "query,rank,ball,distance,x,y,z,radius\n1,0,1,0.25,5000000.25,0,0,2\n");
        def.kind = GBT_QUERY_OVERLAPPING;
        def.from = NULL;
        def.at = "0,0,3";
        def.radius = 2;
        expect_printed(path, &def, "query,rank,ball,distance,x,y,z,radius\n0,0,0,3,0,0,0,1\n");
        def.kind = GBT_QUERY_CROSSED;
        def.at = "-1,0,-2,0,0,1";
        expect_printed(path, &def, "query,rank,ball,t,x,y,z,radius\n0,0,0,2,0,0,0,1\n");
        def.at = "-1,0,-2,0,0,1,0,1.9";
        expect_printed(path, &def, "query,rank,ball,t,x,y,z,radius\n");
        def.at = NULL;
    }
    gbt_error err = {0};
    def.from = ply;
    assert_refused(gbt_query(balls, &def, stdout, &err), &err, GBT_ERR_FORMAT, "vertices have no direction");
    err = (gbt_error){0};
    write_text(lists,
               "ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar float x\nproperty float y\n"
               "property float z\nend_header\n1 5 2 3\n");
    def.from = NULL;
    def.kind = GBT_QUERY_NEAREST;
    def.at = "0,0,0";
    assert_refused(gbt_query(lists, &def, stdout, &err), &err, GBT_ERR_FORMAT, "property x is a list");
    err = (gbt_error){0};
    def = gbt_query_def_default();
    assert_refused(gbt_query(balls, &def, stdout, &err), &err, GBT_ERR_ARGUMENT,
                   "at, from: neither is given");
    err = (gbt_error){0};
    def.kind = (gbt_query_kind)9;
    assert_refused(gbt_query(balls, &def, stdout, &err), &err, GBT_ERR_ARGUMENT, "kind: 9 (wanted 0 to 4)");
    def.kind = GBT_QUERY_NEAREST;
    err = (gbt_error){0};
    def.at = "1,2";
    assert_refused(gbt_query(balls, &def, stdout, &err), &err, GBT_ERR_FORMAT, "at:1: 2 numbers");
    err = (gbt_error){0};
    def.at = "1,2,3";
    assert_refused(gbt_query(bad, &def, stdout, &err), &err, GBT_ERR_FORMAT, ":2: not a row of numbers");
    static const char *const gaps[] = {"1,,2,3", ",1,2,3", "1, ,2,3", "1,2,3,,", " , 1 2 3", ","};
    for (size_t i = 0; i < sizeof gaps / sizeof *gaps; i++) {
        err = (gbt_error){0};
        def.at = gaps[i];
        assert_refused(gbt_query(balls, &def, stdout, &err), &err, GBT_ERR_FORMAT,
                       "at:1: not a row of numbers");
    }
    static const char *const beyond[] = {"0,nan,0", "-inf,0,0", "1e101,0,0"};
    for (size_t i = 0; i < sizeof beyond / sizeof *beyond; i++) {
        def.at = beyond[i];
        expect_refused_silently(balls, &def, "at: query 0: points: bad query");
    }
    write_text(bad, "1 2 3\n1 2 nan\n");
    def.at = NULL;
    def.from = bad;
    expect_refused_silently(balls, &def, "bad.txt: query 1: points: bad query");
    def.kind = GBT_QUERY_CONTAINING;
    expect_refused_silently(balls, &def, "bad.txt: query 1: points: bad query");
    write_text(bad, "\xef\xbb\xbf"
                    "1 2 0\r\n");
    expect_printed(balls, &def, "query,rank,ball,distance,x,y,z,radius\n");
    def.kind = GBT_QUERY_NEAREST;
    def.from = NULL;
    def.at = "0 , 0\t,3, # a comma at the end may stay";
    expect_printed(balls, &def, "query,rank,ball,distance,x,y,z,radius\n0,0,0,3,0,0,0,1\n");
    def.at = "1,2,3";
    err = (gbt_error){0};
    assert_refused(gbt_query("/nowhere/run", &def, stdout, &err), &err, GBT_ERR_IO, "/nowhere/run");
    err = (gbt_error){0};
    assert_refused(gbt_query(balls, &(gbt_query_def){.at = "1,2,3", .k = 1}, stdout, &err), &err,
                   GBT_ERR_ARGUMENT, "gbt_query_def_default");
}

/* The ball of an anchor holds all of its Gaussians, to where their response is 1/255, from anywhere. */
static void balls_hold_what_anchors_show(void **state)
{
    (void)state;
    enum { COUNT = 200, OFFSETS = 4 };
    const char *path = in_folder("model.gbt");
    model m = {.anchors.offset_count = OFFSETS, .origin = {5e5, -4.5e6, 0.1}, .voxel_size = 1, .extent = 1};
    assert_ok(anchors_resize(&m.anchors, COUNT, NULL));
    for (size_t i = 0; i < 3 * COUNT; i++)
        m.anchors.position[i] = 10 * (float)rng_normal(1, 0, i);
    for (size_t i = 0; i < ANCHOR_FEATURE_DIM * COUNT; i++)
        m.anchors.feature[i] = (float)rng_normal(1, 1, i);
    for (size_t i = 0; i < 3 * OFFSETS * COUNT; i++)
        m.anchors.offset[i] = (float)rng_normal(1, 2, i);
    for (size_t i = 0; i < 6 * COUNT; i++)
        m.anchors.scale_log[i] = i == 7 ? -60 : (float)rng_normal(1, 3, i);
    assert_ok(decoder_init(&m.decoder, OFFSETS, false, 9, NULL));
    assert_ok(model_save(path, &m, NULL));
    gbt_balls *balls;
    assert_ok(gbt_balls_open(path, &balls, NULL));
    const gbt_balls_view v = gbt_balls_get(balls);
    assert_true(v.anchors && v.count == COUNT);
    size_t seen = 0;
    double fullest = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        const float *center = m.anchors.position + 3 * i;
        for (size_t c = 0; c < 3; c++)
            assert_true(v.position[3 * i + c] == (double)center[c] + m.origin[c]);
        gaussians g = {0};
        decode_tape tape = {0};
        const float eye[3] = {(float)rng_normal(2, 0, i), (float)rng_normal(2, 1, i), 3};
        assert_ok(decode_forward(&m.anchors, &m.decoder, eye, &i, 1, 1.0f / 255, &g, &tape, NULL));
        for (size_t k = 0; k < g.count; k++, seen++) {
            const double x = (double)g.mean_x[k] - (double)center[0],
                         y = (double)g.mean_y[k] - (double)center[1],
                         z = (double)g.mean_z[k] - (double)center[2];
            const double scale = fmax((double)g.scale_x[k], fmax((double)g.scale_y[k], (double)g.scale_z[k]));
            const double far = sqrt(x * x + y * y + z * z) +
                               scale * sqrt(2 * log(255 * fmax((double)g.opacity[k], 1.0 / 255)));
            assert_true(far <= v.radius[i] + 1e-5);
            fullest = fmax(fullest, far / v.radius[i]);
        }
        gaussians_free(&g);
        decode_tape_free(&tape);
    }
    assert_true(seen > COUNT && fullest > 0.5);
    gbt_balls_free(balls);
    model_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_every_ball),
        cmocka_unit_test(few_balls),
        cmocka_unit_test(what_is_refused),
        cmocka_unit_test(files_of_balls_and_queries),
        cmocka_unit_test(balls_hold_what_anchors_show),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
