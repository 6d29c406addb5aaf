/* SPDX-License-Identifier: Apache-2.0 */
/* data/glb.h -- what the writer and the reader of .glb share: numbers of binary glTF 2.0. */
#ifndef GBT_DATA_GLB_H
#define GBT_DATA_GLB_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

enum {
    GLB_MAGIC = 0x46546C67,
    GLB_JSON = 0x4E4F534A, /* chunks */
    GLB_BINARY = 0x004E4942,
    GLB_BYTE = 5120, /* componentType */
    GLB_UBYTE = 5121,
    GLB_SHORT = 5122,
    GLB_USHORT = 5123,
    GLB_FLOAT = 5126,
    GLB_POINTS = 0 /* mode */
};

/** The near distance, a number in the `extras` of `asset`, which are for what others need not know. */
#define GLB_NEAR "gbtrace_near"

/** The first primitive with KHR_gaussian_splatting, neither compressed nor sparse; the translation of its
   node becomes the origin. */
gbt_status glb_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

#endif
