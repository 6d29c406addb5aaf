/* SPDX-License-Identifier: Apache-2.0 */
/* render/output_names.h -- names of the outputs beside colour, and parsing of lists of them. */
#ifndef GBT_RENDER_OUTPUT_NAMES_H
#define GBT_RENDER_OUTPUT_NAMES_H

#include "gbtrace/status.h"

typedef enum render_output {
    OUTPUT_TRANSMITTANCE,
    OUTPUT_DEPTH,
    OUTPUT_MEDIAN_DEPTH,
    OUTPUT_NORMAL,
    OUTPUT_HITS,
    OUTPUT_ANCHOR,
    OUTPUT_COUNT
} render_output;

extern const struct render_output_kind {
    const char *name;
    int channels;
} render_output_kinds[OUTPUT_COUNT];

/**
 * Parse a comma-separated list of: transmittance, depth, median-depth, normal, hits, anchor.
 *
 * @param list   [in]  NULL: none
 * @param wanted [out] one bit per output
 * @return GBT_OK, or GBT_ERR_ARGUMENT for an unknown name
 */
gbt_status render_outputs_parse(const char *list, unsigned *wanted, gbt_error *err);

#endif
