/* SPDX-License-Identifier: Apache-2.0 */
/* study/time.c -- the study "time": held-out PSNR against training time. Makes the runs. */
#include "study/time.h"

#include "base/fail.h"
#include "data/scene.h"
#include "raster/raster.h"

static gbt_status run_one(const void *study, size_t of_data, size_t variant, int seed, const char *folder,
                          study_figures *out, gbt_error *err)
{
    const grid_study *s = study;
    const time_variant *v = &time_variants[variant];
    gbt_train_def def = gbt_train_def_default();
    def.eval_split = s->def.eval_split;
    def.downscale = s->def.downscale;
    def.seed = (uint64_t)seed;
    def.save_every_seconds = 0;
    def.find_exposure = false; /* the faithful protocol has none, and scores must be over the same pixels */
    def.command = "gbtrace study time";
    def.budget_seconds = v->budgets * s->def.budget_seconds;
    for (int i = 0; i < TIME_MARKS; i++)
        def.eval_at_seconds[def.eval_at_count++] = def.budget_seconds * (i + 1) / (TIME_MARKS + 1);
    return study_runs_do_variant(folder, s->def.data[of_data], s->grid.names[of_data], v->name, v->settings,
                                 def, out, err);
}

/* The faithful protocol trains with splats, which need pinholes. */
static gbt_status want_pinholes(const char *data, gbt_error *err)
{
    scene s;
    GBT_TRY(scene_load_in_place(data, NULL, &s, err));
    gbt_status status = GBT_OK;
    for (size_t i = 0; i < s.view_count && status == GBT_OK; i++)
        if (!raster_takes(&s.views[i].camera))
            status = base_fail(err, GBT_ERR_ARGUMENT,
                               "%s: %s is not a pinhole's, which the faithful protocol's splats want", data,
                               s.views[i].name);
    scene_free(&s);
    return status;
}

gbt_status lab_study_time(const lab_runs_def *def, const char *folder, FILE *out, gbt_error *err)
{
    grid_study s = {.def = study_grid_def(def, 1, "auto", 0)};
    if (!(def->budget_seconds > 0 && def->budget_seconds <= 1e6))
        return base_fail(err, GBT_ERR_ARGUMENT, "--budget: %g s (wanted more than 0, up to 1e6)",
                         def->budget_seconds);
    for (size_t i = 0; i < def->data_count; i++)
        GBT_TRY(want_pinholes(def->data[i], err));
    GBT_TRY(study_grid_open(&s.grid, def->data, def->data_count, time_variant_count, s.def.seeds, err));
    return study_grid_report(&s.grid, NULL, run_one, &time_output, &s, folder, out, err);
}
