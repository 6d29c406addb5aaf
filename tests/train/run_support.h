/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/run_support.h -- a folder for runs, a tiny scene to train on, and runs that must succeed or
   fail.

   The scene is tiny (photos of 48 x 36), so a run takes a fraction of a second. */
#ifndef GBT_TESTS_RUN_SUPPORT_H
#define GBT_TESTS_RUN_SUPPORT_H

#include "test_support.h"

#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"
#include "gbtrace/make_scene.h"
#include "remove_tree.h"
#include "train/trainer.h"

enum { PATH_SIZE = 512, STEPS = 60, VIEWS = 9 };

static char root[64], tiny[PATH_SIZE];

/* ---- folders, files ---- */

static inline const char *in_root(const char *format, ...)
{
    static char paths[16][PATH_SIZE];
    static int next = 0;
    char *path = paths[next = (next + 1) % 16];
    const int length = snprintf(path, PATH_SIZE, "%s/", root);
    va_list list;
    va_start(list, format);
    vsnprintf(path + length, PATH_SIZE - (size_t)length, format, list);
    va_end(list);
    return path;
}

typedef struct bytes {
    unsigned char *data;
    size_t count;
} bytes;

static inline bytes read_bytes(const char *path)
{
    bytes b;
    gbt_error err = {0};
    if (file_read(path, &b.data, &b.count, &err) != GBT_OK)
        fail_msg("%s", err.text);
    return b;
}

static inline void copy_file(const char *from, const char *to)
{
    bytes b = read_bytes(from);
    assert_ok(file_write_atomic(to, b.data, b.count, &assert_ok_err_));
    mem_free(b.data);
}

static inline void assert_same_file(const char *a, const char *b)
{
    bytes x = read_bytes(a), y = read_bytes(b);
    if (x.count != y.count || memcmp(x.data, y.data, x.count) != 0)
        fail_msg("%s and %s differ", a, b);
    mem_free(x.data);
    mem_free(y.data);
}

static inline bool is_same_file(const char *a, const char *b)
{
    bytes x = read_bytes(a), y = read_bytes(b);
    const bool same = x.count == y.count && memcmp(x.data, y.data, x.count) == 0;
    mem_free(x.data);
    mem_free(y.data);
    return same;
}

static inline void make_tiny_scene(const char *folder)
{
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.width = 48;
    def.height = 36;
    def.view_count = VIEWS;
    def.points = 150;
    def.samples = 4;
    gbt_error err = {0};
    if (gbt_make_scene(&def, folder, &err) != GBT_OK)
        fail_msg("%s", err.text);
}

/* The end of a frame of a transforms.json. */
static inline void put_pose(FILE *file, const scene *s, size_t view)
{
    const double *r = s->views[view].camera.rotation, *at = s->views[view].camera.center;
    fprintf(file, "\"transform_matrix\": [");
    for (int k = 0; k < 3; k++) /* columns: x right, y up, z back */
        fprintf(file, "[%.17g, %.17g, %.17g, %.17g], ", r[k], -r[3 + k], -r[6 + k], at[k] + s->origin[k]);
    fprintf(file, "[0, 0, 0, 1]]}");
}

static inline int make_root(void **state)
{
    (void)state;
    snprintf(root, sizeof root, "/tmp/gbt_train_XXXXXX");
    if (mkdtemp(root) == NULL)
        return -1;
    snprintf(tiny, sizeof tiny, "%s/tiny", root);
    make_tiny_scene(tiny);
    return 0;
}

static inline int remove_root(void **state)
{
    (void)state;
    return remove_tree(root);
}

/* ---- runs ---- */

static inline gbt_train_def run_def(void)
{
    gbt_train_def def = gbt_train_def_default();
    def.iterations = STEPS;
    def.seed = 5;
    def.save_every_seconds = 0;
    return def;
}

static inline void train_ok(const char *data, const char *run, const gbt_train_def *def)
{
    gbt_error err = {0};
    if (gbt_train(data, run, def, &err) != GBT_OK)
        fail_msg("%s: %s", run, err.text);
}

static inline void train_fails(const char *data, const char *run, const gbt_train_def *def, gbt_status wanted,
                               const char *says)
{
    gbt_error err = {0};
    const gbt_status status = gbt_train(data, run, def, &err);
    if (status != wanted || err.status != wanted || strstr(err.text, says) == NULL ||
        strchr(err.text, '\n') != NULL)
        fail_msg("wanted status %d and \"%s\", got %d: %s", (int)wanted, says, (int)status, err.text);
}

static inline void open_ok(trainer *t, const char *data, const gbt_train_def *def)
{
    gbt_error err = {0};
    *t = (trainer){0};
    if (trainer_open(t, data, def, &err) != GBT_OK)
        fail_msg("%s", err.text);
}

static inline void step_ok(trainer *t, step_report *report)
{
    gbt_error err = {0};
    if (trainer_step(t, report, &err) != GBT_OK)
        fail_msg("step %llu: %s", (unsigned long long)t->step, err.text);
}

#endif
