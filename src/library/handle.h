/* SPDX-License-Identifier: Apache-2.0 */
/* library/handle.h -- what is behind a gbt_model. */
#ifndef GBT_LIBRARY_HANDLE_H
#define GBT_LIBRARY_HANDLE_H

#include <string.h>

#include "gbtrace/model.h"
#include "run/loaded_run.h"

struct gbt_model {
    loaded_run run;
    trace_settings settings; /* the caller's; those of `run` stay as it was opened */
    char path[4096];         /* that it was opened from; empty: of arrays */
    float *quat_length;      /* [run.cloud.count] of the quaternions that the caller gave; NULL: all 1 */
    unsigned char *raised;   /* [run.cloud.count] bit k: the given scale_log[k] is below what is drawn */
    bool kept;               /* the last render can be differentiated */
    gaussian_cloud gradient; /* room for that of run.cloud; its mean is not used */
    float *d_mean;           /* [run.cloud.count][3] */
};

/* For the caller's arrays: NULL is not wanted. */
static inline void copy_floats(const float *from, size_t count, float *to)
{
    if (to != NULL)
        memcpy(to, from, count * sizeof *to);
}

#endif
