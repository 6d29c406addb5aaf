/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode_raise.c -- raise opacities that have fallen below 0, where Gaussians have no gradient. */
#include "anchor/decode.h"

#include <math.h>

#include "anchor/decode_layout.h"

void decode_raise_opacity(const decode_tape *tape, float least, float opacity, decoder *d)
{
    decoder_network networks[DECODER_NETWORKS];
    decoder_networks(d, networks);
    const size_t offsets = (size_t)d->offset_count;
    float *bias = d->params + networks[DECODER_OPACITY].end - offsets;
    for (size_t k = 0; k < offsets && tape->visible_count > 0; k++) {
        double sum = 0;
        for (size_t v = 0; v < tape->visible_count; v++)
            sum += (double)tape->alpha[v * offsets + k];
        const double mean = sum / (double)tape->visible_count, lowest = -0.9999;
        if (mean < (double)least)
            bias[k] += (float)(atanh((double)opacity) - atanh(fmax(mean, lowest)));
    }
}
