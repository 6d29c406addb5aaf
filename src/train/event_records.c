/* SPDX-License-Identifier: Apache-2.0 */
/* train/event_records.c -- TensorBoard's protobuf messages, framed with lengths and checksums. */
#include "train/event_records.h"

#include <stdbool.h>
#include <string.h>
#include <time.h>

#include "base/memory.h"

enum {
    FRAME_HEAD = 12,
    FRAME_TAIL = 4,
    STEP_AT = 9, /* offset after the wall time, which is a tag byte and a double */
    PNG_HEADER = 24
};

/* Protobuf wire types. */
enum { WIRE_VARINT = 0, WIRE_DOUBLE = 1, WIRE_BYTES = 2, WIRE_FLOAT = 5 };

static uint32_t masked_crc(const unsigned char *bytes, size_t count)
{
    uint32_t crc = UINT32_MAX; /* CRC-32C, reflected polynomial 0x82f63b78 */
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1 ? 0x82f63b78u : 0);
    }
    crc = ~crc;
    return (crc >> 15 | crc << 17) + 0xa282ead8u;
}

static void put(event_records *r, const void *bytes, size_t count)
{
    if (r->status == GBT_OK)
        r->status = mem_reserve((void **)&r->bytes, &r->capacity, r->count, r->count + count, 1,
                                "TensorBoard events", NULL);
    if (r->status != GBT_OK || count == 0)
        return;
    memcpy(r->bytes + r->count, bytes, count);
    r->count += count;
}

static void put_varint(event_records *r, uint64_t value)
{
    unsigned char bytes[10];
    size_t count = 0;
    for (; value >= 0x80; value >>= 7)
        bytes[count++] = (unsigned char)(value | 0x80);
    bytes[count++] = (unsigned char)value;
    put(r, bytes, count);
}

static void put_key(event_records *r, unsigned field, unsigned wire) { put_varint(r, field << 3 | wire); }

static void put_bytes(event_records *r, unsigned field, const void *bytes, size_t count)
{
    put_key(r, field, WIRE_BYTES);
    put_varint(r, count);
    put(r, bytes, count);
}

/* Append `inner` to `r` as a field, and empty `inner`. */
static void put_message(event_records *r, unsigned field, event_records *inner)
{
    if (inner->status != GBT_OK)
        r->status = inner->status;
    put_bytes(r, field, inner->bytes, inner->count);
    inner->count = 0;
}

/* Numbers are written in the machine's byte order: every processor that Debian builds Embree for is
   little-endian, as is the file. */
static void begin_event(event_records *event, uint64_t step)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    const double seconds = (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
    put_key(event, 1, WIRE_DOUBLE);
    put(event, &seconds, sizeof seconds);
    put_key(event, 2, WIRE_VARINT);
    put_varint(event, step);
}

/* Append `event` to `r` with its frame, completely or not at all, and free it. */
static void end_event(event_records *r, event_records *event)
{
    const uint64_t length = event->count;
    const size_t before = r->count;
    const uint32_t length_crc = masked_crc((const unsigned char *)&length, sizeof length),
                   crc = masked_crc(event->bytes, event->count);
    if (event->status != GBT_OK)
        r->status = event->status;
    put(r, &length, sizeof length);
    put(r, &length_crc, sizeof length_crc);
    put(r, event->bytes, event->count);
    put(r, &crc, sizeof crc);
    if (r->status != GBT_OK)
        r->count = before;
    event_records_free(event);
}

void event_add_version(event_records *r)
{
    static const char version[] = "brain.Event:2";
    event_records event = {0};
    begin_event(&event, 0);
    put_bytes(&event, 3, version, sizeof version - 1);
    end_event(r, &event);
}

void event_add_start(event_records *r, uint64_t step)
{
    event_records event = {0}, session = {0};
    begin_event(&event, step);
    put_key(&session, 1, WIRE_VARINT);
    put_varint(&session, 1); /* START */
    put_message(&event, 7, &session);
    end_event(r, &event);
    event_records_free(&session);
}

void event_add_scalars(event_records *r, uint64_t step, const event_scalar *scalars, size_t count)
{
    event_records event = {0}, summary = {0}, value = {0};
    begin_event(&event, step);
    for (size_t i = 0; i < count; i++) {
        const float number = (float)scalars[i].value;
        put_bytes(&value, 1, scalars[i].tag, strlen(scalars[i].tag));
        put_key(&value, 2, WIRE_FLOAT);
        put(&value, &number, sizeof number);
        put_message(&summary, 1, &value);
    }
    put_message(&event, 5, &summary);
    end_event(r, &event);
    event_records_free(&summary);
    event_records_free(&value);
}

/* Big-endian, as in PNG. */
static uint32_t read_png_number(const unsigned char *bytes)
{
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

void event_add_png(event_records *r, uint64_t step, const char *tag, const unsigned char *png, size_t size)
{
    if (size < PNG_HEADER || memcmp(png + 12, "IHDR", 4) != 0)
        return;
    event_records event = {0}, summary = {0}, value = {0}, picture = {0};
    const uint64_t numbers[] = {read_png_number(png + 20), read_png_number(png + 16), 3}; /* height, width,
                                                                                             colours */
    begin_event(&event, step);
    for (unsigned i = 0; i < 3; i++) {
        put_key(&picture, i + 1, WIRE_VARINT);
        put_varint(&picture, numbers[i]);
    }
    put_bytes(&picture, 4, png, size);
    put_bytes(&value, 1, tag, strlen(tag));
    put_message(&value, 4, &picture);
    put_message(&summary, 1, &value);
    put_message(&event, 5, &summary);
    end_event(r, &event);
    event_records_free(&summary);
    event_records_free(&value);
    event_records_free(&picture);
}

/* Read the step of an event that this file wrote; false for any other event. */
static bool read_step(const unsigned char *event, size_t count, uint64_t *step)
{
    if (count < STEP_AT + 2 || event[0] != (1 << 3 | WIRE_DOUBLE) || event[STEP_AT] != (2 << 3 | WIRE_VARINT))
        return false;
    *step = 0;
    for (size_t i = STEP_AT + 1, shift = 0; i < count && shift < 64; i++, shift += 7) {
        *step |= (uint64_t)(event[i] & 0x7f) << shift;
        if (event[i] < 0x80)
            return true;
    }
    return false;
}

size_t event_records_until(const unsigned char *bytes, size_t count, uint64_t step)
{
    size_t at = 0;
    while (count - at >= FRAME_HEAD + FRAME_TAIL) {
        uint64_t length, event_step;
        uint32_t length_crc, crc;
        memcpy(&length, bytes + at, sizeof length);
        memcpy(&length_crc, bytes + at + sizeof length, sizeof length_crc);
        const unsigned char *event = bytes + at + FRAME_HEAD;
        if (masked_crc(bytes + at, sizeof length) != length_crc ||
            length > count - at - FRAME_HEAD - FRAME_TAIL)
            break;
        memcpy(&crc, event + length, sizeof crc);
        if (masked_crc(event, length) != crc || !read_step(event, length, &event_step) || event_step > step)
            break;
        at += FRAME_HEAD + length + FRAME_TAIL;
    }
    return at;
}

void event_records_free(event_records *r)
{
    mem_free(r->bytes);
    *r = (event_records){0};
}
