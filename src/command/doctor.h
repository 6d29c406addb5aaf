/* SPDX-License-Identifier: Apache-2.0 */
/* command/doctor.h -- how the doctor's checks write their lines. */
#ifndef GBT_COMMAND_DOCTOR_H
#define GBT_COMMAND_DOCTOR_H

#include <stddef.h>

#include "gbtrace/doctor.h"

/** The next line, with level ok. The caller writes its texts. */
static inline gbt_check *doctor_line(gbt_diagnosis *d, const char *name)
{
    gbt_check *c = &d->checks[d->count < GBT_DOCTOR_MAX ? d->count++ : GBT_DOCTOR_MAX - 1];
    *c = (gbt_check){.name = name};
    return c;
}

/** A line about the self test: it fails beyond the limit, for NaN, and when more than half of the rays were
   left out. `what`: what the error is of. */
void doctor_compare(gbt_diagnosis *d, const char *name, const char *what, double error, double limit,
                    size_t rays, size_t left_out);

/** Tracer and adjoint against the double references on a procedural cloud; and how many rays go through a
    larger one in a second. */
gbt_status doctor_self_test(gbt_diagnosis *d, gbt_error *err);

#endif
