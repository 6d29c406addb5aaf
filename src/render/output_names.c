/* SPDX-License-Identifier: Apache-2.0 */
/* render/output_names.c -- names of the outputs beside colour, and parsing of lists of them. */
#include "render/output_names.h"

#include <string.h>

#include "base/fail.h"

const struct render_output_kind render_output_kinds[OUTPUT_COUNT] = {
    {"transmittance", 1}, {"depth", 1}, {"median-depth", 1}, {"normal", 3}, {"hits", 1}, {"anchor", 1}};

gbt_status render_outputs_parse(const char *list, unsigned *wanted, gbt_error *err)
{
    *wanted = 0;
    for (const char *word = list; word != NULL;) {
        const size_t length = strcspn(word, ",");
        int i = 0;
        while (i < OUTPUT_COUNT && (strlen(render_output_kinds[i].name) != length ||
                                    strncmp(word, render_output_kinds[i].name, length) != 0))
            i++;
        if (i == OUTPUT_COUNT)
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "outputs: \"%.*s\" (wanted transmittance, depth, median-depth, normal, hits "
                             "or anchor, with commas between)",
                             length < 40 ? (int)length : 40, word);
        *wanted |= 1u << i;
        word = word[length] == ',' ? word + length + 1 : NULL;
    }
    return GBT_OK;
}
