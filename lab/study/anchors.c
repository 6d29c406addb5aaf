/* SPDX-License-Identifier: Apache-2.0 */
/* study/anchors.c -- the study "anchors": held-out PSNR against the number of anchors. Makes the runs. */
#include "study/anchors.h"

#include "base/fail.h"
#include "lab/lab.h"
#include "study/grid.h"
#include "study/runs.h"

static gbt_status run_one(const void *study, size_t scene, size_t variant, int seed, const char *folder,
                          study_figures *out, gbt_error *err)
{
    const grid_study *s = study;
    const anchors_variant *v = &anchors_variants[variant];
    gbt_train_def def = gbt_train_def_default();
    def.eval_split = s->def.eval_split;
    def.iterations = s->def.iterations;
    def.downscale = s->def.downscale;
    def.seed = (uint64_t)seed;
    def.save_every_seconds = 0;
    def.find_exposure = false; /* so that scores of all variants are over the same pixels */
    def.command = "gbtrace study anchors";
    return study_runs_do_variant(folder, s->def.data[scene], s->grid.names[scene], v->name, v->settings, def,
                                 out, err);
}

gbt_status lab_study_anchors(const lab_runs_def *def, const char *folder, FILE *out, gbt_error *err)
{
    grid_study s = {.def = study_grid_def(def, 3, "auto", 1000)};
    if (s.def.iterations < 20)
        return base_fail(err, GBT_ERR_ARGUMENT, "--iterations: %llu (wanted at least 20)",
                         (unsigned long long)s.def.iterations);
    GBT_TRY(study_grid_open(&s.grid, def->data, def->data_count, anchors_variant_count, s.def.seeds, err));
    return study_grid_report(&s.grid, NULL, run_one, &anchors_output, &s, folder, out, err);
}
