/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_ply_write.c -- writes plain 3DGS models as the .ply that every viewer reads. */
#include <math.h>
#include <stdio.h>

#include "data/compressed_ply.h"
#include "data/gaussian_formats.h"
#include "data/gaussian_ply.h"

/* The inverse of the sigmoid. 0 and 1 give finite logits whose sigmoid in float is as close as possible. */
static double logit(double opacity)
{
    const double p = fmin(fmax(opacity, 1e-7), 1 - 1e-7);
    return log(p / (1 - p));
}

static void put_properties(sink *s, const char *stem, size_t count)
{
    char line[64];
    for (size_t i = 0; i < count; i++) {
        snprintf(line, sizeof line, "property float %s%zu\n", stem, i);
        sink_put_text(s, line);
    }
}

/*
 * Write a file as the 3DGS reference implementation does: binary, normals of 0, f_rest channel-major, opacity
 * as a logit, scales as logs.
 *
 * @param origin [in] added to every mean in double
 */
static gbt_status write_ply(const char *path, const gaussian_cloud *cloud, const double origin[3],
                            gbt_error *err)
{
    const size_t functions = (size_t)((cloud->sh_degree + 1) * (cloud->sh_degree + 1));
    sink s = {.err = err};
    char line[128];
    sink_put_text(&s, "ply\nformat binary_little_endian 1.0\n");
    if (cloud->antialiased)
        sink_put_text(&s, GAUSSIAN_PLY_MIP "\n");
    snprintf(line, sizeof line, "element vertex %zu\n", cloud->count);
    sink_put_text(&s, line);
    gaussian_ply_put_near(&s, cloud); /* after the count, because the viewer of 3DGS expects that in the third
                                         line */
    sink_put_text(&s, "property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty "
                      "float ny\nproperty float nz\n");
    put_properties(&s, "f_dc_", 3);
    put_properties(&s, "f_rest_", 3 * (functions - 1));
    sink_put_text(&s, "property float opacity\n");
    put_properties(&s, "scale_", 3);
    put_properties(&s, "rot_", 4);
    sink_put_text(&s, "end_header\n");
    for (size_t i = 0; i < cloud->count && s.status == GBT_OK; i++) {
        const float(*sh)[3] = (const float(*)[3])(cloud->sh + i * GAUSSIAN_SH_COUNT * 3);
        for (size_t k = 0; k < 3; k++)
            sink_put_f32(&s, (float)((double)cloud->mean[3 * i + k] + origin[k]));
        for (size_t k = 0; k < 3; k++)
            sink_put_f32(&s, 0);
        for (size_t c = 0; c < 3; c++)
            sink_put_f32(&s, sh[0][c]);
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 1; k < functions; k++)
                sink_put_f32(&s, sh[k][c]);
        sink_put_f32(&s, (float)logit((double)cloud->opacity[i]));
        for (size_t k = 0; k < 3; k++)
            sink_put_f32(&s, cloud->scale_log[3 * i + k]);
        for (size_t k = 0; k < 4; k++)
            sink_put_f32(&s, cloud->quat[4 * i + k]);
    }
    return sink_write(&s, path);
}

const gaussian_format gaussian_format_ply = {
    .ending = ".ply",
    .what = "everything, as the reference implementation of 3DGS writes it",
    .degree = 3,
    .read = gaussian_ply_read,
    .holds = gaussian_ply_has_gaussians,
    .write = write_ply};

const gaussian_format gaussian_format_compressed_ply = {
    .ending = ".compressed.ply",
    .what = "a quarter of a .ply: positions to 1/1000 of a chunk of 256, colours in 8 bits",
    .degree = 3,
    .read = gaussian_ply_read,
    .holds = gaussian_ply_has_gaussians,
    .write = compressed_ply_write};
