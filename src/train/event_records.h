/* SPDX-License-Identifier: Apache-2.0 */
/* train/event_records.h -- records of a TensorBoard event file, in memory.

   A file is a row of records: length (u64), its masked CRC-32C, that many bytes, their masked CRC-32C;
   little-endian. The bytes are a protobuf Event: 1 wall time (double), 2 step (varint), and one of 3 version
   (text), 5 summary, 7 session. */
#ifndef GBT_TRAIN_EVENT_RECORDS_H
#define GBT_TRAIN_EVENT_RECORDS_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

/* TensorBoard takes every file whose name holds "tfevents", in the order of names. */
#define EVENTS_TRAIN_NAME "events.out.tfevents.0.train"
#define EVENTS_EVAL_NAME "events.out.tfevents.1.eval"

/** Start from {0}; free with event_records_free(). Without memory a record is left out, and `status` says
    so. */
typedef struct event_records {
    unsigned char *bytes;
    size_t count, capacity;
    gbt_status status;
} event_records;

typedef struct event_scalar {
    const char *tag; /* "group/name" */
    double value;    /* kept as a float */
} event_scalar;

/** The record that every file starts with. */
void event_add_version(event_records *r);

/** A reader drops what it has of steps from `step` on: they come again. */
void event_add_start(event_records *r, uint64_t step);

void event_add_scalars(event_records *r, uint64_t step, const event_scalar *scalars, size_t count);

/** One picture, as the bytes of a PNG file; what is none is left out. */
void event_add_png(event_records *r, uint64_t step, const char *tag, const unsigned char *png, size_t size);

/** Length of the records at the start of `bytes` that are whole and undamaged, up to the first of a later
    step than `step`. */
size_t event_records_until(const unsigned char *bytes, size_t count, uint64_t step);

void event_records_free(event_records *r);

#endif
