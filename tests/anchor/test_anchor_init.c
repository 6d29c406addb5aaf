/* SPDX-License-Identifier: Apache-2.0 */
/* tests/anchor/test_anchor_init.c -- GBAI, GBSP, adaptive balls, random points and the voxel baseline,
   against hand values and double. */
#include "fixture.h"

#include "anchor/init.h"
#include "base/parallel.h"
#include "gb/adaptive.h"

static anchor_init_def def_with_voxel(float voxel_size)
{
    anchor_init_def def = anchor_init_def_default();
    def.balls.voxel_size = voxel_size;
    return def;
}

static void random_cloud(float *position, size_t count, uint64_t seed)
{
    for (size_t i = 0; i < count * 3; i++)
        position[i] = spread(seed, 0, i, -1.0f, 1.0f) * (i / 3 % 5 == 0 ? 4.0f : 1.0f);
}

/* Squared distances to the other anchors, in double. */
static double square_distance(const anchors *a, size_t i, size_t j)
{
    double sum = 0;
    for (size_t c = 0; c < 3; c++) {
        const double d = (double)a->position[i * 3 + c] - (double)a->position[j * 3 + c];
        sum += d * d;
    }
    return sum;
}

static void assert_scale(const anchors *a, size_t i, double scale)
{
    for (size_t c = 0; c < 6; c++)
        if (!(fabs((double)a->scale_log[i * 6 + c] - log(scale)) <= 2e-6 * fmax(1, fabs(log(scale)))))
            fail_msg("anchor %zu: log-scale %.9g, not %.9g", i, (double)a->scale_log[i * 6 + c], log(scale));
}

static double expected_prior(const anchors *a, const balls *b, size_t i, const anchor_init_def *def)
{
    double near = HUGE_VAL;
    for (size_t j = 0; j < a->count; j++) {
        const double square = square_distance(a, i, j);
        if (square > 0)
            near = fmin(near, sqrt(square));
    }
    const double radius = (double)b->radius[i];
    if (near == HUGE_VAL)
        near = radius;
    const double clipped = fmin(fmax(radius, (double)def->clip_min * near), (double)def->clip_max * near);
    const double fused = (double)def->fusion * near + (1 - (double)def->fusion) * clipped;
    return fmin(fmax(fused, (double)(def->balls.min_scale * def->balls.voxel_size)), (double)def->scale_max);
}

static double expected_spacing(const anchors *a, size_t i)
{
    double best[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL};
    for (size_t j = 0; j < a->count; j++) {
        double square = square_distance(a, i, j);
        if (j == i)
            continue;
        for (int k = 0; k < 3; k++)
            if (square < best[k]) {
                const double larger = best[k];
                best[k] = square;
                square = larger;
            }
    }
    double sum = 0;
    int count = 0;
    while (count < 3 && best[count] < HUGE_VAL)
        sum += best[count++];
    return sqrt(fmax(sum / count, 1e-7));
}

static void anchors_stand_on_ball_centers(void **state)
{
    (void)state;
    static float position[900 * 3];
    random_cloud(position, 900, 1);
    const float fusions[3] = {0.5f, 0.0f, 1.0f};
    for (int f = 0; f < 3; f++) {
        anchor_init_def def = def_with_voxel(0.05f);
        def.fusion = fusions[f];
        def.offset_count = 4;
        anchors a;
        balls b, again;
        assert_ok(anchors_init(position, NULL, 900, &def, &a, &b, NULL));
        assert_ok(balls_build(position, NULL, 900, &def.balls, &again, NULL));
        assert_true(a.count > 300 && a.count == again.count && b.count == a.count);
        assert_int_equal(a.offset_count, 4);
        assert_memory_equal(a.position, again.center, a.count * 3 * sizeof(float));
        for (size_t i = 0; i < a.count; i++)
            assert_scale(&a, i, expected_prior(&a, &b, i, &def));
        for (size_t i = 0; i < a.count * 32; i++)
            assert_true(a.feature[i] == 0.0f);
        for (size_t i = 0; i < a.count * 12; i++)
            assert_true(a.offset[i] == 0.0f);
        anchors_free(&a);
        balls_free(&b);
        balls_free(&again);
    }
}

static size_t half_of_the_papers(const float *position, const float *color, size_t count)
{
    const anchor_init_def def = def_with_voxel(0.05f);
    balls paper;
    assert_ok(balls_build(position, color, count, &def.balls, &paper, NULL));
    const size_t half = paper.count / 2;
    balls_free(&paper);
    assert_true(half > 100);
    return half;
}

static void adaptive_anchors_stand_on_adaptive_balls(void **state)
{
    (void)state;
    static float position[900 * 3], color[900 * 3];
    random_cloud(position, 900, 6);
    for (size_t i = 0; i < 900 * 3; i++)
        color[i] = spread(6, 1, i, 0.0f, 1.0f);
    const struct {
        double fraction;
        size_t count;
    } rows[] = {
        {0, half_of_the_papers(position, color, 900)}, {0.25, 225}, {0.3334, 301}, {1e-6, 1}, {1, 900}};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        anchor_init_def def = def_with_voxel(0.05f);
        def.kind = GBT_INIT_ADAPTIVE;
        def.fraction = rows[r].fraction;
        adaptive_def like = adaptive_def_default();
        like.voxel_size = 0.05f;
        like.balls_max = rows[r].count;
        anchors a;
        balls b, again;
        assert_ok(anchors_init(position, color, 900, &def, &a, &b, NULL));
        assert_ok(balls_adapt(position, color, 900, &like, &again, NULL));
        assert_true(a.count == rows[r].count && b.count == a.count && again.count == a.count);
        assert_memory_equal(a.position, again.center, a.count * 3 * sizeof(float));
        for (size_t i = 0; i < a.count; i++)
            assert_scale(&a, i, a.count > 1 ? expected_spacing(&a, i) : 0.05); /* whatever def.scale says */
        anchors_free(&a);
        balls_free(&b);
        balls_free(&again);
    }
}

static void random_anchors_are_some_of_the_points(void **state)
{
    (void)state;
    static float position[1000 * 3];
    random_cloud(position, 1000, 7);
    const struct {
        double fraction;
        size_t count;
    } rows[] = {
        {0, half_of_the_papers(position, NULL, 1000)}, {0.25, 250}, {0.0001, 1}, {0.9991, 1000}, {1, 1000}};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        anchor_init_def def = def_with_voxel(0.05f);
        def.kind = GBT_INIT_RANDOM;
        def.fraction = rows[r].fraction;
        anchors a;
        balls b;
        assert_ok(anchors_init(position, NULL, 1000, &def, &a, &b, NULL));
        assert_true(a.count == rows[r].count && b.count == 0);
        size_t i = 0, first_half = 0;
        for (size_t j = 0; j < a.count; j++, i++) { /* a subsequence: each point once at most */
            while (i < 1000 && memcmp(a.position + 3 * j, position + 3 * i, 3 * sizeof(float)) != 0)
                i++;
            assert_true(i < 1000);
            first_half += i < 500;
            if (a.count > 1)
                assert_scale(&a, j, expected_spacing(&a, j));
        }
        assert_true(a.count < 100 || (first_half > a.count * 4 / 10 && first_half < a.count * 6 / 10));
        anchors other;
        def.seed = 1;
        assert_ok(anchors_init(position, NULL, 1000, &def, &other, NULL, NULL));
        assert_true(other.count == a.count &&
                    (a.count == 1000) ==
                        (memcmp(other.position, a.position, 3 * a.count * sizeof *a.position) == 0));
        anchors_free(&other);
        anchors_free(&a);
    }
}

static void neighbour_scale(void **state)
{
    (void)state;
    static float position[600 * 3];
    random_cloud(position, 600, 2);
    for (int kind = 0; kind <= 1; kind++) {
        anchor_init_def def = def_with_voxel(0.3f);
        def.kind = kind == 0 ? GBT_INIT_GB : GBT_INIT_VOXEL;
        def.scale = kind == 0 ? GBT_SCALE_PRIOR_NN
                              : GBT_SCALE_PRIOR_GB; /* voxels have no balls: the neighbour rule in any case */
        anchors a;
        balls b;
        assert_ok(anchors_init(position, NULL, 600, &def, &a, &b, NULL));
        assert_true(a.count > 100);
        for (size_t i = 0; i < a.count; i++)
            assert_scale(&a, i, expected_spacing(&a, i));
        if (kind == 1) {
            float *centers;
            size_t count;
            assert_ok(voxel_centers(position, 600, 0.3f, &centers, &count, NULL));
            assert_int_equal(count, a.count);
            assert_memory_equal(centers, a.position, count * 3 * sizeof(float));
            assert_true(b.count == 0 && b.radius == NULL);
            mem_free(centers);
        }
        anchors_free(&a);
        balls_free(&b);
    }
}

typedef struct hand_case {
    const char *name;
    gbt_init_kind kind;
    gbt_scale_prior scale;
    size_t count;
    float position[12];
    size_t expected_count;
    double expected[4]; /* scales; v = 1, so s_min = 0.25 */
    float scale_max;
} hand_case;

static hand_case hand_cases[] = {
    /* Two pairs along x, 10 apart: radii 0.5, d_nn = 10. clip(0.5, 2.5, 40) = 2.5; 5 + 1.25 = 6.25. */
    {"two far pairs: the lower clip",
     GBT_INIT_GB,
     GBT_SCALE_PRIOR_GB,
     4,
     {0, 0, 0, 1, 0, 0, 10, 0, 0, 11, 0, 0},
     2,
     {6.25, 6.25},
     INFINITY},
    {"the cap wins",
     GBT_INIT_GB,
     GBT_SCALE_PRIOR_GB,
     4,
     {0, 0, 0, 1, 0, 0, 10, 0, 0, 11, 0, 0},
     2,
     {2, 2},
     2},
    /* Pairs of width 2.5 that are 4 apart: r = 1.25 is inside [1, 16]: 2 + 0.625. */
    {"two near pairs: no clip",
     GBT_INIT_GB,
     GBT_SCALE_PRIOR_GB,
     4,
     {0, 0, 0, 2.5f, 0, 0, 4, 0, 0, 6.5f, 0, 0},
     2,
     {2.625, 2.625},
     INFINITY},
    /* A lone pair is one ball: no neighbour, s_nn := r = 1.5. */
    {"one ball: its radius", GBT_INIT_GB, GBT_SCALE_PRIOR_GB, 2, {0, 0, 0, 3, 0, 0}, 1, {1.5}, INFINITY},
    {"one point: the finest scale", GBT_INIT_GB, GBT_SCALE_PRIOR_GB, 1, {5, 5, 5}, 1, {0.25}, INFINITY},
    {"the cap wins over the floor", GBT_INIT_GB, GBT_SCALE_PRIOR_GB, 1, {5, 5, 5}, 1, {0.125}, 0.125f},
    {"coincident points are one ball",
     GBT_INIT_GB,
     GBT_SCALE_PRIOR_GB,
     3,
     {1, 2, 3, 1, 2, 3, 1, 2, 3},
     1,
     {0.25},
     INFINITY},
    {"no point", GBT_INIT_GB, GBT_SCALE_PRIOR_GB, 0, {0}, 0, {0}, INFINITY},
    {"voxels: no point", GBT_INIT_VOXEL, GBT_SCALE_PRIOR_NN, 0, {0}, 0, {0}, INFINITY},
    {"voxels: a lone one takes the voxel size",
     GBT_INIT_VOXEL,
     GBT_SCALE_PRIOR_NN,
     1,
     {5.2f, 5, 5},
     1,
     {1},
     INFINITY},
    {"voxels: one neighbour",
     GBT_INIT_VOXEL,
     GBT_SCALE_PRIOR_NN,
     2,
     {0, 0, 0, 3.1f, 4.2f, 0},
     2,
     {5, 5},
     INFINITY},
    {"voxels: two neighbours",
     GBT_INIT_VOXEL,
     GBT_SCALE_PRIOR_NN,
     3,
     {0, 0, 0, 1, 0, 0, 3, 0, 0},
     3,
     {2.2360679774997898, 1.5811388300841898, 2.5495097567963922},
     INFINITY},
    {"voxels: three neighbours",
     GBT_INIT_VOXEL,
     GBT_SCALE_PRIOR_NN,
     4,
     {0, 0, 0, 0, 0, 2, 0, 3, 0, 6, 0, 0},
     4,
     {4.041451884327381, 4.358898943540674, 4.725815626252609, 6.350852961085884},
     INFINITY},
};

static void scales_by_hand(void **state)
{
    const hand_case *c = *state;
    anchor_init_def def = def_with_voxel(1.0f);
    def.kind = c->kind;
    def.scale = c->scale;
    def.scale_max = c->scale_max;
    anchors a;
    assert_ok(anchors_init(c->position, NULL, c->count, &def, &a, NULL, NULL));
    assert_int_equal(a.count, c->expected_count);
    for (size_t i = 0; i < a.count; i++)
        assert_scale(&a, i, c->expected[i]);
    anchors_free(&a);
}

static void tiny_scales_have_a_floor(void **state)
{
    (void)state;
    anchor_init_def def =
        def_with_voxel(1e-9f); /* everything below the floors: eps, and sqrt(1e-7) of the baseline */
    def.balls.min_radius = BALLS_PAPER_MIN_RADIUS;
    anchors a;
    const float close[12] = {0, 0, 0, 1e-8f, 0, 0, 2e-8f, 0, 0, 3e-8f, 0, 0};
    for (int nn = 0; nn <= 1; nn++) {
        def.scale = nn == 1 ? GBT_SCALE_PRIOR_NN : GBT_SCALE_PRIOR_GB;
        def.kind = nn == 1 ? GBT_INIT_VOXEL : GBT_INIT_GB;
        assert_ok(anchors_init(close, NULL, 4, &def, &a, NULL, NULL));
        assert_true(a.count > 1);
        for (size_t i = 0; i < a.count; i++)
            assert_scale(&a, i, nn == 1 ? sqrt(1e-7) : 1e-6);
        anchors_free(&a);
    }
    def.kind = GBT_INIT_GB; /* in our rules no unit of length is meant: eps is v / 4 */
    def.scale = GBT_SCALE_PRIOR_GB;
    def.balls.voxel_size = 1e-7f;
    def.balls.min_radius = 0;
    assert_ok(anchors_init(close, NULL, 4, &def, &a, NULL, NULL));
    for (size_t i = 0; i < a.count; i++)
        assert_scale(&a, i, 0.25e-7);
    anchors_free(&a);
    float scale[4]; /* of points in one place, in any unit of length */
    assert_ok(
        anchor_scales_from_spacing((const float[12]){0}, 4, ANCHOR_SPACING_LEAST(1e-9f), 2, 1, scale, NULL));
    assert_true(fabsf(scale[3] / (2e-9f / 64) - 1) < 1e-5f);
}

static void same_bits_for_all_threads(void **state)
{
    (void)state;
    static float position[5000 * 3];
    random_cloud(position, 5000, 3);
    const int before = parallel_threads();
    const anchor_init_def def = def_with_voxel(0.01f);
    uint64_t hash[2];
    for (int t = 0; t < 2; t++) {
        parallel_set_threads(t == 0 ? 1 : 5);
        anchors a;
        assert_ok(anchors_init(position, NULL, 5000, &def, &a, NULL, NULL));
        hash[t] = hash_bytes(hash_bytes(1, a.position, a.count * 3 * sizeof(float)), a.scale_log,
                             a.count * 6 * sizeof(float));
        anchors_free(&a);
    }
    parallel_set_threads(before);
    assert_true(hash[0] == hash[1]);
}

static void wrong_arguments_are_refused(void **state)
{
    (void)state;
    const float position[3] = {0};
    for (int t = 0; t < 11; t++) {
        anchor_init_def def = def_with_voxel(1.0f);
        switch (t) {
        case 0:
            def.balls.voxel_size = 0.0f;
            break;
        case 1:
            def.balls.voxel_size = NAN;
            break;
        case 2:
            def.offset_count = 0;
            break;
        case 3:
            def.offset_count = ANCHOR_MAX_OFFSETS + 1;
            break;
        case 4:
            def.fusion = 1.5f;
            break;
        case 5:
            def.clip_min = 5.0f;
            break;
        case 6:
            def.scale_max = 0.0f;
            break;
        case 7:
            def.fraction = -0.1;
            break;
        case 8:
            def.fraction = 1.001;
            break;
        case 9:
            def.fraction = NAN;
            break;
        default:
            def.balls.max_depth = 65;
            break;
        }
        anchors a;
        balls b;
        gbt_error err = {0};
        assert_int_equal(anchors_init(position, NULL, 1, &def, &a, &b, &err), GBT_ERR_ARGUMENT);
        assert_string_not_equal(err.text, "");
        assert_true(a.position == NULL && a.count == 0 && b.center == NULL);
    }
    const float bad[3] = {0, NAN, 0};
    anchors a;
    for (gbt_init_kind kind = GBT_INIT_GB; kind <= GBT_INIT_RANDOM; kind++) {
        anchor_init_def def = def_with_voxel(1.0f);
        def.kind = kind;
        assert_int_equal(anchors_init(bad, NULL, 1, &def, &a, NULL, NULL), GBT_ERR_ARGUMENT);
    }
}

static void no_memory_is_an_error(void **state)
{
    (void)state;
    static float position[50 * 3];
    random_cloud(position, 50, 4);
    for (gbt_init_kind kind = GBT_INIT_GB; kind <= GBT_INIT_RANDOM; kind++) {
        anchor_init_def def = def_with_voxel(0.1f);
        def.kind = kind;
        long n = 0;
        for (;; n++) {
            anchors a;
            balls b;
            gbt_error err = {0};
            mem_fail_after(n);
            const gbt_status status = anchors_init(position, NULL, 50, &def, &a, &b, &err);
            mem_fail_after(-1);
            if (status == GBT_OK) {
                anchors_free(&a);
                balls_free(&b);
                break;
            }
            assert_int_equal(status, GBT_ERR_NO_MEMORY);
            assert_true(err.text[0] != '\0' && a.position == NULL && b.center == NULL);
        }
        assert_true(n > 5);
    }
}

int main(void)
{
    struct CMUnitTest tests[32];
    size_t count = 0;
    for (size_t i = 0; i < sizeof hand_cases / sizeof *hand_cases; i++)
        tests[count++] = (struct CMUnitTest){
            .name = hand_cases[i].name, .test_func = scales_by_hand, .initial_state = &hand_cases[i]};
    const struct CMUnitTest single[] = {
        cmocka_unit_test(anchors_stand_on_ball_centers),
        cmocka_unit_test(neighbour_scale),
        cmocka_unit_test(adaptive_anchors_stand_on_adaptive_balls),
        cmocka_unit_test(random_anchors_are_some_of_the_points),
        cmocka_unit_test(tiny_scales_have_a_floor),
        cmocka_unit_test(same_bits_for_all_threads),
        cmocka_unit_test(wrong_arguments_are_refused),
        cmocka_unit_test(no_memory_is_an_error),
    };
    for (size_t i = 0; i < sizeof single / sizeof *single; i++)
        tests[count++] = single[i];
    return _cmocka_run_group_tests("anchor_init", tests, count, NULL, NULL);
}
