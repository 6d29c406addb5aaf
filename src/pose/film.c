/* SPDX-License-Identifier: Apache-2.0 */
/* pose/film.c -- runs ffmpeg twice: once for small grey pictures of all frames, once to decode the chosen
   frames. */
#include "pose/film.h"

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/bytes.h"
#include "pose/child.h"
#include "pose/frames.h"

enum {
    BLOCK = 16,            /* side in pixels; change is measured on means of blocks, which suppresses noise */
    BLOCKS_MAX = 64 * 256, /* for a picture of width FRAMES_WIDTH; taller ones are rejected */
    PICTURE_MAX = 1 << 24, /* bytes */
    FRAMES_LEAST = 60,
    FRAMES_MOST = 200
};

static const double frames_a_second = 3;

/* ---- ffmpeg's messages ---- */

/* The last line of a log, for an error message. */
static void last_line(const char *log_path, char *out, size_t size)
{
    char line[512];
    FILE *log = fopen(log_path, "re");
    out[0] = '\0';
    while (log != NULL && fgets(line, sizeof line, log) != NULL) {
        line[strcspn(line, "\r\n")] = '\0';
        if (line[0] != '\0')
            snprintf(out, size, "%s", line);
    }
    if (log != NULL)
        fclose(log);
}

/* The length of the film in seconds, and frames per second; 0 when the log does not state them. */
static void read_length(const char *log_path, double *seconds, double *rate)
{
    char line[512];
    FILE *log = fopen(log_path, "re");
    *seconds = *rate = 0;
    while (log != NULL && fgets(line, sizeof line, log) != NULL) {
        int hours, minutes;
        double rest;
        const char *at = strstr(line, "Duration: ");
        if (at != NULL && *seconds == 0 && sscanf(at, "Duration: %d:%d:%lf", &hours, &minutes, &rest) == 3)
            *seconds = 3600 * hours + 60 * minutes + rest;
        at = strstr(line, " fps,");
        if (at != NULL && *rate == 0 && strstr(line, "Video:") != NULL) {
            while (at > line && at[-1] != ' ')
                at--;
            *rate = strtod(at, NULL);
        }
    }
    if (log != NULL)
        fclose(log);
}

/* ---- small grey pictures ---- */

typedef struct measuring {
    child ffmpeg;
    unsigned char bytes[1 << 16];
    size_t have, used;
    unsigned char *picture; /* owned */
    size_t picture_capacity;
    int width, height;
    float blocks[2][BLOCKS_MAX]; /* block means of this frame and the one before */
    frame_measure *frames;       /* owned */
    size_t count, capacity;
} measuring;

/* Read `count` bytes, or fewer at the end. */
static gbt_status take(measuring *m, unsigned char *out, size_t count, size_t *got, gbt_error *err)
{
    *got = 0;
    while (*got < count) {
        if (m->used == m->have) {
            GBT_TRY(child_read(&m->ffmpeg, m->bytes, sizeof m->bytes, &m->have, err));
            m->used = 0;
            if (m->have == 0)
                return GBT_OK;
        }
        const size_t part = count - *got < m->have - m->used ? count - *got : m->have - m->used;
        memcpy(out + *got, m->bytes + m->used, part);
        *got += part;
        m->used += part;
    }
    return GBT_OK;
}

static gbt_status odd_output(gbt_error *err)
{
    return base_fail(err, GBT_ERR_IO, "ffmpeg: unexpected output (wanted PGM pictures)");
}

/* Read a number of the PGM header and the blank after it. */
static gbt_status take_number(measuring *m, int *out, gbt_error *err)
{
    *out = 0;
    for (int digits = 0; digits < 7; digits++) {
        unsigned char byte;
        size_t got;
        GBT_TRY(take(m, &byte, 1, &got, err));
        if (got == 1 && byte >= '0' && byte <= '9')
            *out = 10 * *out + (byte - '0');
        else if (got == 1 && digits > 0 && (byte == ' ' || byte == '\n'))
            return GBT_OK;
        else
            break;
    }
    return odd_output(err);
}

/* Read one PGM picture; `more` is false at the end. */
static gbt_status take_picture(measuring *m, bool *more, gbt_error *err)
{
    unsigned char magic[3];
    size_t got;
    int most;
    GBT_TRY(take(m, magic, sizeof magic, &got, err));
    *more = got > 0;
    if (got == 0)
        return GBT_OK;
    if (got < sizeof magic || memcmp(magic, "P5\n", sizeof magic) != 0)
        return odd_output(err);
    GBT_TRY(take_number(m, &m->width, err));
    GBT_TRY(take_number(m, &m->height, err));
    GBT_TRY(take_number(m, &most, err));
    const size_t size = (size_t)m->width * (size_t)m->height;
    if (most != 255 || size == 0 || size > PICTURE_MAX ||
        (m->width / BLOCK + 1) * (m->height / BLOCK + 1) > BLOCKS_MAX)
        return odd_output(err);
    void *grown = m->picture;
    const gbt_status status = mem_reserve(&grown, &m->picture_capacity, 0, size, 1, "frame", err);
    m->picture = grown;
    GBT_TRY(status);
    GBT_TRY(take(m, m->picture, size, &got, err));
    return got == size ? GBT_OK : odd_output(err);
}

/* Compute the block means of the frame, and their mean difference from the frame before. */
static double change_of(measuring *m)
{
    float *now = m->blocks[m->count % 2], *before = m->blocks[(m->count + 1) % 2];
    const int across = m->width / BLOCK, down = m->height / BLOCK;
    double change = 0;
    for (int v = 0; v < down; v++)
        for (int u = 0; u < across; u++) {
            unsigned sum = 0;
            for (int y = 0; y < BLOCK; y++)
                for (int x = 0; x < BLOCK; x++)
                    sum += m->picture[(size_t)(v * BLOCK + y) * (size_t)m->width + (size_t)(u * BLOCK + x)];
            now[v * across + u] = (float)sum / (BLOCK * BLOCK);
            change += fabs((double)now[v * across + u] - (double)before[v * across + u]);
        }
    return m->count > 0 && across * down > 0 ? change / (across * down) : 0;
}

static gbt_status measure(measuring *m, const char *log_path, double *seconds, gbt_error *err)
{
    double rate = 0;
    for (;;) {
        bool more;
        GBT_TRY(take_picture(m, &more, err));
        if (!more) {
            if (*seconds == 0 && rate > 0)
                *seconds = (double)m->count / rate;
            return GBT_OK;
        }
        if (m->count == 0)
            read_length(log_path, seconds, &rate);
        void *grown = m->frames;
        const gbt_status status =
            mem_reserve(&grown, &m->capacity, m->count, m->count + 1, sizeof *m->frames, "frames", err);
        m->frames = grown;
        GBT_TRY(status);
        m->frames[m->count] = (frame_measure){.sharpness = frames_sharpness(m->picture, m->width, m->height),
                                              .change = change_of(m)};
        m->count++;
        const double total = *seconds * rate;
        log_count("frames, measuring", m->count, total >= (double)m->count ? (uint64_t)total : 0,
                  (double)NAN);
    }
}

static gbt_status measure_film(const job *j, measuring *m, double *seconds, gbt_error *err)
{
    char log_path[JOB_PATH_SIZE], filter[64], last[512];
    GBT_TRY(job_path(j, "measure.log", log_path, err));
    unlink(log_path);
    snprintf(filter, sizeof filter, "scale=%d:-2:flags=area,format=gray", FRAMES_WIDTH);
    const char *const arguments[] = {
        "ffmpeg", "-hide_banner", "-nostdin",    "-nostats", "-i",         j->source, "-map", "0:v:0",  "-vf",
        filter,   "-fps_mode",    "passthrough", "-f",       "image2pipe", "-c:v",    "pgm",  "pipe:1", NULL};
    GBT_TRY(child_start(&m->ffmpeg, arguments, log_path, false, err));
    const gbt_status status = measure(m, log_path, seconds, err);
    if (status != GBT_OK) {
        child_kill(&m->ffmpeg);
        return status;
    }
    last_line(log_path, last, sizeof last);
    GBT_TRY(child_end(&m->ffmpeg, last, err));
    return m->count >= 3 ? GBT_OK
                         : base_fail(err, GBT_ERR_FORMAT, "%s: a film of %zu frames (wanted 3 or more)",
                                     j->source, m->count);
}

/* ---- decoding the chosen frames ---- */

typedef struct decoding {
    uint64_t done, total;
} decoding;

static void hear_frame(const char *line, void *context)
{
    decoding *d = context;
    unsigned long long frame;
    if (sscanf(line, "frame=%llu", &frame) == 1 && frame > d->done && frame <= d->total) {
        d->done = frame;
        log_count("frames, decoding", d->done, d->total, (double)NAN);
    }
}

/* folder/frame_%05d.jpg for ffmpeg; a % in the folder's name is doubled. */
static gbt_status pattern_of(const char *folder, char out[JOB_PATH_SIZE], gbt_error *err)
{
    size_t used = 0;
    for (const char *at = folder; *at != '\0' && used + 32 < JOB_PATH_SIZE; at++) {
        out[used++] = *at;
        if (*at == '%')
            out[used++] = '%';
    }
    if (used + 32 >= JOB_PATH_SIZE)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", folder);
    snprintf(out + used, JOB_PATH_SIZE - used, "/frame_%%05d.jpg");
    return GBT_OK;
}

/* The filter select='eq(n,3)+eq(n,9)+...' for the chosen frames. */
static gbt_status select_filter(const size_t *chosen, size_t count, sink *out)
{
    sink_put_text(out, "select='");
    for (size_t i = 0; i < count; i++) {
        char term[40];
        snprintf(term, sizeof term, "%seq(n,%zu)", i > 0 ? "+" : "", chosen[i]);
        sink_put_text(out, term);
    }
    sink_put_text(out, "'");
    sink_put(out, "", 1);
    return out->status;
}

static gbt_status count_frames(const char *folder, size_t wanted, gbt_error *err)
{
    for (size_t i = 1; i <= wanted; i++) {
        char name[32], path[JOB_PATH_SIZE];
        snprintf(name, sizeof name, "frame_%05zu.jpg", i);
        GBT_TRY(file_join(path, sizeof path, folder, name, err));
        if (!file_exists(path))
            return base_fail(err, GBT_ERR_IO, "ffmpeg: wrote %zu of %zu frames to %s", i - 1, wanted, folder);
    }
    return GBT_OK;
}

static gbt_status decode(const job *j, const size_t *chosen, size_t count, gbt_error *err)
{
    char log_path[JOB_PATH_SIZE], part[JOB_PATH_SIZE], pattern[JOB_PATH_SIZE];
    sink filter = {.err = err};
    decoding d = {.total = count};
    GBT_TRY(job_path(j, "frames.log", log_path, err));
    GBT_TRY(job_path(j, "frames", part, err));
    GBT_TRY(pattern_of(part, pattern, err));
    unlink(log_path);
    job_remove_folder(part);
    GBT_TRY(file_make_folder(part, err));
    gbt_status status = select_filter(chosen, count, &filter);
    const char *const arguments[] = {
        "ffmpeg",    "-hide_banner", "-nostdin", "-nostats", "-i",
        j->source,   "-map",         "0:v:0",    "-vf",      (const char *)filter.bytes,
        "-fps_mode", "passthrough",  "-q:v",     "2",        "-progress",
        "pipe:1",    pattern,        NULL};
    if (status == GBT_OK)
        status = child_run(arguments, log_path, hear_frame, &d, err);
    sink_free(&filter);
    if (status == GBT_OK)
        status = count_frames(part, count, err);
    if (status == GBT_OK && rename(part, j->images) != 0)
        status = base_fail(err, GBT_ERR_IO, "%s: cannot replace: %s", j->images, strerror(errno));
    return status;
}

gbt_status film_to_photos(const job *j, gbt_error *err)
{
    double seconds = 0;
    measuring *m = mem_calloc(1, sizeof *m, "frames", err);
    if (m == NULL)
        return GBT_ERR_NO_MEMORY;
    size_t *chosen = NULL;
    gbt_status status = measure_film(j, m, &seconds, err);
    double wanted = j->def.frames;
    if (j->def.frames == 0)
        wanted = fmin(fmax(frames_a_second * seconds, FRAMES_LEAST), FRAMES_MOST);
    const size_t count = (size_t)wanted < m->count ? (size_t)wanted : m->count;
    if (status == GBT_OK && (chosen = mem_alloc(count, sizeof *chosen, "frames", err)) == NULL)
        status = GBT_ERR_NO_MEMORY;
    if (status == GBT_OK) {
        frames_choose(m->frames, m->count, count, chosen);
        log_info("%s: %zu of %zu frames chosen, sharp ones spread over time and movement", j->source, count,
                 m->count);
        status = decode(j, chosen, count, err);
    }
    mem_free(chosen);
    mem_free(m->frames);
    mem_free(m->picture);
    mem_free(m);
    return status;
}
