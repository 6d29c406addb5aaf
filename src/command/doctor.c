/* SPDX-License-Identifier: Apache-2.0 */
/* command/doctor.c -- the checks of the machine and of the build. */
#include "command/doctor.h"

#include <jansson.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "base/cpu.h"
#include "base/file.h"
#include "base/image.h"
#include "base/machine.h"
#include "base/parallel.h"
#include "base/plain_numbers.h"
#include "bvh/device.h"
#include "gbtrace/version.h"

/* Bytes. To warn: below a run on 100 small photos, or a few runs with checkpoints. To fail: too little to
   start at all, or for one run. */
static const double memory_warn = 2e9, memory_fail = 3e8;
static const double disk_warn = 2e9, disk_fail = 1e8;

static void advise(gbt_check *c, gbt_check_level level, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void advise(gbt_check *c, gbt_check_level level, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(c->advice, sizeof c->advice, format, args);
    va_end(args);
    c->level = level;
}

static const char build_kind[] =
#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
    "with a sanitizer";
#elif defined __OPTIMIZE__
    "optimised";
#else
    "not optimised";
#endif

static void check_version(gbt_diagnosis *d)
{
    gbt_check *c = doctor_line(d, "version");
    snprintf(c->found, sizeof c->found, "gbtrace %s, built by %s %s, %s", gbt_version(),
#ifdef __clang__
             "clang",
#else
             "gcc",
#endif
             __VERSION__, build_kind);
    if (strcmp(build_kind, "optimised") != 0)
        advise(c, GBT_CHECK_WARN,
               "many times slower than an optimised build: ./run build, or cmake -DCMAKE_BUILD_TYPE=Release");
}

static void check_processor(gbt_diagnosis *d, const machine *m)
{
    gbt_check *c = doctor_line(d, "processor");
    const cpu_isa isa = cpu_best_isa();
    const char *wanted = getenv("GBT_ISA");
    snprintf(c->found, sizeof c->found, "%s; kernels for %s",
             m->processor[0] != '\0' ? m->processor : "unknown", cpu_isa_name(isa));
    bool held = false;
    for (int i = (int)isa + 1; i < CPU_ISA_COUNT; i++)
        held = held || cpu_has_isa((cpu_isa)i);
    if (held && wanted != NULL)
        advise(c, GBT_CHECK_WARN, "GBT_ISA=%.20s holds the kernels back: unset it", wanted);
    else if (isa == CPU_PLAIN)
        advise(c, GBT_CHECK_WARN,
               "without NEON, or AVX2, FMA and F16C, everything is several times slower; the results are the "
               "same");
}

static void check_threads(gbt_diagnosis *d, const machine *m)
{
    gbt_check *c = doctor_line(d, "threads");
    const int threads = parallel_threads();
    size_t used = (size_t)snprintf(c->found, sizeof c->found, "%d of %d processors", threads, m->processors);
    if (m->processors_allowed < m->processors)
        used += (size_t)snprintf(c->found + used, sizeof c->found - used, "; %d are allowed to this process",
                                 m->processors_allowed);
    if (isfinite(m->processors_quota))
        snprintf(c->found + used, sizeof c->found - used, "; the control group gives the time of %.4g",
                 m->processors_quota);
    const int best = machine_threads(m);
    if (threads > best)
        advise(c, GBT_CHECK_WARN,
               "more threads than processor time only wait for each other: GBTRACE_THREADS=%d", best);
}

static void check_memory(gbt_diagnosis *d, const machine *m)
{
    gbt_check *c = doctor_line(d, "memory");
    const bool limited = m->memory_limit_bytes < m->memory_bytes;
    const double usable = fmin((double)m->memory_free_bytes, (double)m->memory_limit_bytes);
    if (m->memory_bytes == 0) {
        snprintf(c->found, sizeof c->found, "not known");
        return;
    }
    const size_t used = (size_t)snprintf(c->found, sizeof c->found, "%.1f GB, %.1f GB free",
                                         (double)m->memory_bytes / 1e9, (double)m->memory_free_bytes / 1e9);
    if (limited)
        snprintf(c->found + used, sizeof c->found - used, "; this process may have %.1f GB",
                 (double)m->memory_limit_bytes / 1e9);
    if (usable < memory_warn)
        advise(c, usable < memory_fail ? GBT_CHECK_FAIL : GBT_CHECK_WARN,
               "train with downscale 2 or more, or make room");
}

static void check_libraries(gbt_diagnosis *d)
{
    gbt_check *c = doctor_line(d, "libraries");
    gbt_error why = {0};
    snprintf(c->found, sizeof c->found, "Embree %s, %s, %s, jansson %s", bvh_embree_version(),
             image_library(), parallel_library(), jansson_version_str());
    if (bvh_device(&why) == NULL)
        advise(c, GBT_CHECK_FAIL, "Embree does not start: %.150s", why.text);
}

static void check_folder(gbt_diagnosis *d, const char *folder)
{
    gbt_check *c = doctor_line(d, "folder");
    char path[4096];
    struct statvfs space;
    gbt_error why = {0};
    gbt_status status = file_is_folder(folder) ? GBT_OK : GBT_ERR_IO;
    if (status != GBT_OK)
        snprintf(why.text, sizeof why.text, "%.300s: no such folder", folder);
    if (status == GBT_OK)
        status = file_join(path, sizeof path, folder, ".gbtrace-doctor", &why);
    if (status == GBT_OK)
        status = file_write_atomic(path, "written by gbtrace doctor\n", 26, &why);
    if (status != GBT_OK) {
        snprintf(c->found, sizeof c->found, "%.380s", why.text);
        advise(c, GBT_CHECK_FAIL, "name a folder that you may write to: gbtrace doctor FOLDER");
        return;
    }
    unlink(path);
    const double room =
        statvfs(folder, &space) == 0 ? (double)space.f_bavail * (double)space.f_frsize : (double)INFINITY;
    snprintf(c->found, sizeof c->found, "%.300s can be written, %.1f GB free", folder, room / 1e9);
    if (room < disk_warn)
        advise(c, room < disk_fail ? GBT_CHECK_FAIL : GBT_CHECK_WARN,
               "a run needs some hundred megabytes, for its checkpoints most: make room");
}

gbt_status gbt_doctor(const char *folder, gbt_diagnosis *out, gbt_error *err)
{
    PLAIN_NUMBERS;
    const machine m = machine_read("");
    *out = (gbt_diagnosis){0};
    check_version(out);
    check_processor(out, &m);
    check_threads(out, &m);
    check_memory(out, &m);
    check_libraries(out);
    check_folder(out, folder);
    return doctor_self_test(out, err);
}
