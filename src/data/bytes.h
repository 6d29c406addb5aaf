/* SPDX-License-Identifier: Apache-2.0 */
/* data/bytes.h -- a bounds-checked cursor for all binary readers, and a growing buffer for all writers.

   No read leaves [0, size): a read past the end gives 0 and sets `short_read`. Readers call cursor_need()
   before each record, so that the error message names the record, and check counts with cursor_count_fits()
   before they allocate. Values are assembled from bytes with shifts, so the host's byte order does not
   matter. */
#ifndef GBT_DATA_BYTES_H
#define GBT_DATA_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"

/** A file in memory; `name` is for messages only. Functions only borrow it. */
typedef struct source_file {
    const char *name;
    const unsigned char *bytes;
    size_t size;
} source_file;

typedef struct cursor {
    const source_file *file;
    size_t at;
    bool short_read;
} cursor;

static inline size_t cursor_left(const cursor *c) { return c->file->size - c->at; }

/** Fails when fewer than `byte_count` bytes are left; the message gives the offset and both sizes. */
static inline gbt_status cursor_need(const cursor *c, size_t byte_count, const char *what, gbt_error *err)
{
    if (cursor_left(c) >= byte_count)
        return GBT_OK;
    return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: file ends inside %s (wanted %zu more bytes, got %zu)",
                     c->file->name, c->at, what, byte_count, cursor_left(c));
}

/** True when the remaining bytes can hold `count` records of at least `record_bytes` (> 0). */
static inline bool cursor_count_fits(const cursor *c, uint64_t count, size_t record_bytes)
{
    return count <= cursor_left(c) / record_bytes;
}

static inline bool cursor_skip(cursor *c, uint64_t byte_count)
{
    if (byte_count > cursor_left(c)) {
        c->short_read = true;
        return false;
    }
    c->at += (size_t)byte_count;
    return true;
}

/** The next 1..8 bytes as an unsigned number, little endian. */
static inline uint64_t cursor_uint(cursor *c, size_t byte_count)
{
    const size_t from = c->at;
    if (!cursor_skip(c, byte_count))
        return 0;
    uint64_t value = 0;
    for (size_t i = 0; i < byte_count; i++)
        value |= (uint64_t)c->file->bytes[from + i] << (8 * i);
    return value;
}

static inline uint32_t cursor_u32(cursor *c) { return (uint32_t)cursor_uint(c, 4); }

static inline uint64_t cursor_u64(cursor *c) { return cursor_uint(c, 8); }

static inline float cursor_f32(cursor *c)
{
    const uint32_t bits = cursor_u32(c);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static inline double cursor_f64(cursor *c)
{
    const uint64_t bits = cursor_uint(c, 8);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/** A growing output buffer. After the first failure `status` stays set and further puts do nothing. */
typedef struct sink {
    unsigned char *bytes; /* owned; free with sink_free() */
    size_t size, capacity;
    gbt_status status;
    gbt_error *err;
} sink;

static inline void sink_put(sink *s, const void *bytes, size_t byte_count)
{
    if (s->status != GBT_OK)
        return;
    void *grown = s->bytes;
    s->status =
        mem_reserve(&grown, &s->capacity, s->size, s->size + byte_count, 1, "file to be written", s->err);
    s->bytes = grown;
    if (s->status != GBT_OK || byte_count == 0)
        return;
    memcpy(s->bytes + s->size, bytes, byte_count);
    s->size += byte_count;
}

/** The low 1..8 bytes of `value`, little endian. */
static inline void sink_put_uint(sink *s, uint64_t value, size_t byte_count)
{
    unsigned char bytes[8];
    for (size_t i = 0; i < byte_count; i++)
        bytes[i] = (unsigned char)(value >> (8 * i));
    sink_put(s, bytes, byte_count);
}

static inline void sink_put_f64(sink *s, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    sink_put_uint(s, bits, 8);
}

static inline void sink_put_f32(sink *s, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    sink_put_uint(s, bits, 4);
}

/** Append `value` as a byte: rounded to the nearest integer (halves up) and clamped to [0, 255]; NaN becomes
    0. */
static inline void sink_put_level(sink *s, double value)
{
    sink_put_uint(s, value >= 255 ? 255 : value > 0 ? (uint64_t)(value + 0.5) : 0, 1);
}

static inline void sink_put_text(sink *s, const char *text) { sink_put(s, text, strlen(text)); }

static inline void sink_free(sink *s)
{
    mem_free(s->bytes);
    memset(s, 0, sizeof *s);
}

/** Write the buffer to a file atomically, and free it whether or not that succeeds. */
static inline gbt_status sink_write(sink *s, const char *path)
{
    const gbt_status status =
        s->status == GBT_OK ? file_write_atomic(path, s->bytes, s->size, s->err) : s->status;
    sink_free(s);
    return status;
}

#endif
