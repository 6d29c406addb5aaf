/* SPDX-License-Identifier: Apache-2.0 */
/* io/float_code.c -- losslessly codes floats and decodes them. */
#include "io/float_code.h"

#include <string.h>

#include "base/memory.h"

enum { BYTE_VALUES = 256 };

gbt_status floats_code(range_coder *c, float *values, size_t rows, size_t columns, gbt_error *err)
{
    /* The context of the first byte is the column, that of the second byte is the first byte. */
    const size_t trees = columns + BYTE_VALUES;
    coder_bit_model(*tree)[BYTE_VALUES] = mem_alloc(trees, sizeof *tree, "float contexts", err);
    if (tree == NULL)
        return GBT_ERR_NO_MEMORY;
    coder_bits_start(tree[0], trees * BYTE_VALUES);
    for (size_t i = 0; i < rows * columns; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        const uint32_t first = coder_tree(c, tree[i % columns], 8, bits >> 24);
        const uint32_t second = coder_tree(c, tree[columns + first], 8, bits >> 16 & 0xFF);
        bits = first << 24 | second << 16 | coder_plain(c, 16, bits & 0xFFFF);
        memcpy(&values[i], &bits, sizeof bits);
    }
    mem_free(tree);
    return GBT_OK;
}
