/* SPDX-License-Identifier: Apache-2.0 */
/* io/range_coder.c -- the range coder: bytes with carry propagation, bits with adaptive probabilities, and
   integers as sequences of bits. */
#include "io/range_coder.h"

#include <string.h>

#include "base/fail.h"
#include "base/memory.h"

enum {
    RENORM = 1 << 24,
    P_LEAST = 64,   /* of 65536: the most probable bit still costs 0.0014 bits, so one byte cannot expand to
                       more than some thousand bits */
    SEEN_MAX = 250, /* the adaptation rate stops falling here, so that recent bits count for more */
    STRETCH_MAX = 2047, /* +-8.0 in 1/256 */
    LEARN_SHIFT = 14,
    BEYOND_MAX = 8, /* 4 bytes are read ahead, and up to 4 zeros are omitted at the end of writing */
    BIN_SIGN = 0,
    BIN_CLASS = 1, /* 1 .. 31: is the number in a higher class? */
    CLASS_MAX = 30,
    BIN_MANTISSA = BIN_CLASS + CLASS_MAX,
    MANTISSA_CLASSES = 13, /* classes 1 to 13 have contexts for their highest bits below the leading one */
    MANTISSA_BITS = 3
};

/* ---- bytes ---- */

static void put_byte(range_coder *c, uint8_t byte)
{
    if (c->status == GBT_OK && c->size == c->capacity)
        c->status =
            mem_reserve((void **)&c->bytes, &c->capacity, c->size, c->size + 4096, 1, "coded bytes", NULL);
    if (c->status == GBT_OK)
        c->bytes[c->size++] = byte;
}

/* Output the highest byte of `low`. It is held back as long as a later carry could still change it, that is
   while only bytes of 255 follow it. */
static void shift_low(range_coder *c)
{
    if (c->low < UINT64_C(0xFF000000) || c->low > UINT64_C(0xFFFFFFFF)) {
        const uint8_t carry = (uint8_t)(c->low >> 32);
        for (uint8_t byte = c->held; c->held_count > 0; c->held_count--, byte = 0xFF)
            put_byte(c, (uint8_t)(byte + carry));
        c->held = (uint8_t)(c->low >> 24);
    }
    c->held_count++;
    c->low = (c->low & 0xFFFFFF) << 8;
}

static uint8_t next_byte(range_coder *c)
{
    if (c->at < c->size)
        return c->bytes[c->at++];
    c->beyond++;
    return 0;
}

/* ---- probabilities ---- */

/* The logistic function 65536 / (1 + e^-x), x in 1/256, interpolated from a table with steps of 1/2. */
static int squash(int x)
{
    static const int32_t at[33] = {22,    36,    60,    98,    162,   267,   439,   720,   1179,
                                   1921,  3108,  4971,  7812,  11955, 17625, 24743, 32768, 40793,
                                   47911, 53581, 57724, 60565, 62428, 63615, 64357, 64816, 65097,
                                   65269, 65374, 65438, 65476, 65500, 65514};
    x = x < -STRETCH_MAX ? -STRETCH_MAX : x > STRETCH_MAX ? STRETCH_MAX : x;
    const int i = (x + 2048) >> 7, f = (x + 2048) & 127;
    return (int)((at[i] * (128 - f) + at[i + 1] * f) >> 7);
}

/* Tabulate the inverse of squash(), by walking along squash(). */
static void fill_stretch(int16_t stretch[CODER_STRETCH_SIZE])
{
    int next = 0;
    for (int x = -STRETCH_MAX; x <= STRETCH_MAX; x++)
        for (const int p = squash(x) >> 4; next <= p; next++)
            stretch[next] = (int16_t)x;
    for (; next < CODER_STRETCH_SIZE; next++)
        stretch[next] = STRETCH_MAX;
}

static uint32_t cut(int p)
{
    return (uint32_t)(p < P_LEAST ? P_LEAST : p > 65536 - P_LEAST ? 65536 - P_LEAST : p);
}

/* Move p towards the bit: at first p is the mean of all bits seen, later an exponentially weighted mean. */
static void learn(coder_bit_model *m, int bit)
{
    const int step = ((bit << 16) - (int)m->p - bit) * 2 / (2 * m->seen + 3);
    m->p = (uint16_t)(m->p + step);
    m->seen = (uint8_t)(m->seen < SEEN_MAX ? m->seen + 1 : SEEN_MAX);
}

void coder_bits_start(coder_bit_model *models, size_t count)
{
    for (size_t i = 0; i < count; i++)
        models[i] = (coder_bit_model){.p = 32768};
}

void coder_ints_start(coder_int_model *models, size_t count)
{
    for (size_t i = 0; i < count; i++)
        coder_bits_start(models[i].bin, CODER_INT_BINS);
}

void coder_mixers_start(coder_mixer *mixers, size_t count)
{
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < CODER_INPUTS; k++)
            mixers[i].weight[k] = 65536 * 2 / 5;
}

/* ---- start and end ---- */

void coder_write_start(range_coder *c)
{
    memset(c, 0, sizeof *c);
    c->range = UINT32_MAX;
    c->held_count = 1;
    fill_stretch(c->stretch);
}

void coder_read_start(range_coder *c, const unsigned char *bytes, size_t size)
{
    memset(c, 0, sizeof *c);
    c->reading = true;
    c->range = UINT32_MAX;
    c->bytes = (unsigned char *)(uintptr_t)bytes;
    c->size = size; /* `bytes` is only read from here on */
    fill_stretch(c->stretch);
    for (int i = 0; i < 4; i++)
        c->code = c->code << 8 | next_byte(c);
}

gbt_status coder_write_end(range_coder *c, gbt_error *err)
{
    /* Rounded up, but still within [low, low + range), so that it ends in three zero bytes. */
    c->low = (c->low + RENORM - 1) & ~(uint64_t)(RENORM - 1);
    for (int i = 0; i < 5; i++)
        shift_low(c);
    if (c->status != GBT_OK)
        return base_fail(err, c->status, "out of memory for coded bytes");
    c->size--; /* drop the first byte, the initial `held`, which is always 0 because no carry reaches it */
    memmove(c->bytes, c->bytes + 1, c->size);
    for (int i = 0; i < 4 && c->size > 0 && c->bytes[c->size - 1] == 0; i++)
        c->size--;
    return GBT_OK;
}

bool coder_read_whole(const range_coder *c) { return c->at == c->size && c->beyond <= BEYOND_MAX; }

void coder_free(range_coder *c)
{
    if (!c->reading)
        mem_free(c->bytes);
    memset(c, 0, sizeof *c);
}

/* ---- bits ---- */

int coder_bit(range_coder *c, uint32_t p, int bit)
{
    const uint32_t bound = (c->range >> 16) * p;
    if (c->reading)
        bit = c->code < bound;
    if (bit) {
        c->range = bound;
    } else {
        c->range -= bound;
        if (c->reading)
            c->code -= bound;
        else
            c->low += bound;
    }
    for (; c->range < RENORM; c->range <<= 8)
        if (c->reading)
            c->code = c->code << 8 | next_byte(c);
        else
            shift_low(c);
    return bit;
}

int coder_adaptive(range_coder *c, coder_bit_model *m, int bit)
{
    bit = coder_bit(c, cut(m->p), bit);
    learn(m, bit);
    return bit;
}

/* Mix the contexts' probabilities in the logistic domain, and update the weights by the gradient of the
   coding cost (Mahoney 2005). */
int coder_mixed(range_coder *c, coder_bit_model *const models[CODER_INPUTS], coder_mixer *mixer, int bit)
{
    int st[CODER_INPUTS];
    int64_t sum = 0;
    for (int i = 0; i < CODER_INPUTS; i++) {
        st[i] = c->stretch[models[i]->p >> 4];
        sum += (int64_t)mixer->weight[i] * st[i];
    }
    sum /= 65536;
    const int p = squash(sum < -STRETCH_MAX ? -STRETCH_MAX : sum > STRETCH_MAX ? STRETCH_MAX : (int)sum);
    bit = coder_bit(c, cut(p), bit);
    const int error = (bit << 16) - p;
    for (int i = 0; i < CODER_INPUTS; i++) {
        const int32_t w = mixer->weight[i] + (int32_t)((int64_t)st[i] * error / (1 << LEARN_SHIFT));
        mixer->weight[i] = w < -(1 << 20) ? -(1 << 20) : w > 1 << 20 ? 1 << 20 : w;
        learn(models[i], bit);
    }
    return bit;
}

uint32_t coder_plain(range_coder *c, int count, uint32_t value)
{
    uint32_t out = 0;
    for (int i = count - 1; i >= 0; i--)
        out = out << 1 | (uint32_t)coder_bit(c, 32768, (int)(value >> i & 1));
    return out;
}

uint32_t coder_tree(range_coder *c, coder_bit_model *tree, int count, uint32_t value)
{
    uint32_t node = 1;
    for (int i = count - 1; i >= 0; i--)
        node = node << 1 | (uint32_t)coder_adaptive(c, &tree[node], (int)(value >> i & 1));
    return node - (1u << count);
}

/* ---- integers ---- */

typedef struct int_contexts {
    coder_int_model *const *models;
    coder_int_mixer *mixer; /* NULL: models[0] alone */
} int_contexts;

static int int_bit(range_coder *c, const int_contexts *x, size_t bin, int bit)
{
    if (x->mixer == NULL)
        return coder_adaptive(c, &x->models[0]->bin[bin], bit);
    coder_bit_model *bits[CODER_INPUTS];
    for (int i = 0; i < CODER_INPUTS; i++)
        bits[i] = &x->models[i]->bin[bin];
    return coder_mixed(c, bits, &x->mixer->bin[bin], bit);
}

/* Class n holds the magnitudes 2^n - 1 .. 2^(n+1) - 2; class 0 is zero. */
static int32_t code_int(range_coder *c, const int_contexts *x, int32_t value)
{
    const uint32_t magnitude = (uint32_t)(value < 0 ? -value : value) + 1;
    const int own = 31 - __builtin_clz(magnitude);
    int magnitude_class = 0;
    while (magnitude_class < CLASS_MAX &&
           int_bit(c, x, (size_t)(BIN_CLASS + magnitude_class), magnitude_class < own))
        magnitude_class++;
    if (magnitude_class == 0)
        return 0;
    uint32_t out = 1;
    int left = magnitude_class;
    for (int k = 0; k < MANTISSA_BITS && left > 0 && magnitude_class <= MANTISSA_CLASSES; k++) {
        left--;
        const size_t node = out - 1; /* 0; 1, 2; 3 .. 6 */
        out = out << 1 |
              (uint32_t)int_bit(c, x, (size_t)BIN_MANTISSA + (size_t)(magnitude_class - 1) * 7 + node,
                                (int)(magnitude >> left & 1));
    }
    out = (uint32_t)((uint64_t)out << left) |
          coder_plain(c, left, left > 0 ? magnitude & ((1u << left) - 1) : 0);
    const int32_t size = out - 1 > CODER_INT_MAX ? CODER_INT_MAX : (int32_t)(out - 1);
    return int_bit(c, x, BIN_SIGN, value < 0) ? -size : size;
}

int32_t coder_int(range_coder *c, coder_int_model *const models[CODER_INPUTS], coder_int_mixer *mixer,
                  int32_t value)
{
    return code_int(c, &(int_contexts){models, mixer}, value);
}

int32_t coder_int_alone(range_coder *c, coder_int_model *model, int32_t value)
{
    return code_int(c, &(int_contexts){&model, NULL}, value);
}
