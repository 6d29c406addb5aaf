/* SPDX-License-Identifier: Apache-2.0 */
/* train/photo_pick.c -- every n-th pixel of a photo in both directions, converted from bytes to floats. */
#include "train/photo_pick.h"

#include "base/parallel.h"

enum { PICK_ROWS = 32 /* rows per block of work */ };

typedef struct pick_job {
    const unsigned char *bytes, *transparency;
    const float *change;
    size_t first, row, step; /* pixels */
    image *out;
} pick_job;

static size_t first_of(const photo_pick *pick, int full_width)
{
    return (size_t)pick->first[1] * (size_t)full_width + (size_t)pick->first[0];
}

static void lay_on(const pick_job *job, const unsigned char *transparency, float *to)
{
    for (size_t x = 0; x < (size_t)job->out->width; x++)
        for (size_t c = 0; c < 3; c++)
            to[3 * x + c] += (float)transparency[x * job->step] * (1.0f / 255) * job->change[c];
}

static void pick_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const pick_job *job = context;
    const size_t width = (size_t)job->out->width, stride = 3 * job->step;
    for (size_t y = begin; y < end; y++) {
        const size_t first = job->first + y * job->step * job->row;
        const unsigned char *from = job->bytes + 3 * first;
        float *to = job->out->pixels + 3 * y * width;
        if (job->step == 1) { /* contiguous pixels: the compiler vectorises this loop */
            for (size_t i = 0; i < 3 * width; i++)
                to[i] = (float)from[i] * (1.0f / 255);
        } else {
            for (size_t x = 0; x < width; x++)
                for (size_t c = 0; c < 3; c++)
                    to[3 * x + c] = (float)from[x * stride + c] * (1.0f / 255);
        }
        if (job->transparency != NULL)
            lay_on(job, job->transparency + first, to);
    }
}

void photo_pick_pixels(const unsigned char *bytes, int full_width, const photo_pick *pick,
                       const unsigned char *transparency, const float *change, image *out)
{
    pick_job job = {.bytes = bytes,
                    .transparency = transparency,
                    .change = change,
                    .first = first_of(pick, full_width),
                    .row = (size_t)full_width,
                    .step = (size_t)pick->step,
                    .out = out};
    parallel_blocks((size_t)out->height, PICK_ROWS, pick_rows, &job);
}

void photo_pick_marks(const unsigned char *marks, int full_width, const photo_pick *pick, int width,
                      int height, unsigned char *out)
{
    const size_t w = (size_t)width, h = (size_t)height, step = (size_t)pick->step;
    marks += first_of(pick, full_width);
    for (size_t y = 0; y < h; y++)
        for (size_t x = 0; x < w; x++)
            out[y * w + x] = marks[y * step * (size_t)full_width + x * step];
}
