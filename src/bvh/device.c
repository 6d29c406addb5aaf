/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/device.c -- the one Embree device of the process: made once, errors in words, memory counted. */
#include "bvh/device.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/types.h>

#include "base/cpu.h"
#include "base/fail.h"
#include "base/parallel.h"
#include "bvh/embree_api.h"

static pthread_once_t made_once = PTHREAD_ONCE_INIT;
static RTCDevice device;
static enum RTCError creation_error;
static char version[32];

static atomic_llong bytes_held;
static atomic_llong bytes_allowed = INT64_MAX;

/* Embree reports on the thread that called it, so the text waits here for bvh_check() on the same thread. */
static _Thread_local char complaint[256];

static void remember_complaint(void *user, enum RTCError code, const char *text)
{
    (void)user;
    (void)code;
    if (complaint[0] == '\0')
        snprintf(complaint, sizeof complaint, "%s", text != NULL ? text : "");
}

/* Embree calls this before it allocates, or right after (post); freed memory comes as negative bytes. An
   allocation that was refused before it was made is never reported as freed. */
static bool watch_memory(void *user, ssize_t bytes, bool post)
{
    (void)user;
    const long long held = atomic_fetch_add(&bytes_held, bytes) + bytes;
    if (bytes <= 0 || held <= atomic_load(&bytes_allowed))
        return true;
    if (!post)
        atomic_fetch_sub(&bytes_held, bytes);
    return false;
}

static const char *configuration(void)
{
    /* The limit GBT_ISA holds for Embree's kernels, too: a run that must not use wide vectors must not get
       them from here. */
#if defined(__x86_64__)
    if (cpu_best_isa() == CPU_PLAIN)
        return "max_isa=sse4.2";
    if (cpu_best_isa() == CPU_AVX2)
        return "max_isa=avx2";
#endif
    return NULL;
}

static void make_device(void)
{
    snprintf(version, sizeof version, "%s", RTC_VERSION_STRING);
    parallel_threads(); /* finds how many can start, before Embree's tasks run on them */
    device = rtcNewDevice(configuration());
    if (device == NULL) {
        creation_error = rtcGetDeviceError(NULL);
        return;
    }
    rtcSetDeviceErrorFunction(device, remember_complaint, NULL);
    rtcSetDeviceMemoryMonitorFunction(device, watch_memory, NULL);
    snprintf(version, sizeof version, "%d.%d.%d",
             (int)rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION_MAJOR),
             (int)rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION_MINOR),
             (int)rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION_PATCH));
}

static const char *error_name(enum RTCError code)
{
    switch (code) {
    case RTC_ERROR_NONE:
        return "no reason given";
    case RTC_ERROR_INVALID_ARGUMENT:
        return "invalid argument";
    case RTC_ERROR_INVALID_OPERATION:
        return "invalid operation";
    case RTC_ERROR_OUT_OF_MEMORY:
        return "out of memory";
    case RTC_ERROR_UNSUPPORTED_CPU:
        return "this processor is not supported";
    case RTC_ERROR_CANCELLED:
        return "cancelled";
    default:
        return "unknown error";
    }
}

static gbt_status error_status(enum RTCError code)
{
    return code == RTC_ERROR_OUT_OF_MEMORY ? GBT_ERR_NO_MEMORY : GBT_ERR_INTERNAL;
}

void *bvh_device(gbt_error *err)
{
    pthread_once(&made_once, make_device);
    if (device == NULL)
        base_fail(err, error_status(creation_error), "embree: no device: %s", error_name(creation_error));
    return device;
}

gbt_status bvh_check(const char *what, gbt_error *err)
{
    if (bvh_device(err) == NULL)
        return error_status(creation_error);
    const enum RTCError code = rtcGetDeviceError(device);
    if (code == RTC_ERROR_NONE)
        return GBT_OK;
    /* When oneTBB cannot allocate within Embree, it is an unknown error with the name of the exception. */
    const bool memory = strstr(complaint, "bad_alloc") != NULL;
    const gbt_status status =
        base_fail(err, memory ? GBT_ERR_NO_MEMORY : error_status(code), "%s: embree: %s%s%s", what,
                  error_name(code), complaint[0] != '\0' ? ": " : "", complaint);
    complaint[0] = '\0';
    return status;
}

const char *bvh_embree_version(void)
{
    bvh_device(NULL);
    return version;
}

size_t bvh_memory_bytes(void)
{
    const long long held = atomic_load(&bytes_held);
    return held > 0 ? (size_t)held : 0;
}

void bvh_limit_memory(size_t bytes)
{
    atomic_store(&bytes_allowed, bytes > INT64_MAX ? INT64_MAX : (long long)bytes);
}
