/* SPDX-License-Identifier: Apache-2.0 */
/* trace/ray_file.c -- rays that the user computed: an EXR with six channels. */
#include "trace/ray_file.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/image.h"
#include "base/vec.h"

enum { RAY_CHANNELS = 6 };

/* 0 to 5: origin x, y, z, direction x, y, z; -1: none of them. */
static int slot_of(const char *name)
{
    const size_t length = strlen(name);
    if (length < 2)
        return -1;
    const int kind = tolower((unsigned char)name[0]), axis = tolower((unsigned char)name[length - 1]) - 'x';
    return (kind == 'o' || kind == 'd') && axis >= 0 && axis < 3 ? (kind == 'o' ? 0 : 3) + axis : -1;
}

static gbt_status find_channels(const char *path, const image *im, const image_names *names,
                                int channel[RAY_CHANNELS], gbt_error *err)
{
    int found = 0;
    for (int k = 0; k < RAY_CHANNELS; k++)
        channel[k] = -1;
    for (int c = 0; c < im->channels; c++) {
        const int slot = slot_of(names->name[c]);
        if (slot < 0)
            continue;
        if (channel[slot] >= 0)
            return base_fail(err, GBT_ERR_FORMAT, "%s: channels \"%s\" and \"%s\" name the same thing", path,
                             names->name[channel[slot]], names->name[c]);
        channel[slot] = c;
        found++;
    }
    if (found == 0 && im->channels == RAY_CHANNELS)
        for (int k = 0; k < RAY_CHANNELS; k++)
            channel[k] = k;
    else if (found != RAY_CHANNELS)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: %d channels, %d of them named as rays (wanted ox oy oz dx dy dz, or just six "
                         "with other names)",
                         path, im->channels, found);
    return GBT_OK;
}

static gbt_status take_rays(const char *path, const image *im, const int channel[RAY_CHANNELS],
                            const double origin[3], ray_image *out, gbt_error *err)
{
    const size_t count = (size_t)im->width * (size_t)im->height;
    for (size_t i = 0; i < count; i++) {
        double value[RAY_CHANNELS];
        bool fine = true;
        for (int k = 0; k < RAY_CHANNELS; k++) {
            value[k] =
                (double)im->pixels[i * (size_t)im->channels + (size_t)channel[k]] - (k < 3 ? origin[k] : 0);
            fine = fine &&
                   (k < 3 ? fabs(value[k]) < RAY_ORIGIN_LIMIT : isfinite(value[k])); /* both false for NaN */
        }
        if (!fine)
            return base_fail(err, GBT_ERR_FORMAT,
                             "%s: pixel (%zu, %zu): ray (%g, %g, %g) -> (%g, %g, %g) (wanted finite values, "
                             "origins within 1e17)",
                             path, i % (size_t)im->width, i / (size_t)im->width, value[0], value[1], value[2],
                             value[3], value[4], value[5]);
        dvec_normalize(value + 3);
        for (int k = 0; k < 3; k++) {
            out->origin[3 * i + (size_t)k] = (float)value[k];
            out->dir[3 * i + (size_t)k] = (float)value[3 + k];
        }
    }
    return GBT_OK;
}

gbt_status ray_image_read(const char *path, const double origin[3], ray_image *out, gbt_error *err)
{
    image im;
    image_names names;
    int channel[RAY_CHANNELS];
    GBT_TRY(image_read_raw(path, &im, &names, err));
    gbt_status status = find_channels(path, &im, &names, channel, err);
    if (status == GBT_OK)
        status = ray_image_reserve(out, im.width, im.height, false, err);
    if (status == GBT_OK)
        status = take_rays(path, &im, channel, origin, out, err);
    if (status != GBT_OK)
        ray_image_free(out);
    image_free(&im);
    return status;
}
