/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_memory_limit.c -- a run below a limit is the run without one, and the kernel's peak is
   below it. */
#include "run_support.h"

#include "base/parallel.h"
#include "child.h"
#include "train/memory_need.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SANITIZED = 1 }; /* they need memory themselves */
#else
enum { SANITIZED = 0 };
#endif

enum { POINTS = 160000 };
static const size_t limit = (size_t)185 << 20;

static int make_large_scene(void *folder)
{
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.width = 64;
    def.height = 48;
    def.view_count = VIEWS;
    def.points = POINTS;
    def.samples = 1;
    return gbt_make_scene(&def, folder, NULL) != GBT_OK;
}

typedef struct limited_run {
    const char *data, *run;
    size_t memory;
    uint64_t iterations;
    bool resume;
} limited_run;

static int train(void *context)
{
    const limited_run *r = context;
    gbt_error err = {0};
    gbt_train_def def = gbt_train_def_default();
    def.iterations = r->iterations;
    def.resume = r->resume;
    def.memory = r->memory;
    const gbt_status status = gbt_train(r->data, r->run, &def, &err);
    if (status != GBT_OK)
        fprintf(stderr, "%s: %s\n", r->run, err.text);
    return status != GBT_OK;
}

static size_t train_in_child(const char *data, const char *run, size_t memory, uint64_t iterations,
                             bool resume)
{
    int failed;
    const size_t peak = in_child(train, &(limited_run){data, run, memory, iterations, resume}, &failed);
    assert_int_equal(failed, 0);
    return peak;
}

static void the_same_run_in_less_memory(void **state)
{
    (void)state;
    if (SANITIZED)
        skip();
    char data[PATH_SIZE];
    snprintf(data, sizeof data, "%s", in_folder("large"));
    int failed;
    in_child(make_large_scene, data, &failed);
    assert_int_equal(failed, 0);
    char whole[PATH_SIZE], less[PATH_SIZE];
    snprintf(whole, sizeof whole, "%s", in_folder("whole"));
    snprintf(less, sizeof less, "%s", in_folder("less"));
    const size_t without = train_in_child(data, whole, 0, 3, false),
                 with = train_in_child(data, less, limit, 3, false);
    print_message("%zu MB without a limit, %zu with %zu\n", without >> 20, with >> 20, limit >> 20);
    assert_true(without > limit && with <= limit);
    assert_same_file(in_folder("whole/model.gbt"), in_folder("less/model.gbt"));
    for (uint64_t steps = 4; steps <= 5; steps++) /* the second time there are two checkpoints */
        assert_true(train_in_child(data, less, limit, steps, true) <= limit);
}

/* Before any work, and nothing is left that looks like a run. */
static void too_little(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.memory = (size_t)60 << 20;
    train_fails(tiny, in_folder("none"), &def, GBT_ERR_NO_MEMORY, "60 MiB is too little");
    assert_false(file_exists(in_folder("none/model.gbt")));
}

/* There saves are made at once, not beside the steps. */
static void a_save_that_failed_is_made_once_more(void **state)
{
    (void)state;
    char in_its_way[PATH_SIZE];
    snprintf(in_its_way, sizeof in_its_way, "%s", in_folder("once/checkpoints/.last.gbt.tmp"));
    assert_ok(file_make_folder(in_its_way, NULL));
    gbt_train_def def = run_def();
    def.memory = (size_t)4 << 30;
    def.save_every_seconds = 1e-6;
    gbt_listen(remove_at_warning, in_its_way);
    train_ok(tiny, in_folder("once"), &def);
    gbt_listen(NULL, NULL);
    assert_false(file_exists(in_its_way));
}

static void what_it_takes(void **state)
{
    (void)state;
    scene s;
    gbt_train_def def = gbt_train_def_default();
    const train_rules usual = train_rules_of(&def);
    def.step_pixels = 0;
    const train_rules rules_of_all = train_rules_of(&def);
    def.step_pixels = 5000;
    const train_rules rules_of_some = train_rules_of(&def);
    assert_ok(scene_load(tiny, NULL, &s, NULL));
    const memory_need small = memory_need_of(&s, 1, &usual);
    s.points.count = 1000000;
    const memory_need large = memory_need_of(&s, 1, &usual), fine = memory_need_of(&s, 2, &usual);
    s.points.count = 0;
    assert_true(s.file_bytes > 0 && small.reading > (double)s.file_bytes);
    assert_true(small.least > small.program && small.whole >= small.least);
    assert_true(large.whole > small.whole && large.least > small.least && large.whole > large.least &&
                fine.photos < large.photos);
    const memory_need all = memory_need_of(&s, 0.1, &rules_of_all),
                      some = memory_need_of(&s, 0.1, &rules_of_some);
    assert_true(all.view > 2 * some.view);
    const memory_need found =
        memory_need_of(&s, 1, &usual); /* points are, in smaller photos that are all held */
    assert_true(found.decoding >= (VIEWS - 2) * 16.0 * 48 * 36);
    for (size_t i = 0; i < s.view_count; i++)
        s.views[i].photo_width = 100 * s.views[i].camera.width; /* as stored: 17 megapixels */
    const memory_need stored = memory_need_of(&s, 1, &usual);
    assert_true(stored.decoding >= 24.0 * 4800 * 3600 && stored.least > 24.0 * 4800 * 3600);
    assert_true(stored.photos == small.photos && stored.whole > stored.decoding + stored.program);
    assert_int_equal(photos_at_once(&s, 1), 1);
    assert_int_equal(photos_at_once(&s, SIZE_MAX), parallel_threads());
    assert_int_equal(photos_at_once(&s, (size_t)(24.0 * 4800 * 3600 * 2)), parallel_threads() < 2 ? 1 : 2);
    assert_true(stored.least * 3 / 8 >= photos_decoded_bytes(&s)); /* what is above the 5/8 that memory is let
                                                                      go of to */
    for (size_t i = 0; i < s.view_count; i++)
        s.views[i].is_exr = true;
    assert_true(fabs(photos_decoded_bytes(&s) - 40.0 * 4800 * 3600) < 1);
    for (size_t i = 0; i < s.view_count; i++) {
        s.views[i].is_exr = false;
        s.views[i].has_alpha = true;
    }
    const memory_need clear = memory_need_of(&s, 1, &usual);
    assert_true(fabs(clear.photos - 4.0 / 3 * stored.photos) < 1);
    assert_int_equal(photos_at_once(&s, (size_t)(24.0 * 4800 * 3600 * 2)), 1);
    scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_same_run_in_less_memory), cmocka_unit_test(too_little),
        cmocka_unit_test(a_save_that_failed_is_made_once_more), cmocka_unit_test(what_it_takes)};
    return cmocka_run_group_tests(tests, make_root, folder_remove);
}
