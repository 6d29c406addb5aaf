/* SPDX-License-Identifier: Apache-2.0 */
/* tests/eval/test_compare.c -- two image files compared: the figures of the metrics themselves, alpha and
   formats, what is refused. */
#include "eval/picture_support.h"

#include "gbtrace/evaluate.h"
#include "image/metrics.h"
#include "run/loaded_run.h"

static void write_noise(const char *name, int width, int height, uint64_t seed)
{
    image im = noise(width, height, 3, seed);
    assert_ok(image_write(in_folder("%s", name), &im, NULL));
    image_free(&im);
}

static void figures_are_those_of_the_metrics(void **state)
{
    (void)state;
    write_noise("a.png", 24, 20, 1);
    write_noise("b.exr", 24, 20, 2);
    image a = noise(24, 20, 3, 1), b = noise(24, 20, 3, 2);
    gbt_comparison c;
    double flip;
    assert_ok(gbt_compare_images(in_folder("a.png"), in_folder("b.exr"), NULL, &c, NULL));
    assert_ok(metric_flip(&a, &b, &flip, NULL, NULL));
    assert_true(c.width == 24 && c.height == 20 && c.psnr == metric_psnr(&a, &b) && c.flip == flip);
    double ssim, inside;
    assert_ok(metric_ssim(&a, &b, &ssim, NULL));
    assert_ok(metric_ssim_interior(&a, &b, &inside, NULL));
    assert_true(c.ssim == ssim && c.ssim_interior == inside);
    assert_true(c.ssim != c.ssim_interior && isnan(c.lpips) && isnan(c.lpips_01));
    gbt_comparison in_memory;
    assert_ok(gbt_compare_pictures(a.pixels, b.pixels, 24, 20, &in_memory, NULL));
    assert_memory_equal(&in_memory, &c, sizeof c);
    assert_int_equal(gbt_compare_pictures(a.pixels, b.pixels, 0, 20, &in_memory, NULL), GBT_ERR_ARGUMENT);
    for (int i = 0; i < 2; i++) {
        gbt_error err = {0};
        float *value = &(i == 0 ? a : b).pixels[3 * (24 * 7 + 2) + 1], kept = *value;
        *value = i == 0 ? NAN : INFINITY;
        assert_int_equal(gbt_compare_pictures(a.pixels, b.pixels, 24, 20, &in_memory, &err),
                         GBT_ERR_ARGUMENT);
        assert_string_equal(err.text, i == 0 ? "picture: nan at pixel 2, 7 (wanted finite values)"
                                             : "reference: inf at pixel 2, 7 (wanted finite values)");
        *value = kept;
    }
    assert_ok(gbt_compare_images(in_folder("a.png"), in_folder("a.png"), NULL, &c, NULL));
    assert_true(c.psnr == METRIC_PSNR_MAX && c.ssim == 1 && c.ssim_interior == 1 && c.flip == 0);
    image_free(&a);
    image_free(&b);
}

static void pictures_are_named_after_views(void **state)
{
    (void)state;
    static const char *const names[][2] = {{"a/b.jpg", "a_b"},     {"a.b/c.JPEG", "a.b_c"},
                                           {"1623.25", "1623.25"}, {"1623.25.png", "1623.25"},
                                           {".png", ".png"},       {"\xc3\xa4.png", "\xc3\xa4"}};
    char got[FILE_NAME_SIZE], other[FILE_NAME_SIZE], name[3000];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        loaded_run_file_name(names[i][0], got);
        assert_string_equal(got, names[i][1]);
    }
    /* A long name, of letters of two bytes behind one of one, stays below what file systems take. */
    name[0] = 'a';
    for (size_t i = 1; i + 2 < sizeof name; i += 2)
        memcpy(name + i, "\xc3\xa4", 3);
    loaded_run_file_name(name, got);
    assert_true(strlen(got) == 179 + 17 && got[179] == '-');
    name[sizeof name - 4] = '\0';
    loaded_run_file_name(name, other);
    assert_string_not_equal(got, other);
    /* What is not UTF-8 would be another name in JSON. */
    loaded_run_file_name("x\xe4/y.png", got);
    loaded_run_file_name("x\xf6/y.png", other);
    assert_true(strncmp(got, "x__y-", 5) == 0 && strlen(got) == 4 + 17);
    assert_string_not_equal(got, other);
    /* Two views never share one. */
    scene_view views[] = {
        {.name = "a.png"}, {.name = "a.jpg"}, {.name = "b/c"}, {.name = "b_c.png"}, {.name = "d.png"}};
    const loaded_run run = {.scene = {.views = views, .view_count = 5}};
    static const char *const starts[] = {"a-", "a-", "b_c-", "b_c-", "d"};
    for (size_t i = 0; i < 5; i++) {
        loaded_run_view_name(&run, i, got);
        assert_int_equal(strncmp(got, starts[i], strlen(starts[i])), 0);
        for (size_t k = 0; k < i; k++) {
            loaded_run_view_name(&run, k, other);
            assert_string_not_equal(got, other);
        }
    }
    assert_string_equal(got, "d");
}

static void alpha_is_left_out(void **state)
{
    (void)state;
    image with = noise(16, 16, 4, 5), without;
    assert_ok(image_alloc(&without, 16, 16, 3, NULL));
    for (int i = 0; i < 16 * 16; i++)
        memcpy(without.pixels + 3 * i, with.pixels + 4 * i, 3 * sizeof(float));
    assert_ok(image_write(in_folder("with.png"), &with, NULL));
    assert_ok(image_write(in_folder("without.png"), &without, NULL));
    gbt_comparison c;
    assert_ok(gbt_compare_images(in_folder("with.png"), in_folder("without.png"), NULL, &c, NULL));
    assert_true(c.psnr == METRIC_PSNR_MAX && c.ssim == 1);
    image_free(&with);
    image_free(&without);
}

static void no_view_gets_files_of_another(void **state)
{
    (void)state;
    const char *const names[] = {"0.png",   "0.photo.png",  "0.median-depth.png", "0.flip.photo.jpg",
                                 "a/0.jpg", "a_0.hits.png", "1623.png",           "1623.25.png"};
    enum { COUNT = sizeof names / sizeof *names };
    scene_view views[COUNT] = {{0}};
    for (size_t i = 0; i < COUNT; i++)
        views[i].name = (char *)names[i];
    const loaded_run r = {.scene = {.views = views, .view_count = COUNT}};
    static const bool told_apart[COUNT] = {false, true, true, false, false, true, false, false};
    for (size_t i = 0; i < COUNT; i++) {
        char plain[FILE_NAME_SIZE], got[FILE_NAME_SIZE];
        loaded_run_file_name(names[i], plain);
        loaded_run_view_name(&r, i, got);
        assert_true((strcmp(plain, got) != 0) == told_apart[i]);
    }
}

static void what_cannot_be_compared(void **state)
{
    (void)state;
    write_noise("small.png", 8, 8, 1);
    write_noise("wide.png", 9, 8, 1);
    image spoiled = noise(8, 8, 3, 1);
    spoiled.pixels[3 * (8 * 2 + 5) + 1] = NAN;
    assert_ok(image_write(in_folder("spoiled.exr"), &spoiled, NULL));
    image_free(&spoiled);
    const struct {
        const char *a, *b;
        gbt_status status;
        const char *says;
    } cases[] = {
        {"small.png", "wide.png", GBT_ERR_ARGUMENT, "8 x 8"},
        {"none.png", "wide.png", GBT_ERR_IO, "none.png"},
        {"wide.png", "none.png", GBT_ERR_IO, "none.png"},
        {"spoiled.exr", "small.png", GBT_ERR_FORMAT, "spoiled.exr: a value that is not finite at pixel 5, 2"},
        {"small.png", "spoiled.exr", GBT_ERR_FORMAT,
         "spoiled.exr: a value that is not finite at pixel 5, 2"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        gbt_comparison c;
        gbt_error err = {0};
        assert_int_equal(
            gbt_compare_images(in_folder("%s", cases[i].a), in_folder("%s", cases[i].b), NULL, &c, &err),
            cases[i].status);
        assert_non_null(strstr(err.text, cases[i].says));
    }
    gbt_comparison c;
    assert_ok(gbt_compare_images(in_folder("small.png"), in_folder("small.png"), NULL, &c, NULL));
    assert_true(c.ssim == 1 && isnan(c.ssim_interior)); /* no window fits */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(figures_are_those_of_the_metrics),
        cmocka_unit_test(pictures_are_named_after_views),
        cmocka_unit_test(alpha_is_left_out),
        cmocka_unit_test(no_view_gets_files_of_another),
        cmocka_unit_test(what_cannot_be_compared),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
