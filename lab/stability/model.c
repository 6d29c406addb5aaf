/* SPDX-License-Identifier: Apache-2.0 */
/* stability/model.c -- write a 3DGS file in memory and read it back. */
#include "stability/model.h"

#include <stdio.h>

#include "base/fail.h"
#include "data/bytes.h"
#include "data/gaussian_ply.h"
#include "stability/draw.h"

static void put_model(sink *out, const float (*rows)[MODEL_COLUMNS], size_t count)
{
    static const char *const names[MODEL_COLUMNS] = {"x",      "y",       "z",       "f_dc_0",  "f_dc_1",
                                                     "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                                                     "rot_0",  "rot_1",   "rot_2",   "rot_3"};
    char line[96];
    snprintf(line, sizeof line, "ply\nformat binary_little_endian 1.0\nelement vertex %zu\n", count);
    sink_put_text(out, line);
    for (int i = 0; i < MODEL_COLUMNS; i++) {
        snprintf(line, sizeof line, "property float %s\n", names[i]);
        sink_put_text(out, line);
    }
    sink_put_text(out, "end_header\n");
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < MODEL_COLUMNS; k++)
            sink_put_f32(out, rows[i][k]);
}

gbt_status stability_read_model(stability *s, const float (*rows)[MODEL_COLUMNS], size_t count,
                                gaussian_cloud *out)
{
    sink bytes = {0};
    gbt_error err = {0};
    *out = (gaussian_cloud){0};
    if (s->status != GBT_OK)
        return s->status;
    put_model(&bytes, rows, count);
    gbt_status status = bytes.status;
    if (status == GBT_OK) {
        const source_file file = {"model in memory", bytes.bytes, bytes.size};
        status = gaussian_ply_read(&file, out, &err);
    }
    sink_free(&bytes);
    if (status == GBT_ERR_NO_MEMORY)
        stability_ok(s, base_fail(s->err, status, "%s: no memory for a model", s->path));
    return status;
}

size_t stability_bad_in_model(const gaussian_cloud *cloud)
{
    const size_t n = cloud->count;
    return draw_count_bad(cloud->mean, 3 * n) + draw_count_bad(cloud->scale_log, 3 * n) +
           draw_count_bad(cloud->quat, 4 * n) + draw_count_bad(cloud->opacity, n) +
           draw_count_bad(cloud->sh, 3 * GAUSSIAN_SH_COUNT * n);
}
