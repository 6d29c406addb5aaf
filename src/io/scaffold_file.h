/* SPDX-License-Identifier: Apache-2.0 */
/* io/scaffold_file.h -- trained models of Scaffold-GS: a .ply of anchors, and three networks as .safetensors
   beside it. */
#ifndef GBT_IO_SCAFFOLD_FILE_H
#define GBT_IO_SCAFFOLD_FILE_H

#include "io/model_file.h"

/**
 * Read anchors and networks (docs/formats.md) as a model of ours that decodes to the same Gaussians.
 *
 * opacity_mlp.safetensors, cov_mlp.safetensors and color_mlp.safetensors are looked up in the folder of the
 * .ply; each holds 0.weight, 0.bias, 2.weight and 2.bias. 32 features, 32 hidden units, up to
 * ANCHOR_MAX_OFFSETS offsets; no feature bank, no appearance embedding.
 *
 * @param ply     [in]  path of point_cloud.ply
 * @param out     [out] anchors, decoder and origin (the median of the anchors) are set, the rest is zero;
 *                      free with model_free(); zeroed on failure
 * @param dropped [out] rows with a value that is not finite
 * @return GBT_OK; GBT_ERR_IO (a file is missing; says how to make a .safetensors of a .pt), GBT_ERR_FORMAT,
 *         GBT_ERR_NO_MEMORY
 */
gbt_status scaffold_file_read(const char *ply, model *out, size_t *dropped, gbt_error *err);

/**
 * GBT_ERR_FORMAT for a file of PyTorch (.pt, .pth), saying how to write its networks as .safetensors; GBT_OK
 * for any other name.
 *
 * Scaffold-GS saves three TorchScript files NAME_mlp.pt, or one checkpoint, a dictionary of the three
 * networks.
 */
gbt_status scaffold_file_check_name(const char *path, gbt_error *err);

#endif
