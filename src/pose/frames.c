/* SPDX-License-Identifier: Apache-2.0 */
/* pose/frames.c -- measures sharpness, and chooses frames. */
#include "pose/frames.h"

#include <math.h>
#include <stdint.h>

#include "base/memory.h"
#include "data/photo_size.h"

/* How far from the centre of its part a frame may be, as a fraction of the part: below 1/2, so that frames of
   neighbouring parts are not next to each other. */
static const double middle = 0.35;

double frames_sharpness(const unsigned char *grey, int width, int height)
{
    double sum = 0, squares = 0;
    if (width < 3 || height < 3)
        return 0;
    for (int y = 1; y < height - 1; y++)
        for (int x = 1; x < width - 1; x++) {
            const unsigned char *p = grey + (size_t)y * (size_t)width + x;
            const int laplacian = p[-1] + p[1] + p[-width] + p[width] - 4 * p[0];
            sum += laplacian;
            squares += (double)laplacian * laplacian;
        }
    const double count = (double)(width - 2) * (height - 2), mean = sum / count;
    return squares / count - mean * mean;
}

static void set_places(frame_measure *frames, size_t count)
{
    double total = 0, change = 0;
    for (size_t i = 1; i < count; i++)
        total += frames[i].change;
    for (size_t i = 0; i < count; i++) {
        const double time = (double)i / (double)(count - 1);
        change += i > 0 ? frames[i].change : 0;
        frames[i].place = total > 0 ? 0.5 * time + 0.5 * change / total : time;
    }
}

/* The sharpest frame of [first, last] within `reach` of the centre; if there is none, the frame nearest to
   the centre. */
static size_t choose_one(const frame_measure *frames, size_t first, size_t last, double centre, double reach)
{
    size_t nearest = first, sharpest = last + 1;
    for (size_t i = first; i <= last; i++) {
        const double off = fabs(frames[i].place - centre);
        if (off < fabs(frames[nearest].place - centre))
            nearest = i;
        if (off <= reach && (sharpest > last || frames[i].sharpness > frames[sharpest].sharpness))
            sharpest = i;
    }
    return sharpest <= last ? sharpest : nearest;
}

size_t frames_choose(frame_measure *frames, size_t count, size_t wanted, size_t *chosen)
{
    if (wanted >= count || count < 2) {
        for (size_t i = 0; i < count; i++)
            chosen[i] = i;
        return count;
    }
    set_places(frames, count);
    for (size_t part = 0; part < wanted; part++) {
        const size_t first = part > 0 ? chosen[part - 1] + 1 : 0, last = count - (wanted - part);
        chosen[part] =
            choose_one(frames, first, last, ((double)part + 0.5) / (double)wanted, middle / (double)wanted);
    }
    return wanted;
}

gbt_status frames_photo_sharpness(const char *path, double *out, gbt_error *err)
{
    image photo = {0}, small = {0};
    unsigned char *grey = NULL;
    gbt_status status = image_read(path, &photo, err);
    const int width = photo.width < FRAMES_WIDTH ? photo.width : FRAMES_WIDTH;
    if (status == GBT_OK) {
        const int height = (int)((int64_t)photo.height * width / photo.width);
        status = photo_resize(&photo, width, height > 0 ? height : 1, &small, err);
    }
    const size_t count = (size_t)small.width * (size_t)small.height;
    if (status == GBT_OK && (grey = mem_alloc(count, 1, "photo", err)) == NULL)
        status = GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count && status == GBT_OK; i++) {
        const float *p = small.pixels + i * (size_t)small.channels;
        grey[i] = (unsigned char)(255 * (0.299f * p[0] + 0.587f * p[1] + 0.114f * p[2]) + 0.5f);
    }
    *out = status == GBT_OK ? frames_sharpness(grey, small.width, small.height) : 0;
    mem_free(grey);
    image_free(&small);
    image_free(&photo);
    return status;
}
