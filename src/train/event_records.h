/* SPDX-License-Identifier: Apache-2.0 */
/* train/event_records.h -- records of a TensorBoard event file, in memory.

   A file is a sequence of records: length (u64), its masked CRC-32C, that many bytes, their masked CRC-32C;
   little-endian. The bytes are a protobuf Event: 1 wall time (double), 2 step (varint), and one of 3 version
   (text), 5 summary, 7 session. */
#ifndef GBT_TRAIN_EVENT_RECORDS_H
#define GBT_TRAIN_EVENT_RECORDS_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

/* TensorBoard reads every file whose name contains "tfevents", in the order of names. */
#define EVENTS_TRAIN_NAME "events.out.tfevents.0.train"
#define EVENTS_EVAL_NAME "events.out.tfevents.1.eval"

/** Start from {0}; free with event_records_free(). When memory runs out a record is left out, and `status`
    says so. */
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

/** Tell readers to drop the events of all steps from `step` on, because they will be written again. */
void event_add_start(event_records *r, uint64_t step);

void event_add_scalars(event_records *r, uint64_t step, const event_scalar *scalars, size_t count);

/** One image, as the bytes of a PNG file; anything else is left out. */
void event_add_png(event_records *r, uint64_t step, const char *tag, const unsigned char *png, size_t size);

/** Number of bytes at the start of `bytes` that are complete, undamaged records, up to the first record of a
    step after `step`. */
size_t event_records_until(const unsigned char *bytes, size_t count, uint64_t step);

void event_records_free(event_records *r);

#endif
