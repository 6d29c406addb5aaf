/* SPDX-License-Identifier: Apache-2.0 */
/* io/range_coder.h -- an adaptive binary range coder with context mixing (Witten 1987; mixing: Mahoney 2005).
   The same calls write and read, so writer and reader cannot get out of step.

   All arithmetic is in integers: the same bits on every machine. A reader takes zeros behind the end of its
   bytes and counts them; every call ends after a bounded number of steps, whatever the bytes are. Format:
   docs/compression.md, "Range coder". */
#ifndef GBT_IO_RANGE_CODER_H
#define GBT_IO_RANGE_CODER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

enum { CODER_INPUTS = 3, CODER_STRETCH_SIZE = 4096, CODER_INT_BINS = 128, CODER_INT_MAX = (1 << 30) - 1 };

typedef struct range_coder {
    bool reading;
    uint32_t range;
    /* writing */
    uint64_t low;
    uint8_t held;         /* the last byte, held back because a carry may still change it */
    uint64_t held_count;  /* that byte, and the bytes of 255 after it */
    unsigned char *bytes; /* owned when writing, borrowed when reading */
    size_t size, capacity;
    gbt_status status; /* when writing: GBT_ERR_NO_MEMORY after a failure */
    /* reading */
    uint32_t code;
    size_t at, beyond;                   /* bytes consumed, and zeros taken behind the end */
    int16_t stretch[CODER_STRETCH_SIZE]; /* ln(p / (1 - p)) in 1/256, indexed by p in 1/4096 */
} range_coder;

/** The probability of a 1 in one context. {0} is not a valid start: use coder_bits_start(). */
typedef struct coder_bit_model {
    uint16_t p; /* probability of a 1, in 1/65536 */
    uint8_t seen;
} coder_bit_model;

/** The weight of each input of a mixed bit, in 1/65536. */
typedef struct coder_mixer {
    int32_t weight[CODER_INPUTS];
} coder_mixer;

/** The contexts for one kind of integer. */
typedef struct coder_int_model {
    coder_bit_model bin[CODER_INT_BINS];
} coder_int_model;

typedef struct coder_int_mixer {
    coder_mixer bin[CODER_INT_BINS];
} coder_int_mixer;

void coder_bits_start(coder_bit_model *models, size_t count);
void coder_ints_start(coder_int_model *models, size_t count);
void coder_mixers_start(coder_mixer *mixers, size_t count);

void coder_write_start(range_coder *c);

/** Start reading. `bytes` are borrowed until the coder is no longer used. */
void coder_read_start(range_coder *c, const unsigned char *bytes, size_t size);

/** Finish writing: c->bytes and c->size are the result (free with coder_free()). GBT_ERR_NO_MEMORY if a byte
    could not be stored. */
gbt_status coder_write_end(range_coder *c, gbt_error *err);

/** Whether reading has consumed exactly the bytes that were given. */
bool coder_read_whole(const range_coder *c);

void coder_free(range_coder *c);

/** Write or read one bit that is 1 with probability p / 65536, 0 < p < 65536. When writing, `bit` is coded;
    when reading it is ignored. Returns the bit. */
int coder_bit(range_coder *c, uint32_t p, int bit);

/** One bit with the probability of one context. */
int coder_adaptive(range_coder *c, coder_bit_model *m, int bit);

/** One bit with the mixed probability of CODER_INPUTS different contexts. */
int coder_mixed(range_coder *c, coder_bit_model *const models[CODER_INPUTS], coder_mixer *mixer, int bit);

/** `count` <= 32 bits with probability 1/2 each, the highest first. */
uint32_t coder_plain(range_coder *c, int count, uint32_t value);

/** A number below 2^count, bit by bit through a binary tree of contexts, [2^count]. */
uint32_t coder_tree(range_coder *c, coder_bit_model *tree, int count, uint32_t value);

/**
 * An integer with CODER_INPUTS mixed contexts: whether it is zero, its sign, the position of its highest bit,
 * and the bits below.
 *
 * @param models [in,out] [CODER_INPUTS], all different
 * @param value  [in] |value| <= CODER_INT_MAX; not used when reading
 */
int32_t coder_int(range_coder *c, coder_int_model *const models[CODER_INPUTS], coder_int_mixer *mixer,
                  int32_t value);

/** An integer with one context. */
int32_t coder_int_alone(range_coder *c, coder_int_model *model, int32_t value);

#endif
