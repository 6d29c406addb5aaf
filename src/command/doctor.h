/* SPDX-License-Identifier: Apache-2.0 */
/* command/doctor.h -- lines of the report of gbtrace doctor, for the files that make the checks. */
#ifndef GBT_COMMAND_DOCTOR_H
#define GBT_COMMAND_DOCTOR_H

#include <stddef.h>

#include "gbtrace/doctor.h"

/** The next line, with level ok; the caller fills in its texts. */
static inline gbt_check *doctor_line(gbt_diagnosis *d, const char *name)
{
    gbt_check *c = &d->checks[d->count < GBT_DOCTOR_MAX ? d->count++ : GBT_DOCTOR_MAX - 1];
    *c = (gbt_check){.name = name};
    return c;
}

/** A line of the self-test. It fails if `error` exceeds `limit` or is NaN, or if more than half of the rays
    were left out. `what`: the quantity compared. */
void doctor_compare(gbt_diagnosis *d, const char *name, const char *what, double error, double limit,
                    size_t rays, size_t left_out);

/** Compare the tracer and its adjoint with the double-precision references on a procedural cloud, and measure
    the rays per second through a larger one. */
gbt_status doctor_self_test(gbt_diagnosis *d, gbt_error *err);

#endif
