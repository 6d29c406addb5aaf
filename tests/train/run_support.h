/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/run_support.h -- a tiny scene to train on, and runs that must succeed or fail.

   The scene is tiny (photos of 48 x 36), so a run takes a fraction of a second. */
#ifndef GBT_TESTS_RUN_SUPPORT_H
#define GBT_TESTS_RUN_SUPPORT_H

#include "folder.h"

#include "gbtrace/make_scene.h"
#include "gbtrace/progress.h"
#include "train/held_out.h"
#include "train/trainer.h"

enum { PATH_SIZE = 512, STEPS = 60, VIEWS = 9 };

static const char *tiny;

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
    if (folder_make(state) != 0)
        return -1;
    tiny = in_folder("tiny");
    make_tiny_scene(tiny);
    return 0;
}

/* ---- runs ---- */

static inline gbt_train_def run_def(void)
{
    gbt_train_def def = gbt_train_def_default();
    def.iterations = STEPS;
    def.seed = 5;
    def.save_every_seconds = 0;
    def.step_pixels = 24 * 18; /* every second one across and down */
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

/* For gbt_listen(): `folder`, which was in the way of what could not be written, is gone when it is written
   once more. */
static inline void remove_at_warning(const gbt_event *event, void *folder)
{
    if (event->kind == GBT_EVENT_WARNING && strstr(event->text, "saving once more") != NULL)
        assert_int_equal(rmdir(folder), 0);
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
