/* SPDX-License-Identifier: Apache-2.0 */
/* query/handle.h -- the struct behind the handle gbt_balls. */
#ifndef GBT_QUERY_HANDLE_H
#define GBT_QUERY_HANDLE_H

#include "bvh/points.h"
#include "gbtrace/query.h"

struct gbt_balls {
    size_t count;
    double *position; /* [count][3] */
    double *radius;   /* [count]; NULL: points */
    bool anchors;
    point_tree *tree;
};

#endif
