/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_memory_limit.c -- a run below a limit is the run without one, and the kernel's peak is
   below it. */
#include "run_support.h"

#include <sys/resource.h>
#include <sys/wait.h>

#include "train/memory_need.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SANITIZED = 1 }; /* they need memory themselves */
#else
enum { SANITIZED = 0 };
#endif

enum { POINTS = 160000 };
static const size_t limit = (size_t)220 << 20;

/* In a process of its own, whose memory is not that of others. @return its largest resident memory */
static size_t in_child(void (*work)(void *), void *context)
{
    struct rusage used;
    int ended;
    fflush(NULL);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        work(context);
        _exit(0);
    }
    assert_int_equal(wait4(child, &ended, 0, &used), child);
    assert_true(WIFEXITED(ended) && WEXITSTATUS(ended) == 0);
    return (size_t)used.ru_maxrss * 1024;
}

static void make_large_scene(void *folder)
{
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.width = 64;
    def.height = 48;
    def.view_count = VIEWS;
    def.points = POINTS;
    def.samples = 1;
    if (gbt_make_scene(&def, folder, NULL) != GBT_OK)
        _exit(1);
}

typedef struct limited_run {
    const char *data, *run;
    size_t memory;
    gbt_status wanted;
} limited_run;

static void train(void *context)
{
    const limited_run *r = context;
    gbt_error err = {0};
    gbt_train_def def = gbt_train_def_default();
    def.iterations = 3;
    def.memory = r->memory;
    const gbt_status status = gbt_train(r->data, r->run, &def, &err);
    if (status != r->wanted)
        fprintf(stderr, "%s: %s\n", r->run, err.text);
    _exit(status != r->wanted);
}

static void the_same_run_in_less_memory(void **state)
{
    (void)state;
    if (SANITIZED)
        skip();
    char data[PATH_SIZE];
    snprintf(data, sizeof data, "%s", in_root("large"));
    in_child(make_large_scene, data);
    char whole[PATH_SIZE], less[PATH_SIZE];
    snprintf(whole, sizeof whole, "%s", in_root("whole"));
    snprintf(less, sizeof less, "%s", in_root("less"));
    const size_t without = in_child(train, &(limited_run){data, whole, 0, GBT_OK}),
                 with = in_child(train, &(limited_run){data, less, limit, GBT_OK});
    print_message("%zu MB without a limit, %zu with %zu\n", without >> 20, with >> 20, limit >> 20);
    assert_true(without > limit && with <= limit);
    assert_same_file(in_root("whole/model.gbt"), in_root("less/model.gbt"));
}

/* Before any work, and nothing is left that looks like a run. */
static void too_little(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.memory = (size_t)60 << 20;
    train_fails(tiny, in_root("none"), &def, GBT_ERR_NO_MEMORY, "60 MB is too little");
    assert_false(file_exists(in_root("none/model.gbt")));
}

static void what_it_takes(void **state)
{
    (void)state;
    scene s;
    assert_ok(scene_load(tiny, NULL, &s, NULL));
    const memory_need small = memory_need_of(&s, 1);
    s.points.count = 1000000;
    const memory_need large = memory_need_of(&s, 1), fine = memory_need_of(&s, 2);
    s.points.count = 0;
    assert_true(s.file_bytes > 0 && small.reading > (double)s.file_bytes);
    assert_true(small.least > small.program && small.whole >= small.least);
    assert_true(large.whole > small.whole && large.least > small.least && large.whole > large.least &&
                fine.photos < large.photos);
    scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_same_run_in_less_memory),
                                       cmocka_unit_test(too_little), cmocka_unit_test(what_it_takes)};
    return cmocka_run_group_tests(tests, make_root, remove_root);
}
