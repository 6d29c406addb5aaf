/* SPDX-License-Identifier: Apache-2.0 */
/* train/near_distance.c -- near distances from the depths of sparse points in the photos. */
#include "train/near_distance.h"

#include <math.h>
#include <stdlib.h>

#include "base/compare.h"
#include "base/memory.h"
#include "train/rules.h"

enum { NEARER_VIEWS = 20 /* one view in this many may be nearer to the scene */ };

float near_of_view(float t_near, const gbt_train_def *def, const scene_view *view)
{
    const double share = train_rules_of(def).near_depth == 0 ? def->near : 0;
    return share > 0 && view->nearest > 0 ? fminf(t_near, (float)(share * view->nearest)) : t_near;
}

gbt_status near_of_scene(const scene *s, const size_t *views, size_t count, double share, float *out,
                         gbt_error *err)
{
    double *nearest = mem_alloc(count, sizeof *nearest, "nearest points", err);
    if (nearest == NULL)
        return GBT_ERR_NO_MEMORY;
    size_t known = 0;
    for (size_t i = 0; i < count; i++)
        if (s->views[views[i]].nearest > 0)
            nearest[known++] = s->views[views[i]].nearest;
    qsort(nearest, known, sizeof *nearest, compare_doubles);
    *out = known > 0 ? (float)(share * nearest[known / NEARER_VIEWS]) : 0;
    mem_free(nearest);
    return GBT_OK;
}
