/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper.c -- the study "paper": find out which runs its tables need, and make them. */
#include "study/paper.h"

#include <stdio.h>

#include "base/fail.h"

enum { LEAST_ITERATIONS = 20 };

/* Parse "1,3": comma-separated numbers of tables, each at most once. */
static gbt_status choose_tables(const char *list, bool has_table[PAPER_TABLES + 1], gbt_error *err)
{
    for (const char *at = list;; at += 2) {
        const int table = *at - '0';
        if (table < 1 || table > PAPER_TABLES || has_table[table] || (at[1] != ',' && at[1] != '\0'))
            return base_fail(err, GBT_ERR_ARGUMENT, "--tables: \"%.40s\" (wanted some of 1,2,3,4)", list);
        has_table[table] = true;
        if (at[1] == '\0')
            return GBT_OK;
    }
}

/* Choose tables and variants, and look at the scenes' points. */
static gbt_status plan(paper_study *s, gbt_error *err)
{
    const lab_runs_def *def = &s->def;
    if (def->iterations < LEAST_ITERATIONS)
        return base_fail(err, GBT_ERR_ARGUMENT, "--iterations: %llu (wanted at least %d)",
                         (unsigned long long)def->iterations, (int)LEAST_ITERATIONS);
    GBT_TRY(choose_tables(def->tables, s->has_table, err));
    for (size_t i = 0; i < s->grid.scene_count; i++)
        GBT_TRY(paper_scene_look(def->data[i], def->voxel_size, &s->scenes[i], err));
    for (int table = 1; table <= PAPER_TABLES; table++) {
        const paper_variant_id *variants;
        const size_t count = paper_table_variants(table, &variants);
        for (size_t i = 0; i < count && s->has_table[table]; i++)
            s->has_variant[variants[i]] = true;
    }
    return GBT_OK;
}

static gbt_status run_one(const void *study, size_t scene, size_t variant, int seed, const char *folder,
                          study_figures *out, gbt_error *err)
{
    char run[4096];
    const paper_study *s = study;
    const paper_variant *v = &paper_variants[variant];
    if (v->max_depth < PAPER_DEPTH_MAX && v->max_depth >= s->scenes[scene].tree_depth) {
        *out = *paper_run(s, scene, PAPER_GBSP, seed); /* the depth limit has no effect on this scene, so the
                                                          run is identical to the bit */
        return GBT_OK;
    }
    gbt_train_def def = gbt_train_def_default();
    def.compat = true;
    def.eval_split = s->def.eval_split;
    def.save_every_seconds = 0;
    /* Set what `compat` implies explicitly, so that new defaults do not make finished runs look outdated. */
    def.step_pixels = 0;
    def.splats_until = 0;
    def.footprint = 0;
    def.iterations = s->def.iterations;
    def.downscale = s->def.downscale;
    def.renderer = s->def.renderer;
    def.voxel_size = (float)s->def.voxel_size;
    def.seed = (uint64_t)seed;
    def.init = v->init;
    def.scale_prior = v->scale_prior;
    def.grow_until = v->grow_until;
    def.max_depth = v->max_depth;
    def.scale_factor = v->scaled ? s->scenes[scene].scale_constant : 1;
    def.command = "gbtrace study paper";
    GBT_TRY(study_runs_folder(folder, s->grid.names[scene], v->name, def.seed, run, sizeof run, err));
    return study_runs_do(s->def.data[scene], run, &def, s->def.lpips, out, err);
}

gbt_status lab_study_paper(const lab_runs_def *def, const char *folder, FILE *out, gbt_error *err)
{
    paper_study s = {.def = study_grid_def(def, 3, "every=8", 3000)};
    GBT_TRY(study_grid_open(&s.grid, def->data, def->data_count, PAPER_VARIANTS, s.def.seeds, err));
    const gbt_status status = plan(&s, err);
    if (status == GBT_OK)
        return study_grid_report(&s.grid, s.has_variant, run_one, &paper_output, &s, folder, out, err);
    study_grid_close(&s.grid);
    return status;
}
