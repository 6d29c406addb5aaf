/* SPDX-License-Identifier: Apache-2.0 */
/* data/glb.h -- constants of binary glTF 2.0, shared by the reader and the writer of .glb. */
#ifndef GBT_DATA_GLB_H
#define GBT_DATA_GLB_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

enum {
    GLB_MAGIC = 0x46546C67,
    GLB_JSON = 0x4E4F534A, /* chunk types */
    GLB_BINARY = 0x004E4942,
    GLB_BYTE = 5120, /* componentType */
    GLB_UBYTE = 5121,
    GLB_SHORT = 5122,
    GLB_USHORT = 5123,
    GLB_FLOAT = 5126,
    GLB_POINTS = 0 /* mode */
};

/** The near distance: our own number in `extras` of `asset`, which glTF reserves for application data. */
#define GLB_NEAR "gbtrace_near"

/** Read the first primitive with KHR_gaussian_splatting; compressed or sparse data is an error. The
    translation of its first node becomes the origin. A warning counts primitives and nodes if there are
    more. */
gbt_status glb_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

#endif
