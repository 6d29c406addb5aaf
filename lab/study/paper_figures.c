/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper_figures.c -- figures of single runs, their statistics over seeds, and changes between variants.
 */
#include <math.h>

#include "study/paper.h"

const paper_figure_text paper_figure_texts[PAPER_FIGURES] = {
    [PAPER_INITIAL] = {"initial anchors", "initial anchors", "initial anchors, %", 0, true, 1},
    [PAPER_FINAL] = {"final anchors", "final anchors", "final anchors, %", 0, true, 1},
    [PAPER_STORAGE] = {"storage", "storage, MiB", "storage, %", 2, true, 1},
    [PAPER_MODEL] = {"model.gbt", "model.gbt, MiB", "model.gbt, %", 2, true, 1},
    [PAPER_PSNR] = {"PSNR", "PSNR, dB", "PSNR, dB", 2, false, 2},
    [PAPER_SSIM] = {"SSIM", "SSIM", "SSIM", 4, false, 4},
    [PAPER_LPIPS] = {"LPIPS", "LPIPS", "LPIPS", 4, false, 4},
    [PAPER_ARITHMETIC] = {"arithmetic", "arithmetic of the networks per view, 10^9 multiply-adds",
                          "arithmetic of the networks per view, %", 4, true, 1},
    [PAPER_BLENDED] = {"blended", "hits that a ray blends", "hits that a ray blends, %", 1, true, 1},
};

double paper_figure_of(const study_figures *run, paper_figure figure)
{
    static const double bytes_per_anchor = 316, mebibyte = 1048576; /* 79 floats: docs/paper.md */
    switch (figure) {
    case PAPER_INITIAL:
        return run->anchors_initial;
    case PAPER_FINAL:
        return run->anchors_final;
    case PAPER_STORAGE:
        return (bytes_per_anchor * run->anchors_final + run->network_bytes) / mebibyte;
    case PAPER_MODEL:
        return run->model_bytes / mebibyte;
    case PAPER_PSNR:
        return run->psnr;
    case PAPER_SSIM:
        return run->ssim;
    case PAPER_LPIPS:
        return run->lpips_01;
    case PAPER_ARITHMETIC:
        return 1e-9 * run->macs_per_anchor * run->anchors_in_view;
    case PAPER_BLENDED:
        return run->blended_per_ray;
    default:
        return NAN;
    }
}

stat_sample paper_stat(const paper_study *s, size_t scene, paper_variant_id variant, paper_figure figure)
{
    double values[STUDY_SEEDS_MAX];
    for (int seed = 0; seed < s->grid.seeds; seed++)
        values[seed] = paper_figure_of(paper_run(s, scene, variant, seed), figure);
    return stat_of(values, (size_t)s->grid.seeds);
}

static double change_of(const paper_study *s, size_t scene, paper_variant_id variant, paper_variant_id base,
                        paper_figure figure, int seed)
{
    const double from = paper_figure_of(paper_run(s, scene, base, seed), figure),
                 to = paper_figure_of(paper_run(s, scene, variant, seed), figure);
    return paper_figure_texts[figure].is_relative ? 100 * (to / from - 1) : to - from;
}

stat_sample paper_change(const paper_study *s, size_t scene, paper_variant_id variant, paper_variant_id base,
                         paper_figure figure)
{
    double values[STUDY_SEEDS_MAX];
    for (int seed = 0; seed < s->grid.seeds; seed++) {
        double over_scenes[STUDY_SCENES_MAX];
        size_t count = 0;
        for (size_t i = 0; i < s->grid.scene_count; i++)
            if (scene == PAPER_ALL || scene == i)
                over_scenes[count++] = change_of(s, i, variant, base, figure, seed);
        values[seed] = stat_of(over_scenes, count).mean;
    }
    return stat_of(values, (size_t)s->grid.seeds);
}

/* ---- the changes that are compared ---- */

#define BALLS_FOR_VOXELS "balls in place of voxels"
#define GBAI_FOR_VOXELS "GBAI in place of voxels"
#define GBSP_ADDED "GBSP added to GBAI"
#define GBSP_OR_CONSTANT "GBSP in place of the constant"
#define CONSTANT_GBAI "the constant added to GBAI"
#define CONSTANT_VOXELS "the constant added to voxels"
#define BALLS_AT(part) "balls in place of voxels, growth to " part
#define DEPTH_TO(d) "D_max " d " in place of 18"

const paper_claim paper_claims[] = {
    {1, BALLS_FOR_VOXELS, PAPER_GBSP, PAPER_VOXEL, PAPER_INITIAL},
    {1, BALLS_FOR_VOXELS, PAPER_GBSP, PAPER_VOXEL, PAPER_FINAL},
    {1, BALLS_FOR_VOXELS, PAPER_GBSP, PAPER_VOXEL, PAPER_STORAGE},
    {1, BALLS_FOR_VOXELS, PAPER_GBSP, PAPER_VOXEL, PAPER_PSNR},
    {1, BALLS_FOR_VOXELS, PAPER_GBSP, PAPER_VOXEL, PAPER_SSIM},
    {1, BALLS_FOR_VOXELS, PAPER_GBSP, PAPER_VOXEL, PAPER_LPIPS},

    {2, GBAI_FOR_VOXELS, PAPER_GBAI, PAPER_VOXEL, PAPER_FINAL},
    {2, GBAI_FOR_VOXELS, PAPER_GBAI, PAPER_VOXEL, PAPER_PSNR},
    {2, GBSP_ADDED, PAPER_GBSP, PAPER_GBAI, PAPER_FINAL},
    {2, GBSP_ADDED, PAPER_GBSP, PAPER_GBAI, PAPER_PSNR},
    {2, CONSTANT_GBAI, PAPER_GBAI_SCALED, PAPER_GBAI, PAPER_FINAL},
    {2, CONSTANT_GBAI, PAPER_GBAI_SCALED, PAPER_GBAI, PAPER_PSNR},
    {2, GBSP_OR_CONSTANT, PAPER_GBSP, PAPER_GBAI_SCALED, PAPER_FINAL},
    {2, GBSP_OR_CONSTANT, PAPER_GBSP, PAPER_GBAI_SCALED, PAPER_PSNR},
    {2, CONSTANT_VOXELS, PAPER_VOXEL_SCALED, PAPER_VOXEL, PAPER_FINAL},
    {2, CONSTANT_VOXELS, PAPER_VOXEL_SCALED, PAPER_VOXEL, PAPER_PSNR},

    {3, BALLS_AT("1/6"), PAPER_GBSP_SIXTH, PAPER_VOXEL_SIXTH, PAPER_FINAL},
    {3, BALLS_AT("1/6"), PAPER_GBSP_SIXTH, PAPER_VOXEL_SIXTH, PAPER_ARITHMETIC},
    {3, BALLS_AT("1/6"), PAPER_GBSP_SIXTH, PAPER_VOXEL_SIXTH, PAPER_PSNR},
    {3, BALLS_AT("1/3"), PAPER_GBSP_THIRD, PAPER_VOXEL_THIRD, PAPER_FINAL},
    {3, BALLS_AT("1/3"), PAPER_GBSP_THIRD, PAPER_VOXEL_THIRD, PAPER_ARITHMETIC},
    {3, BALLS_AT("1/3"), PAPER_GBSP_THIRD, PAPER_VOXEL_THIRD, PAPER_PSNR},
    {3, BALLS_AT("1/2"), PAPER_GBSP, PAPER_VOXEL, PAPER_FINAL},
    {3, BALLS_AT("1/2"), PAPER_GBSP, PAPER_VOXEL, PAPER_ARITHMETIC},
    {3, BALLS_AT("1/2"), PAPER_GBSP, PAPER_VOXEL, PAPER_BLENDED},
    {3, BALLS_AT("1/2"), PAPER_GBSP, PAPER_VOXEL, PAPER_PSNR},

    {4, DEPTH_TO("10"), PAPER_DEPTH_10, PAPER_GBSP, PAPER_INITIAL},
    {4, DEPTH_TO("10"), PAPER_DEPTH_10, PAPER_GBSP, PAPER_FINAL},
    {4, DEPTH_TO("10"), PAPER_DEPTH_10, PAPER_GBSP, PAPER_PSNR},
    {4, DEPTH_TO("12"), PAPER_DEPTH_12, PAPER_GBSP, PAPER_INITIAL},
    {4, DEPTH_TO("12"), PAPER_DEPTH_12, PAPER_GBSP, PAPER_FINAL},
    {4, DEPTH_TO("12"), PAPER_DEPTH_12, PAPER_GBSP, PAPER_PSNR},
    {4, DEPTH_TO("14"), PAPER_DEPTH_14, PAPER_GBSP, PAPER_INITIAL},
    {4, DEPTH_TO("14"), PAPER_DEPTH_14, PAPER_GBSP, PAPER_FINAL},
    {4, DEPTH_TO("14"), PAPER_DEPTH_14, PAPER_GBSP, PAPER_PSNR},
    {4, DEPTH_TO("16"), PAPER_DEPTH_16, PAPER_GBSP, PAPER_INITIAL},
    {4, DEPTH_TO("16"), PAPER_DEPTH_16, PAPER_GBSP, PAPER_FINAL},
    {4, DEPTH_TO("16"), PAPER_DEPTH_16, PAPER_GBSP, PAPER_PSNR},
};

const size_t paper_claim_count = sizeof paper_claims / sizeof *paper_claims;
