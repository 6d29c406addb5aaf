/* SPDX-License-Identifier: Apache-2.0 */
/* tests/fuzz/targets.h -- the readers that are fuzzed. */
#ifndef GBT_TESTS_FUZZ_TARGETS_H
#define GBT_TESTS_FUZZ_TARGETS_H

#include "data/bytes.h"

typedef void fuzz_target(const source_file *file);

fuzz_target fuzz_colmap_bin, fuzz_colmap_txt, fuzz_transforms, fuzz_ply_points, fuzz_ply_gaussians,
    fuzz_splat, fuzz_spz, fuzz_sog, fuzz_glb, fuzz_usda, fuzz_usdz, fuzz_safetensors, fuzz_model, fuzz_mesh,
    fuzz_config, fuzz_camera, fuzz_path, fuzz_photo, fuzz_request;

/** Inputs that readers took. */
extern size_t fuzz_accepted;

void fuzz_one(fuzz_target *target, const unsigned char *bytes, size_t size);

#endif
