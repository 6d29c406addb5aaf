/* SPDX-License-Identifier: Apache-2.0 */
/* tests/study/test_study.c -- lists of kernels, passes in turn, rows of gradients, and a chart whose words
   cover nothing. */
#include "base/memory.h"
#include "base/near.h"
#include "benchmark/bench_passes.h"
#include "benchmark/bench_reference.h"
#include "benchmark/check_grad.h"
#include "study/chart.h"
#include "trace/random_scene.h"

static void lists_of_kernels(void **state)
{
    (void)state;
    int k[3];
    assert_int_equal(bench_kernels_parse("tree", k, 3), 1);
    assert_int_equal(k[0], TRACE_TREE);
    assert_int_equal(bench_kernels_parse("embree,tree,single", k, 3), 3);
    assert_true(k[0] == TRACE_EMBREE && k[1] == TRACE_TREE && k[2] == TRACE_SINGLE);
    static const char *const bad[] = {"",          "trees",       "tre",
                                      "tree,",     ",tree",       "tree,,embree",
                                      "tree,tree", "tree embree", "tree,single,embree,tree"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(bench_kernels_parse(bad[i], k, 3), 0);
    for (int i = 0; i < BENCH_KERNELS; i++) {
        assert_int_equal(bench_kernels_parse(bench_kernel_name(i), k, 3), 1);
        assert_int_equal(k[0], i);
    }
}

static void ways_in_turn(void **state)
{
    (void)state;
    enum { WAYS = 5 };
    gaussians g = random_gaussians(300, 0.1f, 8);
    ray_image rays = pinhole_rays(48, 32);
    const trace_settings s = trace_settings_default();
    const cpu_isa before = cpu_best_isa();
    const gbt_camera camera = pinhole_camera(48, 32);
    const bench_splat splat = {&camera, &g, RASTER_PER_RAY};
    bench_way ways[WAYS] = {{.kernel = TRACE_TREE, .isa = CPU_AVX512, .settings = s},
                            {.kernel = TRACE_EMBREE, .isa = CPU_AVX512, .settings = s},
                            {.kernel = TRACE_TREE, .isa = CPU_PLAIN, .settings = s},
                            {.kernel = TRACE_TREE, .isa = CPU_AVX512, .settings = s, .splat = &splat},
                            {.kernel = TRACE_LIST, .isa = CPU_AVX512, .settings = s}};
    assert_ok(bench_measure(ways, WAYS, &g, &rays, 2, NULL));
    assert_int_equal(cpu_best_isa(), before);
    bench_reference want = {0};
    assert_ok(bench_reference_make(&g, &s, &rays, &want, NULL));
    assert_int_equal(ray_image_count(&want.rays), 6 * 4);
    for (int i = 0; i < WAYS; i++) {
        const bench_figures *f = &ways[i].figures;
        assert_true((f->build_ms > 0 || ways[i].splat != NULL) && f->build_us >= 0 && f->forward_us > 0 &&
                    f->adjoint_us > 0 && f->forward_seconds > 0 && f->adjoint_seconds > 0);
        assert_int_equal(f->counters.rays, 48 * 32);
        assert_true(f->counters.blended > 0 && (ways[i].splat != NULL || (f->tree_bytes + f->list_bytes > 0 &&
                                                                          f->record_bytes == 300 * 64)));
        assert_true(bench_reference_compare(&want, &ways[i].rgb).psnr > 90);
    }
    assert_memory_equal(ways[0].rgb.pixels, ways[2].rgb.pixels, 3 * 48 * 32 * sizeof(float));
    assert_true(ways[0].figures.counters.tape_bytes > 1000);
    assert_true(ways[4].figures.tree_bytes == 0 && ways[4].figures.list_bytes > 300 * 104);
    ways[0].rgb.pixels[3 * (8 * 48 + 16) + 1] += 0.5f; /* pixel (16, 8) is one of those that count */
    const bench_error off = bench_reference_compare(&want, &ways[0].rgb);
    assert_near(off.max, 0.5, 1e-4);
    assert_near(off.psnr, -10 * log10(0.25 / 72), 0.01);
    ways[0].rgb.pixels[3 * (8 * 48 + 16) + 1] = NAN; /* no picture is right that holds one */
    const bench_error none = bench_reference_compare(&want, &ways[0].rgb);
    assert_true(isnan(none.max) && isnan(none.psnr));
    for (int i = 0; i < WAYS; i++)
        bench_way_free(&ways[i]);
    bench_reference_free(&want);
    gaussians_free(&g);
    ray_image_free(&rays);
}

/* ---- the chart ---- */

static char *draw(const scatter_point *points, size_t count, const scatter_level *levels, size_t level_count)
{
    const scatter_chart chart = {.title = "a < b",
                                 .note = "note",
                                 .x_unit = "x",
                                 .y_unit = "y",
                                 .series = {"zero", "one", "two"},
                                 .points = points,
                                 .point_count = count,
                                 .levels = levels,
                                 .level_count = level_count};
    text out = {0};
    scatter_draw(&out, &chart, 7);
    assert_int_equal(out.status, GBT_OK);
    char *svg = mem_calloc(out.length + 1, 1, "test", NULL);
    memcpy(svg, out.bytes, out.length);
    text_free(&out);
    return svg;
}

static size_t count_of(const char *svg, const char *part)
{
    size_t count = 0;
    for (const char *at = strstr(svg, part); at != NULL; at = strstr(at + 1, part))
        count++;
    return count;
}

static void gradients_beyond_their_limits(void **state)
{
    (void)state;
    static grad_checker c;
    char *rows = NULL;
    size_t size;
    c.out = open_memstream(&rows, &size);
    grad_print_row(&c, "tracer", "mean", 0.5e-4, 1e-4);
    grad_print_row(&c, "tracer", "scale", 2e-4, 1e-4);
    grad_print_row(&c, "tracer", "opacity", (double)NAN, 1e-4);
    fclose(c.out);
    assert_int_equal(c.broken, 2);
    assert_int_equal(count_of(rows, "  broken\n"), 2);
    free(rows);
}

static void chart_of_nothing(void **state)
{
    (void)state;
    const scatter_point bad[] = {{0, NAN, 1, "a"}, {1, 0, 1, "b"}, {2, -1, 1, "c"}, {1, 1, INFINITY, "d"}};
    const scatter_level level = {3, "level"};
    char *svg = draw(bad, 4, &level, 1);
    assert_non_null(strstr(svg, "nothing was measured"));
    assert_non_null(strstr(svg, "a &lt; b"));
    assert_int_equal(count_of(svg, "class=\"mark"), 0);
    mem_free(svg);
}

static void one_point_is_a_chart(void **state)
{
    (void)state;
    const scatter_point one = {0, 0.25, 50, "only"};
    char *svg = draw(&one, 1, NULL, 0);
    assert_int_equal(count_of(svg, "class=\"label s0\""), 1);
    assert_non_null(strstr(svg, ">only</text>"));
    const char *x = strstr(svg, "<g class=\"x\">");
    assert_non_null(x);
    assert_true(count_of(x, "<text x=") >= 2); /* ticks */
    assert_int_equal(count_of(svg, "class=\"unit\""), 2);
    assert_null(strstr(svg, "nan"));
    mem_free(svg);
}

/* A chart of speed: the mark at the left edge has neighbours on all sides. */
static void crowded_marks_have_names(void **state)
{
    (void)state;
    static const scatter_point points[] = {
        {0, 0.602, 106.3, "exact"}, {0, 0.266, 54.1, "default"}, {0, 0.174, 40.7, "fast"},
        {1, 0.52, 85.1, "1e-4"},    {1, 0.338, 65.6, "0.001"},   {1, 0.213, 46.3, "0.01"},
        {1, 0.18, 40.7, "0.02"},    {1, 0.133, 33.3, "0.05"},    {2, 0.118, 41.3, "EWA splats"},
        {2, 4.789, 54.1, "plain"},
    };
    enum { COUNT = sizeof points / sizeof *points };
    char *svg = draw(points, COUNT, NULL, 0);
    assert_int_equal(count_of(svg, "class=\"label"), COUNT);
    mem_free(svg);
}

/* Where words start, and how wide their letters make them, at least. */
static void words_cover_nothing(void **state)
{
    (void)state;
    enum { COUNT = 40 };
    scatter_point points[COUNT];
    const scatter_level levels[] = {{50, "first level"}, {50.4, "second level"}};
    for (uint64_t i = 0; i < COUNT; i++) /* a heap of points around one place, and the named ones in it */
        points[i] = (scatter_point){i < 3 ? 0 : 1 + (int)(i % 2), exp(0.3 * rng_normal(3, 0, i)),
                                    50 + 4 * rng_normal(3, 1, i), i < 3 ? "named" : "0.0123"};
    char *svg = draw(points, COUNT, levels, 2);
    double x[64], y[64], width[64];
    size_t count = 0, large = 0;
    for (const char *at = strstr(svg, "class=\"l"); at != NULL; at = strstr(at + 1, "class=\"l")) {
        char kind[16];
        if (sscanf(at, "class=\"%15[a-z-]", kind) == 1 && strcmp(kind, "label") != 0 &&
            strcmp(kind, "level-label") != 0)
            continue;
        const char *place = strstr(at, "x=\"");
        assert_int_equal(sscanf(place, "x=\"%lf\" y=\"%lf\"", &x[count], &y[count]), 2);
        const char *word = strchr(place, '>') + 1;
        width[count++] = 5.5 * (double)strcspn(word, "<");
        large += strncmp(word, "named", 5) == 0;
    }
    assert_true(count > 15 && count < COUNT + 2); /* there is no room for all */
    assert_int_equal(large, 3);                   /* but for the named ones, which come first */
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < i; j++)
            assert_false(fabs(y[i] - y[j]) < 9 && x[i] < x[j] + width[j] && x[j] < x[i] + width[i]);
    assert_int_equal(count_of(svg, "<title>"), COUNT);
    mem_free(svg);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_of_kernels),
        cmocka_unit_test(ways_in_turn),
        cmocka_unit_test(chart_of_nothing),
        cmocka_unit_test(one_point_is_a_chart),
        cmocka_unit_test(crowded_marks_have_names),
        cmocka_unit_test(words_cover_nothing),
        cmocka_unit_test(gradients_beyond_their_limits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
