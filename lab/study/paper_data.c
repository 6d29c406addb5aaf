/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper_data.c -- the study "paper" as JSON: rows, changes and figures. */
#include <math.h>
#include <stdio.h>

#include "base/choice.h"
#include "data/json_out.h"
#include "study/paper.h"

/* Largest relative difference between the number of balls of real points and paper_ball_count(); ties and
   sets that are not split cause it. */
static const double ball_count_limit = 0.015;

/* Compare the initial number of balls with paper_ball_count(), for each depth that was trained. */
static void add_count_rows(const paper_study *s, size_t scene, json_t *rows)
{
    for (int v = 0; v < PAPER_VARIANTS; v++) {
        const bool from_balls = paper_variants[v].init == GBT_INIT_GB;
        const bool is_first =
            v == PAPER_GBSP || v >= PAPER_DEPTH_10; /* other variants start from the balls of PAPER_GBSP */
        if (!s->has_variant[v] || !from_balls || !is_first)
            continue;
        char row[STUDY_NAME_SIZE + 80];
        const study_figures *run = paper_run(s, scene, (paper_variant_id)v, 0);
        const double wanted = paper_ball_count(run->points, paper_variants[v].max_depth),
                     value = fabs(run->anchors_initial / wanted - 1);
        snprintf(row, sizeof row, "%s: initial anchors at D_max %d against the closed form",
                 s->grid.names[scene], paper_variants[v].max_depth);
        json_array_append_new(rows,
                              json_pack("{s:o,s:f,s:o,s:b}", "row", json_text(row), "limit", ball_count_limit,
                                        "value", json_number(value), "pass", value <= ball_count_limit));
    }
}

/* Changes have no limit, because the paper's are not promised for other scenes. */
static void add_change_rows(const paper_study *s, json_t *rows)
{
    for (size_t i = 0; i < paper_claim_count; i++) {
        const paper_claim *claim = &paper_claims[i];
        if (!s->has_table[claim->table] || !paper_is_measured(s, claim->figure))
            continue;
        for (size_t scene = 0; scene <= s->grid.scene_count; scene++) {
            char row[2 * STUDY_NAME_SIZE];
            const bool is_all = scene == s->grid.scene_count;
            const stat_sample ours =
                paper_change(s, is_all ? PAPER_ALL : scene, claim->variant, claim->base, claim->figure);
            const double published = paper_published(claim);
            snprintf(row, sizeof row, "table %d, %s: %s: change of %s", claim->table,
                     is_all ? "all" : s->grid.names[scene], claim->what,
                     paper_figure_texts[claim->figure].change_name);
            json_array_append_new(rows, json_pack("{s:o,s:n,s:o,s:n,s:o,s:o,s:s}", "row", json_text(row),
                                                  "limit", "value", json_number(ours.mean), "pass", "ours",
                                                  stat_to_json(&ours), "paper", json_number(published),
                                                  "says", paper_verdict(&ours, claim)));
        }
    }
}

static json_t *variant_to_json(const paper_study *s, size_t scene, paper_variant_id variant)
{
    json_t *root = json_pack("{s:o,s:s}", "scene", json_text(s->grid.names[scene]), "variant",
                             paper_variants[variant].name);
    for (int f = 0; f < PAPER_FIGURES; f++) {
        const stat_sample stat = paper_stat(s, scene, variant, (paper_figure)f);
        if (paper_is_measured(s, (paper_figure)f))
            json_object_set_new(root, paper_figure_texts[f].name, stat_to_json(&stat));
    }
    return root;
}

static json_t *data_of(const void *study)
{
    const paper_study *s = study;
    json_t *rows = json_array(), *figures = json_array(), *scenes = json_array();
    for (size_t scene = 0; scene < s->grid.scene_count; scene++) {
        add_count_rows(s, scene, rows);
        json_array_append_new(scenes, json_pack("{s:o,s:f}", "scene", json_text(s->grid.names[scene]),
                                                "scale_constant", s->scenes[scene].scale_constant));
        for (int v = 0; v < PAPER_VARIANTS; v++)
            if (s->has_variant[v])
                json_array_append_new(figures, variant_to_json(s, scene, (paper_variant_id)v));
    }
    add_change_rows(s, rows);
    return json_pack("{s:I,s:f,s:f,s:s,s:i,s:o,s:o,s:o}", "iterations", (json_int_t)s->def.iterations,
                     "downscale", s->def.downscale, "voxel_size", s->def.voxel_size, "renderer",
                     CHOICE_NAME(GBT_RENDERER_NAMES, s->def.renderer), "seeds", s->grid.seeds, "rows", rows,
                     "scenes", scenes, "figures", figures);
}

const study_output paper_output = {
    .name = "paper", .tables = paper_tables, .charts = paper_charts, .data = data_of};
