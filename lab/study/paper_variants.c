/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper_variants.c -- the runs of the study "paper", and which of them each table compares. */
#include "study/paper.h"

/* The paper's growth ends after half of the run, at iteration 15000 of 30000. */
static const double full = 0.5, third = 1.0 / 3, sixth = 1.0 / 6;

/* Names are folders of runs: if a row changes its meaning it needs a new name. */
const paper_variant paper_variants[PAPER_VARIANTS] = {
    [PAPER_VOXEL] = {"voxel", "voxels", GBT_INIT_VOXEL, GBT_SCALE_PRIOR_NN, false, full, PAPER_DEPTH_MAX},
    [PAPER_GBSP] = {"gbai-gbsp", "GBAI + GBSP", GBT_INIT_GB, GBT_SCALE_PRIOR_GB, false, full,
                    PAPER_DEPTH_MAX},
    [PAPER_GBAI] = {"gbai", "GBAI", GBT_INIT_GB, GBT_SCALE_PRIOR_NN, false, full, PAPER_DEPTH_MAX},
    [PAPER_VOXEL_SCALED] = {"voxel-scaled", "voxels, scale x constant", GBT_INIT_VOXEL, GBT_SCALE_PRIOR_NN,
                            true, full, PAPER_DEPTH_MAX},
    [PAPER_GBAI_SCALED] = {"gbai-scaled", "GBAI, scale x constant", GBT_INIT_GB, GBT_SCALE_PRIOR_NN, true,
                           full, PAPER_DEPTH_MAX},
    [PAPER_VOXEL_SIXTH] = {"voxel-grow-sixth", "voxels, growth to 1/6", GBT_INIT_VOXEL, GBT_SCALE_PRIOR_NN,
                           false, sixth, PAPER_DEPTH_MAX},
    [PAPER_GBSP_SIXTH] = {"gbai-gbsp-grow-sixth", "GBAI + GBSP, growth to 1/6", GBT_INIT_GB,
                          GBT_SCALE_PRIOR_GB, false, sixth, PAPER_DEPTH_MAX},
    [PAPER_VOXEL_THIRD] = {"voxel-grow-third", "voxels, growth to 1/3", GBT_INIT_VOXEL, GBT_SCALE_PRIOR_NN,
                           false, third, PAPER_DEPTH_MAX},
    [PAPER_GBSP_THIRD] = {"gbai-gbsp-grow-third", "GBAI + GBSP, growth to 1/3", GBT_INIT_GB,
                          GBT_SCALE_PRIOR_GB, false, third, PAPER_DEPTH_MAX},
    [PAPER_DEPTH_10] = {"gbai-gbsp-depth-10", "D_max 10", GBT_INIT_GB, GBT_SCALE_PRIOR_GB, false, full, 10},
    [PAPER_DEPTH_12] = {"gbai-gbsp-depth-12", "D_max 12", GBT_INIT_GB, GBT_SCALE_PRIOR_GB, false, full, 12},
    [PAPER_DEPTH_14] = {"gbai-gbsp-depth-14", "D_max 14", GBT_INIT_GB, GBT_SCALE_PRIOR_GB, false, full, 14},
    [PAPER_DEPTH_16] = {"gbai-gbsp-depth-16", "D_max 16", GBT_INIT_GB, GBT_SCALE_PRIOR_GB, false, full, 16},
};

size_t paper_table_variants(int table, const paper_variant_id **out)
{
    static const paper_variant_id main_results[] = {PAPER_VOXEL, PAPER_GBSP},
                                  ablation[] = {PAPER_VOXEL, PAPER_GBAI, PAPER_GBSP, PAPER_VOXEL_SCALED,
                                                PAPER_GBAI_SCALED},
                                  growth[] = {PAPER_VOXEL_SIXTH, PAPER_GBSP_SIXTH, PAPER_VOXEL_THIRD,
                                              PAPER_GBSP_THIRD,  PAPER_VOXEL,      PAPER_GBSP},
                                  depth[] = {PAPER_DEPTH_10, PAPER_DEPTH_12, PAPER_DEPTH_14, PAPER_DEPTH_16,
                                             PAPER_GBSP};
    static const struct {
        const paper_variant_id *variants;
        size_t count;
    } all[PAPER_TABLES] = {{main_results, sizeof main_results / sizeof *main_results},
                           {ablation, sizeof ablation / sizeof *ablation},
                           {growth, sizeof growth / sizeof *growth},
                           {depth, sizeof depth / sizeof *depth}};
    *out = all[table - 1].variants;
    return all[table - 1].count;
}
