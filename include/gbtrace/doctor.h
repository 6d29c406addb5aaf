/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/doctor.h -- check that this build works on this machine. */
#ifndef GBTRACE_DOCTOR_H
#define GBTRACE_DOCTOR_H

#include "gbtrace/api.h"
#include "gbtrace/status.h"

GBT_API_BEGIN

typedef enum gbt_check_level { GBT_CHECK_OK, GBT_CHECK_WARN, GBT_CHECK_FAIL } gbt_check_level;

/** The result of one check: what was found, and what to do about it. */
typedef struct gbt_check {
    const char *name; /* static */
    gbt_check_level level;
    char found[400];
    char advice[200]; /* what to do; "" when there is nothing to do */
} gbt_check;

enum { GBT_DOCTOR_MAX = 24 };

typedef struct gbt_diagnosis {
    int count;
    gbt_check checks[GBT_DOCTOR_MAX];
} gbt_diagnosis;

/**
 * Check version, processor, threads, memory, libraries and the working folder, and compare the tracer and its
 * adjoint on a small scene with their double-precision references.
 *
 * @param folder [in]  where runs will be written; checked for write permission and free space
 * @param out    [out] overwritten; complete even when a check fails
 * @return GBT_OK, also when checks failed; GBT_ERR_NO_MEMORY
 *
 * Threads: uses all that gbt_set_threads() allows. Cost: some seconds, and a small file in `folder`, which is
 * removed.
 */
gbt_status gbt_doctor(const char *folder, gbt_diagnosis *out, gbt_error *err);

GBT_API_END
#endif
