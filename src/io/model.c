/* SPDX-License-Identifier: Apache-2.0 */
/* io/model.c -- frees a model. */
#include "io/model.h"

#include <string.h>

#include "base/memory.h"

void model_free(model *m)
{
    anchors_free(&m->anchors);
    mem_free(m->anchor_pixel);
    decoder_free(&m->decoder);
    memset(m, 0, sizeof *m);
}
