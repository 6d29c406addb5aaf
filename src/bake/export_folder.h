/* SPDX-License-Identifier: Apache-2.0 */
/* bake/export_folder.h -- the folder that the reference implementation of 3DGS leaves behind, so that what
   was made for its results works on ours. */
#ifndef GBT_BAKE_EXPORT_FOLDER_H
#define GBT_BAKE_EXPORT_FOLDER_H

#include "eval/lpips.h"
#include "image/metrics.h"
#include "run/loaded_run.h"

/** Whether an output is meant as a result folder: its name ends in a slash. */
bool export_folder_is(const char *path);

/** GBT_ERR_ARGUMENT when it holds a later iteration than the run's: readers take the last one. */
gbt_status export_folder_check(const char *folder, const loaded_run *r, gbt_error *err);

/**
 * cfg_args, cameras.json (held-out views first, then those trained on), input.ply (the sparse points) and
 * point_cloud/iteration_N/point_cloud.ply, N the iterations of the run.
 *
 * @param r     [in]  with its views and photos open
 * @param cloud [in]  in the model's coordinates
 * @param bytes [out] of point_cloud.ply
 */
gbt_status export_folder_write(const char *folder, const loaded_run *r, const gaussian_cloud *cloud,
                               long long *bytes, gbt_error *err);

/** test/ours_N/renders/INDEX.png and test/ours_N/gt/INDEX.png, five digits. */
gbt_status export_folder_picture(const char *folder, const loaded_run *r, size_t index, const image *render,
                                 const image *photo, gbt_error *err);

/**
 * results.json and per_view.json: means and values of the `count` pictures: SSIM, PSNR, and LPIPS as 3DGS
 * feeds it unless `with_network` is NULL.
 */
gbt_status export_folder_scores(const char *folder, const loaded_run *r, const image_scores *scores,
                                const lpips_scores *with_network, size_t count, gbt_error *err);

#endif
