/* SPDX-License-Identifier: Apache-2.0 */
/* bake/export_folder.h -- writes the result folder of the 3DGS reference implementation, so that tools made
   for its results also work with ours. */
#ifndef GBT_BAKE_EXPORT_FOLDER_H
#define GBT_BAKE_EXPORT_FOLDER_H

#include "image/metrics.h"
#include "run/loaded_run.h"

/** Whether an output is meant to be a result folder: its name ends in a slash. */
bool export_folder_is(const char *path);

/** GBT_ERR_ARGUMENT when the folder holds a later iteration than the run's: readers use the last one. */
gbt_status export_folder_check(const char *folder, const loaded_run *r, gbt_error *err);

/**
 * Write cfg_args, cameras.json (held-out views first, then training views), input.ply (the sparse points) and
 * point_cloud/iteration_N/point_cloud.ply, where N is the number of iterations of the run.
 *
 * @param r     [in]  with its views and photos open
 * @param cloud [in]  in the model's coordinates
 * @param bytes [out] size of point_cloud.ply
 */
gbt_status export_folder_write(const char *folder, const loaded_run *r, const gaussian_cloud *cloud,
                               long long *bytes, gbt_error *err);

/** Write test/ours_N/renders/INDEX.png and test/ours_N/gt/INDEX.png; INDEX has five digits. */
gbt_status export_folder_picture(const char *folder, const loaded_run *r, size_t index, const image *render,
                                 const image *photo, gbt_error *err);

/**
 * Write results.json and per_view.json: means and values of SSIM and PSNR of `count` pictures, and of LPIPS
 * with 3DGS's input range unless `with_network` is NULL.
 */
gbt_status export_folder_scores(const char *folder, const loaded_run *r, const image_scores *scores,
                                const lpips_scores *with_network, size_t count, gbt_error *err);

#endif
