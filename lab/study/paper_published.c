/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper_published.c -- the paper's own numbers (3DGBGS, tables 1 to 4), and the changes between their
   rows. */
#include <math.h>
#include <string.h>

#include "study/paper.h"

/* Anchors in thousands, storage in MiB, GFLOPs of the networks as the paper counts them. NaN: not given. */
typedef struct published_row {
    int table;
    const char *scene; /* or the name of a data set, for its mean */
    paper_variant_id variant;
    double initial, final, storage, arithmetic, psnr, ssim, lpips;
} published_row;

static const published_row rows[] = {
    {1, "Mip-NeRF 360", PAPER_VOXEL, 109.8, 567.2, 171.6, NAN, 27.761, 0.812, 0.226},
    {1, "Mip-NeRF 360", PAPER_GBSP, 66.1, 521.8, 158.0, NAN, 27.597, 0.809, 0.230},
    {1, "Tanks & Temples", PAPER_VOXEL, 132.4, 255.8, 77.5, NAN, 24.136, 0.852, 0.175},
    {1, "Tanks & Temples", PAPER_GBSP, 92.7, 228.1, 69.5, NAN, 24.081, 0.850, 0.180},
    {1, "Deep Blending", PAPER_VOXEL, 54.8, 175.9, 53.5, NAN, 30.242, 0.906, 0.256},
    {1, "Deep Blending", PAPER_GBSP, 34.1, 160.7, 49.0, NAN, 30.123, 0.905, 0.257},
    {1, "BungeeNeRF", PAPER_VOXEL, 113.5, 579.7, 175.2, NAN, 24.891, 0.837, 0.202},
    {1, "BungeeNeRF", PAPER_GBSP, 65.2, 510.2, 154.3, NAN, 24.946, 0.842, 0.211},

    {2, "Rome", PAPER_VOXEL, 120.8, 564.7, 171, NAN, 22.962, 0.835, 0.200},
    {2, "Rome", PAPER_GBAI, 66.4, 557.0, 168, NAN, 23.538, 0.839, 0.211},
    {2, "Rome", PAPER_GBSP, 66.4, 528.9, 160, NAN, 23.276, 0.838, 0.208},
    {2, "Hollywood", PAPER_VOXEL, 106.4, 452.3, 137, NAN, 23.718, 0.767, 0.258},
    {2, "Hollywood", PAPER_GBAI, 65.6, 460.2, 139, NAN, 23.342, 0.752, 0.293},
    {2, "Hollywood", PAPER_GBSP, 65.6, 428.0, 130, NAN, 23.283, 0.756, 0.281},
    {2, "Quebec", PAPER_VOXEL, 113.5, 480.2, 145, NAN, 28.235, 0.921, 0.153},
    {2, "Quebec", PAPER_GBAI, 66.2, 464.5, 141, NAN, 28.337, 0.918, 0.165},
    {2, "Quebec", PAPER_GBSP, 66.2, 441.6, 134, NAN, 28.252, 0.921, 0.153},
    {2, "Bilbao", PAPER_VOXEL, 84.3, 659.2, 199, NAN, 27.981, 0.892, 0.156},
    {2, "Bilbao", PAPER_GBAI, 54.4, 542.6, 164, NAN, 27.791, 0.887, 0.166},
    {2, "Bilbao", PAPER_GBSP, 54.4, 522.5, 158, NAN, 27.921, 0.890, 0.165},
    {2, "Amsterdam", PAPER_VOXEL, 124.8, 699.9, 211, NAN, 26.736, 0.896, 0.144},
    {2, "Amsterdam", PAPER_GBAI, 67.7, 684.2, 207, NAN, 26.640, 0.886, 0.164},
    {2, "Amsterdam", PAPER_GBSP, 67.7, 659.2, 199, NAN, 26.738, 0.918, 0.164},
    {2, "Pompidou", PAPER_VOXEL, 130.9, 621.8, 188, NAN, 19.715, 0.709, 0.301},
    {2, "Pompidou", PAPER_GBAI, 71.0, 576.1, 174, NAN, 20.121, 0.722, 0.299},
    {2, "Pompidou", PAPER_GBSP, 71.0, 480.8, 145, NAN, 20.205, 0.728, 0.294},

    {3, "Bonsai", PAPER_VOXEL_SIXTH, NAN, 288.90, NAN, 5.375, 32.539, 0.946, 0.184},
    {3, "Bonsai", PAPER_GBSP_SIXTH, NAN, 233.06, NAN, 3.819, 32.128, 0.944, 0.187},
    {3, "Bonsai", PAPER_VOXEL_THIRD, NAN, 360.42, NAN, 5.584, 32.698, 0.948, 0.180},
    {3, "Bonsai", PAPER_GBSP_THIRD, NAN, 305.90, NAN, 4.019, 32.382, 0.945, 0.183},
    {3, "Bonsai", PAPER_VOXEL, NAN, 416.09, NAN, 5.756, 32.834, 0.948, 0.179},
    {3, "Bonsai", PAPER_GBSP, NAN, 351.75, NAN, 4.053, 32.433, 0.946, 0.182},
    {3, "Bicycle", PAPER_VOXEL_SIXTH, NAN, 338.20, NAN, 1.880, 24.765, 0.720, 0.293},
    {3, "Bicycle", PAPER_GBSP_SIXTH, NAN, 308.35, NAN, 1.672, 24.693, 0.714, 0.300},
    {3, "Bicycle", PAPER_VOXEL_THIRD, NAN, 655.20, NAN, 4.721, 25.059, 0.740, 0.265},
    {3, "Bicycle", PAPER_GBSP_THIRD, NAN, 615.24, NAN, 4.469, 25.019, 0.736, 0.271},
    {3, "Bicycle", PAPER_VOXEL, NAN, 912.30, NAN, 7.187, 25.143, 0.746, 0.257},
    {3, "Bicycle", PAPER_GBSP, NAN, 872.15, NAN, 6.829, 25.056, 0.742, 0.262},

    {4, "Deep Blending", PAPER_DEPTH_10, 1.02, 163.68, NAN, NAN, 29.713, 0.896, 0.273},
    {4, "Deep Blending", PAPER_DEPTH_12, 4.10, 161.78, NAN, NAN, 29.890, 0.899, 0.269},
    {4, "Deep Blending", PAPER_DEPTH_14, 16.37, 151.09, NAN, NAN, 30.003, 0.902, 0.264},
    {4, "Deep Blending", PAPER_DEPTH_16, 34.13, 157.19, NAN, NAN, 30.146, 0.905, 0.256},
    {4, "Deep Blending", PAPER_GBSP, 34.14, 160.65, NAN, NAN, 30.123, 0.905, 0.257},
};

static double value_of(const published_row *r, paper_figure figure)
{
    switch (figure) {
    case PAPER_INITIAL:
        return r->initial;
    case PAPER_FINAL:
        return r->final;
    case PAPER_STORAGE:
        return r->storage;
    case PAPER_ARITHMETIC:
        return r->arithmetic;
    case PAPER_PSNR:
        return r->psnr;
    case PAPER_SSIM:
        return r->ssim;
    case PAPER_LPIPS:
        return r->lpips;
    default:
        return NAN;
    }
}

static double change(const paper_claim *claim, double from, double to)
{
    return paper_figure_texts[claim->figure].is_relative ? 100 * (to / from - 1) : to - from;
}

/* The next pair of rows of one scene that belongs to a claim, searching from `*at` on. */
static bool next_pair(const paper_claim *claim, size_t *at, double *from, double *to)
{
    for (; *at < sizeof rows / sizeof *rows; ++*at) {
        const published_row *base = &rows[*at];
        if (base->table != claim->table || base->variant != claim->base)
            continue;
        for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
            if (rows[i].table == claim->table && rows[i].variant == claim->variant &&
                strcmp(rows[i].scene, base->scene) == 0) {
                *from = value_of(base, claim->figure);
                *to = value_of(&rows[i], claim->figure);
                ++*at;
                return isfinite(*from) && isfinite(*to);
            }
    }
    return false;
}

double paper_published(const paper_claim *claim)
{
    double from, to, from_sum = 0, to_sum = 0, pairs = 0;
    for (size_t at = 0; next_pair(claim, &at, &from, &to);) {
        from_sum += from;
        to_sum += to;
        pairs++;
    }
    return pairs > 0 ? change(claim, from_sum / pairs, to_sum / pairs) : (double)NAN;
}

bool paper_published_range(const paper_claim *claim, double range[2])
{
    double from, to;
    range[0] = INFINITY;
    range[1] = -INFINITY;
    for (size_t at = 0; next_pair(claim, &at, &from, &to);) {
        const double one = change(claim, from, to);
        range[0] = fmin(range[0], one);
        range[1] = fmax(range[1], one);
    }
    return range[0] <= range[1];
}
