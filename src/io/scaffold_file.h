/* SPDX-License-Identifier: Apache-2.0 */
/* io/scaffold_file.h -- reads trained Scaffold-GS models: a .ply of anchors, and three networks as
   .safetensors beside it. */
#ifndef GBT_IO_SCAFFOLD_FILE_H
#define GBT_IO_SCAFFOLD_FILE_H

#include "io/model.h"

/**
 * Read anchors and networks (docs/formats.md) as a gbtrace model that decodes to the same Gaussians.
 *
 * opacity_mlp.safetensors, cov_mlp.safetensors and color_mlp.safetensors are looked up in the folder of the
 * .ply; each holds 0.weight, 0.bias, 2.weight and 2.bias. 32 features, 32 hidden units, up to
 * ANCHOR_MAX_OFFSETS offsets; no feature bank, no appearance embedding.
 *
 * @param ply     [in]  path of point_cloud.ply
 * @param out     [out] anchors, decoder and origin (the median of the anchors) are set, the rest is zero;
 *                      free with model_free(); zeroed on failure
 * @param dropped [out] number of rows dropped because a value is not finite
 * @return GBT_OK; GBT_ERR_IO (a file is missing; the message says how to convert a .pt), GBT_ERR_FORMAT,
 *         GBT_ERR_NO_MEMORY
 */
gbt_status scaffold_file_read(const char *ply, model *out, size_t *dropped, gbt_error *err);

/**
 * GBT_ERR_FORMAT for a PyTorch file (.pt, .pth), with a message that says how to convert its networks to
 * .safetensors; GBT_OK for any other name.
 *
 * Scaffold-GS saves either three TorchScript files NAME_mlp.pt, or one checkpoint with a dictionary of the
 * three networks.
 */
gbt_status scaffold_file_check_name(const char *path, gbt_error *err);

#endif
