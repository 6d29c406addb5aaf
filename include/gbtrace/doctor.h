/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/doctor.h -- check that this build works on this machine. */
#ifndef GBTRACE_DOCTOR_H
#define GBTRACE_DOCTOR_H

#include "gbtrace/api.h"
#include "gbtrace/status.h"

GBT_API_BEGIN

typedef enum gbt_check_level { GBT_CHECK_OK, GBT_CHECK_WARN, GBT_CHECK_FAIL } gbt_check_level;

/** One line of the doctor. */
typedef struct gbt_check {
    const char *name; /* static */
    gbt_check_level level;
    char found[400];
    char advice[200]; /* what to do; "" where nothing has to be done */
} gbt_check;

enum { GBT_DOCTOR_MAX = 24 };

typedef struct gbt_diagnosis {
    int count;
    gbt_check checks[GBT_DOCTOR_MAX];
} gbt_diagnosis;

/**
 * Look at version, processor, threads, memory, libraries, the folder to work in, and let the tracer
 * and its adjoint draw a small scene beside their double references.
 *
 * @param folder [in]  where runs shall be written: may we write there, is there room
 * @param out    [out] overwritten; whole even when a check fails
 * @return GBT_OK, also with checks that failed; GBT_ERR_NO_MEMORY
 *
 * Threads: uses all. Cost: some seconds; a small file in `folder`, which is removed.
 */
gbt_status gbt_doctor(const char *folder, gbt_diagnosis *out, gbt_error *err);

GBT_API_END
#endif
