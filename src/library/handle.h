/* SPDX-License-Identifier: Apache-2.0 */
/* library/handle.h -- the struct behind the public handle gbt_model. */
#ifndef GBT_LIBRARY_HANDLE_H
#define GBT_LIBRARY_HANDLE_H

#include <string.h>

#include "gbtrace/model.h"
#include "run/loaded_run.h"

struct gbt_model {
    loaded_run run;
    trace_settings settings; /* as the caller changed them; those of `run` stay as opened */
    char path[4096];         /* file it was opened from; empty: made from arrays */
    float *quat_length; /* [run.cloud.count] lengths of the caller's quaternions before normalization; NULL:
                           all 1 */
    unsigned char *raised;   /* [run.cloud.count] bit k: the caller's scale_log[k] was too small and has been
                                raised */
    bool kept;               /* the last render was kept, so that it can be differentiated */
    gaussian_cloud gradient; /* scratch for the gradient of run.cloud; its mean is not used */
    float *d_mean;           /* [run.cloud.count][3] */
};

/* For optional outputs: NULL is skipped. */
static inline void copy_floats(const float *from, size_t count, float *to)
{
    if (to != NULL)
        memcpy(to, from, count * sizeof *to);
}

#endif
