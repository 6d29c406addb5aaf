/* SPDX-License-Identifier: Apache-2.0 */
/* study/anchors_write.c -- the study "anchors" as tables and as data. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>

#include "data/json_out.h"
#include "study/anchors.h"
#include "study/grid.h"
#include "study/runs.h"
#include "study/runs_stat.h"

enum { PAPER_BYTES_PER_ANCHOR = 316 }; /* 79 floats, by the paper's accounting */

/* ---- statistics ---- */

typedef enum figure { INITIAL, FINAL, BYTES, BLENDED, PSNR, SSIM, FIGURES } figure;

static const struct {
    const char *name, *title;
    int decimals;
} figure_texts[FIGURES] = {{"anchors_initial", "initial anchors", 0},
                           {"anchors_final", "final anchors", 0},
                           {"model_bytes", "model.gbt, bytes", 0},
                           {"blended_per_ray", "blended per ray", 1},
                           {"psnr", "PSNR, dB", 2},
                           {"ssim", "SSIM", 4}};

static double value_of(const study_figures *run, figure which)
{
    const double values[FIGURES] = {run->anchors_initial, run->anchors_final, run->model_bytes,
                                    run->blended_per_ray, run->psnr,          run->ssim};
    return values[which];
}

static stat_sample stat_over(const grid_study *s, size_t scene, size_t variant, figure which)
{
    double values[STUDY_SEEDS_MAX];
    for (int seed = 0; seed < s->grid.seeds; seed++)
        values[seed] = value_of(study_grid_at(&s->grid, scene, variant, seed), which);
    return stat_of(values, (size_t)s->grid.seeds);
}

/* A variant compared with `base` at the same seed: the difference, or the percentage of the value of `base`.
 */
static stat_sample compared_with(const grid_study *s, size_t scene, size_t variant, size_t base, figure which,
                                 bool relative)
{
    double values[STUDY_SEEDS_MAX];
    for (int seed = 0; seed < s->grid.seeds; seed++) {
        const double here = value_of(study_grid_at(&s->grid, scene, variant, seed), which),
                     there = value_of(study_grid_at(&s->grid, scene, base, seed), which);
        values[seed] = relative ? 100 * here / there : here - there;
    }
    return stat_of(values, (size_t)s->grid.seeds);
}

/* How many times smaller the variant's anchors are than voxel anchors at the paper's bytes per anchor. */
static double times_smaller(const grid_study *s, size_t scene, size_t variant)
{
    return PAPER_BYTES_PER_ANCHOR * stat_over(s, scene, ANCHORS_VOXELS, FINAL).mean /
           stat_over(s, scene, variant, BYTES).mean;
}

/* ---- Markdown ---- */

static void add_row(const grid_study *s, size_t scene, size_t v, text *out)
{
    text_format(out, "| %s |", anchors_variants[v].name);
    for (int f = 0; f < FIGURES; f++) {
        const stat_sample stat = stat_over(s, scene, v, (figure)f);
        text_add(out, " ");
        stat_add(out, &stat, figure_texts[f].decimals, false);
        text_add(out, " |");
    }
    const stat_sample initial = compared_with(s, scene, v, ANCHORS_BALLS, INITIAL, true),
                      final = compared_with(s, scene, v, ANCHORS_VOXELS, FINAL, true);
    const stat_sample psnr = compared_with(s, scene, v, ANCHORS_VOXELS, PSNR, false);
    text_add(out, " ");
    stat_add(out, &initial, 0, false);
    text_add(out, " | ");
    stat_add(out, &final, 0, false);
    text_add(out, " | ");
    stat_add_judged(out, &psnr, 2);
    text_add(out, " | ");
    text_number(out, times_smaller(s, scene, v), 1);
    text_add(out, " |\n");
}

static void add_tables(const void *study, text *out)
{
    const grid_study *s = study;
    text_format(out,
                "# Anchors against held-out PSNR\n\n%llu iterations of the default settings, photos divided "
                "by %g, ",
                (unsigned long long)s->def.iterations, s->def.downscale);
    study_grid_add_runs(&s->grid, s->def.eval_split, out);
    text_format(out,
                "Mean ± standard deviation over the seeds. Times smaller: model.gbt against %d bytes, as the "
                "paper counts, for each final anchor of the voxels. The voxels are those of the first row. ",
                (int)PAPER_BYTES_PER_ANCHOR);
    text_add(out, STAT_BOLD_MEANS "\n");
    for (size_t scene = 0; scene < s->grid.scene_count; scene++) {
        text_add(out, "\n## ");
        text_plain(out, s->grid.names[scene]);
        text_add(out, "\n\n| start |");
        for (int f = 0; f < FIGURES; f++)
            text_format(out, " %s |", figure_texts[f].title);
        text_add(out, " initial, % of the paper's balls | final, % of the voxels | PSNR against the voxels, "
                      "dB | times smaller |\n|---|");
        for (int f = 0; f < FIGURES + 4; f++)
            text_add(out, "---|");
        text_add(out, "\n");
        for (size_t v = 0; v < anchors_variant_count; v++)
            add_row(s, scene, v, out);
    }
}

/* ---- JSON ---- */

static void add_limited(json_t *rows, const char *scene, const char *start, const char *what, double value,
                        double limit)
{
    char row[STUDY_NAME_SIZE + 160];
    snprintf(row, sizeof row, "%s: %s: %s", scene, start, what);
    json_array_append_new(rows,
                          json_pack("{s:o,s:o,s:o,s:b}", "row", json_text(row), "limit", json_number(limit),
                                    "value", json_number(value), "pass", isnan(limit) || value <= limit));
}

static void add_rows(const grid_study *s, size_t scene, json_t *rows)
{
    for (size_t v = 1; v < anchors_variant_count; v++) {
        const char *start = anchors_variants[v].name;
        add_limited(rows, s->grid.names[scene], start, "final anchors, % of the voxels'",
                    compared_with(s, scene, v, ANCHORS_VOXELS, FINAL, true).mean, NAN);
        add_limited(rows, s->grid.names[scene], start, "blended per ray, % of the voxels'",
                    compared_with(s, scene, v, ANCHORS_VOXELS, BLENDED, true).mean, NAN);
        add_limited(rows, s->grid.names[scene], start, "PSNR against the voxels', dB",
                    compared_with(s, scene, v, ANCHORS_VOXELS, PSNR, false).mean, NAN);
    }
    add_limited(rows, s->grid.names[scene], anchors_variants[ANCHORS_ADAPTIVE].name,
                "initial anchors, % of the paper's balls",
                compared_with(s, scene, ANCHORS_ADAPTIVE, ANCHORS_BALLS, INITIAL, true).mean, 50);
}

static json_t *data_of(const void *study)
{
    const grid_study *s = study;
    json_t *rows = json_array(), *runs = json_array();
    for (size_t scene = 0; scene < s->grid.scene_count; scene++) {
        add_rows(s, scene, rows);
        for (size_t v = 0; v < anchors_variant_count; v++) {
            json_t *run = json_pack("{s:o,s:s,s:s}", "scene", json_text(s->grid.names[scene]), "start",
                                    anchors_variants[v].name, "settings", anchors_variants[v].settings);
            for (int f = 0; f < FIGURES; f++) {
                const stat_sample stat = stat_over(s, scene, v, (figure)f);
                json_object_set_new(run, figure_texts[f].name, stat_to_json(&stat));
            }
            json_array_append_new(runs, run);
        }
    }
    return json_pack("{s:I,s:f,s:i,s:o,s:o}", "iterations", (json_int_t)s->def.iterations, "downscale",
                     s->def.downscale, "seeds", s->grid.seeds, "rows", rows, "runs", runs);
}

const study_output anchors_output = {.name = "anchors", .tables = add_tables, .data = data_of};
